"""Weighs what a machine lifts, sample by sample from what its sensors say, or from tracks of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ramsight.arrays import Array
from ramsight.engine.recursion import Live, replay
from ramsight.engine.typed_state import initial_values
from ramsight.normal import TWO_SIDED_95
from ramsight.sensor.status import is_invalid
from ramsight.sensor.virtual_sensor import HIGHEST, LOWEST, VirtualSensor
from ramsight.signals import Signals
from ramsight.tool.force_scale import TERMS, Scale
from ramsight.tool.lift_law import ENDED, LiftLaw, lift_law
from ramsight.tool.lift_values import QUALITIES
from ramsight.tool.unit_tracks import standing
from ramsight.tool.weighing_events import Moment, Plain, Scene, Weighing
from ramsight.tool.weighing_limits import CLOCK_BACK
from ramsight.tool.weighing_tally import Tally

_AT_ONCE = 100_000  # samples whose outputs are kept at a time
_REST = 0.2  # s after the last sample, when a motion that has not ended does: longer than a pause of a lift


def law_of(scene: Scene) -> LiftLaw:
    """The recursion of a scene's lifts."""
    return lift_law(scene.machine.mechanism, scene.machine.unit(scene.unit), scene.chart)


def lifts(scene: Scene, track: Signals) -> list[Plain]:
    """All motions of a log as lifts by the described machine.

    Args:
        track: of the unit that lifts, with position, velocity, load, load_std, load_age and status.
    """
    law, rows = law_of(scene), rows_of(scene, track)
    state, found = initial_values(law.initial), []
    for first in range(0, len(rows), _AT_ONCE):
        said = replay(law.recursion, rows[first : first + _AT_ONCE], np.array([scene.inclination]), state)
        found += [plain_of(law, row) for row in said[said[:, 0] > 0.0].tolist()]
    return found


def rows_of(scene: Scene, track: Signals) -> Array:
    """The inputs of the recursion, shape (samples, inputs), and at last a sample at which nothing moves any more."""
    time, law = track["time"].values, law_of(scene)
    rods = scene.others.rods(scene.machine, scene.unit, track)
    parts = [(rods.position[:, k], rods.velocity[:, k], rods.std[:, k]) for k in range(len(law.units))]
    own = [track[name].values for name in ("load", "load_std", "load_age")]
    rows = np.column_stack([column for part in parts for column in part] + [time, *own])
    return np.concatenate([rows, [_rest(law, float(time[-1]))]]) if len(time) else rows


def _rest(law: LiftLaw, time: float) -> list[float]:
    """A sample at which nothing moves."""
    return [0.0] * (len(law.recursion.inputs) - 4) + [time + _REST, 0.0, 0.0, math.inf]


def plain_of(law: LiftLaw, row: Sequence[float]) -> Plain:
    """The outputs of a sample that ends a motion as a lift."""
    said = dict(zip(law.recursion.outputs, row, strict=True))
    others = np.array([said[f"others[{k}]"] for k in range(len(law.units) - 1)])
    moment = Moment(said["per_mass"], said["moment_std"], said["covered"] > 0.0)
    return Plain(
        said["time"], said["duration"], said["upwards"] > 0.0, said["mass"],
        np.array([said[f"row[{k}]"] for k in range(len(TERMS))]), said["own_std"], others,
        QUALITIES[int(said["quality"])], moment if math.isfinite(said["per_mass"]) else None,
    )  # fmt: skip


class Weigher:
    """Finds lifts in what sensors say, and weighs them.

    Attributes:
        tally: the weighings so far.
        scene: the machine.
    """

    def __init__(self, scene: Scene, scale: Scale) -> None:
        self.scene, self.tally = scene, Tally(scale, scene.other_strokes, scene.rated)
        self._law = law_of(scene)
        self._live = Live(self._law.recursion, self._law.initial, [scene.inclination]).compiled()
        self._ended = self._law.recursion.outputs.index(ENDED)
        self._last = -math.inf
        self._still = {name: standing(scene.machine, name, scene.others) for name in self._law.units}

    def step(self, time: float, sensors: Mapping[str, VirtualSensor]) -> Weighing | None:
        """Take what sensors said last.

        Args:
            time: of the sample [s]; one that is not after the one before is passed over.
            sensors: by the names of their units.

        Returns:
            The last weighing, where it is new or has become better.
        """
        if not -CLOCK_BACK <= time - self._last <= 0.0:
            self._last = time
        own = sensors[self.scene.unit]
        rods: list[float] = []
        for name in self._law.units:
            rods += _rod(sensors[name]) if name in sensors else self._still[name]
        return self._taken([*rods, time, own.says("load"), own.says("load_std"), own.says("load_age")])

    def finish(self) -> Weighing | None:
        """Weigh the motion that has not ended yet, where no more samples come; returns as `step`."""
        return self._taken(_rest(self._law, self._last))

    def _taken(self, row: Sequence[float]) -> Weighing | None:
        said = self._live.step(row)
        return self.tally.add(plain_of(self._law, said)) if said[self._ended] > 0.0 else None


def _rod(sensor: VirtualSensor) -> tuple[float, float, float]:
    """Position, velocity and standard deviation of the position, as `Others.rods` has them of a track."""
    position = math.nan if is_invalid(sensor.says("status")) else sensor.says("position")
    if LOWEST in sensor.outputs:
        half = 0.5 * (sensor.says(HIGHEST) - sensor.says(LOWEST))
    else:
        half = TWO_SIDED_95 * sensor.says("position_std")
    return position, sensor.says("velocity"), half / TWO_SIDED_95
