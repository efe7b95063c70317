"""What the cylinders move: planar mechanisms from a description, in closed form."""

from ramsight.plant.linkage.dynamics import motion
from ramsight.plant.linkage.mechanism import Mechanism, build_mechanism
from ramsight.plant.linkage.survey import angles, holding_forces, joints, points, positions, potential, tip

__all__ = [
    "Mechanism", "angles", "build_mechanism", "holding_forces", "joints", "motion", "points", "positions",
    "potential", "tip",
]  # fmt: skip
