"""A calibrated table as a picture: movement per motor revolution over torque."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from ramsight.optional import needing
from ramsight.sensor.table import MovementTable
from ramsight.tracking.figures import STYLE, save
from ramsight.units import FREEZING

MM_PER_REVOLUTION = 2e3 * math.pi
"""Of one metre per radian [mm/rev]."""


def warmth(share: float) -> Any:
    """Colour of an oil temperature, 0 the coldest and 1 the hottest."""
    with needing("figures"):
        import matplotlib as mpl

    return mpl.colormaps["plasma"](0.08 + 0.78 * share)


def movement_figure(movement: MovementTable, title: str, path: str | Path) -> None:
    """Draw a table and write the picture.

    Args:
        movement: the table, as `ramsight.calibration.cached.calibrated` makes it.
        title: above the picture.
        path: .png, .svg or .pdf.

    Raises:
        OutputError: it cannot be written.
    """
    with needing("figures"):
        import matplotlib as mpl
        from matplotlib.figure import Figure

    with mpl.rc_context(STYLE):  # type: ignore[arg-type]
        figure = Figure(figsize=(7.2, 4.2), layout="constrained")
        draw_movement(figure, movement)
        figure.axes[0].set_title(title, loc="left", fontweight="bold")
        save(figure, path)


def draw_movement(figure: Any, movement: MovementTable) -> None:
    """Draw a table into a figure: a curve for each oil temperature and direction.

    Args:
        figure: a `matplotlib.figure.Figure`.
        movement: the table; where no load of it opened the relief valve, none is marked.
    """
    axes = figure.add_subplot()
    rows = list(zip(movement.temperature, movement.lift, movement.lower, strict=True))
    for k, (temperature, lift, lower) in enumerate(rows):
        colour = warmth(k / (len(rows) - 1))
        label = f"{temperature - FREEZING:.0f} °C"
        axes.plot(movement.lift_torque, MM_PER_REVOLUTION * lift, color=colour, label=label)
        axes.plot(movement.lower_torque, MM_PER_REVOLUTION * lower, "--", color=colour)
    axes.plot([], [], color="0.3", label="lifting")
    axes.plot([], [], "--", color="0.3", label="lowering")
    if math.isfinite(movement.relief_torque):
        _mark_relief(axes, movement)
    axes.set(xlabel="motor torque [N m]", ylabel="movement [mm/rev]")
    axes.set_ylim(bottom=0.0)
    axes.legend(ncols=2, loc="center left" if movement.lift_sign > 0 else "center right", fontsize=8)


def _mark_relief(axes: Any, movement: MovementTable) -> None:
    axes.axvline(movement.lift_sign * movement.relief_torque, color="0.3", lw=0.8, ls=":")
    axes.annotate(
        "relief valve opens",
        (movement.lift_sign * movement.relief_torque, 0.03),
        xycoords=("data", "axes fraction"),
        xytext=(-6 * movement.lift_sign, 0),
        textcoords="offset points",
        ha="right" if movement.lift_sign > 0 else "left",
        fontsize=8,
    )
