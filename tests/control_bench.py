"""Stages of the control by themselves, compiled and stepped or evaluated with plain numbers, and its graph replayed."""

import math
from dataclasses import dataclass, fields

import casadi as ca
import numpy as np

from ramsight.control.actuation import Actuation
from ramsight.control.decision import Sample
from ramsight.control.orders import Ask, Inputs
from ramsight.control.sensing import Sensed, reliance_on
from ramsight.control.thresholds import NO_PLACE
from ramsight.control.trajectory import Trajectory, advanced, at_rest, begun, setpoint
from ramsight.engine.recursion import Live, recursion_of, replay
from ramsight.engine.typed_state import initial_values, leaf, mapped, symbols
from ramsight.expression import Scalar
from ramsight.sensor.status import Status


def number(expression):
    """The value of an expression without symbols."""
    return float(ca.DM(ca.evalf(ca.SX(expression))))


def numbers(tree):
    """A tree of states or outputs as plain numbers."""
    return mapped(tree, lambda one: number(one.value))


@dataclass(frozen=True)
class _Order:
    begins: Scalar = leaf("1")
    position: Scalar = leaf("m")
    velocity: Scalar = leaf("m/s")
    target: Scalar = leaf("m")
    speed: Scalar = leaf("m/s")


class Way:
    """A trajectory, sample by sample."""

    def __init__(self, limits, stroke, period):
        initial = at_rest(limits, period)

        def stage(state, now):
            start = begun(state, now.position, now.velocity, period)
            goes = advanced(state, limits, stroke, limits.acceleration, now.target, now.speed, period)
            new = Trajectory(
                tuple(ca.if_else(now.begins, a, b) for a, b in zip(start.points, goes.points, strict=True)),
                ca.if_else(now.begins, start.velocity, goes.velocity),
            )
            return new, (*setpoint(new, period), new.velocity)

        names = ("position", "velocity", "lead")
        self._live = Live(recursion_of(initial, symbols(_Order()), names, stage), initial)
        self.begin(0.0)

    def begin(self, position, velocity=0.0):
        self.position, self.velocity, self._lead = self._live.step((1.0, position, velocity, 0.0, 0.0))

    def step(self, target, speed):
        self.position, self.velocity, self._lead = self._live.step((0.0, 0.0, 0.0, target, speed))

    @property
    def stands(self):
        return self.velocity == 0.0 and self._lead == 0.0


def sample_of(unit, *, by=None, target=0.3, motor_speed=0.0, at_limit=False, status=Status.OK, **inputs):
    """A sample of plain numbers; `inputs` are those of `Inputs`."""
    values = dict.fromkeys([one.name for one in fields(Inputs)], 0.0)
    values |= {"position": 0.3, "load": 2e5, "leak": 1.0, "displacement": 1.0, "speed": math.inf, "reported": 1.0}
    values |= {"ask": float(Ask.POSITION), "target": target, "status": float(status)} | inputs
    given = Inputs(**{name: ca.SX(value) for name, value in values.items()})
    by = by or Actuation.of(unit)
    sensed = Sensed(
        given.position, given.position_std, given.velocity, given.load, given.status, given.leak, given.displacement
    )
    return Sample(
        by, given, sensed, reliance_on(given.status), ca.SX(float(at_limit)), ca.SX(motor_speed), ca.SX(target),
        by.limits.acceleration,
    )  # fmt: skip


class Evaluated:
    """An object whose methods give plain numbers for plain numbers."""

    def __init__(self, of):
        self.of = of

    def __getattr__(self, name):
        value = getattr(self.of, name)
        if not callable(value):
            return value
        return lambda *given, **named: number(value(*given, **named))


def parameters_of(block):
    """Of the graph of a control: the largest acceleration of a move."""
    return np.array([block.by.limits.acceleration])


def said_by(block, rows, state=None):
    """What the graph of a control says, from its first state or a state that goes on."""
    state = initial_values(block.initial) if state is None else state
    return replay(block.recursion, np.ascontiguousarray(rows), parameters_of(block), state)


def same(unit, block, run):
    """Commands of the graph, whose orders stay at its inputs, in a recorded run: those of the live control."""
    said, recorded = said_by(block, run.rows), run.said
    np.testing.assert_array_equal(said[:, 1], recorded[:, 1])
    np.testing.assert_array_equal(np.where(said[:, 3] == NO_PLACE, np.nan, said[:, 3]), recorded[:, 2])
    assert np.abs(said[:, 0] - recorded[:, 0]).max() < 1e-9 * unit.max_speed
    return said
