"""What a unit is said to be able to have, and what was found beyond its limits."""

from dataclasses import replace

import numpy as np
import pytest

import ramsight
from ramsight.api import abilities as module
from ramsight.api.abilities import abilities
from ramsight.duty.recorded import Recorded, Signal
from ramsight.duty.run_summary import refuse_torn_oil, run_cautions
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


def test_a_chamber_below_nothing_is_said_with_how_long():
    run = run_of(np.zeros(1001), np.zeros(1001))
    pressure = np.full(1001, 5e5)
    pressure[:4] = -3e5
    signals = {**run.signals, "pressure_a": Signal(pressure, "", ""), "pressure_b": Signal(np.abs(pressure), "", "")}
    assert run_cautions(Recorded(signals, {}), 90.0, 500e3) == ()
    pressure[:50] = -3e5
    (said,) = run_cautions(Recorded(signals, {}), 90.0, 500e3)
    assert said.startswith("chamber A falls to -3.0 bar absolute, for 1.0 s of 20.0 s")


@pytest.mark.parametrize(
    ("samples", "bar", "torn"), [(5, 30.0, False), (7, 30.0, True), (50, 19.0, False), (50, 21.0, True)]
)
def test_a_run_in_which_oil_pulls_for_longer_than_a_moment_is_refused(samples, bar, torn):
    """Beyond a tenth of the largest pressure, 200 bar."""
    run = run_of(np.zeros(1001), np.zeros(1001))
    pressure = np.full(1001, 5e5)
    pressure[100 : 100 + samples] = -1e5 * bar
    other = np.full(1001, 200e5)
    signals = {**run.signals, "pressure_b": Signal(other, "", ""), "pressure_a": Signal(pressure, "", "")}
    torn_run = Recorded(signals, {"unit": "boom"})
    if not torn:
        refuse_torn_oil(torn_run)
        return
    with pytest.raises(ramsight.SimulationError) as refused:
        refuse_torn_oil(torn_run)
    assert str(refused.value).startswith(f"boom: chamber A falls to -{bar:.1f} bar absolute, first at 2.00 s")


def test_a_reservoir_with_too_much_gas_pressure_gives_no_run():
    """Precharged above the tank's pressure it holds no oil that could follow the rod."""
    described = ramsight.load_machine("eha-single-rod").replace({"units.axis.parts.reservoir.precharge": "40 bar"})
    with pytest.raises(ramsight.SimulationError, match=r"axis: .* falls to -\d+\.\d bar absolute.*less precharge"):
        ramsight.simulate(described, load="2 kN")


def test_a_relief_valve_that_is_not_there_is_said():
    from ramsight.plant.valve import ReliefValve

    unit = ramsight.build("press")
    without = replace(unit, others=tuple(p for p in unit.others if not isinstance(p, ReliefValve)))
    assert "without a relief valve" in said(without)["sensors"].how
    assert "without a relief valve" not in said(unit)["sensors"].how
