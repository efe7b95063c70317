"""Many cycles in a row, with and without references."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ramsight import simulate
from ramsight.duty.simulate import SAMPLE_PERIOD
from reproduction.bench import Bench
from reproduction.references import ProximitySwitch, with_stop, with_switches

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]

CYCLES = 50
_LOW, _HIGH = 0.02, 0.98  # shares of the stroke between which it works
SWITCHES = {"end": (0.05,), "middle": (0.5,), "both_ends": (0.05, 0.95)}
_INTO_STOP = 1.5  # s of lowering beyond the closed cycle, so that the rod meets its stop
NAMES = {
    "none": "no reference",
    "end": "switch at the end",
    "middle": "switch in the middle",
    "both_ends": "switches at both ends",
    "stop": "end stop, from the torque",
}


@dataclass(frozen=True)
class Repeated:
    """What a sensor made of fifty cycles.

    Attributes:
        after_cycle: magnitude of the error after each cycle [mm], shape (`CYCLES`,).
        largest: largest error of all samples [mm].
        left: largest error at the last reference of any visit [mm]; NaN without references.
    """

    after_cycle: Array
    largest: float
    left: float

    @property
    def drift(self) -> float:
        """Growth of the error per cycle [mm], from the first cycle's end to the last's."""
        return float((self.after_cycle[-1] - self.after_cycle[0]) / (len(self.after_cycle) - 1))

    @property
    def numbers(self) -> dict[str, Any]:
        """Numbers that results.json has of it."""
        numbers = {
            "after_1_cycle_mm": float(self.after_cycle[0]),
            "after_10_cycles_mm": float(self.after_cycle[9]),
            "after_50_cycles_mm": float(self.after_cycle[-1]),
            "largest_mm": self.largest,
        }
        return numbers if np.isnan(self.left) else numbers | {"left_by_a_visit_mm": self.left}


def repeat(bench: Bench, cycles: int = CYCLES) -> tuple[dict[str, dict[str, Repeated]], float]:
    """Run a unit through many cycles with each kind of reference.

    Args:
        bench: the unit; it works at its high load.
        cycles: how many.

    Returns:
        By sensor and kind of reference what came out, and the switches' own accuracy [mm].
    """
    load = bench.loads["high"]
    duty = bench.closed_cycle(load, _LOW, _HIGH)
    run = simulate(bench.unit, duty.repeated(cycles))
    into_stop = bench.closed_cycle(load, _LOW, _HIGH, extra=_INTO_STOP)
    stopped = simulate(bench.unit, into_stop.repeated(cycles))
    result: dict[str, dict[str, Repeated]] = {name: {} for name in bench.sensors}
    for kind in NAMES:
        of, period = (stopped, into_stop.duration) if kind == "stop" else (run, duty.duration)
        add = _adder(bench, kind, of)
        for name, sensor in bench.sensors.items():
            finds_it = kind == "stop" and name == "kalman"  # by itself, and needs no one who looks at the torque for it
            result[name][kind] = _follow(bench, sensor, of, None if finds_it else add, period, cycles)
    fastest = float(np.abs(run["velocity"].values).max())
    return result, 1e3 * ProximitySwitch(0.0).accuracy(fastest, SAMPLE_PERIOD)


def _adder(bench: Bench, kind: str, run: xarray.Dataset) -> Callable[[xarray.Dataset], xarray.Dataset] | None:
    if kind == "none":
        return None
    if kind == "stop":
        return lambda log: with_stop(log, bench.unit.lift_sign, bench.lowered_end)
    switches = [ProximitySwitch(bench.at(share)) for share in SWITCHES[kind]]
    return lambda log: with_switches(log, run, switches)


def _follow(
    bench: Bench,
    sensor: Any,
    run: xarray.Dataset,
    add: Callable[[xarray.Dataset], xarray.Dataset] | None,
    period: float,
    cycles: int,
) -> Repeated:
    references: list[Array] = []

    def keep(log: xarray.Dataset) -> xarray.Dataset:
        changed = log if add is None else add(log)
        if add is not None:
            references.append(changed["reference"].values)
        return changed

    tracked = bench.track(run, sensor, add=keep)
    error = 1e3 * np.abs(tracked.error)
    ends = np.minimum(np.searchsorted(tracked.time, period * np.arange(1, cycles + 1)), len(error) - 1)
    known = np.isfinite(references[0]) if references else np.zeros(len(error), dtype=bool)
    left = float(error[known].max()) if known.any() else float("nan")
    return Repeated(error[ends], float(error.max()), left)
