"""Weighs what a machine lifts while it works: sample by sample, from what its sensors say."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from concurrent.futures import Future

from ramsight.sensor.virtual_sensor import VirtualSensor
from ramsight.tool.force_scale import Scale
from ramsight.tool.live_lifts import LiveLifts, Work
from ramsight.tool.weighing_events import Plain, Scene, Weighing
from ramsight.tool.weighing_tally import Tally

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
