"""The loading cycle under sensorless control: a reference, then from phase to phase, with payload and heap."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ramsight import AsBuilt, DescriptionError, DriveResponse
from ramsight.closed_loop.loop import ClosedLoop
from ramsight.closed_loop.referencing import LoopSettings
from ramsight.duty.linked_duty import simulate_linked
from ramsight.duty.loading import PHASES, Phase
from ramsight.duty.simulate import SAMPLE_PERIOD
from ramsight.normal import TWO_SIDED_95
from ramsight.plant.ddh import DdhUnit
from ramsight.plant.linkage import joints, tip
from ramsight.plant.linked import LinkedMachine

if TYPE_CHECKING:
    import xarray

UNITS = ("boom", "bucket")
_START = {"boom": 0.05, "bucket": 0.5}  # shares of the strokes, where the cycle begins and a bucket is level
_SECONDS = 130.0  # about what a cycle with its references takes, for a progress bar
_LOADED_IN = 1.0  # s, in which payload comes or goes in a phase without a move


@dataclass(frozen=True)
class Options:
    """What is worked with.

    Args:
        payload: in the full bucket [kg]; the rated one if omitted.
        oil_temperature: [K].
        leak: leakage of all pumps over the data sheet's [1].
        temperature_offset: by which the thermometers read too much [K].
        references: visits of each unit to an end stop before the work; after the second one the sensor has learned.
        seed: of the drives' noise.
        delay: by which the drives are late, with commands and with reports each [s]; the controls know it. Two samples
            by default: one until the bus takes a value over, one until the other side does.

    Example:
        >>> Options().late
        'drives 40 ms late either way'
    """

    payload: float | None = None
    oil_temperature: float = 313.15
    leak: float = 1.0
    temperature_offset: float = 0.0
    references: int = 1
    seed: int = 0
    delay: float = 2.0 * SAMPLE_PERIOD

    @property
    def late(self) -> str:
        """What a title says of the drives."""
        return f"drives {1e3 * self.delay:g} ms late either way" if self.delay else "drives without a delay"


@dataclass(frozen=True)
class Work:
    """What came of it.

    Attributes:
        machine: as its data sheets have it.
        run: the truth, from `simulate_linked`.
        tracks: what the sensors said, by unit, with `target` [m] beside it.
        phases: names and when each began [s].
        works_from: when the references were over [s].
        arrivals: of each phase with moves: its name, and rods less targets at its end [m], by unit.
        stopped: why the machine stopped; empty if it did not.
    """

    machine: LinkedMachine
    run: xarray.Dataset
    tracks: dict[str, xarray.Dataset]
    phases: tuple[tuple[str, float], ...]
    works_from: float
    arrivals: tuple[tuple[str, dict[str, float]], ...]
    stopped: str

    def results(self) -> dict[str, Any]:
        """Errors and energies as plain numbers, SI."""
        time = self.run["time"].values
        working = time >= self.works_from - 1e-9
        found: dict[str, Any] = {"duration": float(time[-1]), "works_from": self.works_from, "stopped": self.stopped}
        found["phases"] = [{"name": name, "begins": begins} for name, begins in self.phases]
        for name in UNITS:
            error = self._error(name)[working]
            band = TWO_SIDED_95 * self.tracks[name]["position_std"].values[working]
            missed = [off[name] for _, off in self.arrivals if name in off]
            found[name] = {
                "sensor_error_largest": float(np.abs(error).max()),
                "sensor_error_p95": float(np.percentile(np.abs(error), 95)),
                "within_band": float(np.mean(np.abs(error) <= band)),
                "target_error_largest": max((abs(value) for value in missed), default=None),
                "shaft_energy_given": float(self.run.attrs[f"{name}.energy.shaft_given"]),
                "shaft_energy_taken": float(self.run.attrs[f"{name}.energy.shaft_taken"]),
            }
        off = self.tip_error()[working]
        found["tip_error_largest"], found["tip_error_p95"] = float(off.max()), float(np.percentile(off, 95))
        found["energy_residual"] = float(self.run.attrs["energy_residual"])
        found["volume_residual"] = float(self.run.attrs["volume_residual"])
        found["arrivals"] = [{"phase": name, "rod_less_target": off} for name, off in self.arrivals]
        return found

    def tip_error(self) -> np.ndarray[Any, Any]:
        """How far the tip is from where the sensors have it [m], over time."""
        estimated = np.column_stack([self.tracks[name]["position"].values for name in UNITS])
        there = tip(self.machine.mechanism, joints(self.machine.mechanism, estimated))
        off: np.ndarray[Any, Any] = np.hypot(
            there[:, 0] - self.run["tip_x"].values, there[:, 1] - self.run["tip_z"].values
        )
        return off

    def _error(self, name: str) -> np.ndarray[Any, Any]:
        error: np.ndarray[Any, Any] = self.tracks[name]["position"].values - self.run[f"{name}_position"].values
        return error


def work(sheet: LinkedMachine, options: Options, *, advance: Callable[[float], object] | None = None) -> Work:
    """Reference the loader, then run the loading cycle, each move to a position.

    Args:
        sheet: the machine as its data sheets have it, with the units "boom" and "bucket".
        options: what is worked with.
        advance: called now and then with the share of the work done since the last call; about 1 in all.

    Raises:
        DescriptionError: the machine is no loader, or a temperature is out of range.
        SimulationError: the run cannot be followed.
    """
    tell = advance or (lambda _: None)
    if sorted(sheet.mechanism.cylinders) != sorted(UNITS):
        has = ", ".join(sheet.mechanism.cylinders)
        raise DescriptionError("a loader has the units boom and bucket", key="linkage.cylinders", value=has)
    stroke = {unit.name: unit.cylinder.stroke for unit in sheet.units}
    start = {name: share * stroke[name] for name, share in _START.items()}
    full = sheet.mechanism.rated_payload if options.payload is None else options.payload
    built = AsBuilt(leak=options.leak)
    actual = replace(
        sheet, units=tuple(built.apply(unit) if isinstance(unit, DdhUnit) else unit for unit in sheet.units)
    )  # fmt: skip
    setting = LoopSettings(
        oil_temperature=options.oil_temperature,
        temperature_offset=options.temperature_offset,
        seed=options.seed,
        drive=DriveResponse(command_delay=options.delay, report_delay=options.delay),
    )
    loop = ClosedLoop(actual, sheet, start, setting)
    phases = [("reference boom", 0.0)]
    for k in range(options.references):
        loop.home("boom", lifted=k % 2 == 1)
        tell(0.1 / options.references)
    phases.append(("reference bucket", loop.now.time))
    for k in range(options.references):
        loop.home("bucket", lifted=k % 2 == 0)
        tell(0.1 / options.references)
    loop.go(start)
    works_from, arrivals = loop.now.time, []
    for phase in PHASES:
        if loop.stopped:
            break
        phases.append((phase.name, loop.now.time))
        targets = _go(loop, phase, stroke, full)
        if targets:
            arrivals.append((phase.name, {name: loop.now.position[name] - x for name, x in targets.items()}))
        tell(0.3 / len(PHASES))
    reason = next((why for why in loop.reasons.values()), "") if loop.stopped else ""
    duty = loop.duty(phases)
    run = simulate_linked(actual, duty, sample_period=loop.period, advance=lambda s: tell(0.5 * s / duty.duration))
    tracks = {name: loop.track(name) for name in UNITS}
    return Work(sheet, run, tracks, tuple(phases), works_from, tuple(arrivals), reason)


def _go(loop: ClosedLoop, phase: Phase, stroke: dict[str, float], full: float) -> dict[str, float]:
    """One phase: payload and force change evenly while the rods go to their targets, which are returned [m]."""
    asked = {"boom": phase.boom, "bucket": phase.bucket}
    targets = {name: stroke[name] * share for name, share in asked.items() if share is not None}
    time = loop.send(targets) if targets else _LOADED_IN
    loop.load(phase.payload * full, time, phase.tip_force)
    loop.wait()
    loop.rest(max(phase.rest, 0.5))
    return targets
