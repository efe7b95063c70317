"""The picture of a circuit in a notebook: the package states what draws it, because a description knows no drawing."""

from __future__ import annotations

from collections.abc import Callable

from ramsight.errors import RamsightError

_DRAWERS: list[Callable[[object, str], str]] = []


def draw_circuits_by(drawer: Callable[[object, str], str]) -> None:
    """State what draws circuits.

    Args:
        drawer: of a unit, as a description or built, and its name; it returns SVG.
    """
    _DRAWERS[:] = [drawer]


def circuit_picture(unit: object, name: str) -> str:
    """The drawing of a unit's circuit as SVG, as wide as the place that it stands in; "" where it cannot be drawn."""
    try:
        svg = _DRAWERS[0](unit, name)
    except RamsightError:
        return ""
    opening, _, rest = svg[svg.index("<svg") :].partition(">")
    return f'{opening} style="width:100%;height:auto">{rest}'
