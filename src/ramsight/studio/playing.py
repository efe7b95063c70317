"""A duty that plays: levers that are moved as somebody works who watches the rod."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ramsight.duty.lift_lower import SPEED

ENDS = "end to end"
DUTIES = {
    ENDS: "to both end stops, pressing on them",
    "lift and lower": "between a fifth and four fifths of the stroke",
    "paper": "1500 rpm, three loads in turn",
}
"""Duty cycles that play, and what they are."""
_LOW, _HIGH = 0.2, 0.8  # of the stroke
_REST = 2.0  # s, at either end
_PRESS, _HARD = 2.0, 0.5  # s, for which a lever presses on an end, and how far it is out then
_STANDS = 0.3  # s without progress, after which whoever holds a lever sees that the piston stands
_PROGRESS = 1e-3  # of the stroke
_STARTS = 1.0  # s more, in which a piston has to begin to move
_LOADS = (0.25, 0.5, 0.75)  # of the largest, one a cycle of the paper's


@dataclass
class _Hand:
    """What one lever is doing: where it moves to, +1 lifting, −1 lowering, and how long it still rests or presses [s].

    Its `reached` is the share of the stroke at which the piston stood lately, for so long as `stood` [s].
    """

    way: float = 1.0
    rests: float = 0.0
    presses: float = 0.0
    reached: float = -1.0
    stood: float = 0.0


@dataclass
class Playing:
    """A duty of all units of a machine.

    Example:
        >>> hand = Playing("lift and lower", {"ram": 1.0}, {"ram": 200.0})
        >>> hand.levers({"ram": 0.5}, 0.02), hand.levers({"ram": 0.9}, 0.02), hand.levers({"ram": 0.9}, 3.0)
        ({'ram': 1.0}, {'ram': 0.0}, {'ram': -1.0})
    """

    name: str  # of `DUTIES`
    lift_signs: Mapping[str, float]
    speeds: Mapping[str, float]  # motor speed at a lever's end [rad/s], by unit
    load: float | None = None  # over the largest that is to be carried now; None to leave it
    _hands: dict[str, _Hand] = field(default_factory=dict)
    _cycles: int = 0

    def __post_init__(self) -> None:
        if self.name not in DUTIES:
            raise ValueError(f"no duty {self.name!r}; there are {', '.join(DUTIES)}")
        self._hands = {unit: _Hand() for unit in self.lift_signs}
        self.load = _LOADS[0] if self.name == "paper" else None

    def levers(self, shares: Mapping[str, float], period: float) -> dict[str, float]:
        """Where the levers are now, −1 to 1, positive extending.

        Args:
            period: since the last call [s].
        """
        return {unit: self._lever(unit, hand, shares[unit], period) for unit, hand in self._hands.items()}

    def _lever(self, unit: str, hand: _Hand, share: float, period: float) -> float:
        direction = hand.way * self.lift_signs[unit]
        if self.name == ENDS:
            return direction * self._to_the_end(hand, share, period)
        if hand.rests > 0.0:
            hand.rests -= period
        elif (share > _HIGH and direction > 0.0) or (share < _LOW and direction < 0.0):
            hand.rests, hand.way = _REST - period, -hand.way
            if self.name == "paper" and hand.way > 0.0 and unit == next(iter(self._hands)):
                self._cycles += 1
                self.load = _LOADS[self._cycles % len(_LOADS)]
        if hand.rests > 0.0:
            return 0.0
        size = min(SPEED / self.speeds[unit], 1.0) if self.name == "paper" else 1.0
        return size * hand.way * self.lift_signs[unit]

    def _to_the_end(self, hand: _Hand, share: float, period: float) -> float:
        """How far the lever is out: on until the piston stands, then pressing, then resting before it turns round."""
        if hand.presses > 0.0:
            hand.presses -= period
            hand.rests = _REST
            return _HARD
        if hand.rests > 0.0:
            hand.rests -= period
            if hand.rests <= 0.0:
                hand.way, hand.stood, hand.reached = -hand.way, -_STARTS, share
            return 0.0
        if abs(share - hand.reached) > _PROGRESS:
            hand.reached, hand.stood = share, min(hand.stood, 0.0)
        hand.stood += period
        if hand.stood > _STANDS:
            hand.presses = _PRESS
        return 1.0
