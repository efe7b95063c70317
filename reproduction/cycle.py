"""One lift-lower cycle of one unit, as all sensors see it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ramsight import Duty, simulate
from reproduction.bench import SEED, TEMPERATURE, Bench, Tracked

_SETTLES = 0.5  # s after a ramp
NOISES = 20
"""Draws of the drive's noise that a sensor has to bear."""


@dataclass(frozen=True)
class Cycle:
    """One cycle of one unit with one load.

    Attributes:
        duty: what the unit was asked to do.
        tracks: what each sensor made of it.
        way_mm: how far the rod went from its lowest to its highest position [mm].
    """

    duty: Duty
    tracks: dict[str, Tracked]
    way_mm: float

    @property
    def ramps(self) -> list[tuple[float, float]]:
        """When the motor accelerates or decelerates [s]."""
        time, speed = self.duty.motor_speed.time, self.duty.motor_speed.value
        return [(float(a), float(b)) for a, b, u, v in zip(time, time[1:], speed, speed[1:], strict=False) if u != v]

    @property
    def largest_mm(self) -> dict[str, float]:
        """Largest error by sensor [mm]."""
        return {name: tracked.largest_mm for name, tracked in self.tracks.items()}

    @property
    def unsteady(self) -> float:
        """By how much the rod's velocity varies while lifting at constant motor speed, over its mean [1]."""
        track, (_, begin), (end, _) = self.tracks["table"], self.ramps[0], self.ramps[1]
        inside = (track.time > begin + _SETTLES) & (track.time < end)
        velocity = np.abs(np.gradient(track.truth, track.time))[inside]
        return float(np.ptp(velocity) / velocity.mean())

    def gained_mm(self, sensor: str) -> tuple[float, float]:
        """Error gained in the ramps and at constant speed [mm]; what a ramp sets off is the ramp's."""
        track = self.tracks[sensor]
        error = 1e3 * track.error

        def at(time: float) -> float:
            return float(np.interp(time, track.time, error))

        steady = 0.0
        for (_, begin), (end, _) in zip(self.ramps[::2], self.ramps[1::2], strict=True):
            steady += abs(at(end) - at(begin))
        ramps = sum(abs(at(end) - at(begin)) for begin, end in self.ramps)
        return ramps, steady


def run_cycle(bench: Bench, load: float, temperature: float = TEMPERATURE) -> Cycle:
    """Simulate one cycle and let all sensors follow it.

    Args:
        bench: the unit.
        load: [N].
        temperature: of the oil [K].
    """
    duty = bench.cycle(load, temperature=temperature)
    run = simulate(bench.unit, duty)
    tracks = {name: bench.track(run, sensor) for name, sensor in bench.sensors.items()}
    return Cycle(duty, tracks, 1e3 * float(np.ptp(run["position"].values)))


def any_noise_mm(bench: Bench, cycle: Cycle, sensor: str) -> float:
    """Largest error of a sensor over `NOISES` draws of the drive's noise on one cycle [mm]."""
    run = simulate(bench.unit, cycle.duty)
    seeds = range(SEED, SEED + NOISES)
    return max(bench.track(run, bench.sensors[sensor], seed=seed).largest_mm for seed in seeds)
