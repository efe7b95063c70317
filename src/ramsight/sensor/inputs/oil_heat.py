"""How fast the oil of the tank warms up, and how much warmer it is in the gaps of the pumps.

Trapped oil expands as it warms up. The thermometer has noise and steps, so it is smoothed by a first-order filter whose
time constant grows with its age up to 20 s. The rate is the filter's own change over the sample, so that the sum of the
rates is the change of the smoothed temperature exactly.

The gaps are warmer by what the pumps lose:

    C_c dD/dt = P - G_ct D - C_c dT_t/dt,    D = T_c - T_t

P is what leakage and friction of the pumps turn into heat, by the balance of the sample; capacity and conductance are
those of the description (`ramsight.plant.heat`). What the cases lose to the air is left out: a hundredth of what the
oil carries away, at an ambient temperature that is unknown. Solved implicitly, so that a long sample ends in
equilibrium.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Scalar, within
from ramsight.plant.heat import HeatStores
from ramsight.plant.symbols import Parameters
from ramsight.sensor.inputs.sample import Sample
from ramsight.sensor.thresholds import CASE_WARMER_MOST, SHORTEST_STEP, SMOOTHING_TIME


@dataclass(frozen=True, kw_only=True)
class WarmingState:
    """The smoothed thermometer."""

    temperature: Scalar = leaf("K")  # smoothed [K]
    age: Scalar = leaf("s")  # of the filter [s]


def warming_rate(state: WarmingState, sample: Sample) -> tuple[WarmingState, Scalar]:
    """Rate of the smoothed temperature [K/s]."""
    dt = sample.elapsed
    before = ca.if_else(state.age > 0.0, state.temperature, sample.oil_temperature)
    change = dt / (ca.fmin(state.age, SMOOTHING_TIME) + dt + SHORTEST_STEP) * (sample.oil_temperature - before)
    rate = ca.if_else(dt > 0.0, change / ca.fmax(dt, SHORTEST_STEP), 0.0)
    return WarmingState(temperature=before + change, age=state.age + dt), rate


@dataclass(frozen=True, kw_only=True)
class CaseState:
    """The pumps' cases as a heat store."""

    warmer: Scalar = leaf("K")  # than the tank [K]
    tank: Scalar = leaf("K")  # temperature of the tank at the last sample [K]; 0 before the first


@dataclass(frozen=True)
class CaseParameters:
    """Heat capacity of the cases [J/K] and their conductance to the tank [W/K]."""

    capacity: Scalar
    to_tank: Scalar

    @classmethod
    def of(cls, table: Parameters, stores: HeatStores) -> CaseParameters:
        """As parameters of the recursion."""
        return cls(table.add("heat.case", stores.case), table.add("heat.case_to_tank", stores.case_to_tank))


def with_case(sample: Sample, state: CaseState | None) -> Sample:
    """The sample with the oil in the gaps as warm as the cases are."""
    return sample if state is None else replace(sample, pump_warmer=state.warmer)


def heat_case(state: CaseState, sample: Sample, heat: Scalar, passed: Scalar, cases: CaseParameters) -> CaseState:
    """The cases after a sample.

    Args:
        heat: into the cases [W].
        passed: time since the last sample, gaps that are not counted included [s].
    """
    tank = sample.oil_temperature
    risen = ca.if_else(state.tank > 0.0, tank - state.tank, 0.0)
    stored = state.warmer - risen + sample.elapsed * heat / cases.capacity
    warmer = stored / (1.0 + ca.fmax(passed, sample.elapsed) * cases.to_tank / cases.capacity)
    return CaseState(warmer=within(warmer, -CASE_WARMER_MOST, CASE_WARMER_MOST), tank=tank)
