"""A mechanism as shapes in its plane: what a drawing or an animation of it is made of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ramsight.arrays import Array
from ramsight.drawing.mechanism.bucket import Bucket, bucket
from ramsight.plant.linkage import Mechanism, points
from ramsight.plant.linkage import joints as joints_at


@dataclass(frozen=True)
class Strut:
    """A cylinder in the side view."""

    name: str
    # base, barrel_end, rod: pin of the barrel, end of the barrel, pin of the rod, [x, z] in m
    base: Array
    barrel_end: Array
    rod: Array


@dataclass(frozen=True)
class Shapes:
    """A mechanism in one pose; all points are [x, z] in m."""

    # outline of each body, shape (corners, 2), by name: a bucket's shell, of others the hull of their pins; the frame
    # is none of them
    bodies: dict[str, Array]
    links: tuple[Array, ...]  # both pins of each link, shape (2, 2)
    struts: tuple[Strut, ...]
    pivots: tuple[Array, ...]  # pins that bodies turn about
    frame: tuple[Array, ...]  # pins on the machine itself
    centres: dict[str, Array]  # centres of mass, by body
    load: Array | None  # where the payload's mass acts, if there is a payload
    tip: Array
    bucket: Bucket | None = None  # that carries the payload and has the tip, if there is one


def shapes(mechanism: Mechanism, positions: ArrayLike) -> Shapes:
    """A mechanism's shapes at cylinder positions.

    Args:
        positions: of its cylinders [m], shape (cylinders,).

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.linkage import build_mechanism
        >>> seen = shapes(build_mechanism(machine.load_machine("mining-loader").linkage), [0.35, 0.25])
        >>> sorted(seen.bodies), [strut.name for strut in seen.struts]
        (['boom', 'bucket', 'lever'], ['boom', 'bucket'])
    """
    pins = points(mechanism, joints_at(mechanism, positions))
    found = {name: dict(own) for name, own in pins.items()}
    ends: dict[str, list[Array]] = {}
    for own in pins.values():
        for what, place in own:
            if what.startswith("link of "):
                ends.setdefault(what, []).append(place)
    struts = []
    for strut in mechanism.struts:
        base, rod = found[strut.base][f"base of {strut.name}"], found[strut.rod][f"rod of {strut.name}"]
        share = min(_BARREL * strut.retracted_length / float(np.linalg.norm(rod - base)), 1.0)
        struts.append(Strut(strut.name, base, base + share * (rod - base), rod))
    bodies = {
        name: hull(np.array([place for what, place in own if what != "centre of mass"]))
        for name, own in pins.items()
        if name != "frame"
    }
    shell = _shell(mechanism, found)
    if shell is not None:
        bodies[mechanism.tip.body] = shell.outline
    return Shapes(
        bodies=bodies,
        links=tuple(np.array(places) for places in ends.values()),
        struts=tuple(struts),
        pivots=tuple(place for name, own in pins.items() if name != "frame" for what, place in own if what == "pivot"),
        frame=tuple(place for _, place in pins["frame"]),
        centres={name: found[name]["centre of mass"] for name in found if name != "frame"},
        load=None if mechanism.load is None else found[mechanism.load.body]["payload"],
        tip=found[mechanism.tip.body]["tip"],
        bucket=shell,
    )


def _shell(mechanism: Mechanism, found: dict[str, dict[str, Array]]) -> Bucket | None:
    """The bucket: what a cylinder turns, and carries the payload and has the tip."""
    body = mechanism.tip.body
    strut = next((one for one in mechanism.struts if one.rod == body), None)
    if strut is None or mechanism.load is None or mechanism.load.body != body or "pivot" not in found[body]:
        return None
    return bucket(found[body]["pivot"], found[body][f"rod of {strut.name}"], found[body]["tip"])


_BARREL = 0.92  # the barrel's share of the retracted length, for the eye only


def hull(places: Array) -> Array:
    """Convex hull of points (n, 2), anticlockwise (Andrew's monotone chain).

    Example:
        >>> hull(np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 0.2], [1.0, 1.0], [0.0, 1.0]])).tolist()
        [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
    """
    ordered = sorted({(float(x), float(z)) for x, z in places})

    def half(row: list[tuple[float, float]]) -> list[tuple[float, float]]:
        kept: list[tuple[float, float]] = []
        for x, z in row:
            while len(kept) > 1 and _turn(kept[-2], kept[-1], (x, z)) <= 0.0:
                kept.pop()
            kept.append((x, z))
        return kept[:-1]

    return np.array((half(ordered) + half(ordered[::-1])) or ordered)


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
