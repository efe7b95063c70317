"""A run of a unit under control, recorded: what an exported control is compared on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ramsight.control.block import ACTIVITIES, Ask, Block
from ramsight.control.setting import Setting
from ramsight.control.unit_loop import UnitLoop
from ramsight.plant.limits import limits_of
from ramsight.plant.unit import HydraulicUnit

Array = NDArray[np.float64]

_LOAD, _MORE = 0.3, 0.5  # of the load at relief pressure, at first and then
_START = 0.4  # of the stroke
_NO_TARGET = float("nan")


class RecordedRun:
    """A run of Python's control around a simulated unit: moves, a hand, a load that changes, a sensor that is lost.

    Args:
        unit: the unit.
        block: the control that is exported; its limits and period are those of the run.

    Attributes:
        rows: what the control was given, a column each of `ramsight.control.block.INPUTS`, shape (samples, 11).
        said: motor speed [rad/s] and activity, as `PositionControl` had them, shape (samples, 2).
    """

    def __init__(self, unit: HydraulicUnit, block: Block) -> None:
        stroke, full = unit.cylinder.stroke, limits_of(unit).load
        self._name, self._full, self._stroke = unit.name, full, stroke
        self._asked: list[tuple[float, float, float, float]] = []
        limits = {unit.name: block.limits}
        setting = Setting(known=True, limits=limits, period=block.period)
        self._loop = UnitLoop(unit, unit, _START * stroke, _LOAD * full, setting)
        self._run(block.limits.speed)
        self.rows, self.said = self._recorded()

    def _run(self, speed: float) -> None:
        loop, name = self._loop, self._name
        self._go_on(0.3)
        self._send(0.5, wait=True)
        self._send(0.42, wait=True)
        self._steer(0.8 * speed, 2.0)
        self._send(0.3, wait=False)
        self._go_on(2.0)
        self._steer(-0.3 * speed, 1.0)
        self._steer(0.0, 1.0)
        self._send(0.35, wait=True)
        loop.load(_MORE * self._full, 0.5)
        self._note(Ask.POSITION, 0.35)
        self._send(0.25, wait=False)
        self._go_on(1.0)
        self._stop()
        loop.controls[name].steer(0.2 * speed)
        self._go_on(0.5, Ask.STEER, steering=0.2 * speed)
        self._send(0.2, wait=False)
        self._go_on(1.0)
        loop.fault = lambda _, now: replace(now, motor_torque=_NO_TARGET)
        self._go_on(0.5)

    def _note(self, ask: Ask, share: float = _NO_TARGET, steering: float = 0.0) -> None:
        """What was asked for in the samples since the last note."""
        more = len(self._loop.time) - len(self._asked)
        self._asked += [(float(ask), share * self._stroke, steering, np.inf)] * more

    def _go_on(self, time: float, ask: Ask | None = None, steering: float = 0.0) -> None:
        before = self._asked[-1] if self._asked else (float(Ask.POSITION), _NO_TARGET, 0.0, np.inf)
        self._loop.rest(time)
        used = before if ask is None else (float(ask), _NO_TARGET, steering, np.inf)
        self._asked += [used] * (len(self._loop.time) - len(self._asked))

    def _send(self, share: float, *, wait: bool) -> None:
        self._loop.send({self._name: share * self._stroke})
        if wait:
            self._loop.wait()
        else:
            self._loop.step()
        self._note(Ask.POSITION, share)

    def _steer(self, velocity: float, time: float) -> None:
        self._loop.controls[self._name].steer(velocity)
        self._go_on(time, Ask.STEER, velocity)

    def _stop(self) -> None:
        self._loop.controls[self._name].stop("asked to stop")
        self._go_on(0.3, Ask.STOP)

    def _recorded(self) -> tuple[Array, Array]:
        record = self._loop.records[self._name]
        rows = [
            (e.position, e.velocity, e.load, float(e.status), r.oil_temperature, *learned, *asked)
            for e, r, learned, asked in zip(
                record.estimate, record.reported, record.learned, self._asked, strict=True
            )
        ]  # fmt: skip
        said = [
            (command, float(ACTIVITIES.index(activity)))
            for command, activity in zip(record.asked, record.activity, strict=True)
        ]
        return np.array(rows), np.array(said)
