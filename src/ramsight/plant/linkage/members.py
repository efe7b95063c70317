"""What a mechanism is made of, as numbers: from its description to frozen dataclasses of SI floats."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ramsight.machine import linkage as description
from ramsight.machine.linkage import FRAME
from ramsight.plant.linkage.planar import side_of


@dataclass(frozen=True)
class Body:
    """A body on its joint; points are those of the drawing [m]."""

    name: str
    parent: str  # the body that it is joined to
    joint: int | None  # its coordinate's place among the free joints; none if a link or another joint moves it
    mass: float  # [kg]
    inertia: float  # about the centre of mass [kg m2]
    centre_x: float
    centre_z: float


@dataclass(frozen=True)
class Turning(Body):
    """A body that turns about a pin at `pivot_x`, `pivot_z` by its joint's angle [rad]."""

    pivot_x: float
    pivot_z: float


@dataclass(frozen=True)
class Linked(Turning):
    """A body that turns as a link lets it, from `pin_x`, `pin_z` on it to `far_x`, `far_z` on the body `far`."""

    far: str
    pin_x: float
    pin_z: float
    far_x: float
    far_z: float
    side: float


@dataclass(frozen=True)
class Sliding(Body):
    """A body that slides along a direction of length 1 by its joint's coordinate [m]."""

    direction_x: float
    direction_z: float


@dataclass(frozen=True)
class Following:
    """A joint that moves in proportion to another."""

    name: str  # of the body on the joint
    leader: str  # body whose joint is followed
    ratio: float  # this joint's motion over the other's [1]


@dataclass(frozen=True)
class Strut:
    """The cylinders of a unit between two pins, in the drawing [m]."""

    name: str
    # base, rod: bodies that they are pinned to
    base: str
    rod: str
    base_x: float
    base_z: float
    rod_x: float
    rod_z: float
    retracted_length: float  # from pin to pin at position 0 [m]
    joint: str  # body on the joint that the cylinders move
    near: str  # end on that body, "base" or "rod"
    side: float  # of the triangle that pin, pin and pivot make, as drawn; of a sliding joint, whether it goes away

    @property
    def pins(self) -> tuple[tuple[float, float], tuple[float, float], str]:
        """The pin on the body that the cylinders move, the other pin, and the body that this one is on."""
        base, rod = (self.base_x, self.base_z), (self.rod_x, self.rod_z)
        return (rod, base, self.base) if self.near == "rod" else (base, rod, self.rod)


@dataclass(frozen=True)
class Spot:
    """A point of a body, in the drawing [m]."""

    name: str
    body: str
    x: float
    z: float


def body(spec: description.Linkage, name: str) -> Body:
    """A described body."""
    found = spec.bodies[name]
    centre = found.centre_of_mass
    place = spec.free_joints.index(name) if found.free else None
    common = (name, found.parent, place, found.mass, found.moment_of_inertia, centre.x, centre.z)
    if isinstance(found, description.SlidingBody):
        return Sliding(*common, math.cos(found.direction), math.sin(found.direction))
    pivot = found.pivot
    if found.link is None:
        return Turning(*common, pivot.x, pivot.z)
    pin, far = found.link.pin, found.link.to
    side = side_of(pin.x - pivot.x, pin.z - pivot.z, far.x - pivot.x, far.z - pivot.z)
    return Linked(*common, pivot.x, pivot.z, far.body, pin.x, pin.z, far.x, far.z, side)


def following(spec: description.Linkage, name: str) -> Following | None:
    """What a described body's joint follows, if it does."""
    found = spec.bodies[name].follows
    return None if found is None else Following(name, found.body, found.ratio)


def strut(spec: description.Linkage, name: str) -> Strut:
    """The pins of a described cylinder."""
    found = spec.cylinders[name]
    base, rod, joint = found.base, found.rod, spec.moved_joint(name)
    near = "rod" if rod.body == joint else "base"
    here, there = (rod, base) if near == "rod" else (base, rod)
    moved = spec.bodies[joint]
    if isinstance(moved, description.TurningBody):
        pivot = moved.pivot
        side = side_of(here.x - pivot.x, here.z - pivot.z, there.x - pivot.x, there.z - pivot.z)
    else:
        along = (here.x - there.x) * math.cos(moved.direction) + (here.z - there.z) * math.sin(moved.direction)
        side = 1.0 if along >= 0.0 else -1.0
    return Strut(name, base.body, rod.body, base.x, base.z, rod.x, rod.z, found.retracted_length, joint, near, side)


def spot(spec: description.Attachment, name: str) -> Spot:
    """A described point."""
    return Spot(name, spec.body, spec.x, spec.z)


__all__ = ["FRAME", "Body", "Following", "Linked", "Sliding", "Spot", "Strut", "Turning"]
