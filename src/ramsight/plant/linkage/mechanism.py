"""A planar mechanism as numbers, and where its bodies are at joint coordinates or cylinder positions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import casadi as ca

from ramsight.expression import Real
from ramsight.machine import linkage as description
from ramsight.plant.linkage import members
from ramsight.plant.linkage.members import Body, Following, Linked, Sliding, Spot, Strut, Turning
from ramsight.plant.linkage.planar import Pose, arm_to, way_to
from ramsight.plant.symbols import Parameters

N = TypeVar("N", bound=Body | Following | Strut | Spot)


@dataclass(frozen=True)
class Mechanism:
    """Bodies on joints, and the cylinders that move them."""

    bodies: tuple[Body, ...]  # each after those that it hangs on
    followings: tuple[Following, ...]  # joints that follow others
    struts: tuple[Strut, ...]
    tip: Spot  # point of the tool
    load: Spot | None  # point where the payload's mass acts; none without one
    gravity: float  # [m/s2]
    rated_payload: float  # [kg]

    @property
    def name(self) -> str:
        """Under which its parameters stand."""
        return "linkage"

    @property
    def free(self) -> tuple[Body, ...]:
        """Bodies whose joints are the coordinates, in order."""
        return tuple(body for body in self.bodies if body.joint is not None)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of these bodies."""
        return tuple(body.name for body in self.free)

    @property
    def joint_units(self) -> tuple[str, ...]:
        """Units of the coordinates."""
        return tuple("m" if isinstance(body, Sliding) else "rad" for body in self.free)

    @property
    def cylinders(self) -> tuple[str, ...]:
        """Names of the units whose cylinders move it."""
        return tuple(strut.name for strut in self.struts)

    def symbolic(self, parameters: Parameters) -> Mechanism:
        """A copy with parameters `linkage.*` in place of its numbers."""

        def of(kind: str, part: N) -> N:
            return parameters.symbolic(f"{self.name}.{kind}{part.name}", part)

        plain = parameters.symbolic(self.name, self)
        return replace(
            plain,
            bodies=tuple(of("", body) for body in self.bodies),
            followings=tuple(of("chain_", following) for following in self.followings),
            struts=tuple(of("cylinder_", strut) for strut in self.struts),
            tip=of("", self.tip),
            load=None if self.load is None else of("", self.load),
        )

    def poses(self, coordinates: Sequence[Real]) -> dict[str, Pose]:
        """Where every body is, by name; the frame among them.

        Args:
            coordinates: of the free joints, in their order [rad or m].
        """

        def coordinate(body: Body, poses: dict[str, Pose]) -> Real:
            assert body.joint is not None, "a link or another joint moves it"
            return coordinates[body.joint]

        poses, _ = self._assembled(coordinate)
        return poses

    def solved(self, positions: Sequence[Real], passive: Sequence[Real] = ()) -> list[Real]:
        """Coordinates of the free joints at cylinder positions, in closed form.

        Args:
            positions: of the cylinders, in their order [m].
            passive: coordinates of the free joints that no cylinder moves, in their order; 0 if omitted.
        """
        moved = {strut.joint: (strut, position) for strut, position in zip(self.struts, positions, strict=True)}
        left = iter(passive)

        def coordinate(body: Body, poses: dict[str, Pose]) -> Real:
            if body.name not in moved:
                return next(left, 0.0)
            strut, position = moved[body.name]
            return _closed(body, strut, strut.retracted_length + position, poses)

        _, found = self._assembled(coordinate)
        return [found[name] for name in self.joints]

    def length(self, strut: Strut, poses: dict[str, Pose]) -> Real:
        """From pin to pin of a cylinder [m]."""
        base = poses[strut.base].at(strut.base_x, strut.base_z)
        rod = poses[strut.rod].at(strut.rod_x, strut.rod_z)
        return ca.sqrt((rod[0] - base[0]) ** 2 + (rod[1] - base[1]) ** 2)

    def _assembled(
        self, coordinate: Callable[[Body, dict[str, Pose]], Real]
    ) -> tuple[dict[str, Pose], dict[str, Real]]:
        poses: dict[str, Pose] = {members.FRAME: Pose()}
        found: dict[str, Real] = {}
        chains = {following.name: following for following in self.followings}
        for body in self.bodies:
            parent = poses[body.parent]
            if isinstance(body, Linked):
                poses[body.name] = parent.turn_about(body.pivot_x, body.pivot_z, *_linked(body, poses))
                continue
            if body.name in chains:
                chain = chains[body.name]
                q = chain.ratio * found[chain.leader]
            else:
                q = coordinate(body, poses)
            found[body.name] = q
            if isinstance(body, Sliding):
                poses[body.name] = parent.slide(body.direction_x, body.direction_z, q)
            elif isinstance(body, Turning):
                poses[body.name] = parent.turn_about(body.pivot_x, body.pivot_z, ca.cos(q), ca.sin(q))
        return poses, found


def _seen_from(parent: Pose, x: Real, z: Real) -> tuple[Real, Real]:
    """A direction in the parent's own axes."""
    return parent.cosine * x + parent.sine * z, parent.cosine * z - parent.sine * x


def _linked(body: Linked, poses: dict[str, Pose]) -> tuple[Real, Real]:
    """Cosine and sine of the joint's angle that a link gives."""
    parent = poses[body.parent]
    far, pivot = poses[body.far].at(body.far_x, body.far_z), parent.at(body.pivot_x, body.pivot_z)
    length = ca.sqrt((body.far_x - body.pin_x) ** 2 + (body.far_z - body.pin_z) ** 2)
    arm = body.pin_x - body.pivot_x, body.pin_z - body.pivot_z
    return arm_to(*arm, *_seen_from(parent, far[0] - pivot[0], far[1] - pivot[1]), length, body.side)


def _closed(body: Body, strut: Strut, length: Real, poses: dict[str, Pose]) -> Real:
    """The joint's coordinate at which a cylinder has a length."""
    parent = poses[body.parent]
    here, there, other = strut.pins
    far = poses[other].at(*there)
    if isinstance(body, Sliding):
        start = parent.at(*here)
        gap = _seen_from(parent, start[0] - far[0], start[1] - far[1])
        return way_to(*gap, body.direction_x, body.direction_z, length, strut.side)
    assert isinstance(body, Turning)
    pivot = parent.at(body.pivot_x, body.pivot_z)
    arm = here[0] - body.pivot_x, here[1] - body.pivot_z
    cosine, sine = arm_to(*arm, *_seen_from(parent, far[0] - pivot[0], far[1] - pivot[1]), length, strut.side)
    return ca.atan2(sine, cosine)


def build_mechanism(spec: description.Linkage) -> Mechanism:
    """The mechanism of a description.

    Example:
        >>> from ramsight import machine
        >>> build_mechanism(machine.load_machine("mining-loader").linkage).joints
        ('boom', 'bucket')
    """
    chains = (members.following(spec, name) for name in spec.bodies)
    return Mechanism(
        bodies=tuple(members.body(spec, name) for name in spec.bodies),
        followings=tuple(chain for chain in chains if chain is not None),
        struts=tuple(members.strut(spec, name) for name in spec.cylinders),
        tip=members.spot(spec.tip, "tip"),
        load=None if spec.payload is None else members.spot(spec.payload, "payload"),
        gravity=spec.gravity,
        rated_payload=0.0 if spec.payload is None else spec.payload.rated,
    )
