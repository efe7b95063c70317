"""Energy: what a unit makes of lifting and lowering over load and speed, and where a cycle's energy goes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ramsight import Duty, simulate
from ramsight.duty.lift_lower import SPEED
from ramsight.duty.profile import constant, trapezoid_moves
from ramsight.optional import needing
from ramsight.plant.steady import derive, torque_at_load
from ramsight.units import RPM
from reproduction import baseline
from reproduction.bench import TEMPERATURE, Bench
from reproduction.chapter import Chapter, Grid, Picture
from reproduction.words import both, figure

Array = NDArray[np.float64]

_SHARES = np.linspace(0.05, 0.97, 24)  # of the load at relief
_SPEEDS = np.linspace(200.0, 3000.0, 24)  # rpm
_BATTERY = 96.0 * 60.0 * 3600.0  # J, 96 V [P] of modules of 24 V and 60 Ah (the paper's reference 15)
_THIN = 0.012  # share of an energy; thinner arrows are not drawn
_LOW, _HIGH = 0.2, 0.6  # shares of the stroke between which a closed cycle goes
_LOSSES = {
    "leakage of the pumps": ("pump_a.leakage", "pump_b.leakage"),
    "friction of the pumps": ("pump_a.friction", "pump_b.friction"),
    "valves and hoses": tuple(
        f"{name}_{side}.throttling" for name in ("relief", "anticavitation", "safety", "hose") for side in "ab"
    ),
    "friction of the cylinders": ("cylinder.friction", "cylinder.stop"),
}
_WAYS = ("lifting", "lowering")

Flow = dict[str, float]
"""Energies of one move [kJ], by name."""


def energy(benches: dict[str, Bench]) -> Chapter:
    """Maps, the energy flow of a cycle, and what comes back to the battery."""
    maps = {unit: efficiency_maps(bench) for unit, bench in benches.items()}
    flows = {unit: {way: _flow(bench, way) for way in _WAYS} for unit, bench in benches.items()}
    battery = {
        unit: {load: _battery(bench, value) for load, value in bench.loads.items()} for unit, bench in benches.items()
    }
    driven = baseline.baseline(benches, _LOW, _HIGH)
    back = {unit: by["high"]["back_percent"] for unit, by in battery.items()}
    return Chapter(
        "Energy",
        (
            "Energy is what direct drive is built for; the paper leaves storage and power electronics for later. The "
            "maps are of the hydraulics alone, from the motor's shaft to the load: lifting, the load's work over the "
            "shaft's; lowering, the shaft's over the load's. Leakage per second makes slow lifting inefficient; "
            "friction "
            "makes light loads so. White is where a load does not lift, or lowers only with the motor's help.",
            "Of a cycle at high load that ends where it began, with motor and inverter of "
            f"{100 * _supply(benches)[0]:.0f} % and a battery of {100 * _supply(benches)[1]:.0f} % each way (guesses "
            f"of "
            f"the description), {both(back, 0, '%')} of what the battery gives comes back to it. Of 96 V and 60 Ah a "
            "cycle takes "
            + both({unit: by["high"]["net_percent_of_battery"] for unit, by in battery.items()}, 2, "%")
            + ".",
            *baseline.text(driven),
        ),
        {
            "valve_controlled_kJ": driven,
            "energy_flow_kJ": flows,
            "battery_by_load": battery,
            "best_efficiency_percent": {
                unit: {way: 100.0 * float(np.nanmax(of[way])) for way in _WAYS} for unit, of in maps.items()
            },
        },
        (baseline.saves(driven),),
        (
            Picture(
                "fig26_efficiency_maps",
                "Efficiency of the hydraulics over load and motor speed at 40 °C, steady: lifting and lowering [%].",
                lambda figure: _draw_maps(figure, maps, benches),
                (7.2, 5.6),
            ),
            Picture(
                "fig27_energy_flow",
                "Where the energy of lifting and of lowering the high load goes, at 1500 rpm and 40 °C [kJ].",
                lambda figure: _draw_flows(figure, flows),
                (7.2, 7.0),
            ),
            *baseline.pictures(driven),
        ),
        (_grid(battery), *baseline.grids(driven)),
    )


def efficiency_maps(bench: Bench) -> dict[str, Array]:
    """Efficiencies [1] of lifting and lowering, shape (loads, speeds), NaN where there is none.

    Args:
        bench: the unit.
    """
    unit, largest = bench.unit, derive(bench.unit).load_at_relief
    found = {way: np.full((len(_SHARES), len(_SPEEDS)), np.nan) for way in _WAYS}
    for i, share in enumerate(_SHARES):
        for k, rpm in enumerate(_SPEEDS):
            load, speed = share * largest, rpm * RPM
            point = torque_at_load(unit, load, TEMPERATURE, speed)
            lift, lower = unit.lift_sign * point.torque_lift, unit.lift_sign * point.torque_lower
            leaks = 0.5 * (point.travel_lower - point.travel_lift)
            if leaks < 0.5 * (point.travel_lower + point.travel_lift):  # else the pumps only make up for leakage
                found["lifting"][i, k] = load * point.travel_lift / lift
            if lower > 0.0:
                found["lowering"][i, k] = lower / (load * point.travel_lower)
    return found


def _supply(benches: dict[str, Bench]) -> tuple[float, float]:
    supply = next(iter(benches.values())).unit.drive.supply
    return (supply.drive_efficiency, supply.battery_efficiency) if supply else (1.0, 1.0)


def _flow(bench: Bench, way: str) -> Flow:
    """Energies of one move of the high load [kJ]; `shaft` and `load` are what they give in this move."""
    sign = bench.unit.lift_sign * (1.0 if way == "lifting" else -1.0)
    hold = 0.3 * bench.unit.cylinder.stroke / (SPEED * bench.unit.travel_per_radian)
    speed = trapezoid_moves([(sign * SPEED, hold)], ramp=bench.ramp, before=1.0, rest=1.5)
    start = bench.at(0.3 if way == "lifting" else 0.7)
    attrs = simulate(bench.unit, Duty(speed, constant(bench.loads["high"]), constant(TEMPERATURE), start)).attrs
    taken = {name: sum(attrs.get(f"energy.{key}", 0.0) for key in keys) / 1e3 for name, keys in _LOSSES.items()}
    given = {"shaft": attrs["energy.shaft"] / 1e3, "load": -attrs["energy.load"] / 1e3}
    rest = sum(given.values()) - sum(taken.values())
    return {**given, **taken, "oil, tank and air": rest}


def _battery(bench: Bench, load: float) -> dict[str, float]:
    """What the battery gives and gets back in a cycle that ends where it began."""
    attrs = simulate(bench.unit, bench.closed_cycle(load, _LOW, _HIGH)).attrs
    given, back = (
        attrs.get(f"electrical_energy_{name}", attrs[f"energy.shaft_{other}"])
        for name, other in (("given", "given"), ("recovered", "taken"))
    )
    return {
        "shaft_given_kJ": attrs["energy.shaft_given"] / 1e3,
        "shaft_taken_kJ": attrs["energy.shaft_taken"] / 1e3,
        "given_kJ": given / 1e3,
        "back_kJ": back / 1e3,
        "back_percent": 100.0 * back / given,
        "net_percent_of_battery": 100.0 * (given - back) / _BATTERY,
    }


def _grid(battery: dict[str, dict[str, dict[str, float]]]) -> Grid:
    keys = ("shaft_given_kJ", "shaft_taken_kJ", "given_kJ", "back_kJ", "back_percent")
    rows = tuple(
        (f"{unit}, {load} load", *(figure(by[key]) for key in keys), figure(by["net_percent_of_battery"], 3))
        for unit, loads in battery.items()
        for load, by in loads.items()
    )
    head = ("cycle", "shaft gives", "shaft takes", "battery gives", "gets back", "back [%]", "net [% of battery]")
    return Grid("Energy of one cycle that ends where it began, at 40 °C [kJ]", head, rows)


def _draw_maps(figure: Any, maps: dict[str, dict[str, Array]], benches: dict[str, Bench]) -> None:
    grid = figure.subplots(2, 2, sharex=True, sharey="row")
    levels = np.linspace(0.0, 100.0, 21)
    for row, (unit, of) in zip(grid, maps.items(), strict=True):
        largest = derive(benches[unit].unit).load_at_relief / 1e3
        for axes, way in zip(row, _WAYS, strict=True):
            share = 100.0 * np.clip(of[way], 0.0, 1.0)
            drawn = axes.contourf(_SPEEDS, _SHARES * largest, share, levels, cmap="viridis")
            lines = axes.contour(
                _SPEEDS, _SHARES * largest, share, (20, 40, 60, 70, 80), colors="white", linewidths=0.7
            )
            axes.clabel(lines, fmt="%d", fontsize=7)
            axes.set_title(f"{unit}, {way}")
        row[0].set_ylabel("load [kN]")
    for axes in grid[-1]:
        axes.set_xlabel("motor speed [rpm]")
    figure.colorbar(drawn, ax=grid, label="efficiency [%]")


def _draw_flows(figure: Any, flows: dict[str, dict[str, Flow]]) -> None:
    panels = figure.subplots(2, 2)
    for row, (unit, by) in zip(panels, flows.items(), strict=True):
        for axes, (way, flow) in zip(row, by.items(), strict=True):
            _draw_flow(axes, flow, *(("shaft", "load") if way == "lifting" else ("load", "shaft")))
            axes.set_title(f"{unit}, {way}")


def _draw_flow(axes: Any, flow: Flow, source: str, sink: str) -> None:
    """Draw where what the source gives goes; what is too thin to be drawn is the rest."""
    with needing("figures"):
        from matplotlib.sankey import Sankey

    total = flow[source]
    taken = {name: value for name, value in flow.items() if name in _LOSSES and value > _THIN * total}
    rest = total + flow[sink] - sum(taken.values())
    arrows = {source: total, sink: flow[sink], **{name: -value for name, value in taken.items()}}
    if rest > _THIN * total:
        arrows["rest"] = -rest
    sankey = Sankey(ax=axes, scale=1.0 / total, format="%.1f", unit=" kJ", gap=0.5, shoulder=0.03, offset=0.2)
    sankey.add(
        flows=list(arrows.values()),
        labels=[name.replace(" of the ", "\nof the ").replace(" and ", "\nand ") for name in arrows],
        orientations=[0, 0, 1, -1, 1, -1, 1][: len(arrows)],
        pathlengths=[0.35 + 0.3 * (k // 2) for k in range(len(arrows))],
        facecolor="#9db8c9",
        edgecolor="#2a6f97",
        lw=0.8,
    )
    for diagram in sankey.finish():
        for text in [*diagram.texts, diagram.text]:
            text.set_fontsize(7)
    axes.set_aspect("equal", adjustable="box")
    axes.set_axis_off()
