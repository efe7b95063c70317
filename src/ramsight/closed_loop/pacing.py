"""Cylinders that move together: how fast each may go."""

from __future__ import annotations

from collections.abc import Mapping

from ramsight.control.trajectory import Limits


def together(ways: Mapping[str, tuple[Limits, float]]) -> dict[str, tuple[float, float]]:
    """Velocities [m/s] and accelerations [m/s2] with which cylinders do the same shares of their ways at any time.

    Args:
        ways: limits and way [m] of each.

    Example:
        >>> slow, fast = Limits(0.05, 0.1, 0.01, 0.02), Limits(0.1, 0.1, 0.01, 0.02)
        >>> together({"boom": (slow, 0.2), "bucket": (fast, -0.1)})
        {'boom': (0.05, 0.1), 'bucket': (0.025, 0.05)}
    """
    moving = {name: (limits, abs(way)) for name, (limits, way) in ways.items() if way != 0.0}
    speed = min((limits.speed / way for limits, way in moving.values()), default=0.0)
    slope = min((limits.acceleration / way for limits, way in moving.values()), default=0.0)
    still = {name: (limits.speed, limits.acceleration) for name, (limits, _) in ways.items()}
    return still | {name: (speed * way, slope * way) for name, (_, way) in moving.items()}
