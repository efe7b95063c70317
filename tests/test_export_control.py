"""A control that is exported asks for what the live control asks for: as a graph, as C, as an FMU around a plant."""

import re
import subprocess

import numpy as np
import pytest
from typer.testing import CliRunner

from ramsight import machine
from ramsight.cli import app
from ramsight.closed_loop.loop import UnitLoop
from ramsight.closed_loop.referencing import LoopSettings
from ramsight.control.activity import ACTIVITIES, Activity
from ramsight.control.block import position_block
from ramsight.control.orders import INPUTS, Ask, Reason
from ramsight.control.trajectory import Limits
from ramsight.deploy.c_control import control_source, golden_control
from ramsight.deploy.c_sensor import sensor_source
from ramsight.deploy.compiler import STRICT, CompilerError, find_compiler, run
from ramsight.deploy.fmu import write_fmu
from ramsight.deploy.golden_control import golden_run
from ramsight.deploy.profiles import ControlOptions
from ramsight.duty.drive_response import IDEAL, DriveResponse
from ramsight.engine.typed_state import initial_values
from ramsight.plant.limits import limits_of
from ramsight.sensor.kalman import kalman
from ramsight.sensor.status import Status

from .control_bench import said_by, same
from .plant_bench import UNITS

COMPILER = find_compiler()
NAMES = ["mining-loader boom", "press ram", "eha-test-bench axis"]
BOOM, PREFIX = UNITS["mining-loader boom"], "ramsight_it"


LATE = DriveResponse(0.05, 0.03, bandwidth=10.0, order=2, acceleration=300.0, lost=0.02)


@pytest.fixture(scope="module", params=[*((name, IDEAL) for name in NAMES), ("mining-loader bucket", LATE)])
def driven(request):
    """A unit, its control as a graph, and a run of the live control."""
    name, drive = request.param
    unit = UNITS[name]
    block = ControlOptions(drive=drive).block(unit)
    return unit, block, golden_run(unit, block)


@pytest.fixture(scope="module")
def beside():
    """Files of a sensor, of which the control needs what is the same for all."""
    return sensor_source(kalman(BOOM), BOOM, PREFIX, "m", single=False).files


def test_orders_that_stay_at_the_inputs_give_the_commands_of_the_live_control(driven):
    unit, block, run = driven
    done = {ACTIVITIES[int(k)] for k in run.said[:, 1]}
    assert done == set(Activity) - (set() if block.by.holding.stands else {Activity.LEAK_TEST})
    said = same(unit, block, run)
    reasons = {Reason(int(k)) for k in said[:, 2]}
    assert {Reason.NONE, Reason.ASKED, Reason.SILENT, Reason.SENSOR} <= reasons


@pytest.mark.skipif(COMPILER is None, reason="there is no C compiler")
def test_c_asks_for_it_too_and_a_wrong_sample_is_noticed(driven, beside, tmp_path):
    unit, block, run_ = driven
    source = golden_control(control_source(block, unit, PREFIX, "m"), run_.rows, run_.said, unit.max_speed)
    for name, text in (beside | source.files).items():
        (tmp_path / name).write_text(text)
    strict = [*STRICT, "-Wconversion", "-Wdouble-promotion", "-DROUNDS=1"]
    build = [COMPILER, *strict, f"{PREFIX}_control.c", f"{PREFIX}_control_test.c", "-lm", "-o", "golden"]
    run(build, tmp_path)
    said = run([str(tmp_path / "golden")], tmp_path)
    assert "0 other activities" in said
    assert float(re.findall(r"difference (\S+)", said)[0]) < 1e-12
    wrong = run_.said.copy()
    wrong[len(wrong) // 2, 0] += 1e-6 * unit.max_speed
    text = golden_control(source, run_.rows, wrong, unit.max_speed).files[f"{PREFIX}_control_golden.h"]
    (tmp_path / f"{PREFIX}_control_golden.h").write_text(text)
    run(build, tmp_path)
    with pytest.raises(CompilerError, match="golden failed"):
        run([str(tmp_path / "golden")], tmp_path)


ORDER = dict.fromkeys(INPUTS, 0.0) | {
    "position": 0.3, "load": 2e5, "oil_temperature": 313.15, "leak": 1.0, "displacement": 1.0,
    "reported": 1.0, "reported_speed": np.nan, "reported_torque": np.nan,  # of which the watch says nothing
    "ask": float(Ask.POSITION), "target": np.nan, "speed": np.inf,
}  # fmt: skip


def orders(count, **changes):
    return np.tile([float(({**ORDER, **changes})[name]) for name in INPUTS], (count, 1))


def doing(said):
    return [ACTIVITIES[int(k)] for k in said[:, 1]]


def test_nothing_moves_before_it_is_told_to_and_a_stop_has_to_be_taken_back():
    block = position_block(BOOM)
    state = initial_values(block.initial)
    assert (said_by(block, orders(50), state)[:, 0] == 0.0).all()
    goes = said_by(block, orders(20, target=0.4), state)
    assert goes[-1, 0] > 10.0
    stops = said_by(block, orders(20, target=0.4, ask=float(Ask.STOP)), state)
    assert stops[7:, 0].tolist() == [0.0] * 13
    assert doing(stops)[-1] is Activity.STOPPED
    assert Reason(int(stops[-1, 2])) is Reason.ASKED
    again = said_by(block, orders(20, target=0.4), state)
    assert again[-1, 0] > 10.0
    lost = said_by(block, orders(20, target=0.4, status=float(Status.INPUT_LOST)), state)
    assert Reason(int(lost[-1, 2])) is Reason.SENSOR
    back = said_by(block, orders(20, target=0.4), state)
    assert (back[:, 0] == 0.0).all(), "a sensor that is well again moves nothing"
    assert said_by(block, orders(20, target=0.41), state)[-1, 0] > 10.0
    outside = said_by(block, orders(20, target=0.9), state)
    assert doing(outside)[-1] is Activity.MOVING, "a target beyond the stroke is none"


def test_a_load_at_the_largest_force_stops_the_rod_and_a_slower_speed_is_kept():
    block = position_block(BOOM, Limits.of(BOOM, force=2.5e5))
    free, near = (said_by(block, orders(60, target=0.4, load=load))[-1, 0] for load in (2e5, 2.4e5))
    assert 0.0 < near < free
    state = initial_values(block.initial)
    said_by(block, orders(25, target=0.4), state)
    blocked = said_by(block, orders(80, target=0.4, load=2.6e5), state)
    assert blocked[30, 0] == 0.0
    assert Reason(int(blocked[-1, 2])) is Reason.FORCE
    lowers = said_by(block, orders(60, target=0.2, load=2.6e5))
    assert lowers[-1, 0] < -10.0, "what the load helps is not held up"
    slow = said_by(position_block(BOOM), orders(60, target=0.4, speed=0.004))[-1, 0]
    assert slow < 0.5 * said_by(position_block(BOOM), orders(60, target=0.4))[-1, 0]


@pytest.mark.slow
@pytest.mark.skipif(COMPILER is None, reason="there is no C compiler")
def test_the_verb_writes_a_folder_with_a_control(tmp_path):
    runner, out = CliRunner(), tmp_path / "boom"
    base = ["export", "c", "mining-loader", "--unit", "boom", "--out", str(out)]
    limits = ["--speed", "10 mm/s", "--force", "600 kN", "--period", "10 ms", "--drive-delay", "40 ms"]
    done = runner.invoke(app, [*base, "--control", *limits])
    assert done.exit_code == 0, done.output
    assert "control: " in done.output
    header = (out / "ramsight_boom_control.h").read_text()
    assert "at most 0.01; 0: " in header
    assert "CONTROL_PERIOD 0.01" in header
    assert "commands 40 ms late, reports 40 ms late" in header
    assert "ramsight_boom_control_test.c" in (out / "README.md").read_text()
    sources = ["ramsight_boom_control.c", "ramsight_boom_control_test.c", "-lm", "-o", "test"]
    subprocess.run([COMPILER, *STRICT, "-DROUNDS=1", *sources], cwd=out, check=True)
    assert "passed" in run([str(out / "test")], out)


@pytest.mark.parametrize("option", [["--force", "1 kN"], ["--drive-delay", "40 ms"]])
@pytest.mark.parametrize("name", ["c", "fmu"])
def test_options_of_a_control_are_refused_without_one(name, option, tmp_path):
    out = tmp_path / "x.fmu"
    given = ["export", name, "mining-loader", "--unit", "boom", "--out", str(out), *option]
    done = CliRunner().invoke(app, given)
    assert done.exit_code != 0
    assert not out.exists()


@pytest.mark.slow
@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.skipif(COMPILER is None, reason="there is no C compiler")
def test_the_fmu_of_a_control_moves_a_simulated_unit(tmp_path, fmi):
    """Plant and drive of ramsight, sensor and control of the FMU: the commands are those of the loop in Python."""
    fmpy = pytest.importorskip("fmpy")
    from fmpy.validation import validate_fmu

    from .test_export_fmu import Instance

    path = write_fmu(machine.load_machine("mining-loader"), "boom", tmp_path / "c.fmu", what="control", fmi=fmi).path
    assert validate_fmu(str(path)) == []
    loop = UnitLoop(BOOM, BOOM, 0.3, 0.3 * limits_of(BOOM).load, LoopSettings(known=True, assumptions=BOOM.assumptions))
    loop.send({"boom": 0.36})
    loop.rest(4.0)
    record = loop.records["boom"]
    one = Instance(path, tmp_path / f"unzipped{fmi}")
    try:
        one.begin(start_position=0.3, start_known=True, reference_known=False)
        for k, (reported, asked) in enumerate(zip(record.reported, record.asked, strict=True)):
            one.report(reported, target=0.36 if k else 1e10)
            one.step(reported.time, 0.02)
            assert one.get("motor_speed_command") == pytest.approx(asked, abs=1e-6)
        assert max(record.asked) > 50.0
    finally:
        one.fmu.freeInstance()
    assert fmpy is not None
