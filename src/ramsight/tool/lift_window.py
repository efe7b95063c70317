"""What is kept of the blocks of a lift's window: sums of its least squares, where they change, and its load moment.

In a window of steady motion the least squares of the force balance, F = B + m P, give the mass

    m = sum P (F - B) / sum P^2,

with F the sensor's load, B the force that the bodies need and P that per kilogram. The sums are kept for the positions
as they are, for a slope more, and for each position a standard deviation more and less.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca

from ramsight.engine.typed_state import chosen, leaf
from ramsight.expression import Flag, Scalar, all_of, any_of, count, negated
from ramsight.tool.lift_blocks import CLOCK_ROUNDING, WAITING, Blocks, Events
from ramsight.tool.weighing_limits import BLOCK, INCLINATION_STD, LARGEST, SETTLES, SLOWS, STEADY


@dataclass(frozen=True)
class Laws:
    """The mechanism of a lift."""

    unit: str  # that lifts
    # at_rest: positions [m] and slope [rad] to the force of the bodies [N] and that per kilogram [N/kg]
    at_rest: Callable[[Any, Scalar], tuple[Scalar, Scalar]]
    # by_motion: positions, velocities, accelerations and slope to what motion adds to both
    by_motion: Callable[[Any, Any, Any, Scalar], tuple[Scalar, Scalar]]
    # moment: positions and slope to the load moment of a kilogram over the rated one [1/kg], and whether the load chart
    # has their reach; None without a chart
    moment: Callable[[Any, Scalar], tuple[Scalar, Flag]] | None


@dataclass(frozen=True)
class Sums:
    """Of the least squares."""

    pp: Scalar = leaf("N2/kg2")
    pf: Scalar = leaf("N2/kg")
    pb: Scalar = leaf("N2/kg")

    def and_block(self, weight: Scalar, bodies: Scalar, payload: Scalar, force: Scalar) -> Sums:
        """With a block more; without one that is beyond the mechanism."""
        known = ca.fabs(payload) <= LARGEST

        def more(value: Scalar, by: Scalar) -> Scalar:
            return value + ca.if_else(known, weight * payload * by, 0.0)

        return Sums(more(self.pp, payload), more(self.pf, force), more(self.pb, bodies))

    @property
    def mass(self) -> Scalar:
        """The mass [kg]; infinite where all is beyond the mechanism."""
        return ca.if_else(self.pp > 0.0, (self.pf - self.pb) / self.pp, math.inf)


@dataclass(frozen=True)
class Part:
    """Half a second of a window."""

    first: Scalar = leaf("s")
    count: Scalar = leaf("1")
    mass: Scalar = leaf("kg")  # sum over its samples

    @property
    def mean(self) -> Scalar:
        """Mass on average [kg]."""
        return self.mass / ca.fmax(self.count, 1.0)


@dataclass(frozen=True)
class Changes:
    """How the masses of parts differ, with the place at which one step explains most of it."""

    parts: Scalar = leaf("1")
    low: Scalar = leaf("kg", LARGEST)
    high: Scalar = leaf("kg", -LARGEST)
    total: Scalar = leaf("kg")
    squares: Scalar = leaf("kg2")
    longest: Scalar = leaf("1")  # samples of a part
    # before, before_total: parts before the step, and the sum of their masses
    before: Scalar = leaf("1")
    before_total: Scalar = leaf("kg")

    @property
    def step(self) -> Scalar:
        """By which the mass falls at the step [kg]."""
        after = self.parts - self.before
        return self.before_total / ca.fmax(self.before, 1.0) - (self.total - self.before_total) / ca.fmax(after, 1.0)

    @property
    def explained(self) -> Scalar:
        """Variance that the step explains [kg2]."""
        shares = self.before * (self.parts - self.before) / ca.fmax(self.parts, 1.0) ** 2
        return self.step**2 * shares

    @property
    def variance(self) -> Scalar:
        """Of the masses [kg2]."""
        parts = ca.fmax(self.parts, 1.0)
        return self.squares / parts - (self.total / parts) ** 2

    def and_part(self, part: Part) -> Changes:
        """With a part more; the step is where it was, or before this part."""
        mass = part.mean
        more = replace(
            self,
            parts=self.parts + 1.0,
            low=ca.fmin(self.low, mass),
            high=ca.fmax(self.high, mass),
            total=self.total + mass,
            squares=self.squares + mass**2,
            longest=ca.fmax(self.longest, part.count),
        )
        here = replace(more, before=self.parts, before_total=self.total)
        return chosen(here.explained > more.explained, here, more)


@dataclass(frozen=True)
class Moments:
    """Largest load moments of a motion over the rated one."""

    most: tuple[Scalar, ...] = leaf("1/kg", None)  # as it is, and with what is varied
    # inside, outside: blocks whose reach the load chart has, and has not
    inside: Scalar = leaf("1")
    outside: Scalar = leaf("1")


@dataclass(frozen=True)
class Window:
    """Steady motion of a lift."""

    others: tuple[Scalar, ...] = leaf("m", None)  # positions of the other units, at last
    varied: tuple[Sums, ...] = ()  # with a slope more, and with each position more and less
    moments: Moments | None = None  # of the whole motion
    sums: Sums = Sums()
    payload: Scalar = leaf("N/kg")  # sum of P
    count: Scalar = leaf("1")
    # first, last: times of its samples after the motion's start
    first: Scalar = leaf("s")
    last: Scalar = leaf("s")
    time: Scalar = leaf("s")  # sum of these times
    variance: Scalar = leaf("N2")
    # steps, step, step_squares: of the mass from sample to sample, as `Block` has them of the load
    steps: Scalar = leaf("1")
    step: Scalar = leaf("kg")
    step_squares: Scalar = leaf("kg2")
    steady: Scalar = leaf("1")  # samples in steady motion
    # speed, speed_squares: sums of the velocity and its square
    speed: Scalar = leaf("m/s")
    speed_squares: Scalar = leaf("m2/s2")
    part: Part = Part()
    changes: Changes = Changes()

    @classmethod
    def none(cls, units: int, *, charted: bool) -> Window:
        """Before the first block, of a mechanism with so many units."""
        varied = 1 + 2 * units
        zero = ca.SX(0.0)
        moments = Moments((ca.SX(-LARGEST),) * (1 + varied)) if charted else None
        return cls((zero,) * (units - 1), (Sums(),) * varied, moments)


def varied_positions(positions: Any, stds: Any, slope: Scalar) -> list[tuple[Any, Scalar]]:
    """Positions and slopes that the deviations of a mass follow from: a slope more, each position more and less."""
    found = [(positions, slope + INCLINATION_STD)]
    for k in range(positions.numel()):
        for sign in (1.0, -1.0):
            moved = ca.SX(positions)
            moved[k] += sign * stds[k]
            found.append((moved, slope))
    return found


def windowed(state: Window, empty: Window, blocks: Blocks, events: Events, laws: Laws, slope: Scalar) -> Window:
    """A window after a sample: empty at the begin of a motion, with a block more where one is complete.

    Args:
        empty: a window before its first block.
        blocks: after the sample.
        events: of the sample.
        slope: of the machine, its front up [rad].
    """
    begun = chosen(events.begins, empty, state)
    if state.moments is not None:
        moments = chosen(events.completes, _moved(state.moments, blocks, laws, slope), begun.moments)
        begun = replace(begun, moments=moments)
        state = replace(state, moments=moments)
    counts = all_of(events.completes, _counts(blocks))
    return chosen(counts, _with_block(state, blocks, laws, slope), begun)


def _counts(blocks: Blocks) -> Flag:
    """Whether the block that leaves the line is of a window: the motion had settled, and goes on."""
    leaving, older, motion = blocks.line[WAITING], blocks.line[WAITING + 1], blocks.motion
    goes_on = motion.moved - motion.started - leaving.last >= SLOWS - CLOCK_ROUNDING
    return all_of(older.count > 0.0, leaving.first >= SETTLES - CLOCK_ROUNDING, goes_on)


def _moved(moments: Moments, blocks: Blocks, laws: Laws, slope: Scalar) -> Moments:
    """With the newest block."""
    assert laws.moment is not None, "there is a load chart"
    rods = [blocks.line[0].mean(name) for name in blocks.line[0].rods]
    positions, stds = (ca.vertcat(*(getattr(one, name) for one in rods)) for name in ("position", "std"))
    here, inside = laws.moment(positions, slope)
    varied = [laws.moment(*one)[0] for one in varied_positions(positions, stds, slope)]
    most = tuple(
        ca.if_else(all_of(inside, value > kept), value, kept)
        for value, kept in zip((here, *varied), moments.most, strict=True)
    )
    return Moments(most, moments.inside + count(inside), moments.outside + count(negated(inside)))


def _with_block(window: Window, blocks: Blocks, laws: Laws, slope: Scalar) -> Window:
    newer, block, older = blocks.line[WAITING - 1 : WAITING + 2]
    means = {name: block.mean(name) for name in block.rods}
    positions, velocities, stds = (
        ca.vertcat(*(getattr(one, name) for one in means.values())) for name in ("position", "velocity", "std")
    )
    apart = newer.at - older.at
    accelerations = ca.vertcat(*((newer.mean(n).velocity - older.mean(n).velocity) / apart for n in means))
    weight, force = block.count, block.load / ca.fmax(block.count, 1.0)
    bodies, payload = laws.at_rest(positions, slope)
    more, more_payload = laws.by_motion(positions, velocities, accelerations, slope)
    varied = []
    for sums, at in zip(window.varied, varied_positions(positions, stds, slope), strict=True):
        b, p = laws.at_rest(*at)
        varied.append(sums.and_block(weight, b + more, p + more_payload, force))
    b, p = bodies + more, payload + more_payload
    mass = (force - b) / p
    steady = ca.fabs(more + mass * more_payload) <= STEADY * ca.fabs(force)
    speed = means[laws.unit].velocity
    part, changes = _parted(window, block.first, weight, mass)
    sums = Sums(window.sums.pp + weight * p * p, window.sums.pf + weight * p * force, window.sums.pb + weight * p * b)
    return replace(
        window,
        sums=sums,
        payload=window.payload + weight * p,
        varied=tuple(varied),
        count=window.count + weight,
        first=ca.if_else(window.count == 0.0, block.first, window.first),
        last=block.last,
        time=window.time + block.time,
        variance=window.variance + block.variance,
        steps=window.steps + block.steps,
        step=window.step + block.step / p,
        step_squares=window.step_squares + block.step_squares / p**2,
        steady=window.steady + ca.if_else(steady, weight, 0.0),
        speed=window.speed + weight * speed,
        speed_squares=window.speed_squares + weight * speed**2,
        others=tuple(one.position for name, one in means.items() if name != laws.unit),
        part=part,
        changes=changes,
    )


def _parted(window: Window, first: Scalar, weight: Scalar, mass: Scalar) -> tuple[Part, Changes]:
    """The part that goes on, and the changes after one that is complete."""
    part = window.part
    is_full = all_of(part.count > 0.0, first - part.first >= BLOCK - CLOCK_ROUNDING)
    changes = chosen(is_full, window.changes.and_part(part), window.changes)
    base = chosen(any_of(part.count == 0.0, is_full), Part(first), part)
    return Part(base.first, base.count + weight, base.mass + weight * mass), changes
