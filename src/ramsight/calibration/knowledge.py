"""What was measured of one machine, over its description, and what its sensor may assume from then on.

Three things measure it: an identification with a position sensor, the self-calibrating sensor itself, and a leak test.
Each gives factors over the description with their standard deviations. They are the prior of that machine's sensor; the
errors that thermometer and torque may have on another day are added.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from ramsight.calibration.identify import Estimate, Identification
from ramsight.calibration.identify_replay import orifice_at_one
from ramsight.calibration.identify_report import summary, words_of
from ramsight.calibration.leakage import LeakTest, leak_test_summary, per_kelvin
from ramsight.calibration.loss_uncertainty import THERMOMETER
from ramsight.machine.description import Unit
from ramsight.normal import TWO_SIDED_95
from ramsight.plant.limits import limits_of
from ramsight.plant.pump import Pump
from ramsight.plant.unit import HydraulicUnit
from ramsight.plant.valve import orifice_flow
from ramsight.sensor.thresholds import LEAKAGE_REFERENCE
from ramsight.signals import Dataset

if TYPE_CHECKING:
    from ramsight.machine.assumption_description import Assumptions

_CHANGED, _REACHED = 1e-3, 1e-4
"""Chance that a machine whose leakage was measured leaks otherwise by now, and that a piston that was at both ends
stops elsewhere."""
_AT_END = 2e-3
"""How near an end the measured position has to be [m]: twice what a usual position sensor is off."""
_EXPONENT_MOST = 0.5  # what a description may state of it
_ASSUMED = (("leak", "leak"), ("displacement", "displacement"), ("compliance", "stiffness"))
"""Standard deviations that the sensor assumes, and the factor that each belongs to."""


@dataclass(frozen=True)
class MachineKnowledge:
    """What was measured of a machine."""

    origin: str  # what measured it, as a value's source names it
    # factors: over the description's [1], by name of `FACTORS`; one that is missing or not identified stays as
    # described
    factors: Mapping[str, Estimate]
    # assumed: of the sensor's assumptions: path, value [SI] and the words of its source
    assumed: Mapping[str, tuple[float, str]]
    lines: tuple[str, ...]  # what was found, as lines of text


def of_identification(found: Identification, described: Unit) -> MachineKnowledge:
    """What an identification with a measured position says.

    Args:
        found: of the unit.
        described: the unit's description.
    """
    factors, assumptions = found.factors, described.assumptions
    assumed = dict(_assumed(factors, assumptions, 0.0 if factors["orifice"].identified else None))
    stops = assumptions.stops
    low, high = found.reached
    if low < stops.retracted + _AT_END and high > described.cylinder.stroke - stops.extended - _AT_END:
        words = f"the measured position reached both ends, {1e3 * low:.1f} and {1e3 * high:.1f} mm"
        assumed["stops.undeclared"] = min(stops.undeclared, _REACHED), words
    return MachineKnowledge("identified", factors, assumed, tuple(summary(found).splitlines()))


def of_leak_test(test: LeakTest, described: Unit) -> MachineKnowledge:
    """What a leak test says.

    Args:
        test: of the unit.
        described: the unit's description.
    """
    factors = {"leak": _estimate(test.factor, test.std, test.per_kelvin, test.per_torque)}
    lines = tuple(leak_test_summary(test).splitlines())
    return MachineKnowledge("leak test", factors, dict(_assumed(factors, described.assumptions)), lines)


def of_sensor(track: Dataset, described: Unit, built: HydraulicUnit, temperature: float) -> MachineKnowledge:
    """What the self-calibrating sensor has learned at the end of a track.

    Args:
        track: with the learned factors [1] and the hypotheses' probabilities [1].
        described: the unit's description, which the sensor began with.
        built: the unit of that description.
        temperature: of the oil, mean of the log [K].
    """
    last = {str(name): float(track[name][-1]) for name in track.data_vars}
    assumptions = described.assumptions
    assumed_std = {name: getattr(assumptions.machine, name) for name in ("leak", "displacement", "compliance")}

    def learned(name: str, by_kelvin: float = 0.0, by_torque: float = 0.0) -> Estimate:
        value, std = last[f"{name}_factor"], last[f"{name}_factor_std"]
        return replace(_estimate(value, std, by_kelvin, by_torque), identified=std < assumed_std[name])

    leak = last["leak_factor"]
    # A torque stands for a pressure, with which leakage through gaps is in proportion (eq. 10).
    factors = {
        "leak": learned("leak", leak * per_kelvin(built.oil, temperature), -0.01 * leak),
        "displacement": learned("displacement"),
        "stiffness": learned("compliance").reciprocal,
    }
    by_other = last["leaks_probability"]
    assumed = dict(_assumed(factors, assumptions, by_other))
    if factors["leak"].identified:
        exponent, own = last["leak_exponent"], last["leak_exponent_std"]
        by_edges = _law(factors["leak"], exponent, own, built, temperature)
        left = exponent if by_edges == {} else 0.0  # of the exponent, which the description cannot state
        std = math.sqrt(own**2 + left**2 + by_other * (1.0 - by_other) * assumptions.machine.other_exponent**2)
        words = f"exponent of the leakage {exponent:+.3f}, another law: {100.0 * by_other:.2g} %"
        assumed["machine.leak_exponent"] = min(_rounded(std), _EXPONENT_MOST), words
        factors |= by_edges
    undeclared = max(last["low_probability"], last["top_probability"], _REACHED)
    if undeclared < assumptions.stops.undeclared:
        assumed["stops.undeclared"] = _rounded(undeclared), "by the sensor, after its visits to the end stops"
    lines = tuple(words_of(name, one) for name, one in factors.items() if one.identified)
    return MachineKnowledge("learned", factors, assumed, lines)


def _law(leak: Estimate, exponent: float, std: float, unit: HydraulicUnit, temperature: float) -> dict[str, Estimate]:
    """Leakage through gaps and through edges that together grow with pressure as was learned; nothing if none do.

    With p_r the pressure at which the sensor's exponent n has no effect, Q the described leakage there and O the
    orifice's at its factor one, a share 1 - 2 n of f Q through gaps and one of 2 n through edges have the learned value
    and the slope 1 - n there: the factors are (1 - 2 n) f and 2 n f Q/O.
    """
    pumps = [part for part in unit.parts() if isinstance(part, Pump)]
    if exponent <= 0.0 or any(pump.orifice_leak for pump in pumps):
        return {}
    edges = min(2.0 * exponent, 1.0)
    reference = float(LEAKAGE_REFERENCE) * limits_of(unit).pressure
    oil = unit.oil.viscosity(temperature), unit.oil.density
    ratios = [
        float(pump.leakage(pump.nominal_speed, reference, *oil) / orifice_flow(orifice_at_one(pump), reference))
        for pump in pumps
    ]
    at_one = leak.value * sum(ratios) / len(ratios)
    gaps = replace(leak, **{name: (1.0 - edges) * getattr(leak, name) for name in ("value", "low", "high")})
    return {"leak": gaps, "orifice": _estimate(edges * at_one, 2.0 * std * at_one, 0.0, 0.0)}


def completed(known: MachineKnowledge, leakage: MachineKnowledge) -> MachineKnowledge:
    """What is known, and the leakage of a leak test where it is not: a sensor that knows it knows its law as well."""
    if known.factors["leak"].identified:
        return known
    factors, assumed = {**known.factors, **leakage.factors}, {**known.assumed, **leakage.assumed}
    return MachineKnowledge("commissioned", factors, assumed, (*known.lines, *leakage.lines))


def _assumed(
    factors: Mapping[str, Estimate], assumptions: Assumptions, by_other: float | None = None
) -> Iterator[tuple[str, tuple[float, str]]]:
    """Standard deviations of what was found, over it [1]; no factor is known worse than it was before.

    Of a machine whose leakage was measured, but not its law, the exponent is that of both laws together. That it leaks
    otherwise means from then on that it has changed.

    Args:
        by_other: probability that it leaks by another law than described; None: what the leak factor says of it.
    """
    machine = assumptions.machine
    for key, name in _ASSUMED:
        factor = factors.get(name)
        if factor is None or not factor.identified:
            continue
        words = words_of(name, factor)
        torque = 100.0 * assumptions.drive.torque_gain * factor.per_torque
        std = math.hypot(factor.std, THERMOMETER * factor.per_kelvin, torque)
        relative = std / factor.value if factor.value > 0.0 else math.inf  # all of the leakage may be through edges
        yield f"machine.{key}", (min(_rounded(relative), getattr(machine, key)), words)
        if name == "leak":
            share = _by_other_law(factor.value, std, assumptions) if by_other is None else by_other
            exponent = math.sqrt((1.0 - share) * machine.leak_exponent**2 + share * machine.other_exponent**2)
            if share > 0.0:
                yield (
                    "machine.leak_exponent",
                    (_rounded(exponent), f"that it leaks by another law: {100.0 * share:.2g} %"),
                )
            yield "machine.leaks_otherwise", (min(_CHANGED, machine.leaks_otherwise), words)


def _by_other_law(leak: float, std: float, assumptions: Assumptions) -> float:
    """Probability that a machine leaks by another law than described: Bayes' theorem.

    Args:
        std: of that factor [1].
        assumptions: with how probable both laws are, and how much a machine leaks by each.
    """
    machine = assumptions.machine
    usual, other = (math.hypot(std, one) for one in (machine.leak, machine.other_leak))
    prior = machine.leaks_otherwise / (1.0 - machine.leaks_otherwise)
    odds = math.log(prior * usual / other) + 0.5 * (leak - 1.0) ** 2 * (usual**-2 - other**-2)
    return 0.5 * (1.0 + math.tanh(0.5 * odds))  # the logistic function, which no odds make overflow


def _rounded(value: float) -> float:
    """A probability or deviation as it is written: three digits."""
    return float(f"{value:.3g}")


def _estimate(value: float, std: float, per_kelvin: float, per_torque: float) -> Estimate:
    half = TWO_SIDED_95 * std
    return Estimate(value, value - half, value + half, True, per_kelvin, per_torque)
