"""Friction in round pipes from laminar through transition to turbulent flow, without a step.

Laminar below a Reynolds number of 2000 (64/Re), turbulent and smooth above 4000 (Blasius, 0.3164/Re^(1/4)), between
them a cubic in logarithms that meets both with their slopes and is monotone. Holds up to a Reynolds number of 1e5.

Source: H. Blasius, VDI-Forschungsheft 131 (1913); limits of the transition as in F. M. White, Fluid Mechanics, ch. 6.
"""

from __future__ import annotations

import math

import casadi as ca

from ramsight.expression import Real

# Reynolds numbers between which a flow may be either (White: 2000 to 4000), and Blasius's factor for smooth pipes.
_LAMINAR, _TURBULENT = 2000.0, 4000.0
_BLASIUS = 0.3164
_END = _BLASIUS * _TURBULENT**1.75 / 64.0  # what Re would be at 4000 if the flow were still laminar


def _cubic(share: Real, start: float, end: float, start_slope: float, end_slope: float) -> Real:
    """Hermite's cubic over 0 ... 1."""
    s2, s3 = share * share, share * share * share
    return (
        start * (2 * s3 - 3 * s2 + 1) + start_slope * (s3 - 2 * s2 + share) + end * (3 * s2 - 2 * s3)
        + end_slope * (s3 - s2)
    )  # fmt: skip


def _blend(value: Real, first: float, last: float, target: float, end_slope: float) -> Real:
    """In logarithms, the curve from (first, first) with slope 1 to (last, target) with `end_slope`, over `value`."""
    inside = ca.fmin(ca.fmax(value, first), last)
    span = math.log(last / first)
    share = ca.log(inside / first) / span
    curve = _cubic(share, 0.0, math.log(target / first), span, end_slope * span)
    return ca.exp(curve) * first / inside


def flow_over_laminar(laminar_reynolds: Real) -> Real:
    """Flow at a pressure difference over the flow that it would be if laminar [1], 1 or less.

    Args:
        laminar_reynolds: Reynolds number that the flow would have if it were laminar [1].

    Example:
        >>> round(float(flow_over_laminar(1000.0)), 3), round(float(flow_over_laminar(20000.0)), 3)
        (1.0, 0.298)
    """
    beyond = ca.fmax(laminar_reynolds, _END) / _END
    return _blend(laminar_reynolds, _LAMINAR, _END, _TURBULENT, 4.0 / 7.0) * ca.exp(-3.0 / 7.0 * ca.log(beyond))


def drop_over_laminar(reynolds: Real) -> Real:
    """Pressure drop at a flow over what it would be if laminar [1], 1 or more.

    Args:
        reynolds: Reynolds number of the flow [1].

    Example:
        >>> round(float(drop_over_laminar(1000.0)), 3), round(float(drop_over_laminar(10000.0)), 3)
        (1.0, 4.944)
    """
    beyond = ca.fmax(reynolds, _TURBULENT) / _TURBULENT
    return _blend(reynolds, _LAMINAR, _TURBULENT, _END, 1.75) * ca.exp(0.75 * ca.log(beyond))
