"""From the parts of a unit to elements of a drawing: a symbol, the nodes at its ports, and the words beside it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ramsight.drawing import part_symbols
from ramsight.drawing.shapes import Shape, Symbol, Word, through
from ramsight.errors import DescriptionError
from ramsight.plant.accumulator import Accumulator
from ramsight.plant.cylinder import Cylinder
from ramsight.plant.directional import DirectionalValve, metered
from ramsight.plant.hose import Hose, Volume
from ramsight.plant.load_sensing import LoadSensingPump, MeteringValve
from ramsight.plant.pilot_check import PilotCheckValve
from ramsight.plant.pump import Pump
from ramsight.plant.unit import HydraulicUnit
from ramsight.plant.valve import CheckValve, Orifice, ReliefValve, SafetyValve


@dataclass(frozen=True)
class Element:
    """One part of a circuit, to be drawn."""

    name: str
    kind: str  # what it is, as descriptions state it
    symbol: Symbol  # as it is made; the layout turns and moves it
    ends: Mapping[str, str]  # node at each port
    words: tuple[str, ...] = ()  # what stands beside it below its name


def elements(unit: HydraulicUnit, notes: Mapping[str, str]) -> tuple[Element, ...]:
    """The parts of a unit, but for drive, cylinder and rigid volumes, as elements.

    Args:
        notes: a word for parts by name, such as the model of a pump; it stands before the values.

    Raises:
        DescriptionError: a part that is no part of the catalogue does not name two nodes, `inlet` and `outlet`.
    """
    one_way = metered(unit.parts())
    found = []
    for part in unit.parts():
        if part is unit.drive or part is unit.cylinder or isinstance(part, Volume):
            continue
        element = _element(part, one_way=one_way)
        if element.name in notes:
            element = Element(
                element.name, element.kind, element.symbol, element.ends, (notes[element.name], *element.words)
            )
        found.append(element)
    return tuple(found)


def _element(part: Any, *, one_way: bool) -> Element:
    match part:
        case LoadSensingPump():
            ends = {**_two(part), "pilot": part.load_line}
            words = (*_pump_words(part), f"{_bar(part.margin)} over the load")
            return Element(part.name, "pump", part_symbols.load_sensing_pump(), ends, words)
        case Pump():
            return Element(part.name, "pump", part_symbols.pump(reversible=not one_way), _two(part), _pump_words(part))
        case ReliefValve():
            return Element(part.name, "relief valve", part_symbols.relief(), _two(part), (f"{_bar(part.setting)}",))
        case CheckValve():
            symbol = part_symbols.check(spring=part.cracking_pressure > 0.0)
            return Element(part.name, "check valve", symbol, _two(part), _cracking(part))
        case PilotCheckValve():
            ends = {**_two(part), "pilot": part.pilot}
            words = (f"ratio {part.pilot_ratio:g} : 1", *_cracking(part))
            symbol = part_symbols.pilot_check(spring=part.cracking_pressure > 0.0)
            return Element(part.name, "pilot check valve", symbol, ends, words)
        case SafetyValve():
            ends = {"inlet": part.pump_side, "outlet": part.cylinder_side}
            way = "opens to lower" if part.commanded else "held open"
            return Element(part.name, "safety valve", part_symbols.safety(), ends, (way,))
        case Hose():
            words = (f"{part.length:.3g} m, ø {part.diameter * 1e3:.3g} mm",)
            return Element(part.name, "hose", part_symbols.hose(), _two(part), words)
        case Orifice():
            at = part.conductance * math.sqrt(_ORIFICE_POINT) * 60e3
            return Element(part.name, "orifice", part_symbols.orifice(), _two(part), (f"{at:.3g} l/min at 1 bar",))
        case DirectionalValve():
            ends = {key: getattr(part, key) for key in ("port_a", "port_b", "pump_port", "tank_port")}
            symbol = part_symbols.directional()
            if isinstance(part, MeteringValve):
                ends["pilot"], symbol = part.load_line, part_symbols.metering()
            return Element(part.name, "directional valve", symbol, ends, ("drawn at command 1",))
        case Accumulator():
            words = (f"{part.volume * 1e3:.3g} l", f"{_bar(part.precharge)} abs.")
            return Element(part.name, "accumulator", part_symbols.accumulator(), {"node": part.node}, words)
    if isinstance(getattr(part, "inlet", None), str) and isinstance(getattr(part, "outlet", None), str):
        return Element(part.name, type(part).__name__, part_symbols.box(), _two(part))
    raise DescriptionError(
        "cannot be drawn: it names no nodes", key=part.name, allowed="a part with an inlet and an outlet"
    )


_ORIFICE_POINT = 1e5  # Pa, at which an orifice's flow is written


def _two(part: Any) -> dict[str, str]:
    return {"inlet": part.inlet, "outlet": part.outlet}


def _pump_words(part: Pump) -> tuple[str, ...]:
    belt = () if part.belt == 1.0 else (f"belt {part.belt:.3g}",)
    return (f"{part.displacement * 2e6 * math.pi:.3g} cm³/rev", *belt)


def _cracking(part: CheckValve | PilotCheckValve) -> tuple[str, ...]:
    return (f"{_bar(part.cracking_pressure)}",) if part.cracking_pressure > 0.0 else ()


def _bar(pressure: float) -> str:
    return f"{pressure / 1e5:.3g} bar"


_SECOND_ROD = 0.55  # diameter over the bore's of a rod with another one at its other side


def upright(element: Element, top: str) -> Symbol:
    """A symbol whose port of one node is above."""
    symbol = element.symbol
    above = min((p for p in symbol.ports if p in ("inlet", "outlet")), key=lambda p: symbol.ports[p][1])
    return symbol if element.ends[above] == top else symbol.upside_down()


def lying(element: Element, left: str) -> Symbol:
    """A symbol that lies, with its port of one node at its left."""
    symbol = element.symbol.lying()
    first = min((p for p in symbol.ports if p in ("inlet", "outlet")), key=lambda p: symbol.ports[p][0])
    return symbol if element.ends[first] == left else symbol.mirrored()


def swapped(symbol: Symbol) -> Symbol:
    """A directional valve with its ports A and B exchanged, their letters too."""
    letters = {"A": "B", "B": "A"}
    shapes = (replace(s, text=letters.get(s.text, s.text)) if isinstance(s, Word) else s for s in symbol.shapes)
    ports = {**symbol.ports, "port_a": symbol.ports["port_b"], "port_b": symbol.ports["port_a"]}
    return Symbol(tuple(shapes), ports)


def moved(shapes: Sequence[Shape], x: float, y: float) -> list[Shape]:
    """Shapes that belong to no part, at another place."""
    return [through(lambda p: (p[0] + x, p[1] + y), shape) for shape in shapes]


def cylinder_symbol(c: Cylinder, port_a: float, port_b: float) -> Symbol:
    """The cylinder with rods whose thickness makes its areas true in their ratio.

    Areas alone do not tell a second rod: there is one, at side A, if area B is not the smaller one.
    """
    if c.area_b < c.area_a:
        rod, rod_a = math.sqrt(1.0 - c.area_b / c.area_a), 0.0
    else:
        rod, rod_a = _SECOND_ROD, math.sqrt(1.0 - c.area_a / c.area_b * (1.0 - _SECOND_ROD**2))
    cushions = c.cushion_length_a is not None, c.cushion_length_b is not None
    return part_symbols.cylinder(port_a, port_b, rod, rod_a, cushions)
