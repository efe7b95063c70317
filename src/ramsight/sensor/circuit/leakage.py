"""How leakage changes while the machine works: with the oil in the gaps, and with the pressure.

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
from dataclasses import dataclass

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Real, Scalar, negated, within
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
    """The slow temperature from whose distance the rate of change follows.

    Attributes:
        temperature: [K].
        age: of the filter [s].
    """

    temperature: Scalar = leaf("K")
    age: Scalar = leaf("s")


@dataclass(frozen=True)
class Leakage:
    """Leakage at a sample, and how it follows what the filter learns.

    Attributes:
        change: logarithm of the viscosity some time ago over now: how much leakage has grown meanwhile [1].
        rate: of that [1/s].
        per_kelvin: decrease of the viscosity's logarithm [1/K].
        by_exponent: logarithm of the reference torque over the torque [1].
    """

    change: Scalar
    rate: Scalar
    per_kelvin: Scalar
    by_exponent: Scalar

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
            learned: the quantities that the step was made with.
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
        state: before it.
        sample: the sample.
        expected_torque: at the last sample [N m].
        model: of the machine.
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
