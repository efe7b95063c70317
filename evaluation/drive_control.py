"""Control with drives that are not perfect: whether machines move, how well they arrive, and how soon faults stop them.

Machines that are their data sheets, told where they are at the beginning, with virtual sensors as the only feedback; a
drive is declared to the control as it is. All by the truth; the seed decides everything.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from itertools import chain, repeat
from typing import Any

import numpy as np
from circuits import CIRCUITS, catalogued
from live_watch import DriveWatch
from loader_control import KNOWN, arrivals, summed
from loader_control import TARGETS as LOADER_TARGETS

from ramsight import machine
from ramsight.closed_loop.loop import UnitLoop
from ramsight.closed_loop.planning import Visit
from ramsight.closed_loop.referencing import Feedback, LoopSettings, Referencing
from ramsight.control.drive_watch import Verdict
from ramsight.control.repeats import repeats, repeats_in_a_row
from ramsight.control.repeats import runs as in_a_row
from ramsight.control.thresholds import STOPPING_TIME
from ramsight.duty import DriveReport
from ramsight.duty.drive_response import IDEAL, DriveResponse
from ramsight.duty.live import Reported
from ramsight.duty.live_drive import LiveDrive
from ramsight.duty.simulate import SAMPLE_PERIOD
from ramsight.plant.drive import ServoDrive
from ramsight.plant.limits import limits_of
from ramsight.plant.linked import LinkedMachine, build_linked
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.status import Status
from ramsight.units import RPM

UNITS = {**CIRCUITS, "bucket": ("mining-loader", "bucket")}
FAULT_UNITS = ("direct driven", "press", "bucket")  # two behind a valve, one that its pump holds
TARGETS, HOURS, LOOP_HOURS, RUN_HOURS = 12, 10.0, 0.05, 0.25
# Of 60 targets the p95 was 0.53 to 0.62 mm with one drive, by chance; 300 take two minutes a drive, alone on a core.
LOADER_SEEDS, LOADER_GROUP = 10, 2
PRACTICE = 0.25  # h of work, after which faults come: what a watch learns it has learned
TREMBLE = 0.06  # rad/s, standard deviation of commands that follow a sensor: of the press in mid-move
_LOAD, _INSIDE = 0.4, (0.1, 0.9)  # of the load at relief pressure; shares of the stroke
_TORQUE = 0.6  # of the torque at relief pressure: half as much again as the load takes
_STANDS = 5.0  # rad/s, below which a motor stands: what a servo gives way by
_RESTED = 3.0  # s, before a fault: until the torque is the load's
GOING = {"running up": 0.3, "full speed": 2.0}  # s, from the command to a fault
STANDSTILL = 0.3  # s, and the drive's latency, within which a fault is to stop a motor
_GIVEN_UP = 10.0  # s after a fault
_TRIFLE = 1e-6  # s


@dataclass(frozen=True)
class Drive:
    """A drive of the study."""

    response: DriveResponse = IDEAL  # how it follows its commands
    period: float = 0.02  # of its samples [s]
    limited: bool = False  # whether it is a servo whose torque reaches for the load and little more

    def of(self, unit: HydraulicUnit) -> HydraulicUnit:
        """The unit with it."""
        if not self.limited:
            return unit
        torque = _TORQUE * limits_of(unit).torque
        servo = ServoDrive("drive", unit.drive.inertia, 0.8, 16.0, torque)  # gains as the description's defaults
        changed: HydraulicUnit = replace(unit, drive=servo)  # type: ignore[type-var]
        return changed

    @property
    def report(self) -> DriveReport:
        """What it reports: with the noise, and in the steps, that are declared."""
        return DriveReport(speed_noise=self.response.speed_noise, speed_step=self.response.speed_step)

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
        response(command_delay=0.04, report_delay=0.04, bandwidth=10.0, order=2, acceleration=300.0, lost=0.02)
    ),
}


def loop(unit: HydraulicUnit, drive: Drive, start: float, seed: int, **setting: Any) -> UnitLoop:
    """A unit with a drive, told where it is, as a share of its stroke; with more of a `LoopSettings`."""
    driven = drive.of(unit)
    common = {"known": True, "seed": seed, "period": drive.period, "drive": drive.response, "report": drive.report}
    load = _LOAD * limits_of(unit).load
    return UnitLoop(driven, driven, start * unit.cylinder.stroke, load, LoopSettings(**common | setting))


def targets(unit: HydraulicUnit, seed: int) -> Iterator[float]:
    """Targets drawn at random [m], without end."""
    random = np.random.default_rng([seed, 11])
    while True:
        yield float(random.uniform(*_INSIDE)) * unit.cylinder.stroke


def moved(unit: HydraulicUnit, drive: Drive, seed: int = 0) -> dict[str, Any]:
    """`TARGETS` moves with references as they are due, at either end; one stop is gone on from, a second one ends it.

    Returns:
        How many arrived, errors of rod and sensor [m], visits, time [s], and what stopped it, if anything.
    """
    name, errors, sensed, stopped = unit.name, [], [], ""
    renewing = Referencing({name: (Visit(lifted=False), Visit(lifted=True))})
    run = loop(unit, drive, 0.5, seed, referencing=renewing)
    for _, target in zip(range(TARGETS), targets(unit, seed), strict=False):
        run.go({name: target})
        if run.stopped:
            if stopped:
                break
            stopped = run.reasons[name]
            continue
        errors.append(abs(run.now.position[name] - target))
        sensed.append(abs(run.records[name].estimate[-1].position - run.now.position[name]))
    return {
        "reached": len(errors),
        "p95": float(np.percentile(errors, 95)) if errors else None,
        "largest": max(errors, default=None),
        "sensor_p95": float(np.percentile(sensed, 95)) if sensed else None,
        "visits": len(run.visited),
        "time": run.now.time,
        "stopped": stopped,
    }


def asked(random: np.random.Generator, period: float) -> Iterator[float]:
    """Motor speeds as moves have them, without end [rad/s]: ramps to a speed and back, times of it, rests.

    Every other time a command trembles as that of a sensor does, else it stands as that of a hand.
    """
    speed = 0.0
    while True:
        goal = float(random.choice([0.0, 1.0]) * random.uniform(-300.0, 300.0))
        step = float(random.uniform(50.0, 600.0)) * period
        while speed != goal:
            speed = min(speed + step, goal) if goal > speed else max(speed - step, goal)
            yield speed
        trembles = TREMBLE * float(random.choice([0.0, 1.0])) * (goal != 0.0)
        for _ in range(int(random.uniform(0.2, 5.0) / period)):
            yield speed + trembles * float(random.standard_normal())


class Watched:
    """A drive under the watch alone, without a plant, told motor speeds as moves have them.

    Args:
        unit: whose drive it is.
        drive: as it is declared.
        noisy: whether its reports have the noise that is declared, or none.
        seed: of the speeds.
    """

    def __init__(self, unit: HydraulicUnit, drive: Drive, *, noisy: bool = True, seed: int = 2) -> None:
        self.watch, self._period = DriveWatch(unit, drive.response, drive.period), drive.period
        how = drive.report if noisy else replace(drive.report, speed_noise=0.0)
        self._live, self._speeds = LiveDrive(drive.response, drive.period, how), asked(_random(seed), drive.period)
        self._speed, self._samples = 0.0, 0

    def go(self, hours: float, commands: Iterator[float] | None = None) -> Iterator[Verdict]:
        """Verdicts of so many hours, by the speeds of moves or by other commands [rad/s]."""
        commands = commands or self._speeds
        for _ in range(round(3600.0 * hours / self._period)):
            report = self._live.report(self._period * self._samples, self._speed, 20.0, 313.15)
            verdict = self.watch.missed() if report is None else self.watch.look(report)
            command = next(commands)
            self.watch.command(command)
            self._speed, self._samples = self._live.follow(command), self._samples + 1
            if verdict.stops:
                self.watch.begin()
            yield verdict


def _random(seed: int) -> np.random.Generator:
    return np.random.default_rng(seed)


def watched(unit: HydraulicUnit, drive: Drive, hours: float, *, noisy: bool = True) -> dict[str, float]:
    """Hours under the watch alone: how often it would have stopped the motor, or slowed it down."""
    verdicts = Counter(Watched(unit, drive, noisy=noisy).go(hours))
    stops = sum(count for verdict, count in verdicts.items() if verdict.stops)
    return {"stops": stops, "slow": verdicts[Verdict.SLOW], "hours": hours}


_LEARNED = ("repeats.learned", "repeats.confirmed", "torques", "integral")


def practised(unit: HydraulicUnit, drive: Drive) -> dict[str, float]:
    """What the watch of a drive that has worked for a while has learned of its reports, as states of a control."""
    before = Watched(unit, drive)
    for _ in (*before.go(PRACTICE), *before.go(_RESTED / 3600.0, repeat(0.0))):
        pass
    return {f"watch.{name}": value for name, value in before.watch.state.items() if name.startswith(_LEARNED)}


def worked(unit: HydraulicUnit, drive: Drive, hours: float) -> dict[str, Any]:
    """Hours of moves with the true position, so that nothing but the drive could stop them: moves, hours, stops.

    In runs of a quarter of an hour, each of other targets.
    """
    name, moves, stops, passed = unit.name, 0, 0, 0.0
    for seed in range(1, 1 + math.ceil(hours / RUN_HOURS)):
        run = loop(unit, drive, 0.5, seed, feedback=Feedback.TRUTH)
        ends = 3600.0 * min(hours - passed, RUN_HOURS)
        for target in targets(unit, seed):
            run.go({name: target})
            moves, stops = moves + 1, stops + run.stopped
            if run.now.time > ends:
                break
        passed += run.now.time / 3600.0
        if passed >= hours:
            break
    return {"moves": moves, "hours": passed, "stops": stops}


Changed = Callable[[Reported, Reported], Reported | None]
REPORTS: dict[str, Changed] = {
    "torque lost": lambda now, last: replace(now, motor_torque=math.nan),
    "torque stuck": lambda now, last: replace(now, motor_torque=last.motor_torque),
    "speed stuck": lambda now, last: replace(now, motor_speed=last.motor_speed),
    "speed, wrong sign": lambda now, last: replace(now, motor_speed=-now.motor_speed),
    "speed, half": lambda now, last: replace(now, motor_speed=0.5 * now.motor_speed),
}
RUNS_ON = "motor runs on"
MOTORS: dict[str, Callable[[float, float], float]] = {
    "motor stands": lambda asked, last: 0.0,
    "motor turns the other way": lambda asked, last: -asked,
    "motor half as fast": lambda asked, last: 0.5 * asked,
    RUNS_ON: lambda asked, last: last,
}
SILENT = "no reports"
FAULTS = (*REPORTS, *MOTORS, SILENT)
"""What becomes of reports and commands, given the last before the fault."""


@dataclass(frozen=True)
class Stop:
    """What became of a fault, from the fault on [s]; None is what never came."""

    noticed: float | None = None  # until the control stops
    told: float | None = None  # until its command is at standstill
    stood: float | None = None  # until the motor is, or `told` where a motor turns whatever it is told
    # what a motor needs by its declared acceleration to stand from the speed that it had when the control stopped,
    # beyond the time in which the command comes to rest
    ramp: float = 0.0
    # from when on the motor's speed, or its report, was off by more than the declared deviation, until the control
    # stopped: before, nothing is wrong but by name
    wrong: float | None = None

    @property
    def since(self) -> float | None:
        """Until the command's standstill, from when something was wrong."""
        return (
            None if self.told is None else self.told - min(self.told if self.wrong is None else self.wrong, self.told)
        )


class Broken:
    """A fault in mid-move.

    Args:
        unit: that moves.
        drive: its drive.
        kind: of `FAULTS`.
        going: time from the command to the fault [s].
    """

    def __init__(self, unit: HydraulicUnit, drive: Drive, kind: str, going: float) -> None:
        self._unit, self._drive, self._kind = unit, drive, kind
        self.run, self._name, self._wrong = loop(unit, drive, *_begins(unit)), unit.name, False
        control = self.run.controls[unit.name]
        control.state = control.state | _practised(drive.of(unit), drive)
        self.run.rest(_RESTED)
        self.run.send({unit.name: (0.9 if unit.lift_sign > 0.0 else 0.1) * unit.cylinder.stroke})
        self.run.rest(going)
        record = self.run.records[unit.name]
        self._last, self._asked, self._begun = record.reported[-1], record.command[-1], self.run.now.time
        if kind in MOTORS:
            self.run.motor_fault = self._turns
        else:
            self.run.fault = self._reports

    def _reports(self, _: str, now: Reported) -> Reported | None:
        said = None if self._kind == SILENT else REPORTS[self._kind](now, self._last)
        off = 0.0 if said is None else abs(said.motor_speed - now.motor_speed)
        self._wrong = "speed" not in self._kind or off > self._drive.response.deviation
        return said

    def _turns(self, _: str, speed: float) -> float:
        turns = MOTORS[self._kind](speed, self._asked)
        self._wrong = abs(turns - speed) > self._drive.response.deviation
        return turns

    def until_it_stands(self) -> Stop:
        """Go on until the motor stands, or until that is given up."""
        found, run = Stop(), self.run
        while found.stood is None and run.now.time - self._begun < _GIVEN_UP and not (run.done and not run.stopped):
            run.step()
            found = self._after(found, run.now.time - self._begun)
        return found

    def _after(self, found: Stop, passed: float) -> Stop:
        """With what has come by now."""
        run, speed = self.run, abs(self.run.now.motor_speed[self._name])
        if found.noticed is None and self._wrong != (found.wrong is not None):
            found = replace(found, wrong=passed if self._wrong else None)
        if run.stopped and found.noticed is None:
            ramp = max(speed / self._drive.response.acceleration - STOPPING_TIME, 0.0)
            found = replace(found, noticed=passed, ramp=ramp)
        told = run.stopped and run.controls[self._name].done
        if told and found.told is None:
            found = replace(found, told=passed)
        stands = told and (self._kind == RUNS_ON or speed < _STANDS)
        return replace(found, stood=passed) if stands else found


def _begins(unit: HydraulicUnit) -> tuple[float, int]:
    """Share of the stroke where a move that lifts begins, and the seed."""
    return (0.1 if unit.lift_sign > 0.0 else 0.9), 0


@cache
def _practised(unit: HydraulicUnit, drive: Drive) -> dict[str, float]:
    return practised(unit, drive)


def broken(unit: HydraulicUnit, drive: Drive, kind: str, going: float) -> Stop:
    """What becomes of a fault in mid-move, a time after the command [s]."""
    return Broken(unit, drive, kind, going).until_it_stands()


def loader(drive: Drive, seeds: int) -> dict[str, Any]:
    """The loader on its data sheet, referenced once: as `loader_control` has it, with a drive.

    Targets and noise go by the seed alone, whatever the drive. All targets count together; `groups` has the p95 of
    those of every `LOADER_GROUP` seeds, which says how much of a difference is chance.
    """
    sheet: LinkedMachine = build_linked(machine.load_machine("mining-loader"))
    how = {"drive": drive.response, "report": drive.report}
    found = [arrivals(sheet, sheet, references=1, seed=seed, assumptions=KNOWN, **how) for seed in range(seeds)]
    groups = [found[k : k + LOADER_GROUP] for k in range(0, seeds, LOADER_GROUP)]
    drawn = seeds * LOADER_TARGETS
    return {**summed([*chain(*found)]), "drawn": drawn, "groups": [summed([*chain(*group)])["p95"] for group in groups]}


LOADER = ("ideal", *(f"{n} sample{'s' * (n > 1)} late" for n in (1, 2, 3, 5)))


def study(
    advance: Callable[[float], object] = lambda _: None, hours: float = HOURS, seeds: int = LOADER_SEEDS
) -> dict[str, Any]:
    """All of it.

    Args:
        advance: called with 1 after each of `runs()` runs.
        hours: of motor speeds under the watch alone, with each drive, with its noise and without; or of moves.
        seeds: of the loader's targets and of the noise, the same for each drive.
    """
    found: dict[str, Any] = {"moves": {}, "worked": {}, "watched": {}, "silent": {}, "faults": {}, "loader": {}}
    units = {name: catalogued(*of) for name, of in UNITS.items()}
    for label, drive in DRIVES.items():
        found["moves"][label] = {name: moved(unit, drive) for name, unit in units.items()}
        # What a torque does to a speed, only a plant says.
        found["worked"][label] = worked(units["bucket"], drive, hours if drive.limited else LOOP_HOURS)
        if not drive.limited:
            found["watched"][label] = watched(units["bucket"], drive, hours)
            found["silent"][label] = watched(units["bucket"], drive, hours, noisy=False)
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


def slowest(cases: list[Stop]) -> dict[str, float | None]:
    """The slowest of several cases [s], None without any; how many never stood.

    `stood_less_ramp` leaves out what a motor needs by its declared acceleration.
    """
    found: dict[str, float | None] = {}
    for key in ("noticed", "told", "stood", "since", "ramp"):
        there = [getattr(case, key) for case in cases if getattr(case, key) is not None]
        found[key] = max(there, default=None)
    less = [case.stood - case.ramp for case in cases if case.stood is not None]
    never = sum(case.stood is None for case in cases)
    return found | {"stood_less_ramp": max(less, default=None), "never": never}


def runs() -> int:
    """How many runs `study` makes."""
    return len(DRIVES) + len(LOADER)


def table(found: dict[str, Any]) -> list[str]:
    """How drives move the units."""
    ideal = found["moves"]["ideal"]
    head = [
        "| drive | targets reached | rod less target, p95: median, worst unit [mm] | largest | sensor, p95: worst unit "
        "| visits | time over the ideal drive's | stops by the sensor | false stops | in hours | without the noise |"
    ]
    sensors = {status.text for status in Status}
    rows = []
    for label, units in found["moves"].items():
        p95, sensor = ([1e3 * u[key] for u in units.values() if u["reached"]] for key in ("p95", "sensor_p95"))
        reached, asked_for = sum(unit["reached"] for unit in units.values()), TARGETS * len(units)
        largest = 1e3 * max(unit["largest"] or 0.0 for unit in units.values())
        slower = np.median([unit["time"] / ideal[name]["time"] for name, unit in units.items() if not unit["stopped"]])
        alone, silent = (found[key].get(label, {"stops": 0, "hours": 0.0}) for key in ("watched", "silent"))
        said = [unit["stopped"] for unit in units.values() if unit["stopped"]]
        lost = sum(reason in sensors for reason in said)
        stops = len(said) - lost + found["worked"][label]["stops"] + alone["stops"]
        loops = found["worked"][label]["hours"] + sum(unit["time"] for unit in units.values()) / 3600.0
        visits = sum(unit["visits"] for unit in units.values())
        without = f"{silent['stops']} in {silent['hours']:.0f}" if silent["hours"] else "–"
        rows.append(
            f"| {label} | {reached} of {asked_for} | {np.median(p95):.2f}, {max(p95):.2f} | {largest:.2f} "
            f"| {max(sensor):.2f} | {visits} | {slower:.2f} | {lost} | {stops} "
            f"| {loops:.2f} + {alone['hours']:.0f} | {without} |"
        )
    return [*head, "|---" * 11 + "|", *rows]


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
    return lines or ["- none"]


SINCE = {f"{kind}, from when it shows": kind for kind in ("speed stuck", RUNS_ON)}
"""Faults that are none before the command changes: the report is right, the motor does as it was told."""


def fault_table(found: dict[str, Any]) -> list[str]:
    """How soon faults stop each drive's motor: standstill of the slowest unit, running up and at full speed [s].

    Bold is what is longer than `STANDSTILL`, the drive's latency, and what its motor needs by its own ramp.
    """
    rows = [_row(kind, found, lambda of, kind=kind: _slowest(of, kind, "stood", "stood_less_ramp")) for kind in FAULTS]
    ramps = _row(
        "*and the ramp of the motor*", found, lambda of: ", ".join(f"{_ramp(of, words):.2f}" for words in GOING)
    )
    return [*_head(found), *rows, _allowed(found), ramps]


def command_table(found: dict[str, Any]) -> list[str]:
    """The same until the control's command is at standstill, which is all that a control can do."""
    rows = [_row(kind, found, lambda of, kind=kind: _slowest(of, kind, "told", "told")) for kind in FAULTS]
    since = [
        _row(words, found, lambda of, kind=kind: _slowest(of, kind, "since", "since")) for words, kind in SINCE.items()
    ]
    return [*_head(found), *rows, *since, _allowed(found)]


NOISES = (0.5, 1.0, 2.0, 4.0, 10.0)  # steps of the reported speed


def repeat_table(_: dict[str, Any]) -> list[str]:
    """How long it takes until a stuck speed is told from one that repeats by chance, by the noise that it had."""
    rows = [
        "| noise [steps] | repeats by chance | so many in a row are an alarm | to the command's standstill [s] |",
        "|---" * 4 + "|",
    ]
    for noise in NOISES:
        count, period = repeats_in_a_row(noise, 1.0, SAMPLE_PERIOD), SAMPLE_PERIOD
        rows.append(f"| {noise:g} | {repeats(1, noise, 1.0):.3f} | {count} | {count * period + STOPPING_TIME:.2f} |")
    return rows


def longer(found: dict[str, Any]) -> list[str]:
    """Which faults take longer than is allowed until the motor stands, and by how much, by phase."""
    lines = []
    for words in GOING:
        cases = []
        for kind in FAULTS:
            late = {label: over for label, of in found["faults"].items() if (over := _over(of, kind, words)) > _TRIFLE}
            if late:
                cases.append(f"{kind} {', '.join(f'{over:.2f} s ({label})' for label, over in late.items())}")
        lines.append(f"- {words}: {'; '.join(cases) or 'none'}")
    return lines


def _over(of: dict[str, Any], kind: str, words: str, key: str = "stood_less_ramp") -> float:
    """Time by which a fault takes longer than is allowed [s]."""
    took = of["kinds"][kind][words][key]
    return (_GIVEN_UP if took is None else took) - STANDSTILL - of["latency"]


def _ramp(of: dict[str, Any], words: str) -> float:
    return max(kind[words]["ramp"] for kind in of["kinds"].values())


def _row(name: str, found: dict[str, Any], cell: Callable[[dict[str, Any]], str]) -> str:
    return f"| {name} | {' | '.join(cell(of) for of in found['faults'].values())} |"


def _head(found: dict[str, Any]) -> list[str]:
    return [f"| fault | {' | '.join(found['faults'])} |", "|---" * (len(found["faults"]) + 1) + "|"]


def _allowed(found: dict[str, Any]) -> str:
    return _row(f"*{STANDSTILL:g} s and the latency*", found, lambda of: f"{STANDSTILL + of['latency']:.2f}")


def _slowest(of: dict[str, Any], kind: str, key: str, judged: str) -> str:
    """Both phases of a fault: the times `key`, bold where those of `judged` are longer than is allowed."""
    cells = []
    for words, case in of["kinds"][kind].items():
        bold = "**" * (_over(of, kind, words, judged) > _TRIFLE)
        time = "never" if case[key] is None else f"{case[key]:.2f}"
        cells.append(f"{bold}{time}{bold}" + "\\*" * bool(case["never"]))
    return ", ".join(cells)


def loader_table(found: dict[str, Any]) -> list[str]:
    """The loader on its data sheet; of some of its targets at a time, where there are more than those."""
    grouped = any(len(row.get("groups", ())) > 1 for row in found["loader"].values())
    heads = ["drive", "targets", "rod, p95 [mm]", *(["of every 60"] if grouped else []), "over the ideal drive's"]
    rows = [f"| {' | '.join([*heads, 'largest [mm]', 'tip, p95 [mm]'])} |", "|---" * (len(heads) + 2) + "|"]
    for label, row in found["loader"].items():
        over, p95s = row["p95"] / found["loader"]["ideal"]["p95"], row.get("groups", ())
        spread = [f"{1e3 * min(p95s):.2f} to {1e3 * max(p95s):.2f}"] if grouped else []
        reached = f"{row['targets']} of {row['drawn']}" if grouped else str(row["targets"])
        cells = [
            label,
            reached,
            f"{1e3 * row['p95']:.2f}",
            *spread,
            f"{over:.2f}",
            f"{1e3 * row['largest']:.2f}",
        ]
        rows.append(f"| {' | '.join(cells)} | {1e3 * row['tip_p95']:.2f} |")
    return rows
