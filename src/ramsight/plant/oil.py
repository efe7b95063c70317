"""The oil: how viscosity follows temperature."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import casadi as ca

_OFFSET = 0.7  # mm2/s, the constant of the Walther equation for viscosities above 2 mm2/s
_MM2 = 1e-6  # m2
T40, T100 = 313.15, 373.15  # K, the temperatures at which data sheets give viscosity


def kinematic_viscosity(temperature: Any, walther_a: Any, walther_b: Any) -> Any:
    """Kinematic viscosity [m2/s] after Walther: log10 log10(nu/(mm2/s) + 0.7) = a - b log10(T/K).

    Args:
        temperature: oil temperature [K], number or expression.
        walther_a: constant a [1].
        walther_b: constant b [1].

    Source: ASTM D341-20, eq. 1, in its form for viscosities above 2 mm2/s.

    Example:
        >>> a, b = walther_constants(313.15, 32e-6, 373.15, 6.1e-6)
        >>> round(1e6 * kinematic_viscosity(293.15, a, b), 1)
        78.2
    """
    ln10 = math.log(10.0)
    inner = ca.exp(ln10 * walther_a - walther_b * ca.log(temperature))
    return _MM2 * (ca.exp(ln10 * inner) - _OFFSET)


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
    w1, w2 = (math.log10(math.log10(nu / _MM2 + _OFFSET)) for nu in (nu1, nu2))
    b = (w1 - w2) / (math.log10(t2) - math.log10(t1))
    return w1 + b * math.log10(t1), b


@dataclass(frozen=True)
class Oil:
    """An oil as the circuit sees it.

    Args:
        walther_a, walther_b: constants of the Walther equation [1].
        density: [kg/m3], constant as in the paper.
        bulk_modulus: of the oil itself [Pa].
    """

    walther_a: float
    walther_b: float
    density: float
    bulk_modulus: float

    def viscosity(self, temperature: Any) -> Any:
        """Kinematic viscosity [m2/s] at a temperature [K]."""
        return kinematic_viscosity(temperature, self.walther_a, self.walther_b)
