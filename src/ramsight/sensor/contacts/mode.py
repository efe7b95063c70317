"""What the piston is doing, as one enumeration with one table of transitions.

Each sample the conditions of the table are looked at in its order; the first whose row fits decides. Whether the
position is known at all is another question, which the status answers.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

import casadi as ca

from ramsight.expression import Condition, Flag, Scalar, all_of, any_of


class Mode(IntEnum):
    """What the piston is doing, by the kalman sensor; its tracks have it as `mode`.

    Example:
        >>> import ramsight
        >>> ramsight.Mode(3).name, ramsight.Mode(3).text
        ('HELD_RETRACTING', 'held by what stops its retraction')
    """

    MOVING = 0
    RESTING_ON_VALVE = 1
    RESTING_ON_PUMP = 2
    HELD_RETRACTING = 3
    HELD_EXTENDING = 4
    LEAVING = 5
    OVER_RELIEF = 6
    EMPTY = 7

    @property
    def text(self) -> str:
        """The words for it."""
        return _TEXT[self]


_TEXT = {
    Mode.MOVING: "moves",
    Mode.RESTING_ON_VALVE: "rests, a valve holds the load",
    Mode.RESTING_ON_PUMP: "rests, the pump holds the load",
    Mode.HELD_RETRACTING: "held by what stops its retraction",
    Mode.HELD_EXTENDING: "held by what stops its extension",
    Mode.LEAVING: "released, not yet surely away",
    Mode.OVER_RELIEF: "the pump's oil may pass a relief valve",
    Mode.EMPTY: "no oil gives it a force",
}
HELD = (Mode.HELD_RETRACTING, Mode.HELD_EXTENDING)
FREE = tuple(mode for mode in Mode if mode not in (*HELD, Mode.LEAVING))


@dataclass(frozen=True)
class Transition:
    """A row of the table."""

    before: tuple[Mode, ...]  # modes that it leads from
    when: str  # name of its condition
    after: Mode  # where it leads


TRANSITIONS = (
    Transition((*FREE, *HELD, Mode.LEAVING), "stopped while it retracts", Mode.HELD_RETRACTING),
    Transition((*FREE, *HELD, Mode.LEAVING), "stopped while it extends", Mode.HELD_EXTENDING),
    Transition(HELD, "released", Mode.LEAVING),
    Transition((Mode.LEAVING,), "not yet away", Mode.LEAVING),
    Transition((Mode.HELD_RETRACTING,), "otherwise", Mode.HELD_RETRACTING),
    Transition((Mode.HELD_EXTENDING,), "otherwise", Mode.HELD_EXTENDING),
    Transition((*FREE, Mode.LEAVING), "no force", Mode.EMPTY),
    Transition((*FREE, Mode.LEAVING), "relief valve open", Mode.OVER_RELIEF),
    Transition((*FREE, Mode.LEAVING), "motor turns", Mode.MOVING),
    Transition((*FREE, Mode.LEAVING), "torque shows the load", Mode.RESTING_ON_PUMP),
    Transition((*FREE, Mode.LEAVING), "otherwise", Mode.RESTING_ON_VALVE),
)


def is_in(mode: Scalar, modes: tuple[Mode, ...]) -> Flag:
    """Whether a mode, as a number, is one of these."""
    return any_of(*(mode == float(one) for one in modes))


def next_mode(mode: Scalar, conditions: Mapping[str, Condition]) -> Scalar:
    """The mode after a sample, as a number.

    Args:
        conditions: of the table's rows by their names; "otherwise" always holds.

    Raises:
        KeyError: a condition is missing.
    """
    after = mode
    for row in reversed(TRANSITIONS):
        met = True if row.when == "otherwise" else conditions[row.when]
        after = ca.if_else(all_of(is_in(mode, row.before), met), float(row.after), after)
    return after
