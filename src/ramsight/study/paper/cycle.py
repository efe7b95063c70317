"""One lift-lower cycle of one unit, as both sensors see it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ramsight.duty.lift_lower import lift_lower
from ramsight.duty.profile import Duty
from ramsight.duty.simulate import simulate
from ramsight.study.paper.bench import SEED, TEMPERATURE, Bench, Tracked

NOISES = 20
"""Draws of the drive's noise that the balance sensor has to bear."""


@dataclass(frozen=True)
class Cycle:
    """One cycle of one unit with one load.

    Attributes:
        duty: what the unit was asked to do.
        tracks: what each sensor made of it.
        any_noise_mm: largest error of the balance sensor over `NOISES` draws of the noise [mm].
    """

    duty: Duty
    tracks: dict[str, Tracked]
    any_noise_mm: float

    @property
    def ramps(self) -> list[tuple[float, float]]:
        """When the motor accelerates or decelerates [s]."""
        time, speed = self.duty.motor_speed.time, self.duty.motor_speed.value
        return [(float(a), float(b)) for a, b, u, v in zip(time, time[1:], speed, speed[1:], strict=False) if u != v]

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


def run_cycle(bench: Bench, load: float) -> Cycle:
    """Simulate one cycle at 40 degC and let both sensors follow it.

    Args:
        bench: the unit.
        load: [N].
    """
    duty = lift_lower(bench.unit, load, TEMPERATURE)
    run = simulate(bench.unit, duty)
    tracks = {name: bench.track(run, sensor) for name, sensor in bench.sensors.items()}
    balance = bench.sensors["balance"]
    any_noise = max(bench.track(run, balance, seed=seed).largest_mm for seed in range(SEED, SEED + NOISES))
    return Cycle(duty, tracks, any_noise)
