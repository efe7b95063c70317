"""Control with drives that are not perfect: whether machines move, how well they arrive, and how soon faults stop them.

Machines that are their data sheets, told where they are at the beginning, with virtual sensors as the only feedback; a
drive is declared to the control as it is. All by the truth; the seed decides everything.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from circuits import CIRCUITS, catalogued
from loader_control import KNOWN, arrivals, summed

from ramsight import machine
from ramsight.control.setting import Feedback, Setting
from ramsight.control.unit_loop import UnitLoop
from ramsight.control.watch import DriveWatch, Verdict
from ramsight.control.watch import runs as in_a_row
from ramsight.duty import DriveReport
from ramsight.duty.drive_response import IDEAL, DriveResponse
from ramsight.duty.live import Reported
from ramsight.duty.live_drive import LiveDrive
from ramsight.plant.drive import ServoDrive
from ramsight.plant.limits import limits_of
from ramsight.plant.linked import LinkedMachine, build_linked
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.status import Status
from ramsight.units import RPM

UNITS = {**CIRCUITS, "bucket": ("mining-loader", "bucket")}
FAULT_UNITS = ("direct driven", "press", "bucket")  # two behind a valve, one that its pump holds
TARGETS, HOURS, LOOP_HOURS, LOADER_SEEDS = 12, 10.0, 0.05, 2
_LOAD, _INSIDE = 0.4, (0.1, 0.9)  # of the load at relief pressure; shares of the stroke
_TORQUE = 0.6  # of the torque at relief pressure: half as much again as the load takes
_STANDS = 5.0  # rad/s, below which a motor stands: what a servo gives way by
_RESTED = 3.0  # s, before a fault: until the torque is the load's
GOING = {"running up": 0.3, "full speed": 2.0}  # s, from the command to a fault
STANDSTILL = 0.3  # s, and the drive's latency, within which a fault is to stop a motor
_GIVEN_UP = 10.0  # s after a fault


@dataclass(frozen=True)
class Drive:
    """A drive of the study.

    Args:
        response: how it follows its commands.
        period: of its samples [s].
        limited: whether it is a servo whose torque reaches for the load and little more.
    """

    response: DriveResponse = IDEAL
    period: float = 0.02
    limited: bool = False

    def of(self, unit: HydraulicUnit) -> HydraulicUnit:
        """The unit with it."""
        if not self.limited:
            return unit
        torque = _TORQUE * limits_of(unit).torque
        servo = ServoDrive("drive", unit.drive.inertia, 0.8, 16.0, torque)  # gains as the description's defaults
        changed: HydraulicUnit = replace(unit, drive=servo)  # type: ignore[type-var]
        return changed

    @property
    def latency(self) -> float:
        """By which it may be late, lost samples included [s]; commands and reports take a sample each at least."""
        lost = in_a_row(self.response.lost, self.period) * self.period if self.response.lost > 0.0 else 0.0
        return self.response.lag + lost + max(self.period - 0.02, 0.0)


_REPEATS = 0.05  # of the torque: steps of 1/16 N m over a noise of 0.5 N m
# Whole rpm, of which the last one flickers: an encoder in the bearing of a traction motor has 64 pulses a turn, 256
# edges. If each is placed to 2 % of their distance, a speed counted over 5 ms is off by 0.02 sqrt(2)/(256 * 5 ms)
# = 0.022 /s, 1.3 rpm, whatever the speed; filters of drives take some of it.
NOISE = RPM
FINE = 0.1 * RPM  # of a drive that is told to report tenths: in CiA 402 a matter of the velocity's factor


def response(**follows: Any) -> DriveResponse:
    """How a drive of the study follows, with the noise of its reports."""
    return DriveResponse(**{"speed_noise": NOISE, "torque_repeats": _REPEATS} | follows)


DRIVES = {
    "ideal": Drive(response()),
    **{f"{n} sample{'s' * (n > 1)} late": Drive(response(report_delay=0.02 * n)) for n in (1, 2, 3, 5)},
    "5 samples either way": Drive(response(command_delay=0.1, report_delay=0.1)),
    "10 Hz": Drive(response(bandwidth=10.0, order=2)),
    "150 rad/s²": Drive(response(acceleration=150.0)),
    "torque limited": Drive(response(), limited=True),
    "samples of 100 ms": Drive(response(), period=0.1),
    "5 % lost": Drive(response(lost=0.05)),
    "speed in 0.1 rpm": Drive(response(speed_step=FINE)),
    "all but the torque": Drive(
        response(
            command_delay=0.04, report_delay=0.04, bandwidth=10.0, order=2, acceleration=300.0, lost=0.02
        )
    ),
}


def loop(unit: HydraulicUnit, drive: Drive, start: float, seed: int, feedback: Feedback = Feedback.SENSOR) -> UnitLoop:
    """A unit with a drive, told where it is, as a share of its stroke."""
    driven = drive.of(unit)
    setting = Setting(known=True, seed=seed, period=drive.period, drive=drive.response, feedback=feedback)
    return UnitLoop(driven, driven, start * unit.cylinder.stroke, _LOAD * limits_of(unit).load, setting)


def targets(unit: HydraulicUnit, seed: int) -> Iterator[float]:
    """Targets drawn at random [m], without end."""
    random = np.random.default_rng([seed, 11])
    while True:
        yield float(random.uniform(*_INSIDE)) * unit.cylinder.stroke


def moved(unit: HydraulicUnit, drive: Drive, seed: int = 0) -> dict[str, Any]:
    """`TARGETS` moves: how many arrived, errors of rod and sensor [m], time [s], and what stopped them, if anything."""
    run, name, errors, sensed = loop(unit, drive, 0.5, seed), unit.name, [], []
    for _, target in zip(range(TARGETS), targets(unit, seed), strict=False):
        run.go({name: target})
        if run.stopped:
            break
        errors.append(abs(run.now.position[name] - target))
        sensed.append(abs(run.records[name].estimate[-1].position - run.now.position[name]))
    return {
        "reached": len(errors),
        "p95": float(np.percentile(errors, 95)) if errors else None,
        "largest": max(errors, default=None),
        "sensor_p95": float(np.percentile(sensed, 95)) if sensed else None,
        "time": run.now.time,
        "stopped": run.reasons[name] if run.stopped else "",
    }


def asked(random: np.random.Generator, period: float) -> Iterator[float]:
    """Motor speeds as moves have them, without end [rad/s]: ramps to a speed and back, times of it, rests."""
    speed = 0.0
    while True:
        goal = float(random.choice([0.0, 1.0]) * random.uniform(-300.0, 300.0))
        step = float(random.uniform(50.0, 600.0)) * period
        while speed != goal:
            speed = min(speed + step, goal) if goal > speed else max(speed - step, goal)
            yield speed
        for _ in range(int(random.uniform(0.2, 5.0) / period)):
            yield speed


def watched(unit: HydraulicUnit, drive: Drive, hours: float, seed: int = 2) -> dict[str, float]:
    """Hours of motor speeds under the watch alone, without a plant: how often it would have stopped, or gone slowly."""
    watch, live = DriveWatch(unit, drive.response, drive.period), LiveDrive(drive.response, drive.period, DriveReport())
    speeds, speed, found = asked(np.random.default_rng(seed), drive.period), 0.0, {"stops": 0, "slow": 0}
    for k in range(int(3600.0 * hours / drive.period)):
        report = live.report(drive.period * k, speed, 20.0, 313.15)
        verdict = watch.missed() if report is None else watch.look(report)
        found["stops"] += verdict.stops
        found["slow"] += verdict is Verdict.SLOW
        command = next(speeds)
        watch.command(command)
        speed = live.follow(command)
        if verdict.stops:
            watch.begin()
    return {**found, "hours": hours}


def worked(unit: HydraulicUnit, drive: Drive, hours: float, seed: int = 1) -> dict[str, Any]:
    """Hours of moves with the true position, so that nothing but the drive could stop them: moves, hours, stops."""
    run, name, moves, stops = loop(unit, drive, 0.5, seed, Feedback.TRUTH), unit.name, 0, 0
    for target in targets(unit, seed):
        run.go({name: target})
        moves, stops = moves + 1, stops + run.stopped
        if run.now.time > 3600.0 * hours:
            return {"moves": moves, "hours": run.now.time / 3600.0, "stops": stops}
    raise AssertionError("targets end")


Changed = Callable[[Reported, Reported], Reported | None]
REPORTS: dict[str, Changed] = {
    "torque lost": lambda now, last: replace(now, motor_torque=math.nan),
    "torque stuck": lambda now, last: replace(now, motor_torque=last.motor_torque),
    "speed stuck": lambda now, last: replace(now, motor_speed=last.motor_speed),
    "speed, wrong sign": lambda now, last: replace(now, motor_speed=-now.motor_speed),
    "speed, half": lambda now, last: replace(now, motor_speed=0.5 * now.motor_speed),
}
MOTORS: dict[str, Callable[[float, float], float]] = {
    "motor stands": lambda asked, last: 0.0,
    "motor turns the other way": lambda asked, last: -asked,
    "motor half as fast": lambda asked, last: 0.5 * asked,
    "motor runs on": lambda asked, last: last,
}
SILENT = "no reports"
FAULTS = (*REPORTS, *MOTORS, SILENT)
"""What becomes of reports and commands, given the last before the fault."""


def broken(unit: HydraulicUnit, drive: Drive, kind: str, going: float) -> dict[str, float | None]:
    """A fault in mid-move [s]: until the control stops, and until the motor stands; None if that never comes.

    A motor that runs on whatever it is told never stands; a stop of the control is all that can be asked for.
    """
    up = unit.lift_sign > 0.0
    run, name = loop(unit, drive, 0.1 if up else 0.9, 0), unit.name
    run.rest(_RESTED)
    run.send({name: (0.9 if up else 0.1) * unit.cylinder.stroke})
    run.rest(going)
    record = run.records[name]
    last, asked, begun = record.reported[-1], record.command[-1], run.now.time
    if kind in REPORTS:
        run.fault = lambda _, now: REPORTS[kind](now, last)
    elif kind in MOTORS:
        run.motor_fault = lambda _, speed: MOTORS[kind](speed, asked)
    else:
        run.fault = lambda *_: None
    noticed, stood = None, None
    while stood is None and run.now.time - begun < _GIVEN_UP and not (run.done and not run.stopped):
        run.step()
        if run.stopped and noticed is None:
            noticed = run.now.time - begun
        told = run.stopped and run.controls[name].done
        if told and (kind == "motor runs on" or abs(run.now.motor_speed[name]) < _STANDS):
            stood = run.now.time - begun
    return {"noticed": noticed, "standstill": stood}


def loader(drive: Drive, seeds: int) -> dict[str, float]:
    """The loader on its data sheet, referenced once: as `loader_control` has it, with a drive."""
    sheet: LinkedMachine = build_linked(machine.load("mining-loader"))
    found = []
    for seed in range(seeds):
        found += arrivals(sheet, sheet, references=1, seed=seed, assumptions=KNOWN, drive=drive.response)
    return summed(found)


LOADER = ("ideal", *(f"{n} sample{'s' * (n > 1)} late" for n in (1, 2, 3, 5)))


def study(
    advance: Callable[[float], object] = lambda _: None, hours: float = HOURS, seeds: int = LOADER_SEEDS
) -> dict[str, Any]:
    """All of it.

    Args:
        advance: called with 1 after each of `runs()` runs.
        hours: of motor speeds under the watch alone, with each drive.
        seeds: of the loader's targets.
    """
    found: dict[str, Any] = {"moves": {}, "worked": {}, "watched": {}, "faults": {}, "loader": {}}
    units = {name: catalogued(*of) for name, of in UNITS.items()}
    for label, drive in DRIVES.items():
        found["moves"][label] = {name: moved(unit, drive) for name, unit in units.items()}
        found["worked"][label] = worked(units["bucket"], drive, LOOP_HOURS)
        if not drive.limited:  # what a torque does to a speed, only a plant says
            found["watched"][label] = watched(units["bucket"], drive, hours)
        found["faults"][label] = {"latency": drive.latency, "kinds": faults(drive)}
        advance(1)
    for label in LOADER:
        found["loader"][label] = loader(DRIVES[label], seeds)
        advance(1)
    return found


def faults(drive: Drive) -> dict[str, dict[str, dict[str, float | None]]]:
    """Every fault of a drive, while the motors run up and at full speed."""
    units = [catalogued(*UNITS[name]) for name in FAULT_UNITS]
    return {
        kind: {words: slowest([broken(unit, drive, kind, going) for unit in units]) for words, going in GOING.items()}
        for kind in FAULTS
    }


def slowest(cases: list[dict[str, float | None]]) -> dict[str, float | None]:
    """The slowest reaction and standstill of several cases [s], None without any; how many never stood."""
    found: dict[str, float | None] = {}
    for key in ("noticed", "standstill"):
        there = [case[key] for case in cases if case[key] is not None]
        found[key] = max(there, default=None)  # type: ignore[type-var]
    return found | {"never": sum(case["standstill"] is None for case in cases)}


def runs() -> int:
    """How many runs `study` makes."""
    return len(DRIVES) + len(LOADER)


def table(found: dict[str, Any]) -> list[str]:
    """How drives move the units."""
    ideal = found["moves"]["ideal"]
    head = [
        "| drive | targets reached | rod less target, p95: median, worst unit [mm] | largest | sensor, p95: worst unit "
        "| time over the ideal drive's | stops by the sensor | false stops | in hours |"
    ]
    sensors = {status.text for status in Status}
    rows = []
    for label, units in found["moves"].items():
        p95, sensor = ([1e3 * u[key] for u in units.values() if u["reached"]] for key in ("p95", "sensor_p95"))
        reached, asked_for = sum(unit["reached"] for unit in units.values()), TARGETS * len(units)
        largest = 1e3 * max(unit["largest"] or 0.0 for unit in units.values())
        slower = np.median([unit["time"] / ideal[name]["time"] for name, unit in units.items() if not unit["stopped"]])
        alone = found["watched"].get(label, {"stops": 0, "hours": 0.0})
        said = [unit["stopped"] for unit in units.values() if unit["stopped"]]
        lost = sum(reason in sensors for reason in said)
        stops = len(said) - lost + found["worked"][label]["stops"] + alone["stops"]
        loops = found["worked"][label]["hours"] + sum(unit["time"] for unit in units.values()) / 3600.0
        rows.append(
            f"| {label} | {reached} of {asked_for} | {np.median(p95):.2f}, {max(p95):.2f} | {largest:.2f} "
            f"| {max(sensor):.2f} | {slower:.2f} | {lost} | {stops} | {loops:.2f} + {alone['hours']:.0f} |"
        )
    return [*head, "|---" * 9 + "|", *rows]


def missed(found: dict[str, Any]) -> list[str]:
    """Which units did not reach all their targets: how many they reached, with which drives."""
    lines = []
    for name in next(iter(found["moves"].values())):
        by_reached: dict[int, list[str]] = {}
        for label, units in found["moves"].items():
            by_reached.setdefault(units[name]["reached"], []).append(label)
        if min(by_reached) < TARGETS:
            counts = "; ".join(
                f"{reached} ({', '.join(labels)})" for reached, labels in sorted(by_reached.items())[::-1]
            )
            lines.append(f"- {name}, reached of its {TARGETS} targets: {counts}")
    return lines


def fault_table(found: dict[str, Any]) -> list[str]:
    """How soon faults stop each drive: standstill of the slowest unit, running up and at full speed [s]."""
    head = [f"| fault | {' | '.join(found['faults'])} |", "|---" * (len(found["faults"]) + 1) + "|"]
    allowed = [f"{STANDSTILL + of['latency']:.2f}" for of in found["faults"].values()]
    rows = [
        f"| {kind} | {' | '.join(_slowest(of['kinds'][kind]) for of in found['faults'].values())} |" for kind in FAULTS
    ]
    return [*head, *rows, f"| *{STANDSTILL:g} s and the latency* | {' | '.join(allowed)} |"]


def _slowest(times: dict[str, dict[str, float | None]]) -> str:
    return ", ".join(
        "never" if case["standstill"] is None else f"{case['standstill']:.2f}" + "*" * bool(case["never"])
        for case in times.values()
    )


def loader_table(found: dict[str, Any]) -> list[str]:
    """The loader on its data sheet."""
    rows = [
        "| drive | targets | rod, p95 [mm] | over the ideal drive's | largest [mm] | tip, p95 [mm] |",
        "|---" * 6 + "|",
    ]
    for label, row in found["loader"].items():
        over = row["p95"] / found["loader"]["ideal"]["p95"]
        rows.append(
            f"| {label} | {row['targets']} | {1e3 * row['p95']:.2f} | {over:.2f} | {1e3 * row['largest']:.2f} "
            f"| {1e3 * row['tip_p95']:.2f} |"
        )
    return rows
