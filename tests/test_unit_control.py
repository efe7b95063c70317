"""Sensorless position control of a single unit, on every circuit of the catalogue."""

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from ramsight.closed_loop.loop import UnitLoop
from ramsight.closed_loop.referencing import LoopSettings
from ramsight.control.activity import Activity
from ramsight.control.position import PositionControl
from ramsight.control.thresholds import STOPPING_TIME
from ramsight.duty import simulate
from ramsight.duty.live import LiveUnit, Reported
from ramsight.duty.profile import Profile
from ramsight.errors import DescriptionError
from ramsight.plant.holding import Holding, Leaving
from ramsight.plant.limits import limits_of
from ramsight.plant.pump import Pump
from ramsight.plant.valve import Orifice, SafetyValve
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import Estimate

from .plant_bench import CIRCUITS, UNITS
from .sensor_bench import lowered

WARM, DT = 313.15, 0.02
BOOM, RAM = UNITS["mining-loader boom"], UNITS["press ram"]
PUMP_HOLDS = {"eha-test-bench axis", "eha-single-rod axis", "press ram"}
TARGETS = (0.7, 0.45)  # shares of the stroke


@lru_cache
def worked(name):
    """A loop that was homed at both ends from a position that nobody knew, and sent to targets; its errors [m]."""
    unit = UNITS[name]
    stroke = unit.cylinder.stroke
    loop = UnitLoop(unit, unit, lowered(unit, 0.07 * stroke), 0.4 * limits_of(unit).load)
    begins = loop.records[unit.name].estimate[-1].status
    loop.home(unit.name)
    loop.home(unit.name, lifted=True)
    errors = []
    for share in TARGETS:
        loop.go({unit.name: share * stroke})
        errors.append(loop.now.position[unit.name] - share * stroke)
    return loop, begins, errors


@pytest.mark.parametrize("name", CIRCUITS)
def test_a_unit_that_does_not_know_where_it_is_is_homed_and_goes_where_it_is_sent(name):
    loop, begins, errors = worked(name)
    assert begins is Status.NOT_REFERENCED
    assert not loop.stopped
    assert np.abs(errors).max() < 0.01 * UNITS[name].cylinder.stroke


@pytest.mark.parametrize("name", CIRCUITS)
def test_a_load_that_changes_at_rest_moves_the_rod_by_little(name):
    unit, (loop, _, _) = UNITS[name], worked(name)
    before, full = loop.now.position[unit.name], limits_of(unit).load
    loop.load(0.5 * full, 0.5)
    loop.rest(3.0)
    assert not loop.stopped
    assert abs(loop.now.position[unit.name] - before) < 0.01 * unit.cylinder.stroke
    turns = loop.now.motor_speed[unit.name] * unit.lift_sign
    if name in PUMP_HOLDS:
        assert turns == pytest.approx(Holding(unit).leakage(0.5 * full, WARM), rel=0.25)
    else:
        assert turns == 0.0


@pytest.mark.parametrize("name", CIRCUITS)
def test_a_sensor_that_is_lost_stops_the_motor_in_time(name):
    unit = UNITS[name]
    stroke = unit.cylinder.stroke
    loop = UnitLoop(unit, unit, 0.5 * stroke, 0.4 * limits_of(unit).load, LoopSettings(known=True))
    loop.send({unit.name: (0.5 + 0.4 * unit.lift_sign) * stroke})
    loop.rest(1.0)
    assert abs(loop.now.motor_speed[unit.name]) > 20.0
    loop.fault = lambda _, now: replace(now, motor_torque=math.nan)
    loop.rest(0.3)
    assert loop.now.motor_speed[unit.name] == 0.0
    assert loop.reasons[unit.name] == Status.INPUT_LOST.text
    loop.rest(0.5)
    assert loop.now.motor_speed[unit.name] == 0.0, "stopped is stopped, whoever holds the load"


def test_the_loop_is_the_run_that_its_commands_give():
    load = Profile([0.0, 1.0, 2.0], [50e3, 50e3, 90e3])
    loop = UnitLoop(RAM, RAM, 0.1, load, LoopSettings(known=True))
    loop.send({"ram": 0.12})
    loop.rest(3.0)
    again = simulate(RAM, loop.duty())
    assert np.abs(again["position"].values - loop.records["ram"].position).max() < 5e-6
    assert loop.loads[0] == 50e3
    assert loop.loads[-1] == 90e3


def test_a_live_unit_refuses_oil_that_its_data_do_not_reach():
    with pytest.raises(DescriptionError, match="oil temperature"):
        LiveUnit(RAM, 0.1, oil_temperature=500.0)


@pytest.mark.parametrize("name", CIRCUITS)
def test_what_leaks_is_what_the_pumps_own_law_says(name):
    unit, holding = UNITS[name], Holding(UNITS[name])
    assert holding.stands == (name not in PUMP_HOLDS)
    oil = float(unit.oil.viscosity(WARM)), float(unit.oil.density_at(WARM))
    load = 0.5 * limits_of(unit).load
    ((pump, _),) = [
        (p, sign) for p in unit.parts() if isinstance(p, Pump)
        for sign, node in ((1, p.outlet), (-1, p.inlet)) if node in _held_nodes(unit)
    ]  # fmt: skip
    leaks = float(pump.leakage(0.0, load / unit.cylinder.area(unit.held), *oil)) / pump.geared_displacement
    assert holding.leakage(load, WARM) == pytest.approx(leaks, rel=1e-9)
    assert holding.leakage(math.nan, WARM) == pytest.approx(0.0, abs=1e-6)
    assert holding.travel_per_radian(load) == pytest.approx(unit.travel_per_radian)
    assert (holding.leakage(-load, WARM) < -1.0) == (name in PUMP_HOLDS), "held by the other side, if by anything"


def _held_nodes(unit):
    from ramsight.plant.unit import side_nodes

    return side_nodes(unit, unit.held)


def test_all_that_lets_oil_out_counts_but_relief_valves_that_have_opened():
    plain = Leaving(RAM, "a").flow(100e5, WARM)
    across = replace(RAM, extra=(*RAM.extra, Orifice("short", "port_a", "tank", 3e-9)))
    assert Leaving(across, "a").flow(100e5, WARM) - plain == pytest.approx(3e-9 * math.sqrt(100e5), rel=1e-3)
    seals = replace(RAM, cylinder=replace(RAM.cylinder, seal_leak=5e-18))
    assert Leaving(seals, "a").flow(100e5, WARM) > plain
    assert Leaving(RAM, "a").flow(300e5, WARM) == pytest.approx(3.0 * plain, rel=1e-6)


def still(x, load, status=Status.OK):
    return Estimate(x, 1e-4, 0.0, load, status)


def drive(control, estimates):
    speed, commands = 0.0, []
    for k, estimate in enumerate(estimates):
        commands.append(control.step(estimate, Reported(k * DT, speed, 20.0, WARM)))
        speed = commands[-1].motor_speed
    return commands


def test_a_pump_that_holds_a_load_turns_at_rest_and_leaves_a_dead_band_alone():
    control, leaks = PositionControl(RAM), Holding(RAM).leakage(100e3, WARM)
    assert drive(control, [still(0.1, 100e3)] * 5)[-1].motor_speed == pytest.approx(leaks)
    assert drive(control, [still(0.1 - 0.9 * control.tuning.dead_band, 100e3)])[-1].motor_speed == pytest.approx(leaks)
    assert drive(control, [still(0.099, 100e3)] * 5)[-1].motor_speed > leaks + 1.0
    assert control.done
    assert drive(PositionControl(BOOM), [still(0.1, 100e3)] * 5)[-1].motor_speed == 0.0


def test_a_load_is_kept_up_without_a_reference_but_not_without_a_report():
    control, leaks = PositionControl(RAM), Holding(RAM).leakage(100e3, WARM)
    lost = [still(0.1, 100e3, Status.NOT_REFERENCED)] * 10
    assert drive(control, lost)[-1].motor_speed == pytest.approx(leaks)
    broken = drive(control, [still(0.1, 100e3), *[still(0.1, 100e3, Status.INPUT_LOST)] * 15])
    standing = next(k for k, command in enumerate(broken) if command.motor_speed == 0.0)
    assert standing * DT <= STOPPING_TIME + DT
    assert broken[-1].activity is Activity.STOPPED


def test_what_physics_does_not_allow_is_refused_by_name():
    with pytest.raises(DescriptionError, match="ram: its pump holds the load"):
        PositionControl(RAM).leak_test()
    lazy = BOOM.mapped(
        lambda part: replace(part, opening_speed=300.0 * part.opening_speed) if isinstance(part, SafetyValve) else part
    )
    with pytest.raises(DescriptionError, match="safety_a would have to be opened"):
        PositionControl(lazy)
