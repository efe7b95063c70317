"""A machine as it was built: what differs from its data sheet, as factors."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ramsight.plant.ddh import DdhUnit, Side


@dataclass(frozen=True)
class AsBuilt:
    """Factors on the data sheet's values; 1 is the data sheet.

    Args:
        leak: leakage of both pumps [1].
        displacement: of both pumps [1].
        stiffness: bulk modulus of the oil, and of oil and hose wall together [1].
        friction: Coulomb, breakaway and viscous friction of the cylinder [1].
    """

    leak: float = 1.0
    displacement: float = 1.0
    stiffness: float = 1.0
    friction: float = 1.0

    def apply(self, unit: DdhUnit) -> DdhUnit:
        """The unit's parts with these factors.

        Args:
            unit: its parts as the data sheet has them.

        Example:
            >>> from ramsight import machine
            >>> from ramsight.plant.ddh import build
            >>> boom = build("boom", machine.load("mining-loader").unit("boom"))
            >>> round(AsBuilt(displacement=0.995).apply(boom).travel_per_radian / boom.travel_per_radian, 6)
            0.995
        """
        cylinder = replace(
            unit.cylinder,
            coulomb_friction=unit.cylinder.coulomb_friction * self.friction,
            breakaway_friction=unit.cylinder.breakaway_friction * self.friction,
            viscous_friction=unit.cylinder.viscous_friction * self.friction,
        )
        oil = replace(unit.oil, bulk_modulus=unit.oil.bulk_modulus * self.stiffness)
        return replace(unit, oil=oil, cylinder=cylinder, a=self._side(unit.a), b=self._side(unit.b))

    def _side(self, side: Side) -> Side:
        # Eq. 10 makes leakage proportional to displacement; the factors are meant to be independent.
        pump = replace(
            side.pump,
            displacement=side.pump.displacement * self.displacement,
            leak_factor=side.pump.leak_factor * self.leak / self.displacement,
        )
        hose = replace(side.hose, bulk_modulus=side.hose.bulk_modulus * self.stiffness)
        return replace(side, pump=pump, hose=hose)
