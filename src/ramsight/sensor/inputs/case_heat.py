"""How much warmer the oil in the pumps' gaps is than the tank's thermometer, by what the pumps lose.

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
from ramsight.sensor.thresholds import CASE_WARMER_MOST


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
