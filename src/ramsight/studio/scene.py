"""A machine in space: plates of its mechanism, cylinders that extend, and where the sensor takes it to be."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
from nicegui import ui

from ramsight.arrays import Array
from ramsight.drawing.mechanism.bodies import Shapes, hull, shapes
from ramsight.drawing.mechanism.bucket import Bucket
from ramsight.drawing.mechanism.scenery import COLOURS, GHOST, ROCK, Scenery, heap_radius, scenery, truck
from ramsight.machine.description import Machine
from ramsight.plant.linkage import joints, points
from ramsight.plant.linked import LinkedMachine

STEEL, RED, DARK = "#8b939c", "#b03030", "#4a4f55"
PLATE = 0.14
"""Thickness of a plate."""
_LYING = math.pi / 2.0
_EYE = 0.13  # of a body around its pins
_BUCKET, _WALL, _SHELL = 1.9, 0.05, "#6f7780"  # width of a bucket, and its plates
_CHASSIS, _TYRE_WIDTH, _GROUND = 1.6, 0.45, (14.0, 9.0, 0.05)
_PAINT, _EARTH = "#d9c48f", "#cfc7b8"
_TRACK, _BEAM = 0.36, 0.1  # half the distance of a mast's beams, and how wide they are
_TINE, _BACK = 0.12, 0.9  # width of a fork's tine; height of its back


def plate(outline: Sequence[Sequence[float]], depth: float, colour: str, opacity: float = 1.0) -> Any:
    """A plate upright in the machine's plane."""
    return ui.scene.extrusion([list(one) for one in outline], depth).material(colour, opacity).rotate(_LYING, 0.0, 0.0)


def plates(outline: Array, beside: Sequence[float], depth: float, colour: str, opacity: float = 1.0) -> Any:
    """Plates of one outline beside each other, as one body."""
    with ui.scene.group() as body:
        for side in beside:
            plate(outline.tolist(), depth, colour, opacity).move(0.0, side + 0.5 * depth, 0.0)
    return body


def around(pins: Array) -> Array:
    """An outline around pins, by the width of a pin's eye."""
    angle = np.linspace(0.0, 2.0 * math.pi, 13)[:-1]
    eye = _EYE * np.column_stack([np.cos(angle), np.sin(angle)])
    return hull((pins[:, None] + eye).reshape(-1, 2))


def shell(bucket: Bucket) -> Any:
    """A bucket: two cheeks, and plates between them along its floor and back."""
    with ui.scene.group() as body:
        for side in (-0.5 * _BUCKET, 0.5 * _BUCKET + _WALL):
            plate(bucket.outline.tolist(), _WALL, _SHELL).move(0.0, side, 0.0)
        for begin, end in itertools.pairwise(bucket.inside):
            way, middle = end - begin, 0.5 * (begin + end)
            floor = ui.scene.box(float(np.linalg.norm(way)) + _WALL, _BUCKET, _WALL).material(_SHELL)
            floor.rotate(0.0, -math.atan2(way[1], way[0]), 0.0).move(float(middle[0]), 0.0, float(middle[1]))
    return body


def beams(x: float, low: float, high: float, colour: str, *, within: float = 0.0) -> Any:
    """Two beams of a mast from `low` to `high`, and what joins them; `within` another mast they stand closer."""
    middle, long, half = 0.5 * (low + high), high - low, _TRACK - within
    with ui.scene.group() as body:
        for side in (-half, half):
            ui.scene.box(_BEAM, _BEAM, long).material(colour).move(x, side, middle)
        for z in (low + _BEAM, high - _BEAM):
            ui.scene.box(0.5 * _BEAM, 2.0 * half, _BEAM).material(colour).move(x, 0.0, z)
    return body


def fork(back: float, tip: Array) -> Any:
    """Two tines from a back at `back` to the tip."""
    x, z = (float(one) for one in tip)
    with ui.scene.group() as body:
        for side in (-0.7 * _TRACK, 0.7 * _TRACK):
            ui.scene.box(x - back, _TINE, 0.4 * _TINE).material(DARK).move(0.5 * (x + back), side, z)
            ui.scene.box(0.4 * _TINE, _TINE, _BACK).material(DARK).move(back, side, z + 0.5 * _BACK)
        for up in (0.2, 0.95):
            ui.scene.box(0.4 * _TINE, 2.0 * _TRACK, _TINE).material(DARK).move(back, 0.0, z + up * _BACK)
    return body


def chassis(seen: Scenery, width: float = _CHASSIS) -> None:
    """A machine on wheels, on the ground."""
    tyre_width = _TYRE_WIDTH * width / _CHASSIS
    plate(seen.chassis.tolist(), width, _PAINT).move(0.0, 0.5 * width, 0.0)
    for wheel in seen.wheels:
        for side in (-0.5, 0.5):
            place = float(wheel[0]), side * (width + tyre_width), float(wheel[1])
            ui.scene.cylinder(seen.radius, seen.radius, tyre_width, 24).material(DARK).move(*place)
            rim = 0.45 * seen.radius
            ui.scene.cylinder(rim, rim, 1.04 * tyre_width, 24).material(_PAINT).move(*place)
    ground = ui.scene.box(*_GROUND).material(_EARTH)
    ground.move(float(seen.wheels[:, 0].mean()) + 2.0, 0.0, -0.5 * _GROUND[2])


def rod(begin: float, end: float, radius: float, colour: str, opacity: float = 1.0) -> Any:
    """A round bar along x, as one body."""
    with ui.scene.group() as body:
        bar = ui.scene.cylinder(radius, radius, end - begin, 32).material(colour, opacity)
        bar.rotate(0.0, 0.0, _LYING).move(0.5 * (begin + end), 0.0, 0.0)
    return body


def turn(body: Any, drawn: Array, seen: Array) -> None:
    """Move a body from where it was drawn to where it is, both by two points of it."""
    before, after = drawn[1] - drawn[0], seen[1] - seen[0]
    angle = math.atan2(after[1], after[0]) - math.atan2(before[1], before[0])
    c, s = math.cos(angle), math.sin(angle)
    x, z = seen[0] - np.array([c * drawn[0][0] - s * drawn[0][1], s * drawn[0][0] + c * drawn[0][1]])
    body.rotate(0.0, -angle, 0.0).move(float(x), 0.0, float(z))


def stretch(bar: Any, begin: Array, end: Array) -> None:
    """Put a bar of length 1 between two points."""
    way = end - begin
    bar.scale(float(np.linalg.norm(way)), 1.0, 1.0)
    bar.rotate(_LYING, -math.atan2(way[1], way[0]), 0.0).move(float(begin[0]), 0.0, float(begin[1]))


_RATE = 12  # pictures a second; where no graphics card helps, more of them would hold up the strips
_STILL = 1e-4  # m, or t of a payload: less is not seen, and not sent
_APART, _BEFORE = 0.42, 0.2  # m: from the middle to an arm's plates; from a mast to the fork's back
_BARREL, _ROD = 0.12, 0.06  # m, of a cylinder's barrel and rod in the picture
_BENCH, _LEAST = 0.5, 0.05  # m, height of a bench; the least of a load
_PALLET = 2000.0  # kg/m3 of goods
_BLOCK, _GOODS = "#c98a1b", "#a9825a"
_RAM = "ram"  # what moves on a bench
_LEAVES, _PALE = 5, 0.12  # of the fan over a band: how many, and how opaque
_WIDE = 5e-3  # m: a band that is narrower is not seen, nor a leaf that has moved less


VIEWS = {"side": (0.0, -1.0, 0.0), "front": (1.0, -0.02, 0.1), "above": (0.0, -0.02, 1.0)}
"""Where one looks from, over the distance: forwards, to the left and upwards; straight down a camera has no upright."""


def _visible(bodies: Mapping[str, Any], is_seen: bool) -> None:
    """Show bodies, or hide them."""
    for body in bodies.values():
        body.visible(is_seen)


class MachineScene:
    """A scene of one machine."""

    def __init__(self, machine: Machine, linked: LinkedMachine | None) -> None:
        self._linked, self._times = linked, 1.0
        self._shown: list[float] | None = None
        self._known = self._is_wide = True
        self._edges: list[float] = []
        bodies = () if machine.linkage is None else machine.linkage.bodies.values()
        self._drives = all(body.kind == "turning" for body in bodies)  # a mast stands, a boom is driven about
        self._strokes = {name: unit.cylinder.stroke for name, unit in machine.units.items()}
        self._stroke = next(iter(self._strokes.values()))
        with ui.scene(width=560, height=360, background_color="#e9edf0", grid=(12, 24), fps=_RATE) as self.scene:
            self.scene.classes("w-full").style("height: 360px")
            if self._linked is None:
                self._bench()
            else:
                self._mechanism()

    def look(self, view: str, seconds: float = 0.5) -> None:
        """Look at the machine from one of `VIEWS`, or as at first."""
        (x, z), beside, far = self._middle, self._beside, self._far
        dx, dy, dz = VIEWS.get(view, (beside[0] / far, -1.0, beside[1] / far))
        self.scene.move_camera(
            x=x + dx * far, y=dy * far, z=z + dz * far, look_at_x=x, look_at_y=0.0, look_at_z=z, duration=seconds
        )

    def _set_out(self, middle: tuple[float, float], beside: tuple[float, float], far: float) -> None:
        """Put the camera where it is at first: so far from the middle (x, z) of all, and beside it [m]."""
        self._middle, self._beside, self._far = middle, beside, far
        self.look("", 0.0)

    def magnify(self, times: float) -> None:
        """Show the sensor's errors so many times as large."""
        self._times = times

    def show(
        self,
        true: Mapping[str, float],
        estimated: Mapping[str, float],
        payload: float = 0.0,
        *,
        band: Mapping[str, tuple[float, float]] = MappingProxyType({}),
        known: bool = True,
    ) -> None:
        """Put everything where it is.

        Args:
            true: positions [m], by unit.
            estimated: those that the sensor estimates [m].
            payload: that a mechanism carries [kg].
            band: the sensor's 95 % bands [m]; without one of a unit, it may be anywhere in its stroke.
            known: whether the sensors have positions; where one has none nothing is drawn of what they take it to be.
        """
        if known is not self._known:
            self._known = known
            _visible(self._ghosts, known)
        estimated = {name: self._magnified(name, at, true) for name, at in estimated.items()}
        self._fan({name: band.get(name, (0.0, self._strokes[name])) for name in true}, true)
        now = [*true.values(), *estimated.values(), 1e-3 * payload]
        if self._shown is not None and all(abs(a - b) < _STILL for a, b in zip(now, self._shown, strict=True)):
            return
        self._shown = now
        self._put(self._bodies, true)
        self._put(self._ghosts, estimated)
        if self._linked is None:
            return
        seen = self._seen(true)
        for strut, (barrel, moved) in zip(seen.struts, self._struts, strict=True):
            stretch(barrel, strut.base, strut.barrel_end)
            stretch(moved, strut.barrel_end, strut.rod)
        for link, bar in zip(seen.links, self._links, strict=True):
            stretch(bar, link[0], link[1])
        if seen.load is not None and self._load is not None:
            if self._drives:
                x, z = seen.load if seen.bucket is None else seen.bucket.inside.mean(axis=0)
                size = max(heap_radius(payload), _LEAST)
            else:  # goods, on the fork
                size = max(np.cbrt(payload / _PALLET), _LEAST)
                x, z = seen.load[0], seen.tip[1] + 0.5 * size
            self._load.move(float(x), 0.0, float(z)).scale(size)

    def _magnified(self, name: str, place: float, true: Mapping[str, float]) -> float:
        """A place of the sensor's with its error as large as it is shown."""
        return true[name] + self._times * (place - true[name])

    def _fan(self, band: Mapping[str, tuple[float, float]], true: Mapping[str, float]) -> None:
        """Sweep pale leaves over a band that is wide enough to be seen."""
        edges = [[self._magnified(name, edges[side], true) for name, edges in band.items()] for side in (0, 1)]
        low, high = (np.clip(one, 0.0, [self._strokes[name] for name in band]) for one in edges)
        is_wide = bool(np.any(high - low > _WIDE))
        if is_wide is not self._is_wide:
            self._is_wide = is_wide
            for leaf in self._leaves:
                _visible(leaf, is_wide)
        now = [*low, *high]
        if not is_wide or (self._edges and np.max(np.abs(np.subtract(now, self._edges))) < _WIDE):
            return
        self._edges = now
        for leaf, share in zip(self._leaves, np.linspace(0.0, 1.0, _LEAVES), strict=True):
            self._put(leaf, dict(zip(band, (low + share * (high - low)).tolist(), strict=True)))

    def _put(self, bodies: Mapping[str, Any], positions: Mapping[str, float]) -> None:
        """Put bodies where these positions [m] have them."""
        if self._linked is None:
            (place,) = positions.values()
            bodies[_RAM].move(1.25 * self._stroke + 0.2 + place, 0.0, _BENCH)
            return
        pins = self._pins(positions)
        for name, body in bodies.items():
            turn(body, self._drawn_pins[name], pins[name])

    def _seen(self, positions: Mapping[str, float]) -> Shapes:
        assert self._linked is not None
        places = [positions[unit.name] for unit in self._linked.units]
        strokes = [unit.cylinder.stroke for unit in self._linked.units]
        return shapes(self._linked.mechanism, np.clip(places, 0.0, strokes))

    def _pins(self, positions: Mapping[str, float]) -> dict[str, Array]:
        """Two points of each body, always the same ones; of a body that has only one, that one twice."""
        return {name: np.array([own[0][1], own[-1][1]]) for name, own in self._points(positions).items()}

    def _points(self, positions: Mapping[str, float]) -> dict[str, list[tuple[str, Array]]]:
        """Named points of each body."""
        assert self._linked is not None
        places = [positions[unit.name] for unit in self._linked.units]
        strokes = [unit.cylinder.stroke for unit in self._linked.units]
        mechanism = self._linked.mechanism
        found = points(mechanism, joints(mechanism, np.clip(places, 0.0, strokes)))
        return {name: own for name, own in found.items() if name != "frame"}

    def _bench(self) -> None:
        """A cylinder on a bench, and the block that its rod pushes."""
        s = self._stroke
        long, block = 1.2 * s + 0.2, 0.3 * s + 0.1
        barrel = rod(-0.05, long, 0.1, RED)
        barrel.move(0.0, 0.0, _BENCH)
        for x in (0.0, long):
            rod(x - 0.03, x + 0.03, 0.13, DARK).move(0.0, 0.0, _BENCH)
        ui.scene.box(3.0 * s + 1.0, 0.5, 0.05).move(1.4 * s + 0.2, 0.0, _BENCH - 0.2).material(STEEL)

        def ram(colour: str, of_block: str, opacity: float, radius: float) -> dict[str, Any]:
            with ui.scene.group() as moved:
                rod(-s, 0.0, radius, colour, opacity)
                ui.scene.box(block, 0.36, 0.3).material(of_block, opacity).move(0.5 * block, 0.0, 0.0)
            return {_RAM: moved}

        self._bodies = ram(STEEL, _BLOCK, 1.0, 0.045)
        self._ghosts = ram(GHOST, GHOST, 0.4, 0.06)
        self._leaves = [ram(GHOST, GHOST, _PALE, 0.06) for _ in range(_LEAVES)]
        self._set_out((1.2 * s, 0.4), (0.0, 1.0), 2.0 * s + 1.0)

    def _mechanism(self) -> None:
        assert self._linked is not None
        middle = {unit.name: 0.5 * unit.cylinder.stroke for unit in self._linked.units}
        drawn, self._drawn_pins = self._seen(middle), self._pins(middle)
        outlines = {name: around(np.array([place for _, place in own])) for name, own in self._points(middle).items()}
        colours = dict(zip(outlines, itertools.cycle(COLOURS)))
        tool = self._linked.mechanism.tip.body
        place = scenery(drawn.frame) if self._drives else truck(drawn.frame)
        if self._drives:
            chassis(place)
        else:
            chassis(place, 0.7 * _APART + 0.7)
        self._bodies = {name: self._body(name, drawn, one, colours[name]) for name, one in outlines.items()}
        if drawn.bucket is not None:
            outlines[tool] = drawn.bucket.outline

        def ghosts(opacity: float) -> dict[str, Any]:
            return {name: plates(one, (0.0,), 0.6 * PLATE, GHOST, opacity) for name, one in outlines.items()}

        self._ghosts, self._leaves = ghosts(0.35), [ghosts(_PALE) for _ in range(_LEAVES)]
        unit = np.array([[0.0, -0.5], [1.0, -0.5], [1.0, 0.5], [0.0, 0.5]])

        def bar(height: float, colour: str) -> Any:
            return plate((unit * [1.0, height]).tolist(), height, colour)

        self._struts = [(bar(_BARREL, RED), bar(_ROD, STEEL)) for _ in drawn.struts]
        self._links = [bar(_ROD, "#333333") for _ in drawn.links]
        self._load = None
        if drawn.load is not None:
            self._load = (
                ui.scene.sphere(1.0).material(ROCK) if self._drives else ui.scene.box(1.0, 1.0, 1.0).material(_GOODS)
            )
        everything = np.vstack([[*drawn.frame], place.outline, *outlines.values()])
        x, z = 0.5 * (everything.min(axis=0) + everything.max(axis=0))
        far = 0.7 * float(np.max(np.ptp(everything, axis=0))) + 0.3
        self._set_out((float(x), float(z)), (0.35 * far, 0.3 * far), far)
        self.show(middle, middle)

    def _body(self, name: str, drawn: Shapes, outline: Array, colour: str) -> Any:
        """A body: the bucket, plates on both sides of an arm's cylinders, or a part of a mast."""
        assert self._linked is not None
        if drawn.bucket is not None and name == self._linked.mechanism.tip.body:
            return shell(drawn.bucket)
        if self._drives:
            return plates(outline, (-_APART, _APART), PLATE, colour)
        return self._mast(name, drawn)

    def _mast(self, name: str, drawn: Shapes) -> Any:
        """A body that slides: the fork, or a stage of the mast."""
        assert self._linked is not None
        foot, top = drawn.struts[0].base, drawn.struts[0].rod
        long = float(drawn.struts[0].barrel_end[1] - foot[1])
        if name == self._linked.mechanism.tip.body:
            return fork(float(top[0]) + _BEFORE, drawn.tip)
        beams(float(foot[0]), float(foot[1]), float(foot[1]) + long, STEEL)
        return beams(float(top[0]), float(top[1]) - long, float(top[1]), _BLOCK, within=0.08)
