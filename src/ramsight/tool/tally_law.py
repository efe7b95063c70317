"""Weighings one after another as a recursion: a lift in, and what it weighed by the scale, with the total, out.

Cycles, up and down of one load averaged, and the total since the start, in a fixed memory; the same graph in C.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import casadi as ca

from ramsight.engine.recursion import Recursion, recursion_of
from ramsight.engine.typed_state import chosen, emptied, leaf, leaves, mapped, symbols
from ramsight.expression import Flag, Scalar, all_of, count, negated
from ramsight.tool.force_scale import TERMS
from ramsight.tool.lift_values import LiftValues, root_sum
from ramsight.tool.weighing_limits import PAIR_STDS, STANDS_STILL

_ZEROS = (ca.SX(0.0),) * len(TERMS)


@dataclass(frozen=True)
class TallySettings:
    """What a tally goes by."""

    strokes: tuple[Scalar, ...] = leaf("m", None)  # of the other units
    scale: tuple[Scalar, ...] = leaf("1", None)  # terms of the scale
    covariance: tuple[Scalar, ...] = leaf("1", None)  # of them, the upper triangle row by row
    loaded_from: Scalar = leaf("kg")  # below it the tool is empty

    @classmethod
    def of(cls, units: int) -> TallySettings:
        """Without values, of a mechanism with so many units."""
        zero, pairs = ca.SX(0.0), len(TERMS) * (len(TERMS) + 1) // 2
        return cls((zero,) * (units - 1), _ZEROS, (zero,) * pairs)

    def corrected(self, plain: Scalar, row: tuple[Scalar, ...]) -> Scalar:
        """A mass by the described machine, corrected [kg]."""
        return plain + sum((a * b for a, b in zip(row, self.scale, strict=True)), start=ca.SX(0.0))

    def shared_std(self, row: tuple[Scalar, ...]) -> Scalar:
        """Deviation that the terms leave what changes with them by a row [kg]."""
        variance, entries = ca.SX(0.0), iter(self.covariance)
        for k, one in enumerate(row):
            for other in row[k:]:
                entry = next(entries)
                variance += entry * one * other * (1.0 if one is other else 2.0)
        return ca.sqrt(ca.fmax(variance, 0.0))


@dataclass(frozen=True)
class Summed:
    """What cycles lifted, as `Total` has it."""

    row: tuple[Scalar, ...] = leaf("1", None)
    mass: Scalar = leaf("kg")
    own_variance: Scalar = leaf("kg2")
    cycles: Scalar = leaf("1")

    def __add__(self, other: Summed) -> Summed:
        values = iter(leaves(other))
        return mapped(self, lambda one: one.value + next(values).value)


@dataclass(frozen=True)
class Entry:
    """A weighing that a cycle may count as."""

    summed: Summed = leaf("1", None)
    std: Scalar = leaf("kg")
    counts: Flag = leaf("1")  # it is good, and the tool was not empty


@dataclass(frozen=True)
class TallyState:
    """What is kept of the lifts."""

    before: Summed = leaf("1", None)  # of the cycles that have ended
    best: Entry = leaf("1", None)  # the surest of this cycle but for the last one
    last: Entry = leaf("1", None)
    up: LiftValues = leaf("1", None)  # the lift that the next motion may lower again
    is_up: Flag = leaf("1")  # whether there is one
    lowered: Flag = leaf("1", 1.0)  # whether the next lift begins a cycle
    cycle: Scalar = leaf("1")
    count: Scalar = leaf("1")

    @classmethod
    def none(cls, units: int) -> TallyState:
        """Before the first lift, of a mechanism with so many units."""
        entry = Entry(Summed(_ZEROS))
        return cls(Summed(_ZEROS), entry, entry, LiftValues.none(units))

    @property
    def total(self) -> Summed:
        """Of each cycle the surest good weighing, unless the tool was empty."""
        one = _surest(self.best, self.last)
        return self.before + chosen(one.counts, one.summed, emptied(one.summed))


@dataclass(frozen=True)
class WeighingValues:
    """A weighing as `Weighing` has it, and the tally after it."""

    row: tuple[Scalar, ...] = leaf("1", None)
    total: Summed = leaf("1", None)
    new: Scalar = leaf("1")  # 0: none, 1: by lifting, 2: the last one, better by lowering the same load
    time: Scalar = leaf("s")
    duration: Scalar = leaf("s")
    cycle: Scalar = leaf("1")
    mass: Scalar = leaf("kg")
    std: Scalar = leaf("kg")
    own_std: Scalar = leaf("kg")
    quality: Scalar = leaf("1")
    # rated_share, rated_share_std: load moment over the rated one; NaN where it is unknown
    rated_share: Scalar = leaf("1")
    rated_share_std: Scalar = leaf("1")
    covered: Flag = leaf("1")
    total_std: Scalar = leaf("kg")
    count: Scalar = leaf("1")

    @classmethod
    def none(cls) -> WeighingValues:
        """No weighing."""
        return cls(_ZEROS, Summed(_ZEROS))


@dataclass(frozen=True, eq=False)
class TallyLaw:
    """The recursion of a tally, and what it begins with."""

    # recursion: inputs are the leaves of `LiftValues`, outputs those of `WeighingValues`, parameters `TallySettings`
    recursion: Recursion
    initial: TallyState


@lru_cache(maxsize=8)
def tally_law(units: int) -> TallyLaw:
    """How lifts of a mechanism with so many units are counted.

    Example:
        >>> tally_law(2).recursion.outputs[-3:]
        ('covered', 'total_std', 'count')
    """
    settings, initial = symbols(TallySettings.of(units)), TallyState.none(units)

    def stage(state: TallyState, lift: LiftValues) -> tuple[TallyState, list[Any]]:
        after, said = counted(state, lift, settings)
        return after, [one.value for one in leaves(said)]

    outputs = [one.name for one in leaves(WeighingValues.none())]
    recursion = recursion_of(initial, symbols(LiftValues.none(units)), outputs, stage, settings)
    return TallyLaw(recursion, initial)


def counted(state: TallyState, lift: LiftValues, settings: TallySettings) -> tuple[TallyState, WeighingValues]:
    """A motion more, and what it weighed."""
    upwards = lift.upwards
    same = all_of(negated(upwards), state.is_up, _is_same_load(state.up, lift, settings))
    found = chosen(upwards, lift, _mean(state.up, lift))
    entry, said = _weighed(found, settings)
    begins = all_of(upwards, state.lowered)
    best = chosen(begins, emptied(state.best), chosen(upwards, _surest(state.best, state.last), state.best))
    is_new = ca.if_else(upwards, 1.0, ca.if_else(same, 2.0, 0.0))
    after = TallyState(
        before=chosen(begins, state.total, state.before),
        best=best,
        last=chosen(is_new > 0.0, entry, state.last),
        up=chosen(upwards, lift, state.up),
        is_up=upwards,
        lowered=negated(upwards),
        cycle=state.cycle + count(begins),
        count=state.count + count(upwards),
    )
    total = after.total
    return after, replace(
        said,
        new=is_new,
        cycle=after.cycle,
        count=after.count,
        total=total,
        total_std=root_sum(settings.shared_std(total.row), ca.sqrt(total.own_variance)),
    )


def _weighed(lift: LiftValues, settings: TallySettings) -> tuple[Entry, WeighingValues]:
    mass, shared = settings.corrected(lift.mass, lift.row), settings.shared_std(lift.row)
    std = root_sum(shared, lift.own_std)
    is_good = lift.is_good
    entry = Entry(
        Summed(lift.row, mass, lift.own_std**2, ca.SX(1.0)), std, all_of(is_good, mass > settings.loaded_from)
    )
    share = lift.per_mass * mass
    said = replace(
        WeighingValues.none(),
        row=lift.row,
        time=lift.time,
        duration=lift.duration,
        mass=mass,
        std=std,
        own_std=lift.own_std,
        quality=lift.quality,
        rated_share=ca.if_else(is_good, share, math.nan),
        rated_share_std=ca.if_else(is_good, root_sum(lift.per_mass * shared, lift.moment_std), math.nan),
        covered=lift.covered,
    )
    return entry, said


def _surest(one: Entry, other: Entry) -> Entry:
    """The one that counts, of two that do the one with the smaller deviation."""
    takes_other = all_of(other.counts, negated(all_of(one.counts, one.std <= other.std)))
    return chosen(takes_other, other, one)


def _is_same_load(up: LiftValues, down: LiftValues, settings: TallySettings) -> Flag:
    """Whether a motion down carries what the one up before it did: nothing was dumped, and friction explains it."""
    still = (
        ca.fabs(a - b) <= STANDS_STILL * stroke
        for a, b, stroke in zip(up.others, down.others, settings.strokes, strict=True)
    )
    apart = settings.corrected(up.mass, up.row) - settings.corrected(down.mass, down.row)
    shared = settings.shared_std(tuple(a - b for a, b in zip(up.row, down.row, strict=True)))
    near = ca.fabs(apart) <= PAIR_STDS * root_sum(shared, up.own_std, down.own_std)
    return all_of(up.is_good, down.is_good, near, *still)


def _mean(up: LiftValues, down: LiftValues) -> LiftValues:
    """Both motions of a load as one lift: what differs by direction cancels."""
    return replace(
        up,
        time=0.5 * (up.time + down.time),
        duration=up.duration + down.duration,
        mass=0.5 * (up.mass + down.mass),
        row=tuple(0.5 * (a + b) for a, b in zip(up.row, down.row, strict=True)),
        own_std=0.5 * root_sum(up.own_std, down.own_std),
        per_mass=ca.if_else(down.per_mass > up.per_mass, down.per_mass, up.per_mass),
        moment_std=0.5 * root_sum(up.moment_std, down.moment_std),
        covered=all_of(up.covered, down.covered),
    )
