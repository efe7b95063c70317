"""Oil that is lost: how leakage changes while the machine works, what closed valves let by, pumps that starve.

    leak = factor * exp(lag * d ln(nu)/dt - warmer * d ln(nu)/dT) * (p / p_ref)^(-e)

The described leakage takes the reported temperature for that of the oil in the pumps' gaps. A thermometer in the tank
lags by `lag`, and the oil in the gaps may be `warmer` all the time: in cold oil each kelvin is 6 % of leakage, in warm
oil 3 %, so that a machine that warms up shows which it is. And leakage has a law of pressure, laminar gaps as a
rule, in which it is proportional to the pressure; where a part of it passes orifices, seals or wider gaps it grows
otherwise, by an exponent `e` less. All are quantities that the filter learns (`bank`). The pressure is that of the
torque.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Real, Scalar, Vector, negated, within
from ramsight.plant.oil import MINERAL_EXPANSION, trapped_expansion
from ramsight.plant.pump import Pump
from ramsight.plant.valve import CLOSED_POINT
from ramsight.sensor.inputs.sample import Sample
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.quantity import FACTOR_OF, Quantity, Values
from ramsight.sensor.thresholds import (
    FRICTION_TORQUE_SHARE,
    KELVIN,
    LEAK_FACTOR_LEAST,
    LEAK_FACTOR_MOST,
    LEAKAGE_REFERENCE,
    OUTSIDE,
    SHORTEST_STEP,
    SMOOTHING_TIME,
)


@dataclass(frozen=True, kw_only=True)
class LeakageState:
    """The slow temperature from whose distance the rate of change follows."""

    temperature: Scalar = leaf("K")  # [K]
    age: Scalar = leaf("s")  # of the filter [s]


@dataclass(frozen=True)
class Leakage:
    """Leakage at a sample, and how it follows what the filter learns."""

    change: Scalar  # logarithm of the viscosity some time ago over now: how much leakage has grown meanwhile [1]
    rate: Scalar  # of that [1/s]
    per_kelvin: Scalar  # decrease of the viscosity's logarithm [1/K]
    by_exponent: Scalar  # logarithm of the reference torque over the torque [1]

    def scale(self, learned: Values) -> Scalar:
        """Leakage over that by its factor [1]."""
        power = learned[Quantity.LAG] * self.rate + learned[Quantity.EXPONENT] * self.by_exponent
        if Quantity.WARMER in learned:
            power = power + learned[Quantity.WARMER] * self.per_kelvin
        # No law makes more of a leakage than lies between the tightest and the leakiest pump.
        most = math.log(LEAK_FACTOR_MOST / LEAK_FACTOR_LEAST)
        return ca.exp(within(power, -most, most))

    def factors(self, learned: Values) -> list[Scalar]:
        """Factors of the balance at this sample, in its order [1]."""
        leak = learned[Quantity.LEAKAGE] * self.scale(learned)
        return [leak, learned[Quantity.DISPLACEMENT], learned[Quantity.COMPLIANCE]]

    def derivatives(self, by: Mapping[str, Scalar], learned: Values) -> dict[Quantity, Scalar]:
        """Derivatives with respect to what the filter learns, from those with respect to the balance's factors.

        Args:
            by: with respect to the factors, leakage as it is at this sample.
        """
        scale = self.scale(learned)
        factor = learned[Quantity.LEAKAGE] * scale
        found = {of: by[name] for name, of in FACTOR_OF.items()}
        found[Quantity.LEAKAGE] = by["leak"] * scale
        found[Quantity.LAG] = by["leak"] * factor * self.rate
        found[Quantity.EXPONENT] = by["leak"] * factor * self.by_exponent
        if Quantity.WARMER in learned:
            found[Quantity.WARMER] = by["leak"] * factor * self.per_kelvin
        return found

    def at_reported(self, leak: Scalar, warmer: Scalar) -> tuple[Scalar, dict[Quantity, Scalar]]:
        """Leakage over the described one at the reported temperature, and its derivatives."""
        scale = ca.exp(warmer * self.per_kelvin)
        return leak * scale, {Quantity.LEAKAGE: scale, Quantity.WARMER: leak * scale * self.per_kelvin}


def leakage_law(
    state: LeakageState, sample: Sample, expected_torque: Scalar, model: MachineModel
) -> tuple[LeakageState, Leakage]:
    """The law of leakage at a sample.

    Args:
        expected_torque: at the last sample [N m].
    """
    now, dt = sample.oil_temperature, sample.elapsed
    before = ca.if_else(negated(sample.started), now, state.temperature)
    after = before + dt / (ca.fmin(state.age, SMOOTHING_TIME) + dt + SHORTEST_STEP) * (now - before)
    # Two filters that begin with the same noisy sample differ by that noise for a while.
    settled = ca.fmin(state.age / (-math.log(OUTSIDE) * SMOOTHING_TIME), 1.0)
    gaps = sample.pump_temperature
    # A thermometer's lag does not concern how much warmer the gaps are.
    ratio: Real = model.viscosity(after + sample.pump_warmer) / model.viscosity(gaps)
    change = settled * ca.log(ratio)
    share = within(ca.fabs(expected_torque / model.relief_torque), FRICTION_TORQUE_SHARE, 1.0)
    law = Leakage(
        change=change,
        rate=change / SMOOTHING_TIME,
        per_kelvin=ca.log(model.viscosity(gaps) / model.viscosity(gaps + KELVIN)) / KELVIN,
        by_exponent=ca.log(LEAKAGE_REFERENCE / share),
    )
    return LeakageState(temperature=after, age=state.age + dt), law


def creep(sample: Sample, position: Scalar, load: Scalar, warming: Scalar, model: MachineModel) -> Scalar:
    """By how much the position's standard deviation grows while a closed valve holds the load [m].

    Closed valves leak by a rate that is unknown and constant, and trapped oil changes its volume with its temperature,
    by more than is described or, where nothing is described, as mineral oil does. Both errors keep their sign, so
    deviations are added and not their squares.

    Args:
        position: before it [m].
        load: over what the relief valves carry [1].
        warming: of the oil [K/s].
    """
    unit, machine = model.unit, model.assumed.machine
    area = float(unit.cylinder.area(unit.held))
    pressure = model.limits.pressure * ca.fmin(ca.fabs(load), 1.0)
    viscosity = model.viscosity(sample.oil_temperature)
    leaks = machine.closed_leakage * CLOSED_POINT * pressure / viscosity / area * sample.elapsed
    volume, _ = model.trapped_oil(position)
    per_kelvin = trapped_expansion(sample.oil_temperature, MINERAL_EXPANSION) * volume / area
    share = machine.expansion if unit.oil.expansion is not None else math.hypot(1.0, machine.expansion)
    grown: Scalar = leaks + share * per_kelvin * ca.fabs(warming) * sample.elapsed
    return grown


def unfilled_std(z: Vector, speed: Scalar, model: MachineModel) -> Real:
    """Standard deviation of the share of a pump's chambers that fills [1], of the pump of which it is largest.

    Chambers that fill whatever the inlet lets through are certain to; of those that do not, what comes in is as
    uncertain as the way in: half of what lies between one that passes a standard deviation more and one that passes as
    much less.

    Args:
        speed: of the motor [rad/s].
    """
    balance, tank, std = model.balance, model.of_circuit("tank.pressure"), model.assumed.machine.filling
    largest: Real = 0.0
    for part in balance.unit.parts():
        if isinstance(part, Pump) and part.filling is not None:
            passes = model.of_circuit(f"{part.name}.filling")
            changed: dict[str, Any] = {"displacement": model.of_circuit(f"{part.name}.displacement")}
            pump = replace(part, **changed)  # a part's law takes symbols for its numbers
            inlet, outlet = (balance.pressure(z, node, tank) for node in (part.inlet, part.outlet))
            more, less = (
                _with_filling(pump, passes * (1.0 + way * std)).filled(part.belt * speed, inlet, outlet)
                for way in (1.0, -1.0)
            )
            largest = ca.fmax(largest, 0.5 * (more - less))
    return largest


def _with_filling(pump: Pump, passes: Scalar) -> Pump:
    """A pump with another flow that its way in passes."""
    changed: dict[str, Any] = {"filling": passes}
    return replace(pump, **changed)
