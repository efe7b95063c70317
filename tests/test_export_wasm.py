"""A sensor as WebAssembly says in Node what Python says, on golden samples and on recorded logs."""

import json
import shutil
import subprocess
import sys
from importlib.util import find_spec

import numpy as np
import pytest
from typer.testing import CliRunner

from ramsight import machine
from ramsight.cli import app
from ramsight.deploy.c_sensor import inputs_of
from ramsight.deploy.compiler import CompilerError
from ramsight.deploy.wasm import WrittenWasm, write_wasm
from ramsight.engine.recursion import replay
from ramsight.logs import read_log
from ramsight.plant.build import build
from ramsight.sensor.kalman import kalman
from ramsight.sensor.status import Status
from ramsight.sensor.thresholds import START_STD

from .conftest import trace_names

LOADER = machine.load_machine("mining-loader")
NODE = shutil.which("node")
LARGEST = 200_000  # bytes
needs_zig = pytest.mark.skipif(find_spec("ziglang") is None, reason="the package ziglang is not installed")
needs_node = pytest.mark.skipif(NODE is None, reason="there is no node")
ROWS = """
import { readFile, writeFile } from "node:fs/promises";
import { createSensor, facts } from "./MODULE";
const s = await createSensor();
const [start, std, ...rows] = new Float64Array((await readFile("rows")).buffer);
if (!s.start(start, std)) throw new Error("no start");
const out = [];
for (let k = 0; k < rows.length; k += 4) {
  const [time, motorSpeed, motorTorque, oilTemperature] = rows.slice(k, k + 4);
  const said = s.step({ time, motorSpeed, motorTorque, oilTemperature });
  out.push(...facts.outputs.map((name) => said[name]));
  if (facts.status[said.status][1] !== said.text) throw new Error(said.text);
}
await writeFile("said", new Float64Array(out));
"""


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """An exported folder of a unit of the loader."""
    made: dict[str, WrittenWasm] = {}

    def of(unit):
        if unit not in made:
            made[unit] = write_wasm(LOADER, unit, tmp_path_factory.mktemp("wasm") / unit)
        return made[unit]

    return of


def node(folder, *words):
    return subprocess.run([NODE, *words], cwd=folder, capture_output=True, text=True, check=False)


def by_node(folder, unit, rows, start):
    """All outputs of a sensor that starts at a position [m], shape (samples, outputs)."""
    (folder / "rows").write_bytes(np.concatenate([[start, START_STD], rows.ravel()]).tobytes())
    (folder / "replay.mjs").write_text(ROWS.replace("MODULE", f"ramsight_{unit}.mjs"))
    done = node(folder, "replay.mjs")
    assert done.returncode == 0, done.stderr
    return np.frombuffer((folder / "said").read_bytes()).reshape(len(rows), -1)


def compared(exported, trace):
    """Largest difference of the position from Python's on a log [m]; bands, bounds and statuses are the same."""
    unit = trace.case["unit"]
    log = read_log(trace.log)
    rows = np.column_stack([log[n].values for n in ("time", "motor_speed", "motor_torque", "oil_temperature")])
    found = by_node(exported(unit).folder, unit, rows, trace.case["x0"])
    sensor = kalman(build(LOADER, unit))
    sensor.start(trace.case["x0"])
    state = np.array([sensor.state[name] for name in sensor.recursion.state])
    rows = np.column_stack([rows, np.full(len(rows), np.nan)])
    expected = replay(sensor.recursion, inputs_of(rows), sensor.parameters, state)
    names = list(sensor.recursion.outputs)
    status = names.index("status")
    assert (found[:, status] == expected[:, status]).all()
    assert np.isfinite(expected[:, 0]).any()
    for name in ("position", "position_low", "position_high", "position_bound", "leak_factor"):
        place = names.index(name)
        np.testing.assert_allclose(found[:, place], expected[:, place], rtol=0.0, atol=1e-9)
    return np.nanmax(np.abs(found[:, 0] - expected[:, 0]))


@pytest.mark.slow
@needs_zig
def test_the_command_writes_a_small_module_that_runs_its_golden_samples(tmp_path):
    out = tmp_path / "boom-wasm"
    done = CliRunner().invoke(app, ["export", "wasm", "mining-loader", "--unit", "boom", "--out", str(out)])
    assert done.exit_code == 0, done.output
    code = (out / "ramsight_boom.wasm").read_bytes()
    assert len(code) <= LARGEST
    assert f"{len(code)} bytes of WebAssembly" in done.output
    assert ("passed" if NODE else "no Node was found") in done.output
    assert json.loads((out / "ramsight.json").read_text())["command"].startswith(
        "ramsight export wasm description.toml"
    )
    types = (out / "ramsight_boom.d.mts").read_text()
    assert "/** [rad/s] positive extends */\n  motorSpeed?: number;" in types
    assert "/** [m] lower end of the 95 % band */\n  positionLow: number;" in types


@pytest.mark.slow
@needs_zig
@needs_node
def test_the_module_asks_nothing_of_its_host_and_says_each_status_in_the_words_of_the_sensor(exported):
    folder = exported("boom").folder
    code = """
    import { readFileSync } from "node:fs";
    import { facts } from "./ramsight_boom.mjs";
    const module = new WebAssembly.Module(readFileSync("ramsight_boom.wasm"));
    console.log(JSON.stringify({ imports: WebAssembly.Module.imports(module), status: facts.status }));
    """
    (folder / "imports.mjs").write_text(code)
    said = json.loads(node(folder, "imports.mjs").stdout)
    assert said["imports"] == []
    assert said["status"] == {str(int(one)): [one.validity, one.text] for one in Status}


@pytest.mark.slow
@needs_zig
@needs_node
def test_golden_samples_that_differ_fail(exported, tmp_path):
    folder = shutil.copytree(exported("boom").folder, tmp_path / "boom")
    golden = json.loads((folder / "golden.json").read_text())
    golden["outputs"][1000][0] += 2e-9
    (folder / "golden.json").write_text(json.dumps(golden))
    done = node(folder, "test.mjs")
    assert done.returncode == 1
    assert "FAILED" in done.stdout


@pytest.mark.slow
@needs_zig
@needs_node
@pytest.mark.parametrize("name", ["boom_asbuilt1_workday", "bucket_162kN_40C"])
def test_a_recorded_log_gives_what_python_gives(exported, trace, name):
    assert compared(exported, trace(name)) <= 1e-9


@pytest.mark.slow
@pytest.mark.slow
@needs_zig
@needs_node
@pytest.mark.parametrize("name", trace_names())
def test_every_recorded_log_gives_what_python_gives(exported, trace, name):
    largest = compared(exported, trace(name))
    print(f"{name}: {largest:.2g} m")
    assert largest <= 1e-9


def test_a_package_that_is_missing_is_named_before_the_work(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ziglang", None)
    with pytest.raises(CompilerError, match=r"needs the package ziglang: pip install .ramsight\[platforms\]"):
        write_wasm(LOADER, "boom", tmp_path / "boom")
    done = CliRunner().invoke(app, ["export", "page", "--out", str(tmp_path / "try.html")])
    assert done.exit_code != 0
    assert isinstance(done.exception, CompilerError)
    assert list(tmp_path.iterdir()) == []
