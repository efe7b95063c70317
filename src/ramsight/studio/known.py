"""What a sensor knows, as what a page draws: its hypotheses, what it has learned of the machine, and since when."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from ramsight.normal import TWO_SIDED_95
from ramsight.sensor.kind import Kind, covariance_of, state_of
from ramsight.sensor.quantity import Quantity
from ramsight.sensor.status import Status
from ramsight.sensor.thresholds import OTHERWISE
from ramsight.sensor.virtual_sensor import BOUND, HIGHEST, LOWEST, Estimate, VirtualSensor
from ramsight.signals import Signals

_LEARNED = {"leakage": "leak_factor", "displacement": "displacement_factor", "compliance": "compliance_factor"}
_MOVED = 0.02  # probability by which a hypothesis has become likelier
_KEPT = 4  # of what has moved the hypotheses, the newest
LOOKS = 1500
"""At what a sensor knows along a log: about as many as a picture has pixels."""

_NEXT = {
    Kind.LOW: "Press it on the retracted end, and on the other one: two ends that agree are those of the cylinder.",
    Kind.TOP: "Press it on the extended end, and on the other one: two ends that agree are those of the cylinder.",
    Kind.UNKNOWN_POSITION: "Press it on an end of the stroke, or give a reference.",
}
"""What would make a sensor surer, by the likeliest hypothesis that contradicts the description."""
_NO_POSITION = "It gives no position, so nothing that relies on one is misled."


class Known:
    """What a kalman sensor knows while it runs.

    Args:
        stroke: of its cylinder [m].

    Example:
        >>> import ramsight
        >>> from ramsight.plant.build import build
        >>> from ramsight.sensor.kalman import kalman
        >>> unit = build("mining-loader", "boom")
        >>> sensor = kalman(unit)
        >>> sensor.start(None)
        >>> knowledge = Known(sensor, unit.cylinder.stroke)
        >>> said = knowledge.look(0.0, sensor.step(0.0, 0.0, 0.0, 313.15))
        >>> said["position"], said["low"], said["high"], said["since"]
        (None, 0.0, 700.0, None)
    """

    def __init__(self, sensor: VirtualSensor, stroke: float) -> None:
        self.sensor, self._stroke = sensor, stroke
        outputs = set(sensor.recursion.outputs)
        self.kinds = [kind for kind in Kind if f"{kind.text}_probability" in outputs]
        self._chances: dict[Kind, float] = {}
        self._met = (0.0, 0.0)
        self._since = math.nan
        self._referred = math.nan
        self._moved: list[str] = []

    def look(self, time: float, said: Estimate, referred: float = math.nan) -> dict[str, Any]:
        """What it knows now: lengths in mm, None for what is unknown.

        Args:
            time: [s].
            referred: when it was given a reference last [s]; NaN never.

        Returns:
            `position`, `low` and `high` of the 95 % band, `bound`, `stroke`; `hypotheses` with name, words, place,
            deviation and chance; `learned` quantities over the data sheet; `since`, the time since a measurement of
            the place [s]; `moved`, what made hypotheses likelier; `next`, what would make it surer; `wrong`, where the
            piston is if it is wrong.
        """
        state, says = self.sensor.state, self.sensor.says
        chances = {kind: says(f"{kind.text}_probability") for kind in self.kinds}
        self._follow(time, (state["met_low"], state["met_top"]), referred, chances)
        known = said.status is not Status.NOT_REFERENCED and math.isfinite(said.position)
        at, count = Quantity.POSITION, len(self.kinds)
        variances = [state[covariance_of(k, at, at)] for k in range(count)]
        places = [state["position"] + state[state_of(k, at)] for k in range(count)]
        return {
            "stroke": _mm(self._stroke),
            "position": _mm(said.position) if known else None,
            "low": _mm(says(LOWEST)) if known else 0.0,
            "high": _mm(says(HIGHEST)) if known else _mm(self._stroke),
            "bound": _mm(says(BOUND)) if known else None,
            "hypotheses": [
                {"name": kind.text, "words": kind.words, "place": _mm(place), "std": _mm(math.sqrt(max(variance, 0.0))),
                 "chance": round(chances[kind], 5)}
                for kind, place, variance in zip(self.kinds, places, variances, strict=True)
            ],
            "learned": [
                {"name": name, "value": round(says(output), 4), "std": round(says(f"{output}_std"), 4)}
                for name, output in _LEARNED.items()
            ],
            "since": None if math.isnan(self._since) else round(time - self._since, 1),
            "moved": list(self._moved),
            "next": self.surer(known=known, chances=chances),
            "wrong": self._wrong(said.position, chances, places, variances) if known else _NO_POSITION,
        }  # fmt: skip

    def _wrong(self, position: float, chances: dict[Kind, float], places: list[float], variances: list[float]) -> str:
        """Where the piston is, with 95 %, by the hypothesis that adds most to the square of the error."""
        best = max(chances, key=lambda kind: chances[kind])

        def cost(k: int) -> float:
            return chances[self.kinds[k]] * (variances[k] + (places[k] - position) ** 2)

        k = max((k for k, kind in enumerate(self.kinds) if kind is not best), key=cost)
        kind = self.kinds[k]
        half = TWO_SIDED_95 * math.sqrt(max(variances[k], 0.0))
        low, high = (1e3 * min(max(places[k] + side * half, 0.0), self._stroke) for side in (-1.0, 1.0))
        chance = "less than 0.1 %" if chances[kind] < 1e-3 else f"{100.0 * chances[kind]:.1f} %"
        return f"With a probability of {chance}, {kind.words}: the piston is then between {low:.0f} and {high:.0f} mm."

    def _follow(self, time: float, met: tuple[float, float], referred: float, chances: dict[Kind, float]) -> None:
        """Take note of what was measured since the last look, and of what it made likelier."""
        why = "by its way since"
        if met != self._met:
            why, self._since = f"{'retracted' if met[0] != self._met[0] else 'extended'} end met", time
        elif math.isfinite(referred) and referred != self._referred:
            why, self._since = "a reference", referred
        by = {kind: chance - self._chances.get(kind, chance) for kind, chance in chances.items()}
        most = max(by, key=lambda kind: by[kind])
        if by[most] > _MOVED:
            words = f"{time:.0f} s, {why}: {most.words}, {self._chances[most]:.2f} → {chances[most]:.2f}"
            self._moved = [words, *self._moved][:_KEPT]
        self._met, self._referred, self._chances = met, referred, chances

    @staticmethod
    def surer(*, known: bool, chances: dict[Kind, float]) -> str:
        """What would make a sensor surer."""
        if not known:
            return _NEXT[Kind.UNKNOWN_POSITION]
        others = {kind: chance for kind, chance in chances.items() if kind in _NEXT and chance > OTHERWISE}
        if others:
            return _NEXT[max(others, key=lambda kind: others[kind])]
        return "Nothing but a new reference: each end that it meets takes away what the way has added since."


def known_along(
    sensor: VirtualSensor, log: Signals, stroke: float, looks: int = LOOKS
) -> Iterator[tuple[float, dict[str, Any]]]:
    """What a kalman sensor knows while it goes through a log: at its first sample, evenly over it, and at its last.

    Args:
        stroke: of the cylinder [m].

    Yields:
        A time [s], and what `Known.look` finds then.
    """
    known, time = Known(sensor, stroke), log["time"].values
    given = log["reference"].values if "reference" in log else np.full(len(time), np.nan)
    ends = np.unique(np.linspace(1, len(time), min(looks, len(time))).astype(int)).tolist() if len(time) else []
    first, referred = 0, math.nan
    for end in ends:
        piece = slice(first, end)
        sensor.followed(log.rows(piece))
        references = time[piece][np.isfinite(given[piece])]
        referred = float(references[-1]) if len(references) else referred
        first, now = end, float(time[end - 1])
        yield now, known.look(now, sensor.estimate, referred)


def _mm(metres: float) -> float | None:
    return round(1e3 * metres, 3) if math.isfinite(metres) else None
