"""Where everything stands: cylinder above, its trunks below, pumps and valves between and beside them, the tank last.

The drawing is built from top to bottom. Nothing here knows a circuit by its name: what goes where follows from `order`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

from ramsight.drawing import part_symbols
from ramsight.drawing.circuit_drawing import Sheet
from ramsight.drawing.elements import Element, cylinder_symbol, elements, lying, moved, swapped, upright
from ramsight.drawing.order import Order, Trunk, order
from ramsight.drawing.shapes import SIZES, Point, Shape, Symbol, Word, through
from ramsight.plant.circuit import TANK
from ramsight.plant.unit import HydraulicUnit
from ramsight.units import RPM

_LEVEL = 88.0  # from a trunk's node to the next, with a part in line
_ROW = 92.0  # from a part across to the next
_FIRST_ROW = 58.0  # from a node to the first part across below it
_MOTOR = 62.0  # that a pump across is lower than another part, its motor above it
_DOWN = 62.0  # from a node's rail to the middle of what hangs on it
_BELOW = 96.0  # from there to the rail of the bottom
_LINE = 13.0  # from one line of words to the next
_BESIDE = 9.0  # from a line to the words beside it
_MIDDLE = 400.0  # between the trunks, at least
_FEED = 92.0  # from a trunk to its pump
_TO_MOTOR = 125.0  # from pump to motor, or to the next pump
_GAP = 26.0  # between columns
_UNDER_ROW = 48.0  # from a part across to the rail of pumps below it: room for the words over the motor
_LOOSE = 74.0  # between parts whose ends are named
_PILOT = 18.0  # from a pilot's port to its line
_UNDER_PAIR = 138.0  # from two checks to the bottom's rail: room for a pilot's line and an accumulator


def drawn(unit: HydraulicUnit, title: str | None = None, notes: Mapping[str, str] | None = None) -> Sheet:
    """Draw a unit's circuit.

    Args:
        title: above it; by default the unit's name.
        notes: a word more for parts by name, such as the model of a pump, or the number of cylinders.

    Raises:
        DescriptionError: a part names no nodes.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build
        >>> sheet = drawn(build(machine.load_machine("press").unit("ram"), "ram"))
        >>> sorted(part.name for part in sheet.placed)[:3]
        ['cylinder', 'drive', 'oil temperature']
    """
    known = notes or {}
    found = order(elements(unit, known), unit.cylinder.node_a, unit.cylinder.node_b)
    return _Layout(unit, found, title or unit.name, known).done()


class _Layout:
    """A sheet in the making."""

    def __init__(self, unit: HydraulicUnit, found: Order, title: str, notes: Mapping[str, str]) -> None:
        self.unit, self.order, self.notes = unit, found, notes
        self.sheet = Sheet(title)
        if found.cross_pump:  # their place is taken
            found.loose += [*found.feeders["a"], *found.feeders["b"]]
            found.feeders["a"], found.feeders["b"] = [], []
        self.levels = found.levels
        feeds = (len(found.feeders["a"]), len(found.feeders["b"]))
        shafts = sum(feeds) * _TO_MOTOR if sum(feeds) else 0.0
        edges = sum(_FEED for count in feeds if count) + (0.0 if all(feeds) else _FEED)
        self.x = {"a": 0.0, "b": max(_MIDDLE, shafts + edges if sum(feeds) else 0.0)}
        self.centre = 0.5 * self.x["b"]
        self.hanging: list[tuple[float, float]] = []  # lines that go down to the bottom: where, and from which height
        self.rails: dict[str, list[float]] = {}
        self.y: dict[int, float] = {}
        self.lowest = 0.0
        self.edge = {"a": self.x["a"], "b": self.x["b"]}

    def done(self) -> Sheet:
        """The finished sheet."""
        self._cylinder()
        self._trunks()
        base = self._across(self.levels - 1, self.y[self.levels - 1])
        if self.order.valve is not None:
            self._valve(self.order.valve)
        base = self._pair(base)
        self._feeders(base)
        for side in "ab":
            self._columns(side)
        self._bottom()
        self._loose()
        self._sensors()
        self._head()
        self.sheet.tidy()
        return self.sheet

    # -- the cylinder

    def _cylinder(self) -> None:
        c = self.unit.cylinder
        ends = {"node_a": c.node_a, "node_b": c.node_b}
        element = Element("cylinder", "cylinder", cylinder_symbol(c, self.x["a"], self.x["b"]), ends)
        symbol = self.sheet.put(element, element.symbol, ())
        right = max(x for shape in symbol.shapes for x, _ in getattr(shape, "points", ()))
        outwards = c.load_sign < 0.0
        self.sheet.others += part_symbols.load(right, outwards=outwards, either=c.passive)
        self._say((right + 34.0, -34.0), (f"{_rounded(c.mass)} kg",), "value")
        self._say((right + 34.0, 24.0), ("resists" if c.passive else "load +",), "value")
        for letter, side, step, anchor in (("A", "a", 7.0, "start"), ("B", "b", -7.0, "end")):
            at = (self.x[side] + step, 0.5 * part_symbols.BARREL + 14.0)
            self.sheet.words.append(Word(at, letter, "port", anchor))

    def _head(self) -> None:
        """Title and cylinder's words, above everything."""
        c = self.unit.cylinder
        note = (self.notes["cylinder"],) if "cylinder" in self.notes else ()
        words = (*note, f"A {_area(c.area_a)}, B {_area(c.area_b)}", f"stroke {c.stroke * 1e3:.4g} mm")
        left, top = self.x["a"] - 30.0, -0.5 * part_symbols.BARREL - 10.0
        self.sheet.words.append(Word((left, top), ", ".join(words)))
        self.sheet.words.append(Word((left, top - _LINE - 2.0), "cylinder", "name"))
        self.sheet.words.append(Word((self.sheet.box[0] + 18.0, top - 4.0 * _LINE), self.sheet.title, "title"))

    # -- trunks

    def _trunks(self) -> None:
        """Nodes of both sides from top to bottom, and what is in line between them."""
        y = 0.5 * part_symbols.BARREL + 22.0
        for level in range(self.levels):
            self.y[level] = y
            if level < self.levels - 1:
                y = self._across(level, y) + _LEVEL
        for side, trunk in (("a", self.order.a), ("b", self.order.b)):
            self._trunk(side, trunk)

    def _trunk(self, side: str, trunk: Trunk) -> None:
        x, inner = self.x[side], 1.0 if side == "a" else -1.0
        at: Point = (x, 0.5 * part_symbols.BARREL)
        for level, node in enumerate(trunk.nodes):
            rail = self.y[self.order.height(trunk, level)]
            self.sheet.run(node, at, (x, rail))
            at = (x, rail)
            self._name(node, (x - 6.0 * inner, rail - 4.0), "end" if side == "a" else "start")
            if level < len(trunk.line):
                element = trunk.line[level]
                middle = self.y[level + 1] - 0.5 * _LEVEL
                symbol = upright(element, top=node)
                symbol = (symbol if side == "a" else symbol.mirrored()).moved(x, middle)
                ports = sorted((symbol.ports[port] for port in ("inlet", "outlet")), key=lambda place: place[1])
                self.sheet.run(node, at, ports[0])
                near = symbol.box[2] if side == "a" else symbol.box[0]
                self._label(element, symbol, (near + 6.0 * inner, middle), "start" if side == "a" else "end")
                self._pilot(element, symbol)
                at = ports[1]

    # -- across

    def _across(self, level: int, y: float) -> float:
        """Parts between both trunks below a height, the pump last; gives the height that is free below them."""
        trunks = self.order.a, self.order.b
        wanted = sorted(self.order.across.get(level, []), key=lambda e: e.kind == "pump")
        for element in wanted:
            nodes = [next(n for n in trunk.nodes if n in element.ends.values()) for trunk in trunks]
            middle = y + (_FIRST_ROW if element is wanted[0] else _ROW) + (_MOTOR if element.kind == "pump" else 0.0)
            symbol = lying(element, left=nodes[0]).moved(self.centre, middle)
            left, right = sorted((symbol.ports[p] for p in ("inlet", "outlet")), key=lambda place: place[0])
            for node, side, port in ((nodes[0], "a", left), (nodes[1], "b", right)):
                self.sheet.run(node, (self.x[side], y), (self.x[side], middle), port)
            self._pilot(element, symbol)
            if element.kind == "pump":
                self._upright_motor(middle)
                self._label(element, symbol, (self.centre + 34.0, middle + 18.0), "start", below=True)
            else:
                self._label(element, symbol, (right[0] - 4.0, middle - 9.0), "start", above=True)
            y = middle
        return y

    def _upright_motor(self, y: float) -> None:
        top = y - part_symbols.PUMP_RADIUS
        middle = top - 34.0 - part_symbols.MOTOR_RADIUS
        turned = [through(lambda p: (p[1], -p[0]), s) for s in self._shaft(0.0, 34.0)]
        self.sheet.others += moved(turned, self.centre, top)
        self._motor((self.centre, middle), (self.centre + part_symbols.MOTOR_RADIUS + 7.0, middle - 2.0), "start")

    def _motor(self, at: Point, beside: Point, anchor: str, *, above: bool = False) -> None:
        note = (self.notes["drive"],) if "drive" in self.notes else ()
        words = (*note, f"to {self.unit.max_speed / RPM:.4g} rpm")
        element = Element("drive", "drive", part_symbols.motor(), {}, words)
        self._label(element, element.symbol.moved(*at), beside, anchor, above=above)

    def _shaft(self, begin: float, end: float) -> tuple[Shape, ...]:
        return part_symbols.shaft(begin, end, both_ways=self.order.valve is None)

    def _pair(self, y: float) -> float:
        """Two checks from the bottom between both trunks."""
        if not self.order.pair:
            return y
        middle, bottom = y + _ROW + 12.0, str(self.order.bottom)
        for element, side, inner in zip(self.order.pair, "ab", (1.0, -1.0), strict=True):
            trunk = self.order.a if side == "a" else self.order.b
            turned = element.symbol.mirrored().lying() if side == "a" else element.symbol.lying().mirrored()
            if element.ends["inlet"] != bottom:  # towards the bottom
                turned = turned.mirrored()
            symbol = turned.moved(self.centre - 92.0 * inner, middle)
            outer, near = sorted((symbol.ports[p] for p in ("inlet", "outlet")), key=lambda place: inner * place[0])
            self.sheet.run(trunk.end, (self.x[side], y), (self.x[side], middle), outer)
            self.sheet.run(bottom, near, (self.centre, middle))
            if side == "a":
                self._label(element, symbol, (outer[0] + 34.0, middle - 27.0), "end", above=True)
            else:
                self._label(element, symbol, (outer[0] - 34.0, middle + 38.0), "start", below=True)
            self._pair_pilot(element, symbol, -_PILOT if side == "a" else _PILOT, middle)
        self.hanging.append((self.centre, middle))
        self.lowest = max(self.lowest, middle + _UNDER_PAIR)
        return middle

    def _pair_pilot(self, element: Element, symbol: Symbol, step: float, y: float) -> None:
        """A pilot's line to the other trunk, past the other valve."""
        if "pilot" not in symbol.ports:
            return
        node, port = element.ends["pilot"], symbol.ports["pilot"]
        place = self.order.place(node)
        if place is None or node not in (self.order.a.end, self.order.b.end):
            self._flag(node, port, (port[0], port[1] + step), style="pilot")
            return
        x = self.x[place[0]]
        self.sheet.run(node, port, (port[0], port[1] + step), (x, port[1] + step), style="pilot")
        if port[1] + step > y:  # the trunk's line ends above
            self.sheet.run(node, (x, y), (x, port[1] + step))

    # -- the directional valve and what feeds it

    def _valve(self, element: Element) -> None:
        y = self.y[self.levels - 1]
        middle = y + 58.0
        symbol = element.symbol
        if element.ends["port_a"] != self.order.a.end:  # its port A fills the rod's side: the other way round
            symbol = swapped(symbol)
        symbol = symbol.moved(self.centre + 25.0, middle)
        for side, node in (("a", self.order.a.end), ("b", self.order.b.end)):
            port = next(symbol.ports[p] for p in ("port_a", "port_b") if element.ends[p] == node)
            self.sheet.run(node, (self.x[side], y), (port[0], y), port)
        self._label(element, symbol, (symbol.box[2] + 8.0, middle), "start")
        self._pilot(element, symbol)
        pump, back = symbol.ports["pump_port"], symbol.ports["tank_port"]
        if element.ends["tank_port"] == self.order.bottom:
            self.hanging.append(back)
        else:
            self._flag(element.ends["tank_port"], back, (back[0], back[1] + 14.0))
        self._feeding(element.ends["pump_port"], pump)

    def _feeding(self, node: str, port: Point) -> None:
        """What is between the valve's feeding node and the bottom: beside each other, the pump last."""
        rail = port[1] + 22.0
        self.sheet.run(node, port, (port[0], rail))
        middle, x = rail + _DOWN, port[0]
        for element in self.order.beside["p"]:
            symbol = upright(element, top=node).mirrored()
            x -= max(symbol.box[2], 12.0) + _GAP
            x = self._hang(element, symbol, node, (x, middle), rail, "end")
        for element in self.order.feeders["p"]:
            symbol = upright(element, top=node)
            x -= part_symbols.PUMP_RADIUS + _GAP
            at = x
            x = self._hang(element, symbol, node, (x, middle), rail, "end", low=True)
            if element is self.order.feeders["p"][-1]:
                self._lying_shaft([at], at - _TO_MOTOR, middle)
                x = min(x, at - _TO_MOTOR - 60.0)
        self.sheet.run(node, (port[0], rail), (self.rails.get(node, [port[0]])[-1], rail))
        self._name(node, (self.rails.get(node, [port[0]])[-1], rail - 4.0), "start")
        self.edge["a"] = min(self.edge["a"], x)

    # -- pumps on trunks

    def _feeders(self, y: float) -> None:
        """Pumps between a trunk and the bottom: between the trunks, on one shaft with the motor."""
        rows = self.order.feeders
        if not rows["a"] and not rows["b"]:
            return
        if self.order.across.get(self.levels - 1):
            y += _UNDER_ROW
        middle = y + _DOWN
        spots = []
        for side, inner in (("a", 1.0), ("b", -1.0)):
            trunk = self.order.a if side == "a" else self.order.b
            x = self.x[side] + inner * (_FEED - _TO_MOTOR)
            for element in rows[side]:
                x += inner * _TO_MOTOR
                spots.append(x)
                self.sheet.run(trunk.end, (self.x[side], self.y[self.levels - 1]), (self.x[side], y))
                self._hang(
                    element, upright(element, top=trunk.end), trunk.end, (x, middle), y,
                    "start" if side == "a" else "end", low=True,
                )  # fmt: skip
                self.sheet.run(trunk.end, (self.x[side], y), (x, y))
        one_sided = spots[-1] + (_TO_MOTOR if rows["a"] else -_TO_MOTOR)
        motor = self.centre if rows["a"] and rows["b"] else one_sided
        self._lying_shaft(spots, motor, middle)

    def _lying_shaft(self, pumps: Sequence[float], motor: float, y: float) -> None:
        """Motor and pumps on one level shaft."""
        spots = sorted([(x, part_symbols.PUMP_RADIUS) for x in pumps] + [(motor, part_symbols.MOTOR_RADIUS)])
        for (x0, r0), (x1, r1) in pairwise(spots):
            self.sheet.others += moved(self._shaft(x0 + r0, x1 - r1), 0.0, y)
        self._motor((motor, y), (motor, y - part_symbols.MOTOR_RADIUS - 8.0), "middle", above=True)

    # -- beside the trunks

    def _columns(self, side: str) -> None:
        """Parts from a trunk to the bottom beside it: those of its lower nodes nearer to it, so that no lines cross."""
        trunk = self.order.a if side == "a" else self.order.b
        outer = -1.0 if side == "a" else 1.0
        lowest = self.y[self.levels - 1]
        middle, x = lowest + _DOWN, self.edge[side]
        straight = (
            not trunk.line and self.order.valve is None and not self.order.feeders[side] and not self.order.across
        )
        heights = {node: self.order.height(trunk, k) for k, node in enumerate(trunk.nodes)}
        for element in sorted(self.order.beside[side], key=lambda e: -max(heights.get(n, -1) for n in e.ends.values())):
            node = next(n for n in element.ends.values() if n in heights)
            symbol = upright(element, top=node)
            symbol = symbol.mirrored() if side == "a" else symbol
            inner = -symbol.box[0] if side == "b" else symbol.box[2]
            x += 0.0 if straight else outer * (max(inner, 12.0) + _GAP)
            straight = False
            rail = self.y[heights[node]]
            self.sheet.run(node, (self.x[side], rail), (x, rail))
            x = self._hang(element, symbol, node, (x, middle), rail, "end" if side == "a" else "start")
        self.edge[side] = (min if side == "a" else max)(self.edge[side], x)

    def _hang(
        self, element: Element, symbol: Symbol, node: str, at: Point, rail: float, anchor: str, *, low: bool = False
    ) -> float:
        """Hang an upright part on a node's rail, its other port to the bottom; gives where its words end."""
        placed = symbol.moved(*at)
        top, foot = sorted((placed.ports[p] for p in ("inlet", "outlet")), key=lambda place: place[1])
        self.sheet.run(node, (at[0], rail), top)
        self.rails.setdefault(node, []).append(at[0])
        self.hanging.append(foot)
        side = 1.0 if anchor == "start" else -1.0
        words = self._label(
            element, placed, (at[0] + side * _BESIDE, at[1] + (44.0 if low else 34.0)), anchor, below=True
        )
        self._pilot(element, placed)
        reach = max((word.box[2] - word.box[0] for word in words), default=0.0) + _BESIDE
        box = symbol.box
        return at[0] + side * max(reach, box[2] if side > 0 else -box[0])

    # -- the bottom

    def _bottom(self) -> None:
        """The rail that everything returns to, with its tank or accumulator and the thermometer of the oil."""
        node = self.order.bottom
        if node is None:
            return
        words = [word.box[3] + 12.0 for one in self.sheet.placed for word in one.words]
        y = max([self.lowest, *words, *(foot + _BELOW - 34.0 for _, foot in self.hanging)])
        right = max(
            [self.edge["b"] if self.order.beside["b"] or self.order.valve else 0.0, *(x for x, _ in self.hanging)]
        )
        for element in self.order.stores:
            right = self._store(element, right, y)
        self._thermometer(node, max(right, *(x for x, _ in self.hanging)) + 40.0, y)
        for x, foot in self.hanging:
            self.sheet.run(node, (x, foot), (x, y))
        spots = sorted({x for x, _ in self.hanging} | ({self.centre} if node == TANK else set()))
        for begin, end in pairwise(spots):
            self.sheet.run(node, (begin, y), (end, y))
        if node == TANK:
            element = Element(
                "tank", "tank", part_symbols.tank(), {"node": TANK}, (f"{self.unit.tank_pressure / 1e5:.3g} bar abs.",)
            )
            symbol = element.symbol.moved(self.centre, y + 26.0)
            self.sheet.run(node, (self.centre, y), symbol.ports["node"])
            self._label(element, symbol, (self.centre + 30.0, y + 36.0), "start")
        if node != TANK or self.order.loose:
            self._name(node, (spots[0], y + 13.0), "start")
        self.lowest = y

    def _store(self, element: Element, right: float, y: float) -> float:
        """Stand an accumulator on the bottom's rail: below two checks, or at its right; gives where its words end."""
        inside = bool(self.order.pair) and element is self.order.stores[0]
        x = self.centre - 46.0 if inside else right + 20.0 + _GAP
        self.hanging.append((x, y))
        side = -1.0 if inside else 1.0
        words = self._label(
            element, element.symbol.moved(x, y - 38.0), (x + side * 22.0, y - 40.0), "end" if inside else "start"
        )
        return right if inside else max(word.box[2] for word in words)

    def _thermometer(self, node: str, x: float, y: float) -> None:
        element = Element("oil temperature", "sensor", part_symbols.thermometer(), {"node": node})
        symbol = element.symbol.moved(x, y - 30.0)
        self.sheet.run(node, symbol.ports["node"], (x, y))
        self.hanging.append((x, y))
        self._label(element, symbol, (x + 18.0, y - 30.0), "start")

    # -- what is left

    def _loose(self) -> None:
        """Parts that fit nowhere: beside the drawing, their ends named."""
        x = max(self.edge["b"], self.sheet.box[2]) + 40.0
        y = self.y[0]
        for element in self.order.loose:
            symbol = element.symbol.moved(x - element.symbol.box[0], y - element.symbol.box[1])
            for port, place in symbol.ports.items():
                if port != "pilot":
                    upwards = place[1] < 0.5 * (symbol.box[1] + symbol.box[3])
                    self._flag(element.ends[port], place, (place[0], place[1] + (-16.0 if upwards else 16.0)))
            self._pilot(element, symbol)
            self._label(element, symbol, (symbol.box[2] + 6.0, 0.5 * (symbol.box[1] + symbol.box[3])), "start")
            y = symbol.box[3] + _LOOSE

    def _pilot(self, element: Element, symbol: Symbol) -> None:
        """A pilot's line that leads away too far to be drawn: its node is named."""
        if "pilot" in symbol.ports:
            (x, y), (left, top, right, _) = symbol.ports["pilot"], symbol.box
            if x in (left, right):
                end = (x + (12.0 if x == right else -12.0), y)
            else:
                end = (x, y + (-12.0 if y == top else 12.0))
            self._flag(element.ends["pilot"], (x, y), end, style="pilot")

    def _flag(self, node: str, begin: Point, end: Point, *, style: str = "line") -> None:
        """A short line whose end states which node it goes on with."""
        self.sheet.run(node, begin, end, style=style)
        if begin[0] == end[0]:
            self._name(node, (end[0], end[1] + (10.0 if end[1] > begin[1] else -4.0)), "middle")
        else:
            self._name(node, (end[0] + (3.0 if end[0] > begin[0] else -3.0), end[1] + 3.0),
                       "start" if end[0] > begin[0] else "end")  # fmt: skip

    def _sensors(self) -> None:
        """Pressure sensors of the chambers, where they are declared."""
        if self.unit.assumptions.pressure.std <= 0.0:
            return
        for side, inner in (("a", 1.0), ("b", -1.0)):
            node = self.order.a.nodes[0] if side == "a" else self.order.b.nodes[0]
            symbol = part_symbols.pressure_sensor() if side == "a" else part_symbols.pressure_sensor().mirrored()
            placed = symbol.moved(self.x[side] + inner * 60.0, self.y[0])
            self.sheet.run(node, (self.x[side], self.y[0]), placed.ports["node"])
            self.sheet.put(Element(f"pressure_{side}", "sensor", symbol, {"node": node}), placed, ())

    # -- words

    def _name(self, node: str, at: Point, anchor: str) -> None:
        self.sheet.words.append(Word(at, node, "node", anchor))

    def _say(self, at: Point, texts: Sequence[str], kind: str) -> None:
        self.sheet.words += [Word((at[0], at[1] + _LINE * k), text, kind) for k, text in enumerate(texts)]

    def _label(
        self, element: Element, symbol: Symbol, at: Point, anchor: str, *, above: bool = False, below: bool = False
    ) -> tuple[Word, ...]:
        """Put a part and its words: beside a place, or above or below it."""
        texts = [element.name, *element.words]
        first = at[1] + 4.0 - 0.5 * _LINE * (len(texts) - 1)
        if above:
            first = at[1] - _LINE * (len(texts) - 1)
        elif below:
            first = at[1] + 0.8 * SIZES["value"] - 8.0
        kinds = ["name"] + ["value"] * len(element.words)
        words = tuple(
            Word((at[0], first + _LINE * k), text, kind, anchor)
            for k, (text, kind) in enumerate(zip(texts, kinds, strict=True))
        )
        self.sheet.put(element, symbol, words)
        return words


def _rounded(value: float) -> str:
    return f"{value:.3g}" if value < 1000.0 else f"{round(value, -1):.0f}"


def _area(area: float) -> str:
    return f"{area * 1e4:.4g} cm²"
