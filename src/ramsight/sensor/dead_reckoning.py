"""Sensors that add up the piston's travel, and take a reference for the position as it comes."""

from __future__ import annotations

from dataclasses import dataclass, field

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Flag, Scalar, all_of, any_of, negated
from ramsight.sensor.inputs.sample import Sample, SampleState, lasted
from ramsight.sensor.thresholds import NOISE_AVERAGED


@dataclass(frozen=True, kw_only=True)
class ReliefLossState:
    """A relief valve that may have let oil pass."""

    open_for: Scalar = leaf("s")  # how long it has looked open [s]
    unobservable: Flag = leaf("1")  # whether the position is unobservable since


@dataclass(frozen=True, kw_only=True)
class ReckoningState:
    """What a sensor by dead reckoning keeps."""

    position: Scalar = leaf("m", None, exact="sum")  # [m]
    intake: SampleState  # the last sample
    relief: ReliefLossState = field(default_factory=ReliefLossState)  # a valve that may have let oil pass


def relief_loss(state: ReliefLossState, sample: Sample, relief_open: Flag) -> ReliefLossState:
    """Whether the position is unobservable: the relief valve has let oil pass, and no reference came since.

    Args:
        relief_open: whether it looks like that; noise is distinguished from it by how long it lasts.
    """
    open_for = ca.if_else(relief_open, state.open_for + sample.elapsed, 0.0)
    unobservable = any_of(state.unobservable, lasted(open_for, NOISE_AVERAGED))
    return ReliefLossState(open_for=open_for, unobservable=all_of(negated(sample.referenced), unobservable))


def at_reference(sample: Sample, position: Scalar) -> Scalar:
    """The position of a sensor that accepts every reference [m]."""
    return ca.if_else(sample.referenced, sample.reference, position)
