"""The studio in a real Chromium: what a visitor sees and does.

`RAMSIGHT_PICTURES=docs/images pytest tests/test_studio_browser.py tests/test_studio_visits.py` renews the pictures of
docs/how-to/studio.md.
"""

import contextlib
import json
import math
import re
import socket
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import psutil
import pytest
from typer.testing import CliRunner

from ramsight.cli import app
from ramsight.histories.history_store import HistoryStore
from ramsight.histories.record import MachineKey

from .chromium import nothing, wrong_on
from .history_bench import life
from .studio_pages import (
    FIXTURES,
    TRACES,
    answered,
    newest,
    of_a_user,
    picture,
    runs,
    studio,
    wait,
    workers,
)
from .waiting import PATIENCE

pytestmark = pytest.mark.slow

pytest.importorskip("nicegui", reason="needs the extra studio")

browser, loader, visitor, page = FIXTURES
TOGETHER = "['time', 'position'].map((one) => studio.units.boom[one].at(-1))"  # of one sample


def test_the_lever_moves_the_boom_and_the_estimate_follows_within_the_band(page):
    wait(page, lambda: newest(page, "position") is not None)
    before = newest(page, "position")
    page.get_by_role("button", name="lift boom").click()
    wait(page, lambda: newest(page, "position") > before + 60.0)
    kept = page.evaluate("studio.units.boom")
    off = [
        (error, band)
        for error, band in zip(kept["kalman_error"], kept["kalman_band"], strict=True)
        if abs(error) > band + 1e-3
    ]
    assert off == []
    shown = page.evaluate("['now-true', 'now-kalman'].map((one) => +document.getElementById(one).innerText)")
    assert abs(shown[0] - shown[1]) < 5.0
    assert page.locator("#status-boom-kalman").inner_text() == "uncertain: reference due"  # no contact agrees yet
    picture(page, "studio-live.png")
    page.locator("[data-circuit=boom]").scroll_into_view_if_needed()  # what is not seen is not drawn
    wait(page, lambda: page.locator("[data-circuit=boom] g.open").count() > 0)
    page.get_by_role("button", name="stop boom").click()
    wait(page, lambda: newest(page, "speed") == 0.0)


SMALL = """() => {
    const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), found = [];
    while (walker.nextNode()) {
        const own = walker.currentNode.parentElement;
        if (!walker.currentNode.textContent.trim() || /SCRIPT|STYLE/.test(own.tagName)) continue;
        if (!own.checkVisibility({ visibilityProperty: true })) continue;
        const scale = own.closest('svg') && own.getScreenCTM ? own.getScreenCTM().a : 1;
        const size = scale * parseFloat(getComputedStyle(own).fontSize);
        if (size < 10.9) found.push([size, walker.currentNode.textContent.slice(0, 40)]);
    }
    return found;
}"""


SIZES = ((1400, 813), (1024, 768), (420, 800))


def test_a_new_page_plays_a_scenario_and_says_of_every_sensor_where_it_is_without_scrolling(page, loader):
    address, _ = loader
    page.goto(address)
    bar = page.locator("#bar")
    bar.wait_for()
    assert page.locator("#bar .status.ok").count() == 0, "nothing is green before there is data"
    words = page.locator("#story-words li")
    wait(page, lambda: words.count() >= 1 and newest(page, "position") is not None)
    status = page.locator("#status-boom-kalman")
    assert status.inner_text() == "not referenced"
    assert "Move to an end stop" in page.locator("#remedy").inner_text()
    assert page.locator("#status-boom-balance").inner_text() == "unchecked"
    assert "unchecked" in page.locator("#status-boom-balance").get_attribute("class")
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        for width, height in SIZES:
            page.set_viewport_size({"width": width, "height": height})
            page.mouse.wheel(0, 3000)
            page.wait_for_timeout(300)
            box = bar.bounding_box()
            assert box["y"] >= 0.0
            assert box["y"] + box["height"] <= 0.5 * height, "the bar leaves room for what it is about"
            assert page.locator("#remedy").bounding_box()["y"] < height
            assert page.evaluate(SMALL) == []
            page.mouse.wheel(0, -3000)
    wait(page, lambda: words.count() >= 3)  # it has found its position
    page.set_viewport_size({"width": 1400, "height": 813})
    page.emulate_media(color_scheme="light")
    wait(page, lambda: "end met" in page.locator("#known-moved").inner_text())
    page.wait_for_timeout(600)  # it is drawn in these colours, as wide as it is
    picture(page, "studio-story.png")
    picture(page.locator(".panel.known").first, "studio-known.png")
    assert "95 % band" in page.locator("#strip-position .u-legend").inner_text()
    page.get_by_role("button", name="enlarge").click()
    page.locator("[data-circuit=boom] text", has_text="hose_a").first.wait_for()
    assert page.evaluate(SMALL) == []


def test_every_card_plays_its_scenario_and_the_controls_show_what_it_sets(page):
    page.get_by_role("button", name="scenarios", exact=True).click()
    wait(page, lambda: newest(page, "position") is not None)
    for name in ("ground", "thermometer", "power", "second", "worn"):
        card = page.locator(f"[data-scenario={name}]")
        card.click()
        page.locator(f"[data-scenario={name}][aria-pressed=true]").wait_for()
        page.locator("#story h2", has_text=card.locator("b").inner_text()).wait_for()
        page.locator("#story-words li").first.wait_for()
        wait(page, lambda: newest(page, "time") > 1.0 and newest(page, "speed") != 0.0)
        transducer = page.locator("#status-boom-second")
        transducer.wait_for(state="visible" if name == "second" else "hidden")
    page.get_by_role("button", name="controls", exact=True).click()
    leakage = page.get_by_role("slider", name="leakage [× data sheet]")
    wait(page, lambda: leakage.get_attribute("aria-valuenow") == "1.6")
    page.get_by_role("button", name="lift boom").click()  # a hand at the lever ends it
    page.get_by_role("button", name="scenarios", exact=True).click()
    wait(page, lambda: "yours" in page.locator("#story h2").inner_text())


def test_keys_are_levers_as_long_as_they_are_down_and_time_goes_as_fast_as_life(page):
    wait(page, lambda: newest(page, "position", "bucket") is not None)
    before = newest(page, "position", "bucket")
    page.keyboard.down("ArrowRight")  # lifting retracts the bucket's cylinder
    wait(page, lambda: newest(page, "position", "bucket") < before - 5.0)
    page.keyboard.up("ArrowRight")
    wait(page, lambda: newest(page, "speed", "bucket") == 0.0)
    first, begun = newest(page, "time"), time.monotonic()
    count = page.evaluate("studio.count()")
    page.wait_for_timeout(4000)
    assert page.evaluate("studio.count()") - count > 10  # the benchmark counts them; here only that they come
    passed = time.monotonic() - begun
    assert 0.5 * passed < newest(page, "time") - first < passed + 1.0  # as fast as life, if the computer keeps up
    slider = page.get_by_role("slider", name="leakage [× data sheet]")
    slider.focus()
    page.keyboard.down("ArrowRight")
    wait(page, lambda: slider.get_attribute("aria-valuenow") != "1")
    assert newest(page, "speed", "bucket") == 0.0  # a key on a slider is no lever
    page.keyboard.up("ArrowRight")


def test_every_slider_has_words_a_unit_and_its_value_and_home_and_end_take_it_to_its_ends(page):
    page.locator(".space .nicegui-scene").wait_for()
    sliders = page.locator("[role=slider]")  # not the native one, which goes back in time
    names = [one.get_attribute("aria-label") for one in sliders.all()]
    assert len(names) == len(set(names)) >= 16
    for name in names:
        assert re.fullmatch(r".+ \[.+\]", name), name
        slider = page.get_by_role("slider", name=name, exact=True)
        words = page.get_by_text(name, exact=True)
        value = words.locator("xpath=following-sibling::*[1]")
        if slider.get_attribute("aria-disabled") == "true":
            continue
        for key, end in (("Home", "aria-valuemin"), ("End", "aria-valuemax"), ("Home", "aria-valuemin")):
            slider.focus()
            page.keyboard.press(key)
            wanted = slider.get_attribute(end)
            wait(page, lambda s=slider, w=wanted: s.get_attribute("aria-valuenow") == w)
            wait(page, lambda v=value, w=wanted: float(v.inner_text()) == float(w))


def test_a_fault_changes_the_status_goes_again_and_is_marked_in_the_strips(page):
    def marked(words):
        wait(page, lambda: words in str(page.evaluate("studio.timeline.marks()")))

    page.get_by_role("switch", name="temperature lost").click()
    status = page.locator("#status-boom-kalman")
    wait(page, lambda: "oil temperature missing" in status.inner_text())
    marked("temperature lost")
    assert "uncertain" in status.get_attribute("class")
    picture(page, "studio-fault.png")
    page.get_by_role("switch", name="temperature lost").click()
    wait(page, lambda: "oil temperature" not in status.inner_text())
    marked("temperature lost: over")


def test_a_machine_that_stands_is_not_drawn_anew_and_one_that_moves_is(page):
    wait(page, lambda: (page.evaluate("studio.pictures") or 0) > 3)
    page.wait_for_timeout(7000)
    before = page.evaluate("studio.pictures")
    page.wait_for_timeout(2000)
    assert page.evaluate("studio.pictures") == before
    page.get_by_role("button", name="lift boom").click()
    wait(page, lambda: page.evaluate("studio.pictures") > before + 5)
    page.get_by_role("button", name="stop boom").click()
    wait(page, lambda: newest(page, "speed") == 0.0)


def moving(page, unit="boom"):
    """Flows of the lines that show dashes."""
    return [one for one in page.evaluate(f"studio.moving({json.dumps(unit)})") if one["shown"]]


def test_dashes_go_as_the_oil_goes_stand_with_it_and_a_relief_valve_that_spits_says_so(page):
    wait(page, lambda: newest(page, "position") is not None)
    page.set_viewport_size({"width": 1400, "height": 2400})  # what is not seen is not drawn
    wait(page, lambda: moving(page) == [])
    page.get_by_role("button", name="lift boom").click()
    wait(page, lambda: newest(page, "speed") > 1900.0)

    def go_as_the_oil():
        """Between two looks, within which a busy page may have drawn nothing."""
        first = page.evaluate("studio.moving('boom')")
        page.wait_for_timeout(120)
        second = page.evaluate("studio.moving('boom')")
        gone = [
            (one["flow"], other["gone"] - one["gone"])
            for one, other in zip(first, second, strict=True)
            if min(abs(one["flow"]), abs(other["flow"])) > 1.0  # a valve that chatters may turn round meanwhile
        ]
        fastest, slowest = (f(gone, key=lambda one: abs(one[0]), default=(0.0, 0.0)) for f in (max, min))
        return (
            len(gone) > 8 and all(flow * step > 0.0 for flow, step in gone) and abs(fastest[1]) > 1.5 * abs(slowest[1])
        )

    wait(page, go_as_the_oil)
    drawn, moved = page.evaluate(
        """() => [[...document.querySelectorAll('[data-circuit=boom] .flows polyline')].filter((e) => !e.style.display),
        studio.moving('boom').filter((one) => one.shown)].map((all) => all.length)"""
    )
    assert drawn == moved
    page.emulate_media(reduced_motion="reduce")
    arrow = page.locator("[data-circuit=boom] .flows path").first
    wait(page, lambda: arrow.evaluate("(e) => getComputedStyle(e).visibility") == "visible")
    still = page.evaluate("studio.moving('boom').map((one) => one.gone)")
    page.wait_for_timeout(300)
    assert page.evaluate("studio.moving('boom').map((one) => one.gone)") == still
    page.emulate_media(reduced_motion="no-preference")
    page.get_by_role("switch", name="an obstacle").click()
    spitting = page.locator("[data-circuit=boom] g.spits text.says")
    wait(page, lambda: spitting.count() > 0 and re.fullmatch(r"spits \d+ l/min", spitting.text_content() or ""))
    page.get_by_role("switch", name="an obstacle").click()
    page.get_by_role("button", name="lower boom").click()
    opened = page.locator("[data-circuit=boom] #part-safety_a text.says")
    wait(page, lambda: opened.count() > 0 and opened.text_content() == "100 % open")
    page.get_by_role("button", name="stop boom").click()
    wait(page, lambda: moving(page) == [])


def test_oil_cools_in_cold_air_unless_it_is_held(page):
    wait(page, lambda: page.locator("#now-tank").inner_text() != "–")
    air = page.get_by_role("slider", name="ambient temperature [°C]")
    for name, key, value in (("ambient temperature [°C]", "Home", "-20"), ("speed-up [× real time]", "End", "50")):
        slider = page.get_by_role("slider", name=name)
        slider.focus()
        page.keyboard.press(key)
        wait(page, lambda s=slider, v=value: s.get_attribute("aria-valuenow") == v)
    wait(page, lambda: float(page.locator("#now-tank").inner_text()) < 39.0)
    page.get_by_role("switch", name="hold the oil there").click()
    wait(page, lambda: page.locator("#now-tank").inner_text() == "40.0")
    wait(page, lambda: air.get_attribute("aria-disabled") == "true")


def test_the_energy_that_came_in_is_drawn_as_wide_as_what_went_out(page):
    page.get_by_role("button", name="lift boom").click()
    wait(page, lambda: page.locator("#sankey rect").count() >= 4)
    wait(page, lambda: "pumps: friction" in page.locator("#sankey").inner_text())
    page.get_by_role("button", name="lower boom").click()
    wait(page, lambda: "back to the drive" in page.locator("#sankey").inner_text())
    sides = page.evaluate(
        """() => { const found = {};
        for (const one of document.querySelectorAll('#sankey rect'))
          found[one.getAttribute('x')] = (found[one.getAttribute('x')] ?? 0) + +one.getAttribute('height');
        return Object.values(found); }"""
    )
    assert len(sides) == 2
    assert sides[0] == pytest.approx(sides[1], rel=0.15)  # gaps between the entries are beside
    assert re.search(r"regenerated: \d+ % of what the load gave", page.locator("#energy-said").inner_text())
    page.locator("#sankey").scroll_into_view_if_needed()
    picture(page, "studio-energy.png")
    page.get_by_role("button", name="stop boom").click()


def test_what_the_sensor_knows_is_drawn_over_the_cylinder(page):
    wait(page, lambda: page.locator("#known polygon").count() >= 2)
    said = page.locator("#known svg").get_attribute("aria-label")
    assert re.search(r"how likely each place in the cylinder is: \d+\.\d mm, in 95 of 100 cases between", said)
    chances = page.locator("#known-hypotheses b").all_inner_texts()
    assert len(chances) == 5
    assert sum(float(one.strip("< %")) for one in chances) == pytest.approx(100.0, abs=1.0)
    assert page.locator("#known-learned svg").count() == 3
    heights = page.evaluate(
        """() => [...document.querySelectorAll('#known polygon')].map((one) =>
        Math.min(...one.getAttribute('points').split(' ').map((at) => +at.split(',')[1])))"""
    )
    assert min(heights) == pytest.approx(0.0, abs=0.1), "the likeliest place is as high as the picture"
    page.get_by_role("button", name="boom: reference", exact=True).click()
    wait(page, lambda: re.search(r"last end or reference was \d+ s ago", page.locator("#known-said").inner_text()))


MOVE = """([what, seconds]) => new Promise((stops) => {
  const { frame } = studio, press = (word) => document.querySelector(`[aria-label="${word} boom"]`).click();
  let begun = null;
  studio.frame = (f) => {
    const now = f.columns.time.at(-1);
    if (begun === null && f.columns.boom.speed.at(-1)) begun = now;
    if (begun !== null && now >= begun + seconds) { studio.frame = frame; press("stop"); stops(); }
    return frame(f);
  };
  press(what);
})"""
"""The page itself lets go of the lever, by the machine's time: whoever looks from outside may be late by seconds."""


def test_each_lift_is_weighed_with_its_band_the_rated_load_and_the_truth_beside_it(page):
    newest, drawn = page.locator("#lifts-newest"), page.locator("#lifts-picture svg")
    wait(page, lambda: "Lift the boom steadily" in page.locator("#lifts").inner_text())

    def move(what, seconds):
        page.evaluate(MOVE, [what, seconds])

    def count():
        return int(re.search(r"of (\d+) weighing", page.locator("#lifts-total").inner_text())[1])

    move("lift", 4.5)
    wait(page, lambda: "good" in newest.inner_text())
    said = newest.inner_text().replace("\u202f", "")
    mass, half, share, status = re.search(r"(\d+) ± (\d+) kg[^§]*rated load: (\d+) ± \d+ %, (\w+)", said).groups()
    assert abs(int(mass) - 3875) <= int(half) < 400
    assert "true: 3875 kg, within the band" in said
    assert (40 < int(share) < 60, status) == (True, "within")
    assert f"weighed {mass} ± {half} kg, true 3875 kg" in drawn.get_attribute("aria-label").replace("\u202f", "")
    drawing = drawn.bounding_box()
    assert drawing["width"] > 300
    wait(page, lambda: f"weighed {mass} kg" in str(page.evaluate("studio.timeline.marks()")))
    assert f"total since the start: {mass} ± {half} kg (95 %) in 1 cycle" in page.locator(
        "#lifts-total"
    ).inner_text().replace("\u202f", "")
    for _ in range(5):  # a page that is kept waiting for seconds may have lifted for long enough
        weighed = count()
        move("lift", 0.3)
        wait(page, lambda weighed=weighed: count() > weighed)
        if "good" not in newest.inner_text():
            break
    assert "too short: lift steadily for 3 s" in newest.inner_text()
    assert newest.locator(".status.invalid").inner_text() == "bad"
    assert f"{mass} ± {half} kg" in page.locator("#lifts-before").inner_text().replace("\u202f", "")
    for width in (1400, 390):
        page.set_viewport_size({"width": width, "height": 1000})
        wait(page, lambda: page.locator("#lifts").evaluate("(own) => own.scrollWidth <= own.clientWidth"))
    page.set_viewport_size({"width": 1400, "height": 1000})
    load = page.get_by_role("slider", name="load [% of the largest]")
    load.focus()
    page.keyboard.press("End")
    move("lower", 3.0)
    move("lift", 5.0)
    wait(page, lambda: "exceeded" in newest.inner_text())
    assert newest.locator(".status.invalid").inner_text().startswith("rated load: 1")
    picture(page.locator("#lifts"), "studio-lifts.png")
    page.get_by_role("button", name="begin again").click()
    wait(page, lambda: "Lift the boom steadily" in page.locator("#lifts").inner_text() and drawn.count() == 0)


ONE_INSTANT = """(() => {
  const { frame } = studio;
  studio.frame = (f) => {
    if (studio.stands) return 0;
    studio.stands = "boom" in f.known;
    return frame(f);
  };
})()"""
"""Lets the page stand as soon as it has been told what the sensor knows: all that is on it is of that instant."""


def answers(page):
    """Answers of the page to its questions, by question."""
    dl = page.locator("#known-said")
    return dict(zip(*(dl.locator(one).all_inner_texts() for one in ("dt", "dd")), strict=True))


def test_five_questions_are_answered_by_a_look(loader, visitor):
    page = visitor()
    runs(page, f"{loader[0]}?play=ends&strips=position,error")
    wait(page, lambda: "unknown" in page.locator("#known-now").inner_text())
    nothing_known = answers(page)
    assert list(nothing_known) == ["What does it know now?", "How sure is it?", "Since when?", "What makes it surer?",
                                   "What if it is wrong?"]  # fmt: skip
    assert nothing_known["How sure is it?"].startswith("In 95 of 100 cases it is between 0.0 and 700.0 mm.")
    assert nothing_known["Since when?"] == "It has met no end and no reference yet."
    assert nothing_known["What makes it surer?"].startswith("Press it on an end")
    assert nothing_known["What if it is wrong?"].startswith("It gives no position")
    wait(page, lambda: "end met" in page.locator("#known-moved").inner_text())
    wait(page, lambda: re.search(r"[1-9]\d* s ago", page.locator("#known-since").inner_text()))
    page.wait_for_timeout(1500)
    page.evaluate(ONE_INSTANT)
    wait(page, lambda: page.evaluate("studio.stands"))
    said = answers(page)
    at = float(re.fullmatch(r"The piston is at (\d+\.\d) mm\.", said["What does it know now?"])[1])
    sure = r"In 95 of 100 cases it is between (\S+) and (\S+) mm; one sample in 100\s000 is off by more than (\d+) mm."
    low, high, bound = map(float, re.fullmatch(sure, said["How sure is it?"]).groups())
    assert low <= at <= high
    assert high - low < 700.0
    assert bound > 0.5 * (high - low)
    assert re.fullmatch(r"The last end or reference was \d+ s ago\.", said["Since when?"])
    assert re.match(r"Press it on the \w+ end, and on the other one", said["What makes it surer?"])
    wrong = r"With a probability of .+ %, the extended end is met elsewhere: .+ between (\d+) and (\d+) mm\."
    assert at - 50.0 > float(re.fullmatch(wrong, said["What if it is wrong?"])[1])
    shown = {"now": "#bar .unit", "sure": "#known", "since": "#strip-position", "surer": "#known-said"}
    for name, place in (shown | {"wrong": "#known-hypotheses"}).items():
        picture(page.locator(place).first, f"studio-{name}.png")


def figures(text):
    return re.findall(r"largest .*", text) + re.findall(r"position .* at last", text)


def test_a_dropped_log_has_the_figures_of_the_verb(page):
    log, truth = TRACES / "boom_441kN_40C.csv.gz", TRACES / "boom_441kN_40C_truth.csv.gz"
    words = ["track", "mining-loader", str(log), "--unit", "boom", "--start", "100 mm", "--truth", str(truth)]
    verb = CliRunner().invoke(app, words)
    assert verb.exit_code == 0
    page.get_by_role("tab", name="Logs").click()
    said = page.locator("#log-said")
    page.locator("#upload-truth input[type=file]").set_input_files(truth)
    wait(page, lambda: "true position" in said.inner_text())
    page.locator("#upload-log input[type=file]").set_input_files(log)
    wait(page, lambda: "3 channels" in said.inner_text())
    page.get_by_label("piston at first").fill("100 mm")
    page.locator("#track").click()
    page.locator("#track-picture .uplot").wait_for()
    assert figures(said.inner_text()) == figures(verb.stdout)
    assert len(figures(verb.stdout)) == 2
    picture(page, "studio-logs.png")
    whole = page.evaluate("[studio.seen.columns.time[0], studio.seen.columns.time.at(-1)]")
    over = page.locator("#track-picture .u-over").bounding_box()
    x, y = over["x"], over["y"] + 0.5 * over["height"]
    page.mouse.move(x + 0.4 * over["width"], y)
    page.mouse.down()
    page.mouse.move(x + 0.5 * over["width"], y)
    page.mouse.up()
    wait(page, lambda: page.evaluate("studio.seen.columns.time.at(-1)") < whole[1] - 1.0)
    page.locator("#track-picture .u-over").dblclick()
    wait(page, lambda: page.evaluate("studio.seen.columns.time.at(-1)") == whole[1])
    for name, begins in (("track.csv", b"time_s"), ("track.png", b"\x89PNG"), ("track.svg", b"<?xml")):
        with page.expect_download() as coming:
            page.get_by_role("link", name=f"download {name}").click()
        assert Path(coming.value.path()).read_bytes().startswith(begins)
    page.get_by_role("button", name="leak test").click()
    wait(page, lambda: "no leak test" in said.inner_text())
    page.locator("#upload-log input[type=file]").set_input_files(TRACES / "boom_441kN_40C.csv.gz")
    wait(page, lambda: page.locator("#track-picture .uplot").count() == 0)  # results of another upload are gone
    wait(page, lambda: page.locator("#log-exports a").count() == 0)
    page.get_by_role("button", name="remove the true position").click()
    page.get_by_text("truth: none", exact=True).wait_for()


def test_of_a_track_it_is_seen_what_the_sensor_knew_at_the_pointer_and_by_keys(page):
    page.get_by_role("tab", name="Logs").click()
    log = TRACES / "person" / "person_boom_datasheet.csv.gz"
    page.locator("#upload-log input[type=file]").set_input_files(log)
    wait(page, lambda: "3 channels" in page.locator("#log-said").inner_text())
    page.locator("#track").click()
    hill, at = page.locator("#log-known svg"), page.locator("#log-known-at")
    wait(page, lambda: hill.count() == 1 and "in 95 of 100 cases" in hill.get_attribute("aria-label"))
    last = at.inner_text()
    picture(page.locator("#log-knows"), "studio-logs-known.png")
    track = page.locator("#track-picture .u-over")
    middle = track.bounding_box()["height"] / 2
    track.hover(position={"x": 3, "y": middle})
    wait(page, lambda: "the place of the piston is unknown" in hill.get_attribute("aria-label"))
    assert at.inner_text() != last
    assert page.locator("#log-known-hypotheses b").count() == page.locator("#log-known-hypotheses li").count() == 5
    handle = page.get_by_role("slider", name="instant of the log")
    before = at.inner_text()
    handle.focus()
    page.keyboard.press("ArrowRight")
    wait(page, lambda: at.inner_text() != before)
    track.hover(position={"x": track.bounding_box()["width"] - 3, "y": middle})
    wait(page, lambda: "in 95 of 100 cases" in hill.get_attribute("aria-label"))
    page.locator("#upload-log input[type=file]").set_input_files(TRACES / "boom_441kN_40C.csv.gz")
    wait(page, lambda: not page.locator("#log-knows").is_visible())  # of another log it knew something else


def test_a_tab_shows_how_the_machines_of_a_store_change(visitor, tmp_path):
    store = tmp_path / "fleet.db"
    with HistoryStore(store, makes=True) as made:
        for serial, rate in (("A17", 0.35), ("<b>B2</b>", 0.0)):
            place = made.described(MachineKey("mining-loader", "boom", serial), "d", "")
            for one in life(30, rate=rate, seed=len(serial)):
                made.add(place, one)
    with studio("mining-loader", "--history", str(store)) as (address, _):
        page = visitor()
        wrong = wrong_on(page)
        runs(page, f"{address}?play=none")
        page.get_by_role("tab", name="History").click()
        shown = page.frame_locator("iframe.fleet")
        shown.get_by_text("A17").first.wait_for()
        shown.get_by_text("<b>B2</b>").first.wait_for()  # a name is text
        picture(page, "studio-history.png")
        store.unlink()
        page.get_by_role("button", name="read again").click()
        wait(page, lambda: "no such file" in page.locator("#fleet-said").inner_text())
        nothing(wrong, page)


def turned_to(page, word, shown):
    """Choose what the first column shows, again if a busy page has not heard it.

    Args:
        shown: whether it is shown.
    """

    def there():
        if not shown():
            page.get_by_text(word, exact=True).click()
        return shown()

    wait(page, there)


def test_in_the_race_a_worn_pump_takes_dead_reckoning_away_and_a_wrong_start_is_found(page):
    begin = page.locator("#race-start")
    turned_to(page, "race", begin.is_visible)
    begin.click()

    def off(kind):
        text = page.locator(f"#race-{kind} b").inner_text()
        return math.nan if text == "–" else float(text)

    says = page.locator("#race-says")
    wait(page, lambda: off("kalman") < 2.0 and off("balance") < 2.0 and off("table") < 20.0)

    def speed_up(*keys):
        turned_to(page, "controls", begin.is_hidden)
        page.get_by_label("speed-up [× real time]").focus()
        for key in keys:
            page.keyboard.press(key)
        turned_to(page, "race", begin.is_visible)

    speed_up("End")
    worn = page.get_by_role("button", name="worn pump")
    worn.click()
    wait(page, lambda: worn.get_attribute("aria-pressed") == "true")
    wait(page, lambda: off("balance") > max(10.0, 3.0 * off("kalman")) and "says: ok" in says.inner_text())
    picture(page, "studio-race.png")
    worn.click()
    wait(page, lambda: worn.get_attribute("aria-pressed") == "false")
    speed_up("Home", "ArrowRight")  # from a pause to as slow as it goes: what lasts until the next end is seen
    page.get_by_role("button", name="wrong start").click()
    wait(page, lambda: off("kalman") > 20.0 and "says: uncertain" in says.inner_text())
    speed_up("End")
    wait(page, lambda: off("kalman") < 5.0 and "says: ok" in says.inner_text())  # after an end


def test_a_rehearsed_commissioning_shows_its_references_and_gives_its_report(page, tmp_path):
    log, truth = tmp_path / "log.csv", tmp_path / "truth.csv"
    words = ["simulate", "mining-loader", "--unit", "boom", "--duty", "commissioning", "--log", str(log)]
    assert CliRunner().invoke(app, [*words, "--truth", str(truth)]).exit_code == 0
    page.get_by_role("tab", name="Logs").click()
    said, judged = page.locator("#log-said"), page.locator("#log-judged")
    page.locator("#upload-truth input[type=file]").set_input_files(truth)
    wait(page, lambda: "true position" in said.inner_text())
    page.locator("#upload-log input[type=file]").set_input_files(log)
    wait(page, lambda: "channels" in said.inner_text())
    page.locator("#track").click()
    wait(page, lambda: "end stop, extended" in page.locator("#log-references").inner_text())
    page.get_by_role("link", name="download track.svg").wait_for()
    for name, words in (("leak test", "leak factor"), ("identified factors", "displacement"), ("report", "end stops")):
        page.get_by_role("button", name=name, exact=True).click()
        wait(page, lambda words=words: words in judged.inner_text())
    picture(page, "studio-judged.png")
    with page.expect_download() as coming:
        page.get_by_role("link", name="download report.html").click()
    assert b"<!doctype html>" in Path(coming.value.path()).read_bytes()[:40]


def test_a_wrong_file_says_why(page, tmp_path):
    file = tmp_path / "holiday.png"
    file.write_bytes(b"\x89PNG\r\n")
    page.get_by_role("tab", name="Logs").click()
    page.locator("#upload-log input[type=file]").set_input_files(file)
    said = page.locator("#log-said")
    wait(page, lambda: "unknown" in said.inner_text())
    assert said.inner_text().startswith("holiday.png: ")


def posted(address, path, headers, pieces):
    """Post pieces of a body until the server answers; the status, and how many bytes it has taken."""
    host, taken = address.removeprefix("http://").strip("/"), 0
    with socket.create_connection(host.split(":")) as to:
        lines = [f"POST {path} HTTP/1.1", f"Host: {host}", *(f"{name}: {value}" for name, value in headers.items())]
        to.sendall("\r\n".join([*lines, "", ""]).encode())
        to.settimeout(0.0 if pieces else PATIENCE)
        for piece in pieces:
            to.settimeout(PATIENCE)
            with contextlib.suppress(ConnectionError):
                to.sendall(piece)
                taken += len(piece)
            to.settimeout(0.0)
            with contextlib.suppress(BlockingIOError):
                return int(to.recv(4096).split()[1]), taken
        to.settimeout(PATIENCE)
        return int(to.recv(4096).split()[1]), taken


def test_more_than_a_gigabyte_is_refused_early_and_takes_no_memory(page, loader, tmp_path):
    address, server = loader
    file, small = tmp_path / "year.csv", tmp_path / "<img src=x onerror='window.hit=1'>.csv"
    with file.open("wb") as empty:
        empty.truncate(1200 * 2**20)
    small.write_text("nothing\n")
    before = psutil.Process(server.pid).memory_info().rss
    page.get_by_role("tab", name="Logs").click()
    said = page.locator("#log-said")
    with page.expect_request(lambda one: one.method == "POST") as sent:
        page.locator("#upload-log input[type=file]").set_input_files(small)
    wait(page, lambda: "onerror" in said.inner_text())
    assert page.evaluate("window.hit") is None, "the name of a file is text"
    page.locator("#upload-log input[type=file]").set_input_files(file)
    wait(page, lambda: said.inner_text() == "refused: a file of at most 250 MiB")
    path = "/" + sent.value.url.removeprefix(address)
    form = {"Content-Type": "multipart/form-data; boundary=b"}
    assert posted(address, path, {**form, "Content-Length": 1200 * 2**20}, []) == (413, 0)  # nothing was sent for it
    head = b'--b\r\nContent-Disposition: form-data; name="f"; filename="f.csv"\r\n\r\n'
    million = b"100000\r\n" + bytes(2**20) + b"\r\n"
    pieces = [f"{len(head):x}\r\n".encode() + head + b"\r\n", *(1200 * [million])]
    status, taken = posted(address, path, {**form, "Transfer-Encoding": "chunked"}, pieces)
    assert status == 413
    assert taken < 300 * 2**20
    grown = psutil.Process(server.pid).memory_info().rss - before
    assert grown < 60 * 2**20, grown


def test_a_description_is_edited_and_kept_over_a_reload_and_comes_as_the_file_that_check_accepts(page, tmp_path):
    page.get_by_role("tab", name="Machines").click()
    said, follows = page.locator("#machine-said"), page.locator("#machine-follows")
    wait(page, lambda: "load at relief pressure" in follows.inner_text())
    verb = CliRunner().invoke(app, ["check", "mining-loader"])
    shown = {" ".join(line.split()) for line in follows.inner_text().splitlines()}
    assert {" ".join(line.split()) for line in verb.stdout.splitlines() if "area" in line} <= shown
    page.get_by_text("units.boom.cylinder", exact=True).click()
    bore = page.locator("[id='value-units.boom.cylinder.bore']")
    wait(page, lambda: bore.input_value() == "127 mm")
    field = page.locator("[data-path='units.boom.cylinder.bore']")
    assert "at most 1 m" in field.inner_text()
    bore.fill("40 mm")
    bore.press("Tab")
    rod = page.locator("[data-path='units.boom.cylinder.rod']")
    wait(page, lambda: "does not fit into the bore" in rod.inner_text())  # at the field that has to give way
    assert rod.locator("input").first.get_attribute("aria-invalid") == "true"
    picture(page, "studio-machine.png")
    page.reload()
    page.get_by_role("tab", name="Machines").click()
    wait(page, lambda: "does not fit into the bore" in said.inner_text())
    wait(page, lambda: bore.input_value() == "40 mm")
    bore.fill("130 mm")
    bore.press("Tab")
    wait(page, lambda: "holds" in said.inner_text() and "26546" in follows.inner_text())  # 2 pi/4 130^2 mm2
    source = field.get_by_label("source of units.boom.cylinder.bore")
    wait(page, lambda: source.input_value() == "")  # another value has another source
    source.fill("drawing 4711")
    source.press("Tab")
    wait(page, lambda: "drawing 4711" in page.locator("#machine-file").input_value())
    with page.expect_download() as coming:
        page.locator("#download-description").click()
    file = tmp_path / "mine.toml"
    coming.value.save_as(file)
    assert 'bore = { value = "130 mm", source = "drawing 4711" }' in file.read_text()
    assert "26546" in CliRunner().invoke(app, ["check", str(file)]).stdout
    file.write_text(file.read_text().replace('"130 mm"', '"140 mm"'))
    page.locator("#open-description input[type=file]").set_input_files(file)
    wait(page, lambda: bore.input_value() == "140 mm")


def test_an_edited_machine_runs_live_and_one_that_cannot_is_said_why_while_the_other_goes_on(page, loader):
    _, server = loader
    wait(page, lambda: newest(page, "position") is not None)
    wait(page, lambda: len(workers(server)) == 1)  # that of the visitor before ends a little later
    before = {p.pid for p in workers(server)}
    page.get_by_role("tab", name="Machines").click()
    said, run = page.locator("#machine-said"), page.locator("#run-description")
    wait(page, lambda: "holds" in said.inner_text())

    def write(key, value):
        table = page.get_by_text(f"units.boom.{key.rpartition('.')[0]}", exact=True)
        if table.locator("xpath=..").get_attribute("open") is None:
            table.click()
        field = page.locator(f"[id='value-units.boom.{key}']")
        field.fill(value)
        field.press("Tab")

    write("cylinder.bore", "40 mm")
    wait(page, lambda: "does not fit into the bore" in said.inner_text())
    run.click()
    wait(page, lambda: said.inner_text().startswith("not run: units.boom.cylinder.rod: the rod does not fit"))
    write("cylinder.bore", "150 mm")
    write("cylinder.stroke", "5 m")  # described well, but the mechanism does not reach so far
    wait(page, lambda: "holds" in said.inner_text())
    run.click()
    stroke = page.locator("[data-path='units.boom.cylinder.stroke']")
    wait(page, lambda: "cannot be assembled" in stroke.inner_text())
    assert "cannot be assembled" in said.inner_text()
    assert before <= {p.pid for p in workers(server)}
    at = newest(page, "time")
    wait(page, lambda: newest(page, "time") > at + 0.5)
    write("cylinder.stroke", "0.8 m")
    wait(page, lambda: "holds" in said.inner_text())
    run.click()
    page.get_by_text("runs", exact=True).wait_for()
    wait(page, lambda: not before & {p.pid for p in workers(server)})
    wait(page, lambda: newest(page, "position") is not None and abs(newest(page, "position") - 320.0) < 2.0)
    page.get_by_role("button", name="lift boom").click()
    wait(page, lambda: newest(page, "position") > 340.0)
    at, begun = page.evaluate(TOGETHER)
    wait(page, lambda: newest(page, "time") > at + 2.0)
    ended, position = page.evaluate(TOGETHER)
    speed = (position - begun) / (ended - at)
    assert speed == pytest.approx(2000.0 / 60.0 * 0.574, rel=0.1)  # mm/s: the larger bore takes 0.574 mm a turn
    assert abs(newest(page, "kalman_error")) < 2.0
    assert len(workers(server)) == 1


def test_a_data_sheet_fills_is_stopped_goes_on_and_is_the_sheet_of_the_verb(page, loader, tmp_path):
    _, server = loader
    page.get_by_role("tab", name="Studies").click()
    said = page.locator("#study-said")
    page.get_by_label("duty", exact=True).click()
    page.get_by_role("option", name="lift-lower").click()
    page.get_by_label("machines", exact=True).fill("400")
    running = {p.pid for p in workers(server)}
    page.locator("#study-start").click()
    wait(page, lambda: "of 400 machines" in said.inner_text())
    assert page.locator("#study-accuracy tbody tr").count() >= 3
    page.locator("#study-picture canvas").wait_for()
    assert page.locator("#study-picture .u-legend .u-series").count() >= 4  # machines, and three groups
    page.locator("#study-stop").click()
    wait(page, lambda: "stopped" in said.inner_text())
    assert {p.pid for p in workers(server)} <= running
    page.get_by_label("machines", exact=True).fill("20")
    page.locator("#study-start").click()
    wait(page, lambda: page.get_by_text("open the sheet").count() > 0)
    picture(page, "studio-studies.png")
    with page.expect_download() as coming:
        page.get_by_role("link", name="download sheet.json").click()
    mine = json.loads(Path(coming.value.path()).read_text())
    words = ["datasheet", "mining-loader", "--unit", "boom", "--duty", "lift-lower", "--machines", "20"]
    command = [sys.executable, "-m", "ramsight", *words, "--out", str(tmp_path / "sheet")]
    subprocess.run(command, check=True, capture_output=True, env=of_a_user())
    assert mine["accuracy"] == json.loads((tmp_path / "sheet" / "sheet.json").read_text())["accuracy"]
    with page.expect_popup() as opened:
        page.get_by_text("open the sheet").click()
    opened.value.get_by_role("heading", level=1).wait_for()
    address = opened.value.url
    opened.value.close()
    assert answered(address.rsplit("/", 2)[0] + "/another/sheet.html")[0] >= 400


def test_strips_stand_where_they_are_dragged_over_and_are_saved(page, tmp_path):
    wait(page, lambda: page.evaluate("studio.units.boom.time.length") > 100)
    over = page.locator("#strip-error .u-over").bounding_box()
    middle = over["y"] + 0.5 * over["height"]
    page.mouse.move(over["x"] + 0.4 * over["width"], middle)
    page.mouse.down()
    page.mouse.move(over["x"] + 0.8 * over["width"], middle, steps=4)
    page.mouse.up()
    pause = page.locator("#strips-pause")
    assert pause.get_attribute("aria-pressed") == "true"
    scales = page.evaluate("studio.plots().map((one) => [one.plot.scales.x.min, one.plot.scales.x.max])")
    assert all(one == scales[0] for one in scales), "all strips show the same time"
    count, drawn = page.evaluate("[studio.units.boom.time.length, studio.plots()[0].plot.data[0].length]")
    wait(page, lambda: page.evaluate("studio.units.boom.time.length") > count)
    assert page.evaluate("studio.plots()[0].plot.scales.x.max") == scales[0][1], "they stand while the machine goes on"
    assert page.evaluate("studio.plots()[0].plot.data[0].length") == drawn, "what stands is what was drawn"
    with page.expect_download() as coming:
        page.locator("#strips-picture").click()
    assert Path(coming.value.path()).read_bytes().startswith(b"\x89PNG")
    page.locator("#strips-whole").click()
    assert pause.get_attribute("aria-pressed") == "false"
    wait(page, lambda: page.evaluate("studio.plots()[0].plot.scales.x.max") > scales[0][1])
    pause.click()
    stood = page.evaluate("studio.plots()[0].plot.scales.x.max")
    page.evaluate("studio.show('bucket')")
    assert pause.get_attribute("aria-pressed") == "true"
    shown = page.evaluate("[studio.plots()[0].plot.scales.x.max, studio.plots()[0].plot.data[1].at(-1)]")
    bucket = page.evaluate("studio.units.bucket.position[studio.units.bucket.time.findLastIndex((t) => t <= 1e-9 + "
                           "studio.plots()[0].plot.data[0].at(-1))]")  # fmt: skip
    assert shown == [stood, bucket], "the same time of another unit"
    page.evaluate("studio.show('boom')")
    with page.expect_download() as coming:
        page.get_by_role("button", name="save the run of boom").click()
    with zipfile.ZipFile(coming.value.path()) as archive:
        archive.extractall(tmp_path)
    words = ["track", str(tmp_path / "machine.toml"), str(tmp_path / "log.csv"), "--unit", "boom"]
    assert CliRunner().invoke(app, [*words, "--truth", str(tmp_path / "truth.csv")]).exit_code == 0
