"""A rig in a process of its own: it keeps time, takes commands through a pipe and sends back what happened."""

from __future__ import annotations

import gc
import math
import os
import time
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from multiprocessing.connection import Connection
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ramsight.duty.live_energy import EnergyAccount
from ramsight.errors import DescriptionError, RamsightError
from ramsight.machine import load_machine
from ramsight.machine.as_toml import as_toml
from ramsight.machine.description import Machine
from ramsight.normal import TWO_SIDED_95
from ramsight.plant.hose import Hose
from ramsight.plant.pump import Pump
from ramsight.plant.unit import HydraulicUnit
from ramsight.plant.valve import ReliefValve
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import Estimate
from ramsight.studio.draft import Problem, problem
from ramsight.studio.first_start import make
from ramsight.studio.knobs import LIE, SECOND
from ramsight.studio.marks import Mark
from ramsight.studio.rig import Rig, Row
from ramsight.studio.said import LEVELS, of_estimate, of_verdict
from ramsight.studio.scenarios import SCENARIOS, Storyteller
from ramsight.units import FREEZING, RPM

_FRAME = 1.0 / 30.0  # s, from one frame to the next
_ALIVE = 0.5  # s, after which a machine that has no frame says that it is there
_SMOOTH = 0.1  # share of a frame in how fast the machine is said to run
_ROWS = 8  # of a frame, at most: of a faster machine only every nth sample is sent
_ENERGY = 0.3  # s, from one look at the energy accounts to the next
_KNOWN = 0.2  # s, from one look at what the sensors know to the next
_BEHIND = 0.5  # s; whoever is later than that runs slower than it should, and does not catch up
FASTEST = 50.0  # times faster than life


@dataclass
class Frame:
    """What happened since the last one, as plain values that a page can have; NaN is None."""

    # by unit and name, in the units that people read; `time` is common
    columns: dict[str, Any] = field(default_factory=dict)
    # by unit: pressures of nodes [bar], openings of valves [1] and flows of parts [l/min] now
    circuit: dict[str, dict[str, float]] = field(default_factory=dict)
    # by unit and sensor, the fields of `said.Said`
    status: dict[str, dict[str, dict[str, str]]] = field(default_factory=dict)
    factor: float = 0.0  # times faster than life that it really runs
    energy: dict[str, Any] = field(default_factory=dict)  # by unit, as `energy.flows`; empty in most frames
    # by unit, as `Known.look` of its kalman sensor, with the true place then; empty in most frames
    known: dict[str, Any] = field(default_factory=dict)
    load: float = 0.0  # on the unit [N], or what the mechanism carries [kg]
    lifts: dict[str, Any] = field(default_factory=dict)  # what was weighed, as `Lifts.shown`; empty in most frames
    # temperatures of the oil in the pumps and in the tank [°C], by unit
    oil: dict[str, list[float]] = field(default_factory=dict)
    marks: list[Mark] = field(default_factory=list)  # what has happened at one time, as `marks.Mark`
    begun: int = 0  # how often the machine has begun again
    telling: dict[str, Any] | None = None  # how far the scenario is, as `scenarios.Telling`; None if none plays
    # what knobs, faults, duty cycle, speed-up and sensors are now
    settings: dict[str, Any] = field(default_factory=dict)


def run(pipe: Connection, machine: Machine | str) -> None:
    """Let a machine run until the pipe's other end closes or says stop."""
    try:
        described = machine if isinstance(machine, Machine) else load_machine(machine)
        rig = _ready(pipe, described)
        pipe.send(("ready", _about(rig)))
        _Clock(rig, pipe, described).go_on()
    except (EOFError, BrokenPipeError, ConnectionResetError, KeyboardInterrupt):
        return
    except RamsightError as error:
        _last_words(pipe, str(error), problem(error) if isinstance(error, DescriptionError) else None)


def _ready(pipe: Connection, described: Machine) -> Rig:
    """A machine that has made its first sample, with all that it needs compiled."""
    gc.disable()  # a quarter of the time that a graph takes
    try:
        with suppress(RamsightError):  # the machine itself has the last word
            make(described, lambda text: pipe.send(("making", text)))
        rig = Rig(described)
        rig.step()
    finally:
        gc.enable()
    return rig


def _last_words(pipe: Connection, text: str, wrong: Problem | None) -> None:
    try:
        pipe.send(("ended", (text, wrong)))
    except OSError:
        return


def _about(rig: Rig) -> dict[str, Any]:
    """What the page has to know of a machine."""
    strokes = {name: unit.cylinder.stroke for name, unit in rig.sheet.items()}
    return {"name": rig.name, "units": list(rig.sheet), "strokes": strokes}


class _Clock:
    """Steps a rig so that its time goes by a factor faster than ours."""

    def __init__(self, rig: Rig, pipe: Connection, described: Machine) -> None:
        self.rig, self.pipe, self.described, self.factor = rig, pipe, described, 1.0
        self.begun, self.steps, self.sent, self.accounted, self.looked = time.perf_counter(), 0, 0.0, 0.0, 0.0
        self.rows: list[dict[str, Row]] = []
        self.ran, self.restarts, self.spoke, self.due = 0.0, 0, 0.0, 0.0
        self.story: Storyteller | None = None

    def go_on(self) -> None:
        """Run until a stop is requested."""
        while self._take_commands():
            now = time.perf_counter()
            due = int((now - self.begun) * self.factor / self.rig.period) - self.steps
            if due * self.rig.period > _BEHIND * max(self.factor, 1.0):
                self._from_now(now)
                due = 1
            until = now + _FRAME
            for _ in range(due):
                self.rows.append(self.rig.step())
                self.steps += 1
                if self.story is not None:
                    self.story.look(self.rows[-1])
                if time.perf_counter() > until:
                    break
            if self.rows and now >= self.due:
                self.pipe.send(("frame", self._frame(now)))
                self.sent, self.due = now, max(self.due + _FRAME, now)  # as often as said, whatever a turn takes
            elif now - max(self.sent, self.spoke) >= _ALIVE:
                self.pipe.send(("alive", None))
                self.spoke = now
            time.sleep(0.004)

    def _from_now(self, now: float) -> None:
        self.begun, self.steps = now, 0

    def _take_commands(self) -> bool:
        """Take commands; whether to go on."""
        while self.pipe.poll(0.25 if self.factor == 0.0 else 0.0):
            what, *values = self.pipe.recv()
            match what:
                case "lever":
                    self._lever(values[0], float(values[1]))
                case "scenario":
                    self._begin(values[0])
                case "knobs":
                    self._turn(values[0])
                case "fault":
                    self.rig.fault(values[0], on=values[1])
                case "refer":
                    self.rig.refer(values[0], LIE if values[1] else 0.0)
                case "sense":
                    self._sense(values[0], on=values[1])
                case "play":
                    self._play(values[0])
                case "hold oil":
                    self.rig.hold_oil(on=values[0])
                case "account":
                    self.rig.begin_account()
                case "save":
                    self._save(values[0])
                case "start":
                    self.rig.start_sensors(off=float(values[0]) if values else 0.0)
                case "factor":
                    self._set_factor(float(values[0]))
                case "stop":
                    return False
        return True

    def _lever(self, unit: str, value: float) -> None:
        """Move a lever; a hand on it ends what plays."""
        if value != 0.0 and self.rig.duty is not None:
            self._play(None)
        self.rig.levers[unit] = min(max(value, -1.0), 1.0)

    def _turn(self, knobs: dict[str, float]) -> None:
        """Turn knobs; what the machine cannot have is said, and it stays as it was."""
        try:
            self.rig.turn(replace(self.rig.knobs, **knobs))
        except RamsightError as error:
            self.pipe.send(("refused", str(error)))

    def _play(self, duty: str | None) -> None:
        """Play a duty cycle, or nothing; a scenario that has not ended does so without its words to the end."""
        self.rig.play(duty)
        if self.story is not None and not self.story.over:
            self.story = None

    def _begin(self, name: str | None) -> None:
        """Play a scenario from its beginning, or begin again with nothing that plays; time stands meanwhile."""
        if name is None:
            self.story = None
            self.rig.begin()
        else:
            self.story = Storyteller(self.rig, name, SCENARIOS[name])
        self.rows, self.restarts = [], self.restarts + 1
        self._set_factor(1.0 if name is None else SCENARIOS[name].pace)

    def _set_factor(self, factor: float) -> None:
        self.factor = min(max(factor, 0.0), FASTEST)
        self._from_now(time.perf_counter())

    def _sense(self, kind: str, *, on: bool) -> None:
        """Switch a sensor; time stands while it is made."""
        try:
            self.rig.sense(kind, on=on)
        except RamsightError as error:
            self.pipe.send(("refused", str(error)))
        self.rows = []  # of one kind of columns
        self._from_now(time.perf_counter())

    def _save(self, unit: str) -> None:
        """Hand out the log of a unit's drive with its truth; time stands meanwhile, of an hour for some seconds."""
        with ThreadPoolExecutor(1) as pool:
            made = pool.submit(self._packed, unit)
            while not wait([made], _ALIVE).done:
                self.pipe.send(("alive", None))
            self.pipe.send(("saved", (unit, made.result())))
        self._from_now(time.perf_counter())

    def _packed(self, unit: str) -> bytes | str:
        """The run of a unit as a ZIP file, or why there is none."""
        toml = "\n".join(as_toml(self.described, self.described.sources)).strip() + "\n"
        folder = ""
        try:
            with TemporaryDirectory() as folder:
                path = Path(folder) / "run.zip"
                self.rig.recorders[unit].save(path, unit, toml)
                return path.read_bytes()
        except RamsightError as error:
            return str(error).replace(f"{folder}{os.sep}", "")
        except OSError as error:  # its text names a folder of the server
            return f"{unit}: the run cannot be saved: {error.strerror or 'no file can be written'}"

    def _frame(self, now: float) -> Frame:
        every = max(math.ceil(len(self.rows) / _ROWS), 1)
        kept, last = self.rows[every - 1 :: every] or self.rows[-1:], self.rows[-1]
        frame = Frame()
        for name in self.rig.sheet:
            frame.columns[name] = _columns([row[name] for row in kept], self.rig.sheet[name].cylinder.stroke)
            frame.circuit[name] = self._circuit(name)
            frame.status[name] = _said(self.rig, name, last[name])
        first = next(iter(self.rig.sheet))
        frame.columns["time"] = [round(row[first].time, 3) for row in kept]
        self.ran += _SMOOTH * (len(self.rows) * self.rig.period / max(now - self.sent, _FRAME) - self.ran)
        frame.factor, frame.load = self.ran, round(self.rig.load, 1)
        frame.oil = {name: [_celsius(oil.pumps), _celsius(oil.tank)] for name, oil in self.rig.oil.items()}
        if now - self.accounted >= _ENERGY:
            self.accounted = now
            frame.energy = {name: flows(self.rig.sheet[name], account) for name, account in self.rig.accounts.items()}
        if now - self.looked >= _KNOWN:
            self.looked = now
            frame.known = {name: self._known(name, row) for name, row in last.items()}
            frame.lifts = {} if self.rig.lifts is None else self.rig.lifts.shown
        frame.marks = self.rig.marks.taken()
        frame.begun, frame.telling = self.restarts, None if self.story is None else self.story.telling
        frame.settings = {"knobs": asdict(self.rig.knobs), "faults": sorted(self.rig.faults), "duty": self.rig.duty}
        frame.settings |= {"speed": self.factor, "sensors": list(self.rig.sensors[first])}
        frame.settings |= {"holds_oil": self.rig.holds_oil}
        self.rows = []
        return frame

    def _known(self, name: str, row: Row) -> dict[str, Any] | None:
        """What the sensor of a unit knows, and where the piston is then: later it is elsewhere."""
        found = self.rig.known(name, row.time)
        return None if found is None else found | {"true": _number(1e3 * row.position)}

    def _circuit(self, name: str) -> dict[str, float]:
        found = {}
        prefix = f"{name}." if self.rig.linked is not None else ""
        for key, value in self.rig.inside.items():
            if not key.startswith(prefix):
                continue
            key = key.removeprefix(prefix)
            if key.startswith("pressure_"):
                found[key] = round(value / 1e5, 1)
            elif key.endswith(".flow"):
                found[key] = round(value * 60e3, 2)
            elif key.endswith(".opening"):
                found[key] = round(value, 2)
        return found


def _said(rig: Rig, name: str, row: Row) -> dict[str, dict[str, str]]:
    """What is said of a unit's sensors, by kind; `SECOND` is the real one beside them."""
    found = {kind: asdict(of_estimate(row.estimates.get(kind))) for kind in rig.sensors[name]}
    if name in rig.second:
        found[SECOND] = asdict(of_verdict(None if row.second is None else row.second.verdict))
    return found


def _columns(rows: list[Row], stroke: float) -> Mapping[str, list[float | None]]:
    """What the strips show of a unit: mm, rpm, N m and bar."""
    found: dict[str, list[float | None]] = {
        "position": [_number(1e3 * row.position) for row in rows],
        "speed": [_number(row.motor_speed / RPM, 1) for row in rows],
        "torque": [_number(row.motor_torque, 2) for row in rows],
        "pressure_a": [_number(row.pressure_a / 1e5, 1) for row in rows],
        "pressure_b": [_number(row.pressure_b / 1e5, 1) for row in rows],
    }
    for kind in {kind: None for row in rows for kind in row.estimates}:
        said: list[Estimate | None] = [row.estimates.get(kind) for row in rows]
        both = list(zip(said, rows, strict=True))
        found[kind] = [None if one is None else _number(1e3 * one.position) for one in said]
        found[f"{kind}_error"] = [
            None if one is None else _number(1e3 * (one.position - row.position)) for one, row in both
        ]
        found[f"{kind}_band"] = [
            None if one is None else _number(1e3 * TWO_SIDED_95 * one.position_std) for one in said
        ]
        edges = [_edges(one, stroke) for one in said]
        found[f"{kind}_low"], found[f"{kind}_high"] = ([one[side] for one in edges] for side in (0, 1))
        found[f"{kind}_level"] = [LEVELS.index(of_estimate(one).level) for one in said]
    if any(row.second for row in rows):
        shown = [None if row.second is None else row.second.position for row in rows]
        found[SECOND] = [None if at is None else _number(1e3 * at) for at in shown]
        found[f"{SECOND}_error"] = [
            None if at is None else _number(1e3 * (at - row.position)) for at, row in zip(shown, rows, strict=True)
        ]
    return found


def _edges(said: Estimate | None, stroke: float) -> tuple[float | None, float | None]:
    """Ends of the 95 % band [mm], within the stroke [m]: all of it where nothing is known, none without a band."""
    if said is None:
        return None, None
    if said.status is Status.NOT_REFERENCED:
        return 0.0, _number(1e3 * stroke)
    half = TWO_SIDED_95 * said.position_std
    ends = (said.position + side * half for side in (-1.0, 1.0))
    low, high = (_number(1e3 * min(max(end, 0.0), stroke)) if math.isfinite(end) else None for end in ends)
    return low, high


def _celsius(kelvin: float) -> float:
    return round(kelvin - FREEZING, 1)


def _number(value: float, digits: int = 3) -> float | None:
    return round(value, digits) if math.isfinite(value) else None


_OF_PUMPS = {"leakage": "pumps: leakage", "friction": "pumps: friction", "belt": "belts"}
_OF_CYLINDER = {"friction": "cylinder: friction", "stop": "end stops"}
_STORED = "stored, tank and air"


def flows(unit: HydraulicUnit, account: EnergyAccount) -> dict[str, Any]:
    """Energies in kJ, by what people call them.

    Returns:
        `in` and `out`, energies by words, which are the same sum but for `missing`; `regenerated`, what the motor took
        back over what the load gave, and `recovered`, over what the motor gave, None where there was nothing.
    """
    kinds = {part.name: part for part in unit.parts()}
    out = {"load": account.lifted, "back to the drive": account.taken}
    for name, energy in account.losses.items():
        words = _words(kinds, name)
        out[words] = out.get(words, 0.0) + energy
    came = {"drive": account.given, "load comes down": account.lowered}
    kept = sum(account.works.values()) + sum(account.stored.values())
    (out if kept >= 0.0 else came)[_STORED] = abs(kept)
    return {
        "in": {name: _kj(energy) for name, energy in came.items()},
        "out": {name: _kj(energy) for name, energy in out.items()},
        "missing": _kj(account.missing),
        "regenerated": _share(account.taken, account.lowered),
        "recovered": _share(account.taken, account.given),
    }


def _words(kinds: dict[str, Any], loss: str) -> str:
    """What people call a loss of the circuit."""
    name, _, how = loss.partition(".")
    part = kinds.get(name)
    if isinstance(part, Pump):
        return _OF_PUMPS.get(how, "pumps: other")
    if isinstance(part, ReliefValve):
        return "relief valves"
    if isinstance(part, Hose):
        return "hoses"
    if how.endswith("throttling"):
        return "other valves"
    return _OF_CYLINDER.get(how, "cylinder: seal and cushions")


def _kj(energy: float) -> float:
    return round(energy / 1e3, 3) + 0.0


def _share(part: float, whole: float) -> float | None:
    share = part / whole if whole > 1.0 else math.nan  # J; less is nothing that was moved
    return round(share, 4) if math.isfinite(share) else None
