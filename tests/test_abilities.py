"""What a unit is said to be able to have, and what was found beyond its limits."""

from dataclasses import replace

import numpy as np
import pytest

import ramsight
from ramsight.api import abilities as module
from ramsight.api.abilities import abilities
from ramsight.duty.recorded import Recorded, Signal
from ramsight.duty.run_figures import run_cautions
from ramsight.plant.holding import held_by_valve

from .test_rehearsal import UNITS


def said(unit):
    return {one.what: one for one in abilities(unit)}


@pytest.mark.parametrize("name", UNITS)
def test_what_holds_the_load_decides_what_a_unit_can_have(name):
    unit = ramsight.build(*UNITS[name])
    found, by_valve = said(unit), held_by_valve(unit)
    assert by_valve == (name in ("boom", "bucket", "forklift"))
    assert ("against the closed valve" in found["leak test"].how) == by_valve
    assert ("stiffness, friction" in found["identify"].how) == by_valve
    assert ("the motor stands" in found["control"].how) == by_valve
    assert [one.what for one in found.values() if not one.can] == ["faults"], "unless further signals are declared"


def test_what_is_declared_decides_which_faults_show():
    unit = ramsight.build("press")
    assert "next reference" in said(unit)["faults"].how

    def declaring(**more):
        changed = {name.replace("_", ".", 1): value for name, value in more.items()}
        return said(replace(unit, assumptions=unit.assumptions.replace(changed)))["faults"].how

    both = declaring(shaft_std=1e-3, power_std=0.01)
    assert both == "wrong and named: speed, counter; seen, not which: torque, DC power"
    assert declaring(shaft_std=1e-3) == "seen, not which: speed, counter; unseen before a reference: torque"
    assert "pressures" in declaring(pressure_std=1e5)


def test_pumps_that_hardly_leak_have_no_leak_test():
    tight = ramsight.AsBuilt(leak=0.05).apply(ramsight.build("forklift-mast"))
    found = said(tight)["leak test"]
    assert not found.can
    assert "slower than it can" in found.how


def test_what_is_not_installed_is_named(monkeypatch):
    monkeypatch.setattr(module, "find_compiler", lambda: None)
    monkeypatch.setattr(module, "find_spec", lambda name: None)
    found = said(ramsight.build("press"))
    assert "no C compiler here" in found["export"].how
    assert not found["encoder"].can
    assert "ramsight[can]" in found["encoder"].how


def run_of(torque, load):
    data = {"time": 0.02 * np.arange(len(torque)), "motor_torque": torque, "load": load}
    return Recorded({name: Signal(values, "", "") for name, values in data.items()}, {})


def test_torque_and_load_beyond_their_limits_are_said_with_how_long():
    torque, load = np.zeros(1001), np.full(1001, 100e3)
    torque[:5] = 200.0
    assert run_cautions(run_of(torque, load), 90.0, 500e3) == ()
    torque[100:250] = -95.0
    load[7] = 600e3
    by_torque, by_load = run_cautions(run_of(torque, load), 90.0, 500e3)
    assert "up to 200.0 N m, it has 90 N m: 3.1 s of 20.0 s" in by_torque
    assert "600 kN, is more than the 500 kN" in by_load


@pytest.mark.parametrize(("times", "is_said"), [(2.9, False), (3.1, True)])
def test_a_torque_far_beyond_the_motors_is_said_however_short(times, is_said):
    torque = np.zeros(1001)
    torque[[100, 500]] = times * 90.0
    said = run_cautions(run_of(torque, np.zeros(1001)), 90.0, 500e3)
    assert bool(said) == is_said
    if is_said:
        assert "0.04 s of 20.0 s are beyond that" in said[0]


def test_a_chamber_whose_oil_tears_is_said_with_how_long():
    run = run_of(np.zeros(1001), np.zeros(1001))
    pressure = np.full(1001, 5e5)
    pressure[:4] = 0.0
    signals = {**run.signals, "pressure_a": Signal(pressure, "", ""), "pressure_port_b": Signal(pressure + 9e2, "", "")}
    assert run_cautions(Recorded(signals, {}), 90.0, 500e3) == ()
    pressure[:50] = 0.0
    (said,) = run_cautions(Recorded(signals, {}), 90.0, 500e3)
    assert said.startswith("the oil tears in chamber A, for 1.0 s of 20.0 s")


def test_a_relief_valve_that_is_not_there_is_said():
    from ramsight.plant.valve import ReliefValve

    unit = ramsight.build("press")
    without = replace(unit, extra=tuple(p for p in unit.extra if not isinstance(p, ReliefValve)))
    assert "without a relief valve" in said(without)["sensors"].how
    assert "without a relief valve" not in said(unit)["sensors"].how
