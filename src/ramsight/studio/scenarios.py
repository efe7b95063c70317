"""The scenarios that the studio plays: what happens in each, the words beside it, and how they play on a rig.

What the words say of a machine stands behind a condition: they are shown once it has happened.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from ramsight.normal import TWO_SIDED_95
from ramsight.sensor.virtual_sensor import Estimate
from ramsight.studio.playing import ENDS
from ramsight.studio.rig import Rig, Row
from ramsight.tracking.comparing import ALERTS

LONGEST = 240.0
"""Time of the machine [s] that a scene may last; a machine that has not shown it by then does not show it."""
MISSED = f"This machine has not shown the next step within {LONGEST:g} s. The scenario ends here."


@dataclass(frozen=True)
class View:
    """What a scene looks at."""

    rig: Rig
    unit: str
    row: Row
    since: float  # the scene began [s]

    @property
    def kalman(self) -> Estimate | None:
        """What the self-calibrating sensor reports."""
        return self.row.estimates.get("kalman")

    @property
    def validity(self) -> str:
        """Validity of its status; "" if it reports nothing."""
        return "" if self.kalman is None else self.kalman.status.validity

    @property
    def share(self) -> float:
        """Where the piston is, over the stroke."""
        return self.row.position / self.rig.sheet[self.unit].cylinder.stroke

    @property
    def band(self) -> float:
        """Half the 95 % band over the stroke; infinite if nothing is reported."""
        if self.kalman is None:
            return float("inf")
        return TWO_SIDED_95 * self.kalman.position_std / self.rig.sheet[self.unit].cylinder.stroke

    def error(self, kind: str) -> float:
        """How far a sensor is off [m]; 0 if it reports nothing."""
        said = self.row.estimates.get(kind)
        return 0.0 if said is None else abs(said.position - self.row.position)


def _nothing(rig: Rig, unit: str) -> None:
    """Change nothing."""


@dataclass(frozen=True)
class Scene:
    """A part of a scenario."""

    words: str
    until: Callable[[View], bool]  # whether it is over
    act: Callable[[Rig, str], None] = _nothing  # done to the machine when it begins


@dataclass(frozen=True)
class Scenario:
    """A story of a machine."""

    title: str
    sentence: str
    scenes: tuple[Scene, ...]
    closing: str  # words at the end
    try_this: str  # what a visitor can do next
    pace: float = 3.0  # times faster than real time


@dataclass
class Telling:
    """How far a scenario is, as plain values for a page."""

    name: str  # of the scenario, as a link has it
    words: list[str] = field(default_factory=list)
    over: bool = False  # whether it has ended
    missed: bool = False  # whether that is because the machine has not shown what was waited for


class Storyteller:
    """Plays one scenario on the first unit of a rig."""

    def __init__(self, rig: Rig, name: str, scenario: Scenario) -> None:
        self._rig, self._scenario, self._unit = rig, scenario, next(iter(rig.sheet))
        self._telling, self._place, self._begun = Telling(name), 0, 0.0
        rig.begin()
        self._enter(0.0)

    @property
    def telling(self) -> dict[str, Any]:
        """How far it is: the fields of `Telling`."""
        return asdict(self._telling)

    @property
    def over(self) -> bool:
        """Whether it has ended."""
        return self._telling.over

    def look(self, rows: Mapping[str, Row]) -> None:
        """Go on to the next scene if this one is over."""
        if self._telling.over:
            return
        row = rows[self._unit]
        view = View(self._rig, self._unit, row, row.time - self._begun)
        if self._scenario.scenes[self._place].until(view):
            self._place += 1
            self._enter(row.time)
        elif view.since > LONGEST:
            self._end(MISSED, missed=True)

    def _enter(self, time: float) -> None:
        self._begun = time
        if self._place == len(self._scenario.scenes):
            self._end(self._scenario.closing)
            return
        scene = self._scenario.scenes[self._place]
        scene.act(self._rig, self._unit)
        self._rig.marks.add(time, f"step {self._place + 1}")
        self._telling.words.append(scene.words)

    def _end(self, words: str, *, missed: bool = False) -> None:
        self._telling.words.append(words)
        self._telling.over, self._telling.missed = True, missed


FIRST, NOTHING = "ends", "none"
"""The scenario that a new page opens on; the word of a link for none at all."""
_LEAK = 1.6  # of the data sheet: a pump that is due for an overhaul
_EARLY = 0.7  # of the stroke, where an obstacle stands
_WARMER = 10.0  # K, by which oil warms while nobody measures it
_SLIPPED = 15e-3  # m, by which the magnet of a transducer has moved on its rod
_NEAR = 0.02  # of the stroke: an error that a visitor sees
_DARK = 6.0  # s without power
_READ = 12.0  # s of the machine's time, in which a sentence is read


def _works(rig: Rig, *, known: bool) -> None:
    rig.begin(known=known)
    rig.play(ENDS)


def _unknown(rig: Rig, unit: str) -> None:
    _works(rig, known=False)


def _known(rig: Rig, unit: str) -> None:
    _works(rig, known=True)


def _wear(rig: Rig, unit: str) -> None:
    _known(rig, unit)
    rig.turn(replace(rig.knobs, leak=_LEAK))


def _obstruct(rig: Rig, unit: str) -> None:
    _unknown(rig, unit)
    rig.obstruct({unit: _EARLY * rig.sheet[unit].cylinder.stroke})


def _warm(rig: Rig, unit: str) -> None:
    rig.turn(replace(rig.knobs, oil_temperature=rig.knobs.oil_temperature + _WARMER))


def _mend(rig: Rig, unit: str) -> None:
    rig.fault("temperature", on=False)
    rig.start_sensors("balance")


def _add_second(rig: Rig, unit: str) -> None:
    _known(rig, unit)
    rig.add_second(unit)


def _slip(rig: Rig, unit: str) -> None:
    rig.second[unit].slipped = _SLIPPED


def _ok(view: View) -> bool:
    return view.since > 1.0 and view.validity == "ok"


def _uncertain(view: View) -> bool:
    return view.validity == "uncertain"


def _read(view: View) -> bool:
    return view.since > _READ


def _closed(view: View) -> bool:
    """The band is millimetres, in the middle of the stroke: learned, not pressed against an end."""
    return view.validity == "ok" and view.band < _NEAR and 0.3 < view.share < 0.7


def _learned(view: View) -> bool:
    """The balance is off by what an eye sees, and `kalman` by much less."""
    stroke = view.rig.sheet[view.unit].cylinder.stroke
    off = {kind: view.error(kind) / stroke for kind in ("kalman", "balance")}
    return view.since > 30.0 and view.validity == "ok" and off["balance"] > max(_NEAR, 3.0 * off["kalman"])


_ENDS = Scenario(
    "The sensor finds its position",
    "A machine at work meets its end stops, and the band closes from the whole stroke to millimetres.",
    (
        Scene(
            "The machine works from end to end, and no sensor sees the rod. The sensor starts without a position: it"
            " says *not referenced*, its band is the whole stroke, and its position must not be used.",
            _uncertain,
            _unknown,
        ),
        Scene(
            "The rod has pressed on an end stop, and the sensor has recognised the contact by torque and speed. It"
            " knows now where it is, if that was the cylinder's end. It may have been the ground: so it says"
            " *uncertain*, with a wide band.",
            _ok,
        ),
        Scene(
            "The other end was where the stroke says. Both agree: the status is *ok*, and the band is a few"
            " millimetres. The plain balance was given the true start, and cannot check itself.",
            _closed,
        ),
        Scene(
            "From end to end the band grows a little, and closes at the next contact. Every contact also shows how"
            " much the pumps leak.",
            lambda view: view.since > 40.0,
        ),
    ),
    "The sensor has its position, and keeps it as long as the machine meets an end now and then.",
    "Choose *lift and lower* as duty cycle in the controls: the machine meets no end any more. Watch how long the"
    " status remains *ok*.",
)

_WORN = Scenario(
    "A worn pump",
    f"The pumps leak {_LEAK:g} times what the data sheet says, and no sensor is given that.",
    (
        Scene(
            f"The pumps leak {_LEAK:g} times as much as on the data sheet, which is all that both sensors have. Both"
            " count oil that never reached the cylinder: both run ahead of the rod.",
            _ok,
            _wear,
        ),
        Scene(
            "At the end stop `kalman` has seen how far it was off, and what leakage explains that. The plain balance"
            " takes nothing from it.",
            _learned,
        ),
        Scene(
            "The same pump, the same reports: the balance is several times as far off as `kalman`, which has learned"
            " the leakage. The balance has no band, so it says *unchecked* at best.",
            _read,
        ),
    ),
    "A sensor that learns from its end stops needs no new data sheet when the pump wears.",
    "Set *leakage* to 2.5 at once in the controls. Wear comes in months; a jump is more than the sensor expects, and it"
    " takes some ends until it is *ok* again.",
)

_GROUND = Scenario(
    "The ground is met early",
    "Something stops the rod before its end, and the sensor cannot feel the difference.",
    (
        Scene(
            f"The sensor starts without a position, and an obstacle stands at {_EARLY:.0%} of the stroke, as the ground"
            " below a bucket does.",
            _uncertain,
            _obstruct,
        ),
        Scene(
            "The rod was stopped, and the sensor takes that for an end. Its error is a sixth of the stroke, and so is"
            " its deviation: one contact can be wrong, and for that reason the status is *uncertain* and not *ok*.",
            lambda view: view.since > 10.0 and view.share < 0.02,
        ),
        Scene(
            "The true end of the other side. The two contacts are closer together than the stroke is long, so one of"
            " them was no end. The sensor cannot know which one, and stays *uncertain*.",
            lambda view: view.since > 5.0 and view.share > 0.1,
        ),
        Scene(
            "The obstacle is gone. The next contact is the cylinder's own end.",
            lambda view: _ok(view) and view.error("kalman") < 0.01,
            lambda rig, unit: rig.obstruct({}),
        ),
    ),
    "Two contacts a stroke apart: the sensor is right again, and *ok* for the first time.",
    "Switch *an obstacle* on in the controls while the status is *ok*, and see what a sensor that knows both ends makes"
    " of a stop that is none.",
)

_THERMOMETER = Scenario(
    "The thermometer fails",
    "The oil temperature is lost while the oil warms up.",
    (
        Scene("First the sensor meets its ends, with a thermometer that works.", _closed, _known),
        Scene(
            "The thermometer's cable is broken. The sensor goes on with the last good temperature and says so. The"
            " plain balance has no value to go on with.",
            _read,
            lambda rig, unit: rig.fault("temperature", on=True),
        ),
        Scene(
            f"The oil warms by {_WARMER:g} K, and nobody measures it. Warm oil leaks more than the sensor works out:"
            " the error grows, and the band knows nothing of the reason. That is what *uncertain* is for.",
            lambda view: view.since > 60.0,
            _warm,
        ),
        Scene(
            "The cable is mended. The new temperature is far from the last one: it is not accepted at once.", _ok, _mend
        ),
    ),
    "Thermometer and status are back.",
    "Set *thermometer offset* to 10 K in the controls: a wrong value that is plausible is harder than none.",
)

_POWER = Scenario(
    "Power is cut",
    "The drive goes dark, and the position is there again when power returns.",
    (
        Scene("First the sensor meets its ends.", _closed, _known),
        Scene(
            "The machine stops for a moment: the load is held by its valves.",
            lambda view: view.since > 3.0,
            lambda rig, unit: rig.play(None),
        ),
        Scene(
            "Power is cut. No sensor reports anything, and nothing is green. The state of `kalman` is in its file.",
            lambda view: view.since > _DARK,
            lambda rig, unit: rig.fault("power", on=True),
        ),
        Scene(
            "Power is back. The sensor resumes where the piston rested, with what it has learned.",
            lambda view: view.since > 3.0 and view.validity != "",
            lambda rig, unit: rig.fault("power", on=False),
        ),
        Scene(
            "The machine works on, without a visit to an end.",
            lambda view: view.since > 20.0,
            lambda rig, unit: rig.play(ENDS),
        ),
    ),
    "A power cut at rest costs no reference.",
    "Cut the power in the controls while the machine moves: a saved state of a moving piston has no position.",
)

_SECOND = Scenario(
    "A second channel",
    "A real position sensor beside the virtual one: its magnet slips, and the comparison finds out which is wrong.",
    (
        Scene(
            "A transducer on the rod reports the position, too. As long as the virtual sensor may be off by the whole"
            " stroke, the comparison says *unchecked*.",
            _closed,
            _add_second,
        ),
        Scene(
            f"The transducer's magnet slips by {1e3 * _SLIPPED:g} mm. That is within the bound of the virtual sensor,"
            " which is several times its band: both still agree. The bound is narrowest at an end stop.",
            lambda view: view.row.second is not None and view.row.second.verdict in ALERTS,
            _slip,
        ),
        Scene("The virtual sensor has met its end and is sure. The two are apart, and the alert says so.", _read),
    ),
    "Two sensors of different principles: one wrong sensor is found out at the next end stop.",
    "Give *boom: faulty limit switch* in the controls, and see which of the two the comparison names.",
)

SCENARIOS = {
    FIRST: _ENDS, "worn": _WORN, "ground": _GROUND, "thermometer": _THERMOMETER, "power": _POWER, "second": _SECOND,
}  # fmt: skip
"""Scenarios by the names that a link uses."""
