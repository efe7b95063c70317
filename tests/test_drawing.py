"""Drawings of circuits: what is joined is drawn joined, nothing is drawn over anything, and every part is there."""

import xml.etree.ElementTree as ET
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import ramsight
from ramsight import machine
from ramsight.drawing import drawn, svg
from ramsight.drawing.circuit_drawing import Sheet, Wire, is_on
from ramsight.drawing.notes import notes
from ramsight.drawing.shapes import Word, around, points_of
from ramsight.errors import DescriptionError
from ramsight.plant.build import build
from ramsight.plant.hose import Volume
from ramsight.plant.pilot_check import PilotCheckValve
from ramsight.plant.valve import CheckValve, Orifice, ReliefValve

from .command import as_command, at_once

UNITS = [
    (entry.name, unit) for entry in ramsight.catalogue("machine") for unit in machine.load_machine(entry.name).units
]
SVG = "{http://www.w3.org/2000/svg}"


def unit_of(name, unit):
    described = machine.load_machine(name)
    return build(described, unit)


def sheet_of(name, unit):
    return drawn(unit_of(name, unit), f"{name}: {unit}", notes(machine.load_machine(name).unit(unit)))


every_unit = pytest.mark.parametrize(("name", "unit"), UNITS)


def meets(one, other):
    """Whether two lines have a point in common."""
    (l0, t0, r0, b0), (l1, t1, r1, b1) = line_box(one), line_box(other)
    return l0 <= r1 and l1 <= r0 and t0 <= b1 and t1 <= b0


def only_crosses(one, other):
    """Whether two lines cross in the middle of both, which joins nothing."""
    if one.is_level == other.is_level:
        return not meets(one, other)
    level, upright = (one, other) if one.is_level else (other, one)
    point = (upright.begin[0], level.begin[1])
    return not meets(one, other) or (
        point not in (one.begin, one.end, other.begin, other.end) and is_on(point, one) and is_on(point, other)
    )


def pieces(sheet, node):
    """The lines of a node as sets of those that are joined."""
    found = []
    for wire in (w for w in sheet.wires if w.node == node):
        near = [piece for piece in found if any(meets(wire, other) for other in piece)]
        found = [piece for piece in found if piece not in near] + [[wire, *(w for piece in near for w in piece)]]
    return found


def named(sheet, node, piece):
    """Whether the node's name stands beside these lines."""
    words = [word.at for word in sheet.words if word.kind == "node" and word.text == node]
    boxes = [(w[0] - 14.0, w[1] - 14.0, w[2] + 14.0, w[3] + 14.0) for w in map(line_box, piece)]
    return any(not apart((*at, *at), box) for at in words for box in boxes)


def wrongly_joined(sheet):
    """What a reader would take for joined, or not joined, and is not so."""
    wrong = [
        (one, other)
        for one, other in combinations(sheet.wires, 2)
        if one.node != other.node and not only_crosses(one, other)
    ]
    for part in sheet.placed:
        for port, node in part.ends.items():
            at = part.symbol.ports[port]
            if not any(w.node == node and is_on(at, w) for w in sheet.wires):
                wrong.append((part.name, port))
            wrong += [(part.name, port, w) for w in sheet.wires if w.node != node and is_on(at, w)]
    for node in {wire.node for wire in sheet.wires}:
        found = pieces(sheet, node)
        if len(found) > 1:
            wrong += [(node, piece) for piece in found if not named(sheet, node, piece)]
    return wrong


def apart(one, other, by=0.0):
    return one[2] <= other[0] + by or other[2] <= one[0] + by or one[3] <= other[1] + by or other[3] <= one[1] + by


def line_box(wire):
    return (*map(min, zip(wire.begin, wire.end, strict=True)), *map(max, zip(wire.begin, wire.end, strict=True)))


def drawn_over(sheet):
    """What is drawn over something else: symbols, lines and words."""
    wrong = []
    whole = [(part.name, part.symbol.box) for part in sheet.placed]
    wrong += [(a, b) for (a, one), (b, other) in combinations(whole, 2) if not apart(one, other, 0.5)]
    bodies = [
        (part.name, around(points_of(shape)))
        for part in sheet.placed
        for shape in part.symbol.shapes
        if not isinstance(shape, Word)
    ]
    bodies += [("shaft", around(points_of(shape))) for shape in sheet.others]
    wrong += [(name, wire) for name, box in bodies for wire in sheet.wires if not apart(box, line_box(wire), 3.0)]
    words = [*sheet.words, *(word for part in sheet.placed for word in part.words)]
    wrong += [(a.text, b.text) for a, b in combinations(words, 2) if not apart(a.box, b.box, 1.0)]
    wrong += [(word.text, name) for word in words for name, box in bodies if not apart(word.box, box, 1.0)]
    wrong += [(word.text, wire) for word in words for wire in sheet.wires if not apart(word.box, line_box(wire), 1.0)]
    return wrong


@every_unit
def test_every_part_is_drawn_once(name, unit):
    parts = [part.name for part in unit_of(name, unit).parts() if not isinstance(part, Volume)]
    shown = [part.name for part in sheet_of(name, unit).placed if part.kind not in ("tank", "sensor")]
    assert sorted(shown) == sorted(parts)


@every_unit
def test_what_is_joined_is_drawn_joined_and_nothing_else(name, unit):
    assert wrongly_joined(sheet_of(name, unit)) == []


@every_unit
def test_nothing_is_drawn_over_anything(name, unit):
    assert drawn_over(sheet_of(name, unit)) == []


@every_unit
def test_the_cylinder_is_above_and_the_tank_at_the_bottom(name, unit):
    sheet = sheet_of(name, unit)
    at = {part.name: part.symbol.box for part in sheet.placed}
    others = [box for part, box in at.items() if part not in ("cylinder", "tank", "reservoir", "link_angle")]
    assert all(at["cylinder"][3] <= box[3] for box in others)
    last = at.get("tank") or at["reservoir"]
    assert all(box[1] <= last[3] for box in others)
    pumps = [part for part in sheet.placed if part.kind == "pump"]
    motor = at["drive"]
    assert all(box[3] >= motor[1] - 60.0 for box in (part.symbol.box for part in pumps))


@every_unit
def test_rods_make_the_areas_true_in_their_ratio(name, unit):
    c = unit_of(name, unit).cylinder
    barrel, *rods, _piston = [
        shape.points for part in sheet_of(name, unit).placed if part.name == "cylinder" for shape in part.symbol.shapes
    ][:4]
    rods = [points for points in rods if points[1][1] != barrel[1][1]]
    bore = barrel[2][1] - barrel[1][1]
    areas = {"a": bore**2, "b": bore**2}
    for points in rods:
        areas["b" if points[1][0] > barrel[1][0] else "a"] -= (points[2][1] - points[1][1]) ** 2
    assert areas["b"] / areas["a"] == pytest.approx(c.area_b / c.area_a, rel=1e-9)


def test_the_free_way_of_a_check_valve_leads_over_its_seat_to_its_ball():
    sheet = sheet_of("press", "ram")
    for part in sheet.placed:
        if part.kind == "check valve":
            seat, ball = part.symbol.shapes[0].points[1], part.symbol.shapes[1].centre
            inlet = part.symbol.ports["inlet"]
            assert abs(inlet[1] - seat[1]) < abs(inlet[1] - ball[1])


def test_a_relief_valve_is_held_shut_against_the_pressure_at_its_inlet():
    for part in sheet_of("eha-test-bench", "axis").placed:
        if part.kind == "relief valve":
            pilot = next(s for s in part.symbol.shapes if getattr(s, "style", "") == "pilot")
            inlet, outlet = (part.symbol.ports[p] for p in ("inlet", "outlet"))
            begin = pilot.points[0]
            assert abs(begin[0] - inlet[0]) < abs(begin[0] - outlet[0])


def test_a_pump_that_turns_one_way_has_one_triangle():
    def triangles(name, unit):
        (pump,) = [part for part in sheet_of(name, unit).placed if part.kind == "pump"]
        return len(pump.symbol.shapes) - 1

    assert triangles("eha-valve-rig", "axis") == 1
    assert triangles("forklift-mast", "lift") == 2


def test_lines_that_join_have_a_dot_and_lines_that_cross_have_none():
    sheet = Sheet("two nodes")
    sheet.run("a", (0.0, 0.0), (10.0, 0.0))
    sheet.run("a", (5.0, 0.0), (5.0, 9.0))
    sheet.run("b", (8.0, -5.0), (8.0, 5.0))
    assert sheet.junctions == [("a", (5.0, 0.0))]


def test_pieces_of_a_line_become_one():
    sheet = Sheet("one node")
    sheet.run("a", (0.0, 0.0), (4.0, 0.0))
    sheet.run("a", (9.0, 0.0), (3.0, 0.0))
    sheet.run("a", (9.0, 0.0), (9.0, 5.0))
    sheet.tidy()
    assert sheet.wires == [Wire("a", (0.0, 0.0), (9.0, 0.0)), Wire("a", (9.0, 0.0), (9.0, 5.0))]


MORE = {
    "orifice": lambda name, a, b: Orifice(name, a, b, 1e-7),
    "relief": lambda name, a, b: ReliefValve(name, a, b, 100e5, 1e-10),
    "check": lambda name, a, b: CheckValve(name, a, b, 0.5e5, 1e-7),
    "pilot": lambda name, a, b: PilotCheckValve(name, a, b, "chamber_b", 0.5e5, 1e-7, 3.0),
}


@st.composite
def changed_units(draw):
    """A unit of the catalogue with further parts between nodes that it has, or a new one."""
    name, unit = draw(st.sampled_from([one for one in UNITS if not one[0].startswith("mining-loader")]))
    built = unit_of(name, unit)
    nodes = sorted({node for part in drawn(built).placed for node in part.ends.values()} | {"new"})
    ends = st.lists(st.sampled_from(nodes), min_size=2, max_size=2, unique=True)
    kinds = draw(st.lists(st.tuples(st.sampled_from(sorted(MORE)), ends), min_size=1, max_size=4))
    more = [MORE[kind](f"more_{k}", *those) for k, (kind, those) in enumerate(kinds)]
    return replace(built, extra=(*built.extra, *more))


@settings(max_examples=60, deadline=None)
@given(changed_units())
def test_any_circuit_is_drawn_as_it_is_joined(unit):
    sheet = drawn(unit)
    assert wrongly_joined(sheet) == []
    parts = sorted(part.name for part in unit.parts() if not isinstance(part, Volume))
    assert sorted(part.name for part in sheet.placed if part.kind not in ("tank", "sensor")) == parts


def test_port_reliefs_of_the_direct_driven_unit_stand_beside_the_others(tmp_path):
    file = tmp_path / "loader.toml"
    assert at_once("new", file).returncode == 0
    text = file.read_text(encoding="utf-8")
    valve = '\n[units.boom.port_relief_valve]\nmodel = "DB10P-01"\nsetting = "250 bar"\n'
    file.write_text(text + valve, encoding="utf-8")
    sheet = drawn(build(machine.load_machine(file).unit("boom"), "boom"))
    assert {"port_relief_a", "port_relief_b"} <= {part.name for part in sheet.placed}
    assert wrongly_joined(sheet) == []
    assert drawn_over(sheet) == []


def test_the_pages_pictures_are_what_is_drawn_today(script):
    root = Path(__file__).parent.parent
    pictures = script("drawings")
    page = (root / "docs" / "reference" / "circuits.md").read_text(encoding="utf-8")
    assert list(pictures.units()) == UNITS
    for name, unit in UNITS:
        file = pictures.file_name(name, unit)
        assert (root / "docs" / "images" / file).read_text(encoding="utf-8") == ramsight.draw(name, unit=unit)
        assert f"](../images/{file})" in page
    assert len(list((root / "docs" / "images").glob("circuit-*.svg"))) == len(UNITS)


class Strange:
    """A part of somebody's own, with no nodes."""

    name = "strange"

    def connect(self, circuit):
        pass


def test_a_part_without_nodes_is_refused_by_its_name():
    built = unit_of("press", "ram")
    with pytest.raises(DescriptionError, match="strange: cannot be drawn"):
        drawn(replace(built, extra=(*built.extra, Strange())))


def test_the_svg_has_a_group_for_each_part_and_each_node():
    root = ET.fromstring(ramsight.draw("press"))
    groups = list(root.iter(f"{SVG}g"))
    assert {"part-pump_a", "part-relief_b", "part-cylinder"} <= {g.get("id") for g in groups}
    assert {"tank", "port_a", "chamber_b"} <= {g.get("data-node") for g in groups}
    assert root.find(f"{SVG}title").text == "press: ram"
    assert root.get("width").endswith("mm")


def test_words_of_a_description_are_no_markup():
    text = svg.text(drawn(unit_of("press", "ram"), "<script>alert(1)</script> & more", {"pump_a": "<b>"}))
    assert "<script" not in text
    assert "<b>" not in text
    ET.fromstring(text)


@pytest.mark.parametrize(("suffix", "begins"), [(".svg", b"<svg"), (".png", b"\x89PNG"), (".pdf", b"%PDF")])
def test_the_verb_writes_what_the_suffix_says(suffix, begins, tmp_path):
    file = tmp_path / f"boom{suffix}"
    run = as_command if suffix == ".png" else at_once
    done = run("draw", "mining-loader", "--unit", "boom", "--out", file)
    assert (done.returncode, done.stderr, done.stdout) == (0, "", f"{file}: written\n")
    assert file.read_bytes().startswith(begins)
    assert [one.name for one in tmp_path.iterdir()] == [file.name]


def test_the_verb_says_what_is_wrong(tmp_path):
    def said(*words):
        done = at_once("draw", *words)
        assert done.returncode == 2
        return done.stderr

    assert "name one" in said("mining-loader", "--out", str(tmp_path / "a.svg"))
    assert "unknown suffix" in said("press", "--out", str(tmp_path / "a.bmp"))
    assert "unknown unit 'rim'" in said("press", "--unit", "rim", "--out", str(tmp_path / "a.svg"))
    file = tmp_path / "my.svg"
    file.write_text("format = 1")
    assert "give another file" in said(str(file), "--out", str(file))
    assert sorted(one.name for one in tmp_path.iterdir()) == ["my.svg"]
