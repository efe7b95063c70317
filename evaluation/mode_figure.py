"""The figure of contacts.md: modes of the sensor and what leads from one to another, from the sensor's own table."""

import sys
from pathlib import Path

from ramsight.output import atomic_path
from ramsight.sensor.contacts.mode import FREE, HELD, TRANSITIONS, Mode

INK, EDGE, FILL = "#1f2a36", "#9aa5b1", "#f4f1ea"
AT = {Mode.HELD_EXTENDING: (7.4, 3.9), Mode.HELD_RETRACTING: (7.4, 0.9), Mode.LEAVING: (7.4, 2.4)}
LEFT, RIGHT, TOP = 0.2, 2.9, 4.5


def conditions(before: Mode, after: Mode) -> str:
    """What leads from one mode to another, a line each."""
    return "\n".join(row.when for row in TRANSITIONS if before in row.before and row.after is after)


def main(file: Path) -> None:
    """Draw it."""
    import matplotlib as mpl
    from matplotlib.figure import Figure
    from matplotlib.patches import FancyBboxPatch

    with mpl.rc_context({"font.size": 9, "svg.hashsalt": "ramsight"}):
        figure = Figure(figsize=(8.6, 4.6), layout="constrained")
        axes = figure.subplots()
        axes.set(xlim=(0.0, 9.2), ylim=(0.0, 4.9))
        axes.axis("off")

        def box(x: float, y: float, width: float, height: float, fill: str) -> None:
            style = "round,pad=0.02,rounding_size=0.12"
            axes.add_patch(FancyBboxPatch((x, y), width, height, boxstyle=style, ec=INK, fc=fill, lw=1.0))

        def arrow(
            start: tuple[float, float], end: tuple[float, float], words: str, at: tuple[float, float], head: str = "-|>"
        ) -> None:
            axes.annotate("", end, start, arrowprops={"arrowstyle": head, "color": INK, "lw": 1.1})
            axes.text(*at, words, ha="center", va="center", color=INK, fontsize=8, style="italic")

        box(LEFT, 0.35, RIGHT - LEFT, TOP - 0.35, FILL)
        axes.text(LEFT + 0.12, TOP - 0.2, "free: the first that fits", va="center", color=INK, weight="bold")
        rows = [row for row in TRANSITIONS if row.after in FREE]
        for k, row in enumerate(rows):
            y = TOP - 0.62 - 0.78 * k
            axes.text(LEFT + 0.12, y, row.after.name, va="center", color=INK)
            axes.text(LEFT + 0.24, y - 0.26, row.when, va="center", color=INK, fontsize=8, style="italic")
        for mode, (x, y) in AT.items():
            box(x - 0.85, y - 0.3, 1.7, 0.6, "white")
            axes.text(x, y, mode.name, ha="center", va="center", color=INK)
        free = FREE[0]
        for mode in HELD:
            (x, y), up = AT[mode], 1.0 if mode is Mode.HELD_EXTENDING else -1.0
            arrow((RIGHT, y), (x - 0.87, y), conditions(free, mode), (4.7, y + 0.17))
            leaving = AT[Mode.LEAVING]
            arrow((x, y - up * 0.32), (leaving[0], leaving[1] + up * 0.32), "", (x, y), "<|-|>")
            middle = 0.5 * (y + leaving[1])
            axes.text(x + 0.12, middle, conditions(mode, Mode.LEAVING), va="center", fontsize=8, style="italic")
            axes.text(x - 0.12, middle, conditions(Mode.LEAVING, mode), va="center", ha="right", fontsize=8,
                      style="italic", color=EDGE)  # fmt: skip
        (x, y) = AT[Mode.LEAVING]
        arrow((RIGHT, y + 0.12), (x - 0.87, y + 0.12), conditions(free, Mode.LEAVING), (4.7, y + 0.29))
        arrow((x - 0.87, y - 0.12), (RIGHT, y - 0.12), "otherwise: is away", (4.7, y - 0.29))
        with atomic_path(file) as draft:
            figure.savefig(draft, format="svg", metadata={"Date": None})


if __name__ == "__main__":
    main(Path(sys.argv[1]))
