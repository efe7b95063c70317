"""The studio in a real Chromium: links, visitors, proxies, servers that end, and pages that anybody can use."""

import contextlib
import itertools
import math
import os
import re
import shutil
import socket
import subprocess
import urllib.error
import urllib.request
from pathlib import Path

import numpy as np
import pytest

import ramsight
from ramsight.studio.first_start import helpers
from ramsight.studio.session import STANDS

from .chromium import nothing, violations, wrong_on
from .studio_pages import (
    FIXTURES,
    TRACES,
    answered,
    listens,
    newest,
    picture,
    runs,
    studio,
    wait,
    workers,
)
from .waiting import PATIENCE, wait_for

pytestmark = pytest.mark.slow

pytest.importorskip("nicegui", reason="needs the extra studio")

browser, loader, visitor, page = FIXTURES


def german(folder):
    """A log as a German program writes it: decimal commas, milliseconds, torque in percent of 80 N m."""
    run = ramsight.simulate("mining-loader", unit="boom", load="250 kN", visits=1)
    log = ramsight.drive_report(run)
    columns = {
        "Zeit [ms]": 1e3 * log["time"].values,
        "Drehzahl Motor [1/min]": log["motor_speed"].values * 30.0 / math.pi,
        "Drehmoment [%]": log["motor_torque"].values / 0.8,
        "Öltemperatur [°C]": log["oil_temperature"].values - 273.15,
        "Weg [mm]": 1e3 * np.interp(log["time"], run["time"], run["position"]),
    }
    rows = zip(*columns.values(), strict=True)
    lines = [";".join(columns), *(";".join(f"{value:.4f}".replace(".", ",") for value in row) for row in rows)]
    file = folder / "prüfstand.csv"
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return file


def test_a_german_log_is_tracked_with_its_channels_chosen_from_lists(page, tmp_path):
    page.get_by_role("tab", name="Logs").click()
    page.locator("#upload-log input[type=file]").set_input_files(german(tmp_path))
    page.get_by_label("100 % of the motor torque is").wait_for()
    assert page.get_by_role("checkbox", name="use the channel map below").get_attribute("aria-checked") == "true"
    page.get_by_label("100 % of the motor torque is").fill("80 N m")
    text = page.get_by_label("channel map, to be checked: signs above all")
    wait(page, lambda: "80 N m" in text.input_value())
    text.fill("# mine\n" + text.input_value())
    page.get_by_label("true position, where it was measured", exact=True).click()
    page.get_by_role("option", name="Weg [mm]").click()
    wait(page, lambda: "Weg [mm]" in text.input_value())
    assert text.input_value().startswith("# mine\n"), "the form keeps what was written beside it"
    picture(page, "studio-channels.png")
    page.locator("#track").click()
    said = page.locator("#log-said")
    wait(page, lambda: "error against the truth" in said.inner_text())
    assert float(re.search(r"95 % within ([\d.]+) mm", said.inner_text())[1]) < 30.0


def test_values_of_a_description_are_found_and_what_follows_is_dimmed_while_one_is_wrong(page):
    page.get_by_role("tab", name="Machines").click()
    said = page.locator("#machine-found")
    wait(page, lambda: " values" in said.inner_text())
    shown = page.locator("#machine-form .field:not([hidden])")
    page.get_by_label("find a value").fill("bore")
    wait(page, lambda: 0 < shown.count() < 40)
    assert page.locator("[data-path='units.boom.cylinder.bore']").is_visible()
    page.get_by_label("find a value").fill("")
    page.get_by_text("only what is given").click()
    given = shown.count()
    assert 50 < given < page.locator("#machine-form .field").count()
    field = page.locator("[data-path='units.boom.cylinder.bore'] input").first
    page.get_by_label("find a value").fill("cylinder.bore")
    field.fill("-3 mm")
    field.press("Tab")
    wait(page, lambda: "old" in (page.locator("#machine-follows").get_attribute("class") or ""))
    field.fill("127 mm")
    field.press("Tab")
    wait(page, lambda: "old" not in (page.locator("#machine-follows").get_attribute("class") or ""))


def test_a_part_of_the_circuit_opens_its_values_by_mouse_and_by_keys(page):
    page.get_by_role("tab", name="Machines").click()
    relief = page.get_by_role("button", name="relief_a, relief valve: to its values").first
    relief.wait_for()
    page.get_by_label("find a value").fill("bore")
    relief.click()
    assert page.locator("[data-group='units.boom.relief_valve']").evaluate("(e) => e.open")
    assert page.locator("[data-path='units.boom.relief_valve.setting'] input").first.is_visible()
    assert page.evaluate("document.activeElement.textContent") == "units.boom.relief_valve"
    page.get_by_role("button", name="back to the circuit").click()
    assert page.evaluate("document.activeElement.dataset.section") == "units.boom.relief_valve"
    picture(page, "studio-menu.png")
    pump = page.get_by_role("button", name="pump_b, pump: to its values").nth(1)
    pump.focus()
    assert page.locator("#machine-part").inner_text() == "pump_b, pump: to its values"
    page.keyboard.press("Enter")
    assert page.locator("[data-group='units.bucket.pump_b']").evaluate("(e) => e.open")
    assert page.evaluate("document.activeElement.textContent") == "units.bucket.pump_b"
    assert serious(page) == []


def test_a_page_that_is_busy_for_a_while_is_not_loaded_again(page):
    page.evaluate("window.stays = true")
    page.evaluate("for (const from = performance.now(); performance.now() - from < 15000;);")
    count = page.evaluate("studio.count()")
    wait(page, lambda: page.evaluate("studio.count()") > count + 20)
    assert page.evaluate("window.stays")


def test_the_machine_is_looked_at_from_above_and_as_at_first(page):
    scene = page.locator(".space .nicegui-scene")
    scene.wait_for()
    at = f"getElement({scene.get_attribute('id')[1:]}).camera.position"
    first = page.evaluate(f"{at}.z")
    page.get_by_role("button", name="above", exact=True).click()
    wait(page, lambda: page.evaluate(f"{at}.z") > first + 1.0)
    page.get_by_role("button", name="as at first", exact=True).click()
    wait(page, lambda: abs(page.evaluate(f"{at}.z") - first) < 1e-3)


def test_a_view_of_ones_own_is_kept_and_its_axes_turn_with_it(page):
    scene = page.locator(".space .nicegui-scene")
    scene.wait_for()
    at = f"getElement({scene.get_attribute('id')[1:]}).camera.position"
    kept, axes = page.get_by_role("button", name="kept view", exact=True), page.locator(".space svg.axes")
    assert not kept.is_visible(), "nothing is kept yet"
    page.get_by_role("button", name="side", exact=True).click()
    wait(page, lambda: abs(page.evaluate(f"{at}.y") - page.evaluate(f"{at}.z")) > 1.0)
    page.wait_for_timeout(1000)
    side = page.evaluate(f"({at}).toArray()")
    page.get_by_role("button", name="keep this view", exact=True).click()
    upright = axes.locator("line").nth(2)
    wait(page, lambda: abs(float(upright.get_attribute("x2")) - 34.0) < 1.0)  # z goes up
    page.get_by_role("button", name="above", exact=True).click()
    wait(page, lambda: page.evaluate(f"{at}.z") > side[2] + 1.0)
    wait(page, lambda: abs(float(upright.get_attribute("y2")) - 34.0) < 2.0)  # z goes to the eye
    kept.click()
    wait(page, lambda: np.allclose(page.evaluate(f"({at}).toArray()"), side, atol=1e-2))
    page.reload()
    page.get_by_text("runs", exact=True).wait_for()
    wait(page, kept.is_visible)


def test_circuit_and_space_are_dark_where_the_page_is(page):
    def colours():
        return page.evaluate(
            "[document.querySelector('.circuit .drawing .sheet'), document.querySelector('.panel')]"
            ".map((one, k) => getComputedStyle(one)[k ? 'backgroundColor' : 'fill'])"
        )

    light = colours()
    assert light[0] == light[1], "a sheet has the colour of its panel"
    page.emulate_media(color_scheme="dark")
    wait(page, lambda: colours() != light)
    dark = colours()
    assert dark[0] == dark[1]


def made_link(page):
    """The link that a page makes now."""
    page.get_by_role("button", name="make a link").click()
    page.locator("#link").wait_for()
    return page.locator("#link").input_value()


LATE = """const plain = Object.getOwnPropertyDescriptor(WebSocket.prototype, "onmessage");
Object.defineProperty(WebSocket.prototype, "onmessage", { set(heard) {
  plain.set.call(this, (said) => setTimeout(() => heard(said), 300));
} });"""
"""What a page runs that hears its server 0.3 s late."""


def test_a_slider_takes_every_key_though_the_server_answers_late(loader, visitor):
    address, _ = loader
    page = visitor()
    page.add_init_script(LATE)
    runs(page, f"{address}?play=none")
    leakage = page.get_by_role("slider", name="leakage [× data sheet]")
    leakage.focus()
    for _ in range(12):
        page.keyboard.press("ArrowRight")
        page.wait_for_timeout(70)
    wait(page, lambda: "leak=1.6" in made_link(page))
    assert leakage.get_attribute("aria-valuenow") == "1.6"


def test_a_link_leads_to_the_same_machine_in_the_same_setting(page, loader, visitor):
    address, server = loader
    leakage = page.get_by_role("slider", name="leakage [× data sheet]")
    leakage.focus()
    for _ in range(12):
        page.keyboard.press("ArrowRight")
    page.get_by_role("switch", name="torque frozen").click()
    page.get_by_role("switch", name="kalman without references").click()
    page.get_by_role("button", name="drive", exact=True).click()
    page.locator("#strip-drive").wait_for(state="hidden")
    page.evaluate("studio.show('bucket')")
    wait(page, lambda: page.locator("#status-bucket-unreferenced").is_visible())
    said = "machine=mining-loader&play=none&leak=1.6&faults=torque&sensors=kalman,balance,unreferenced"
    link = f"{address}?{said}&unit=bucket&strips=position,error,status,pressure"
    wait(page, lambda: made_link(page) == link)  # what was set last may be on its way
    assert page.url == link
    assert serious(page) == []
    other = visitor()
    runs(other, link)
    wait(other, lambda: newest(other, "position") is not None)
    assert other.get_by_role("slider", name="leakage [× data sheet]").get_attribute("aria-valuenow") == "1.6"
    for name in ("torque frozen", "kalman without references"):
        assert other.get_by_role("switch", name=name).get_attribute("aria-checked") == "true"
    wait(other, lambda: other.locator("#status-bucket-unreferenced").is_visible())
    assert other.evaluate("studio.shown()") == "bucket"
    assert other.locator("[data-circuit=bucket]").is_visible()
    assert not other.locator("#strip-drive").is_visible()
    wait(other, lambda: made_link(other) == link)
    other.context.close()
    wait(page, lambda: len(workers(server)) == 1)


def test_a_link_to_another_machine_of_the_catalogue_opens_it_and_one_that_lies_is_refused_in_a_line(loader, visitor):
    address, server = loader
    before = len(workers(server))
    for query in (
        "machine=/etc/passwd",
        "leak=9",
        "leak=%D9%A1",
        "unit=%00",
        "faults=fire",
        "strips=a%0Ab",
        "x=" + "y" * 5000,
    ):
        status, text = answered(f"{address}?{query}")
        assert status == 400
        assert text.startswith("link")
        assert len(text) < 300
        assert text.isprintable()
    assert len(workers(server)) == before
    other = visitor()
    runs(other, f"{address}?machine=press&play=none&load=80")
    wait(other, lambda: newest(other, "position", "ram") is not None)
    assert "press" in other.locator("#machine-name").inner_text().lower()
    assert "press" in other.title().lower()
    assert other.get_by_role("slider", name="load [% of the largest]").get_attribute("aria-valuenow") == "80"


def test_a_second_visitor_has_a_machine_of_his_own_and_a_closed_tab_ends_its_process(loader, visitor, page):
    address, server = loader
    wait(page, lambda: newest(page, "position") is not None)
    before = {p.pid for p in workers(server)}
    other = visitor()
    runs(other, f"{address}?play=none")
    wait(other, lambda: newest(other, "position") is not None)
    mine = {p.pid for p in workers(server)} - before
    assert mine
    here = newest(page, "position")
    other.get_by_role("button", name="lift boom").click()
    wait(other, lambda: newest(other, "position") > 300.0)
    assert newest(page, "position") == pytest.approx(here, abs=1.0)
    other.context.close()
    wait(page, lambda: not mine & {p.pid for p in workers(server)})
    assert newest(page, "position") is not None


NAMELESS = """() => ['button', '[role=slider]', '[role=switch]', '[role=tab]', 'input:not([type=file])', 'textarea']
    .flatMap((one) => [...document.querySelectorAll(one)])
    .filter((e) => e.offsetParent !== null)
    .filter((e) => !(e.innerText || e.getAttribute('aria-label') || e.closest('label')?.innerText
                     || (e.id && document.querySelector(`label[for="${CSS.escape(e.id)}"]`))))
    .map((e) => e.outerHTML.slice(0, 200))"""


def test_every_control_has_a_name_and_a_narrow_screen_is_wide_enough(page):
    page.set_viewport_size({"width": 400, "height": 900})
    for tab in ("Live", "Machines", "Logs", "Studies", "History"):
        page.get_by_role("tab", name=tab).click()
        page.wait_for_timeout(2500)
        assert page.evaluate("document.documentElement.scrollWidth") <= 400, tab
        assert page.evaluate(NAMELESS) == [], tab
        if folder := os.environ.get("RAMSIGHT_NARROW"):  # to be looked at
            page.emulate_media(color_scheme="dark")
            page.wait_for_timeout(500)
            page.screenshot(path=Path(folder) / f"narrow-{tab}.png")
            page.emulate_media(color_scheme="light")


def serious(page):
    """What axe-core finds of the page as it is that keeps somebody out, and where; wide and narrow, light and dark."""
    wrong = []
    page.add_style_tag(
        content="*, *::before, *::after { transition: none !important }"
    )  # no colour on its way to another
    for width in (400, 1500):
        page.set_viewport_size({"width": width, "height": 1000})
        for scheme in ("dark", "light"):
            page.emulate_media(color_scheme=scheme)
            page.wait_for_function(
                "dark => document.body.classList.contains('body--dark') === dark", arg=scheme == "dark"
            )
            wrong += [(width, scheme, *one) for one in violations(page)]
    return wrong


def test_axe_finds_nothing_serious_on_any_tab(page):
    page.get_by_role("switch", name="temperature lost").click()
    page.get_by_role("button", name="lift boom").click()
    wait(page, lambda: "uncertain" in page.locator("#status-boom-kalman").inner_text())
    page.get_by_role("switch", name="hold the oil there").click()
    wait(page, lambda: page.locator("#sankey rect").count() >= 4)
    assert serious(page) == []
    page.get_by_role("tab", name="Machines").click()
    wait(page, lambda: "load at relief pressure" in page.locator("#machine-follows").inner_text())
    page.get_by_text("units.boom.cylinder", exact=True).click()
    page.locator("[id='value-units.boom.cylinder.bore']").fill("40 mm")
    page.keyboard.press("Tab")
    wait(page, lambda: "does not fit" in page.locator("#machine-said").inner_text())
    assert serious(page) == []
    page.get_by_role("tab", name="Logs").click()
    page.locator("#upload-log input[type=file]").set_input_files(TRACES / "boom_441kN_40C.csv.gz")
    wait(page, lambda: "3 channels" in page.locator("#log-said").inner_text())
    page.get_by_label("piston at first").fill("100 mm")
    page.locator("#track").click()
    page.get_by_role("link", name="download track.svg").wait_for()
    page.get_by_role("button", name="leak test").click()
    wait(page, lambda: "no leak test" in page.locator("#log-said").inner_text())
    assert serious(page) == []
    page.get_by_role("tab", name="Studies").click()
    page.get_by_label("duty", exact=True).click()
    page.get_by_role("option", name="lift-lower").click()
    page.locator("#study-start").click()
    wait(page, lambda: page.locator("#study-accuracy tbody tr").count() >= 3)
    page.locator("#study-stop").click()
    wait(page, lambda: "stopped" in page.locator("#study-said").inner_text())
    assert serious(page) == []


def test_a_machine_starts_for_who_looks_and_there_is_room_for_so_many(visitor):
    with studio("mining-loader", "--visitors", "2") as (address, server):
        for _ in range(30):
            assert answered(address)[0] == 200
        framed = urllib.request.Request(
            address, headers={"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "iframe"}
        )
        for _ in range(30):
            assert answered(framed)[0] == 403
        assert len(workers(server)) <= 1 + helpers(), "no browser has shown anything: one machine waits for the first"
        pages = [visitor() for _ in range(3)]
        for one in pages:
            one.goto(address)
            one.locator("#full, .studio").first.wait_for()
        assert [one.locator("#full").count() for one in pages] == [0, 0, 1]
        assert "--visitors" in pages[2].locator("#full").inner_text()
        assert len(workers(server)) == 2
        pages[0].close()
        wait(pages[2], lambda: len(workers(server)) == 1)

        def admitted():  # the machine has ended; the place of its visitor is free soon after
            pages[2].reload()
            pages[2].locator("#full, .studio").first.wait_for()
            return pages[2].locator(".studio").count() == 1

        wait(pages[2], admitted)
        for one in pages[1:]:
            one.context.close()


NGINX = shutil.which("nginx") or shutil.which("nginx", path="/usr/sbin:/usr/local/sbin")
PROXY = """
daemon off; pid {folder}/pid; error_log {folder}/error.log; events {{}}
http {{
  access_log off;
  client_body_temp_path {folder}/body; proxy_temp_path {folder}/proxy; fastcgi_temp_path {folder}/fastcgi;
  uwsgi_temp_path {folder}/uwsgi; scgi_temp_path {folder}/scgi;
  map $http_upgrade $upgraded {{ default upgrade; "" close; }}
  server {{
    listen 127.0.0.1:{port};
    location /rig/ {{
      proxy_pass {address};
      proxy_http_version 1.1;
      proxy_set_header Host $http_host;
      proxy_set_header X-Forwarded-Prefix /rig;
      proxy_set_header Upgrade $http_upgrade;
      proxy_set_header Connection $upgraded;
    }}
  }}
}}
"""


@contextlib.contextmanager
def proxied(address, folder):
    """A reverse proxy that serves a studio under /rig/; its address."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    (folder / "nginx.conf").write_text(PROXY.format(folder=folder, port=port, address=address))
    server = subprocess.Popen([NGINX, "-p", folder, "-c", folder / "nginx.conf"], stderr=subprocess.DEVNULL)
    try:
        wait_for(lambda: listens(port))
        yield f"http://127.0.0.1:{port}/rig/"
    finally:
        server.terminate()
        server.wait(PATIENCE)


@pytest.mark.skipif(NGINX is None, reason="needs nginx")
def test_behind_a_proxy_with_a_prefix_every_file_is_found_and_a_process_that_stands_is_told(loader, visitor, tmp_path):
    address, server = loader
    with proxied(address, tmp_path) as behind:
        page, files, wrong = visitor(), [], []
        page.on("response", lambda r: files.append(r.url) if r.status < 400 else wrong.append(f"{r.status} {r.url}"))
        page.on("pageerror", lambda error: wrong.append(str(error)))
        before = set(workers(server))
        runs(page, f"{behind}?play=none")
        wait(page, lambda: page.locator("#now-time").inner_text() != "–")
        assert [one for one in files if "/studio-assets/" in one and one.startswith(behind)]
        assert wrong == []
        assert all(one.startswith(behind) for one in files)
        process = (set(workers(server)) - before).pop()
        process.suspend()
        page.get_by_text(f"has said nothing for {STANDS:g} s").wait_for()
        wait(page, lambda: "stands" in (page.locator("body").get_attribute("class") or ""))
        process.resume()
        page.get_by_text("runs", exact=True).wait_for()
        wait(page, lambda: "stands" not in (page.locator("body").get_attribute("class") or ""))


def test_a_process_that_stands_while_another_tab_is_shown_is_told_on_the_way_back(loader, visitor):
    address, server = loader
    page = visitor()
    wrong = wrong_on(page)
    before = set(workers(server))
    runs(page, f"{address}?play=none")
    process = (set(workers(server)) - before).pop()
    page.get_by_role("tab", name="Logs").click()
    page.locator("#bar").wait_for(state="detached")
    process.suspend()
    wait(page, lambda: "stands" in (page.locator("body").get_attribute("class") or ""))
    page.get_by_role("tab", name="Live").click()
    rows = page.locator("#bar .rows")
    rows.wait_for()

    def opacity():
        return float(rows.evaluate("rows => getComputedStyle(rows).opacity"))

    wait(page, lambda: opacity() == 0.5)  # a process that a busy computer held up may have said something meanwhile
    process.resume()
    wait(page, lambda: opacity() == 1)
    nothing(wrong, page)


def test_files_of_the_server_cannot_be_read(loader):
    address, _ = loader
    for path in ("studio-assets/../server.py", "studio-assets/%2e%2e/server.py", "studio-assets//etc/passwd"):
        _, text = answered(address + path)
        assert "def serve" not in text
        assert "root:" not in text


def test_elsewhere_a_token_is_printed_and_needed(visitor):
    with studio("press", "--host", "0.0.0.0") as (address, _):
        token = re.search(r"\?token=(\S+)", address)[1]
        port = re.search(r":(\d+)/", address)[1]
        here = f"http://127.0.0.1:{port}/"
        assert answered(here)[0] == 401
        opened = visitor()
        runs(opened, f"{here}?token={token}")
        assert opened.url == here
        wait(opened, lambda: newest(opened, "position", "ram") is not None)
        opened.context.close()


RUN = """
(() => {
  const kept = studio.keeper(), numbers = (k) => [...Array(50).keys()].map((j) => 50 * k + j);
  for (let k = 0; k < 200; k++) kept.take(numbers(k).map((one) => 0.02 * one), { place: numbers(k) });
  return [kept.fine.time.length, kept.reach(), kept.between(["time", "place"], 10, 190)];
})()"""


def test_the_strips_keep_a_long_run_and_its_newest_part_in_full(page):
    fine, (first, newest_time), (time, place) = page.evaluate(RUN)
    assert 1500 <= fine <= 1650
    assert (first, newest_time) == (0.0, pytest.approx(199.98))
    assert time[0] <= 10.0 < time[1]
    assert time[-2] <= 190.0 <= time[-1]
    steps = [after - before for before, after in itertools.pairwise(time)]
    assert min(steps) > 0.0
    assert max(steps) < 0.23, "some each second"
    assert max(steps[-600:]) < 0.03, "every sample of the newest"
    assert [0.02 * one for one in place] == pytest.approx(time), "columns stay beside each other"


def test_a_run_is_looked_back_at_and_the_link_keeps_for_how_long(loader, visitor):
    page = visitor()
    runs(page, f"{loader[0]}?play=none&speed=20&span=30s")
    wait(page, lambda: page.locator("[data-span='30s']").get_attribute("aria-pressed") == "true")
    back = page.get_by_role("slider", name="back in time [s]")
    wait(page, lambda: back.is_enabled() and float(back.get_attribute("max")) > 60.0)
    first, newest_time = page.evaluate(
        "(() => { const { min, max } = studio.plots()[0].plot.scales.x; return [min, max]; })()"
    )
    assert newest_time - first == pytest.approx(30.0)
    back.focus()
    page.keyboard.press("Home")
    assert page.locator("#strips-pause").get_attribute("aria-pressed") == "true"
    shown = page.evaluate("studio.plots().map((one) => [one.plot.scales.x.min, one.plot.scales.x.max])")
    assert all(one == shown[0] for one in shown)
    assert shown[0][0] == pytest.approx(0.0, abs=0.1)
    assert back.get_attribute("aria-valuetext") == "0 to 30 s"
    page.get_by_role("button", name="all", exact=True).click()
    assert page.locator("#strips-pause").get_attribute("aria-pressed") == "false"
    wait(page, lambda: page.evaluate("studio.plots()[0].plot.scales.x.max") > newest_time)
    assert page.evaluate("studio.plots()[0].plot.scales.x.min") == pytest.approx(0.0, abs=0.1)
    wait(page, lambda: "span=all" in page.url)


LOOK_OF = """(({ plot: { series, axes } }) =>
  [series.slice(1).map((one) => one.label), axes.slice(1).map((one) => one.label),
   series.map((one) => `${one._stroke}${one.dash}`)])(studio.plots().at(-1))"""
"""Names of a strip's lines and axes, and how its lines look."""


def strip_titles(page):
    return page.locator("#strips .u-title").all_inner_texts()


def test_a_strip_of_chosen_signals_of_two_units_is_kept_by_the_link_and_keys_are_enough(page, loader, visitor):
    wait(page, lambda: page.locator("#known-learned svg").count() == 3)
    usual = strip_titles(page)
    page.locator("#strip-add").focus()
    page.keyboard.press("Enter")
    menu = page.locator(".strip details[open]")
    menu.locator("fieldset").first.wait_for()
    assert "Choose signals." in page.locator(".strip-plot").last.inner_text()
    for name in ("boom: leakage [× data sheet]", "bucket: leakage [× data sheet]", "shown: motor speed [rpm]"):
        page.get_by_label(name, exact=True).focus()
        page.keyboard.press("Space")
    assert page.get_by_label("shown: pressure A [bar]", exact=True).is_disabled(), "two axes are taken"
    assert page.get_by_label("shown: compliance [× data sheet]", exact=True).is_enabled()
    assert page.get_by_label("shown: kalman [status]", exact=True).is_disabled(), "lanes stand alone"
    assert serious(page) == []
    own = page.evaluate(LOOK_OF)
    assert own[0][:4] == ["motor speed", "boom leakage", "bucket leakage", "95 % band"]
    assert own[1] == ["rpm", "× data sheet"]
    assert len(set(own[2][1:4])) == 3, "each line has a look of its own"
    learned = page.evaluate("['boom', 'bucket'].map((one) => studio.units[one].leakage.at(-1))")
    wait(page, lambda: page.evaluate("studio.plots().at(-1).plot.data[0].length") > 10)
    assert [round(page.evaluate(f"studio.plots().at(-1).plot.data[{k}].at(-1)"), 1) for k in (2, 3)] == [
        pytest.approx(one, abs=0.2) for one in learned
    ]
    page.keyboard.press("Escape")
    menu.wait_for(state="detached")
    up = page.locator(".strip").last.get_by_role("button", name="move up")
    up.focus()
    page.keyboard.press("Enter")
    assert page.evaluate("document.activeElement.dataset.stripDo") == "up", "the focus goes with it"
    chosen = "speed+boom.leakage+bucket.leakage"
    wait(page, lambda: page.url.endswith(f"&strips=position,error,status,drive,{chosen},pressure"))
    page.get_by_role("button", name="remove: boom: error [mm]").click()
    wait(page, lambda: page.url.endswith(f"&strips=position,status,drive,{chosen},pressure"))
    other = visitor()
    runs(other, page.url)
    wait(other, lambda: len(strip_titles(other)) == 5)
    assert strip_titles(other) == strip_titles(page)
    assert strip_titles(page) == [
        usual[0], *usual[2:4], "boom: motor speed, boom leakage, bucket leakage [rpm, × data sheet]", usual[4],
    ]  # fmt: skip


def test_steps_of_a_scenario_are_marked_in_the_strips(loader, visitor):
    page = visitor()
    runs(page, f"{loader[0]}?play=ends")
    wait(page, lambda: "step 2" in str(page.evaluate("studio.timeline.marks()")))


def test_a_unit_that_is_chosen_is_what_bar_strips_and_canvases_speak_of(page):
    page.set_viewport_size({"width": 1500, "height": 420})  # most strips are off the screen
    wait(page, lambda: page.evaluate("studio.units.boom.time.length") > 20)
    assert "boom, kalman: " in page.locator("#status-said").text_content()
    with page.expect_download():
        page.locator("#strips-picture").click()
    assert page.evaluate("studio.plots().map((one) => one.plot.data[0].length > 10)") == [True] * 5
    page.get_by_role("button", name="bucket", exact=True).click()
    wait(page, lambda: page.locator("#meaning-of").inner_text().startswith("bucket, kalman"))
    wait(page, lambda: page.locator("#now-unit").inner_text() == "bucket")
    titles = page.locator("#strips .u-title").all_inner_texts()
    assert len(titles) == 5
    assert all(one.startswith("bucket: ") for one in titles)
    assert page.evaluate("studio.plots().map((one) => one.plot.axes.slice(1).map((axis) => axis.label))") == [
            ["mm"], ["mm"], [None], ["rpm", "N m"], ["bar"],
    ]  # fmt: skip
    page.locator(".space canvas[aria-label]").wait_for()
    canvases = page.evaluate("[...document.querySelectorAll('canvas')].map((one) => one.getAttribute('aria-label'))")
    assert len(canvases) == 6
    assert all(canvases)
    assert "--" not in page.locator("#strips").inner_text()
    assert page.evaluate("studio.timeline.rows([[0, 50], [10, 60], [20, 30], [55, 90], [60, 70]])") == [0, 1, 2, 0, 1]
    page.get_by_role("switch", name="temperature lost").click()
    wait(page, lambda: "oil temperature missing" in page.locator("#status-said").text_content())
    page.get_by_role("button", name="enlarge").click()
    page.locator(".circuit.large").wait_for()
    page.keyboard.press("Escape")
    page.locator(".circuit.large").wait_for(state="detached")


def test_words_that_come_move_no_card(page, loader):
    address, _ = loader
    page.goto(address)
    words, card = page.locator("#story-words li"), page.locator("[data-scenario=worn]")
    words.first.wait_for()
    top = "(e) => e.getBoundingClientRect().top - document.getElementById('story').getBoundingClientRect().top"
    before = card.evaluate(top)
    wait(page, lambda: words.count() >= 3)
    assert card.evaluate(top) == before


def test_a_page_that_is_loaded_again_keeps_tab_and_setting_and_says_what_is_gone(page):
    page.get_by_role("switch", name="torque frozen").click()
    wait(page, lambda: "faults=torque" in page.url)
    page.get_by_role("button", name="drive", exact=True).click()
    page.get_by_role("tab", name="Logs").click()
    page.locator("#upload-log input[type=file]").set_input_files(TRACES / "boom_441kN_40C.csv.gz")
    wait(page, lambda: "3 channels" in page.locator("#log-said").inner_text())
    wait(page, lambda: page.url.endswith("&strips=position,error,status,pressure&tab=Logs"))
    page.reload()
    page.locator("#upload-log").wait_for()
    page.get_by_role("tab", name="Live").click()
    page.get_by_role("switch", name="torque frozen", checked=True).wait_for()
    said = page.locator("#reloaded").inner_text()
    assert "the machine begins from the start" in said
    assert "The log boom_441kN_40C.csv.gz is gone" in said
    assert not page.locator("#strip-drive").is_visible()
    wait(page, lambda: "tab=" not in page.url)


def test_what_a_server_has_shown_that_has_gone_is_grey_and_said_to_be_old(visitor):
    with studio("press") as (address, server):
        page = visitor()
        runs(page, address)
        wait(page, lambda: newest(page, "position", "ram") is not None)
        assert page.locator("body.gone").count() == 0
        server.kill()
        page.locator("body.gone").wait_for()
        assert "what is shown is old" in page.locator("#gone").inner_text()
        assert not page.locator("#ready").is_visible()
        page.context.close()


DROPPED = """([name, text]) => {
    const held = new DataTransfer();
    held.items.add(new File([text], name));
    const event = new DragEvent("drop", { bubbles: true, cancelable: true, dataTransfer: held });
    document.body.dispatchEvent(event);
    return event.defaultPrevented;
}"""


def test_a_file_beside_its_box_is_taken_and_tracking_waits_until_it_was_looked_through(page, tmp_path):
    page.get_by_role("tab", name="Logs").click()
    page.locator("#upload-log input[type=file]").wait_for(state="attached")
    said = page.locator("#log-said")
    text = german(tmp_path).read_text(encoding="utf-8").replace("Drehmoment [%]", "Drehmoment [Nm]")
    page.get_by_label("piston at first").fill("100 mm")
    assert page.evaluate(DROPPED, ["prüfstand.csv", text]) is True
    page.get_by_text("log: prüfstand.csv", exact=True).wait_for()
    page.locator("#track").click()
    page.locator("#track-picture .uplot").wait_for()
    assert "largest" in said.inner_text() or "position" in said.inner_text()
    wrong, right = tmp_path / "druck.csv", tmp_path / "weg.csv"
    wrong.write_text("Zeit [s];Druck [bar]\n0,0;1,5\n0,1;2,5\n")
    right.write_text("Zeit [s];Weg [mm]\n0,0;100,5\n0,1;100,5\n")
    page.locator("#upload-truth input[type=file]").set_input_files(wrong)
    wait(page, lambda: "druck.csv: missing columns time_s, position_m" in said.inner_text())
    page.get_by_text("truth: none", exact=True).wait_for()
    page.locator("#upload-truth input[type=file]").set_input_files(right)
    wait(page, lambda: "weg.csv: taken as the true position, of 'Weg [mm]' in mm, 2 samples" in said.inner_text())
