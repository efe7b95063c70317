"""A scenario that plays on a rig: scene by scene, each with its words, until what it waits for has happened."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from ramsight.normal import TWO_SIDED_95
from ramsight.sensor.virtual_sensor import Estimate
from ramsight.studio.rig import Rig, Row

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
