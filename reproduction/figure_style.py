"""How the report's figures look: one hand for all of them."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

from ramsight.optional import needing
from ramsight.tracking.figures import ERROR, ESTIMATE, STYLE, TRUTH, UNCERTAIN, save
from reproduction.chapter import Picture

__all__ = [
    "BALANCE",
    "ESTIMATE",
    "GREY",
    "KALMAN",
    "LOADS",
    "SENSORS",
    "SPEED_TABLE",
    "TRUTH",
    "UNCERTAIN",
    "UNITS",
    "Look",
    "draw",
    "shade",
]

BALANCE, KALMAN, SPEED_TABLE, GREY = ERROR, "#2f7d4f", "#7b4fa3", "#8a94a0"


class Look(NamedTuple):
    """How a sensor is drawn: its name, colour and line style."""

    name: str
    colour: str
    style: str


SENSORS = {
    "table": Look("table", ESTIMATE, "-"),
    "balance": Look("balance", BALANCE, "--"),
    "kalman": Look("self-calibrating", KALMAN, "-."),
}
LOADS = {"light": "#f0a58c", "medium": "#dd6b47", "high": ESTIMATE}
UNITS = {"boom": ("-", "o"), "bucket": ("--", "s")}
"""Line style and marker of each unit."""
_MORE = {"axes.titlesize": 9.5, "axes.titleweight": "bold", "axes.titlelocation": "left", "lines.markersize": 4.5}


def draw(picture: Picture, folder: Path) -> None:
    """Draw a picture into a folder, as PNG and as SVG."""
    with needing("figures"):
        import matplotlib as mpl
        from matplotlib.figure import Figure

    with mpl.rc_context(STYLE | _MORE):  # type: ignore[arg-type]
        figure = Figure(figsize=picture.size, layout="constrained")
        picture.draw(figure)
        for suffix in (".png", ".svg"):
            save(figure, folder / f"{picture.name}{suffix}")


def shade(axes: Any, spans: Iterable[tuple[float, float]], label: str, colour: str = UNCERTAIN) -> None:
    """Mark spans of the horizontal axis."""
    for k, (first, last) in enumerate(spans):
        axes.axvspan(first, last, color=colour, alpha=0.22, lw=0, label=label if k == 0 else None)
