"""Commissioning: what a temporary position sensor tells of a machine's deviations from its data sheet."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ramsight.calibration.identify_balance import BalanceFit, BalanceProblem, fit_balance
from ramsight.calibration.identify_friction import FrictionFit, fit_friction, same_loads
from ramsight.calibration.identify_moves import Moves, find_moves, going
from ramsight.calibration.identify_record import IdentifyError, Record, recorded
from ramsight.calibration.identify_replay import Circuit, Deviation, Run
from ramsight.calibration.loss_uncertainty import EFFICIENCY
from ramsight.normal import TWO_SIDED_95
from ramsight.plant.directional import metered
from ramsight.signals import Dataset

if TYPE_CHECKING:
    from ramsight.plant.unit import HydraulicUnit

__all__ = ["EVALUATIONS", "FACTORS", "Estimate", "Identification", "IdentifyError", "identify"]

AS_DESCRIBED = {"leak": 1.0, "orifice": 0.0, "displacement": 1.0, "stiffness": 1.0, "friction": 1.0, "efficiency": 0.0}
"""What the factors of a machine are that is its description."""
FACTORS = tuple(AS_DESCRIBED)
EVALUATIONS = 160.0
"""About how often the circuit is run, for a progress bar."""
UNUSUAL = 2.0
"""Standard deviations that the sensor assumes, from which a machine is far from its description."""
_FRICTION = 0.5  # of the data sheet's, from which friction is far from it
_PUMPS = 0.02  # of efficiency, what pumps of one type differ by
_ROUNDS = 2  # of the balance with the efficiency that friction gave; the first is near the last


@dataclass(frozen=True)
class Estimate:
    """One factor."""

    # value: over the data sheet's [1]; of the pumps' efficiency, less the data sheet's [1]. The data sheet's if the
    # log does not tell
    value: float
    # low, high: 95 % interval [1]; what it would have been if the log does not tell
    low: float
    high: float
    identified: bool  # whether the log identifies it
    per_kelvin: float = 0.0  # change of `value` if the oil is 1 K warmer than the log states
    per_torque: float = 0.0  # change of `value` if the torque is 1 % larger than the log states
    # per_no_load: change of `value` if the pumps' no-load torque is a quarter larger than described; the interval
    # holds it
    per_no_load: float = 0.0
    # as_described: half of the interval if the no-load torque is what is described; NaN of what it does not concern
    as_described: float = math.nan

    @property
    def std(self) -> float:
        """Standard deviation, by the interval [1]."""
        return (self.high - self.low) / (2.0 * TWO_SIDED_95)

    @property
    def reciprocal(self) -> Estimate:
        """Of one over the value; what it depends on is left out."""
        highest = 1.0 / self.low if self.low > 0.0 else math.inf
        return Estimate(1.0 / self.value, 1.0 / self.high, highest, self.identified)


@dataclass(frozen=True)
class Identification:
    """How a machine differs from its data sheet."""

    factors: dict[str, Estimate]  # leak, orifice, displacement, stiffness, friction and efficiency, by name
    delay: Estimate  # by which the position sensor lags the drive [s], and its interval
    moves: int  # how many moves it rests on
    loads: int  # how many loads were lifted and lowered, as far as can be distinguished
    duration: float  # of these moves together [s]
    residual: float  # root mean square of what the balance leaves unexplained within a move, as position [m]
    pressure: tuple[float, float]  # 5 and 95 % of the holding chamber's pressure in the moves, above tank [Pa]
    temperature: tuple[float, float]  # lowest and highest oil temperature [K]
    # lifts, lowers: how many moves are which
    lifts: int
    lowers: int
    reached: tuple[float, float]  # lowest and highest position that was measured [m]
    # judged_by: half of the interval within which each factor is as described; a wider one says nothing
    judged_by: dict[str, float] = field(default_factory=dict)

    def is_vague(self, name: str) -> bool:
        """Whether the interval of a factor is wider than the one that it is judged by: the log does not tell it.

        Args:
            name: of `FACTORS`.
        """
        one = self.factors[name]
        return one.identified and 0.5 * (one.high - one.low) > self.judged_by.get(name, math.inf)

    @property
    def deviation(self) -> Deviation:
        """The factors as the circuit takes them."""
        value = {name: estimate.value for name, estimate in self.factors.items()}
        return Deviation(
            value["leak"],
            value["orifice"],
            value["displacement"],
            1.0 / value["stiffness"],
            self.delay.value,
            value["efficiency"],
        )


def judged_by(unit: HydraulicUnit) -> dict[str, float]:
    """How far each factor may be from the data sheet's, by what the sensor assumes of the machine."""
    assumed = unit.assumptions.machine
    return {
        "leak": UNUSUAL * assumed.leak,
        "orifice": UNUSUAL * assumed.leak,
        "displacement": UNUSUAL * assumed.displacement,
        "stiffness": UNUSUAL * assumed.compliance,
        "friction": _FRICTION,
        "efficiency": _PUMPS,
    }


def identify(
    unit: HydraulicUnit, log: Dataset, truth: Dataset, *, advance: Callable[[float], object] | None = None
) -> Identification:
    """Fit the factors of a machine to its log and its measured position.

    Args:
        unit: the unit's parts, as its data sheet has them, whatever its circuit.
        log: Dataset over `time` with motor_speed [rad/s], motor_torque [N m] and oil_temperature [K].
        truth: Dataset over `time` with position [m]; nothing else of it is used.
        advance: called with steps of the work as they are done.

    Raises:
        IdentifyError: the two have no time in common, nothing moves, or a valve meters the rod.
    """
    if metered(unit.parts()):
        raise IdentifyError(
            f"a valve of unit {unit.name!r} meters the rod, so its travel is not the motor's: find the values of its "
            "parts (ramsight identify with a --map that names the measured position, ramsight.identify_values)"
        )
    record, circuit = recorded(unit, log, truth), Circuit(unit)
    base = circuit.described()
    described = circuit.run(record, base)
    moves = find_moves(unit, record, described)
    _check(unit, record, described, moves)
    balance, friction, groups = _fit(BalanceProblem(circuit, record, moves, advance=advance), base)
    factors = _estimates(balance, friction)
    apart, shifts = "efficiency" in friction.identified, []
    for other in (record.changed(kelvin=1.0), record.changed(torque=0.01)):
        problem = BalanceProblem(circuit, other, moves, advance=advance)
        again = fit_balance(problem, balance.deviation, balance)
        found = _estimates(again, fit_friction(problem, again.deviation, groups, apart))
        shifts.append({key: found[key].value - e.value if e.identified else 0.0 for key, e in factors.items()})
    factors = {key: replace(e, per_kelvin=shifts[0][key], per_torque=shifts[1][key]) for key, e in factors.items()}
    return _result(circuit, record, moves, balance, friction, factors)


def _check(unit: HydraulicUnit, record: Record, described: Run, moves: Moves) -> None:
    """Reject a log whose load pulls the wrong way, and one without moves."""
    moving = going(unit, record, described)
    if moving.any() and np.median(described.force[moving]) < 0.0:
        raise IdentifyError(
            f"by its torque the load pulls unit {unit.name!r} the way that lifts, away from side {unit.held.upper()} "
            "that holds it: is this log another unit's, or is the torque's sign turned?"
        )
    if len(np.unique(moves.run)) < 2:
        raise IdentifyError(
            "nothing to identify from: the log needs moves of a second and more, away from the stops and the relief "
            "pressure, in which motor and position go the same way"
        )


def _fit(problem: BalanceProblem, base: Deviation) -> tuple[BalanceFit, FrictionFit, NDArray[np.int64]]:
    """Balance and friction in turn, each with the result of the other."""
    circuit, record, moves = problem.circuit, problem.record, problem.moves
    balance = fit_balance(problem, base)
    groups = same_loads(circuit.unit, moves, record, problem.run(balance.deviation))
    friction = fit_friction(problem, balance.deviation, groups)
    for _ in range(_ROUNDS):
        if "efficiency" not in friction.identified:
            break
        problem.efficiency_std = min(EFFICIENCY, friction.half_width["efficiency"] / TWO_SIDED_95)
        start = replace(balance.deviation, efficiency=friction.value["efficiency"])
        balance = fit_balance(problem, start, balance)
        friction = fit_friction(problem, balance.deviation, groups, separate=True)
    return balance, friction, groups


def _estimates(fitted: BalanceFit, friction: FrictionFit) -> dict[str, Estimate]:
    how, half = fitted.deviation, fitted.half_width

    def flow(name: str) -> Estimate:
        value = float(getattr(how, name))
        least = 0.0 if name in fitted.none else value - half[name]
        return Estimate(value, least, value + half[name], name in fitted.free or name in fitted.none)

    def force(name: str) -> Estimate:
        value, wide = friction.value[name], friction.half_width[name]
        estimate = Estimate(value, value - wide, value + wide, name in friction.identified)
        if name == "friction" and estimate.identified:
            return replace(estimate, per_no_load=friction.per_no_load, as_described=friction.as_described)
        return estimate

    stiff = flow("compliance").reciprocal
    return {name: stiff if name == "stiffness" else flow(name) for name in FACTORS[:4]} | {
        name: force(name) for name in FACTORS[4:]
    }


def _result(
    circuit: Circuit,
    record: Record,
    moves: Moves,
    balance: BalanceFit,
    friction: FrictionFit,
    factors: dict[str, Estimate],
) -> Identification:
    late, lag = balance.half_width["delay"], balance.deviation.delay
    pressure = moves.mean(circuit.run(record, balance.deviation).pressure)
    runs = np.unique(moves.run, return_index=True)[1]
    return Identification(
        factors=factors,
        delay=Estimate(lag, lag - late, lag + late, "delay" in balance.free),
        moves=len(runs),
        loads=friction.loads,
        duration=float(record.period * moves.samples().sum()),
        residual=balance.residual,
        pressure=(float(np.percentile(pressure, 5)), float(np.percentile(pressure, 95))),
        temperature=(float(record.oil_temperature.min()), float(record.oil_temperature.max())),
        lifts=int(moves.lifting[runs].sum()),
        lowers=int((~moves.lifting[runs]).sum()),
        reached=(float(np.nanmin(record.position)), float(np.nanmax(record.position))),
        judged_by=judged_by(circuit.unit),
    )
