"""What a cylinder under control is doing, as one enumeration with one table of transitions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum, IntEnum
from typing import TypeVar

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Condition, Flag, Real, Scalar, all_of, any_of, negated

R = TypeVar("R", bound=IntEnum)


class Activity(Enum):
    """What a cylinder is doing."""

    RESTING = "resting"
    MOVING = "moving"
    LANDING = "landing"
    MANUAL = "steered by hand"
    HOMING = "homing"
    LEAK_TEST = "leak test"
    STOPPING = "stopping"
    STOPPED = "stopped"

    @property
    def number(self) -> int:
        """Its number in the graph, in C and in FMUs."""
        return ACTIVITIES.index(self)


class Event(Enum):
    """What ends an activity."""

    SENT = "sent to a target"
    HOMED = "sent to an end stop"
    TESTED = "leak test asked for"
    STEERED = "steered by hand"
    NEAR = "target is near"
    MISSED = "target was missed"
    SETTLED = "rod has settled"
    PRESSED = "stop was pressed"
    OVER = "time is over"
    FAILED = "not to be relied on"
    STANDS = "motor stands"


@dataclass(frozen=True)
class Transition:
    """A row of the table."""

    before: tuple[Activity, ...]  # activities that it leads from
    when: Event  # what happens
    after: Activity  # where it leads


ANY = tuple(Activity)
STOPS = (Activity.STOPPING, Activity.STOPPED)
GOING = tuple(activity for activity in Activity if activity not in STOPS)
# New activities come last: a machine that reads these numbers keeps the ones that it has.
ACTIVITIES = (
    *(activity for activity in Activity if activity not in {Activity.HOMING, Activity.LEAK_TEST}),
    Activity.HOMING,
    Activity.LEAK_TEST,
)
"""Activities in the order of their numbers."""

TRANSITIONS = (
    Transition(ANY, Event.SENT, Activity.MOVING),
    Transition(ANY, Event.HOMED, Activity.HOMING),
    Transition(ANY, Event.TESTED, Activity.LEAK_TEST),
    Transition(ANY, Event.STEERED, Activity.MANUAL),
    Transition((Activity.MOVING,), Event.NEAR, Activity.LANDING),
    Transition((Activity.LANDING,), Event.MISSED, Activity.MOVING),
    Transition((Activity.LANDING,), Event.SETTLED, Activity.RESTING),
    Transition((Activity.HOMING,), Event.PRESSED, Activity.RESTING),
    Transition((Activity.LEAK_TEST,), Event.OVER, Activity.RESTING),
    Transition(GOING, Event.FAILED, Activity.STOPPING),
    Transition((Activity.STOPPING,), Event.STANDS, Activity.STOPPED),
)


def after(activity: Activity, event: Event) -> Activity:
    """Where an event leads.

    Args:
        activity: before it.
        event: what happens.

    Raises:
        ValueError: the table has no such row.

    Example:
        >>> after(Activity.MOVING, Event.NEAR)
        <Activity.LANDING: 'landing'>
    """
    for row in TRANSITIONS:
        if row.when is event and activity in row.before:
            return row.after
    raise ValueError(f"{activity.value}: no transition when {event.value!r}")


@dataclass(frozen=True)
class ActivityState:
    """State of the activity."""

    number: Scalar = leaf("1", Activity.RESTING.number)
    begins: Flag = leaf("1")  # whether the next sample is its first
    reason: Scalar = leaf("1")  # why the cylinder stops or has stopped, a `Reason`
    ramp: Scalar = leaf("rad/s2")  # change of the motor's speed in a stop

    def is_any_of(self, *activities: Activity) -> Flag:
        """Whether the activity is one of these."""
        return any_of(*(self.number == float(one.number) for one in activities))


def follow(now: ActivityState, events: Sequence[tuple[Activity | None, Event, Condition]]) -> ActivityState:
    """Go where the table leads.

    Args:
        events: that may happen: in which activity (None: in any), and whether they do.

    Raises:
        ValueError: the table has no such row.
    """
    number, begins = now.number, now.begins
    for before, event, happens in events:
        (leads_to,) = {after(one, event) for one in (ANY if before is None else (before,))}
        number = ca.if_else(happens, float(leads_to.number), number)
        begins = any_of(begins, happens)
    return replace(now, number=number, begins=begins)


def fail(now: ActivityState, reasons: Mapping[R, Condition], ramp: Real) -> ActivityState:
    """Stop, unless the cylinder stops already.

    Args:
        reasons: to stop, and whether they hold; the first one that does counts.
        ramp: with which the motor comes to rest [rad/s2].
    """
    stops = all_of(any_of(*reasons.values()), negated(now.is_any_of(*STOPS)))
    reason = now.reason
    for one, holds in reversed(list(reasons.items())):
        reason = ca.if_else(holds, float(one), reason)
    return replace(
        now,
        number=ca.if_else(stops, float(Activity.STOPPING.number), now.number),
        reason=ca.if_else(stops, reason, now.reason),
        ramp=ca.if_else(stops, ramp, now.ramp),
    )
