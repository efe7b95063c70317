"""Homing at either end: the object that gives orders, and the graph whose orders stay at its inputs, do the same."""

import ctypes
import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ramsight import machine
from ramsight.control.activity import ACTIVITIES, Activity
from ramsight.control.homing import longest_search
from ramsight.control.orders import INPUTS, Ask, Reason
from ramsight.control.position import PositionControl
from ramsight.control.thresholds import NO_PLACE
from ramsight.deploy.c_control import control_source
from ramsight.deploy.c_sensor import sensor_source
from ramsight.deploy.compiler import STRICT, find_compiler, library
from ramsight.deploy.fmu import write_fmu
from ramsight.deploy.golden_control import Recording
from ramsight.deploy.profiles import ControlOptions
from ramsight.duty.live import Reported
from ramsight.engine.recursion import replay
from ramsight.engine.typed_state import initial_values
from ramsight.plant.limits import limits_of
from ramsight.sensor.kalman import kalman
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import Estimate

from .control_bench import parameters_of, same
from .plant_bench import UNITS

NAMES = ["mining-loader boom", "press ram", "forklift-mast lift", "mining-loader bucket"]
DT, WARM = 0.02, 313.15


@pytest.fixture(scope="module", params=[*NAMES[:3], pytest.param(NAMES[3], marks=pytest.mark.slow)])
def built(request):
    unit = UNITS[request.param]
    return unit, ControlOptions().block(unit)


@pytest.mark.parametrize(
    ("built", "known"),
    [*((name, True) for name in NAMES[:3]), pytest.param(NAMES[3], True, marks=pytest.mark.slow), ("press ram", False)],
    indirect=["built"],
)
def test_both_ends_are_homed(built, known):
    unit, block = built
    run = Recording(unit, block, 0.2, known=known)
    first = len(run.rows)
    for lifted in (False, True):
        run.home(lifted=lifted)
        run.go_on(1.0)
        assert run.loop.controls[unit.name].activity is Activity.RESTING, run.loop.reasons
    run.home(lifted=False, slow=True)
    run.send(0.3, wait=True)  # off the stop, whose load was felt on the way
    run.go_on(1.0)
    run.send(0.32, wait=True)
    run.home(lifted=True, time=3.0)
    run.home(lifted=False, time=3.0)  # back before it is there
    run.send(0.35, wait=False)
    run.go_on(1.0)
    said = same(unit, block, run)
    ends = said[said[:, 3] != NO_PLACE, 3]
    stroke = unit.cylinder.stroke
    assert ends.tolist() == ([0.0, stroke, 0.0] if unit.lift_sign > 0.0 else [stroke, 0.0, stroke])
    validity = Status(int(run.rows[first, INDEX["status"]])).validity
    assert (validity == "not referenced") is not known
    assert Status(int(run.rows[-1, INDEX["status"]])).validity in {"ok", "uncertain"}


INDEX = {name: k for k, name in enumerate(INPUTS)}


@pytest.mark.parametrize("pulls", [-0.1, 0.1])
def test_a_load_that_pulls_off_the_stop_is_held_on_it(pulls):
    """A pump-held rod on its stop: the motor stands where the load presses on the stop, and carries it where not."""
    unit = UNITS["press ram"]
    block = ControlOptions().block(unit)
    for lifted in (False, True):
        run = Recording(unit, block, 0.95 if lifted else 0.05, load=pulls)
        run.home(lifted=lifted)
        run.go_on(2.0)
        said = same(unit, block, run)
        assert Activity.RESTING is ACTIVITIES[int(said[-1, 1])]
        assert bool(said[-1, 0] != 0.0) is (lifted is (pulls > 0.0))


def test_a_sensor_that_is_lost_on_the_way_stops_the_visit(built):
    unit, block = built
    run = Recording(unit, block, 0.5)
    run.home(lifted=False, time=1.5)
    run.lose(0.5)
    said = same(unit, block, run)
    assert ACTIVITIES[int(said[-1, 1])] is Activity.STOPPED
    assert Reason(int(said[-1, 2])) is Reason.SENSOR
    assert said[-1, 0] == 0.0


class Both:
    """The live control, and the graph with orders at its inputs; `watched`: with reports of what was commanded."""

    def __init__(self, unit, block, *, watched=False):
        self.watched = watched
        self.unit, self.block = unit, block
        self.control = PositionControl(unit, block.by.limits, period=block.by.period)
        self.state, self.speed, self.k = initial_values(block.initial), 0.0, 0

    def step(self, estimate, ask=Ask.POSITION, target=math.nan, steering=0.0, says=None):
        """One sample; the estimate may be any."""
        speed, torque = says or (self.speed if self.watched else math.nan, 20.0 + self.k % 7)
        reported = Reported(self.k * DT, speed, torque, WARM)
        sensed = estimate.position, estimate.position_std, estimate.velocity, estimate.load, float(estimate.status)
        given_ = (
            *(*sensed, WARM, 1.0, 1.0, 1.0),
            *(reported.motor_speed, reported.motor_torque, float(ask), target, steering, math.inf),
        )  # fmt: skip
        said = replay(self.block.recursion, np.array([given_]), parameters_of(self.block), self.state)[0]
        asked = self.control.step(estimate, reported)
        self.speed, self.k = asked.motor_speed, self.k + 1
        assert ACTIVITIES[int(said[1])] is asked.activity
        assert said[0] == pytest.approx(asked.motor_speed, abs=1e-9 * self.unit.max_speed)
        return asked, Reason(int(said[2]))


def test_a_stop_that_is_not_there_is_given_up(built):
    unit, block = built
    both = Both(unit, block)
    both.control.home(lifted=True)
    longest = longest_search(block.by)
    goes = Estimate(0.5 * unit.cylinder.stroke, math.inf, 0.5 * block.by.limits.speed, 1e4, Status.NOT_REFERENCED)
    asked, reason = both.step(goes, Ask.HOME_LIFTED)
    while asked.activity is Activity.HOMING:
        asked, reason = both.step(goes, Ask.HOME_LIFTED)
    assert both.k * block.by.period == pytest.approx(longest, abs=2 * block.by.period)
    assert reason is Reason.NOT_FOUND
    assert asked.reason.startswith(reason.text)


@pytest.mark.parametrize(
    "status", [Status.OK, Status.NOT_REFERENCED, Status.TOO_UNCERTAIN, Status.REFERENCE_DUE, Status.INPUT_LOST]
)
@pytest.mark.parametrize("away", [0.3, 0.01])
def test_what_holds_the_rod_is_a_stop_only_where_one_may_be(built, status, away):
    unit, block = built
    both = Both(unit, block)
    both.control.home()
    end = both.control.end(lifted=False)
    place = abs(end - away * unit.cylinder.stroke)
    held = Estimate(place, 1e-3, 0.0, 1e4, status)
    for _ in range(400):
        asked, reason = both.step(held, Ask.HOME_LOWERED)
    if status is Status.INPUT_LOST:
        assert reason is Reason.SENSOR
    elif away > 0.04:
        assert reason is Reason.NO_REFERENCE
        assert asked.reason.startswith(reason.text)
    else:
        assert asked.activity is Activity.RESTING
        assert reason is Reason.NONE


def test_a_target_near_the_stop_that_is_missed_is_sought_without_the_load_that_was_felt_before(built):
    unit, block = built
    both = Both(unit, block)
    lowered, way = both.control.end(lifted=False), unit.lift_sign
    both.control.home()
    for k in range(400):  # 2 s of way, then the stop
        goes = -way * 0.3 * block.by.limits.speed if k < 100 else 0.0
        both.step(Estimate(lowered, 1e-3, goes, 2e5, Status.OK), Ask.HOME_LOWERED)
    assert both.control.activity is Activity.RESTING
    target, place, tries = lowered + way * 3e-3, lowered, set()
    both.control.move_to(target)
    for _ in range(300):
        asked, _ = both.step(Estimate(place, 1e-3, 0.0, 0.0, Status.OK), Ask.POSITION, target)
        goes = asked.activity is Activity.MOVING
        place = place + way * min(abs(target - place), 1e-4) if goes else target - way * 1e-3  # gives way when it lands
        tries.add(both.control.state["move.tries"])
    assert len(tries) > 2, "it was missed"


ASKS = st.sampled_from(["move", "lowered", "lifted", "steer", "stop", None, None])
STATUS = st.sampled_from([Status.OK, Status.OK, Status.REFERENCE_DUE, Status.NOT_REFERENCED, Status.INPUT_LOST])


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=25, deadline=None)
@given(
    steps=st.lists(st.tuples(ASKS, STATUS, st.integers(1, 300)), min_size=2, max_size=8),
    start=st.floats(0.0, 1.0),
    load=st.floats(-0.3, 0.6),
)
def test_whatever_is_asked_and_whatever_the_sensor_says_both_do_the_same(name, steps, start, load):
    """A crude rod follows the commands."""
    unit = UNITS[name]
    block = BLOCKS.setdefault(name, ControlOptions().block(unit))
    both, stroke = Both(unit, block, watched=True), unit.cylinder.stroke
    x, force, travel = start * stroke, load * limits_of(unit).load, unit.travel_per_radian
    ask, target = Ask.POSITION, math.nan
    for what, status, count in steps:
        control = both.control
        if what == "move":
            anew = 0.1 * stroke if target != 0.1 * stroke else 0.7 * stroke
            ask, target = Ask.POSITION, anew
            control.move_to(target)
        elif what in {"lowered", "lifted"}:
            new = Ask.HOME_LIFTED if what == "lifted" else Ask.HOME_LOWERED
            if new is not ask:
                control.home(lifted=what == "lifted")
            ask, target = new, math.nan
        elif what == "steer":
            if ask is not Ask.STEER:
                control.steer(0.3 * block.by.limits.speed)
            ask, target = Ask.STEER, math.nan
        elif what == "stop":
            control.stop("asked to stop")
            ask, target = Ask.STOP, math.nan
        for _ in range(count):
            before, x = x, min(max(x + travel * both.speed * DT, 0.0), stroke)
            estimate = Estimate(x, 1e-4, (x - before) / DT, force, status)
            both.step(estimate, ask, target, 0.3 * block.by.limits.speed)


BLOCKS = {}


SHIM = """
#include "ramsight_boom_control.h"
double boom_cycle(ramsight_boom *, ramsight_boom_control *, const ramsight_boom_inputs *, double);
static ramsight_boom sensor;
static ramsight_boom_control control;
void begin(void) { ramsight_boom_init(&sensor); ramsight_boom_control_init(&control); }
double cycle(const double *row, double target, int first) {
  const ramsight_boom_inputs in = {.time = row[0], .motor_speed = row[1], .motor_torque = row[2],
                                   .oil_temperature = row[3]};
  ramsight_boom_outputs out;
  if (!first) return boom_cycle(&sensor, &control, &in, target);
  ramsight_boom_step(&sensor, &in, &out);
  return 0.0;
}
"""


@pytest.mark.slow
@pytest.mark.skipif(find_compiler() is None, reason="there is no C compiler")
def test_the_pages_cycle_goes_home_and_to_its_target_as_python_does(tmp_path):
    """Plant and drive of ramsight; sensor, control and the page's function in C, from unreferenced to the target."""
    unit = UNITS["mining-loader boom"]
    block = ControlOptions().block(unit)
    run = Recording(unit, block, 0.1, known=False)
    run.home(lifted=False)
    run.send(0.1, wait=True)
    record, target = run.loop.records["boom"], 0.1 * unit.cylinder.stroke
    page = (Path(__file__).parent.parent / "docs" / "how-to" / "c-control.md").read_text(encoding="utf-8")
    *_, cycle = re.findall(r"```c\n(.*?)```", page, flags=re.DOTALL)
    sensor = sensor_source(kalman(unit), unit, "ramsight_boom", "m", single=False).files
    control = control_source(block, unit, "ramsight_boom", "m").files
    files = {**sensor, **control, "cycle.c": cycle, "shim.c": SHIM}
    library(find_compiler(), files, tmp_path / "cycle.so", *STRICT)
    made = ctypes.CDLL(str(tmp_path / "cycle.so"))
    made.cycle.restype = ctypes.c_double
    made.begin()
    for k, (reported, asked) in enumerate(zip(record.reported, record.asked, strict=True)):
        row = reported.time, reported.motor_speed, reported.motor_torque, reported.oil_temperature
        said = made.cycle((ctypes.c_double * 4)(*row), ctypes.c_double(target), k == 0)
        assert said == pytest.approx(asked, abs=1e-6)
    assert abs(record.position[-1] - target) < 2e-3


@pytest.mark.slow
@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.skipif(find_compiler() is None, reason="there is no C compiler")
def test_an_fmu_that_knows_nothing_finds_its_place_and_tells_its_sensor(tmp_path, fmi):
    """Plant and drive of ramsight, sensor and control of the FMU: estimates and commands are those of Python's loop."""
    pytest.importorskip("fmpy")
    from .test_export_fmu import Instance

    unit = UNITS["mining-loader boom"]
    run = Recording(unit, ControlOptions().block(unit), 0.1, known=False)
    run.home(lifted=False)
    run.go_on(0.5)
    run.send(0.1, wait=True)
    path = write_fmu(machine.load_machine("mining-loader"), "boom", tmp_path / "c.fmu", what="control", fmi=fmi).path
    one = Instance(path, tmp_path / "unzipped")
    record = run.loop.records["boom"]
    try:
        one.begin(start_known=False, reference_known=False)
        samples = zip(run.rows, record.reported, record.estimate, record.asked, strict=True)
        for row, reported, estimate, asked in samples:
            target = row[INDEX["target"]]
            one.report(reported, ask=row[INDEX["ask"]], target=1e10 if math.isnan(target) else target)
            one.step(reported.time, DT)
            assert one.get("position_std") == pytest.approx(estimate.position_std, rel=1e-6, nan_ok=True)
            assert one.get("motor_speed_command") == pytest.approx(asked, abs=1e-6)
        assert record.estimate[-1].status is Status.OK
    finally:
        one.fmu.freeInstance()
