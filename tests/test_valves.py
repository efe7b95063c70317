"""Valves alone, against their data: what they let pass just below and just above the pressure at which they open."""

import casadi as ca
import numpy as np
import pytest

from ramsight.plant.circuit import join
from ramsight.plant.hose import Volume
from ramsight.plant.oil import Oil, walther_constants
from ramsight.plant.valve import CheckValve, ReliefValve

OIL = Oil(*walther_constants(313.15, 32e-6, 373.15, 6.1e-6), density=872.0, bulk_modulus=1.2e9)
LOW = 50e5  # Pa, at the outlet


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
    assert flow(valve, -100e5) == pytest.approx(-1e-17 / 32e-6 * 100e5, rel=1e-3)


def test_a_relief_valve_opens_at_its_setting_and_grows_in_proportion():
    valve = ReliefValve("valve", "in", "out", 200e5, 1e-10)
    assert flow(valve, 200e5 - 1.0) == 0.0
    assert flow(valve, 210e5) == pytest.approx(1e-10 * 10e5, rel=1e-9)
