"""Whether the oil gives the piston a force: what is no load, and what is only a light one."""

import casadi as ca
import pytest

from ramsight.sensor.emptiness import EmptyState, emptiness
from ramsight.sensor.thresholds import LOAD_MEMORY, NO_LOAD_GATE, TORQUE_OFFSET


class Mast:
    """A machine whose pump acts on one side only: 1 mm per radian, 50 kN and 50 N m at its relief valve."""

    passive = False
    balance = None
    lift = 1.0
    relief_torque = 50.0
    travel_per_radian = 1e-3


class Lowered:
    """A sample while it is lowered."""

    extending_speed = ca.DM(-100.0)
    elapsed = ca.DM(0.02)


OFFSET = NO_LOAD_GATE * TORQUE_OFFSET * Mast.relief_torque / Mast.travel_per_radian  # N


def seen(load, *, carried=0.0, since=0.0, std=10.0, friction=0.0, sample=Lowered):
    state = EmptyState(since=ca.DM(since), carried=ca.DM(carried))
    return emptiness(state, None, ca.DM(load), ca.DM(std**2), ca.DM(friction), ca.DM(0.1), sample, Mast)


@pytest.mark.parametrize(("load", "none"), [(0.0, True), (39.0, True), (41.0, False), (0.5 * OFFSET, False)])
def test_a_load_that_stays_is_none_within_four_of_its_deviations(load, none):
    assert bool(seen(load).may_be) == none


@pytest.mark.parametrize(("load", "none"), [(0.5 * OFFSET, True), (0.99 * OFFSET, True), (1.1 * OFFSET, False)])
def test_of_a_load_that_has_gone_an_offset_of_the_torque_may_be_left(load, none):
    assert bool(seen(load, carried=20e3).may_be) == none


def test_a_load_that_falls_by_half_is_a_load():
    assert not bool(seen(0.9 * OFFSET, carried=1.9 * OFFSET).may_be)


def test_what_was_carried_is_remembered_while_there_may_be_none():
    fading = seen(0.5 * OFFSET, carried=20e3)
    kept = seen(0.5 * OFFSET, carried=20e3, since=0.5)
    assert float(fading.state.carried) == pytest.approx(20e3 * (1.0 - 0.02 / LOAD_MEMORY), rel=1e-3)
    assert float(kept.state.carried) == 20e3
    assert bool(kept.surely)
    assert not bool(fading.surely), "a load that bounces comes back"


def test_a_pump_that_delivers_carries_its_load():
    class Raised(Lowered):
        extending_speed = ca.DM(100.0)

    assert not bool(seen(0.0, carried=20e3, sample=Raised).may_be)
