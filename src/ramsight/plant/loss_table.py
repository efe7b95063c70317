"""A pump's losses from measured efficiencies over pressure, speed and viscosity.

The efficiencies of pump operation become leakage and friction torque at each point of the grid,

    q_leak = D w (1 - eta_v),    tau_fr = D dp (1/eta_hm - 1),

and these are interpolated: linear in pressure, speed and 1/viscosity. Losses vanish or level off where efficiencies
run to zero, so the losses can be read off in all four quadrants, by symmetry, without the thresholds of pressure
that tables of efficiencies need; and a table of the analytic law gives the analytic law.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from ramsight.expression import Real

Grid = tuple[tuple[tuple[float, ...], ...], ...]


def interpolate(x: Real, knots: Sequence[float], values: Sequence[Real], *, beyond: bool) -> Real:
    """Piecewise-linear interpolation on numbers or symbols.

    Args:
        knots: increasing, two or more, or one for a constant.
        beyond: go on in a straight line above the last knot; else hold the last value. Below the first it is held.

    Example:
        >>> [float(interpolate(x, (0.0, 1.0, 3.0), (0.0, 2.0, 2.0), beyond=True)) for x in (-1.0, 0.5, 2.0, 4.0)]
        [0.0, 1.0, 2.0, 2.0]
    """
    result = values[0]
    last = len(knots) - 2
    for k in range(len(knots) - 1):
        share = ca.fmax((x - knots[k]) / (knots[k + 1] - knots[k]), 0.0)
        if k < last or not beyond:
            share = ca.fmin(share, 1.0)
        result = result + share * (values[k + 1] - values[k])
    return result


@dataclass(frozen=True)
class LossTable:
    """Efficiencies of pump operation on a grid."""

    pressure: tuple[float, ...]  # pressure rises [Pa], increasing, above 0
    speed: tuple[float, ...]  # pump speeds [rad/s], increasing, above 0
    viscosity: tuple[float, ...]  # kinematic viscosities [m2/s], increasing
    # volumetric, hydromechanical: efficiencies [1] by viscosity, speed, pressure
    volumetric: Grid
    hydromechanical: Grid

    def leakage(self, displacement: Real, speed: Real, pressure_rise: Real, viscosity: Real) -> Real:
        """Leakage from outlet to inlet [m3/s], of the pressure rise's sign.

        Args:
            displacement: D [m3/rad].
            speed: [rad/s].
            pressure_rise: [Pa].
            viscosity: [m2/s].
        """
        share = [
            [[w * (1.0 - eta) for eta in row] for w, row in zip(self.speed, page, strict=True)]
            for page in self.volumetric
        ]
        # Without pressure nothing leaks: the line goes on from the lowest pressure to the origin.
        rows = [[[0.0, *row] for row in page] for page in share]
        magnitude = self._look_up(rows, (0.0, *self.pressure), speed, pressure_rise, viscosity)
        return displacement * magnitude * ca.sign(pressure_rise)

    def friction(
        self, displacement: Real, speed: Real, pressure_rise: Real, viscosity: Real, *, threshold: Real
    ) -> Real:
        """Friction torque [N m] against the rotation.

        Args:
            displacement: D [m3/rad].
            speed: [rad/s].
            pressure_rise: [Pa].
            viscosity: [m2/s].
            threshold: speed at which friction is fully developed [rad/s].
        """
        lost = [
            [[dp * (1.0 / eta - 1.0) for dp, eta in zip(self.pressure, row, strict=True)] for row in page]
            for page in self.hydromechanical
        ]
        # Down to no pressure the line of the first two points goes on, but never below nothing.
        rows = [[[self._at_rest(row), *row] for row in page] for page in lost]
        magnitude = self._look_up(rows, (0.0, *self.pressure), speed, pressure_rise, viscosity)
        return displacement * magnitude * ca.tanh(4.0 * speed / threshold)

    def _at_rest(self, row: Sequence[float]) -> float:
        if len(row) < 2:
            return 0.0
        slope = (row[1] - row[0]) / (self.pressure[1] - self.pressure[0])
        return max(row[0] - slope * self.pressure[0], 0.0)

    def _look_up(
        self, pages: Sequence[Sequence[Sequence[float]]], pressure: Sequence[float], speed: Real, rise: Real, nu: Real
    ) -> Real:
        """Interpolate magnitudes, thinnest oil last: viscosity first, which is constant for long."""
        fluidity = [1.0 / value for value in reversed(self.viscosity)]
        pages = list(reversed(pages))
        rows = [
            [interpolate(1.0 / nu, fluidity, [page[j][k] for page in pages], beyond=True) for k in range(len(pressure))]
            for j in range(len(self.speed))
        ]
        columns = [
            interpolate(ca.fabs(speed), self.speed, [row[k] for row in rows], beyond=False)
            for k in range(len(pressure))
        ]
        return ca.fmax(interpolate(ca.fabs(rise), pressure, columns, beyond=True), 0.0)
