"""What direct drive is worth against the same boom behind a valve: sentences, table and figure of both."""

from __future__ import annotations

from typing import Any

from reproduction.bench import Bench
from reproduction.chapter import Grid, Picture, Statement, Verdict
from reproduction.valve_controlled import MACHINE, PLACES, UNIT, Account, compared
from reproduction.words import figure, slashed

_COLOURS = ("#b9c4cf", "#2a6f97", "#c8553d", "#e0b15a", "#7d8b99")
_DIRECT, _VALVE = "direct drive", "valve-controlled"

Compared = dict[str, dict[str, Account]]
"""Accounts by load and by how the cylinder is driven."""


def baseline(benches: dict[str, Bench], low: float, high: float) -> Compared:
    """Both ways of driving the boom through the same cycle, at its three loads; nothing where it retracts to lift.

    Args:
        benches: the units.
        low: share of the stroke at which the cycle begins and ends.
        high: share at which it turns.
    """
    bench = benches[UNIT]
    return compared(bench, low, high) if bench.unit.lift_sign > 0.0 else {}


def text(found: Compared) -> tuple[str, ...]:
    """Sentences that say what the baseline is."""
    if not found:
        return ()
    return (
        "The baseline is simulated. It is the same boom as loaders usually drive it. Cylinders, hoses, oil and load "
        "are as they are, behind a proportional directional valve. It is fed by a load-sensing pump of 45 cm³/rev that "
        "an electric motor of the same efficiency turns at 1500 rpm all the time. The pump holds 20 bar above what the "
        f"valve's port asks for (the machine {MACHINE} of the catalogue, each value with its source; the paper "
        "describes no such machine). It "
        "goes the same way with the same velocities, ramps and rests: the valve's openings are searched for.",
    )


def saves(found: Compared) -> Statement:
    """What the paper states of direct drive, decided by the baseline."""
    words = "No baseline: this boom lifts by retracting, and the valve-controlled one extends."
    if found:
        nets = {way: [by[way]["net"] for by in found.values()] for way in (_DIRECT, _VALVE)}
        less = [100.0 * (1.0 - direct / valve) for direct, valve in zip(nets[_DIRECT], nets[_VALVE], strict=True)]
        at_rest = [by[_VALVE]["shaft_at_rest"] for by in found.values()]
        pumps = {way: [by[way]["pumps"] for by in found.values()] for way in (_DIRECT, _VALVE)}
        edges = [by[_VALVE]["directional valve"] for by in found.values()]
        back = [100.0 * by[_DIRECT]["gets_back"] / by[_DIRECT]["battery_gives"] for by in found.values()]
        drawn = [by[_DIRECT]["battery_gives"] / by[_VALVE]["battery_gives"] for by in found.values()]
        words = (
            f"At light / medium / high load a cycle of the boom takes {slashed(nets[_DIRECT], 0)} kJ of the battery, "
            f"behind the valve {slashed(nets[_VALVE], 0)} kJ. Direct drive takes {slashed(less, 0)} % less. Behind the "
            f"valve {slashed(edges, 0)} kJ go over its edges and {slashed(at_rest)} kJ into a pump that idles for 4 s. "
            f"Direct drive gives {slashed(back, 0)} % back; without that it would still take "
            f"{slashed([100.0 * (1.0 - share) for share in drawn], 0)} % less. Its pumps lose "
            f"{slashed(pumps[_DIRECT], 0)} kJ, the baseline's one {slashed(pumps[_VALVE], 0)} kJ."
        )
    cheaper = all(by[_DIRECT]["net"] < by[_VALVE]["net"] for by in found.values())
    return Statement(
        "Abstract, introduction",
        "Direct drive saves energy against valve-controlled hydraulics: no idling, no losses in directional valves.",
        words,
        Verdict.of(cheaper) if found else Verdict.NOT_TESTABLE,
    )


def grids(found: Compared) -> tuple[Grid, ...]:
    """Energy of a cycle by load and way of driving, and where it goes."""
    if not found:
        return ()
    keys = ("lifted", "battery_gives", "gets_back", "net")
    rows = tuple(
        (
            f"{load} load, {way}",
            *(figure(by[key]) for key in keys),
            figure(100.0 * by["lifted"] / by["battery_gives"], 0),
            *(figure(by[place]) for place in PLACES),
        )
        for load, ways in found.items()
        for way, by in ways.items()
    )
    head = ("boom", "lifts the load by", "battery gives", "gets back", "net", "lifted of given [%]", *PLACES)
    return (
        Grid(
            "One cycle of the boom, direct-driven and valve-controlled, and where the net energy goes [kJ]", head, rows
        ),
    )


def pictures(found: Compared) -> tuple[Picture, ...]:
    """Where the net energy of a cycle goes, both ways."""
    if not found:
        return ()
    caption = (
        "Where the battery's net energy of one cycle of the boom goes, direct-driven and behind a valve, at 40 °C [kJ]."
    )
    return (Picture("fig28_valve_controlled", caption, lambda figure: _draw(figure, found), (7.2, 3.6)),)


def _draw(figure: Any, found: Compared) -> None:
    axes = figure.add_subplot()
    bars = [(load, way, by) for load, ways in found.items() for way, by in ways.items()]
    spots = [2.6 * (k // 2) + 1.05 * (k % 2) for k in range(len(bars))]
    floor = [0.0] * len(bars)
    for place, colour in zip(PLACES, _COLOURS, strict=True):
        heights = [by[place] for _, _, by in bars]
        axes.bar(spots, heights, 0.95, floor, color=colour, label=place)
        floor = [low + height for low, height in zip(floor, heights, strict=True)]
    for spot, top, (_, _, by) in zip(spots, floor, bars, strict=True):
        axes.text(spot, top + 3.0, f"{by['net']:.0f}", ha="center", fontsize=8)
    axes.set_xticks(
        spots, [f"{load}\n{way.replace(' ', chr(10)).replace('-', '-' + chr(10))}" for load, way, _ in bars]
    )
    axes.tick_params(axis="x", labelsize=7)
    axes.set_ylabel("energy of a cycle [kJ]")
    axes.legend(fontsize=7, loc="upper left")
