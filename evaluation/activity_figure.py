"""The figure of control-concept.md: activities of a control and what leads from one to another, from its own table."""

import sys
from pathlib import Path

from ramsight.control.activity import ANY, GOING, TRANSITIONS, Activity
from ramsight.output import atomic_path

INK, EDGE, FILL = "#1f2a36", "#9aa5b1", "#f4f1ea"
AT = {
    Activity.MOVING: (1.3, 3.1),
    Activity.LANDING: (4.3, 3.1),
    Activity.RESTING: (7.3, 3.1),
    Activity.HOMING: (1.3, 1.7),
    Activity.LEAK_TEST: (4.3, 1.7),
    Activity.MANUAL: (7.3, 0.5),
    Activity.STOPPING: (1.3, 0.5),
    Activity.STOPPED: (4.3, 0.5),
}
WIDE, HIGH = 0.85, 0.28


def words(before: Activity, after: Activity) -> str:
    """What leads from one activity to another by itself."""
    rows = (row for row in TRANSITIONS if row.before not in (ANY, GOING))
    return "\n".join(row.when.value for row in rows if before in row.before and row.after is after)


def main(file: Path) -> None:
    """Draw it."""
    import matplotlib as mpl
    from matplotlib.figure import Figure
    from matplotlib.patches import FancyBboxPatch

    with mpl.rc_context({"font.size": 9, "svg.hashsalt": "ramsight"}):
        figure = Figure(figsize=(8.6, 3.8), layout="constrained")
        axes = figure.subplots()
        axes.set(xlim=(0.0, 8.6), ylim=(0.0, 3.9))
        axes.axis("off")
        style = "round,pad=0.02,rounding_size=0.12"
        for activity, (x, y) in AT.items():
            corner = (x - WIDE, y - HIGH)
            axes.add_patch(FancyBboxPatch(corner, 2 * WIDE, 2 * HIGH, boxstyle=style, ec=INK, fc=FILL, lw=1.0))
            axes.text(x, y, activity.name, ha="center", va="center", color=INK)
            sent = [row.when.value for row in TRANSITIONS if row.before == ANY and row.after is activity]
            axes.text(x, y - 0.42, "\n".join(f"from any: {when}" for when in sent), ha="center", va="center",
                      color=EDGE, fontsize=8, style="italic")  # fmt: skip
        for before, (x, y) in AT.items():
            for after, (x_after, y_after) in AT.items():
                said = words(before, after)
                if not said:
                    continue
                back = x_after < x
                level = y == y_after
                start = (x + (-WIDE if back else WIDE), y + (0.12 if back else 0.0 if level else 0.08))
                end = (x_after + (WIDE if back else -WIDE), y_after + (0.12 if back else 0.0 if level else -0.12))
                axes.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": INK, "lw": 1.1})
                along = 0.5 if level else 0.35
                x_said, y_said = start[0] + along * (end[0] - start[0]), start[1] + along * (end[1] - start[1])
                if level:
                    y_said += -0.15 if not back and words(after, before) else 0.15
                else:
                    x_said, y_said = x_said + 0.1, y_said - 0.1
                axes.text(x_said, y_said, said, ha="center" if level else "left", va="center", color=INK, fontsize=8,
                          style="italic")  # fmt: skip
        ends = ", ".join(row.when.value for row in TRANSITIONS if row.before == GOING)
        stop = AT[Activity.STOPPING]
        axes.text(stop[0], stop[1] - 0.42, f"from all above: {ends}", ha="center", va="center", color=EDGE, fontsize=8,
                  style="italic")  # fmt: skip
        with atomic_path(file) as draft:
            figure.savefig(draft, format="svg", metadata={"Date": None})


if __name__ == "__main__":
    main(Path(sys.argv[1]))
