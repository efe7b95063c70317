"""Kinematic viscosity of an oil from two points of its data sheet, after Walther (ASTM D341)."""

from __future__ import annotations

import math

OFFSET = 0.7
"""Constant of the Walther equation for viscosities above 2 mm2/s [mm2/s]."""
MM2 = 1e-6  # m2
T40, T100 = 313.15, 373.15
"""Temperatures at which data sheets give the viscosity [K]."""


def walther_constants(t1: float, nu1: float, t2: float, nu2: float) -> tuple[float, float]:
    """Constants (a, b) of the Walther equation from two points of a data sheet.

    Args:
        t1: first temperature [K].
        nu1: kinematic viscosity there [m2/s].
        t2: second temperature [K].
        nu2: kinematic viscosity there [m2/s].

    Example:
        >>> a, b = walther_constants(313.15, 32e-6, 373.15, 6.1e-6)
        >>> round(a, 3), round(b, 3)
        (8.7, 3.414)
    """
    w1, w2 = (math.log10(math.log10(nu / MM2 + OFFSET)) for nu in (nu1, nu2))
    b = (w1 - w2) / (math.log10(t2) - math.log10(t1))
    return w1 + b * math.log10(t1), b


def viscosity_of(nu40: float, nu100: float, temperature: float) -> float:
    """Kinematic viscosity [m2/s] at a temperature.

    Args:
        nu40: at 40 degC [m2/s].
        nu100: at 100 degC [m2/s].
        temperature: [K].

    Example:
        >>> round(1e6 * viscosity_of(46e-6, 6.8e-6, 333.15), 1)
        20.6
    """
    a, b = walther_constants(T40, nu40, T100, nu100)
    return float(MM2 * (10.0 ** (10.0 ** (a - b * math.log10(temperature))) - OFFSET))
