"""A bus of python-can with an encoder on it, or a recorded log, frame after frame: one loop, one clock."""

from __future__ import annotations

import gc
import logging
import math
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from ramsight.deploy.encoder.encoder import Encoder
from ramsight.deploy.encoder.frame import EXTENDED, Frame
from ramsight.deploy.encoder.j1939 import Broadcasting
from ramsight.errors import RamsightError
from ramsight.optional import needing
from ramsight.system import forward

with needing("can"):
    import can


_AT_ONCE = 3  # lines of one kind
_EVERY = 10.0  # s between lines of one kind after that
_KINDS = 64  # that are remembered


class Limit(logging.Filter):
    """Lets the first lines of a kind through, then one every ten seconds with the number of those held back.

    A kind is a logger, a level and a message before its values are filled in.

    Args:
        clock: [s], runs only forward.

    Example:
        >>> limit = Limit(clock=lambda: 0.0)
        >>> line = logging.makeLogRecord({"name": "can", "msg": "frame lost"})
        >>> sum(limit.filter(line) for _ in range(1000))
        3
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._clock = clock
        self._seen: dict[tuple[str, int, str], tuple[int, float, int]] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether a line is let through."""
        kind = (record.name, record.levelno, str(record.msg)[:80])
        now = self._clock()
        if kind not in self._seen and len(self._seen) >= _KINDS:
            kind = ("", 0, "")  # messages that are all different are one kind, too
        passed, last, held = self._seen.get(kind, (0, now, 0))
        if passed >= _AT_ONCE and now - last < _EVERY:
            self._seen[kind] = (passed, last, held + 1)
            return False
        self._seen[kind] = (passed + 1, now, 0)
        if held:
            record.msg, record.args = f"{record.getMessage()} (and {held} more since the last such line)", ()
        return True


@contextmanager
def limited_log_lines() -> Iterator[None]:
    """Warnings of all loggers go to standard error, limited in rate, until the block ends."""
    handler = logging.StreamHandler()
    handler.setLevel(logging.WARNING)
    handler.setFormatter(logging.Formatter("%(name)s: %(message)s"))
    handler.addFilter(Limit())
    root = logging.getLogger()
    root.addHandler(handler)
    try:
        yield
    finally:
        root.removeHandler(handler)


class BusError(RamsightError):
    """A bus that cannot be opened."""


_LONGEST_WAIT = 0.1  # s; so that a wish to stop is noticed
_AFTER_ERROR = 0.05  # s; a bus that is off is not asked without pause


def serve(
    encoder: Encoder | Broadcasting,
    bus: Any,
    stop: threading.Event,
    *,
    clock: Callable[[], float] = forward,
    sent: Callable[[float, Frame], object] | None = None,
    each: Callable[[], object] = lambda: None,
) -> None:
    """Run an encoder until a stop is requested.

    What is due goes out before the next frame is taken in, so that a flood delays nothing by more than one frame. A
    bus that fails is tried again; what could not be sent is gone.

    Args:
        encoder: it is started, and stopped at the end.
        bus: a python-can bus; stays open.
        stop: set it to end.
        clock: [s], runs only forward.
        sent: is passed of every frame that went out, with its time.
        each: called whenever something has been done, at least ten times a second.
    """

    def send(frames: Iterable[Frame]) -> None:
        for frame in frames:
            try:
                bus.send(message_of(frame))
            except can.CanError:
                continue
            if sent is not None:
                sent(clock(), frame)

    try:
        send(encoder.start(clock()))
        while not stop.is_set():
            send(encoder.advance(clock()))
            wait = min(max(encoder.due - clock(), 0.0), _LONGEST_WAIT)
            try:
                message = bus.recv(wait)
            except can.CanError:
                stop.wait(_AFTER_ERROR)
                continue
            frame = None if message is None else frame_of(message)
            if frame is not None:
                send(encoder.receive(clock(), frame))
            each()
    finally:
        encoder.stop()


@contextmanager
def until_stopped() -> Iterator[threading.Event]:
    """An event that an interrupt (Ctrl-C) or a termination signal sets; only in a program's main thread."""
    stop = threading.Event()
    before = {one: signal.signal(one, lambda *_: stop.set()) for one in (signal.SIGINT, signal.SIGTERM)}
    gc.collect()
    gc.freeze()  # what is there stays there: the collector need not look through it while PDOs are due
    try:
        yield stop
    finally:
        gc.unfreeze()
        for one, handler in before.items():
            signal.signal(one, handler)


def open_bus(interface: str, channel: str) -> Any:
    """A bus of python-can.

    Args:
        interface: ``socketcan``, ``udp_multicast``, ``virtual``, ...
        channel: ``can0``, ``239.74.163.2``, ...

    Raises:
        BusError: it cannot be opened.
    """
    try:
        return can.Bus(interface=interface, channel=channel)
    except (can.CanError, OSError, ValueError, ImportError) as error:
        text = " ".join(str(error).split()) or type(error).__name__
        raise BusError(f"{channel}: the bus cannot be opened by {interface}: {text}") from None


def frame_of(message: Any) -> Frame | None:
    """A message of python-can as a frame; None for what is no data."""
    if message.is_error_frame or message.is_remote_frame or message.is_fd:
        return None
    wide = EXTENDED if message.is_extended_id else 0
    return Frame(message.arbitration_id | wide, bytes(message.data), message.timestamp)


def message_of(frame: Frame) -> Any:
    """A frame as a message of python-can."""
    wide = bool(frame.cob_id & EXTENDED)
    return can.Message(arbitration_id=frame.cob_id & ~EXTENDED, data=frame.data, is_extended_id=wide)


@dataclass(frozen=True)
class Replayed:
    """What went out."""

    frames: int  # that were sent
    lost: int  # that the bus did not take
    lasted: float  # time of the log that was replayed [s]


def replay(
    frames: Iterable[tuple[float, Frame]],
    bus: Any,
    stop: threading.Event,
    *,
    speed: float = 1.0,
    clock: Callable[[], float] = time.monotonic,
    advance: Callable[[float], object] = lambda seconds: None,
) -> Replayed:
    """Send frames as far apart as their times are, until they or somebody's patience end.

    The grid is absolute: a frame that is late does not make the next one late. Where time goes back, or is none, the
    next frame follows at once and the log's time goes on from there.

    Args:
        frames: with their times [s].
        speed: times faster than recorded [1].
        clock: [s], runs only forward.
    """
    begun, past, last, reported = clock(), 0.0, math.nan, 0.0
    sent = lost = 0
    for at, frame in frames:
        past += max(at - last, 0.0) if math.isfinite(at - last) else 0.0
        last = at if math.isfinite(at) else last
        while (wait := begun + past / speed - clock()) > 0.0 and not stop.is_set():
            stop.wait(min(wait, _LONGEST_WAIT))
        if stop.is_set():
            break
        try:
            bus.send(message_of(frame))
            sent += 1
        except can.CanError:
            lost += 1
        advance(past - reported)
        reported = past
    return Replayed(sent, lost, reported)
