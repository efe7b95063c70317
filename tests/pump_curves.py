"""Efficiency curves of a pump, as its data sheet draws them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ramsight.machine.pump_description import Pump as PumpDescription
from ramsight.machine.reading import from_catalogue
from ramsight.plant import described
from ramsight.plant.pump import Pump

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Efficiency:
    """Efficiencies of pump operation over pressure.

    Attributes:
        pressure: pressure rises [Pa].
        volumetric: flow over what the displacement would give [1].
        hydromechanical: torque that the displacement would take over the real one [1].
        total: their product, hydraulic over shaft power [1].
    """

    pressure: Array
    volumetric: Array
    hydromechanical: Array

    @property
    def total(self) -> Array:
        """Hydraulic power over shaft power [1]."""
        return self.volumetric * self.hydromechanical


def efficiency(pump: Pump, pressure: ArrayLike, speed: float, viscosity: float, density: float = 872.0) -> Efficiency:
    """Efficiencies of a pump over pressure at one speed and viscosity: eta_v = Q/(D w), eta_hm = D dp/T.

    Of oil that keeps its volume.

    Args:
        pump: the pump.
        pressure: pressure rises above zero [Pa], shape (n,).
        speed: of the pump, above zero [rad/s].
        viscosity: kinematic [m2/s].
        density: of the oil [kg/m3].

    Example:
        >>> from math import pi
        >>> from ramsight import machine
        >>> pump = catalogue_pump("PGI100-2-008")
        >>> curve = efficiency(pump, [100e5, 250e5], 1450 * pi / 30, 46e-6)
        >>> curve.volumetric.round(3).tolist(), curve.hydromechanical.round(3).tolist()
        ([0.96, 0.9], [0.869, 0.887])
    """
    rises = np.atleast_1d(np.asarray(pressure, dtype=np.float64))
    if not (speed > 0.0 and np.all(rises > 0.0)):
        raise ValueError("efficiencies of pump operation need a speed and pressure rises above zero")
    flow = np.array([float(pump.flow(speed, rise, viscosity, density)) for rise in rises])
    torque = np.array([float(pump.torque(speed, rise, viscosity)) for rise in rises])
    ideal = float(pump.displacement)
    return Efficiency(rises, flow / (ideal * speed), ideal * rises / torque)


def catalogue_pump(name: str, **stated: object) -> Pump:
    """A pump of the catalogue alone: one chamber of one block, on the motor's shaft.

    Args:
        name: its name.
        stated: other values, as in a description: `chambers=2`.
    """
    spec = cast(PumpDescription, from_catalogue("pump", name, **{"belt": 1.0, **stated}))
    return described.pump(spec, "pump", "tank", "port", math.inf)
