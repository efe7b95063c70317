"""Fig. 3: the pumps' efficiencies over pressure."""

from __future__ import annotations

from typing import Any

import numpy as np

from ramsight.plant.pump import Pump
from ramsight.units import RPM
from reproduction.bench import Bench
from reproduction.chapter import Chapter, Picture, Statement, Verdict
from reproduction.figure_style import BALANCE, ESTIMATE

_PRESSURE = np.linspace(2e5, 250e5, 125)
_SPEED = 1450.0 * RPM  # of the pump, as in the paper's Fig. 3
_PUMPS = {
    "boom A, size 8": ("boom", "a"),
    "boom B, size 22": ("boom", "b"),
    "bucket A, size 16": ("bucket", "a"),
    "bucket B, size 13": ("bucket", "b"),
}


def efficiency(pump: Pump, pressure: Any, speed: float) -> tuple[Any, Any]:
    """Volumetric and hydromechanical efficiency (eqs 5, 6) with the oil of the data sheet's nominal point.

    Args:
        pump: the pump.
        pressure: rise from inlet to outlet [Pa].
        speed: of the pump [rad/s].
    """
    viscosity, density = pump.nominal_viscosity, pump.nominal_density
    rise = np.atleast_1d(pressure)
    flow = np.array([float(pump.flow(speed, p, viscosity, density)) for p in rise])
    torque = np.array([float(pump.torque(speed, p)) for p in rise])
    return flow / (pump.displacement * speed), pump.displacement * rise / torque


def efficiencies(benches: dict[str, Bench]) -> Chapter:
    """Fig. 3, and what eqs 7 and 8 make of the nominal efficiency."""
    pumps = {label: getattr(benches[unit].unit, side).pump for label, (unit, side) in _PUMPS.items()}
    curves = {label: efficiency(pump, _PRESSURE, _SPEED) for label, pump in pumps.items()}
    numbers = {"_".join(_PUMPS[label]): _numbers(pumps[label], *curves[label]) for label in _PUMPS}
    early = min(float(np.interp(50e5, _PRESSURE, m) - m[0]) for _, m in curves.values())
    late = max(float(m[-1] - np.interp(125e5, _PRESSURE, m)) for _, m in curves.values())
    rising = all(bool((np.diff(m) > 0.0).all() and (np.diff(v) < 0.0).all()) for v, m in curves.values())
    gains = {"hydromechanical_gain_to_50_bar": early, "hydromechanical_gain_above_125_bar": late}
    return Chapter(
        "Pump efficiencies (Fig. 3)",
        (
            "Volumetric and hydromechanical efficiency of the four pump sizes follow from the paper's loss laws "
            "(eqs 7 to 10) at 1450 rpm with VG46 oil at 40 °C. The nominal efficiencies are assumed values: the "
            "paper's own numbers are lost.",
        ),
        {"pump_efficiency": {**numbers, **gains}},
        (*_shapes(numbers, early, late, rising), _counted_twice(numbers)),
        (
            Picture(
                "fig03_efficiency",
                "Efficiencies of the pumps over pressure at 1450 rpm, VG46 oil at 40 °C (the paper's Fig. 3).",
                lambda figure: _draw(figure, curves),
                (7.2, 3.8),
            ),
        ),
    )


def _numbers(pump: Pump, volumetric: Any, mechanical: Any) -> dict[str, float]:
    """What can be said of a pump's curves [1]."""
    line = np.polyval(np.polyfit(_PRESSURE, volumetric, 1), _PRESSURE)
    return {
        "volumetric_at_250_bar": float(volumetric[-1]),
        "hydromechanical_at_50_bar": float(np.interp(50e5, _PRESSURE, mechanical)),
        "hydromechanical_at_250_bar": float(mechanical[-1]),
        "volumetric_distance_from_line": float(np.abs(volumetric - line).max()),
        "hydromechanical_under_nominal_points": 100.0 * (pump.hydromechanical_efficiency - float(mechanical[-1])),
    }


def _shapes(numbers: dict[str, dict[str, float]], early: float, late: float, rising: bool) -> tuple[Statement, ...]:
    straight = max(n["volumetric_distance_from_line"] for n in numbers.values())
    return (
        Statement(
            "Fig. 3",
            "The volumetric efficiency decreases linearly with increasing pressure.",
            "A straight line for all four pumps, as eq. 9 makes it.",
            Verdict.of(straight < 1e-6 and rising),
        ),
        Statement(
            "Fig. 3",
            "The hydromechanical efficiency increases rapidly at lower pressures and settles to almost constant "
            "but slightly increasing value at higher pressures.",
            f"It gains at least {100 * early:.0f} points up to 50 bar and at most {100 * late:.1f} points from "
            "125 to 250 bar, and never falls.",
            Verdict.of(rising and early > 5 * late),
        ),
    )


def _counted_twice(numbers: dict[str, dict[str, float]]) -> Statement:
    under = [n["hydromechanical_under_nominal_points"] for n in numbers.values()]
    return Statement(
        "Eqs 7, 8",
        "Friction follows from the nominal efficiencies by eq. 8, with a no-load torque of 0.5 N m beside it.",
        "So it is taken here, as printed. At the nominal point the hydromechanical efficiency is then "
        f"{min(under):.1f} to {max(under):.1f} points under the nominal one: eq. 8 puts all friction of that point "
        f"into the term that "
        "grows with pressure, and the no-load torque comes on top.",
        Verdict.of(max(under) < 1.0),
    )


def _draw(figure: Any, curves: dict[str, tuple[Any, Any]]) -> None:
    axes = figure.add_subplot()
    for k, (label, (volumetric, mechanical)) in enumerate(curves.items()):
        style = ("-", "--", "-.", ":")[k]
        axes.plot(_PRESSURE / 1e5, 100 * volumetric, style, color=BALANCE, label=f"volumetric, {label}")
        axes.plot(_PRESSURE / 1e5, 100 * mechanical, style, color=ESTIMATE, label=f"hydromechanical, {label}")
    axes.set(xlabel="pressure [bar]", ylabel="efficiency [%]", xlim=(0, 250), ylim=(60, 100.5))
    axes.legend(fontsize=7.5, ncols=2, loc="lower center")
