"""The leak test's interval holds pumps whose losses are not quite what is described, by a law or by a table."""

from dataclasses import replace
from functools import lru_cache

import pytest

from ramsight import machine
from ramsight.calibration.leakage import leak_test
from ramsight.plant.ddh import build_ddh

from .plant_bench import tabulated
from .test_leakage import log_of, worn

BOOM = build_ddh("boom", machine.load_machine("mining-loader").unit("boom"))
MOVES, LOAD, KELVIN = [(60, 5.0), (100, 5.0)], 441e3, 318.15
BAND = 1.96


def with_pumps(unit, change):
    return replace(
        unit, **{side: replace(getattr(unit, side), pump=change(getattr(unit, side).pump)) for side in ("a", "b")}
    )


def leakier(pump):
    """By a table whose losses are not those of its nominal point: a fifth more leakage."""
    return tabulated(pump, lambda value: 1.0 - 1.2 * (1.0 - value))


@lru_cache
def as_described(unit):
    return leak_test(unit, log_of(unit, MOVES, LOAD, KELVIN, seed=4))


@pytest.mark.parametrize(
    "losses",
    [
        lambda pump: replace(pump, hydromechanical_efficiency=pump.hydromechanical_efficiency - 0.01),
        lambda pump: replace(pump, hydromechanical_efficiency=pump.hydromechanical_efficiency + 0.02),
        lambda pump: replace(pump, no_load_torque=1.25 * pump.no_load_torque),
        lambda pump: replace(pump, no_load_torque=0.75 * pump.no_load_torque),
    ],
    ids=["efficiency 0.01 less", "efficiency 0.02 more", "no-load torque a quarter more", "a quarter less"],
)
def test_the_interval_holds_losses_that_are_not_as_described(losses):
    made = with_pumps(worn(BOOM, 1.15), losses)
    found = leak_test(BOOM, log_of(made, MOVES, LOAD, KELVIN, seed=4))
    assert abs(found.factor - 1.15) <= BAND * found.std
    assert BAND * found.std < 0.08  # an interval that says nothing would hold anything


@pytest.mark.slow
def test_a_loss_table_is_the_law_of_the_leak_test():
    """A machine that is its table has the factor 1 of it, not the 1.2 of the nominal point."""
    unit = with_pumps(BOOM, leakier)
    found = as_described(unit)
    assert found.factor == pytest.approx(1.0, abs=0.02)
    assert abs(found.factor - 1.0) <= BAND * found.std
    analytic = leak_test(BOOM, log_of(unit, MOVES, LOAD, KELVIN, seed=4))
    assert analytic.factor == pytest.approx(1.2, abs=0.03)


def test_a_tables_friction_is_believed_no_further_than_a_laws():
    law, table = as_described(BOOM), as_described(with_pumps(BOOM, leakier))
    assert all(stretch.systematic > 0.005 for stretch in table.stretches)
    # Of a law the no-load torque comes on top, which a table has in it.
    assert 0.5 < table.stretches[0].systematic / law.stretches[0].systematic < 3.0


def test_wear_beyond_a_table_is_found():
    unit = with_pumps(BOOM, leakier)
    found = leak_test(unit, log_of(worn(unit, 1.25), MOVES, LOAD, KELVIN, seed=4))
    assert found.factor == pytest.approx(1.25, rel=0.02)
