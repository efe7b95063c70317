"""A reference visit as a graph: what `ramsight.control.homing` does with an object."""

from __future__ import annotations

from typing import Any

import casadi as ca

from ramsight.control.activity import Activity, Event
from ramsight.control.activity_graph import ActivityGraph, either
from ramsight.control.orders import NOTHING, Ask, Reason
from ramsight.control.visiting import Visiting, end_stop, kept_on
from ramsight.plant.either import both, choose, least, most

STATES = ("end", "sought", "felt", "tells")
"""End stop that is sought or stood on [m], for how long [s], load on the way [N], whether its sensor is to be told.

The time for which the rod is held is `stood`, the velocity towards the stop `lead_velocity`: no other activity that has
these goes on meanwhile.
"""


class Visit:
    """The visit of a sample.

    Args:
        of: the sample's state and inputs.
    """

    def __init__(self, of: ActivityGraph) -> None:
        self.of, self._laws = of, Visiting(of.by)

    @property
    def _direction(self) -> Any:
        """Of the stop, +1 or -1."""
        return choose(self.of.s["end"] > 0.0, 1.0, -1.0)

    def asked(self) -> Any:
        """Whether a visit is asked for that was not before."""
        ask = self.of.u["ask"]
        visits = either(*(ask == float(one) for one in (Ask.HOME_LOWERED, Ask.HOME_LIFTED)))
        return both(visits, ask != self.of.x["ask"])

    def order(self, **anew: Any) -> None:
        """Take up a visit that is asked for; `anew` is what every order changes."""
        of, lifted = self.of, self.of.u["ask"] == float(Ask.HOME_LIFTED)
        begins = {"end": end_stop(of.by.unit, lifted), "sought": 0.0, "lead_velocity": 0.0}
        of.happens(Event.HOMED, self.asked(), **(anew | begins))

    def enter(self) -> None:
        """Feel the load first where the way begins."""
        of = self.of
        begins = both(of.s["fresh"], of.doing(Activity.HOMING))
        of.s["felt"] = choose(begins, of.load, of.s["felt"])

    def step(self, homes: Any) -> Any:
        """What a visit asks for, if there is one: fast while the stop is known to be far, then slowly, then press."""
        of, laws, s = self.of, self._laws, self.of.s
        away = abs(s["end"] - of.position)
        fast = most(least(of.u["speed"], of.by.limits.speed), laws.slowly)
        velocity = laws.nearing(s["lead_velocity"], away, of.sensed["position_std"], fast, ca.logic_not(of.none))
        sought = s["sought"] + of.by.period
        stands = laws.stands(sought, of.sensed["velocity"])
        new = {
            "sought": sought,
            "lead_velocity": velocity,
            "stood": choose(stands, s["stood"] + of.by.period, 0.0),
            "felt": choose(stands, s["felt"], laws.feeling(s["felt"], of.load)),
        }
        s |= {name: choose(homes, value, s[name]) for name, value in new.items()}
        speed = laws.speed(s["lead_velocity"], s["stood"], self._direction, s["felt"], of.load)
        pressed = both(homes, s["stood"] > of.by.tuning.pressing)
        found = both(pressed, laws.on_the_stop(away))
        of.happens(Event.PRESSED, found, tells=1.0)
        of.fail(both(pressed, ca.logic_not(found)), Reason.NO_REFERENCE)
        of.fail(both(both(homes, ca.logic_not(pressed)), s["sought"] > laws.longest), Reason.NOT_FOUND)
        return choose(found, 0.0, speed)

    def stays(self) -> Any:
        """Whether the rod rests on the stop that it was sent to."""
        return both(self.of.doing(Activity.RESTING), self.of.s["end"] != NOTHING)

    def kept(self) -> Any:
        """The motor's speed [rad/s] of a pump-held rod that stays there."""
        return kept_on(self.of.by, self._direction, self.of.s["felt"])

    def told(self, speed: Any) -> Any:
        """The stop's place [m] for the sensor, once, when a visit is over: behind a valve the motor stands by then."""
        of = self.of
        waits = both(of.s["tells"], of.doing(Activity.RESTING))
        over = waits if not of.by.holding.stands else both(waits, speed == 0.0)
        of.s["tells"] = both(waits, ca.logic_not(over))
        return choose(over, of.s["end"], NOTHING)
