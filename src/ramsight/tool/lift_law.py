"""Lifts as a recursion: a sample of all sensors in, and after a motion what it weighed; the same graph in C."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca

from ramsight.engine.recursion import Recursion, recursion_of
from ramsight.engine.typed_state import leaf, leaves, symbols
from ramsight.expression import Flag, Scalar, scalar_symbol
from ramsight.plant.linkage import Mechanism
from ramsight.plant.unit import HydraulicUnit
from ramsight.tool.force_balance import forces
from ramsight.tool.lift_blocks import Blocks, Rod, Sample, summed
from ramsight.tool.lift_values import LiftValues, lift_of
from ramsight.tool.lift_window import Laws, Window, windowed
from ramsight.tool.load_chart import LoadChart
from ramsight.tool.weighing_limits import MOVING

ENDED = "ended"
"""The first output: whether a motion has ended; what comes after it is of that motion."""
SLOPE = "inclination"
"""The parameter: the machine's, its front up [rad]."""


@dataclass(frozen=True)
class LiftState:
    """All that is kept of the samples."""

    blocks: Blocks = leaf("1", None)
    window: Window = leaf("1", None)


@dataclass(frozen=True, eq=False)
class LiftLaw:
    """The recursion of a machine, and what it begins with."""

    recursion: Recursion  # inputs are the leaves of `Sample`, outputs `ENDED` and those of `LiftValues`
    initial: LiftState
    units: tuple[str, ...]  # of the mechanism, in its order


def lift_law(mechanism: Mechanism, unit: HydraulicUnit, chart: LoadChart | None) -> LiftLaw:
    """How lifts of a unit are weighed.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.linked import build_linked
        >>> loader = build_linked(machine.load_machine("mining-loader"))
        >>> law = lift_law(loader.mechanism, loader.unit("boom"), None)
        >>> law.recursion.inputs[:4], law.recursion.outputs[:3], len(law.recursion.state) < 200
        (('boom.position', 'boom.velocity', 'boom.std', 'bucket.position'), ('ended', 'row[0]', 'row[1]'), True)
    """
    return _made(mechanism, unit.name, float(unit.cylinder.stroke), float(unit.lift_sign), chart)


@lru_cache(maxsize=16)
def _made(mechanism: Mechanism, unit: str, stroke: float, lift_sign: float, chart: LoadChart | None) -> LiftLaw:
    units, rated = mechanism.cylinders, mechanism.rated_payload
    laws, slope = _laws(mechanism, unit, lift_sign, chart), scalar_symbol(SLOPE)
    empty = Window.none(len(units), charted=chart is not None)
    initial = LiftState(Blocks.none(units), empty)

    def stage(state: LiftState, sample: Sample) -> tuple[LiftState, list[Any]]:
        blocks, events = summed(state.blocks, sample, unit, MOVING * stroke, lift_sign)
        lift = lift_of(state.window, state.blocks.motion, rated)
        said = [ca.if_else(events.ends, one.value, 0.0) for one in leaves(lift)]
        after = windowed(state.window, empty, blocks, events, laws, slope)
        return LiftState(blocks, after), [events.ends, *said]

    names = [one.name for one in leaves(LiftValues.none(len(units)))]
    sample = symbols(Sample({name: Rod() for name in units}))
    return LiftLaw(recursion_of(initial, sample, [ENDED, *names], stage, (slope,)), initial, units)


def _laws(mechanism: Mechanism, unit: str, lift_sign: float, chart: LoadChart | None) -> Laws:
    balance, row = forces(mechanism), mechanism.cylinders.index(unit)

    def at_rest(positions: Any, slope: Scalar) -> tuple[Scalar, Scalar]:
        still = ca.SX.zeros(positions.numel())
        bodies, loaded, *_ = balance(positions, still, still, slope)
        return lift_sign * bodies[row], lift_sign * (loaded[row] - bodies[row])

    def by_motion(positions: Any, velocities: Any, accelerations: Any, slope: Scalar) -> tuple[Scalar, Scalar]:
        *_, bodies, loaded = balance(positions, velocities, accelerations, slope)
        return lift_sign * bodies[row], lift_sign * (loaded[row] - bodies[row])

    def moment(positions: Any, slope: Scalar) -> tuple[Scalar, Flag]:
        assert chart is not None, "there is one"
        share, inside = chart.law(mechanism)(positions, slope)
        return share, inside

    return Laws(unit, at_rest, by_motion, None if chart is None else moment)
