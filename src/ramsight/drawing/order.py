"""What a circuit is to somebody who draws it: two trunks that hang from the cylinder, and what is between and beside.

A trunk leads from a chamber down to the pumps: its nodes, and the parts in line between them. What is left are pumps,
parts across from one trunk to the other, and parts from a trunk to the node that all return to, the bottom.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from ramsight.drawing.elements import Element
from ramsight.plant.circuit import TANK

_IN_LINE = ("hose", "safety valve", "orifice", "check valve", "pilot check valve")
_ENDS_OF_TRUNKS = ("pump", "directional valve")


@dataclass(frozen=True)
class Trunk:
    """Nodes from a chamber down, and the elements between them, one less."""

    nodes: tuple[str, ...]
    line: tuple[Element, ...]

    @property
    def end(self) -> str:
        """The lowest node."""
        return self.nodes[-1]


@dataclass
class Order:
    """The elements of a circuit, sorted by where they are drawn."""

    # a, b: the trunks of the cylinder's sides
    a: Trunk
    b: Trunk
    bottom: str | None  # the node that all return to, or None where there is none
    valve: Element | None = None  # the directional valve below both trunks
    # pumps between trunk a, or trunk b, and the bottom; "p": the node that the valve is fed by
    feeders: dict[str, list[Element]] = field(default_factory=lambda: {"a": [], "b": [], "p": []})
    # from the lowest node of one trunk to that of the other, or between nodes of one height, by that height
    across: dict[int, list[Element]] = field(default_factory=dict)
    pair: list[Element] = field(default_factory=list)  # two checks from the bottom, one to each trunk
    # from a trunk's node, or the valve's feeding node ("p"), to the bottom
    beside: dict[str, list[Element]] = field(default_factory=lambda: {"a": [], "b": [], "p": []})
    stores: list[Element] = field(default_factory=list)  # accumulators at the bottom
    loose: list[Element] = field(default_factory=list)  # everything else; its nodes are named where it is drawn

    @property
    def levels(self) -> int:
        """How many heights there are."""
        return max(len(self.a.nodes), len(self.b.nodes))

    def height(self, trunk: Trunk, index: int) -> int:
        """Height of a trunk's node, 0 at the chamber; the lowest ones of both trunks are level."""
        return self.levels - 1 if index == len(trunk.nodes) - 1 else index

    @property
    def cross_pump(self) -> bool:
        """Whether a pump is between the two trunks."""
        return any(element.kind == "pump" for row in self.across.values() for element in row)

    def place(self, node: str) -> tuple[str, int] | None:
        """Trunk ("a", "b" or "p") and height (0 at the chamber) of a node; None where it is on none."""
        for name, trunk in (("a", self.a), ("b", self.b)):
            if node in trunk.nodes:
                return name, self.height(trunk, trunk.nodes.index(node))
        if self.valve is not None and node == self.valve.ends["pump_port"] and node != self.bottom:
            return "p", 0
        return None


def order(elements: Sequence[Element], chamber_a: str, chamber_b: str) -> Order:
    """Sort the elements of a circuit by where they are drawn."""
    bottom = _bottom(elements)
    taken = {bottom} if bottom is not None else set()
    a = _trunk(elements, chamber_a, taken | {chamber_b})
    b = _trunk(elements, chamber_b, taken | set(a.nodes))
    found = Order(a, b, bottom)
    found.valve = next((e for e in elements if e.kind == "directional valve" and _is_below(e, a, b)), None)
    done = {id(one) for one in (*a.line, *b.line, found.valve)}
    for element in elements:
        if id(element) not in done:
            _sort(found, element)
    _join_checks(found)
    return found


def _bottom(elements: Sequence[Element]) -> str | None:
    """The tank if anything is joined to it; else the node of the accumulator with the lowest name."""
    nodes = {node for element in elements for node in element.ends.values()}
    if TANK in nodes:
        return TANK
    return min((e.ends["node"] for e in elements if e.kind == "accumulator"), default=None)


def _trunk(elements: Sequence[Element], chamber: str, closed: set[str]) -> Trunk:
    """The shortest way from a chamber to where a pump or a directional valve is, through parts in line."""
    goals = {node for e in elements if e.kind in _ENDS_OF_TRUNKS for node in e.ends.values()} - closed
    ways: list[tuple[tuple[str, ...], tuple[Element, ...]]] = [((chamber,), ())]
    seen = {chamber, *closed}
    while ways:
        nodes, line = ways.pop(0)
        if nodes[-1] in goals:
            return Trunk(nodes, line)
        for element in elements:
            ends = (element.ends.get("inlet", ""), element.ends.get("outlet", ""))
            if element.kind in _IN_LINE and nodes[-1] in ends:
                other = ends[0] if ends[1] == nodes[-1] else ends[1]
                if other not in seen:
                    seen.add(other)
                    ways.append(((*nodes, other), (*line, element)))
    return Trunk((chamber,), ())


def _is_below(valve: Element, a: Trunk, b: Trunk) -> bool:
    return {valve.ends["port_a"], valve.ends["port_b"]} == {a.end, b.end}


def _sort(found: Order, element: Element) -> None:
    """Put one element where it belongs."""
    if element.kind == "accumulator" and element.ends["node"] == found.bottom:
        found.stores.append(element)
        return
    if set(element.ends) - {"inlet", "outlet", "pilot"} or "inlet" not in element.ends:
        found.loose.append(element)
        return
    ends = element.ends["inlet"], element.ends["outlet"]
    places = [found.place(node) for node in ends]
    if found.bottom in ends:
        place = places[0] or places[1]
        if place is not None and element.kind == "pump" and place[1] == _lowest(found, place[0]):
            found.feeders[place[0]].append(element)
        elif place is not None and element.kind != "pump":
            found.beside[place[0]].append(element)
        else:
            found.loose.append(element)
    elif None not in places and {p[0] for p in places if p} == {"a", "b"} and _is_level(found, places):
        height = places[0][1] if places[0] else 0
        found.across.setdefault(height, []).append(element)
    else:
        found.loose.append(element)


def _lowest(found: Order, trunk: str) -> int:
    return 0 if trunk == "p" else found.levels - 1


def _is_level(found: Order, places: Sequence[tuple[str, int] | None]) -> bool:
    """Whether two places are equally high, and what is between them can be drawn so."""
    heights = {place[1] for place in places if place is not None}
    return len(heights) == 1 and (found.valve is None or heights != {found.levels - 1})


def _join_checks(found: Order) -> None:
    """Two checks from the bottom, one to the end of each trunk, stand together where a pump is across."""
    if not found.cross_pump:
        return
    kinds = ("check valve", "pilot check valve")
    ends = {"a": found.a.end, "b": found.b.end}
    fitting = {
        side: [e for e in found.beside[side] if e.kind in kinds and ends[side] in e.ends.values()] for side in "ab"
    }
    if all(len(those) == 1 for those in fitting.values()) and len({those[0].kind for those in fitting.values()}) == 1:
        found.pair = [fitting["a"][0], fitting["b"][0]]
        for side in "ab":
            found.beside[side].remove(fitting[side][0])
