"""A drive that is not there: it plays a log or a simulated run as process data of CiA 402."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass

from ramsight.deploy.encoder.frame import Frame
from ramsight.signals import Samples
from ramsight.units import FREEZING, RPM

_WARM_EVERY = 50  # samples; a thermometer on the bus reports once a second
_ALIVE_EVERY = 5
_LARGEST = 0x7FFF  # per mille that 6077h holds


@dataclass(frozen=True)
class PlayedDrive:
    """Frames of a drive and of a node with a thermometer.

    Example:
        >>> from ramsight.logs import read_log
        >>> log = read_log("tests/traces/boom_441kN_40C.csv.gz").isel(time=slice(100, 102))
        >>> for time, frame in PlayedDrive(log, 5, 35.0).frames():
        ...     print(f"{time:.2f}", frame)
        2.00 705#05
        2.00 185#DC0500009A07
        2.02 185#DC0500009307
    """

    log: Samples  # Dataset over `time` with motor_speed [rad/s], motor_torque [N m] and oil_temperature [K]
    node: int  # the drive's node-ID: 180h + node has 606Ch [1/min] and 6077h [‰], 700h + node its heartbeat
    rated_torque: float  # 6076h [N m]
    # the thermometer's: 180h + node has the oil temperature [0.1 °C] as INT16; None without one
    warm_node: int | None = None

    def frames(self) -> Iterator[tuple[float, Frame]]:
        """The log's frames with their times [s]; of a sample without speed or torque there is none, as on a bus."""
        columns = (self.log[name].values for name in ("time", "motor_speed", "motor_torque", "oil_temperature"))
        for k, (time, speed, torque, warmth) in enumerate(zip(*columns, strict=True)):
            at = float(time)
            if k % _ALIVE_EVERY == 0:
                yield at, Frame(0x700 + self.node, b"\x05", at)
            if self.warm_node is not None and k % _WARM_EVERY == 0 and math.isfinite(warmth):
                yield at, Frame(0x180 + self.warm_node, struct.pack("<h", round(10.0 * (warmth - FREEZING))), at)
            if not (math.isfinite(speed) and math.isfinite(torque)):
                continue
            share = min(max(round(1e3 * torque / self.rated_torque), -_LARGEST), _LARGEST)
            yield at, Frame(0x180 + self.node, struct.pack("<ih", round(speed / RPM), share), at)


def played_map(node: int, warm_node: int, rated_torque: float, hold: str = "60 s") -> str:
    """The channel map of what a `PlayedDrive` with a thermometer sends, as its file would have it.

    Args:
        rated_torque: 6076h [N m].

    Example:
        >>> print(played_map(5, 7, 35.0), end="")
        speed = {channel = "606Ch", unit = "1/min"}
        torque = {channel = "6077h", rated = "35 N m"}
        temperature = {channel = "2010h:01h", unit = "degC", scale = 0.1, hold = "60 s"}
        [[can.pdo]]
        cob_id = 0x185
        objects = ["606Ch", "6077h"]
        [[can.pdo]]
        cob_id = 0x187
        objects = ["2010h:01 INT16"]
    """
    return f"""\
speed = {{channel = "606Ch", unit = "1/min"}}
torque = {{channel = "6077h", rated = "{rated_torque:.15g} N m"}}
temperature = {{channel = "2010h:01h", unit = "degC", scale = 0.1, hold = "{hold}"}}
[[can.pdo]]
cob_id = 0x{0x180 + node:X}
objects = ["606Ch", "6077h"]
[[can.pdo]]
cob_id = 0x{0x180 + warm_node:X}
objects = ["2010h:01 INT16"]
"""
