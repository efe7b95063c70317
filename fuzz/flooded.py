"""An encoder's OPC UA server that is flooded by 2000 connections a second: its frames on the bus come no later.

The encoder is a program of its own on a bus of datagrams; a drive that stands sends beside it. The flood is another
program: connections that say nothing, half a greeting, a greeting and nothing more, or bytes by chance, and half of
them stay open. What is measured is by how much the longest time between two positions on the bus is over their period.
"""

from __future__ import annotations

import contextlib
import math
import random
import socket
import subprocess
import sys
import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from frames import DRIVE, NODE, OPERATE, WARM, has_bus
from harness import READ, WRONG, Rng, Section

CASES = 10
_GROUP, _RATED = "239.74.163.4", 80.0
_PATIENCE, _BOOTS, _QUIET, _LASTS = 300.0, 150.0, 3.0, 6.0  # s
_RATE, _FEWEST = 2000, 0.25  # connections a second; share of them that a busy computer has to manage
_ENOUGH = 0.9  # of the positions that are due
_KEPT = 500  # connections that stay open at most
_PERIOD, _REPORTS, _LATE = 0.01, 0.02, 0.03  # s
_HELLO = b"HELF\x20\x00\x00\x00" + bytes(24)


@dataclass
class Prepared:
    """What the cases share: the bus, the drive's map, and by how much a position came late at most [s]."""

    bus: Any
    map: Path
    quiet: float = 0.0
    flooded: float = 0.0


def prepare(folder: Path) -> Prepared:
    """A bus of datagrams."""
    import can
    from ramsight.deploy.encoder.played_drive import played_map

    (folder / "map.toml").write_text(played_map(DRIVE, WARM, _RATED))
    return Prepared(can.Bus(interface="udp_multicast", channel=_GROUP), folder / "map.toml")


@contextlib.contextmanager
def served(prepared: Prepared) -> Iterator[int]:
    """An encoder on the bus, for a while; its port."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    words = ["encoder", "mining-loader", "--unit", "boom", "--interface", "udp_multicast", "--channel", _GROUP]
    words += ["--node-id", str(NODE), "--drive-node", str(DRIVE), "--map", str(prepared.map)]
    command = [sys.executable, "-m", "ramsight", *words, "--opcua", str(port)]
    _drain(prepared.bus)
    process, begun = subprocess.Popen(command, stdout=subprocess.DEVNULL), time.monotonic()
    try:
        while not latest(prepared, 0.5)[1]:
            if time.monotonic() - begun > _BOOTS:
                raise TimeoutError("the encoder does not boot")
        latest(prepared, _QUIET)
        yield port
    finally:
        process.terminate()
        process.wait()


def latest(prepared: Prepared, seconds: float) -> tuple[float, int]:
    """By how much a position came later than it should at most [s], and how many came in so many seconds."""
    bus, now = prepared.bus, time.monotonic()
    until, tick, last, late, count = now + seconds, now, math.inf, 0.0, 0
    for k in range(int(seconds / _REPORTS)):
        for identifier, data in ((0, OPERATE), (0x180 + WARM, b"\x90\x01"), (0x180 + DRIVE, _report(k))):
            _put(bus, identifier, data)
        tick += _REPORTS
        while (left := min(tick, until) - time.monotonic()) > 0.0:
            message = bus.recv(left)
            if message is not None and message.arbitration_id == 0x180 + NODE:
                last, late, count = message.timestamp, max(late, message.timestamp - last - _PERIOD), count + 1
    return late, count


def _drain(bus: Any) -> None:
    """What waits is of the time before."""
    while bus.recv(0.0) is not None:
        pass


def _report(k: int) -> bytes:
    """The drive stands, and its torque has noise."""
    return bytes(4) + (250 + k % 7).to_bytes(2, "little")


def _put(bus: Any, identifier: int, data: bytes) -> None:
    import can

    with contextlib.suppress(can.CanError):
        bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))


def flood(port: int, seconds: float) -> int:
    """Open so many connections a second; how many there were."""
    rng, kept, count, begun = random.Random(port), deque[socket.socket](), 0, time.monotonic()
    while (passed := time.monotonic() - begun) < seconds:
        if count >= _RATE * passed:
            time.sleep(1e-3)
            continue
        count += 1
        with contextlib.suppress(OSError):
            one = socket.create_connection(("127.0.0.1", port), 0.2)
            one.sendall(rng.choice([b"", _HELLO[:6], _HELLO, rng.randbytes(64)]))
            if rng.random() < 0.5:
                kept.append(one)
            else:
                one.close()
        if len(kept) > _KEPT:
            kept.popleft().close()
    return count


def _check(prepared: Prepared, _: Rng, __: Path) -> tuple[str, str]:
    with served(prepared) as port:
        quiet, _count = latest(prepared, _QUIET)
        command = [sys.executable, __file__, str(port), str(_LASTS + 1.0)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as flooding:
            assert flooding.stdout is not None
            flooding.stdout.readline()  # it has begun
            _drain(prepared.bus)
            late, count = latest(prepared, _LASTS)
            rate = int(flooding.stdout.readline()) / (_LASTS + 1.0)
    prepared.quiet, prepared.flooded = max(prepared.quiet, quiet), max(prepared.flooded, late)
    found = f"{1e3 * prepared.flooded:.1f} ms late at most, {1e3 * prepared.quiet:.1f} ms without a flood"
    detail = f"{rate:.0f} connections a second: {found}"
    if count < _ENOUGH * _LASTS / _PERIOD:
        return WRONG, f"{count} positions; {detail}"
    if rate < _FEWEST * _RATE:
        return WRONG, f"no flood: {detail}"
    return (READ if late <= _LATE else WRONG), detail


SECTIONS = (
    [Section("OPC UA flooded", CASES, prepare, _check, _PATIENCE, tells=True)]
    if find_spec("asyncua") and has_bus(_GROUP)
    else []
)

if __name__ == "__main__":
    print("floods", flush=True)
    print(flood(int(sys.argv[1]), float(sys.argv[2])))
