"""Activities as a graph: a state in the place of objects, and what leads from one to another."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca

from ramsight.control.activity import TRANSITIONS, Activity, Event
from ramsight.control.actuation import Actuation
from ramsight.control.judging import Trust, may_home, trust
from ramsight.control.orders import ACTIVITIES, INPUTS, Reason
from ramsight.control.stopping import stopping_slope
from ramsight.plant.either import choose
from ramsight.sensor.status import Status

SENSED = {
    "position": 1e31,  # no number by `either.known`
    "position_std": 0.0,
    "velocity": 0.0,
    "load": 0.0,
    "status": float(Status.NOT_REFERENCED),
    "leak": 1.0,
    "displacement": 1.0,
}
"""What a control knows of its sensor, and takes it for before the first report."""
LAST = {f"last_{name}": value for name, value in SENSED.items()}
"""The states that remember it."""


class ActivityGraph:
    """A sample's state and inputs, and the table of activities.

    Args:
        by: the cylinder's motor speeds, limits and tuning; they reckon with the graph's inputs from here on.
        names: of the states: `motor_speed`, `activity`, `fresh`, `slope`, `reason`, `temperature`, those of `LAST`, and
            others.

    Attributes:
        x: the state before the sample.
        u: the inputs.
        s: the state as it becomes.
        arrived: whether there is a report at this sample.
        sensed: the sensor's estimate and what it has learned: the last, gone on with, where no report has arrived.
        position: the estimate's, with the way that was commanded and is in no report yet [m].
        full: whether the estimate lets the cylinder go at full speed.
        none: whether it is not to be relied on.
        mended: whether it may go to an end stop all the same.
    """

    def __init__(self, by: Actuation, names: Sequence[str]) -> None:
        self.by = by
        self.x = {name: ca.SX.sym(name) for name in names}
        self.u = {name: ca.SX.sym(name) for name in INPUTS}
        self.s: dict[str, Any] = dict(self.x)
        self.arrived = self.u["reported"] != 0.0
        self.sensed = self._sensed()
        self.position, self.load = self.sensed["position"], self.sensed["load"]
        by.temperature = self.x["temperature"]
        by.warm(self.u["oil_temperature"])
        self.s["temperature"] = by.temperature = choose(self.arrived, by.temperature, self.x["temperature"])
        by.leak, by.displacement = self.sensed["leak"], self.sensed["displacement"]
        self.full = self._any(lambda status: trust(status) is Trust.FULL)
        self.none = self._any(lambda status: trust(status) is Trust.NONE)
        self.mended = self._any(may_home)

    def _sensed(self) -> dict[str, Any]:
        """What the sensor says, or said last and would say of a rod that goes on."""
        last = {name: self.x[f"last_{name}"] for name in SENSED}
        last["position"] = last["position"] + self.by.period * last["velocity"]
        now = {name: choose(self.arrived, self.u[name], last[name]) for name in SENSED}
        self.s |= {f"last_{name}": value for name, value in now.items()}
        return now

    def _any(self, test: Callable[[Status], bool]) -> Any:
        """Whether the status is one of those that pass a test."""
        return either(*(self.sensed["status"] == float(status) for status in Status if test(status)))

    def doing(self, *activities: Activity) -> Any:
        """Whether it does one of these now."""
        return either(*(self.s["activity"] == float(ACTIVITIES.index(one)) for one in activities))

    def happens(self, event: Event, when: Any, **then: Any) -> None:
        """Go where the table leads, with changes of the state, if an event happens in an activity that knows it."""
        for row in TRANSITIONS:
            if row.when is event and row.after in ACTIVITIES:
                goes = ca.logic_and(self.doing(*(one for one in row.before if one in ACTIVITIES)), when)
                changes = {"activity": float(ACTIVITIES.index(row.after)), "fresh": 1.0} | then
                self.s |= {name: choose(goes, value, self.s[name]) for name, value in changes.items()}

    def fail(self, when: Any, reason: Reason) -> None:
        """Stop, for a reason."""
        slope = stopping_slope(self.s["motor_speed"], self.by.period)
        self.happens(Event.FAILED, when, slope=slope, reason=float(reason))


def either(*conditions: Any) -> Any:
    """Whether one of some conditions holds, one at least of which is a graph."""
    found: Any = conditions[0]
    for condition in conditions[1:]:
        found = ca.logic_or(found, condition)
    return found
