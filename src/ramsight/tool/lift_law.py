"""Lifts as a recursion: a sample of all sensors in, and after a motion what it weighed; the same graph in C."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import casadi as ca

from ramsight.engine.recursion import Recursion, recursion_of
from ramsight.engine.typed_state import column, leaf, leaves, symbols
from ramsight.expression import Flag, Scalar, scalar_symbol
from ramsight.plant.linkage import Mechanism
from ramsight.plant.unit import HydraulicUnit
from ramsight.tool.force_balance import forces
from ramsight.tool.lift_blocks import Blocks, Events, Rod, Sample, summed
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
    units = mechanism.cylinders
    slope, sample = scalar_symbol(SLOPE), _sample(units)
    initial = _initial(units, chart)

    def stage(state: LiftState, at: Sample) -> tuple[LiftState, list[Any]]:
        laws = _laws(mechanism, unit, lift_sign, chart)
        after, said, _ = _stepped(state, at, slope, laws, mechanism.rated_payload, stroke, lift_sign)
        return after, said

    names = [one.name for one in leaves(LiftValues.none(len(units)))]
    return LiftLaw(recursion_of(initial, sample, [ENDED, *names], stage, (slope,)), initial, units)


def _sample(units: tuple[str, ...]) -> Sample:
    return symbols(Sample({name: Rod() for name in units}))


def _initial(units: tuple[str, ...], chart: LoadChart | None) -> LiftState:
    return LiftState(Blocks.none(units), Window.none(len(units), charted=chart is not None))


def _stepped(
    state: LiftState, sample: Sample, slope: Scalar, laws: Laws, rated: float, stroke: float, lift_sign: float
) -> tuple[LiftState, list[Any], Events]:
    """A sample more: the state after it, the outputs, and what it did to the motion."""
    blocks, events = summed(state.blocks, sample, laws.unit, MOVING * stroke, lift_sign)
    lift = lift_of(state.window, state.blocks.motion, rated)
    said = [ca.if_else(events.ends, one.value, 0.0) for one in leaves(lift)]
    empty = Window.none(len(sample.rods), charted=laws.moment is not None)
    after = windowed(state.window, empty, blocks, events, laws, slope)
    return LiftState(blocks, after), [events.ends, *said], events


@dataclass(frozen=True, eq=False)
class CalledLift:
    """The same step with the mechanism's laws as functions that it calls in a loop: half of the code.

    Where a block is complete, `at_rest` gives what is found at the first points, and `moment` what is at the others.
    """

    where: ca.Function  # state, sample and slope to whether a block is complete, and to positions and slope of points
    at_rest: ca.Function  # positions and slope to force of the bodies [N] and that per kilogram [N/kg]
    moment: ca.Function | None  # likewise to the load moment of a kilogram over the rated one, and whether it has one
    advance: ca.Function  # state, sample, slope and what was found at all points to the next state and the outputs
    # rests, moments: how many points there are of each
    rests: int
    moments: int


def called_lift(mechanism: Mechanism, unit: HydraulicUnit, chart: LoadChart | None) -> CalledLift:
    """The step of `lift_law` in pieces, for a language that has functions.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.linked import build_linked
        >>> loader = build_linked(machine.load_machine("mining-loader"))
        >>> called_lift(loader.mechanism, loader.unit("boom"), None).rests
        6
    """
    stroke, lift_sign = float(unit.cylinder.stroke), float(unit.lift_sign)
    laws, slope = _laws(mechanism, unit.name, lift_sign, chart), scalar_symbol(SLOPE)
    rests, moments = _Calls("rest"), _Calls("moment")
    called = replace(laws, at_rest=rests, moment=None if laws.moment is None else moments)
    before, sample = symbols(_initial(mechanism.cylinders, chart)), _sample(mechanism.cylinders)
    after, said, events = _stepped(before, sample, slope, called, mechanism.rated_payload, stroke, lift_sign)
    x, u = column(before), column(sample)
    points = ca.vertcat(*rests.points, *moments.points)
    found = ca.vertcat(*rests.found, *moments.found)
    of = {"x": x, "u": u, "p": slope}
    return CalledLift(
        ca.Function("where", [*of.values()], [events.completes, points], [*of], ["whether", "points"], {"cse": True}),
        _at_point("at_rest", laws.at_rest, len(mechanism.cylinders)),
        None if laws.moment is None else _at_point("moment", laws.moment, len(mechanism.cylinders)),
        ca.Function(
            "lift", [*of.values(), found], [column(after), ca.vertcat(*said)], [*of, "found"], ["x_new", "out"],
            {"cse": True},
        ),
        len(rests.points), len(moments.points),
    )  # fmt: skip


class _Calls:
    """In place of a law: symbols for what it finds, and the points that it is asked for."""

    def __init__(self, name: str) -> None:
        self._name = name
        self.points: list[Any] = []
        self.found: list[Any] = []

    def __call__(self, positions: Any, slope: Scalar) -> tuple[Any, Any]:
        pair = ca.SX.sym(f"{self._name}{len(self.points)}", 2)
        self.points.append(ca.vertcat(positions, slope))
        self.found.append(pair)
        return pair[0], pair[1]


def _at_point(name: str, law: Callable[[Any, Scalar], tuple[Any, Any]], units: int) -> ca.Function:
    point = ca.SX.sym("point", units + 1)
    return ca.Function(
        name, [point], [ca.vertcat(*law(point[:units], point[units]))], ["point"], ["found"], {"cse": True}
    )


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
