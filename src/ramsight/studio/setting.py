"""A machine in its setting, as the query of a link: what is opened by it is the same machine, set in the same way.

Anybody can write a link, so each of its values is checked as one of the page would be.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import urlencode

from ramsight.errors import DescriptionError, UnknownNameError
from ramsight.logs.digits import decimal
from ramsight.machine import catalogue, load_machine
from ramsight.machine.as_toml import as_toml
from ramsight.machine.description import Machine
from ramsight.studio.knobs import FAULTS, KINDS, KNOBS, SENSORS
from ramsight.studio.playing import DUTIES
from ramsight.studio.scenarios import FIRST, NOTHING, SCENARIOS
from ramsight.studio.strips import SPAN, SPANS, STRIPS, read_strips, units_of
from ramsight.studio.worker import FASTEST

TABS = ("Live", "Machines", "Logs", "Studies", "History")
"""Tabs of the page."""
_LONGEST = 2000  # letters of a query
_HOLDS = "hold"
_NO = "none"  # of a list
_NAMES = ("machine", "unit", "play", "faults", "sensors", "duty", "speed", _HOLDS, "strips", "span", "tab")


@dataclass(frozen=True)
class Setting:
    """What a link says of a machine."""

    machine: str | None = None  # its name in the catalogue; None for the one that the studio was opened with
    unit: str | None = None  # that is shown; None for the first
    scenario: str | None = FIRST  # that plays; None for none
    knobs: Mapping[str, float] = field(default_factory=dict)  # what differs from the first values, in SI, by name
    faults: tuple[str, ...] = ()
    sensors: tuple[str, ...] = SENSORS
    duty: str | None = None  # that plays; None for none
    speed: float = 1.0  # times faster than life
    holds_oil: bool = False  # whether the oil is held at its temperature
    strips: tuple[str, ...] = STRIPS  # from above, as `strips.read_strips`
    span: str = SPAN  # of `SPANS`, that the strips show
    tab: str = TABS[0]  # of `TABS`, that is open

    @property
    def settings(self) -> dict[str, Any]:
        """What the controls show of it, as a `worker.Frame` has it."""
        knobs = {knob.name: self.knobs.get(knob.name, knob.si(knob.first)) for knob in KNOBS}
        found = {"knobs": knobs, "faults": self.faults, "sensors": self.sensors, "duty": self.duty}
        return found | {"speed": self.speed, "holds_oil": self.holds_oil}

    def commands(self) -> Iterator[tuple[Any, ...]]:
        """Commands for a machine that begins, beside the scenario."""
        if self.knobs:
            yield "knobs", dict(self.knobs)
        for kind in KINDS:
            if (kind in self.sensors) != (kind in SENSORS):
                yield "sense", kind, kind in self.sensors
        for name in self.faults:
            yield "fault", name, True
        if self.holds_oil:
            yield "hold oil", True
        if self.duty is not None:
            yield "play", self.duty
        if self.speed != 1.0:
            yield "factor", self.speed


def read_setting(query: Mapping[str, str]) -> Setting:
    """The setting of a link; one without a word of it is that of a new page.

    Raises:
        DescriptionError: a value that the page would not take, or a name that it does not have.
        UnknownNameError: the catalogue has no such machine.

    Example:
        >>> found = read_setting({"machine": "press", "play": "none", "leak": "1.6", "faults": "torque"})
        >>> found.machine, found.knobs, found.faults, found.scenario
        ('press', {'leak': 1.6}, ('torque',), None)
    """
    if sum(len(name) + len(value) for name, value in query.items()) > _LONGEST:
        raise DescriptionError("is too long", key="link", allowed=f"up to {_LONGEST} letters")
    known = {*_NAMES, *(knob.name for knob in KNOBS)}
    for name in query:
        if name not in known:
            raise UnknownNameError("name", name, known, where="link")
    machine = query.get("machine")
    if machine is not None:  # a name alone: a path would open a file of the server
        machine = catalogue.find("machine", machine, where="link: machine").name
    play, duty = query.get("play", FIRST), query.get("duty")
    return Setting(
        machine=machine,
        unit=query.get("unit"),
        scenario=None if play == NOTHING else _one_of((*SCENARIOS, NOTHING), "play", play),
        knobs={knob.name: knob.si(_number(query, knob.name, knob.least, knob.most))
               for knob in KNOBS if knob.name in query},
        faults=_some_of(FAULTS, query, "faults", ()),
        sensors=_some_of(KINDS, query, "sensors", SENSORS),
        duty=None if duty is None else _one_of(DUTIES, "duty", duty),
        speed=_number(query, "speed", 0.0, FASTEST) if "speed" in query else 1.0,
        holds_oil=_HOLDS in query and _one_of(("oil",), _HOLDS, query[_HOLDS]) == "oil",
        strips=STRIPS if (strips := query.get("strips")) is None else () if strips == _NO else read_strips(strips),
        span=_one_of(tuple(SPANS), "span", query.get("span", SPAN)),
        tab=_one_of(TABS, "tab", query.get("tab", TABS[0])),
    )  # fmt: skip


def catalogue_name(machine: Machine) -> str | None:
    """The name of the catalogue's machine that is described the same; None if there is none.

    Example:
        >>> catalogue_name(load_machine("press"))
        'press'
    """
    if not catalogue.has("machine", machine.name):
        return None
    own, found = (list(as_toml(one, {})) for one in (machine, load_machine(machine.name)))
    return machine.name if own == found else None


def with_unit(setting: Setting, units: list[str]) -> str:
    """The unit that is shown of a machine with these.

    Raises:
        UnknownNameError: it does not run there, or one of those that the strips show.
    """
    for unit in units_of(setting.strips):
        _one_of(units, "unit", unit)
    return units[0] if setting.unit is None else _one_of(units, "unit", setting.unit)


def query_of(settings: Mapping[str, Any], scenario: str | None, machine: str | None) -> str:
    """The query of a link to a machine as it is set; the page adds what it alone knows.

    Args:
        scenario: that plays, which sets all the rest; None for none.
        machine: its name in the catalogue; None for the one that the studio was opened with.

    Example:
        >>> settings = {"knobs": {"leak": 1.6, "load": 0.5}, "faults": ["torque"], "duty": None, "speed": 1.0,
        ...             "sensors": ["kalman"], "holds_oil": False}
        >>> query_of(settings, None, "press")
        'machine=press&play=none&leak=1.6&faults=torque&sensors=kalman'
    """
    found = {} if machine is None else {"machine": machine}
    if scenario is not None:
        return urlencode(found | {"play": scenario})
    found["play"] = NOTHING
    for knob in KNOBS:
        value = knob.shown(settings["knobs"].get(knob.name, knob.si(knob.first)))
        if value != knob.first:
            found[knob.name] = f"{value:g}"
    if settings["faults"]:
        found["faults"] = ",".join(settings["faults"])
    if sorted(settings["sensors"]) != sorted(SENSORS):
        found["sensors"] = ",".join(settings["sensors"]) or _NO
    if settings["duty"]:
        found["duty"] = settings["duty"]
    if settings["speed"] != 1.0:
        found["speed"] = f"{settings['speed']:g}"
    if settings["holds_oil"]:
        found[_HOLDS] = "oil"
    return urlencode(found, safe=",")


def _one_of(known: Mapping[str, Any] | tuple[str, ...] | list[str], name: str, value: str) -> str:
    if value not in known:
        raise UnknownNameError(name, value, known, where="link")
    return value


def _some_of(
    known: Mapping[str, Any] | tuple[str, ...], query: Mapping[str, str], name: str, usual: tuple[str, ...]
) -> tuple[str, ...]:
    """Names with commas between them, each once and in the order in which they are known."""
    if name not in query:
        return usual
    listed = [] if query[name] in ("", _NO) else query[name].split(",")
    chosen = {_one_of(known, name, one) for one in listed}
    return tuple(one for one in known if one in chosen)


def _number(query: Mapping[str, str], name: str, least: float, most: float) -> float:
    try:
        value = decimal(query[name])
    except ValueError:
        value = math.nan
    if not least <= value <= most:
        raise DescriptionError(
            "is no value of this slider", key=f"link: {name}", value=query[name], allowed=f"{least:g} to {most:g}"
        )
    return value
