"""The paper's diagrams, redrawn from its description: relations of the parts, process, control (Figs 4, 7, 8)."""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

from reproduction.bench import Bench
from reproduction.chapter import Chapter, Picture
from reproduction.figure_style import BALANCE, TRUTH, UNCERTAIN


class Arrow(NamedTuple):
    """From one box to another, with what goes along it."""

    begin: str
    end: str
    text: str
    bend: float = 0.0


class Diagram(NamedTuple):
    """Boxes by what stands in them, each with its place (shares of the drawing), and arrows between them."""

    boxes: dict[str, tuple[float, float]]
    arrows: tuple[Arrow, ...]
    given: tuple[str, ...] = ()
    """Boxes that are inputs or results, drawn otherwise."""


RELATIONS = Diagram(
    {
        "motor speed": (0.1, 0.82),
        "motor torque": (0.1, 0.42),
        "pumps\neqs 3 to 10": (0.36, 0.62),
        "oil\nviscosity, density": (0.36, 0.14),
        "valves, lines": (0.6, 0.62),
        "cylinder\neqs 1, 2": (0.82, 0.62),
        "oil\ntemperature": (0.1, 0.14),
        "load": (0.82, 0.2),
        "position": (0.82, 0.92),
    },
    (
        Arrow("motor speed", "pumps\neqs 3 to 10", "displacement"),
        Arrow("pumps\neqs 3 to 10", "valves, lines", "flow", 0.25),
        Arrow("valves, lines", "cylinder\neqs 1, 2", "flow", 0.25),
        Arrow("cylinder\neqs 1, 2", "position", "velocity, summed up"),
        Arrow("load", "cylinder\neqs 1, 2", "force"),
        Arrow("cylinder\neqs 1, 2", "valves, lines", "pressure", 0.25),
        Arrow("valves, lines", "pumps\neqs 3 to 10", "pressure", 0.25),
        Arrow("pumps\neqs 3 to 10", "motor torque", "pressure, friction"),
        Arrow("oil\ntemperature", "oil\nviscosity, density", ""),
        Arrow("oil\nviscosity, density", "pumps\neqs 3 to 10", "leakage"),
    ),
    ("motor speed", "motor torque", "oil\ntemperature", "load", "position"),
)
"""The paper's Fig. 4."""
PROCESS = Diagram(
    {
        "motor speed": (0.09, 0.85),
        "motor torque": (0.09, 0.5),
        "oil temperature": (0.09, 0.15),
        "direction:\nlift or lower": (0.34, 0.85),
        "table of lifting": (0.42, 0.5),
        "table of lowering": (0.42, 0.15),
        "times speed:\nvelocity": (0.68, 0.6),
        "summed up over\nthe time step": (0.86, 0.3),
        "position": (0.86, 0.85),
    },
    (
        Arrow("motor speed", "direction:\nlift or lower", "sign"),
        Arrow("direction:\nlift or lower", "table of lifting", "chooses"),
        Arrow("direction:\nlift or lower", "table of lowering", "", 0.55),
        Arrow("motor torque", "table of lifting", ""),
        Arrow("motor torque", "table of lowering", ""),
        Arrow("oil temperature", "table of lifting", ""),
        Arrow("oil temperature", "table of lowering", ""),
        Arrow("table of lifting", "times speed:\nvelocity", "movement per\nrevolution"),
        Arrow("table of lowering", "times speed:\nvelocity", ""),
        Arrow("direction:\nlift or lower", "times speed:\nvelocity", "speed"),
        Arrow("times speed:\nvelocity", "summed up over\nthe time step", ""),
        Arrow("summed up over\nthe time step", "position", "from the start's"),
    ),
    ("motor speed", "motor torque", "oil temperature", "position"),
)
"""The paper's Fig. 7."""
CONTROL = Diagram(
    {
        "user:\nhuman or machine": (0.13, 0.7),
        "motor controller": (0.42, 0.7),
        "motor, pumps,\nvalves": (0.66, 0.7),
        "cylinder, load": (0.89, 0.7),
        "position\ncalculation": (0.42, 0.2),
        "oil temperature": (0.73, 0.2),
    },
    (
        Arrow("user:\nhuman or machine", "motor controller", "command"),
        Arrow("motor controller", "motor, pumps,\nvalves", "current"),
        Arrow("motor, pumps,\nvalves", "cylinder, load", "oil"),
        Arrow("motor controller", "position\ncalculation", "torque, speed"),
        Arrow("oil temperature", "position\ncalculation", ""),
        Arrow("position\ncalculation", "user:\nhuman or machine", "position"),
    ),
    ("user:\nhuman or machine", "oil temperature"),
)
"""The paper's Fig. 8."""


def diagrams(benches: dict[str, Bench]) -> Chapter:
    """Figs 4, 7 and 8."""
    del benches  # they are the same for every machine
    return Chapter(
        "How the position is calculated (Figs 4, 7 and 8)",
        (
            "Redrawn from the paper's description. Speed decides what the pumps deliver, load and friction what "
            "pressure they deliver it against, and both with the oil's viscosity what leaks; the table holds the "
            "result. "
            "Whoever uses the position sees a sensor like any other.",
        ),
        {},
        pictures=(
            Picture(
                "fig04_relations",
                "How the parts act on each other (the paper's Fig. 4).",
                partial(draw_diagram, diagram=RELATIONS),
                (7.2, 3.6),
            ),
            Picture(
                "fig07_process",
                "From what the drive reports to the position (the paper's Fig. 7).",
                partial(draw_diagram, diagram=PROCESS),
                (7.2, 3.4),
            ),
            Picture(
                "fig08_control",
                "Sensorless control of a cylinder (the paper's Fig. 8).",
                partial(draw_diagram, diagram=CONTROL),
                (7.2, 2.4),
            ),
        ),
    )


def draw_diagram(figure: Any, diagram: Diagram) -> None:
    """Draw boxes and arrows over the whole of a figure.

    Args:
        figure: matplotlib's.
        diagram: what to draw.
    """
    axes = figure.add_subplot()
    axes.set(xlim=(0, 1), ylim=(0, 1))
    axes.set_axis_off()
    drawn = {}
    for name, (x, y) in diagram.boxes.items():
        edge, face = (UNCERTAIN, "#fdf6e3") if name in diagram.given else (BALANCE, "#e9f1f6")
        box = {"boxstyle": "round,pad=0.5", "facecolor": face, "edgecolor": edge}
        drawn[name] = axes.text(x, y, name, ha="center", va="center", fontsize=8, bbox=box, zorder=3)
    for arrow in diagram.arrows:
        begin, end = diagram.boxes[arrow.begin], diagram.boxes[arrow.end]
        look = {
            "arrowstyle": "-|>",
            "color": TRUTH,
            "lw": 0.9,
            "patchA": drawn[arrow.begin].get_bbox_patch(),
            "patchB": drawn[arrow.end].get_bbox_patch(),
            "connectionstyle": f"arc3,rad={arrow.bend}",
        }
        axes.annotate("", xy=end, xytext=begin, arrowprops=look, zorder=2)
        if arrow.text:
            dx, dy = end[0] - begin[0], end[1] - begin[1]
            x, y = 0.5 * (begin[0] + end[0]) + 0.5 * arrow.bend * dy, 0.5 * (begin[1] + end[1]) - 0.5 * arrow.bend * dx
            paper = {"facecolor": "white", "edgecolor": "none", "pad": 0.8}
            axes.text(x, y, arrow.text, ha="center", va="center", fontsize=7, color="#5b6875", bbox=paper, zorder=4)
