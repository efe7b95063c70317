"""Commissioning: what a temporary position sensor tells of a machine's deviations from its data sheet."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ramsight.calibration.identify_balance import BalanceFit, fit_balance
from ramsight.calibration.identify_friction import fit_friction, same_loads
from ramsight.calibration.identify_hydraulics import Deviation, Hydraulics, Record, orifice_at_one
from ramsight.calibration.identify_moves import find_moves
from ramsight.errors import RamsightError

if TYPE_CHECKING:
    import xarray

    from ramsight.plant.ddh import DdhUnit, Side

Array = NDArray[np.float64]

FACTORS = ("leak", "orifice", "displacement", "friction", "stiffness")
FRICTION_LIMIT = 0.5
EVALUATIONS = 80.0
"""About how often the balance is evaluated, for a progress bar."""


class IdentifyError(RamsightError):
    """A log from which nothing can be identified."""


@dataclass(frozen=True)
class Estimate:
    """One factor.

    Attributes:
        value: over the data sheet's [1]; the data sheet's if the log does not tell.
        low, high: 95 % interval [1]; what it would have been if the log does not tell.
        told: whether the log tells it.
        per_kelvin: change of `value` if the oil is 1 K warmer than the log says.
        per_torque: change of `value` if the torque is 1 % larger than the log says.
        per_efficiency: change of `value` if the pumps' hydro-mechanical efficiency is 0.01 less than described.
    """

    value: float
    low: float
    high: float
    told: bool
    per_kelvin: float = 0.0
    per_torque: float = 0.0
    per_efficiency: float = 0.0


@dataclass(frozen=True)
class Identification:
    """How a machine differs from its data sheet.

    Attributes:
        factors: leak, orifice, displacement, friction and stiffness, by name.
        delay: by which the position sensor lags the drive [s], and its interval.
        moves: how many moves it rests on.
        duration: of these moves together [s].
        residual: root mean square of what the balance leaves unexplained within a move, as position [m].
        pressure: 5 and 95 % of the held manifold's pressure in the moves, above tank [Pa].
        temperature: lowest and highest oil temperature [K].
        lifts, lowers: how many moves are which.
    """

    factors: dict[str, Estimate]
    delay: Estimate
    moves: int
    duration: float
    residual: float
    pressure: tuple[float, float]
    temperature: tuple[float, float]
    lifts: int
    lowers: int

    @property
    def deviation(self) -> Deviation:
        """The factors of the volume balance."""
        value = {name: estimate.value for name, estimate in self.factors.items()}
        return Deviation(value["leak"], value["orifice"], value["displacement"], 1.0 / value["stiffness"])


def identify(
    unit: DdhUnit,
    log: xarray.Dataset,
    truth: xarray.Dataset,
    *,
    advance: Callable[[float], object] | None = None,
) -> Identification:
    """Fit the factors of a machine to its log and its measured position.

    Args:
        unit: the unit's parts, as its data sheet has them.
        log: Dataset over `time` with motor_speed [rad/s], motor_torque [N m] and oil_temperature [K].
        truth: Dataset over `time` with position [m]; nothing else of it is used.
        advance: called with steps of the work as they are done.

    Raises:
        IdentifyError: the pumps are described by a table, the two have no time in common, or nothing moves.
    """
    record = _record(unit, log, truth)
    hydraulics = Hydraulics(unit, record)
    base = Deviation(orifice=float(unit.held_side.pump.orifice_leak or 0.0) / orifice_at_one(unit.held_side))
    moves = find_moves(hydraulics, hydraulics.balance(base))
    if len(moves.run) < 2:
        raise IdentifyError(
            "nothing to identify from: the log needs moves of a second and more, away from the stops and the relief "
            "pressure, in which motor and position go the same way"
        )
    if np.median(moves.mean(hydraulics.balance(base).pressure)) < 0.0:
        raise IdentifyError(
            f"the torque draws oil out of side {unit.held.upper()}, which holds unit {unit.name!r}'s load: is this log "
            "another unit's, or is the torque's sign turned?"
        )
    fitted = fit_balance(hydraulics, moves, base, advance=advance)
    balance = hydraulics.balance(fitted.deviation)
    groups = same_loads(hydraulics, moves, balance)
    friction, friction_half = fit_friction(hydraulics, moves, balance, groups)
    factors = _estimates(fitted, friction, friction_half)
    shifts: list[dict[str, float]] = []
    for changed_unit, changed in (
        (unit, record.changed(kelvin=1.0)),
        (unit, record.changed(torque=0.01)),
        (_rougher(unit), record),
    ):
        other = Hydraulics(changed_unit, changed)
        again = fit_balance(other, moves, fitted.deviation, fitted.free, advance=advance)
        shifted, _ = fit_friction(other, moves, other.balance(again.deviation), groups)
        found = {key: e.value for key, e in _estimates(again, friction, friction_half).items()}
        found["friction"] += shifted - friction  # even below nothing: it is a slope
        shifts.append({key: found[key] - e.value if e.told else 0.0 for key, e in factors.items()})
    factors = {
        key: replace(e, per_kelvin=shifts[0][key], per_torque=shifts[1][key], per_efficiency=shifts[2][key])
        for key, e in factors.items()
    }
    late, pressure = fitted.half_width["delay"], moves.mean(balance.pressure)
    runs = np.unique(moves.run, return_index=True)[1]
    return Identification(
        factors=factors,
        delay=Estimate(
            fitted.deviation.delay, fitted.deviation.delay - late, fitted.deviation.delay + late, "delay" in fitted.free
        ),
        moves=len(runs),
        duration=float(record.period * moves.samples().sum()),
        residual=fitted.residual / float(hydraulics.area),
        pressure=(float(np.percentile(pressure, 5)), float(np.percentile(pressure, 95))),
        temperature=(float(record.oil_temperature.min()), float(record.oil_temperature.max())),
        lifts=int(moves.lifting[runs].sum()),
        lowers=int((~moves.lifting[runs]).sum()),
    )


def _rougher(unit: DdhUnit) -> DdhUnit:
    """The unit with pumps whose friction is larger by a hundredth of their hydro-mechanical efficiency."""

    def side(which: Side) -> Side:
        pump = which.pump
        return replace(which, pump=replace(pump, hydromechanical_efficiency=pump.hydromechanical_efficiency - 0.01))

    return replace(unit, a=side(unit.a), b=side(unit.b))


def _estimates(fitted: BalanceFit, friction: float, friction_half: float) -> dict[str, Estimate]:
    how, half = fitted.deviation, fitted.half_width

    def estimate(name: str) -> Estimate:
        value = float(getattr(how, name))
        return Estimate(value, value - half[name], value + half[name], name in fitted.free)

    soft = estimate("compliance")
    told = friction_half < FRICTION_LIMIT and friction > 0.0
    return {
        "leak": estimate("leak"),
        "orifice": estimate("orifice"),
        "displacement": estimate("displacement"),
        "friction": Estimate(
            friction if told else 1.0,
            (friction if told else 1.0) - friction_half,
            (friction if told else 1.0) + friction_half,
            told,
        ),
        "stiffness": Estimate(
            1.0 / soft.value, 1.0 / soft.high, 1.0 / soft.low if soft.low > 0.0 else float("inf"), soft.told
        ),
    }


def _record(unit: DdhUnit, log: xarray.Dataset, truth: xarray.Dataset) -> Record:
    for side in (unit.a, unit.b):
        if side.pump.table is not None:
            raise IdentifyError(
                f'{side.pump.name} is described by a table of efficiencies; identify needs losses = "analytic"'
            )
    time, at = log["time"].values, truth["time"].values
    common = (time >= at[0]) & (time <= at[-1])
    if common.sum() < 50:
        raise IdentifyError(
            f"the log ({time[0]:g} to {time[-1]:g} s) and the position ({at[0]:g} to {at[-1]:g} s) have too little "
            "time in common"
        )
    position = np.interp(time, at, truth["position"].values)[common]
    stroke = unit.cylinder.stroke
    if position.min() < -0.05 * stroke or position.max() > 1.05 * stroke:
        raise IdentifyError(
            f"the position runs from {1e3 * position.min():.0f} to {1e3 * position.max():.0f} mm; the cylinder's "
            f"stroke allows 0 to {1e3 * stroke:.0f} mm, 0 being retracted"
        )
    speed, torque, temperature = (
        log[name].values[common] for name in ("motor_speed", "motor_torque", "oil_temperature")
    )
    return Record(time[common], speed, torque, temperature, position)
