"""The oil: viscosity and density over temperature, stiffness over pressure with the air that is in it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import casadi as ca

from ramsight.expression import Real, Scalar
from ramsight.machine.viscosity import MM2, OFFSET, T40, T100, walther_constants

__all__ = [
    "ATMOSPHERE", "DRY", "MINERAL_EXPANSION", "T15", "T40", "T100", "Oil", "aerated_bulk_modulus", "free_air",
    "held_share", "kinematic_viscosity", "pressure_viscosity_factor", "thermal_density", "torn_capacity",
    "torn_volume", "trapped_expansion", "walther_constants",
]  # fmt: skip

T15 = 288.15  # K, the temperature at which they give density
ATMOSPHERE = 101325.0
"""Pressure of the standard atmosphere [Pa], ISO 2533."""
_STEEL = 3.0 * 11.7e-6  # 1/K, thermal expansion of a steel barrel's volume; DIN EN 10088 and its kind, 20 to 100 degC
DRY = -1e7
"""State of a node's pressure without any oil [Pa]: far, beside the 10 Pa that a step may be off by."""
_FLOOR = 2e3  # Pa; about the pressure at which an oil gives off vapour and air, [G]


def kinematic_viscosity(temperature: Real, walther_a: Real, walther_b: Real) -> Scalar:
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
    return MM2 * (ca.exp(ln10 * inner) - OFFSET)


MINERAL_EXPANSION = 7e-4
"""Thermal expansion of mineral oil [1/K], a of `thermal_density`; data sheets of hydraulic oils say 6.5 to 7.5e-4."""


def thermal_density(temperature: Real, density: Real, expansion: Real) -> Real:
    """Density [kg/m3] at a temperature: rho (1 - a (T - 15 degC)).

    Args:
        temperature: [K].
        density: at 15 degC [kg/m3].
        expansion: a [1/K], about 7e-4 for mineral oil.

    Source: linear thermal expansion of mineral oils, in its usual form; holds from about -20 to 100 degC.

    Example:
        >>> round(thermal_density(313.15, 872.0, 7e-4), 1)
        856.7
    """
    return density * (1.0 - expansion * (temperature - T15))


def trapped_expansion(temperature: Real, expansion: Real) -> Real:
    """Volume that oil gains over that of the steel around it, per kelvin [1/K]: a/(1 - a (T - 15 degC)) - 3 alpha.

    Args:
        temperature: [K].
        expansion: a of `thermal_density` [1/K].

    Example:
        >>> f"{trapped_expansion(313.15, 7e-4):.2e}"
        '6.77e-04'
    """
    return expansion / (1.0 - expansion * (temperature - T15)) - _STEEL


def free_air(pressure: Real, air: Real, polytropic: Real) -> Scalar:
    """Volume of free air at a pressure above 0.02 bar, over that of the oil [1]: a (p_0/p)^(1/n); arguments as next.

    Example:
        >>> [round(float(free_air(p, 0.01, 1.4)), 4) for p in (1e5, 4e5)]
        [0.0101, 0.0038]
    """
    return air * ca.exp(ca.log(ATMOSPHERE / pressure) / polytropic)


def aerated_bulk_modulus(pressure: Real, bulk_modulus: Real, air: Real, polytropic: Real) -> Scalar:
    """Bulk modulus [Pa] of oil with free air in it; collapses at low pressure.

    1/beta = (1/beta_oil + a g/(n p))/(1 + a g) with g = (p_0/p)^(1/n).

    Args:
        pressure: absolute [Pa]; below 0.02 bar the air is taken to expand no further.
        bulk_modulus: beta_oil, of the oil itself [Pa].
        air: a, volume of free air over that of oil at atmospheric pressure p_0 [1].
        polytropic: n, 1 for slow, 1.4 for fast compression of the air [1].

    Source: series of an oil and a polytropic air volume, as reviewed by Gholizadeh, Burton and Schoenau, International
    Journal of Fluid Power 12 (2011) 3, 5-15; air that dissolves under pressure is left out, so that the modulus
    recovers more slowly with pressure than a real oil's.

    Example:
        >>> [round(float(aerated_bulk_modulus(p, 1.2e9, 0.01, 1.4)) / 1e6) for p in (1e5, 10e5, 100e5)]
        [14, 450, 1163]
    """
    p = ca.fmax(pressure, _FLOOR)
    gas = free_air(p, air, polytropic)
    return (1.0 + gas) / (1.0 / bulk_modulus + gas / (polytropic * p))


def pressure_viscosity_factor(pressure: Real, coefficient: Real) -> Scalar:
    """Viscosity at a pressure over that at atmospheric pressure, exp(alpha p) (Barus).

    Args:
        pressure: gauge [Pa].
        coefficient: alpha [1/Pa], 1.5e-8 to 2.4e-8 for light mineral oils.

    Source: C. Barus, American Journal of Science 45 (1893) 87; good to some 500 bar.

    Example:
        >>> round(float(pressure_viscosity_factor(200e5, 1.7e-8)), 2)
        1.4
    """
    return ca.exp(coefficient * pressure)


def torn_volume(state: Real, volume: Real) -> Scalar:
    """Volume of vapour and air in a node whose oil tears [m3]: -V s/s_0 where its pressure's state s is below 0.

    Oil does not pull. Where more of it leaves than comes in, its pressure stays that of its vapour, less than 1 Pa at
    20 degC ([M] safety data sheets of mineral hydraulic oils), for which 0 is taken; the state goes on below 0 and
    counts the volume that opens. At s_0 below 0 (`DRY`) the node has no oil left.

    Args:
        state: of the node's pressure [Pa]; the pressure is what of it is above 0.
        volume: V, of the node [m3].

    Example:
        >>> [float(torn_volume(s, 1e-3)) for s in (1e5, 0.0, 0.5 * DRY, DRY)]
        [0.0, 0.0, 0.0005, 0.001]
    """
    return volume * (1.0 - held_share(state))


def torn_capacity(state: Real, volume: Real) -> Scalar:
    """What a node gives by it, -d`torn_volume`/ds [m3/Pa]; arguments as there."""
    return ca.if_else(state < 0.0, volume / -DRY, 0.0)


def held_share(state: Real) -> Scalar:
    """Share of a node's volume that oil fills [1]; of the state of its pressure [Pa]."""
    return ca.if_else(state < 0.0, 1.0 - state / DRY, 1.0)


@dataclass(frozen=True)
class Oil:
    """An oil as the circuit sees it. What is `None` is left out of the equations."""

    # walther_a, walther_b: constants of the Walther equation [1]
    walther_a: float
    walther_b: float
    density: float  # at 15 degC [kg/m3]
    bulk_modulus: float  # of the oil itself [Pa]
    # thermal [1/K]; without it density is constant, as in the paper, and oil that is shut in keeps its volume whatever
    # its temperature does
    expansion: float | None = None
    air: float | None = None  # free air at atmospheric pressure over oil [1]
    polytropic: float | None = None  # exponent of that air [1]
    pressure_viscosity: float | None = None  # Barus coefficient, acts on the pumps' leakage [1/Pa]
    name: str = "oil"
    temperatures: tuple[float, float] = (0.0, math.inf)  # lowest and highest that the data hold for [K]

    def viscosity(self, temperature: Real) -> Scalar:
        """Kinematic viscosity [m2/s] at a temperature [K] and atmospheric pressure."""
        return kinematic_viscosity(temperature, self.walther_a, self.walther_b)

    def density_at(self, temperature: Real) -> Real:
        """Density [kg/m3] at a temperature [K]."""
        if self.expansion is None:
            return self.density
        return thermal_density(temperature, self.density, self.expansion)

    def trapped_expansion(self, temperature: Real) -> Real:
        """Volume that it gains over its walls per kelvin at a temperature [K], 0 without expansion [1/K]."""
        return 0.0 if self.expansion is None else trapped_expansion(temperature, self.expansion)

    def bulk_modulus_at(self, pressure: Real) -> Real:
        """Bulk modulus [Pa] of the oil with its air at an absolute pressure [Pa]."""
        if self.air is None or self.polytropic is None:
            return self.bulk_modulus
        return aerated_bulk_modulus(pressure, self.bulk_modulus, self.air, self.polytropic)

    def specific_volume(self, pressure: Real) -> Scalar:
        """Volume of the oil with its air at an absolute pressure [Pa], over that of the oil at atmospheric pressure."""
        volume = ca.exp((ATMOSPHERE - pressure) / self.bulk_modulus)
        if self.air is None or self.polytropic is None:
            return volume
        return volume + free_air(ca.fmax(pressure, _FLOOR), self.air, self.polytropic)

    def thickening(self, pressure: Real) -> Real:
        """Viscosity at an absolute pressure [Pa] over that at atmospheric pressure [1]."""
        if self.pressure_viscosity is None:
            return 1.0
        return pressure_viscosity_factor(pressure - ATMOSPHERE, self.pressure_viscosity)
