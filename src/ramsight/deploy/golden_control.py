"""Runs of a unit under control, recorded: what a control that is a graph, or C, is compared on."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ramsight.arrays import Array
from ramsight.closed_loop.loop import UnitLoop
from ramsight.closed_loop.referencing import LoopSettings
from ramsight.control.activity import ACTIVITIES, Activity
from ramsight.control.block import Block
from ramsight.control.orders import Ask
from ramsight.plant.limits import limits_of
from ramsight.plant.unit import HydraulicUnit

_LOAD, _MORE = 0.3, 0.5  # of the load at relief pressure, at first and then
_START = 0.4  # of the stroke
_NO_TARGET = float("nan")


class Recording:
    """Python's control around a simulated unit, with what it was asked for at every sample.

    Args:
        block: the control that is compared; its limits, period and declared drive are those of the run.
        start: where the rod is, over the stroke [1].
        load: on it, over the load at relief pressure [1].

    Attributes:
        loop: plant, drive, sensor and control.
    """

    def __init__(
        self, unit: HydraulicUnit, block: Block, start: float = _START, load: float = _LOAD, *, known: bool = True
    ) -> None:
        self._name, self.full, self._stroke = unit.name, limits_of(unit).load, unit.cylinder.stroke
        self._asked: list[tuple[float, float, float, float]] = []
        self._references: dict[int, float] = {}
        setting = LoopSettings(
            known=known,
            assumptions=unit.assumptions,  # as the exported sensor has them
            limits={unit.name: block.by.limits},
            period=block.by.period,
            drive=block.response,
        )
        self.loop = UnitLoop(unit, unit, start * self._stroke, load * self.full, setting)
        self._note(Ask.POSITION)

    def go_on(self, time: float) -> None:
        """Let a time pass [s]; what is asked for stays."""
        self.loop.rest(time)
        self._asked += self._asked[-1:] * (len(self.loop.time) - len(self._asked))

    def load(self, share: float, time: float) -> None:
        """Let a load come, over the one at relief pressure [1], over a time [s]."""
        self.loop.load(share * self.full, time)
        self.go_on(0.0)

    def send(self, share: float, *, wait: bool) -> None:
        """Send the rod to a target, over the stroke [1]."""
        self.loop.send({self._name: share * self._stroke})
        if wait:
            self.loop.wait()
        else:
            self.loop.step()
        self._note(Ask.POSITION, share)

    def steer(self, velocity: float, time: float) -> None:
        """Steer by hand [m/s] for a time [s]."""
        self.loop.controls[self._name].steer(velocity)
        self.loop.rest(time)
        self._note(Ask.STEER, steering=velocity)

    def home(self, *, lifted: bool, slow: bool = False, time: float = math.inf) -> None:
        """Visit an end stop until it is over, or for a time [s]."""
        control, ask = self.loop.controls[self._name], Ask.HOME_LIFTED if lifted else Ask.HOME_LOWERED
        if math.isfinite(time):
            control.home(lifted=lifted, slow=slow)
            self.loop.rest(time)
        else:
            self.loop.home(self._name, lifted=lifted, slow=slow, settle=0.0)
            if control.activity is Activity.RESTING:
                self._references[len(self.loop.time) - 1] = control.end(lifted=lifted)
        self._note(ask, speed=0.0 if slow else math.inf)

    def stop(self) -> None:
        """Stop, and stay so for a while."""
        self.loop.controls[self._name].stop("asked to stop")
        self.loop.rest(0.3)
        self._note(Ask.STOP)

    def leak_test(self) -> None:
        """A leak test, until it is over."""
        self.loop.leak_test(settle=0.0)
        self._note(Ask.LEAK_TEST)

    def lose(self, time: float) -> None:
        """Lose the torque for a time [s]."""
        self.loop.fault = lambda _, now: replace(now, motor_torque=_NO_TARGET)
        self.go_on(time)
        self.loop.fault = None

    def silence(self, time: float) -> None:
        """Lose the reports for a time [s]."""
        self.loop.fault = lambda *_: None
        self.go_on(time)
        self.loop.fault = None

    def _note(
        self, ask: Ask, share: float = _NO_TARGET, steering: float = 0.0, speed: float = math.inf
    ) -> None:  # fmt: skip
        """What was asked for in the samples since the last note."""
        more = len(self.loop.time) - len(self._asked)
        self._asked += [(float(ask), share * self._stroke, steering, speed)] * more

    @property
    def rows(self) -> Array:
        """The inputs of the control, a column each of `ramsight.control.orders.INPUTS`, shape (samples, 15)."""
        record, rows, before = self.loop.records[self._name], [], math.nan
        for e, r, learned, asked in zip(record.estimate, record.reported, record.learned, self._asked, strict=True):
            sensed = e.position, e.position_std, e.velocity, e.load, float(e.status), r.oil_temperature
            arrived, before = float(r.time != before), r.time  # a report that was lost is the last one once more
            rows.append((*sensed, *learned, arrived, r.motor_speed, r.motor_torque, *asked))
        return np.array(rows)

    @property
    def said(self) -> Array:
        """Motor speed [rad/s], activity and the stop that was pressed [m], as Python has them, shape (samples, 3)."""
        record = self.loop.records[self._name]
        said = [
            (command, float(ACTIVITIES.index(activity)), self._references.get(k, math.nan))
            for k, (command, activity) in enumerate(zip(record.asked, record.activity, strict=True))
        ]
        return np.array(said)


def golden_run(unit: HydraulicUnit, block: Block) -> Recording:
    """All that an exported control does: moves, a hand, a changing load, a visit, a lost drive, a lost sensor."""
    run, speed = Recording(unit, block), block.by.limits.speed
    run.go_on(0.3)
    run.send(0.5, wait=True)
    run.send(0.42, wait=True)
    run.steer(0.8 * speed, 2.0)
    run.send(0.3, wait=False)
    run.go_on(2.0)
    run.steer(-0.3 * speed, 1.0)
    run.steer(0.0, 1.0)
    run.send(0.35, wait=True)
    run.load(_MORE, 0.5)
    run.send(0.25, wait=False)
    run.go_on(1.0)
    run.stop()
    run.steer(0.2 * speed, 0.5)
    run.home(lifted=False)
    run.go_on(0.5)
    if block.by.holding.stands:
        run.leak_test()
    run.send(0.1, wait=False)
    run.go_on(1.0)
    run.silence(0.4)
    run.home(lifted=True, time=1.0)
    run.lose(0.5)
    return run
