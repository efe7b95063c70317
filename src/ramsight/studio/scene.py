"""A machine in space: plates of its mechanism, cylinders that extend, and where the sensor takes it to be."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from nicegui import ui

from ramsight.arrays import Array
from ramsight.drawing.mechanism.bodies import Shapes, hull, shapes
from ramsight.drawing.mechanism.scenery import COLOURS, GHOST, ROCK, Scenery, heap_radius, scenery
from ramsight.machine.description import Machine
from ramsight.plant.linkage import joints, points
from ramsight.plant.linked import LinkedMachine

_RATE = 12  # pictures a second; where no graphics card helps, more of them would hold up the strips
_STILL = 1e-4  # m, or t of a payload: less is not seen, and not sent
_DEPTH = 0.25  # m, of a plate
_BAR = 0.06  # m, half the width of a body that has no outline
_BARREL, _ROD = 0.12, 0.06  # m, heights of a cylinder's barrel and rod in the picture
_LYING = math.pi / 2.0
_CHASSIS, _TYRE_WIDTH, _GROUND, _LEAST = 1.6, 0.45, (14.0, 9.0, 0.05), 0.05  # m, of what stands around
_BUCKET, _WALL = 1.9, 0.05  # m, width of a bucket and its plates
_PAINT, _TYRE, _FOOT = "#d9c48f", "#4a4f55", "#56616d"
_STEEL, _RED = "#8b939c", "#b03030"


VIEWS = {"side": (0.0, -1.0, 0.0), "front": (1.0, -0.02, 0.1), "above": (0.0, -0.02, 1.0)}
"""Where one looks from, over the distance: forwards, to the left and upwards; straight down a camera has no upright."""


class MachineScene:
    """A scene of one machine.

    Args:
        linked: its mechanism; without one a cylinder on a bench is drawn.
    """

    def __init__(self, machine: Machine, linked: LinkedMachine | None) -> None:
        self._linked, self._times = linked, 1.0
        self._shown: list[float] | None = None
        self._known = True
        bodies = () if machine.linkage is None else machine.linkage.bodies.values()
        self._drives = all(body.kind == "turning" for body in bodies)  # a mast stands, a boom is driven about
        self._stroke = next(iter(machine.units.values())).cylinder.stroke
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
        self, true: Mapping[str, float], estimated: Mapping[str, float], payload: float = 0.0, *, known: bool = True
    ) -> None:
        """Put everything where it is.

        Args:
            true: positions [m], by unit.
            estimated: those that the sensor estimates [m].
            payload: that a mechanism carries [kg].
            known: whether the sensors have positions; where one has none nothing is drawn of what they take it to be.
        """
        if known is not self._known:
            self._known = known
            for ghost in [self._ghost_rod] if self._linked is None else self._ghosts.values():
                ghost.visible(known)
        estimated = {name: at + self._times * (estimated[name] - at) for name, at in true.items()}
        now = [*true.values(), *estimated.values(), 1e-3 * payload]
        if self._shown is not None and all(abs(a - b) < _STILL for a, b in zip(now, self._shown, strict=True)):
            return
        self._shown = now
        if self._linked is None:
            (x,), (ghost,) = true.values(), estimated.values()
            self._rod.move(self._stroke + 0.15 + x, 0.0, 0.5)
            self._ghost_rod.move(self._stroke + 0.15 + ghost, 0.0, 0.5)
            return
        for pins, plates in ((self._pins(true), self._plates), (self._pins(estimated), self._ghosts)):
            for name, plate in plates.items():
                _turn(plate, self._drawn_pins[name], pins[name])
        if self._shell is not None:
            name, shell = self._shell
            _turn(shell, self._drawn_pins[name], self._pins(true)[name], 0.0)
        seen = self._seen(true)
        for strut, (barrel, rod) in zip(seen.struts, self._struts, strict=True):
            _stretch(barrel, strut.base, strut.barrel_end)
            _stretch(rod, strut.barrel_end, strut.rod)
        for link, plate in zip(seen.links, self._links, strict=True):
            _stretch(plate, link[0], link[1])
        if seen.load is not None and self._load is not None:
            self._load.move(float(seen.load[0]), 0.0, float(seen.load[1])).scale(max(heap_radius(payload), _LEAST))

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
        s = self._stroke
        ui.scene.box(s + 0.3, 0.2, 0.2).move(0.5 * s, 0.0, 0.5).material(_RED)
        ui.scene.box(3.0 * s + 1.0, 0.5, 0.05).move(1.2 * s, 0.0, 0.3).material(_STEEL)
        self._rod = _plate([[-s - 0.15, -0.05], [0.0, -0.05], [0.0, 0.05], [-s - 0.15, 0.05]], 0.1, _STEEL)
        self._ghost_rod = _plate([[-0.04, -0.09], [0.0, -0.09], [0.0, 0.09], [-0.04, 0.09]], 0.18, GHOST, 0.5)
        self._set_out((1.2 * s, 0.4), (0.0, 1.0), 2.4 * s + 1.2)

    def _mechanism(self) -> None:
        assert self._linked is not None
        middle = {unit.name: 0.5 * unit.cylinder.stroke for unit in self._linked.units}
        self._drawn = drawn = self._seen(middle)
        self._drawn_pins = self._pins(middle)
        named = [(name, hull(np.array([place for _, place in own]))) for name, own in self._points(middle).items()]
        colours = (COLOURS * len(named))[: len(named)]
        wide = [_wide(hull) for _, hull in named]
        self._plates = {n: _plate(w.tolist(), _DEPTH, c) for (n, _), w, c in zip(named, wide, colours, strict=True)}
        tool = self._linked.mechanism.tip.body
        self._shell = None
        if self._drives and tool in self._plates:
            outline = dict(named)[tool]
            self._plates[tool].material(colours[list(self._plates).index(tool)], 0.25)
            self._shell = tool, _bucket(outline, drawn.tip, colours[list(self._plates).index(tool)])
        self._ghosts = {n: _plate(w.tolist(), 0.6 * _DEPTH, GHOST, 0.35) for (n, _), w in zip(named, wide, strict=True)}
        unit = [[0.0, -0.5], [1.0, -0.5], [1.0, 0.5], [0.0, 0.5]]

        def bar(height: float, colour: str) -> Any:
            return _plate([[u, v * height] for u, v in unit], 0.6 * _DEPTH, colour)

        self._struts = [(bar(_BARREL, _RED), bar(_ROD, _STEEL)) for _ in drawn.struts]
        self._links = [bar(_ROD, "#333333") for _ in drawn.links]
        self._load = None if drawn.load is None else ui.scene.sphere(1.0).material(ROCK)
        frame = np.array([*drawn.frame])
        if self._drives:
            around = scenery(drawn.frame)
            _chassis(around)
            everything = np.vstack([frame, around.outline, *wide])
        else:
            low, high = frame.min(axis=0), frame.max(axis=0)
            foot = ui.scene.box(max(high[0] - low[0], 0.4) + 0.3, 0.5, 0.12).material(_FOOT)
            foot.move(float(0.5 * (low[0] + high[0])), 0.0, float(low[1]) - 0.1)
            everything = np.vstack([frame, *wide])
        x, z = 0.5 * (everything.min(axis=0) + everything.max(axis=0))
        far = 0.7 * float(np.max(np.ptp(everything, axis=0))) + 0.3
        self._set_out((float(x), float(z)), (0.35 * far, 0.3 * far), far)
        self.show(middle, middle)


def _chassis(around: Scenery) -> None:
    """A machine on wheels, on the ground, behind its arm."""
    ui.scene.extrusion(around.chassis.tolist(), _CHASSIS).material(_PAINT).rotate(_LYING, 0.0, 0.0).move(
        0.0, 0.5 * _CHASSIS, 0.0
    )
    for wheel in around.wheels:
        for side in (-0.5, 0.5):
            tyre = ui.scene.cylinder(around.radius, around.radius, _TYRE_WIDTH, 24).material(_TYRE)
            tyre.move(float(wheel[0]), side * (_CHASSIS + _TYRE_WIDTH), float(wheel[1]))
            rim = ui.scene.cylinder(0.45 * around.radius, 0.45 * around.radius, 1.04 * _TYRE_WIDTH, 24)
            rim.material(_PAINT).move(float(wheel[0]), side * (_CHASSIS + _TYRE_WIDTH), float(wheel[1]))
    ground = ui.scene.box(*_GROUND).material("#cfc7b8")
    ground.move(float(around.wheels[:, 0].mean()) + 2.0, 0.0, -0.5 * _GROUND[2])


def _bucket(outline: Array, tip: Array, colour: str) -> Any:
    """A bucket as a shell: two sides, and plates along the edges of its outline but the one above the tip."""
    corners = [*outline, outline[0]]
    edges = list(itertools.pairwise(corners))
    at_tip = sorted(edges, key=lambda edge: min(float(np.linalg.norm(end - tip)) for end in edge))[:2]
    opening = max(at_tip, key=lambda edge: float(edge[0][1] + edge[1][1]))
    with ui.scene.group() as shell:
        for side in (-0.5 * _BUCKET, 0.5 * _BUCKET + _WALL):
            _plate(outline.tolist(), _WALL, colour).move(0.0, side, 0.0)
        for begin, end in edges:
            if begin is opening[0] and end is opening[1]:
                continue
            way, middle = end - begin, 0.5 * (begin + end)
            plate = ui.scene.box(float(np.linalg.norm(way)), _BUCKET, _WALL).material(colour)
            plate.rotate(0.0, -math.atan2(way[1], way[0]), 0.0).move(float(middle[0]), 0.0, float(middle[1]))
    return shell


def _wide(outline: Array) -> Array:
    """An outline that can be seen: a body of two points becomes a bar, one of a single point a square."""
    if len(outline) > 2:
        return outline
    begin, end = outline[0], outline[-1]
    size = float(np.linalg.norm(end - begin))
    along = (end - begin) / size if size > 0.0 else np.array([1.0, 0.0])
    begin, end = begin - _BAR * along, end + _BAR * along
    across = _BAR * np.array([-along[1], along[0]])
    return np.array([begin - across, end - across, end + across, begin + across])


def _plate(outline: list[list[float]], depth: float, colour: str, opacity: float = 1.0) -> Any:
    plate = ui.scene.extrusion(outline, depth).material(colour, opacity)
    return plate.rotate(_LYING, 0.0, 0.0)


def _turn(plate: Any, drawn: Array, seen: Array, lying: float = _LYING) -> None:
    """Move a body's plate from where its hull was drawn to where it is; a group of parts does not lie."""
    before, after = drawn[1] - drawn[0], seen[1] - seen[0]
    angle = math.atan2(after[1], after[0]) - math.atan2(before[1], before[0])
    c, s = math.cos(angle), math.sin(angle)
    x, z = seen[0] - np.array([c * drawn[0][0] - s * drawn[0][1], s * drawn[0][0] + c * drawn[0][1]])
    plate.rotate(lying, -angle, 0.0).move(float(x), 0.0, float(z))


def _stretch(bar: Any, begin: Array, end: Array) -> None:
    """Put a bar of length 1 between two points."""
    way = end - begin
    bar.scale(float(np.linalg.norm(way)), 1.0, 1.0)
    bar.rotate(_LYING, -math.atan2(way[1], way[0]), 0.0).move(float(begin[0]), 0.0, float(begin[1]))
