"""In which order samples came, by clocks that may be wrong: one bad time stamp costs one sample, no more."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from ramsight.arrays import Array, Bools
from ramsight.constant import Constant

OUT_OF_ORDER = Constant(1.0, "s", "by which time may go back where samples came out of order; by more, it was set")
LONGEST_RUN = Constant(10.0, "1", "bad time stamps in a row; more of them are a clock that was set")
JITTER = Constant(5.0, "1", "usual distances by which samples may come out of order: a bus's queue, a thread's turn")


@dataclass(frozen=True)
class Arrival:
    """How the samples of one clock came."""

    order: Array  # of each sample, never falling, shape (n,) [s]; comparable between the clocks of a file
    wild: Bools  # which samples have a time beside that of those before and after them, shape (n,)
    falls: tuple[tuple[float, float], ...]  # times before and after each place where the clock was set back [s]
    places: tuple[int, ...]


def arrivals(times: Mapping[int, Array]) -> dict[int, Arrival]:
    """How the samples of several clocks of a file came.

    Args:
        times: of each clock [s], in the order of the file; NaN where unknown.

    Example:
        >>> found = arrivals({0: np.array([0.0, 1.0, 900.0, 3.0, 4.0]), 1: np.array([0.5, 2.5])})
        >>> found[0].order.tolist(), found[0].wild.tolist(), found[1].order.tolist()
        ([0.0, 1.0, 2.0, 3.0, 4.0], [False, False, True, False, False], [0.5, 2.5])
    """
    kept = {clock: _kept(time) for clock, time in times.items()}
    back = {clock: _falls(time[kept[clock]]) for clock, time in times.items()}
    busiest = max(times, key=lambda clock: len(times[clock]), default=0)
    shifts = _own_shifts(back.get(busiest, []))
    found = {}
    for clock, time in times.items():
        own = _own_shifts(back[clock]) if clock == busiest else _matched(back[clock], back[busiest], shifts, time)
        found[clock] = Arrival(
            _order(time, kept[clock], back[clock], own),
            np.isfinite(time) & ~kept[clock],
            tuple((before, after) for _, before, after in back[clock]),
            tuple(int(np.flatnonzero(kept[clock])[place]) for place, _, _ in back[clock]),
        )
    return found


def usual_distance(time: Array) -> float:
    """The median of the distances of a clock that goes on [s], NaN without any.

    Example:
        >>> round(usual_distance(np.array([0.0, 0.02, 0.04, 1800.0, 1800.02])), 9)
        0.02
    """
    steps = np.diff(time[np.isfinite(time)])
    steps = steps[steps > 0.0]
    return float(np.median(steps)) if steps.size else float("nan")


def _tolerance(time: Array) -> float:
    """By how much a clock may go back where samples came out of order [s]."""
    return float(np.fmin(OUT_OF_ORDER, JITTER * usual_distance(time)))


def _kept(time: Array) -> Bools:
    """Which samples have a time that fits those around them."""
    places = np.flatnonzero(np.isfinite(time))
    known, slack = time[places], _tolerance(time)
    usual = float(np.nan_to_num(usual_distance(time)))
    kept = np.zeros(len(time), dtype=np.bool_)
    kept[places] = True
    done = -1
    for fall in np.flatnonzero(np.diff(known) < -slack):
        if fall <= done:
            continue
        first, last = _run(known, int(fall), slack, usual)
        kept[places[first : last + 1]] = False
        done = max(done, last)
    return kept


def _run(known: Array, fall: int, slack: float, usual: float) -> tuple[int, int]:
    """First and last of the bad times around a fall; an empty span where the clock was set.

    The time went on while they came: what fits is as much later as so many samples usually are.
    """
    most, before, after = int(LONGEST_RUN), known[fall], known[fall + 1]
    for length in range(1, most + 1):
        back = fall + 1 + length  # the next time that fits the one before the fall
        if back < len(known) and known[back] > before + length * usual - slack:
            return fall + 1, fall + length
        ahead = fall - length  # the last time that fits the one after the fall
        if ahead >= 0 and known[ahead] < after - length * usual + slack:
            return fall - length + 1, fall
    return (0, fall) if fall < most and len(known) > 2 * most else (fall + 1, fall)


def _falls(time: Array) -> list[tuple[int, float, float]]:
    """Where a clock was set back: the place among its good times, and the times before and after."""
    places = np.flatnonzero(np.diff(time) < -_tolerance(time))
    return [(int(place) + 1, float(time[place]), float(time[place + 1])) for place in places]


def _own_shifts(falls: list[tuple[int, float, float]]) -> list[float]:
    """What is to be added after each fall so that a clock goes on [s]."""
    return list(accumulate(before - after for _, before, after in falls))


def _matched(
    own: list[tuple[int, float, float]], other: list[tuple[int, float, float]], shifts: list[float], time: Array
) -> list[float]:
    """The shifts of another clock's falls where they are the same ones, else those of its own."""
    found, reach = [], 2.0 * float(np.nan_to_num(usual_distance(time))) + OUT_OF_ORDER
    for (_, before, after), alone in zip(own, _own_shifts(own), strict=True):
        apart = [abs(before - first) + abs(after - second) for _, first, second in other]
        nearest = int(np.argmin(apart)) if apart else -1
        found.append(shifts[nearest] if apart and apart[nearest] <= reach else alone)
    return found


def _order(time: Array, kept: Bools, falls: list[tuple[int, float, float]], shifts: list[float]) -> Array:
    good = time[kept]
    for number, (place, _, _) in enumerate(falls):
        end = falls[number + 1][0] if number + 1 < len(falls) else len(good)
        good[place:end] += shifts[number]
    if not len(good):
        return np.zeros(len(time))
    # what has no time that fits came between the ones before and after it
    return np.interp(np.arange(len(time)), np.flatnonzero(kept), np.fmax.accumulate(good))
