"""The position as the bus sees it: no faster than a piston, at once where it may be."""

import math

import pytest

from ramsight.deploy.encoder.scale import Published

FASTEST = 0.1  # m/s


def test_a_correction_is_gone_through_at_the_fastest_velocity_of_the_piston():
    bus = Published(FASTEST)
    assert math.isnan(bus.position)
    bus.set(0.0, 0.2, True)
    assert bus.position == 0.2  # the first valid one is there at once
    bus.set(0.02, 0.3, True)
    assert bus.position == pytest.approx(0.2 + 1.1 * FASTEST * 0.02, abs=1e-12)
    bus.follow(0.12)
    assert bus.position == pytest.approx(0.2 + 1.1 * FASTEST * 0.12, abs=1e-12)
    assert bus.behind == pytest.approx(0.1 - 1.1 * FASTEST * 0.12, abs=1e-12)
    bus.follow(10.0)
    assert (bus.position, bus.behind) == (0.3, 0.0)
    bus.set(10.1, 0.0, True)
    assert bus.position == pytest.approx(0.3 - 1.1 * FASTEST * 0.1, abs=1e-12)  # downwards too


def test_a_preset_and_the_first_position_after_none_are_there_at_once():
    bus = Published(FASTEST)
    bus.set(0.0, 0.2, True)
    bus.set(0.1, 0.5, True, at_once=True)
    assert bus.position == 0.5
    bus.set(0.2, 0.1, False)
    assert (bus.position, bus.valid) == (0.5, False)
    bus.follow(5.0)
    assert bus.position == 0.5  # an invalid one is held
    bus.set(5.1, 0.1, True)
    assert bus.position == 0.1
