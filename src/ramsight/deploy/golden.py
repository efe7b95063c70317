"""A short simulated log with faults in it: what an exported sensor is compared on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ramsight.arrays import Array
from ramsight.duty.drive_report import declared_report, reported
from ramsight.duty.faults import Fault, faulty
from ramsight.duty.simulate import simulated
from ramsight.duty.work_day import work_day
from ramsight.plant.limits import limits_of
from ramsight.plant.unit import HydraulicUnit
from ramsight.signals import Signal, Signals

SAMPLES = 2000
_LOADS = (0.1, 0.5)  # shares of what relief pressure holds
_TEMPERATURE = 313.15  # K
_OVERSPEED, _OVERTORQUE = 20.0, 50.0  # gains that no motor follows
_SAMPLE = "sample"  # number that a sample had before the faults


def faults(at: float) -> list[Fault]:
    """One of each kind in twenty seconds from a time [s]."""
    return [
        Fault("nan", at, at + 0.1, "motor_torque"),
        Fault("nan", at + 2.0, at + 2.06, "motor_speed"),
        Fault("nan", at + 3.0, at + 4.0, "oil_temperature"),
        Fault("dropout", at + 5.0, at + 5.2),
        Fault("reordering", at + 7.0, at + 7.2),
        Fault("frozen", at + 9.0, at + 9.1),
        Fault("stuck", at + 11.0, at + 12.0, "motor_torque"),
        Fault("jump", at + 13.0, at + 13.5, size=5.0),
        Fault("gain", at + 15.0, at + 15.04, "motor_speed", _OVERSPEED),
        Fault("gain", at + 17.0, at + 17.1, "motor_torque", _OVERTORQUE),
        Fault("jump", at + 19.0, at + 19.5, size=-5.0),
    ]


def faulty_day(
    unit: HydraulicUnit,
    *,
    duration: float,
    every: float | None,
    seed: int,
    real: HydraulicUnit | None = None,
    further: Sequence[str] = (),
) -> tuple[Array, float]:
    """A work day with a fault of each kind again and again, and a reference after each round.

    Args:
        duration: of the day [s].
        every: time from one round of faults to the next [s], at least 25; None for a day without faults.
        real: the unit as it is; by default its data sheet.
        further: what else the sensor takes, for columns after these: commands, and pressures without noise.

    Returns:
        Time [s], motor speed [rad/s], torque [N m], oil temperature [K] and reference (NaN: none) [m], shape
        (samples, 5 and more); and the position at the start [m].
    """
    force = limits_of(unit).load
    loads = (_LOADS[0] * force, _LOADS[1] * force)
    duty = work_day(unit, loads, _TEMPERATURE, duration=duration, visit_every=15.0, seed=seed)
    run = simulated(real or unit, duty).columns()
    log = reported(run, declared_report(real or unit, seed))
    more = {name: run[name] for name in further if name not in log}
    log = Signals({**log.columns, **more, _SAMPLE: Signal(np.arange(len(run)))})
    known = np.full(len(run), np.nan)
    for at in np.arange(8.0, duration - 25.0, every) if every else ():
        for fault in faults(float(at)):
            log = faulty(log, fault, seed)
        place = int(np.searchsorted(run["time"].values, at + 21.0))
        known[place] = run["position"].values[place]
        known[place + 100] = 0.5 * unit.cylinder.stroke  # most likely wrong, and to be refused
    names = ("time", "motor_speed", "motor_torque", "oil_temperature")
    columns = [*(log[name].values for name in names), known[log[_SAMPLE].values]]
    rows = np.column_stack([*columns, *(log[name].values for name in further)])
    return rows, duty.start_position
