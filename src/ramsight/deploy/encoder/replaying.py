"""A recorded log on a bus, frame after frame as it was recorded, so that an encoder can be tried without a machine."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from ramsight.deploy.encoder.frame import Frame
from ramsight.deploy.encoder.runner import message_of
from ramsight.optional import needing

with needing("can"):
    import can

_LONGEST_WAIT = 0.1  # s; so that progress is seen, and a wish to stop noticed


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
