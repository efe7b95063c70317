"""Weighs what a machine lifts while it works: sample by sample, from what its sensors say.

A lift follows from the samples of its motion alone. So samples are kept while something moves, and the stretch goes to
`lifts` once no later sample can belong to it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from dataclasses import replace
from functools import partial

import numpy as np

from ramsight.sensor.virtual_sensor import HIGHEST, LOWEST, VirtualSensor
from ramsight.signals import TIME, Signal, Signals
from ramsight.tool.force_scale import Scale
from ramsight.tool.weighing_events import Plain, Scene, Weighing, lifts
from ramsight.tool.weighing_limits import BRIDGED, MOVING
from ramsight.tool.weighing_tally import Tally

Work = Callable[[], list[Plain]]
"""What finds the lifts of a motion that has ended: some hundredths of a second of work."""
_LONGEST = 600.0  # s of a motion that are kept; a rod that counts as moving goes through its stroke in 250 s
_OUTPUTS = ("position", "position_std", "velocity", "load", "load_std", "load_age", LOWEST, HIGHEST, "status")


class LiveLifts:
    """Finds lifts in what sensors say."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._slowest = MOVING * scene.machine.unit(scene.unit).cylinder.stroke
        self._last = self._moved = -np.inf  # times of the last sample, and of the last one in motion [s]
        self._rows: list[list[float]] = []
        self._columns: list[tuple[str, str]] = []

    def step(self, time: float, sensors: Mapping[str, VirtualSensor]) -> Work | None:
        """Take what sensors said last.

        Args:
            time: of the sample [s]; `lifts` passes over one that is not after the one before.
            sensors: by the names of their units, the same ones at each step.

        Returns:
            The work on a motion that has ended: nothing has moved for the time that a pause of a lift may take.
        """
        before, self._last = self._last, time
        if not self._columns:
            self._columns = [(unit, name) for unit, one in sensors.items() for name in _OUTPUTS if name in one.outputs]
        row = [time, *(sensors[unit].says(name) for unit, name in self._columns)]
        found = None
        if self._rows and (time - self._moved > BRIDGED or time - self._rows[0][0] > _LONGEST):
            found = self.finish()
            self._rows = [[before, *(np.nan for _ in self._columns)]]  # at rest: what follows it is no gap
        self._rows.append(row)
        own = sensors[self._scene.unit]
        if abs(own.says("velocity")) > self._slowest and own.says("load_age") <= 0.0:
            self._moved = time
        return found

    def finish(self) -> Work | None:
        """The work on the motion that has not ended yet, where no more samples come."""
        rows, self._rows = self._rows, []
        if not rows or self._moved < rows[0][0]:
            return None
        time, *columns = np.ascontiguousarray(np.array(rows).T)
        tracks: dict[str, dict[str, Signal]] = {}
        for (unit, name), values in zip(self._columns, columns, strict=True):
            tracks.setdefault(unit, {TIME: Signal(time)})[name] = Signal(values)
        own = Signals(tracks.pop(self._scene.unit))
        beside = {unit: Signals(one) for unit, one in tracks.items()}
        return partial(lifts, replace(self._scene, others=replace(self._scene.others, tracks=beside)), own)


Start = Callable[[Work], "Future[list[Plain]]"]


def at_once(work: Work) -> Future[list[Plain]]:
    """Do the work now."""
    done: Future[list[Plain]] = Future()
    done.set_result(work())
    return done


class Weigher:
    """Finds lifts in what sensors say, and weighs them.

    Args:
        start: begins the work on a motion that has ended, as `Executor.submit` does where samples must not wait for it.

    Attributes:
        tally: the weighings so far.
        scene: the machine.
    """

    def __init__(self, scene: Scene, scale: Scale, start: Start = at_once) -> None:
        self._lifts, self._start = LiveLifts(scene), start
        self._begun: deque[Future[list[Plain]]] = deque()
        self.scene, self.tally = scene, Tally(scale, scene.other_strokes, scene.rated)

    def step(self, time: float, sensors: Mapping[str, VirtualSensor]) -> Weighing | None:
        """Take what sensors said last, as `LiveLifts.step`; the last weighing, where it is new or has become better."""
        self._begin(self._lifts.step(time, sensors))
        return self._counted()

    def finish(self) -> Weighing | None:
        """Weigh the motion that has not ended yet, where no more samples come; returns as `step`."""
        self._begin(self._lifts.finish())
        return self._counted(wait=True)

    def _begin(self, work: Work | None) -> None:
        if work is not None:
            self._begun.append(self._start(work))

    def _counted(self, *, wait: bool = False) -> Weighing | None:
        """Count the motions whose work is done."""
        newest = None
        while self._begun and (wait or self._begun[0].done()):
            for one in self._begun.popleft().result():
                newest = self.tally.add(one) or newest
        return newest
