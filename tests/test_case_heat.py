"""Heat of the pumps' cases: described, in a run, and in the sensor, which works out how much warmer their oil is."""

from dataclasses import replace
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

import ramsight
from evaluation.judged_errors import judge
from ramsight import machine
from ramsight.duty import DriveReport, Duty, Profile, report
from ramsight.duty.oil_warming import heats, warmed
from ramsight.duty.profile import constant
from ramsight.duty.simulate import ran
from ramsight.duty.work_day import work_day
from ramsight.engine.typed_state import column, symbols
from ramsight.errors import DescriptionError
from ramsight.plant.balance import balance
from ramsight.plant.build import build
from ramsight.plant.heat import HeatStores
from ramsight.plant.symbols import Parameters
from ramsight.sensor.inputs.oil_heat import CaseParameters, CaseState, heat_case
from ramsight.sensor.kalman import kalman

from .plant_bench import UNITS

STORES = HeatStores(case=4200.0, case_to_tank=300.0)
HEAT = '\n[units.boom.heat]\ncase = "4.2 kJ/K"\ncase_to_tank = "300 W/K"\n\n[units.boom.load]'
BOOM = machine.load_machine("mining-loader").unit("boom")
TOLD = build(BOOM.replace({"heat": {"case": 4200.0, "case_to_tank": 300.0}}), "boom")
UNTOLD = build(BOOM, "boom")


def stepped(heat, tank, elapsed, *, gap=0.0):
    """How much warmer the case is after each sample [K]."""
    table = Parameters()
    cases = CaseParameters.of(table, STORES)
    state, (power, passed, elapsed_, tank_) = symbols(CaseState()), (ca.SX.sym(n) for n in ("P", "passed", "h", "T"))
    sample = SimpleNamespace(elapsed=elapsed_, oil_temperature=tank_)
    after = heat_case(state, sample, power, passed, cases)
    step = ca.Function("step", [column(state), power, tank_, elapsed_, passed, table.column], [column(after)])
    assert dict(zip(table.names, table.values.tolist(), strict=True)) == {
        "heat.case": 4200.0, "heat.case_to_tank": 300.0,
    }  # fmt: skip
    z, found = ca.DM([0.0, 0.0]), []
    for k, watts in enumerate(heat):
        z = step(z, watts, tank[k], elapsed, elapsed + gap, table.values)
        found.append(float(z[0]))
    return np.array(found)


def test_a_case_warms_up_as_its_equation_says():
    time = 0.02 * np.arange(1, 3001)
    found = stepped(np.full(3000, 900.0), np.full(3000, 300.0), 0.02)
    np.testing.assert_allclose(found, 3.0 * (1.0 - np.exp(-time * 300.0 / 4200.0)), rtol=2e-3, atol=2e-4)


def test_a_tank_that_warms_up_as_fast_leaves_the_case_behind():
    time = 0.1 * np.arange(2000)
    found = stepped(np.zeros(2000), 300.0 + 0.05 * time, 0.1)
    assert found[-1] == pytest.approx(-0.05 * 4200.0 / 300.0, rel=1e-2), "what has to flow into it"


def test_after_a_gap_a_case_has_cooled_and_no_fault_takes_it_far():
    assert stepped(np.array([900.0]), np.array([300.0]), 0.1, gap=3600.0)[0] < 1e-4
    assert stepped(np.full(3, 1e12), np.full(3, 300.0), 0.1).max() == 60.0


@pytest.mark.parametrize("speed", [120.0, -80.0])
@pytest.mark.parametrize("name", UNITS)
def test_heat_of_the_pumps_is_that_of_the_run(name, speed):
    """Against the energies that the plant's own audit integrates."""
    unit = UNITS[name]
    load = 0.3 * float(unit.cylinder.area(unit.held)) * 100e5
    duty = Duty(Profile([0.0, 0.5], [speed, speed]), constant(load), constant(313.15), 0.5 * unit.cylinder.stroke)
    done = ran(unit, duty, sample_period=1e-3)
    into_case, _ = heats(unit, done)
    circuit = balance(unit)
    names = [done.model.ode.state_index(name) for name in circuit.states]
    p = circuit.parameters_at(circuit.values, 313.15)
    asked = [float(circuit.pump_heat(z[names], speed, p)) for z in done.trajectory.state[-101:]]
    between = 1e-3 * np.sum(0.5 * (np.array(asked[1:]) + np.array(asked[:-1])))
    assert into_case[-1] - into_case[-101] == pytest.approx(between, rel=1e-3)


def test_pumps_that_leak_more_lose_more():
    circuit = balance(UNTOLD)
    z, p = circuit.at_rest(0.3, 300e3), circuit.parameters_at(circuit.values, 313.15)
    usual = float(circuit.pump_heat(z, 0.0, p))
    assert float(circuit.pump_heat(z, 0.0, p, (1.5, 1.0, 1.0))) == pytest.approx(1.5 * usual, rel=1e-6)


@pytest.mark.slow
def test_the_sensor_follows_a_machine_that_warms_its_pumps():
    duty = work_day(UNTOLD, (60e3, 400e3), 313.15, duration=1200.0, visit_every=120.0, seed=1)
    run = warmed(UNTOLD, replace(duty, oil_temperature=constant(288.15)), STORES)
    log, found, off = report(run, DriveReport(seed=1)), {}, {}
    for name, unit in (("told", TOLD), ("untold", UNTOLD)):
        sensor = kalman(unit)
        sensor.start(duty.start_position)
        track = sensor.track(log)
        found[name] = judge(track, log["motor_speed"].values, run["position"].values, 0.7, after=3)
        off[name] = abs(float(track["leak_factor"][-1]) - 1.0)
    # Who is not told takes the warmer oil for leakage, and stops teach that too.
    assert off["told"] < 0.6 * off["untold"]
    assert found["told"].p95 < found["untold"].p95
    assert found["told"].coverage > 0.93


def test_nothing_described_is_nothing_added():
    names = kalman(UNTOLD).recursion.parameters
    assert not [name for name in names if name.startswith("heat.")]


def test_a_description_says_what_keeps_the_heat():
    text = machine.template().replace("\n[units.boom.load]", HEAT, 1)
    loaded = machine.loads(text)
    heat = loaded.unit("boom").heat
    assert (heat.case, heat.case_to_tank, heat.tank) == (4200.0, 300.0, 37e3)
    assert machine.loads(machine.template(loaded)).unit("boom").heat == heat
    with pytest.raises(
        DescriptionError, match=r"units.boom.heat.case = '0 kJ/K': out of range .allowed: at least 0.05 kJ/K"
    ):
        machine.loads(text.replace('"4.2 kJ/K"', '"0 kJ/K"'))


def test_a_run_with_the_air_given_reports_the_tank_and_goes_by_the_pumps():
    run = ramsight.simulate("mining-loader", unit="boom", load="441 kN", oil_temperature="20 degC", ambient="10 degC")
    pumps, tank = run["pump_temperature"].values, run["oil_temperature"].values
    assert pumps[0] == tank[0] == 293.15
    assert pumps[-1] > tank[-1] > 293.15
    log = ramsight.drive_report(run, temperature_step="0 K", temperature_noise="0 K")
    np.testing.assert_allclose(log["oil_temperature"].values, tank, atol=1e-9)
