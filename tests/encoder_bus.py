"""A bus without time of its own: a master that knows CiA 406 only, an encoder, and a played drive."""

import json
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import canopen
import numpy as np

import ramsight.deploy.encoder
from ramsight import machine
from ramsight.deploy.encoder import Encoder, Frame, Settings, drive_map, encoder_for
from ramsight.deploy.encoder.objects import NAME
from ramsight.deploy.encoder.played_drive import PlayedDrive
from ramsight.logs.channel_map import load_map
from ramsight.logs.mapped import ChannelMap
from ramsight.plant.ddh import DdhUnit, build_ddh

EDS = Path(ramsight.deploy.encoder.__file__).parent / NAME
NODE, DRIVE, WARM, REAL = 6, 5, 7, 8
RATED = 80.0  # N m
FAULT = 0x7FFF_FFFF
PE, WATCHDOG, NOT_REFERENCED, DUE, COLD = 1, 1 << 2, 1 << 5, 1 << 12, 1 << 14


@cache
def boom() -> DdhUnit:
    return build_ddh("boom", machine.load_machine("mining-loader").unit("boom"))


def usual_map() -> ChannelMap:
    return drive_map(DRIVE, rated_torque=RATED)


def encoder(state: Path | None = None, channel_map: ChannelMap | None = None, **options: object) -> Encoder:
    """An encoder; one of this process that had the same state file has lost its power."""
    if state in _ON:
        lose_power(_ON.pop(state))
    device = encoder_for(boom(), channel_map or usual_map(), Settings(NODE, DRIVE, serial=4711, **options), state)
    if state is not None:
        _ON[state] = device
    return device


_ON: dict[Path, Encoder] = {}


def lose_power(device: Encoder) -> None:
    """What the system does when a program ends, however it does: its claim of the state file ends."""
    device._saving._file._file.release()


class Master(canopen.Network):
    """A controller on the same bus: whatever it sends is taken by the encoder at once."""

    def __init__(self, device: Encoder, now: float = 0.0) -> None:
        super().__init__()
        self.device, self.now = device, now
        self.seen: list[tuple[float, Frame]] = []
        self.node = self.add_node(NODE, str(EDS))
        self.node.sdo.RESPONSE_TIMEOUT = 0.01
        self.take(device.start(now))

    def take(self, frames: Iterable[Frame]) -> None:
        for frame in frames:
            self.seen.append((self.now, frame))
            self.notify(frame.cob_id, bytearray(frame.data), self.now)

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        self.take(self.device.receive(self.now, Frame(can_id, bytes(data), self.now)))

    def pass_time(self, until: float, each: Callable[[], object] | None = None) -> None:
        """Let time pass: everything happens just when it is due."""
        while self.device.due <= until:
            self.now = max(self.device.due, self.now)
            self.take(self.device.advance(self.now))
            if each is not None:
                each()
        self.now = until

    def put(self, at: float, frame: Frame) -> None:
        self.pass_time(at)
        self.take(self.device.receive(at, frame))

    def play(self, frames: Iterable[tuple[float, Frame]], offset: float = 0.0) -> None:
        for at, frame in frames:
            self.put(at + offset, Frame(frame.cob_id, frame.data, at + offset))

    def rest(self, seconds: float, torque: float = 20.0) -> None:
        """A drive that stands under load, every 20 ms."""
        noise = np.random.default_rng(round(self.now * 1e3))
        begin = self.now
        for k in range(1, round(seconds / 0.02) + 1):
            self.put(begin + 0.02 * k, sample(0, torque + noise.normal(0.0, 0.5)))

    def sent(self, cob_id: int, since: float = -1.0) -> list[tuple[float, bytes]]:
        return [(at, frame.data) for at, frame in self.seen if frame.cob_id == cob_id and at >= since]

    @contextmanager
    def configuring(self) -> Iterator[None]:
        """Pre-operational for a while, as parameters need it."""
        before, self.node.nmt.state = self.node.nmt.state, "PRE-OPERATIONAL"
        try:
            yield
        finally:
            self.node.nmt.state = before

    def emergencies(self) -> list[int]:
        return [int.from_bytes(data[:2], "little") for _, data in self.sent(0x80 + NODE)]

    @property
    def position(self) -> int:
        return self.node.sdo[0x6004].raw

    @property
    def alarms(self) -> int:
        return self.node.sdo[0x6503].raw

    @property
    def warnings(self) -> int:
        return self.node.sdo[0x6505].raw


def sample(rpm: int, torque: float) -> Frame:
    share = round(1e3 * torque / RATED)
    return Frame(0x180 + DRIVE, rpm.to_bytes(4, "little", signed=True) + share.to_bytes(2, "little", signed=True))


def bus_map(folder, *pdos, speed='channel = "606Ch", unit = "1/min"', torque='channel = "6077h", rated = "80 N m"',
            temperature='constant = "40 degC"', more=""):  # fmt: skip
    """A map of what a drive sends: of each frame its identifier and its objects."""
    text = f"speed = {{{speed}}}\ntorque = {{{torque}}}\ntemperature = {{{temperature}}}\n{more}"
    text += "".join(f"[[can.pdo]]\ncob_id = {cob_id}\nobjects = {json.dumps(objects)}\n" for cob_id, *objects in pdos)
    (folder / "map.toml").write_text(text)
    return load_map(folder / "map.toml")


OTHER_MAP = f"""
[measured.position]
channel = "6004h"
unit = "mm"
scale = 0.01
hold = "100 ms"
[[can.pdo]]
cob_id = 0x{0x180 + REAL:X}
objects = ["6004h INT32"]
"""


def other_frame(steps: int) -> Frame:
    """What a real position sensor sends, in steps of 10 um."""
    return Frame(0x180 + REAL, steps.to_bytes(4, "little", signed=True))


def played(log: object, **options: object) -> Iterable[tuple[float, Frame]]:
    return PlayedDrive(log, DRIVE, RATED, **options).frames()
