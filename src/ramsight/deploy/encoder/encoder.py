"""The encoder: frames and time in, frames out. It has no clock, no thread and no bus of its own."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from ramsight._version import __version__
from ramsight.deploy.encoder import server
from ramsight.deploy.encoder.alarms import ALARMS, OF_STATUS, WARNINGS, Emergencies, Fault, alarms, register, warnings
from ramsight.deploy.encoder.beside import Beside
from ramsight.deploy.encoder.bus_clock import BusClock
from ramsight.deploy.encoder.frame import Frame
from ramsight.deploy.encoder.listening import Listener, Sample
from ramsight.deploy.encoder.liveness import Liveness
from ramsight.deploy.encoder.objects import COMMUNICATION, ENTRIES, FORGET, LEAST, MOST, NO_TEMPERATURE, RUNNING, STORED
from ramsight.deploy.encoder.parameters import ALL, ParameterFile, Stored
from ramsight.deploy.encoder.saving import Persistence, Saving
from ramsight.deploy.encoder.scale import BY_6005, DOWNWARDS, Published, Scale, counted, whole
from ramsight.deploy.encoder.schedule import HEARTBEAT, PDOS, Schedule, pdo_identifiers
from ramsight.deploy.encoder.second_node import PERIOD, Presence, SecondNode
from ramsight.deploy.encoder.weighings import Weighings
from ramsight.errors import DescriptionError
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor import virtual_sensor
from ramsight.sensor.persistence import STARTED
from ramsight.sensor.status import Status
from ramsight.tool.weigher import Weigher

_NMT, _SYNC = 0x000, 0x080
_JUST_AFTER = 1e-4  # s, from the drive's last sample to a preset, whose frame may have a later stamp than the next
_UNDEFINED_STATUS = 255


@dataclass(frozen=True)
class Settings:
    """Who the encoder is on the bus."""

    node_id: int  # its node-ID, 1 to 127
    drive_node: int | None = None  # the drive's, whose heartbeat 1016h may watch; None if it is nobody's
    serial: int = 0  # its serial number
    overrides: Mapping[tuple[int, int], int] | None = None  # values of the dictionary that count instead of stored ones

    def __post_init__(self) -> None:
        for key, node in (("--node-id", self.node_id), ("--drive-node", self.drive_node)):
            if node is not None and not 1 <= node <= 127:
                raise DescriptionError("is no node-ID", key=key, value=node, allowed="1 to 127")
        if self.node_id == self.drive_node:
            raise DescriptionError("is the drive's", key="--node-id", value=self.node_id, allowed="another one")


class Encoder:
    """A virtual position sensor as a linear encoder of CiA 406.

    Args:
        sensor: a `kalman` sensor.
        unit: the unit it watches.
        listener: what the drive's frames mean.
        settings: who it is.
        persistence: where the sensor's state is saved; None saves it nowhere, and the position is unknown at first.
        parameters: where 1010h stores parameters; None refuses to.
        record: is passed each sample that the sensor takes.
        weigher: of the machine, if the unit lifts what it weighs.

    Every method takes the time by a clock that only runs forward [s], and returns the frames to be sent.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.deploy.encoder.listening import drive_map
        >>> from ramsight.plant.build import build
        >>> from ramsight.sensor.kalman import kalman
        >>> boom = build(machine.load_machine("mining-loader").unit("boom"), "boom")
        >>> encoder = Encoder(kalman(boom), boom, Listener(drive_map(5, rated_torque=35.0)), Settings(node_id=6))
        >>> [str(frame) for frame in encoder.start(0.0)]
        ['706#00', '086#00420901002040FF']
        >>> [str(frame) for frame in encoder.receive(0.05, Frame(0x606, bytes.fromhex("4000100000000000")))]
        ['586#4300100096010800']
    """

    def __init__(
        self,
        sensor: virtual_sensor.VirtualSensor,
        unit: HydraulicUnit,
        listener: Listener,
        settings: Settings,
        *,
        persistence: Persistence | None = None,
        parameters: ParameterFile | None = None,
        record: Callable[[Sample], object] = lambda sample: None,
        weigher: Weigher | None = None,
    ) -> None:
        self._record, self.weighings = record, Weighings(weigher, unit.name)
        self._sensor, self._unit, self._listener, self.settings = sensor, unit, listener, settings
        self._saving = Saving(sensor, persistence)
        self._node = server.Node(settings.node_id, self._read, self._check)
        taken = listener.identifiers | pdo_identifiers(settings.drive_node)
        self._schedule, self._clock = Schedule(self._node, taken), BusClock()
        self._published = Published(unit.max_speed * unit.travel_per_radian)
        self._scale = Scale(self._node, unit.cylinder.stroke, self._published)
        self._emergencies = Emergencies(self._node)
        self._beside = Beside(listener, unit, self._node)
        self._now = 0.0
        self._sample: Sample | None = None
        self._estimate: virtual_sensor.Estimate | None = None
        self._drive = Presence(self._node, settings.drive_node)
        self._second = SecondNode(listener.periodic, unit.max_speed)
        self._alive = Liveness(
            unit.max_speed, listener.sequence, listener.noise, listener.torque_step, unit.drive.inertia
        )
        self._fastest = unit.max_speed * unit.travel_per_radian
        self._stored = Stored(self._node, parameters, settings.overrides or {}, self._save_now, self._refusal)
        self._short = False
        self._missed = False  # samples, while the drive was gone; what the sensor says is from before that
        self._faults: set[Fault] = set()
        self._after_write: list[int] = []
        self._live = self._live_values()
        self._state_damaged = self._saving.damaged

    # ---- what happens -------------------------------------------------------------------------------------------

    def start(self, now: float) -> list[Frame]:
        """Power up at a time [s]: parameters, boot-up message, pre-operational."""
        self._now = now
        self._drive.sampled(now)
        self._reset(ALL)
        return self._out()

    def receive(self, now: float, frame: Frame) -> list[Frame]:
        """Take a frame that came from the bus at a time [s]."""
        self._advance(now)
        kind, data = frame.cob_id, frame.data
        if kind in self._listener.identifiers:
            self._listen(frame)
        elif kind == _NMT:
            self._command(data)
        elif kind == _SYNC:
            if len(data) == 1:
                self._alive.synced(data[0])
            if self._node.state == server.OPERATIONAL and len(data) <= 1:
                self._published.follow(now)
                self._schedule.sync()
        elif kind == 0x600 + self.settings.node_id:
            if len(data) == 8 and self._node.state in (server.PRE_OPERATIONAL, server.OPERATIONAL):
                self._serve(data)
        elif self.settings.drive_node is not None and kind == HEARTBEAT + self.settings.drive_node and len(data) == 1:
            self._drive.alive(now, data[0])
            self._look()
        return self._out()

    def advance(self, now: float) -> list[Frame]:
        """Do whatever is due by now [s]."""
        self._advance(now)
        return self._out()

    @property
    def due(self) -> float:
        """When `advance` has something to do next [s]."""
        emergencies = self._emergencies.due(self._faults)
        return min(self._schedule.due, self._drive.due, emergencies, self._saving.due, self._second.due)

    def stop(self) -> None:
        """Power down in order: a position at rest is saved."""
        self._save()
        self._saving.close()

    # ---- what it knows ------------------------------------------------------------------------------------------

    @property
    def faults(self) -> frozenset[Fault]:
        """The faults that there are now."""
        return frozenset(self._faults)

    @property
    def valid(self) -> bool:
        """Whether the position is valid."""
        return self._published.valid

    @property
    def position(self) -> float:
        """The last valid position, as published [m]; NaN if there never was one."""
        self._published.follow(self._now)
        return self._published.position

    @property
    def std(self) -> float:
        """Standard deviation of the position [m]; infinite if it is unknown."""
        std = math.nan if self._estimate is None else self._estimate.position_std
        return math.inf if math.isnan(std) else math.hypot(std, self._unseen / math.sqrt(3.0)) + self._published.behind

    @property
    def bound(self) -> float:
        """What the position's error exceeds once in 100 000 samples without a warning [m]; infinite if unknown."""
        bound = self._sensor.says(virtual_sensor.BOUND)
        return math.inf if math.isnan(bound) else bound + self._unseen + self._published.behind

    @property
    def load(self) -> float:
        """Load on the cylinder, positive against lifting [N]; NaN before the first sample."""
        return math.nan if self._estimate is None else self._estimate.load

    @property
    def load_std(self) -> float:
        """Standard deviation of the load [N]; NaN if it is unknown."""
        return self._sensor.says(virtual_sensor.LOAD_STD)

    @property
    def load_age(self) -> float:
        """Time since the torque has shown the load [s]; NaN if it never has."""
        return self._sensor.says(virtual_sensor.LOAD_AGE)

    @property
    def _unseen(self) -> float:
        """How far the piston may have moved at most while reports that were used may have been old [m]."""
        return self._fastest * self._alive.age

    @property
    def referenced(self) -> bool:
        """Whether a reference has come since power-up."""
        return self._sensor.state.get(virtual_sensor.REFERENCED_NOW, 0.0) > 0.5

    @property
    def velocity(self) -> float:
        """Velocity of the piston [m/s]; NaN before the first sample."""
        return math.nan if self._estimate is None else self._estimate.velocity

    @property
    def stroke(self) -> float:
        """Stroke of the cylinder [m]."""
        return float(self._unit.cylinder.stroke)

    @property
    def said(self) -> str:
        """The position in words, or why there is none."""
        if self.valid:
            return f"position {1e3 * self.position:.1f} mm"
        wrong = [fault.text for fault in Fault if fault in self._faults]
        return "; ".join([*wrong, *filter(None, [self._saving.failure])]) or "no sample of the drive yet"

    # ---- time ---------------------------------------------------------------------------------------------------

    def _advance(self, now: float) -> None:
        self._now = max(now, self._now)
        now = self._now
        if self._saving.rests(now):
            self._save()
        changed = self._saving.check(now)
        changed = self._second.check(now) or changed
        if self._drive.check(now) or changed:
            self._look()
        self._emergencies.tell(self._now, self._faults, self.status)
        if self._node.state == server.OPERATIONAL:
            self._published.follow(now)
        self._schedule.tick(now)

    # ---- the drive ----------------------------------------------------------------------------------------------

    def _listen(self, frame: Frame) -> None:
        sent = self._clock.time(frame.time, self._now)
        whole_frame = self._listener.take(frame, sent, self._now)
        speed = self._listener.speed if whole_frame else math.nan
        came = sent - self._clock.stood  # no frames are missing of a time in which nobody listened
        if self._second.take(frame.cob_id, came, speed, period=1e-4 * self._node.get(*PERIOD)):
            self._saving.forget()  # what it has said may have moved the position already
            self._look()
        if self._short == whole_frame:
            self._short = not whole_frame
            self._look()
        sample = self._listener.sample(self._now) if whole_frame else None
        if sample is None:
            return
        report = self._listener.report(sample)
        report = replace(report, sent=report.sent - self._clock.stood)  # its number says whether time has passed
        if self._alive.take(report, self._second.period_of(frame.cob_id)):
            self._saving.forget()  # reports that were old have been used
        if self._second.is_there or not self._alive.is_new() or self._drive.gone:  # nobody knows whose it is, or when
            self._missed = self._missed or self._drive.gone
            self._drive.sampled(self._now)
            self._look()
        else:
            self._step(sample)

    def _step(self, sample: Sample, *, preset: bool = False) -> None:
        """Let the sensor take a sample. One whose time does not advance is none: if all are so, the drive is silent."""
        self._saving.begin()
        before = self._sensor.state
        further = {name: value for name, value in sample.further.items() if name in self._sensor.optional}
        estimate = self._sensor.step(
            sample.time, sample.motor_speed, sample.motor_torque, sample.oil_temperature, sample.reference, **further
        )
        if estimate.status is Status.TIME_FROZEN:
            return
        if not preset:
            self._record(sample)
        self._drive.sampled(self._now)
        self._sample, self._estimate, self._missed = sample, estimate, False
        self.weighings.take(sample.time, self._sensor)
        self._beside.compare(self._now, sample, estimate, self._sensor.says(virtual_sensor.BOUND))
        after = self._sensor.state
        if any(after[name] != before[name] for name in (virtual_sensor.TIME, STARTED)):  # else it was passed over
            self._listener.referenced()
        if self._saving.watch(self._now, sample.motor_speed, estimate):
            self._save()
            self._saving.check(self._now)
        self._look(preset=preset)

    def _preset(self, steps: int) -> None:
        """Accept a position that a person enters, or reject it."""
        position, last = self._scale.metres(steps), self._sample
        if not 0.0 <= position <= self._unit.cylinder.stroke:
            server.refuse(server.INVALID)
        if (
            last is None or self._drive.lost or self._is_false or self._refused_one
        ):  # whoever insists has to forget the position first
            server.refuse(server.BY_STATE)
        assert last is not None
        sent, warmth = last.time + _JUST_AFTER, self._listener.temperature(self._now)
        self._step(Sample(sent, last.motor_speed, last.motor_torque, warmth, position), preset=True)
        if self._sensor.state[virtual_sensor.TIME] != sent or self._is_disputed:
            server.refuse(server.BY_STATE)
        if not self._saving.moving:
            self._save()

    def _forget(self) -> None:
        """Be unreferenced, on the disk too."""
        forgotten = self._saving.forget()
        self._look()
        if not forgotten:
            server.refuse(server.NOT_STORED)

    # ---- what is wrong ------------------------------------------------------------------------------------------

    def _look(self, *, preset: bool = False) -> None:
        """See what is wrong now, publish the position, tell of changes."""
        state, estimate = self._sensor.state, self._estimate
        referenced = state[virtual_sensor.IS_REFERENCED] > 0.5
        self._state_damaged = self._state_damaged and not referenced
        faults = set()
        if estimate is not None and estimate.status is not Status.OK:
            faults.add(OF_STATUS[estimate.status])
        conditions = {
            Fault.NOT_REFERENCED: not referenced,
            Fault.REFUSED: self._is_disputed,
            Fault.TEMPERATURE: math.isnan(self._listener.temperature(self._now)),
            Fault.SECOND_NODE: self._second.is_there,
            Fault.STALE: self._alive.is_stale,
            Fault.DISABLED: self._alive.is_disabled,
            Fault.DRIVE_SILENT: self._drive.silent,
            Fault.DRIVE_GONE: self._drive.gone or self._missed,
            Fault.SHORT: self._short,
            Fault.STATE_DAMAGED: self._state_damaged,
            Fault.NOT_SAVED: self._saving.failed,
            Fault.PARAMETERS_DAMAGED: self._stored.damaged,
        }
        if self._drive.silent:
            self._beside.unchecked()
        if self._beside.fault is not None:
            faults.add(self._beside.fault)
        self._faults = faults | {fault for fault, holds in conditions.items() if holds}
        valid = estimate is not None and not alarms(self._faults)
        position = math.nan if estimate is None else estimate.position
        self._published.set(self._now, position, valid, at_once=preset)
        self._emergencies.tell(self._now, self._faults, self.status)

    @property
    def _is_false(self) -> bool:
        """Whether the drive's frames are another's, or old, or of a drive that is not enabled."""
        return self._second.is_there or self._alive.is_stale or self._alive.is_disabled

    @property
    def _is_disputed(self) -> bool:
        """Whether a reference was rejected, and none accepted since; a worse status may hide the sensor's own word."""
        status = None if self._estimate is None else self._estimate.status
        return status is Status.REFERENCE_REFUSED or self._refused_one

    @property
    def _refused_one(self) -> bool:
        """The sensor's own memory of it; the balance and the table have none."""
        return self._sensor.state.get(virtual_sensor.DISPUTED, 0.0) > 0.5

    @property
    def status(self) -> int:
        """Number of the sensor's status."""
        return _UNDEFINED_STATUS if self._estimate is None else int(self._estimate.status)

    # ---- the network --------------------------------------------------------------------------------------------

    def _command(self, data: bytes) -> None:
        command = self._node.command(data)
        if command == server.RESET_NODE:
            self._reset(ALL)
        elif command == server.RESET_COMMUNICATION:
            self._reset((COMMUNICATION,))
        elif command:
            self._schedule.restart_pdos(self._now)
            self._look()

    def _reset(self, groups: tuple[str, ...]) -> None:
        """Take stored parameters and boot. The sensor goes on: an absolute encoder knows its position over a reset."""
        stored = self._stored.load(groups)
        self._schedule.link_timers(0x6200 if (0x6200, 0) in stored else 0x1800)
        self._emergencies.forget()
        self._node.boot()
        self._schedule.start(self._now)
        self._look()

    def _out(self) -> list[Frame]:
        sent, self._node.wire.sent = self._node.wire.sent, []
        return sent

    # ---- the object dictionary ----------------------------------------------------------------------------------

    def _serve(self, data: bytes) -> None:
        self._published.follow(self._now)
        self._after_write.clear()
        self._node.request(data)
        for index in self._after_write:  # only once the value is stored
            self._schedule.written(self._now, index)

    def _read(self, index: int, subindex: int) -> int | str | None:
        """Values that change by themselves; None for those that are stored."""
        if index == 0x1003:
            errors = self._emergencies.history
            return len(errors) if subindex == 0 else [*errors, *[0] * 8][subindex - 1]
        if ENTRIES[index, subindex].access == "rw" and index not in (0x1010, 0x1011):
            return None
        if index in (0x1010, 0x1011) and subindex:
            return int(self._stored.is_possible)
        found = self._live.get((index, subindex))
        return None if found is None else found()

    def _live_values(self) -> dict[tuple[int, int], Callable[[], int | str]]:
        scale, stroke, lifts = self._scale, self._unit.cylinder.stroke, self.weighings
        return {
            (0x1001, 0): lambda: register(self._faults),
            (0x100A, 0): lambda: __version__,
            (0x1018, 4): lambda: self.settings.serial,
            (0x2010, 0): lambda: scale.steps(min(self.std, stroke)),
            (0x2011, 0): lambda: self.status,
            (0x2012, 0): lambda: "no sample yet" if self._estimate is None else self._estimate.status.text,
            (0x2013, 0): lambda: 0 if math.isnan(self.load) else whole(self.load, LEAST, MOST),
            (0x2014, 0): lambda: scale.steps(min(self.bound, stroke)),
            (0x2015, 0): lambda: int(self.referenced),
            (0x2016, 0): lambda: counted(self.load_std),
            (0x2017, 0): lambda: counted(1e3 * self.load_age),
            (0x2030, 0): lambda: scale.elsewhere(self._beside.position),
            (0x2031, 0): lambda: self._beside.verdict,
            (0x2040, 0): lambda: MOST if math.isnan(lifts.mass) else whole(lifts.mass, LEAST, MOST),
            (0x2041, 0): lambda: counted(lifts.std),
            (0x2042, 0): lambda: lifts.count % (1 << 16),
            (0x2043, 0): lambda: lifts.quality,
            (0x2044, 0): lambda: counted(lifts.total),
            (0x2045, 0): lambda: counted(lifts.total_std),
            (0x2046, 0): lambda: counted(1e3 * lifts.share, bits=16),
            (0x2047, 0): lambda: counted(1e3 * lifts.share_std, bits=16),
            (0x2048, 0): lambda: lifts.status,
            (0x6002, 0): lambda: scale.steps(stroke),
            (0x6004, 0): lambda: scale.position,
            (0x6030, 1): lambda: scale.speed(self._estimate),
            (0x6400, 1): lambda: scale.area,
            (0x6500, 0): lambda: self._node.get(0x6000),
            (0x6503, 0): lambda: alarms(self._faults),
            (0x6504, 0): lambda: ALARMS,
            (0x6505, 0): lambda: warnings(self._faults),
            (0x6506, 0): lambda: WARNINGS,
            (0x650A, 3): lambda: scale.steps(stroke),
            (0x650B, 0): lambda: self.settings.serial,
        }

    def _check(self, index: int, subindex: int, value: int) -> None:
        """Take a value that is being written, or refuse it."""
        if (index, subindex) in STORED:
            if self._node.state == server.OPERATIONAL and index not in RUNNING:
                server.refuse(server.BY_STATE)
            reason = self._refusal(index, subindex, value)
            if reason:
                server.refuse(reason)
        if index in (0x1010, 0x1011):
            self._stored.write(index, subindex, value)
            self._look()
        elif index == 0x1003:
            if value != 0:
                server.refuse(server.INVALID)
            self._emergencies.history.clear()
        elif index in PDOS:
            self._schedule.check(index, subindex, value)
        elif index == 0x1016:
            self._drive.expect(value)
        elif index == 0x2003:
            if value != FORGET:
                server.refuse(server.NOT_STORED)
            self._forget()
        elif index == 0x2100:
            self._listener.write_temperature(math.nan if value == NO_TEMPERATURE else 0.1 * value, self._now)
            self._look()
        elif index == 0x6003:
            self._preset(value)
        self._after_write.append(index)

    def _refusal(self, index: int, subindex: int, value: int) -> int:
        """The abort code for a parameter that can never have this value; 0 if it can."""
        if index == 0x2001 and self._scale.is_plausible(value):
            return server.INVALID
        if index == 0x6000 and value & ~(BY_6005 | DOWNWARDS):
            return server.INVALID
        return self._schedule.refusal(index, subindex, value)

    # ---- saving -------------------------------------------------------------------------------------------------

    def _save(self) -> None:
        """Save the sensor's state soon. While the drive is silent nothing is known that the file does not say."""
        if not self._drive.silent:
            self._saving.save(self._now)

    def _save_now(self) -> bool:
        """Save it before anything else happens; whether that went well."""
        return self._drive.silent or self._saving.save_now()
