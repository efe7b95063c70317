"""How far a pump's described losses may be off: what leak test and identification allow for."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from ramsight.plant.pump import Pump
from ramsight.plant.unit import HydraulicUnit

EFFICIENCY = 0.02 / math.sqrt(3.0)
"""Standard deviation of a described hydro-mechanical efficiency [1]: anywhere within +-0.02, as the catalogue states of
pumps whose curves were read."""
NO_LOAD_TORQUE = 0.25
"""Of a described no-load torque over it [1]; data sheets rarely give one, and oil and age change it. [G]"""
THERMOMETER = 1.0
"""Error of the oil's temperature that another day may have [K]: class B of IEC 60751 has 0.5 K at 40 degC, and as much
again is between the thermometer and the oil."""
_FELT = 5e-4  # of a factor, for a kelvin or a percent; less is not said


def rougher(nominal: float, change: float) -> float:
    """Friction over the described one if the hydro-mechanical efficiency is not the nominal one [1].

    Args:
        nominal: efficiency as described [1].
        change: what the real one is more [1].

    Example:
        >>> round(rougher(0.9, -0.01), 3)
        1.112
    """
    return (1.0 / (nominal + change) - 1.0) / (1.0 / nominal - 1.0)


def dependence(per_kelvin: float, per_torque: float) -> str:
    """What an interval does not hold, in words: a thermometer or a torque that is off; nothing if neither counts.

    Args:
        per_kelvin: change of the factor if the oil is 1 K warmer than reported [1/K].
        per_torque: change of the factor if the torque is 1 % larger than reported [1].

    Example:
        >>> dependence(-0.038, -0.011)
        '-0.038 for each K that the oil is warmer than reported, -0.011 for each % that the torque is larger'
    """
    causes = ((per_kelvin, "K that the oil is warmer than reported"), (per_torque, "% that the torque is larger"))
    return ", ".join(f"{by:+.3f} for each {cause}" for by, cause in causes if abs(by) >= _FELT)


def with_friction_factor(unit: HydraulicUnit) -> HydraulicUnit:
    """The unit with a factor on the friction of pumps that have a table, whose equations know no efficiency."""

    def part(p: Any) -> Any:
        return replace(p, friction_factor=1.0) if isinstance(p, Pump) and p.table is not None else p

    return unit.mapped(part)
