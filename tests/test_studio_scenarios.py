"""What the studio says of its sensors, in words and colours, and the scenarios that it plays."""

import itertools
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import ramsight
from ramsight import machine
from ramsight.normal import TWO_SIDED_95
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import Estimate
from ramsight.studio import scenarios
from ramsight.studio.playing import ENDS, Playing
from ramsight.studio.rig import Rig
from ramsight.studio.said import LETTERS, LEVELS, SILENT, UNCHECKED, of_estimate, of_verdict
from ramsight.studio.scenarios import FIRST, MISSED, NOTHING, SCENARIOS, Scenario, Scene, Storyteller
from ramsight.studio.status_bar import status_help
from ramsight.studio.worker import _edges as edges_of  # of a strip's band
from ramsight.studio.worker import _said as said_of  # what a frame has of a unit
from ramsight.tracking.comparing import ALERTS, Verdict

ASSETS = Path(ramsight.__file__).parent / "studio" / "assets"


# -- words


@pytest.mark.parametrize("status", list(Status))
def test_only_a_sensor_that_knows_how_wrong_it_may_be_is_ok(status):
    knows, counts = (of_estimate(Estimate(0.1, std, 0.0, math.nan, status)) for std in (1e-3, math.nan))
    assert knows.text == status.text
    assert knows.level == status.validity
    assert counts.level == (UNCHECKED if status is Status.OK else status.validity)
    assert (knows.level == "ok") == (status is Status.OK)


def test_what_has_reported_nothing_is_not_ok_and_no_verdict_is():
    assert of_estimate(None).level == of_verdict(None).level == SILENT
    levels = {verdict: of_verdict(verdict).level for verdict in Verdict}
    assert {verdict for verdict, level in levels.items() if level == "invalid"} == set(ALERTS)
    assert "ok" not in levels.values()
    assert set(levels.values()) <= set(LEVELS)


def test_a_rig_says_unchecked_of_the_balance_and_nothing_without_power():
    rig = Rig(machine.load_machine("press"))
    rig.begin(known=False)
    said = said_of(rig, "ram", rig.step()["ram"])
    assert {kind: one["level"] for kind, one in said.items()} == {"kalman": "not referenced", "balance": UNCHECKED}
    rig.fault("power", on=True)
    assert {one["text"] for one in said_of(rig, "ram", rig.step()["ram"]).values()} == {SILENT}
    rig.fault("power", on=False)


def test_every_word_of_a_status_has_its_meaning_and_what_to_do():
    words = status_help()
    texts = [status.text for status in Status if status is not Status.CAVITATION]  # which is reserved
    for text in [*texts, *(verdict.text for verdict in Verdict), UNCHECKED, SILENT]:
        assert words[text]["meaning"], text
        assert words[text]["do"], text
        assert not re.search(r"[`*\]\n#|]", " ".join(words[text].values())), text
    assert words["ok"]["meaning"].startswith("The position is good.")


# -- scenarios


def test_the_lever_presses_at_both_ends_and_turns_round():
    hand, at, levers = Playing(ENDS, {"ram": -1.0}, {"ram": 200.0}), 0.5, []
    for _ in range(3000):
        lever = hand.levers({"ram": at}, 0.02)["ram"]
        at = min(max(at + 0.002 * lever, 0.0), 1.0)
        levers.append(lever)
    phases = [key for key, _ in itertools.groupby(levers)]
    assert phases[:8] == [-1.0, -0.5, 0.0, 1.0, 0.5, 0.0, -1.0, -0.5]  # a retracting unit lifts first


def test_a_scenario_that_a_machine_does_not_show_ends_in_words_that_say_so(monkeypatch):
    monkeypatch.setattr(scenarios, "LONGEST", 0.1)
    never = Scenario("never", "", (Scene("waits", lambda view: False),), "shown", "")
    rig = Rig(machine.load_machine("press"))
    rig.turn(replace(rig.knobs, leak=2.0))
    story = Storyteller(rig, "never", never)
    assert rig.knobs.leak == 1.0  # it has begun again
    for _ in range(10):
        story.look(rig.step())
    assert story.telling == {"name": "never", "words": ["waits", MISSED], "over": True, "missed": True}


def test_a_page_opens_on_a_scenario_and_every_card_has_a_sentence_and_a_next_step():
    assert FIRST in SCENARIOS
    assert NOTHING not in SCENARIOS
    assert len(SCENARIOS) == 6
    for scenario in SCENARIOS.values():
        assert scenario.sentence.count(". ") == 0
        assert scenario.sentence.endswith(".")
        assert scenario.try_this
        assert len(scenario.scenes) >= 3


def played(name, seconds=600.0):
    """A scenario on a press: the views at the beginning of each scene, and how it ended."""
    rig = Rig(machine.load_machine("press"))
    story, seen = Storyteller(rig, name, SCENARIOS[name]), []
    for _ in range(round(seconds / rig.period)):
        rows = rig.step()
        row = rows["ram"]
        story.look(rows)
        if len(story.telling["words"]) > len(seen):
            seen.append(row)
        if story.telling["over"]:
            break
    assert story.telling["over"]
    assert not story.telling["missed"], story.telling["words"][-2]
    return rig, seen


def test_in_the_first_scenario_the_sensor_finds_its_position_and_its_band_closes():
    _, seen = played(FIRST)
    said = [row.estimates["kalman"] for row in seen]
    assert [one.status.validity for one in said[:3]] == ["not referenced", "uncertain", "ok"]
    assert math.isnan(said[0].position_std)
    assert said[1].position_std > said[2].position_std
    assert abs(said[-1].position - seen[-1].position) < 5e-3


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in SCENARIOS if name != FIRST])
def test_a_scenario_shows_what_its_words_say(name):
    rig, seen = played(name)
    if name == "worn":
        off = {kind: abs(seen[-1].estimates[kind].position - seen[-1].position) for kind in ("kalman", "balance")}
        assert off["kalman"] < off["balance"]
        assert rig.knobs.leak > 1.0
    elif name == "ground":
        stopped = seen[1].estimates["kalman"]
        assert stopped.status.validity == "uncertain"
        assert (
            0.1 < abs(stopped.position - seen[1].position) < 1.96 * stopped.position_std
        )  # the words: as its deviation
        assert seen[-1].estimates["kalman"].status is Status.OK
    elif name == "thermometer":
        assert seen[3].estimates["kalman"].status is Status.TEMPERATURE_LOST
        assert seen[-1].estimates["kalman"].status is Status.OK
    elif name == "power":
        assert seen[3].estimates == {}
        resumed = seen[4].estimates["kalman"]
        assert abs(resumed.position - seen[4].position) < 1.96 * resumed.position_std
    else:
        assert [row.second.verdict in ALERTS for row in seen[:3]] == [False, False, True]


# -- colours


def custom_properties(dark):
    """Colours of the style sheet by name, as shares of red, green and blue."""
    blocks = re.findall(r":root \{(.*?)\}", (ASSETS / "studio.css").read_text(encoding="utf-8"), flags=re.DOTALL)
    found = dict(re.findall(r"--([\w-]+): (#[0-9a-f]{3,6});", blocks[0] + (blocks[1] if dark else "")))
    wide = {
        name: text if len(text) == 7 else "#" + "".join(2 * one for one in text[1:]) for name, text in found.items()
    }
    return {name: np.array([int(text[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]) for name, text in wide.items()}


def linear(colour):
    return np.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4)


DEUTERANOPIA = np.array(  # Machado, Oliveira, Fernandes 2009, severity 1.0, of linear red, green and blue
    [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
)
XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)


def lab(colour):
    """CIELAB (D65) of a colour as a deuteranope sees it."""
    xyz = XYZ @ np.clip(DEUTERANOPIA @ linear(colour), 0.0, 1.0) / XYZ.sum(axis=1)
    f = np.where(xyz > (6 / 29) ** 3, np.cbrt(xyz), xyz / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def luminance(colour):
    return float(XYZ[1] @ linear(colour))


@pytest.mark.parametrize("dark", [False, True])
def test_lines_differ_for_who_sees_no_green_and_stand_out_from_the_paper(dark):
    colours = custom_properties(dark)
    for one, other in itertools.combinations(("true", "kalman", "balance"), 2):
        assert np.linalg.norm(lab(colours[one]) - lab(colours[other])) >= 20.0, (one, other)
    for name in ("true", "kalman", "balance", "unreferenced", "table", "second"):
        light, deep = sorted((luminance(colours[name]), luminance(colours["paper"])), reverse=True)
        assert (light + 0.05) / (deep + 0.05) >= 3.0, name


def test_lines_of_sensors_that_are_close_in_colour_differ_by_their_dashes():
    script = (ASSETS / "studio.js").read_text(encoding="utf-8")
    (table,) = re.findall(r"const DASHES = \{(.*?)\};", script)
    dashes = dict(re.findall(r"(\w+): (\[[\d, ]+\])", table))
    assert set(dashes) == {"balance", "unreferenced", "table", "second"}  # `true` and `kalman` are drawn through
    assert len(set(dashes.values())) == len(dashes)


def test_levels_differ_by_letters_and_lines_without_colour():
    assert len(set(LETTERS.values())) == len(LEVELS) == len(LETTERS)
    (table,) = re.findall(r"const LINES = \{(.*?)\};", (ASSETS / "status.js").read_text(encoding="utf-8"))
    lines = dict(re.findall(r'(\w[\w ]*)"?: (\[\[.*?\]\])', table))
    assert set(lines) == set(LEVELS) - {"ok", SILENT}  # those two differ by their lightness
    assert len(set(lines.values())) == len(lines)


def test_a_band_is_within_the_stroke_and_all_of_it_where_nothing_is_known():
    nan = math.nan
    for position, std, status, ends in (
        (nan, nan, Status.NOT_REFERENCED, (0.0, 700.0)),
        (0.6, 0.2, Status.REFERENCE_DUE, (600.0 - 1e3 * TWO_SIDED_95 * 0.2, 700.0)),
        (0.1, 0.2, Status.REFERENCE_DUE, (0.0, 100.0 + 1e3 * TWO_SIDED_95 * 0.2)),
        (0.9, 0.01, Status.TOO_UNCERTAIN, (700.0, 700.0)),
        (0.3, nan, Status.OK, (None, None)),
    ):
        assert edges_of(Estimate(position, std, 0.0, nan, status), 0.7) == pytest.approx(ends, abs=1e-3)
    assert edges_of(None, 0.7) == (None, None)


def test_nothing_but_ok_is_green():
    style = (ASSETS / "studio.css").read_text(encoding="utf-8")
    rules = dict(re.findall(r"^(\.status[\w.-]*) \{(.*?)\}", style, flags=re.MULTILINE))
    assert "#1d6b34" in rules[".status.ok"]
    assert [name for name, rule in rules.items() if "#1d6b34" in rule] == [".status.ok"]
    for dark in (False, True):
        levels = {name: colour for name, colour in custom_properties(dark).items() if name.startswith("level-")}
        assert set(levels) == {f"level-{one.replace(' ', '-')}" for one in LEVELS}
        green = [name for name, (red, most, blue) in levels.items() if most > 1.2 * max(red, blue)]
        assert green == ["level-ok"]


def test_no_text_of_the_style_is_smaller_than_11_px():
    style = (ASSETS / "studio.css").read_text(encoding="utf-8")
    sizes = [
        float(size) * (16.0 if unit == "rem" else 1.0)
        for size, unit in re.findall(r"font-size: ([\d.]+)(px|rem)", style)
    ]
    assert min(sizes) >= 11.0
