"""A machine as it was built: what differs from its data sheet, as factors."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, TypeVar

from ramsight.errors import DescriptionError
from ramsight.plant.hose import Hose
from ramsight.plant.pump import Pump
from ramsight.plant.unit import HydraulicUnit
from ramsight.plant.valve import ReliefValve
from ramsight.units import argument

U = TypeVar("U", bound=HydraulicUnit)

_RANGES = {
    "leak": ("0.001", "1000"),
    "displacement": ("0.5", "2"),
    "stiffness": ("0.001", "1000"),
    "friction": ("0", "1000"),
    "relief": ("0.5", "1.5"),
}
"""Least and most of each factor: a slip of a sign or a unit is beyond them."""


@dataclass(frozen=True)
class AsBuilt:
    """Factors on the data sheet's values; 1 is the data sheet.

    Args:
        leak: leakage of both pumps [1].
        displacement: of both pumps [1].
        stiffness: bulk modulus of the oil, and of oil and hose wall together [1].
        friction: Coulomb, breakaway and viscous friction of the cylinder, and what grows with its pressures [1].
        relief: settings of the relief valves [1]; they are adjusted by hand, and springs settle: to 5 or 7 %.

    Example:
        >>> import ramsight
        >>> boom = ramsight.build("mining-loader", "boom")
        >>> worn = ramsight.AsBuilt(leak=1.2, friction=1.3).apply(boom)
        >>> round(worn.cylinder.coulomb_friction / boom.cylinder.coulomb_friction, 3)
        1.3
    """

    leak: float = 1.0
    displacement: float = 1.0
    stiffness: float = 1.0
    friction: float = 1.0
    relief: float = 1.0

    def __post_init__(self) -> None:
        """Read and check the factors.

        Raises:
            DescriptionError: one of them is no number, or no machine has it; names it, its value and the range.
        """
        for name, (least, most) in _RANGES.items():
            object.__setattr__(self, name, argument(getattr(self, name), "1", name, least=least, most=most))

    def apply(self, unit: U) -> U:
        """The unit's parts with these factors.

        Args:
            unit: its parts as the data sheet has them.

        Raises:
            DescriptionError: it is none.

        Example:
            >>> from ramsight import machine
            >>> from ramsight.plant.ddh import build_ddh
            >>> boom = build_ddh("boom", machine.load_machine("mining-loader").unit("boom"))
            >>> round(AsBuilt(displacement=0.995).apply(boom).travel_per_radian / boom.travel_per_radian, 6)
            0.995
        """
        if not hasattr(unit, "cylinder"):
            raise DescriptionError("is no unit", key="unit", value=unit, allowed="what ramsight.build makes")
        pressed = unit.cylinder.pressure_friction
        cylinder = replace(
            unit.cylinder,
            pressure_friction=None if pressed is None else pressed * self.friction,
            coulomb_friction=unit.cylinder.coulomb_friction * self.friction,
            breakaway_friction=unit.cylinder.breakaway_friction * self.friction,
            viscous_friction=unit.cylinder.viscous_friction * self.friction,
        )
        oil = replace(unit.oil, bulk_modulus=unit.oil.bulk_modulus * self.stiffness)
        changed: Any = replace(unit.mapped(self._part), oil=oil, cylinder=cylinder)
        return changed  # type: ignore[no-any-return]

    def _part(self, part: Any) -> Any:  # a part of any kind, changed to one of its kind
        if isinstance(part, Pump):
            # Eq. 10 makes leakage proportional to displacement; the factors are meant to be independent.
            return replace(
                part,
                displacement=part.displacement * self.displacement,
                leak_factor=part.leak_factor * self.leak / self.displacement,
            )
        if isinstance(part, ReliefValve):
            return replace(part, setting=part.setting * self.relief)
        if isinstance(part, Hose):
            stiffening = None if part.stiffening is None else part.stiffening * self.stiffness
            return replace(part, bulk_modulus=part.bulk_modulus * self.stiffness, stiffening=stiffening)
        return part
