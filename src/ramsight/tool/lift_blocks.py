"""Samples of a motion summed in blocks of a tenth of a second, of which the newest few are kept: a fixed memory.

A motion goes one way. Its last blocks are not known to be its last ones before it has ended, so that blocks wait in a
line. What leaves the line is weighed; what is in it when the motion ends is not.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import casadi as ca

from ramsight.engine.typed_state import chosen, emptied, inlined, leaf, mapped
from ramsight.expression import Flag, Scalar, all_of, any_of, count, negated
from ramsight.tool.weighing_limits import BRIDGED, CLOCK_BACK, LARGEST, SLOWS, SUMMED

WAITING = round(SLOWS / SUMMED)
"""Blocks of a line that are newer than the one that leaves it."""
CLOCK_ROUNDING = 1e-4
"""By which two times that are as far apart as they should be may differ [s]."""


@dataclass(frozen=True)
class Rod:
    """What the sensor of a unit says of its rods; of a block, sums of it."""

    position: Scalar = leaf("m")  # NaN where it is not known
    velocity: Scalar = leaf("m/s")
    std: Scalar = leaf("m")  # of the position


@dataclass(frozen=True)
class Sample:
    """What sensors say at a time."""

    rods: Mapping[str, Rod] = inlined()  # of each unit, by its name
    time: Scalar = leaf("s")
    # load, load_std, load_age: of the unit that lifts
    load: Scalar = leaf("N")
    load_std: Scalar = leaf("N")
    load_age: Scalar = leaf("s")


@dataclass(frozen=True)
class Block:
    """Sums over its samples."""

    rods: Mapping[str, Rod] = inlined()
    count: Scalar = leaf("1")
    # first, last: times of its samples after the motion's start
    first: Scalar = leaf("s")
    last: Scalar = leaf("s")
    time: Scalar = leaf("s")  # sum of these times
    load: Scalar = leaf("N")
    variance: Scalar = leaf("N2")  # of the load
    # steps, step, step_squares: of the load from sample to sample, how many, their sum, and that of their squares
    steps: Scalar = leaf("1")
    step: Scalar = leaf("N")
    step_squares: Scalar = leaf("N2")

    @property
    def at(self) -> Scalar:
        """Mean time after the motion's start [s]."""
        return self.time / ca.fmax(self.count, 1.0)

    def mean(self, name: str) -> Rod:
        """A unit's rods on average."""
        return mapped(self.rods[name], lambda one: one.value / ca.fmax(self.count, 1.0))


@dataclass(frozen=True)
class Motion:
    """Which motion goes on."""

    direction: Scalar = leaf("1")  # +1 lifts, -1 lowers, 0: none
    started: Scalar = leaf("s")  # time of its first sample
    moved: Scalar = leaf("s")  # time of its last sample in motion
    latest: Scalar = leaf("s", -LARGEST)  # time of the last sample
    load: Scalar = leaf("N")  # at that


@dataclass(frozen=True)
class Blocks:
    """A motion, and its newest blocks."""

    block: Block
    line: tuple[Block, ...]  # complete ones, the newest first
    motion: Motion = Motion()

    @classmethod
    def none(cls, units: tuple[str, ...]) -> Blocks:
        """Before the first sample."""
        empty = Block({name: Rod() for name in units})
        return cls(empty, (empty,) * (WAITING + 2))


@dataclass(frozen=True)
class Events:
    """What a sample does to a motion."""

    ends: Flag  # one ends before this sample
    begins: Flag  # one begins with it
    completes: Flag  # a block is complete


def summed(state: Blocks, sample: Sample, unit: str, slowest: float, lift_sign: float) -> tuple[Blocks, Events]:
    """A sample more.

    Args:
        unit: that lifts.
        slowest: velocity of its rods from which on they move [m/s].
        lift_sign: +1 where extension lifts, -1 where retraction does.
    """
    before, time = state.motion, sample.time
    since = time - before.latest
    is_new = any_of(since > 0.0, since < -CLOCK_BACK)
    lifting = lift_sign * sample.rods[unit].velocity
    moves = all_of(since > 0.0, since <= BRIDGED + CLOCK_ROUNDING, sample.load_age <= 0.0, ca.fabs(lifting) > slowest)
    side = ca.if_else(moves, ca.if_else(lifting > 0.0, 1.0, -1.0), 0.0)
    goes = before.direction != 0.0
    paused = any_of(since < 0.0, since > BRIDGED + CLOCK_ROUNDING, time - before.moved > BRIDGED + CLOCK_ROUNDING)
    ends = all_of(is_new, goes, any_of(paused, side == -before.direction))
    begins = all_of(moves, any_of(negated(goes), ends))
    inside = all_of(is_new, any_of(begins, all_of(goes, negated(ends))))
    started = ca.if_else(begins, time, before.started)
    completes = all_of(inside, negated(begins), time - started - state.block.first >= SUMMED - CLOCK_ROUNDING)
    motion = Motion(
        direction=ca.if_else(begins, side, ca.if_else(ends, 0.0, before.direction)),
        started=started,
        moved=ca.if_else(moves, time, before.moved),
        latest=ca.if_else(is_new, time, before.latest),
        load=ca.if_else(inside, sample.load, before.load),
    )
    step = ca.if_else(begins, 0.0, sample.load - before.load)
    empty = emptied(state.block)
    base = chosen(any_of(begins, completes), replace(empty, first=time - started), state.block)
    block = chosen(inside, _with(base, sample, time - started, step, negated(begins)), state.block)
    line = tuple(
        chosen(completes, newer, chosen(begins, empty, own))
        for newer, own in zip((state.block, *state.line), state.line, strict=False)
    )
    return Blocks(block, line, motion), Events(ends, begins, completes)


def _with(block: Block, sample: Sample, at: Scalar, step: Scalar, stepped: Flag) -> Block:
    rods = {}
    for name, one in sample.rods.items():
        rod = block.rods[name]
        known = ca.fabs(one.velocity) <= LARGEST  # an unknown velocity is of a rod that stands
        rods[name] = Rod(
            rod.position + one.position, rod.velocity + ca.if_else(known, one.velocity, 0.0), rod.std + one.std
        )
    return Block(
        rods=rods,
        count=block.count + 1.0,
        first=block.first,
        last=at,
        time=block.time + at,
        load=block.load + sample.load,
        variance=block.variance + sample.load_std**2,
        steps=block.steps + count(stepped),
        step=block.step + step,
        step_squares=block.step_squares + step**2,
    )
