"""What is said of a clock, for every kind of log: time stamps beside the others, and a clock that was set back."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from ramsight.arrays import Array
from ramsight.errors import warn_of_log
from ramsight.logs.arrival import LONGEST_RUN, Arrival, arrivals

_MARGIN = 2 * int(LONGEST_RUN) + 1  # times on each side of one that say whether it fits
_AT_ONCE = 1 << 12  # times of frames or messages that are looked at together


class ClockWatch:
    """Looks at the times of a channel as they come, with what it needs of earlier ones.

    Attributes:
        wild: how many of them stand beside the others.
        first_wild: number of the first of these, from 1, and its time [s].
        falls: times before and after each place where the clock was set back [s].
    """

    def __init__(self) -> None:
        self.wild = 0
        self.first_wild: tuple[int, float] | None = None
        self.falls: list[tuple[float, float]] = []
        self._waiting: list[float] = []
        self._held: Array = np.empty(0)
        self._settled = 0  # of those that are held, how many have been judged
        self._number = 0  # of the first that is held

    def take(self, time: float) -> None:
        """Take the next time [s]."""
        self._waiting.append(time)
        if len(self._waiting) >= _AT_ONCE:
            self._flush()

    def take_all(self, time: Array) -> None:
        """Take the next times [s], shape (n,)."""
        self._flush()
        self._look(time, is_last=False)

    def _flush(self) -> None:
        if self._waiting:
            waiting, self._waiting = self._waiting, []
            self._look(np.array(waiting, dtype=np.float64), is_last=False)

    def _look(self, time: Array, *, is_last: bool) -> None:
        held = np.concatenate([self._held, time])
        end = len(held) if is_last else max(len(held) - _MARGIN, self._settled)
        came = arrivals({0: held})[0]
        wild = np.flatnonzero(came.wild[self._settled : end]) + self._settled
        if wild.size and self.first_wild is None:
            self.first_wild = self._number + int(wild[0]) + 1, float(held[wild[0]])
        self.wild += wild.size
        self.falls += [
            fall for place, fall in zip(came.places, came.falls, strict=True) if self._settled <= place < end
        ]
        drop = max(end - _MARGIN, 0)
        self._held, self._settled, self._number = held[drop:].copy(), end - drop, self._number + drop

    def end(self) -> None:
        """After the last time."""
        self._flush()
        self._look(np.empty(0), is_last=True)


def warn_of_watched(file: str, watches: Collection[ClockWatch], leaps: Sequence[tuple[float, float]] = ()) -> None:
    """Say what is wrong with the clock of a log of which some channels were watched, by the worst of them.

    Args:
        leaps: times before and after each place where the whole log's clock was set back [s].
    """
    for one in watches:
        one.end()
    worst = max(watches, key=lambda one: one.wild, default=None)
    if worst is not None and worst.first_wild is not None:
        _warn_of_wild(file, None, "log", worst.wild, *worst.first_wild)
    _warn_of_falls(file, max((leaps, *(one.falls for one in watches)), key=len))


def warn_of_clocks(
    file: str, times: Mapping[int, Array], came: Mapping[int, Arrival], names: Mapping[int, str]
) -> None:
    """Say of each group which time stamps stand beside the others, and of the file whether its clock was set.

    Args:
        times: of each group [s].
    """
    for group, one in came.items():
        count = int(one.wild.sum())
        if count:
            first = int(np.argmax(one.wild))
            _warn_of_wild(file, names[group], "group", count, first + 1, float(times[group][first]))
    _warn_of_falls(file, max((one.falls for one in came.values()), key=len, default=()))


def _warn_of_wild(file: str, column: str | None, whole: str, count: int, sample: int, time: float) -> None:
    what = "1 time stamp is" if count == 1 else f"{count} time stamps are"
    more = "" if count == 1 else ", the first"
    warn_of_log(
        f"{what} not between those before and after{more} in sample {sample}: {time:.9g} s; the rest of the {whole} is"
        " read as it is",
        file=file,
        column=column,
    )


def _warn_of_falls(file: str, falls: Sequence[tuple[float, float]]) -> None:
    if falls:
        often = "once" if len(falls) == 1 else f"{len(falls)} times, first"
        before, after = falls[0]
        warn_of_log(
            f"time goes back {often} from {before:.12g} s to {after:.12g} s: was the clock set, or is a part of the log"
            " there twice?",
            file=file,
        )
