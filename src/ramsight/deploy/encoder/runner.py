"""An encoder on a bus of python-can: one loop, one clock."""

from __future__ import annotations

import gc
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

from ramsight.deploy.encoder.encoder import Encoder
from ramsight.deploy.encoder.frame import EXTENDED, Frame
from ramsight.deploy.encoder.j1939 import Broadcasting
from ramsight.errors import RamsightError
from ramsight.optional import needing
from ramsight.system import forward

with needing("can"):
    import can


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
