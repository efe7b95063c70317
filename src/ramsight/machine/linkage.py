"""What the cylinders move: a planar mechanism of bodies, joints, links and cylinders, as its side view shows it.

All points are those of one drawing, x forward and z up; in the pose that is drawn every joint stands at 0. Lengths of
links and the way they are assembled follow from the drawing, so no number is written twice.
"""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal, Self

from pydantic import Discriminator, Field, Tag, model_validator

from ramsight.machine.base import Part
from ramsight.machine.declare import quantity, refuse

#: the machine itself, which stands still
FRAME = "frame"
STANDARD_GRAVITY = 9.80665  # m/s2, ISO 80000-3

_NAME = re.compile(r"[a-z][a-z0-9_]*")
_ROWS = range(2, 101)  # of a load chart

_X = Annotated[float, quantity("m", "forward, in the drawing", least=-1000, most=1000)]
_Z = Annotated[float, quantity("m", "up, in the drawing", least=-1000, most=1000)]
_BodyName = Annotated[str, Field(description='body, or "frame" for the machine itself')]


class Point(Part):
    """Point of the drawing."""

    x: _X
    z: _Z


class Attachment(Point):
    """Point of the drawing that moves with a body."""

    body: _BodyName = FRAME


class Link(Part):
    """Rod without mass between two pins, which closes a loop: it gives the angle of the body that it ends at."""

    pin: Annotated[Point, Field(description="its pin on this body")]
    to: Annotated[Attachment, Field(description="its other pin, on a body named before this one")]


class Follow(Part):
    """Chain or gear that makes a joint move in proportion to another."""

    body: Annotated[str, Field(description="body whose joint is followed")]
    ratio: Annotated[float, quantity("1", "this joint's motion over the other's", least=-1000, most=1000)]


class Body(Part):
    """Rigid body, and what it hangs on."""

    parent: Annotated[_BodyName, Field(description='body that it is joined to, or "frame"')] = FRAME
    mass: Annotated[float, quantity("kg", "mass", least=0, most="1e6 kg")]
    centre_of_mass: Annotated[Point, Field(description="its centre of mass")]
    moment_of_inertia: Annotated[float, quantity("kg m2", "about the centre of mass", least=0, most="1e8 kg m2")]
    follows: Annotated[Follow | None, Field(description="joint that gives this joint's motion")] = None

    @property
    def free(self) -> bool:
        """Whether its joint is a coordinate of the mechanism."""
        return self.follows is None


class TurningBody(Body):
    """Body that turns about a pin."""

    kind: Annotated[Literal["turning"], Field(description="turns about a pin")]
    pivot: Annotated[Point, Field(description="the pin")]
    link: Annotated[Link | None, Field(description="link that gives the joint's angle; it is free without")] = None

    @model_validator(mode="after")
    def _one_master(self) -> Self:
        if self.link is not None and self.follows is not None:
            raise refuse("follows", self.follows.body, "a joint is moved by a link or follows another, not both")
        return self

    @property
    def free(self) -> bool:
        """Whether its joint is a coordinate of the mechanism."""
        return self.link is None and self.follows is None


class SlidingBody(Body):
    """Body that slides along a straight line."""

    kind: Annotated[Literal["sliding"], Field(description="slides along a straight line")]
    direction: Annotated[float, quantity("deg", "of sliding, from forward upwards", least=-360, most=360)]


_KINDS: dict[str, type[Body]] = {"turning": TurningBody, "sliding": SlidingBody}


def _tag(value: Any) -> str | None:
    kind = value.get("kind") if isinstance(value, dict) else getattr(value, "kind", None)
    return f"@{kind}" if isinstance(kind, str) and kind in _KINDS else None


AnyBody = Annotated[
    Annotated[TurningBody, Tag("@turning")] | Annotated[SlidingBody, Tag("@sliding")], Discriminator(_tag)
]


class LinkageCylinder(Part):
    """Where the cylinders of a unit are pinned; several in parallel are one in the side view."""

    base: Annotated[Attachment, Field(description="pin of the barrel")]
    rod: Annotated[Attachment, Field(description="pin of the rod")]
    retracted_length: Annotated[float, quantity("m", "from pin to pin, fully retracted", least=0.001, most=100)]


class Payload(Attachment):
    """What is carried, as a point mass; how much there is at any time is the duty's."""

    rated: Annotated[float, quantity("kg", "rated payload", least=0, most="1e6 kg")]


class LoadChart(Part):
    """Rated load over the reach, as a machine's load chart states it."""

    tool: Annotated[str, Field(description="point whose reach counts, as `ramsight track --tool` names it")] = "payload"
    about: Annotated[Point, Field(description="point of the frame that load moments are about: reach is from there")]
    reach: Annotated[
        tuple[Annotated[float, quantity("m", "reach", above=0, most=1000)], ...],
        Field(description="horizontal distances of the tool's point, each more than the one before"),
    ]
    rated: Annotated[
        tuple[Annotated[float, quantity("kg", "rated load", above=0, most="1e6 kg")], ...],
        Field(description="mass that the tool may carry at each reach; between them the load moment is interpolated"),
    ]

    @model_validator(mode="after")
    def _is_a_chart(self) -> Self:
        rows = len(self.reach)
        if rows not in _ROWS:
            raise refuse("reach", f"{rows} values", "is no table", f"{_ROWS[0]} to {_ROWS[-1]} values")
        if len(self.rated) != rows:
            text = "has another length than reach: each reach has one rated load"
            raise refuse("rated", f"{len(self.rated)} values", text, f"{rows} values")
        for k in range(1, rows):
            before, here = self.reach[k - 1 : k + 1]
            if here <= before:
                raise refuse(f"reach.{k}", f"{here:g} m", "is not more than the reach before it", f"above {before:g} m")
        return self


class Linkage(Part):
    """Planar mechanism that the cylinders move."""

    gravity: Annotated[float, quantity("m/s2", "acceleration of free fall", least=0, most=100)] = STANDARD_GRAVITY
    bodies: Annotated[dict[str, AnyBody], Field(description="bodies by name, each after those that it hangs on")]
    cylinders: Annotated[dict[str, LinkageCylinder], Field(description="cylinders by the name of their unit")]
    payload: Annotated[Payload | None, Field(description="where the payload's mass acts")] = None
    tip: Annotated[Attachment, Field(description="point of the tool that works, for example the bucket's lip")]
    points: dict[str, Attachment] = Field(
        default_factory=dict, description="further points of bodies that have a name; one is called `BODY.NAME`"
    )
    load_chart: Annotated[LoadChart | None, Field(description="what may be lifted at which reach")] = None

    @model_validator(mode="after")
    def _holds_together(self) -> Self:
        known = [FRAME]
        for name, body in self.bodies.items():
            key = f"bodies.{name}"
            if not _NAME.fullmatch(name) or name == FRAME:
                raise refuse(key, name, "a body's name starts with a letter and holds small letters, digits and _")
            self._is_known(f"{key}.parent", body.parent, known)
            if isinstance(body, TurningBody) and body.link is not None:
                self._is_known(f"{key}.link.to.body", body.link.to.body, known)
            if body.follows is not None:
                same = [other for other in known[1:] if self.bodies[other].kind == body.kind]
                self._is_known(f"{key}.follows.body", body.follows.body, same)
            known.append(name)
        for name, cylinder in self.cylinders.items():
            for end in ("base", "rod"):
                self._is_known(f"cylinders.{name}.{end}.body", getattr(cylinder, end).body, known)
        self._is_known("tip.body", self.tip.body, known)
        if self.payload is not None:
            self._is_known("payload.body", self.payload.body, known)
        for name, point in self.points.items():
            if not _NAME.fullmatch(name):
                text = "a point's name starts with a letter and holds small letters, digits and _"
                raise refuse(f"points.{name}", name, text)
            self._is_known(f"points.{name}.body", point.body, known)
        if self.load_chart is not None and self.load_chart.tool not in self.spots:
            raise refuse("load_chart.tool", self.load_chart.tool, "no such point", ", ".join(self.spots))
        if not self.cylinders:
            raise refuse("cylinders", 0, "the mechanism has no cylinder, for example a table [linkage.cylinders.boom]")
        moved: set[str] = set()
        for name in self.cylinders:
            joint = self.moved_joint(name)
            if joint not in self.free_joints or joint in moved:
                text = "moves the joint of its later named body, which has to be free and no other cylinder's"
                raise refuse(f"cylinders.{name}", joint, text)
            moved.add(joint)
        return self

    @staticmethod
    def _is_known(key: str, name: str, known: list[str]) -> None:
        if name not in known:
            raise refuse(key, name, "no such body named before", ", ".join(known))

    @property
    def spots(self) -> dict[str, Attachment]:
        """Points that have a name: tip, payload, centres of mass, pivots and described points."""
        found: dict[str, Attachment] = {"tip": self.tip}
        if self.payload is not None:
            found["payload"] = self.payload
        for name, body in self.bodies.items():
            own = {"centre_of_mass": body.centre_of_mass}
            if isinstance(body, TurningBody):
                own["pivot"] = body.pivot
            found |= {f"{name}.{key}": Attachment(body=name, x=at.x, z=at.z) for key, at in own.items()}
        return found | {f"{point.body}.{name}": point for name, point in self.points.items()}

    @property
    def free_joints(self) -> tuple[str, ...]:
        """Bodies whose joints are the mechanism's coordinates, in order."""
        return tuple(name for name, body in self.bodies.items() if body.free)

    def moved_joint(self, cylinder: str) -> str:
        """The body on the joint that a cylinder moves: of the two that it is pinned to, the one named last."""
        found = self.cylinders[cylinder]
        order = [FRAME, *self.bodies]
        return max(found.base.body, found.rod.body, key=order.index)
