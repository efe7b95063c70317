"""Reports that repeat, as a graph: what `ramsight.control.repeats` counts with objects."""

from __future__ import annotations

import math
from typing import Any

import casadi as ca

from ramsight.control.repeats import FALSE_ALARMS, KNOWN_AFTER, SURELY, repeats_in_a_row
from ramsight.plant.either import both, choose, most

UNSEEN = 1e30  # a report before the first: none is the same
_GOING = ("stands", "trembles")
_RUN = ("looked", "repeats", "followed")


def runs_of(share: Any, period: float) -> Any:
    """As `ramsight.control.repeats.runs`, of a share above 0 and below 1 that is a graph."""
    return most(ca.ceil(math.log(FALSE_ALARMS * period) / ca.log(share)), 1.0)


def share_of(met: Any, samples: Any) -> Any:
    """As `ramsight.control.repeats.Seen.share`, of what was met and looked at."""
    return (met + KNOWN_AFTER) / (samples + KNOWN_AFTER)


class SpeedRepeatsGraph:
    """As `ramsight.control.repeats.SpeedRepeats`.

    Args:
        noise: declared standard deviation of the reported speed [rad/s].
        step: in which it is reported [rad/s].
        period: of the samples [s].

    Attributes:
        initial: its states and their values at power-up; none where no run of repeats says anything.
    """

    def __init__(self, noise: float, step: float, period: float) -> None:
        self._period, self._enough = period, repeats_in_a_row(noise, step, period)
        self.initial: dict[str, float] = {}
        if math.isfinite(self._enough):
            counted = [f"{going}_{name}" for going in _GOING for name in (*_RUN, "samples", "seen", "met")]
            self.initial = {"repeating": UNSEEN, "alarm": 0.0, "any": 0.0, "believed": 1.0} | dict.fromkeys(
                counted, 0.0
            )

    def forget(self, s: dict[str, Any], when: Any) -> None:
        """Count anew, and learn nothing of what was counted."""
        if self.initial:
            begun = {"repeating": UNSEEN, "alarm": 0.0, "any": 0.0}
            begun |= {f"{going}_{name}": 0.0 for going in _GOING for name in _RUN}
            s |= {name: choose(when, value, s[name]) for name, value in begun.items()}

    def look(self, s: dict[str, Any], when: Any, speed: Any, goings: tuple[Any, Any]) -> Any:
        """Whether a report [rad/s] is one too many of a run.

        Args:
            s: the states, which become the next ones.
            when: whether there is one to look at.
            speed: the report [rad/s].
            goings: whether the command stands, and whether it trembles.
        """
        if not self.initial:
            return ca.SX(0.0)
        same = both(when, speed == s["repeating"])
        ends = both(when, ca.logic_not(speed == s["repeating"]))
        self._learn(s, both(ends, ca.logic_not(s["alarm"])), goings)
        self.forget(s, ends)
        s["repeating"] = choose(ends, speed, s["repeating"])
        for going, now in zip(_GOING, goings, strict=True):
            self._repeated(s, going, both(same, now))
            s[f"{going}_looked"] = s[f"{going}_looked"] + both(when, now)
        s["any"] = ca.logic_or(s["any"], both(same, ca.logic_or(*goings)))
        return both(when, s["alarm"])

    def _repeated(self, s: dict[str, Any], going: str, counts: Any) -> None:
        count = s[f"{going}_repeats"] = s[f"{going}_repeats"] + counts
        s[f"{going}_followed"] = s[f"{going}_followed"] + both(counts, s["any"])
        surely = both(count >= self._enough, s[f"{going}_samples"] >= SURELY * self._enough)
        share = share_of(s[f"{going}_met"], s[f"{going}_seen"])
        rare = both(share < 1.0, count >= runs_of(share, self._period))
        found = both(both(counts, s["believed"]), both(surely, rare))
        s["alarm"] = ca.logic_or(s["alarm"], found)

    def _learn(self, s: dict[str, Any], when: Any, goings: tuple[Any, Any]) -> None:
        """From a run that a new value ended, if it was no alarm."""
        short = both(*(s[f"{going}_repeats"] < self._enough for going in _GOING))
        s["believed"] = choose(when, both(s["believed"], short), s["believed"])
        for going, now in zip(_GOING, goings, strict=True):
            followed = s[f"{going}_followed"]
            more = {"samples": s[f"{going}_looked"], "seen": followed + both(s["any"], now), "met": followed}
            s |= {f"{going}_{name}": s[f"{going}_{name}"] + choose(when, n, 0.0) for name, n in more.items()}
