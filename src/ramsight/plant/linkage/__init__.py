"""What the cylinders move: planar mechanisms from a description, in closed form."""

from typing import TYPE_CHECKING

from ramsight.late import late

__all__ = [
    "Mechanism", "angles", "build_mechanism", "holding_forces", "joints", "motion", "points", "positions",
    "potential", "tip",
]  # fmt: skip

if TYPE_CHECKING:
    from ramsight.plant.linkage.dynamics import motion
    from ramsight.plant.linkage.mechanism import Mechanism, build_mechanism
    from ramsight.plant.linkage.survey import angles, holding_forces, joints, points, positions, potential, tip
else:  # who asks for the lever alone needs none of it
    __getattr__, __dir__ = late(__name__)
