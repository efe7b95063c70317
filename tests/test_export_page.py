"""The page that tries sensors: its parts in Node, and all of it in a real Chromium, from a disk, without a network."""

import json
import shutil
import subprocess
from importlib import resources
from importlib.util import find_spec

import numpy as np
import pytest

from ramsight.deploy.page import MODULES, SHOWN, _inline, write_page
from ramsight.logs import read_log

from .conftest import TRACES

NODE = shutil.which("node")
PARTS = resources.files("ramsight.deploy") / "web" / "page"
DAY = TRACES / "boom_asbuilt1_workday.csv.gz"
LARGEST = 2_000_000  # bytes
AT_ONCE = 3000.0  # ms from a log that is dropped to a position
needs_node = pytest.mark.skipif(NODE is None, reason="there is no node")
needs_zig = pytest.mark.skipif(find_spec("ziglang") is None, reason="the package ziglang is not installed")


def by_node(code, *modules):
    """What a program prints as JSON; it has the modules' names."""
    imports = "\n".join(f"import * as {name} from {json.dumps((PARTS / f'{name}.mjs').as_uri())};" for name in modules)
    done = subprocess.run(
        [NODE, "--input-type=module", "-e", f"{imports}\nconsole.log(JSON.stringify({code}))"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def read(text):
    return by_node(
        f"(({{ names, columns }}) => [names, columns.map((one) => [...one])])(csv.readTable({json.dumps(text)}))", "csv"
    )


@needs_node
@pytest.mark.parametrize(
    ("text", "names", "columns"),
    [
        ("time_s,speed_rpm\n0.00,-5\n0.02,1e3\n", ["time_s", "speed_rpm"], [[0, 0.02], [-5, 1000]]),
        ("\ufeffZeit [s];n [1/min]\r\n0,0;1.234,5\r\n0,2;-7\r\n", ["Zeit [s]", "n [1/min]"], [[0, 0.2], [1234.5, -7]]),
        ("Scope 7\nTrace: a, b\n\nZeit\tn\ns\trpm\n0,5\t1\n1,5\t2\n", ["Zeit [s]", "n [rpm]"], [[0.5, 1.5], [1, 2]]),
        ('"t";"n"\n"12:00:59,5";"3"\n"12:01:00";"4"\n', ["t", "n"], [[43259.5, 43260], [3, 4]]),
        ("t,n\n0,1\n1,\n2,x\n3,4\n", ["t", "n"], [[0, 1, 2, 3], [1, None, None, 4]]),
        ("0,1\n1,2\n", ["column 1", "column 2"], [[0, 1], [1, 2]]),
    ],
    ids=["points", "german", "preamble and units", "clock and quotes", "missing", "no heading"],
)  # fmt: skip
def test_tables_are_read_as_programs_write_them(text, names, columns):
    assert read(text) == [names, columns]


@needs_node
@pytest.mark.parametrize(
    ("text", "words"), [("", "no rows"), ("a,b\n", "no rows"), ("one\ntwo\n", "no rows of numbers")]
)
def test_a_file_without_a_table_is_refused_in_words(text, words):
    said = by_node(
        f"(() => {{ try {{ csv.readTable({json.dumps(text)}) }} catch (e) {{ return e.message }} }})()", "csv"
    )
    assert words in said


@needs_node
def test_columns_are_found_by_their_names_and_become_si_units():
    code = """(() => {
      const names = ["oil_temperature_f", "Drehmoment [kNm]", "Drehzahl (1/min)", "t_ms", "rod_position_mm"];
      const choice = columns.guess(names);
      choice.motorSpeed.reversed = true;
      const table = { names, columns: [[32, 32], [0.5, 0.5], [60, 60], [1000, 1020], [250, 250]] };
      const found = columns.quantities(table, choice);
      return Object.fromEntries(Object.entries(found).map(([name, values]) => [name, values[1]]));
    })()"""
    found = by_node(code, "columns")
    assert found["time"] == pytest.approx(0.02)  # from the first sample on
    assert found["motorSpeed"] == pytest.approx(-2.0 * np.pi)
    assert found["motorTorque"] == pytest.approx(500.0)
    assert found["oilTemperature"] == pytest.approx(273.15)
    assert found["position"] == pytest.approx(0.25)


@needs_node
def test_what_a_log_lacks_is_named_and_a_constant_stands_for_the_temperature():
    code = """(() => {
      const choice = columns.guess(["t", "speed"]);
      const without = columns.lacking(choice);
      choice.oilTemperature.constant = "40";
      return [without, columns.lacking(choice)];
    })()"""
    assert by_node(code, "columns") == [["motorTorque", "oilTemperature"], ["motorTorque"]]


def test_what_stands_in_a_script_cannot_end_it():
    assert "</script" not in _inline({"note": "</script><script>"})
    assert json.loads(_inline({"note": "</script>"})) == {"note": "</script>"}
    assert not [name for name in MODULES if not (PARTS / f"{name}.mjs").is_file()]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    if find_spec("ziglang") is None:
        pytest.skip("the package ziglang is not installed")
    out = tmp_path_factory.mktemp("page") / "try.html"
    assert write_page(out) == out.stat().st_size
    return out


@pytest.fixture(scope="module")
def browser():
    from .chromium import launched

    with launched() as found:
        yield found


@pytest.fixture
def page(browser, written):
    """The page from the disk with its first example; it must fetch nothing and have no errors."""
    from .chromium import nothing, wrong_on

    context = browser.new_context(viewport={"width": 1280, "height": 900})
    opened = context.new_page()
    wrong = wrong_on(opened, written.as_uri())
    opened.goto(written.as_uri())
    shown(opened)
    yield opened
    nothing(wrong, opened)


def shown(page):
    """Wait until the log that was chosen last is followed, and be ready to wait for the next one."""
    page.locator("body[data-samples]").wait_for()
    page.evaluate("delete document.body.dataset.samples")


def drop(page, text):
    """Drop a file onto the page, whose position is then that of before no more."""
    code = """(text) => {
      document.getElementById("position").classList.remove("known");
      const data = new DataTransfer();
      data.items.add(new File([text], "day.csv"));
      window.began = performance.now();
      document.body.dispatchEvent(new DragEvent("drop", { dataTransfer: data, bubbles: true, cancelable: true }));
    }"""
    page.evaluate(code, text)


def by_python():
    """The position in the end of the day by Python's sensor [mm]."""
    import ramsight

    return 1e3 * float(ramsight.track("mining-loader", str(DAY), unit="boom")["position"].values[-1])


def day(separator=",", comma=False):
    """The recorded day as a drive's program would export it."""
    log = read_log(DAY)
    speed, torque = log["motor_speed"].values * 30.0 / np.pi, log["motor_torque"].values
    rows = np.column_stack([log["time"].values, speed, torque, log["oil_temperature"].values - 273.15])
    text = "\n".join(separator.join(f"{value:.6f}" for value in row) for row in rows)
    heading = separator.join(("Zeit [s]", "Drehzahl [1/min]", "Drehmoment [Nm]", "Öltemperatur [°C]"))
    return f"{heading}\n{text.replace('.', ',') if comma else text}\n"


@pytest.mark.slow
def test_the_page_is_small_and_has_every_machine(written, page):
    assert written.stat().st_size <= LARGEST
    for one in SHOWN[1:]:
        page.locator("#machine").select_option(f"{one.machine} {one.unit}")
        shown(page)
        assert float(page.locator("#position").inner_text()) > 0.0
        assert abs(float(page.locator("#error").inner_text().removesuffix(" mm"))) < 5.0


@pytest.mark.slow
def test_the_example_begins_without_a_position_and_finds_it(page):
    page.locator("#speed").select_option("60")
    page.get_by_role("button", name="Play the example").click()
    page.locator("#position:not(.known)").get_by_text("unknown").wait_for()
    assert page.locator("#status-text").inner_text() == "not referenced"
    assert page.locator("#cylinder.unknown").count() == 1
    page.locator("#position.known").wait_for()
    page.get_by_role("button", name="Pause").click()
    assert page.locator("#cylinder.unknown").count() == 0
    moment = page.get_by_label("Moment of the log")
    moment.focus()
    page.keyboard.press("Home")
    assert page.locator("#position").inner_text() == "unknown"
    page.keyboard.press("End")
    assert page.locator("#position").inner_text() == f"{by_python():.1f}"
    assert page.locator("#leakage").inner_text().startswith("1.1")


@pytest.mark.slow
@pytest.mark.parametrize(("separator", "comma"), [(",", False), (";", True)], ids=["points", "decimal commas"])
def test_a_log_that_is_dropped_has_its_position_at_once(page, separator, comma):
    drop(page, day(separator, comma))
    page.locator("#position.known").wait_for()
    took = page.evaluate("performance.now() - began")
    print(f"{took:.0f} ms")
    assert took <= AT_ONCE
    assert page.locator("#position").inner_text() == f"{by_python():.1f}"
    assert page.locator("#message").inner_text() == ""


@pytest.mark.slow
def test_a_log_without_known_columns_asks_for_them(page):
    shown_before = page.locator("#position").inner_text()
    drop(page, "a,b,c,d\n" + day().partition("\n")[2])
    page.get_by_role("alert").get_by_text("Say which column is the time, the motor speed, the motor torque").wait_for()
    for label, name in (("Time", "a"), ("Motor speed", "b"), ("Motor torque", "c"), ("Oil temperature", "d")):
        page.get_by_label(f"{label}: column").select_option(label=name)
    shown(page)
    assert page.locator("#position").inner_text() == shown_before


@pytest.mark.slow
def test_a_log_without_an_end_stop_asks_for_the_position_at_the_start(page):
    text = "\n".join(day().splitlines()[:500])
    drop(page, text)
    page.get_by_role("alert").get_by_text("Enter its position at the start").wait_for()
    page.locator("summary").click()
    page.get_by_label("Position at the start").fill("100")
    page.keyboard.press("Tab")
    page.locator("#position.known").wait_for()
    assert float(page.locator("#position").inner_text()) > 100.0


@pytest.mark.slow
def test_the_browser_itself_forbids_the_page_to_send(browser, written):
    code = """() => new Promise((resolve) => {
      addEventListener("securitypolicyviolation", (event) => resolve(event.effectiveDirective));
      fetch("data:text/plain,x").catch(() => 0);
    })"""
    with browser.new_context() as context:
        opened = context.new_page()
        opened.goto(written.as_uri())
        assert opened.evaluate(code) == "connect-src"


@pytest.mark.slow
@pytest.mark.parametrize("width", [390, 1280])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_nothing_scrolls_sideways_and_nobody_is_kept_out(page, width, scheme):
    from .chromium import violations

    page.set_viewport_size({"width": width, "height": 844})
    page.emulate_media(color_scheme=scheme)
    page.locator("summary").click()
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert violations(page) == []
