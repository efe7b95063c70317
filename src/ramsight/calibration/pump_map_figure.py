"""Tables as pictures: a calibrated movement table, and a pump's map."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from ramsight.errors import DescriptionError
from ramsight.optional import needing
from ramsight.plant.loss_table import LossTable
from ramsight.plant.pump import Pump
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.table import MovementTable
from ramsight.tracking.figures import STYLE, save
from ramsight.units import FREEZING, RPM

_FINE = 60  # points of a line
_COLOURS = ("#2a6f97", "#c8401e", "#e9b44c", "#1f2a36", "#8a94a0", "#5a8f5a")


def pump_map_figure(unit: HydraulicUnit, path: str | Path) -> None:
    """Draw the tables of a unit's pumps and write the picture: points as measured, lines as the laws interpolate.

    Raises:
        DescriptionError: no pump of the unit has a table.
        OutputError: the picture cannot be written.
    """
    with needing("figures"):
        import matplotlib as mpl
        from matplotlib.figure import Figure

    pumps = [part for part in unit.parts() if isinstance(part, Pump) and part.table is not None]
    if not pumps:
        allowed = 'losses = "table", or efficiency_file'
        raise DescriptionError("has no pump with measured efficiencies to draw", key=unit.name, allowed=allowed)
    with mpl.rc_context(STYLE):  # type: ignore[arg-type]
        figure = Figure(figsize=(7.2, 2.9 * len(pumps)), layout="constrained")
        for pump, pair in zip(pumps, figure.subplots(len(pumps), 2, squeeze=False), strict=True):
            assert pump.table is not None
            _draw(pair, pump.table, f"{unit.name}, {pump.name}")
        save(figure, path)


def _draw(pair: Any, table: LossTable, title: str) -> None:
    """Both efficiencies over the pressure, a colour a speed, the thinnest and the thickest oil."""
    pressure = np.linspace(0.02, 1.1, _FINE) * table.pressure[-1]
    for axes, grid, name in zip(
        pair, (table.volumetric, table.hydromechanical), ("volumetric", "hydro-mechanical"), strict=True
    ):
        for k in sorted({0, len(table.viscosity) - 1}):
            for j, speed in enumerate(table.speed):
                colour, line = _COLOURS[j % len(_COLOURS)], "-" if k == 0 else "--"
                label = f"{speed / RPM:.0f} rpm" if k == 0 else None
                axes.plot(1e-5 * np.array(table.pressure), grid[k][j], "o", ms=3, color=colour)
                lines = [_efficiency(table, name, speed, float(rise), table.viscosity[k]) for rise in pressure]
                axes.plot(1e-5 * pressure, lines, line, lw=1.2, color=colour, label=label)
        axes.set(xlabel="pressure rise [bar]", ylabel=f"{name} efficiency")
        axes.set_ylim(max(0.0, min(min(row) for page in grid for row in page) - 0.1), 1.01)
    thin, thick = (1e6 * table.viscosity[k] for k in (0, -1))
    pair[0].set_title(f"{title}: solid at {thin:.3g} mm²/s, dashed at {thick:.3g} mm²/s", loc="left", fontweight="bold")
    pair[0].legend(loc="lower left", fontsize=7)


def _efficiency(table: LossTable, name: str, speed: float, rise: float, viscosity: float) -> float:
    """An efficiency of pump operation as the laws have it [1], of a displacement of 1."""
    if name == "volumetric":
        return 1.0 - float(table.leakage(1.0, speed, rise, viscosity)) / speed
    return rise / (rise + float(table.friction(1.0, speed, rise, viscosity, threshold=0.01 * speed)))


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
