"""Faults of inputs by name: what a track's hypotheses say of a report while it contradicts another one."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from ramsight.argument_kinds import by_kind
from ramsight.errors import DescriptionError
from ramsight.sensor.checks.diagnosis import KINDS
from ramsight.sensor.status import Status
from ramsight.signals import Samples

_SURE = 0.95  # probability from which a hypothesis is said
_APART = 1.0  # s; contradictions closer together are one
#: reports that are diagnosed, with what may be wrong as well, and the unit of an offset
_SIGNALS = {"speed": ("the shaft's counter", "rad/s"), "torque": ("DC power", "N m")}
_DECIDED = {int(Status.SPEED_WRONG): "motor speed", int(Status.COUNTER_WRONG): "the shaft's counter"}


@dataclass(frozen=True)
class NamedFault:
    """A fault of an input.

    Example:
        >>> print(NamedFault("motor speed", "", ("gain",), 1.3, 12.6, "rad/s", 120.42, 140.6).text)
        motor speed: 1.30 times what it should be, from 120.4 s to 140.6 s
        >>> print(NamedFault("motor torque", "DC power", ("sign",), -1.0, 9.3, "N m", 120.42, 140.6).text)
        motor torque: of the wrong sign (unless it is DC power that is wrong), from 120.4 s to 140.6 s
    """

    signal: str  # which report, ``"motor speed"``
    or_else: str  # which one is wrong in its place, where nothing shows which of them; else empty
    # kinds: what may be wrong with it, of `ramsight.sensor.checks.diagnosis.KINDS`; one, where that is sure
    kinds: tuple[str, ...]
    gain: float  # of the report over what it should be, if that is its fault [1]
    offset: float  # of it, if that is its fault [`unit`]
    unit: str  # of the report
    # first, last: time from which and to which the reports contradict each other [s]
    first: float
    last: float

    @property
    def text(self) -> str:
        """One line on it."""
        words = {
            "gain": f"{self.gain:.2f} times what it should be",
            "offset": f"off by {self.offset:+.3g} {self.unit}",
            "sign": "of the wrong sign",
            "stuck": "stuck",
            "other": "wrong in another way than by a gain, an offset or a sign",
        }
        said = " or ".join(words[kind] for kind in self.kinds) or "wrong"
        unless = f" (unless it is {self.or_else} that is wrong)" if self.or_else else ""
        return f"{self.signal}: {said}{unless}, from {self.first:.1f} s to {self.last:.1f} s"


@dataclass
class _Episode:
    """A contradiction that has not ended for long: how often each status was, and what is known by its last sample."""

    first: float
    last: float
    codes: Counter[int] = field(default_factory=Counter)
    kinds: tuple[str, ...] = ()
    gain: float = 1.0
    offset: float = 0.0

    def named(self, signal: str) -> NamedFault:
        """The fault, by all that came together until its last sample."""
        other, unit = _SIGNALS[signal]
        decided = _DECIDED.get(self.codes.most_common(1)[0][0]) if signal == "speed" else None
        name, or_else = (decided, "") if decided else (f"motor {signal}", other)
        return NamedFault(name, or_else, self.kinds, self.gain, self.offset, unit, self.first, self.last)


class FaultNames:
    """Names of the faults in a track, piece by piece.

    Example:
        >>> names = FaultNames()
        >>> names.close()
        []
    """

    def __init__(self) -> None:
        self._found: list[NamedFault] = []
        self._open: dict[str, _Episode] = {}

    def append(self, tracked: Samples) -> None:
        """Look at a piece of a track; only sensors that are declared a counter or DC power say anything of it."""
        for signal in _SIGNALS:
            if f"{signal}_{KINDS[0]}_probability" in tracked:
                self._look(signal, tracked)

    def close(self) -> list[NamedFault]:
        """All of them, in the order of their beginnings."""
        for signal in list(self._open):
            self._end(signal)
        return sorted(self._found, key=lambda one: (one.first, one.signal))

    def _look(self, signal: str, tracked: Samples) -> None:
        time, status = tracked["time"].values, tracked["status"].values
        chances = np.array([tracked[f"{signal}_{kind}_probability"].values for kind in KINDS])
        gains, offsets = (tracked[f"{signal}_{kind}"].values for kind in ("gain", "offset"))
        for k in np.flatnonzero(chances.sum(axis=0) > 0.0):
            now = float(time[k])
            if signal in self._open and now - self._open[signal].last > _APART:
                self._end(signal)
            known = self._open.setdefault(signal, _Episode(now, now))
            known.last = now
            known.codes[int(status[k])] += 1
            known.kinds = tuple(kind for kind, p in zip(KINDS, chances[:, k], strict=True) if p > 1.0 - _SURE)
            known.gain, known.offset = float(gains[k]), float(offsets[k])

    def _end(self, signal: str) -> None:
        self._found.append(self._open.pop(signal).named(signal))


@by_kind
def named_faults(tracked: Samples) -> list[NamedFault]:
    """The faults of inputs that a track names, in the order of their beginnings.

    Args:
        tracked: with all that the sensor reports, over `time` [s]; only a sensor to which a counter of the shaft or DC
            power is declared names any.

    Raises:
        DescriptionError: it is no track.

    Example:
        >>> import ramsight
        >>> from ramsight.duty.faults import Fault, inject
        >>> changes = {"units.boom.assumptions.shaft.std": "0.05 deg", "units.boom.assumptions.power.std": "0.5 %"}
        >>> loader = ramsight.load_machine("mining-loader").replace(changes)
        >>> run = ramsight.simulate(loader, "work-day", unit="boom", load=["200 kN"], duration="1 min")
        >>> log = inject(ramsight.drive_report(run, loader, unit="boom"), Fault("sign", 20.0, 40.0, "motor_speed"), 0)
        >>> [one.text for one in named_faults(ramsight.track(loader, log, unit="boom", start="140 mm"))]
        ['motor speed: of the wrong sign, from 20.1 s to 47.3 s']
    """
    if not (hasattr(tracked, "attrs") and hasattr(tracked, "__contains__") and "status" in tracked):
        raise DescriptionError("is no track", key="tracked", value=tracked, allowed="what ramsight.track returns")
    names = FaultNames()
    names.append(tracked)
    return names.close()
