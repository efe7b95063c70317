"""Pages that are written for people show hostile names as text: in a real Chromium nothing of them runs."""

import gzip
import shutil
from pathlib import Path

import numpy as np
import pytest
import xarray
from typer.testing import CliRunner

import ramsight
from film import animation
from ramsight.cli import app
from ramsight.plant.linked import build_linked

pytestmark = pytest.mark.slow

playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright (extra dev)")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
if CHROMIUM is None:
    pytest.skip("needs a Chromium", allow_module_level=True)

RUNS = "<script>window.hit=1</script><img src=x onerror=window.hit=2><!--<script>\"'&lt;@DATA@"
CATALOGUE = Path(ramsight.__file__).parent / "machine" / "catalogue" / "machines"
TRACE = Path(__file__).parent / "traces" / "boom_441kN_40C.csv.gz"


@pytest.fixture(scope="module")
def shown():
    """What a page shows, once it has loaded; nothing of it may run."""
    with playwright.sync_playwright() as p:
        browser = p.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])

        def look(file: Path) -> str:
            page, wrong = browser.new_page(), []
            page.on("pageerror", lambda error: wrong.append(str(error)))
            page.on("dialog", lambda one: wrong.append(one.message))
            page.goto(file.as_uri())
            page.wait_for_timeout(200)
            assert page.evaluate("window.hit ?? null") is None
            assert wrong == []
            text = page.evaluate("(document.body ?? document.documentElement).textContent")
            page.close()
            return str(text)

        yield look
        browser.close()


def described(folder: Path) -> Path:
    """The loader, with names that would run if a page took them for HTML."""
    text = (CATALOGUE / "mining-loader.toml").read_text()
    quoted = "'''" + RUNS + "'''"
    named = ("title =", "description =")
    lines = [f"{one.split(' = ')[0]} = {quoted}" if one.startswith(named) else one for one in text.splitlines()]
    file = folder / "machine.toml"
    file.write_text("\n".join(lines).replace('source = "', f'source = "{RUNS.replace(chr(34), "")} ', 3))
    return file


def done(*words: str) -> str:
    result = CliRunner().invoke(app, list(words))
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.output


def test_the_report_of_a_commissioning(shown, tmp_path):
    machine, log, written = (
        described(tmp_path), tmp_path / "<img src=x onerror=window.hit=3>.csv", tmp_path / "map.toml",
    )  # fmt: skip
    rows = gzip.decompress(TRACE.read_bytes()).decode().splitlines()[1:400]
    names = [f"{one} {RUNS.replace(',', '')}".replace('"', "") for one in ("t", "n", "m", "oil")]
    log.write_text("\n".join([",".join(names), *rows]) + "\n")
    roles = zip(("time", "speed", "torque", "temperature"), names, ("s", "rpm", "N m", "degC"), strict=True)
    written.write_text("".join(f"{role} = {{channel = '''{name}''', unit = '{unit}'}}\n" for role, name, unit in roles))
    said = done(
        "commission", str(machine), str(log), "--unit", "boom", "--map", str(written), "--out", str(tmp_path / "r.html")
    )
    assert (tmp_path / "r.html").exists(), said
    text = shown(tmp_path / "r.html")
    assert RUNS in text
    assert log.name in text
    assert names[1] in text


def test_the_drawing_of_a_circuit(shown, tmp_path):
    out = tmp_path / "circuit.svg"
    done("draw", str(described(tmp_path)), "--unit", "boom", "--out", str(out))
    assert "boom" in shown(out)


def test_the_loader_that_works(shown, tmp_path):
    """Its data stand in a script, where another rule holds than in HTML."""
    loader = build_linked(ramsight.load_machine("mining-loader"))
    times, places = np.array([0.0, 1.0]), {"boom": 0.3, "bucket": 0.3}
    units = [
        {"name": name, "status": np.zeros(2, dtype=int), "position": np.full(2, at), "estimate": np.full(2, at)}
        | {"std": np.full(2, 1e-3), "error": np.zeros(2)}
        for name, at in places.items()
    ]
    run = xarray.Dataset({"payload": ("time", np.zeros(2))}, {"time": times})
    seen = animation._poses(loader, units, times, lambda _: None)
    text = animation.page_text(loader, run, units, seen, times, [(RUNS, 0.0)], RUNS, {"0": RUNS})
    (tmp_path / "loader.html").write_text(text)
    assert shown(tmp_path / "loader.html").count(RUNS) >= 1
