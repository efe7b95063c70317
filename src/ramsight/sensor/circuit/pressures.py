"""Measured pressures of the chambers, where a machine has sensors for them.

While the piston moves they show the load, beside the torque; while it stands they show how much oil has leaked, which
the load does not. A sensor's lag is simulated: its report is compared with what it would show of the estimate.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Flag, Real, Scalar, Vector, all_of, flag, negated, scalar
from ramsight.plant.balance import Solution
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.inputs.sample import PRESSURES, Sample, declared_inputs
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.thresholds import HALF, MEMORY_TIME, MIXED_FRICTION_SPEED, PRESSURE_ABOVE, PRESSURE_BELOW


@dataclass(frozen=True, kw_only=True)
class PressureState:
    """The pressure sensors."""

    shown: Mapping[str, Scalar] = leaf("Pa", None)  # what they would show of the estimated pressures [Pa]
    # leaked: change of the estimated pressures since the piston came to stand [Pa]
    leaked: Mapping[str, Scalar] = leaf("Pa", None)
    corrected: Mapping[str, Scalar] = leaf("Pa", None)  # by which reports have corrected them since [Pa]
    load_variance: Scalar = leaf("N2", variance=True)  # of the load when it came to stand [N2]
    begun: Flag = leaf("1")  # whether there was a sample
    stood: Flag = leaf("1")  # whether the piston stood at it

    @classmethod
    def initial(cls, assumptions: Assumptions) -> PressureState | None:
        """Before the first sample; None where no pressures are measured."""
        names = measured_pressures(assumptions)
        if not names:
            return None
        zeros = {name: scalar(0.0) for name in names}
        return cls(shown=zeros, leaked=zeros, corrected=zeros)


def measured_pressures(assumptions: Assumptions) -> list[str]:
    """Those of a sensor's inputs that are pressures: both, or none."""
    return [one for one in declared_inputs(assumptions) if one in PRESSURES]


@dataclass(frozen=True)
class MeasuredPressures:
    """The pressure sensors at a sample."""

    state: PressureState  # before it
    sample: Sample  # the sample
    model: MachineModel  # of the machine
    shown: Mapping[str, Scalar]  # what they would show after correction [Pa]
    corrected: Mapping[str, Scalar]  # by which reports have corrected the estimates [Pa]
    before: Vector  # states of the circuit before the sample, corrected

    @classmethod
    def of(
        cls, state: PressureState, sample: Sample, model: MachineModel, before: Vector, h: Scalar
    ) -> MeasuredPressures:
        """With the pressures of a standing piston moved towards the reported ones.

        The pressure is known as well as the load was when the piston came to stand, and as what leaked since, as well
        as the leakage; the report as well as its sensor, whose error persists. The pressure takes of the difference the
        share of its own variance in both.

        Args:
            h: its length [s].
        """
        values = ca.vertsplit(before)
        shown, corrected = dict(state.shown), dict(state.corrected)
        std, share = model.assumed.pressure.std, h / (MEMORY_TIME + h)
        for name, (place, area) in _chambers(model).items():
            variance = state.load_variance / area**2 + (_leak_std(model) * state.leaked[name]) ** 2
            reported = sample.measured[name]
            gain = variance / (variance + std**2)
            due = gain * (reported - state.shown[name] + state.corrected[name])
            counts = all_of(_possible(reported, model), state.stood, state.begun)
            moved = ca.if_else(counts, share * (due - state.corrected[name]), 0.0)
            values[place] = values[place] + moved
            shown[name] = state.shown[name] + moved
            corrected[name] = state.corrected[name] + moved
        return cls(state, sample, model, shown, corrected, ca.vertcat(*values))

    @property
    def _force_std(self) -> float:
        """Of the force on the piston by the sensors' errors [N]."""
        cylinder = self.model.unit.cylinder
        return math.hypot(cylinder.area_a, cylinder.area_b) * self.model.assumed.pressure.std

    def _both_known(self) -> Flag:
        return all_of(*(_possible(self.sample.measured[name], self.model) for name in PRESSURES))

    def correction(self, solution: Solution, by_load: Vector, variance: Scalar, h: Scalar) -> tuple[Scalar, Scalar]:
        """Correction of the load by the reports [N], and its variance after that [N2].

        Args:
            h: the step [s].
        """
        lag = h / (self.model.assumed.pressure.lag + h)
        missed: Real = 0.0
        slope: Real = 0.0
        for (name, (place, area)), sign in zip(_chambers(self.model).items(), (1.0, -1.0), strict=True):
            expected = self.shown[name] + lag * (solution.z[place] - self.shown[name])
            missed = missed + sign * area * (self.sample.measured[name] - expected)
            slope = slope + lag * sign * area * by_load[place]
        gain = variance * slope / (slope**2 * variance + self._force_std**2)
        counts = all_of(self._both_known(), all_of(self.state.begun, negated(solution.stands)))
        gain = ca.if_else(counts, gain, 0.0)
        return gain * missed, (1.0 - gain * slope) * variance

    def torque_over(
        self, solution: Solution, by_load: Vector, torque_by_load: Scalar, missed: Scalar, held: Flag
    ) -> tuple[Scalar, Scalar]:
        """Reported torque beyond what the pressures ask of the pump [N m], 0 where they show none; its deviation.

        Args:
            torque_by_load: how its torque follows that load [m].
            missed: the reported torque less the solution's [N m].
        """
        force: Real = 0.0
        slope: Real = 0.0
        for (name, (place, area)), sign in zip(_chambers(self.model).items(), (1.0, -1.0), strict=True):
            force = force + sign * area * (self.sample.measured[name] - solution.z[place])
            slope = slope + sign * area * by_load[place]
        # Behind a closed valve, and while the motor hardly turns, the torque shows no pressure.
        shows = all_of(
            ca.fabs(torque_by_load) > HALF * self.model.travel_per_radian,
            ca.fabs(self.sample.motor_speed) > MIXED_FRICTION_SPEED,
        )
        shows = all_of(all_of(shows, negated(held)), ca.fabs(slope) > HALF)
        shows = all_of(self._both_known(), all_of(self.state.begun, shows))
        per_force = ca.if_else(shows, torque_by_load / slope, 0.0)
        over = ca.if_else(shows, missed - per_force * force, 0.0)
        return over, ca.fabs(per_force) * self._force_std

    def after(self, z: Vector, stands: Flag, h: Scalar, load_variance: Scalar) -> PressureState:
        """The sensors after the sample.

        Args:
            h: the step [s].
            load_variance: of the load [N2].
        """
        lag = h / (self.model.assumed.pressure.lag + h)
        shown, leaked, corrected = {}, {}, {}
        for name, (place, _) in _chambers(self.model).items():
            reported = self.sample.measured[name]
            first = ca.if_else(_possible(reported, self.model), reported, z[place])
            later = self.shown[name] + lag * (z[place] - self.shown[name])
            shown[name] = ca.if_else(self.state.begun, later, first)
            since = self.state.leaked[name] + z[place] - self.before[place]
            leaked[name] = ca.if_else(stands, since, 0.0)
            corrected[name] = ca.if_else(stands, self.corrected[name], 0.0)
        return PressureState(
            shown=shown,
            leaked=leaked,
            corrected=corrected,
            load_variance=ca.if_else(stands, self.state.load_variance, load_variance),
            begun=flag(True),
            stood=stands,
        )


def _possible(reported: Scalar, model: MachineModel) -> Flag:
    """Whether a chamber can have a pressure: a sensor without supply shows less than vacuum, or its full scale."""
    highest = float(model.limits.pressure)
    return all_of(reported > -PRESSURE_BELOW * highest, reported < (1.0 + PRESSURE_ABOVE) * highest)


def _chambers(model: MachineModel) -> dict[str, tuple[int, float]]:
    """Of each chamber's pressure its place among the circuit's states, and the piston's area there [m2]."""
    cylinder, states = model.balance.unit.cylinder, model.balance.states
    nodes = ((cylinder.node_a, cylinder.area_a), (cylinder.node_b, cylinder.area_b))
    return {name: (states.index(f"pressure_{node}"), area) for name, (node, area) in zip(PRESSURES, nodes, strict=True)}


def _leak_std(model: MachineModel) -> float:
    """Standard deviation of the leakage over all assumptions of it [1]."""
    known, otherwise = model.assumed.machine, model.assumed.machine.leaks_otherwise
    return math.sqrt((1.0 - otherwise) * known.leak**2 + otherwise * known.other_leak**2)
