"""Pressure from the torque in four quadrants: the sensor's beside the plant's, at four temperatures of the oil.

The loader's boom raises and lowers under loads that resist and loads that help, so pumps and motors turn both ways. The
drive reports as `DriveReport` does: in steps and with noise. Once the machine is its data sheet, once it is an unlucky
one of those in `real_machine`: belt, drag, magnets and the oil in its pumps are as far off as is drawn there, and its
sensor knows the usual values of belt, drag and compression. Each dot is a move at one load: the median of error and
pressure while it goes steadily.

    python evaluation/quadrants.py [--out docs/images/quadrants.png]
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from effects import both_pumps
from real_machine import COLDER, EFFECTS, unit_with

from ramsight.duty import DriveReport, Duty, Profile, report, simulate
from ramsight.duty.profile import constant
from ramsight.output import atomic_path
from ramsight.sensor.kalman import kalman

mpl.use("Agg")
from matplotlib.figure import Figure

CELSIUS = (0.0, 20.0, 40.0, 60.0)
RESTING = (50e3, 130e3, 210e3, 290e3, 370e3, 450e3)  # N, of the load's weight
PULLING = (-30e3, -70e3, -110e3, -150e3, -190e3, -230e3)  # N, that pull the rod out; the relief valve's are -330 kN
SPEEDS = (60.0, 157.0)  # rad/s
QUADRANTS = {
    "raise against the load: pump": (RESTING, 1.0),
    "lower with the load: motor": (RESTING, -1.0),
    "raise with a pulling load: motor": (PULLING, 1.0),
    "lower against a pulling load: pump": (PULLING, -1.0),
}
"""Loads [N] and sign of the motor's speed."""
TOLD = ("compression", "belt", "drag")
UNLUCKY = both_pumps(compression="in efficiency", belt_efficiency=0.97, belt_creep=0.01, viscous_drag=0.01)
GAIN = 1.08  # of the torque that a drive with warm magnets reports
MACHINES = ("data sheet", "unlucky")
_STYLES, _INK = (":", "-"), "#222222"
_BEGIN, _RAMP, _STEADY = 1.0, 0.5, 5.0  # s
_SETTLED = 2.0  # s, of the steady move that are not looked at


@dataclass(frozen=True)
class Move:
    """One move: the loaded chamber's true pressure [Pa], and the sensor's less that: 5 %, median and 95 %."""

    machine: str
    quadrant: str
    celsius: float
    speed: float
    load: float
    pressure: float
    low: float
    error: float
    high: float


def moved(machine: str, quadrant: str, celsius: float, speed: float, load: float, seed: int) -> Move:
    """One move, simulated and followed."""
    is_sheet = machine == "data sheet"
    real = unit_with({} if is_sheet else UNLUCKY)
    sheet = unit_with({} if is_sheet else {key: value for one in TOLD for key, value in EFFECTS[one].usual.items()})
    drive = DriveReport(seed=seed) if is_sheet else DriveReport(torque_gain=GAIN, temperature_offset=-COLDER, seed=seed)
    sign = QUADRANTS[quadrant][1]
    corners = np.cumsum([0.0, _BEGIN, _RAMP, _STEADY, _RAMP, _BEGIN])
    profile = Profile(corners, [0.0, 0.0, sign * speed, sign * speed, 0.0, 0.0])
    start = (0.2 if sign > 0.0 else 0.8) * real.cylinder.stroke
    run = simulate(real, Duty(profile, constant(load), constant(273.15 + celsius), start))
    sensor = kalman(sheet)
    sensor.start(start)
    track = sensor.track(report(run, drive))
    chamber = "pressure_a" if load > 0.0 else "pressure_b"
    time = run["time"].values
    steady = (time > corners[2] + _SETTLED) & (time < corners[3])
    true, said = run[chamber].values[steady], track[chamber].values[steady]
    low, error, high = np.quantile(said - true, [0.05, 0.5, 0.95])
    return Move(machine, quadrant, celsius, speed, load, float(np.median(true)), float(low), float(error), float(high))


def moves(advance: Callable[[int], object] = lambda done: None) -> list[Move]:
    """All of them."""
    done: list[Move] = []
    for machine, quadrant, celsius, speed in product(MACHINES, QUADRANTS, CELSIUS, SPEEDS):
        for load in QUADRANTS[quadrant][0]:
            done.append(moved(machine, quadrant, celsius, speed, load, len(done)))
            advance(1)
    return done


def runs() -> int:
    """How many moves there are."""
    return len(MACHINES) * len(CELSIUS) * len(SPEEDS) * sum(len(loads) for loads, _ in QUADRANTS.values())


def figures(done: list[Move]) -> dict[str, Any]:
    """By machine and quadrant: medians of all moves, largest of them, and the span of noise [bar]."""
    found: dict[str, Any] = {}
    for machine in MACHINES:
        for quadrant in QUADRANTS:
            some = [one for one in done if (one.machine, one.quadrant) == (machine, quadrant)]
            relative = [abs(one.error) / one.pressure for one in some]
            found.setdefault(machine, {})[quadrant] = {
                "moves": len(some),
                "median_bar": 1e-5 * float(np.median([abs(one.error) for one in some])),
                "largest_bar": 1e-5 * max(abs(one.error) for one in some),
                "median_percent": 100.0 * float(np.median(relative)),
                "noise_bar": 1e-5 * float(np.median([one.high - one.low for one in some])),
            }
    return found


def study(advance: Callable[[int], object]) -> dict[str, Any]:
    """Figures for results/study.json."""
    return figures(moves(advance))


def figure_of(done: list[Move]) -> Figure:
    """A panel for each quadrant: error over the true pressure, of either machine, by temperature and speed."""
    figure = Figure(figsize=(10.0, 7.4), layout="constrained")
    panels = figure.subplots(2, 2, sharey=True).ravel()
    colours = dict(zip(CELSIUS, mpl.colormaps["turbo"](np.linspace(0.08, 0.92, len(CELSIUS))), strict=True))
    for panel, quadrant in zip(panels, QUADRANTS, strict=True):
        for machine, celsius, speed in product(MACHINES, CELSIUS, SPEEDS):
            some = [
                one
                for one in done
                if (one.quadrant, one.celsius, one.machine, one.speed) == (quadrant, celsius, machine, speed)
            ]
            _line(panel, some, colours[celsius])
        panel.axhline(0.0, color="#222222", lw=0.8)
        panel.set(title=quadrant, xlabel="true pressure of the loaded chamber [bar]")
        panel.grid(alpha=0.3)
    for panel in panels[::2]:
        panel.set_ylabel("pressure from torque, less that [bar]")
    plot = panels[0].plot
    handles = [plot([], [], "-", color=colour, label=f"{celsius:g} °C")[0] for celsius, colour in colours.items()]
    handles += [plot([], [], "o", color=_INK, ms=4.0, label="the machine is its data sheet")[0]]
    handles += [plot([], [], "^", color=_INK, ms=4.0, mfc="white", label="an unlucky machine")[0]]
    handles += [
        plot([], [], style, color=_INK, lw=0.9, label=f"{speed:g} rad/s")[0]
        for speed, style in zip(SPEEDS, _STYLES, strict=True)
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False)
    return figure


def _line(panel: Any, some: list[Move], colour: Any) -> None:
    full = some[0].machine == "data sheet"
    panel.errorbar(
        [1e-5 * one.pressure for one in some], [1e-5 * one.error for one in some],
        1e-5 * np.array([[one.error - one.low, one.high - one.error] for one in some]).T,
        fmt="o" if full else "^", ms=4.0, color=colour, mfc=colour if full else "white", elinewidth=0.6, lw=0.9,
        ls=_STYLES[SPEEDS.index(some[0].speed)],
    )  # fmt: skip


def main() -> None:
    """Simulate, follow and draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path(__file__).parents[1] / "docs" / "images" / "quadrants.png")
    given = parser.parse_args()
    with atomic_path(given.out) as draft:
        figure_of(moves()).savefig(draft, dpi=110, format="png")


if __name__ == "__main__":
    main()
