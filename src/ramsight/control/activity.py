"""What a cylinder under control is doing, as one enumeration with one table of transitions."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


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


class Event(Enum):
    """What ends an activity."""

    SENT = "sent to a target"
    HOMED = "sent to an end stop"
    TESTED = "leak test asked for"
    STEERED = "taken by hand"
    NEAR = "target is near"
    MISSED = "target was missed"
    SETTLED = "rod has settled"
    PRESSED = "stop was pressed"
    OVER = "time is over"
    FAILED = "not to be relied on"
    STANDS = "motor stands"


@dataclass(frozen=True)
class Transition:
    """A row of the table.

    Args:
        before: activities that it leads from.
        when: what happens.
        after: where it leads.
    """

    before: tuple[Activity, ...]
    when: Event
    after: Activity


ANY = tuple(Activity)
STOPS = (Activity.STOPPING, Activity.STOPPED)
GOING = tuple(activity for activity in Activity if activity not in STOPS)

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
