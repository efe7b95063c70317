"""What a machine weighs while a visitor works with it, and beside it what it really lifted, which no sensor knows."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from typing import Any

from ramsight.api.live_weighing import weigher_for
from ramsight.machine.description import Machine
from ramsight.normal import TWO_SIDED_95
from ramsight.sensor.virtual_sensor import VirtualSensor
from ramsight.tool.load_chart import LoadStatus
from ramsight.tool.weighing_events import Quality, Weighing

_LONGEST = 300.0  # s of the truth that are kept: a slow lift is shorter
_SHOWN = 6  # weighings, the newest
_WORDS = {Quality.UNKNOWN_POSITION: "position not known: visit an end stop, or give a reference"}
"""Where the words of the command line name its options."""
_LEVELS = {LoadStatus.WITHIN: "ok", LoadStatus.NEAR: "uncertain", LoadStatus.EXCEEDED: "invalid"}


class Lifts:
    """Weighs what is lifted.

    Args:
        period: of the samples [s].

    Example:
        >>> from ramsight import machine
        >>> Lifts(machine.load_machine("mining-loader"), 0.02).shown
        {'weighings': [], 'total': 0, 'total_half': 0, 'cycles': 0, 'count': 0, 'chart': True}
    """

    def __init__(self, machine: Machine, period: float) -> None:
        self._weigher = weigher_for(machine)
        self._has_chart = machine.linkage is not None and machine.linkage.load_chart is not None
        self._truth: deque[tuple[float, float]] = deque(maxlen=round(_LONGEST / period))
        self._rows: deque[dict[str, Any]] = deque(maxlen=_SHOWN)

    def truth(self, time: float, mass: float) -> None:
        """Keep what the mechanism carries [kg] at a time [s]."""
        self._truth.append((time, mass))

    def step(self, time: float, sensors: Mapping[str, VirtualSensor]) -> Weighing | None:
        """Take what sensors said of a sample [s]; the last weighing, where it is new or has become better."""
        found = self._weigher.step(time, sensors)
        if found is not None:
            self._enter(found)
        return found

    def _enter(self, found: Weighing) -> None:
        if found.direction == "both":  # of the lift that is there already
            self._rows[-1] |= _row(found)
            return
        ends = (found.time - 0.5 * found.duration, found.time + 0.5 * found.duration)
        true = [mass for time, mass in self._truth if ends[0] <= time <= ends[1]] or [math.nan]
        self._rows.append(_row(found) | {"at": round(found.time, 1), "true": [_whole(f(true)) for f in (min, max)]})

    @property
    def shown(self) -> dict[str, Any]:
        """The newest weighings, the newest last, and the total since the start; masses in kg, shares in %.

        `chart` says whether the description has a load chart, without which nothing is known of a rated load.

        Each weighing has `at` [s], `mass` and `half` its 95 % band, `true` the least and the most that was carried,
        `quality` and `good`, `share` and `share_half` of the rated load, `rated` the mass that may be lifted there,
        `status` with its `level`, and `direction`. None stands for what is unknown.
        """
        tally = self._weigher.tally
        total = tally.total
        return {
            "weighings": list(self._rows),
            "total": _whole(total.mass), "total_half": _whole(TWO_SIDED_95 * total.std(tally.scale)),
            "cycles": total.cycles, "count": tally.count, "chart": self._has_chart,
        }  # fmt: skip


def _row(one: Weighing) -> dict[str, Any]:
    """A weighing as plain values."""
    share, half = 100.0 * one.rated_share, 100.0 * TWO_SIDED_95 * one.rated_share_std
    return {
        "mass": _whole(one.mass), "half": _whole(TWO_SIDED_95 * one.std), "direction": one.direction,
        "good": one.is_good, "quality": _WORDS.get(one.quality, one.quality.value),
        "share": _whole(share), "share_half": _whole(half),
        "rated": _whole(one.mass / one.rated_share) if one.rated_share > 0.0 else None,
        "status": one.rated_status.name.lower(), "level": _LEVELS.get(one.rated_status, "unchecked"),
    }  # fmt: skip


def _whole(value: float) -> int | None:
    return round(value) if math.isfinite(value) else None
