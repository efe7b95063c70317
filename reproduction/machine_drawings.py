"""The paper's drawings of the machine and of its models, made from the description: Figs 1, 2, 5 and 6."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

from film.side_view import draw_ground, draw_rock, draw_scenery, draw_shapes, name_parts
from ramsight.drawing import Sheet, drawn
from ramsight.drawing.mechanism.bodies import shapes
from ramsight.drawing.mechanism.scenery import scenery
from ramsight.drawing.notes import notes
from ramsight.drawing.shapes import Area, Line, Word
from ramsight.drawing.svg import paint
from ramsight.machine.description import DirectDriven
from ramsight.machine.parts import Pump
from ramsight.plant.ddh import DdhUnit
from ramsight.plant.linked import LinkedMachine, build_linked
from reproduction.bench import Bench
from reproduction.chapter import Chapter, Picture
from reproduction.choices import UNITS, direct_driven
from reproduction.diagrams import Arrow, Diagram, draw_diagram

_WIDTH = 7.2  # inch, of the report's figures
_POSE = (0.55, 0.2)  # shares of the strokes, boom and bucket, at which the arm is shown: carrying
_ELECTRICS = ("Altairnano 96 V", "Sevcon Gen4 Size 6", "Motenergy ME1304")
"""Battery, motor controller and motor, as the paper names them; of the motor's name its digits are lost."""
_BOX, _HIGH, _APART = 150.0, 44.0, 16.0  # of a box of the electrics: width, height; between two


def drawings(benches: dict[str, Bench]) -> Chapter:
    """Figs 1, 2, 5 and 6."""
    bench = benches[UNITS[0]]
    described = direct_driven(bench.machine, UNITS[0])
    sheet = _circuit(bench.unit, described)
    left, top, right, bottom = sheet.box
    models = (
        ("fig05_hydraulics", "hydraulics", hydraulics(described), "Fig. 5", 4.2),
        ("fig06_pumps", "pumps", pumps(described), "Fig. 6", 4.0),
    )
    return Chapter(
        "The machine and its models, drawn (Figs 1, 2, 5 and 6)",
        (
            "Drawn from the description of this run, so that a value that is changed changes here too. The arm's "
            "dimensions "
            "are derived; circuit and components are the paper's. Of its two models the drawings show the parts and "
            "what goes from one to the other. Every part of the hydraulics is a law of its own between two volumes of "
            "oil, and the pumps work as motors too, with eqs 3 to 10 in all four quadrants.",
        ),
        {},
        pictures=(
            *_arm(benches),
            Picture(
                "fig02_circuit",
                "Circuit and components of the boom's unit (the paper's Fig. 2); the motor's digits are a guess.",
                partial(paint_sheet, sheet=sheet),
                (_WIDTH, _WIDTH * (bottom - top) / (right - left)),
            ),
            *(
                Picture(
                    name,
                    f"Model of the boom's {what} (the paper's {place}); its oil goes either way.",
                    _diagram(diagram),
                    (_WIDTH, high),
                )
                for name, what, diagram, place, high in models
            ),
        ),
    )


def _diagram(diagram: Diagram) -> Callable[[Any], None]:
    return partial(draw_diagram, diagram=diagram)


# -- Fig. 1


def _arm(benches: dict[str, Bench]) -> tuple[Picture, ...]:
    described = benches[UNITS[0]].machine
    if described.linkage is None:
        return ()
    draw = partial(_draw_arm, machine=build_linked(described))
    return (Picture("fig01_loader", "The loader and its arm, to scale (the paper's Fig. 1).", draw, (_WIDTH, 3.4)),)


def _draw_arm(figure: Any, machine: LinkedMachine) -> None:
    axes = figure.add_subplot(aspect="equal")
    strokes = np.array([unit.cylinder.stroke for unit in machine.units])
    seen = shapes(machine.mechanism, np.array(_POSE) * strokes)
    draw_scenery(axes, scenery(seen.frame))
    draw_rock(axes, seen, machine.mechanism.rated_payload or 0.0)
    draw_shapes(axes, seen)
    name_parts(axes, seen)
    draw_ground(axes)
    axes.margins(0.04)
    axes.set(xlabel="forward [m]", ylabel="up [m]")
    axes.set_axisbelow(True)


# -- Fig. 2


def _circuit(unit: DdhUnit, described: DirectDriven) -> Sheet:
    """The unit's circuit with battery, controller and motor by name."""
    words = notes(described) | {"drive": _ELECTRICS[2]}
    sheet = drawn(unit, "Unit of the boom", words)
    motor = next(part for part in sheet.placed if part.name == "drive")
    x = 0.5 * (motor.symbol.box[0] + motor.symbol.box[2])
    below = min(word.box[1] for word in motor.words)
    for name, what in zip(_ELECTRICS[1::-1], ("motor controller", "battery"), strict=True):
        foot = below - _APART
        head = foot - _HIGH
        left, right = x - 0.5 * _BOX, x + 0.5 * _BOX
        sheet.others += [
            Line(((x, below), (x, foot)), "thin"),
            Area(((left, head), (right, head), (right, foot), (left, foot))),
            Word((x, head + 18.0), what, "name", "middle"),
            Word((x, head + 34.0), name, "value", "middle"),
        ]
        below = head
    return sheet


def paint_sheet(figure: Any, sheet: Sheet) -> None:
    """Draw a circuit over the whole of a figure.

    Args:
        figure: matplotlib's, as wide over its height as the sheet.
        sheet: the circuit.
    """
    figure.set_layout_engine("none")
    paint(figure.add_axes((0.0, 0.0, 1.0, 1.0)), sheet, width=float(figure.get_size_inches()[0]))


# -- Figs 5 and 6


def hydraulics(unit: DirectDriven) -> Diagram:
    """The boom's hydraulics as blocks: pumps, valves and lines of each side, cylinders and load (Fig. 5).

    Args:
        unit: the description.
    """
    c, hose = unit.cylinder, unit.hose
    rods = f"{c.number} cylinders\nø {1e3 * c.bore:.4g} / {1e3 * c.rod:.4g} mm\nstroke {1e3 * c.stroke:.4g} mm"
    tank = f"tank\n{1e-5 * unit.tank.pressure:.3g} bar"
    boxes = {"motor speed": (0.06, 0.5), "pumps\nFig. 6": (0.2, 0.5), rods: (0.9, 0.5), "load": (0.9, 0.06)}
    arrows = [
        Arrow("motor speed", "pumps\nFig. 6", ""),
        Arrow("load", rods, "force"),
    ]
    for letter, side, y, outer in (("A", "a", 0.72, 0.95), ("B", "b", 0.28, 0.05)):
        commanded = side == unit.load_side
        manifold = f"manifold {letter}\n{1e3 * unit.manifold.volume:.3g} l"
        safety = f"safety valve {letter}\n{'opens to lower' if commanded else 'held open'}"
        line = f"hose {letter}, {1e3 * hose.volume:.3g} l\n{hose.length:.3g} m, ø {1e3 * hose.diameter:.3g} mm"
        relief = f"relief valve {letter}\n{1e-5 * unit.relief_valve.setting:.4g} bar, to tank"
        feed, sump = f"anti-cavitation\nvalve {letter}", f"{tank} " if side == "b" else tank
        boxes |= {manifold: (0.35, y), safety: (0.53, y), line: (0.73, y)}
        boxes |= {relief: (0.42, outer), feed: (0.25, outer), sump: (0.07, outer)}
        arrows += [
            Arrow("pumps\nFig. 6", manifold, "flow"),
            Arrow(manifold, safety, ""),
            Arrow(safety, line, ""),
            Arrow(line, rods, "oil"),
            Arrow(manifold, relief, ""),
            Arrow(feed, manifold, ""),
            Arrow(sump, feed, ""),
            Arrow(sump, "pumps\nFig. 6", "", 0.0),
        ]
        if commanded:
            boxes["motor speed "] = (0.62, outer)
            arrows.append(Arrow("motor speed ", safety, "opens it"))
    return Diagram(boxes, tuple(arrows), ("motor speed", "motor speed ", "load"))


def pumps(unit: DirectDriven) -> Diagram:
    """The boom's pumps as blocks: belts, displacements and losses of both, and the torque that they take (Fig. 6).

    Args:
        unit: the description.
    """
    boxes = {"motor speed": (0.07, 0.5), "motor torque": (0.93, 0.5), "tank": (0.46, 0.5)}
    arrows = []
    for letter, pump, y, outer in (("A", unit.pump_a, 0.76, 0.95), ("B", unit.pump_b, 0.24, 0.05)):
        belt = f"belt {letter}\n{Fraction(pump.belt).limit_denominator(1000)}"
        block, leak, friction, line = (
            _block(letter, pump),
            f"leakage {letter}\neqs 9, 10",
            f"friction {letter}\neqs 7, 8",
            f"manifold {letter}",
        )
        boxes |= {belt: (0.17, y), block: (0.46, y), leak: (0.27, outer), friction: (0.8, y), line: (0.65, outer)}
        arrows += [
            Arrow("motor speed", belt, ""),
            Arrow(belt, block, "speed"),
            Arrow(leak, block, ""),
            Arrow(block, line, "flow, eq. 3"),
            Arrow("tank", block, "oil"),
            Arrow(block, friction, "torque, eq. 4"),
            Arrow(friction, "motor torque", "over the belt"),
        ]
    return Diagram(boxes, tuple(arrows), ("motor speed", "motor torque"))


def _block(letter: str, pump: Pump) -> str:
    each = f"{pump.blocks} × {pump.chambers} × {1e6 * 2.0 * np.pi * pump.displacement:.3g}"
    whole = f"{1e6 * 2.0 * np.pi * pump.displacement_per_rad:.3g} cm³/rev"
    return f"pump-motor {letter}\n{pump.model or ''}\n{each} = {whole}"
