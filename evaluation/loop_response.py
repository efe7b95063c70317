"""Step and frequency response of the position control of each unit, from the running loop; a figure for the docs.

A sum of sines is added to the position that a control is given while its rod goes a long way evenly. What the sensor
then says of the position, over what the control was given, is the loop's gain at each frequency: plant, drive, sensor
and control as they are, with nothing linearised by hand. From it come the margins.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from circuits import CIRCUITS, catalogued
from numpy.typing import NDArray

from ramsight.closed_loop.loop import UnitLoop
from ramsight.closed_loop.referencing import LoopSettings
from ramsight.control.trajectory import Limits
from ramsight.duty.drive_response import IDEAL, DriveResponse
from ramsight.output import atomic_path
from ramsight.plant.limits import limits_of
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import Estimate

UNITS = {**CIRCUITS, "bucket": ("mining-loader", "bucket")}
DRIVES = {
    "ideal": IDEAL,
    "5 samples either way": DriveResponse(command_delay=0.1, report_delay=0.1),
}
WINDOW = 20.0  # s, in which every sine has whole periods
PERIODS = (2, 3, 5, 8, 13, 21, 34, 55, 89, 144, 200)  # in the window: 0.1 to 10 Hz
_SLOW, _QUICK = 0.4e-3, 0.2e-3  # m, of each sine below and above 1 Hz: more than noise, less than the motor's ramp
_BEGINS = 4.0  # s until the rod goes evenly
_SHOWN = 5  # samples from one point of a move to the next
_LOAD, _INSIDE = 0.3, 0.8  # share of the load at relief pressure; of the stroke that is gone


@dataclass(frozen=True)
class Response:
    """The open loop of a unit."""

    frequency: NDArray[np.float64]  # [Hz]
    # complex, of the position that the control is given to the one that the sensor then says
    gain: NDArray[np.complex128]
    delay: float = 0.0  # dead time that the drive is declared to have [s]

    @property
    def phase(self) -> NDArray[np.float64]:
        """Without jumps [rad]: the known dead time turns it by more than half a turn from one sine to the next."""
        turned = 2.0 * np.pi * self.delay * self.frequency
        return np.unwrap(np.angle(self.gain * np.exp(1j * turned))) - turned

    @property
    def crossover(self) -> float:
        """Frequency at which the gain is 1 [Hz]."""
        return _where(self.frequency, np.log(np.abs(self.gain)))

    @property
    def phase_margin(self) -> float:
        """What the phase has left to -180 degrees there [degrees]."""
        return 180.0 + math.degrees(float(np.interp(math.log(self.crossover), np.log(self.frequency), self.phase)))

    @property
    def gain_margin(self) -> float:
        """By how much the gain may grow until the phase of -180 degrees has a gain of 1; NaN: not up to 10 Hz."""
        at = _where(self.frequency, self.phase + math.pi)
        if math.isnan(at):
            return math.nan
        level = np.interp(math.log(at), np.log(self.frequency), np.log(np.abs(self.gain)))
        return 1.0 / math.exp(float(level))


def _where(frequency: NDArray[np.float64], falling: NDArray[np.float64]) -> float:
    """Frequency at which something that falls is 0, between its samples; NaN if nowhere."""
    below = np.flatnonzero((falling[1:] < 0.0) & (falling[:-1] >= 0.0))
    if len(below) == 0:
        return math.nan
    k = int(below[0])
    share = falling[k] / (falling[k] - falling[k + 1])
    return float(frequency[k] ** (1.0 - share) * frequency[k + 1] ** share)


def response(unit: HydraulicUnit, drive: DriveResponse) -> Response:
    """The open loop of a unit that lifts evenly."""
    name, stroke = unit.name, float(unit.cylinder.stroke)
    up = unit.lift_sign > 0.0
    begin, end = (0.1, 0.1 + _INSIDE) if up else (0.1 + _INSIDE, 0.1)
    limits = Limits.of(unit, _INSIDE * stroke / (WINDOW + 2.0 * _BEGINS))
    limits = replace(limits, landing_zone=0.0)
    setting = LoopSettings(known=True, drive=drive, limits={name: limits})
    loop = UnitLoop(unit, unit, begin * stroke, _LOAD * limits_of(unit).load, setting)
    control, given, said = loop.controls[name], [], []
    step, frequency = control.step, np.array(PERIODS) / WINDOW
    sizes = np.where(frequency < 1.0, _SLOW, _QUICK)
    phases = np.pi * np.arange(len(frequency)) ** 2 / len(frequency)  # peaks that do not add up (Schroeder)

    def disturbed(estimate: Estimate, reported: Any, **learned: float) -> Any:
        time = loop.now.time
        put = float((sizes * np.sin(2.0 * np.pi * frequency * time + phases)).sum())
        said.append((time, estimate.position))
        given.append(estimate.position + put)
        # A status would change the speed, and with it what is measured.
        return step(replace(estimate, position=given[-1], status=Status.OK), reported, **learned)

    control.step = disturbed  # type: ignore[method-assign]
    loop.send({name: end * stroke})
    loop.rest(_BEGINS + WINDOW + 0.1)
    assert not loop.stopped, loop.reasons
    times, positions = np.array(said).T
    inside = (times > _BEGINS) & (times <= _BEGINS + WINDOW + 1e-9)
    found = _lines(times[inside], positions[inside], frequency) / _lines(
        times[inside], np.array(given)[inside], frequency
    )
    return Response(frequency, -found, drive.command_delay + drive.report_delay + setting.period)


def _lines(time: NDArray[np.float64], values: NDArray[np.float64], frequency: Any) -> NDArray[np.complex128]:
    """What a signal has of each frequency, a straight line taken off by least squares."""
    columns = [np.ones_like(time), time - time.mean()]
    for one in frequency:
        columns += [np.cos(2.0 * np.pi * one * time), np.sin(2.0 * np.pi * one * time)]
    weights = np.linalg.lstsq(np.column_stack(columns), values, rcond=None)[0][2:].reshape(-1, 2)
    return weights[:, 0] - 1j * weights[:, 1]


def steps(unit: HydraulicUnit, drive: DriveResponse) -> dict[str, list[float]]:
    """A move of a twentieth of the stroke: time [s], and what the true rod has done of its way [1], 1 at the target.

    What it has sunk by before a late drive holds it is no part of the way.
    """
    name, stroke = unit.name, float(unit.cylinder.stroke)
    loop = UnitLoop(unit, unit, 0.4 * stroke, _LOAD * limits_of(unit).load, LoopSettings(known=True, drive=drive))
    loop.rest(1.0)
    way = 0.05 * unit.lift_sign * stroke
    begun, at = loop.now.time, 0.4 * stroke
    loop.go({name: 0.4 * stroke + way}, settle=1.0)
    time, place = np.array(loop.time), np.array(loop.records[name].position)
    after = (time >= begun - 0.1) & (np.arange(len(time)) % _SHOWN == 0)
    return {"time": (time[after] - begun).tolist(), "share": ((place[after] - at) / way).tolist(), "way": [way]}


def study(advance: Callable[[float], object] = lambda _: None) -> dict[str, Any]:
    """Margins of all units and drives, and what the figure shows."""
    found: dict[str, Any] = {}
    for name, of in UNITS.items():
        unit, found[name] = catalogued(*of), {}
        for drive, how in DRIVES.items():
            one = response(unit, how)
            found[name][drive] = {
                "crossover": one.crossover,
                "phase_margin": one.phase_margin,
                "gain_margin": None if math.isnan(one.gain_margin) else one.gain_margin,
                "frequency": one.frequency.tolist(),
                "gain": np.abs(one.gain).tolist(),
                "phase": np.degrees(one.phase).tolist(),
                "step": {key: np.round(value, 5).tolist() for key, value in steps(unit, how).items()},
            }
            advance(1)
    return found


def runs() -> int:
    """How many responses `study` measures."""
    return len(UNITS) * len(DRIVES)


def table(found: dict[str, dict[str, Any]]) -> list[str]:
    """The margins as docs/explanation/control-concept.md has them."""
    rows = ["| unit | drive | crossover [Hz] | phase margin [°] | gain margin |", "|---" * 5 + "|"]
    for name, drives in found.items():
        for drive, row in drives.items():
            margin = "above 10 Hz" if row["gain_margin"] is None else f"{row['gain_margin']:.1f}"
            rows.append(f"| {name} | {drive} | {row['crossover']:.2f} | {row['phase_margin']:.0f} | {margin} |")
    return rows


def draw(found: dict[str, dict[str, Any]], file: Path) -> None:
    """Steps, gains and phases of all units."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 6.4), layout="constrained")
    grid = figure.subplots(len(DRIVES), 3, squeeze=False)
    for row, drive in zip(grid, DRIVES, strict=True):
        for name, drives in found.items():
            one = drives[drive]
            row[0].plot(one["step"]["time"], one["step"]["share"], lw=1.2, label=name)
            row[1].loglog(one["frequency"], one["gain"], lw=1.2)
            row[2].semilogx(one["frequency"], one["phase"], lw=1.2)
        row[0].set(xlabel="time [s]", ylabel="share of the way", title=f"a move, {drive}")
        row[1].set(xlabel="frequency [Hz]", ylabel="gain of the open loop", title="gain")
        row[1].axhline(1.0, color="0.6", lw=0.8)
        row[2].set(xlabel="frequency [Hz]", ylabel="phase [°]", title="phase")
        row[2].axhline(-180.0, color="0.6", lw=0.8)
        for axes in row:
            axes.grid(alpha=0.3)
    grid[0][0].legend(fontsize=7, loc="lower right")
    with atomic_path(file) as draft:
        figure.savefig(draft, dpi=120, format="png")


def main() -> None:
    """Draw the figure from a study's figures."""
    import json

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--study", type=Path, default=Path("results/study.json"))
    parser.add_argument("--out", type=Path, default=Path("docs/images/control-loop.png"))
    given = parser.parse_args()
    draw(json.loads(given.study.read_text())["loop_response"], given.out)


if __name__ == "__main__":
    main()
