"""The drawing of docs/design.md: which room of the package imports which, read from the code.

python evaluation/rooms.py docs/images/rooms.svg

The order and the captions are the page's list. Dark arcs alone give the order; a pale one imports what a chain of dark
ones reaches anyway.
"""

from __future__ import annotations

import ast
import re
import sys
from html import escape
from pathlib import Path

from ramsight.output import write_text

ROOT = Path(__file__).parent.parent
SOURCE = ROOT / "src" / "ramsight"
PAGE = ROOT / "docs" / "design.md"
INK, PALE, FILL = "#1f2a36", "#c3cbd3", "#f4f1ea"
STEP, BOX, LEFT, TOP, WIDTH = 34, 92, 330, 14, 740  # px
ARROW, LEAVES = 4, 5  # px, half of an arrow's height; how far from a box's middle arcs leave and arrive


def listed() -> dict[str, str]:
    """Rooms in the page's order, and what the page calls each in capitals or in its first words."""
    rows = re.findall(r"^  (\w+)(?:/|\.py) +(.*)$", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)
    found = {}
    for name, words in rows:
        capitals = re.match(r"(?:[A-Z]+ )+[A-Z]+\b", words)
        found[name] = (capitals[0].lower() if capitals else re.split(r"[,;:]", words)[0]).replace("`", "")
    return found


def imported(file: Path) -> set[str]:
    """Dotted names that a file imports, those inside of functions too."""
    package = ["ramsight", *file.relative_to(SOURCE).parts[:-1]]
    found = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            name = ".".join([*base, *([node.module] if node.module else [])])
            found |= {f"{name}.{alias.name}" for alias in node.names} if name == "ramsight" else {name}
    return found


def edges(rooms: list[str]) -> set[tuple[str, str]]:
    """Which room imports which; of those that are listed."""
    found = set()
    for room in rooms:
        place = SOURCE / room
        for file in sorted(place.rglob("*.py")) if place.is_dir() else [place.with_suffix(".py")]:
            parts = [name.split(".") for name in imported(file)]
            others = {part[1] for part in parts if part[0] == "ramsight" and len(part) > 1}
            found |= {(room, other) for other in others & set(rooms) - {room}}
    return found


def reduced(found: set[tuple[str, str]]) -> set[tuple[str, str]]:
    """The imports that no chain of others stands for."""

    def reaches(room: str, goal: str, without: tuple[str, str]) -> bool:
        nexts = [other for one, other in found if one == room and (one, other) != without]
        return goal in nexts or any(reaches(other, goal, without) for other in nexts)

    return {edge for edge in found if not reaches(*edge, edge)}


def drawn(rooms: dict[str, str], found: set[tuple[str, str]]) -> str:
    """The drawing as SVG text."""
    row = {name: TOP + STEP * k + STEP // 2 for k, name in enumerate(rooms)}
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {2 * TOP + STEP * len(rooms)}" role="img" '
        f'font-family="sans-serif" font-size="13" aria-label="rooms of the package and what they import">',
        '<rect width="100%" height="100%" fill="white"/>',
    ]
    dark = reduced(found)
    for edge in sorted(found, key=lambda edge: (edge in dark, edge)):
        begin, end = row[edge[0]] - LEAVES, row[edge[1]] + LEAVES
        out = LEFT + BOX + 14 + 0.55 * abs(begin - end)
        colour, width = (INK, 1.4) if edge in dark else (PALE, 1)
        x, tip = LEFT + BOX, LEFT + BOX + 8
        lines.append(
            f'<path d="M {x} {begin} C {out:g} {begin} {out:g} {end} {tip} {end}" fill="none" stroke="{colour}" '
            f'stroke-width="{width}"/>'
        )
        lines.append(f'<path d="M {x} {end} l 9 {-ARROW} v {2 * ARROW} z" fill="{colour}"/>')
    for name, words in rooms.items():
        y = row[name]
        lines += [
            f'<rect x="{LEFT}" y="{y - 11}" width="{BOX}" height="22" rx="4" fill="{FILL}" stroke="{INK}"/>',
            f'<text x="{LEFT + BOX / 2:g}" y="{y + 4.5}" text-anchor="middle" fill="{INK}">{name}</text>',
            f'<text x="{LEFT - 10}" y="{y + 4.5}" text-anchor="end" fill="{INK}">{escape(words)}</text>',
        ]
    return "\n".join([*lines, "</svg>", ""])


def main() -> None:
    """Write the drawing."""
    rooms = listed()
    write_text(drawn(rooms, edges(list(rooms))), Path(sys.argv[1]))


if __name__ == "__main__":
    main()
