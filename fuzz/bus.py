"""An encoder beside a drive that plays a recorded log, without time of its own."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from frames import DRIVE, NODE, OPERATE, WARM
from judge import START, Judge

_RATED = 80.0  # N m
_OPERATIONAL, _PRE_OPERATIONAL = 5, 127


@dataclass
class Prepared:
    """What the runs share."""

    judge: Judge  # with the sensor, and the truth
    channel_map: Path  # of drive and thermometer
    frames: list[list[Any]]  # of either at each sample of the log
    states: list[dict[str, float]]  # the sensor's after each sample when nobody else is on the bus
    true: list[float]  # where the piston was at each sample [m]


def prepare(folder: Path) -> Prepared:
    """Play the log to an encoder that nobody disturbs."""
    from ramsight.deploy.encoder.played_drive import PlayedDrive, played_map

    judge = Judge()
    (folder / "map.toml").write_text(played_map(DRIVE, WARM, _RATED))
    frames: list[list[Any]] = [[]]
    for _, frame in PlayedDrive(judge.log, DRIVE, _RATED, warm_node=WARM).frames():
        frames[-1].append(frame)
        if frame.cob_id == 0x180 + DRIVE:
            frames.append([])
    true = judge.true(judge.log["time"].values).tolist()
    prepared = Prepared(judge, folder / "map.toml", frames[:-1], [], true)
    bus = Bus(prepared, 0)
    for k in range(len(prepared.frames)):
        bus.sample(k)
        prepared.states.append(judge.sensor.state)
    return prepared


class Bus:
    """An encoder that is operational and knows its position, and what it sends.

    Args:
        prepared: log and sensor.
        first: the sample of the log at which it begins.
        state: a file for its state; None without one.
    """

    def __init__(self, prepared: Prepared, first: int, state: Path | None = None) -> None:
        from ramsight.deploy.encoder import Encoder, Listener, ParameterFile, Persistence, Settings
        from ramsight.logs.channel_map import load_map

        self.prepared, self.now = prepared, prepared.frames[first][-1].time
        self.sensor = prepared.judge.sensor
        self.encoder = Encoder(
            self.sensor, prepared.judge.unit, Listener(load_map(prepared.channel_map)), Settings(NODE, DRIVE),
            persistence=None if state is None else Persistence(state, self.sensor),
            parameters=None if state is None else ParameterFile(state.with_name(state.name + ".parameters")),
        )  # fmt: skip
        if first:
            self.sensor.state = prepared.states[first - 1]
        else:
            self.sensor.start(START, 1e-3)
        self.sent: list[tuple[float, Any]] = []
        self._keep(self.encoder.start(self.now))
        self.send(0, OPERATE)
        warm = [one.data for frames in prepared.frames[: first + 1] for one in frames if one.cob_id == 0x180 + WARM]
        self.send(0x180 + WARM, warm[-1])

    def send(self, identifier: int, data: bytes) -> list[Any]:
        """Send a frame now; what is answered at once."""
        from ramsight.deploy.encoder import Frame

        return self.put(self.now, Frame(identifier, data, self.now))

    def put(self, at: float, frame: Any) -> list[Any]:
        """Let time pass up to a frame, and take that; what is answered at once."""
        while self.encoder.due <= at:
            self.now = max(self.now, self.encoder.due)
            self._keep(self.encoder.advance(self.now))
        self.now = max(self.now, at)
        answers = self.encoder.receive(self.now, frame)
        self._keep(answers)
        return answers

    def ask(self, data: bytes) -> list[Any]:
        """Send an SDO request now; the answers."""
        return [one for one in self.send(0x600 + NODE, data) if one.cob_id == 0x580 + NODE]

    def sample(self, k: int) -> None:
        """The drive's sample and whatever it sends with it, at their time."""
        for frame in self.prepared.frames[k]:
            self.put(frame.time, frame)

    @property
    def is_running(self) -> bool:
        """Whether the node is operational."""
        return self.encoder._node.state == _OPERATIONAL

    @property
    def serves(self) -> bool:
        """Whether the node answers SDO requests."""
        return self.encoder._node.state in (_OPERATIONAL, _PRE_OPERATIONAL)

    def parameters(self) -> dict[tuple[int, int], int]:
        """What 1010h would store, without the limits that may be written at any time."""
        from ramsight.deploy.encoder.objects import RUNNING, STORED

        return {key: self.encoder._node.get(*key) for key in STORED if key[0] not in RUNNING}

    def _keep(self, frames: list[Any]) -> None:
        self.sent += [(self.now, frame) for frame in frames]
