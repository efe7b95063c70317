"""Laws of single parts against numbers of a textbook, and valves just below and just above where they open."""

import math
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from ramsight import machine
from ramsight.plant.accumulator import gas_capacity
from ramsight.plant.build import build
from ramsight.plant.circuit import join
from ramsight.plant.holding import Leaving
from ramsight.plant.hose import Volume, drop_over_laminar, laminar_resistance
from ramsight.plant.oil import Oil, aerated_bulk_modulus, walther_constants
from ramsight.plant.pump import friction_coefficient
from ramsight.plant.valve import CheckValve, ReliefValve

OIL = Oil(*walther_constants(313.15, 32e-6, 373.15, 6.1e-6), density=872.0, bulk_modulus=1.2e9)
LOW = 250e5  # Pa, at the outlet: no pressure of the tests is below 0


def flow(valve, difference):
    """Flow through a valve at a pressure difference [m3/s]."""
    model = join("bench", OIL, 1e5, [Volume("at_in", "in", 1e-3), Volume("at_out", "out", 1e-3), valve])
    ode = model.ode
    (expression,) = (output.expression for output in ode.outputs if output.name == f"{valve.name}.flow")
    function = ca.Function("flow", [ode.x, ode.p], [expression])
    state = np.zeros(len(ode.states))
    state[ode.state_index("pressure_in")], state[ode.state_index("pressure_out")] = LOW + difference, LOW
    return float(function(state, model.values))


@pytest.mark.parametrize("cracking", [0.0, 0.5e5, 3e5])
def test_a_check_valve_opens_at_its_cracking_pressure_and_not_before(cracking):
    valve = CheckValve("valve", "in", "out", cracking, 3.8e-6)
    for difference in (-200e5, -1e5, cracking - 10.0, cracking):
        assert flow(valve, difference) == 0.0
    for beyond in (1e4, 1e5, 10e5):
        assert flow(valve, cracking + beyond) == pytest.approx(3.8e-6 * beyond**0.5, rel=0.02)


def test_a_closed_check_valve_lets_its_leakage_pass():
    valve = CheckValve("valve", "in", "out", 1e5, 3.8e-6, closed_leak=1e-17)
    assert flow(valve, -100e5) == pytest.approx(-1e-17 / 32e-6 * 100e5, rel=1e-3, abs=0.0)


def test_a_relief_valve_opens_at_its_setting_and_grows_in_proportion():
    valve = ReliefValve("valve", "in", "out", 200e5, 1e-10)
    assert flow(valve, 200e5 - 1.0) == 0.0
    assert flow(valve, 210e5) == pytest.approx(1e-10 * 10e5, rel=1e-9, abs=0.0)


def test_a_round_line_has_the_resistance_of_hagen_and_poiseuille():
    """1 l/min of 32 mm2/s and 870 kg/m3 through 1 m of 10 mm: 1.89 kPa."""
    drop = laminar_resistance(32e-6, 870.0, 1.0, 0.01) * 1e-3 / 60.0
    assert drop == pytest.approx(128.0 * 32e-6 * 870.0 * 1e-3 / 60.0 / (math.pi * 1e-8), rel=1e-12)
    assert drop == pytest.approx(1890.7, rel=1e-3)


def test_a_pipe_turns_turbulent_at_a_reynolds_number_of_2000_and_follows_blasius_from_4000():
    assert float(drop_over_laminar(1990.0)) == pytest.approx(1.0, abs=1e-9)
    assert float(drop_over_laminar(2200.0)) > 1.005
    for reynolds in (4000.0, 2e4):
        assert float(drop_over_laminar(reynolds)) == pytest.approx(0.3164 * reynolds**0.75 / 64.0, rel=1e-6)


def test_the_gas_of_an_accumulator_is_polytropic():
    """C = -dV/dp of p V^n = const, by differences."""

    def volume(p, n):
        return 1e-3 * (2e5 / p) ** (1.0 / n)

    for n in (1.0, 1.4):
        slope = (volume(4e5 - 10.0, n) - volume(4e5 + 10.0, n)) / 20.0
        assert float(gas_capacity(4e5, 1e-3, 2e5, n)) == pytest.approx(slope, rel=1e-6)


def test_the_bulk_modulus_of_oil_with_air_is_that_of_its_volume():
    """beta = -V dp/dV of an oil whose volume is 1 - p/beta_oil and of polytropic air, by differences."""

    def volume(p, n):
        return 1.0 - p / 1.2e9 + 0.01 * (101325.0 / p) ** (1.0 / n)

    for n in (1.0, 1.4):
        by_differences = volume(5e5, n) * 20.0 / (volume(5e5 - 10.0, n) - volume(5e5 + 10.0, n))
        assert float(aerated_bulk_modulus(5e5, 1.2e9, 0.01, n)) == pytest.approx(by_differences, rel=2e-3)


def test_a_pumps_leakage_goes_with_pressure_over_viscosity():
    pump = build(machine.load_machine("mining-loader").unit("boom"), "boom").a.pump
    plain = replace(pump, orifice_leak=None, table=None)
    once = float(plain.leakage(100.0, 100e5, 46e-6, 870.0))
    assert float(plain.leakage(100.0, 100e5, 23e-6, 870.0)) == pytest.approx(2.0 * once, rel=1e-12)
    assert float(plain.leakage(100.0, 200e5, 46e-6, 870.0)) == pytest.approx(2.0 * once, rel=1e-12)


def test_beyond_its_relief_valve_what_leaves_a_side_grows_in_proportion():
    leaving = Leaving(build(machine.load_machine("mining-loader").unit("boom"), "boom"), "a")
    at = leaving.flow(leaving._most, 313.15)
    assert leaving.flow(2.0 * leaving._most, 313.15) == pytest.approx(2.0 * at, rel=1e-9)


@pytest.mark.parametrize("efficiency", [0.6, 0.9])
def test_a_pumps_friction_makes_its_hydromechanical_efficiency(efficiency):
    """Ideal torque over the torque that the pump takes is the efficiency, at the pressure where only that counts."""
    displacement, pressure = 5e-6, 250e5
    friction = friction_coefficient(displacement, efficiency) * pressure
    assert displacement * pressure / (displacement * pressure + friction) == pytest.approx(efficiency, rel=1e-12)
