"""Parts of a machine in space: plates, a bucket, a fork, a chassis. For the eye only; all lengths are in m."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from nicegui import ui

from ramsight.arrays import Array
from ramsight.drawing.mechanism.bodies import hull
from ramsight.drawing.mechanism.bucket import Bucket
from ramsight.drawing.mechanism.scenery import Scenery

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
