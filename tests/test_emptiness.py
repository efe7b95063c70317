"""Whether the oil gives the piston a force: what is no load, and what is only a light one."""

import casadi as ca
import pytest

from ramsight.sensor.circuit.emptiness import Emptiness, EmptyState, emptiness, not_risen
from ramsight.sensor.thresholds import MEMORY_TIME, SURE_STDS, TORQUE_OFFSET


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


OFFSET = SURE_STDS * TORQUE_OFFSET * Mast.relief_torque / Mast.travel_per_radian  # N


def seen(load, *, carried=0.0, since=0.0, std=10.0, friction=0.0, sample=Lowered):
    state = EmptyState(since=ca.DM(since), carried=ca.DM(carried))
    return emptiness(state, None, ca.DM(load), ca.DM(std**2), ca.DM(friction), ca.DM(0.1), sample, Mast)


@pytest.mark.parametrize(
    ("load", "carried", "none"),
    [
        (0.0, 0.0, True), (39.0, 0.0, True), (41.0, 0.0, False), (0.5 * OFFSET, 0.0, False),
        (0.5 * OFFSET, 20e3, True), (0.99 * OFFSET, 20e3, True), (1.1 * OFFSET, 20e3, False),
        (0.9 * OFFSET, 1.9 * OFFSET, False),
    ],
)  # fmt: skip
def test_a_load_is_none_within_four_of_its_deviations_and_an_offset_if_it_has_gone(load, carried, none):
    """Of a load that has gone an offset of the torque may be left; one that falls by half is a load."""
    assert bool(seen(load, carried=carried).may_be) == none


def test_what_was_carried_is_remembered_while_there_may_be_none():
    fading = seen(0.5 * OFFSET, carried=20e3)
    kept = seen(0.5 * OFFSET, carried=20e3, since=0.5)
    assert float(fading.state.carried) == pytest.approx(20e3 * (1.0 - 0.02 / MEMORY_TIME), rel=1e-3)
    assert float(kept.state.carried) == 20e3
    assert bool(kept.surely)
    assert not bool(fading.surely), "a load that bounces comes back"


def test_a_pump_that_delivers_carries_its_load():
    class Raised(Lowered):
        extending_speed = ca.DM(100.0)

    assert not bool(seen(0.0, carried=20e3, sample=Raised).may_be)


def risen(by, *, speed=-100.0, last=100.0, may_be=True, acts_on_both=False):
    """Travel [m] and velocity after a sample by which the balance has the piston go so far, and how high it may fly."""

    class Stopped(Lowered):
        extending_speed, last_extending_speed = ca.DM(speed), ca.DM(last)

    state = None if acts_on_both else EmptyState(since=ca.DM(0.0), carried=ca.DM(0.0))
    empty = Emptiness(state, 1.0, ca.DM(may_be), ca.DM(0))
    before, after = ca.DM([0.2, 0.3, 1e6]), ca.DM([0.2 + by, 0.3, 0.0])
    z, flies = not_risen(after, before, empty, Stopped, Mast)
    assert float(z[2]) == 0.0
    return float(z[0]) - 0.2, float(z[1]), float(flies)


def test_a_load_that_was_thrown_up_does_not_take_its_piston_with_it():
    """At 0.1 m/s it flies 0.5 mm high."""
    assert risen(0.01) == pytest.approx((0.0, 0.0, 0.1**2 / (2.0 * 9.80665)))
    assert risen(0.01, last=-100.0) == pytest.approx((0.0, 0.0, 0.0)), "of a load that is lowered nothing flies"


@pytest.mark.parametrize("how", [{"may_be": False}, {"acts_on_both": True}])
def test_oil_that_gives_a_force_lifts_its_piston(how):
    assert risen(0.01, **how) == pytest.approx((0.01, 0.3, 0.0))


def test_a_piston_without_a_load_sinks():
    assert risen(-0.01) == pytest.approx((-0.01, 0.3, 0.0))
