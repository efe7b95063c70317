"""A step of the load observer: the circuit's balance under the load from before, and what it finds of a sample."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca

from ramsight.expression import Condition, Flag, Real, Scalar, Vector, all_of, any_of, negated
from ramsight.plant.balance import Balance, Solution
from ramsight.sensor.inputs.sample import Sample
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.thresholds import (
    FRICTION_SPREAD,
    HALF,
    MIXED_FRICTION_SPEED,
    MOTOR_TURNS,
    SETTLED_SHARE,
    SHORTEST_STEP,
)


@dataclass(frozen=True)
class Motion:
    """How the piston moves."""

    travel: Scalar  # since the last sample [m]
    free_travel: Scalar  # what it would be had the load not changed [m]
    velocity: Scalar  # [m/s]
    noise: Scalar  # standard deviation of the position by the torque's noise [m]
    give: Scalar  # travel per load that the oil's compression allows [m/N]
    give_alone: Scalar  # the same where the other chamber has no pressure left [m/N]
    bounce: Scalar  # half a period of the mass on that oil [s]
    flies: Real  # how high a load that has been thrown up may fly beyond that [m]; 0 where none has


@dataclass(frozen=True)
class TorqueStep:
    """How the torque compares with its expectation."""

    expected: Scalar  # after the correction [N m]
    change: Scalar  # of the expectation since the last sample [N m]
    innovation: Scalar  # torque less what was expected before the correction, beyond what friction hides [N m]
    missed: Scalar  # the same with all of it [N m]
    noise: Scalar  # standard deviation of the torque [N m]
    hidden: Scalar  # within which it shows nothing at standstill [N m]; 0 while the motor turns
    shows: Scalar  # how much it shows of the load, 1 where virtual work holds, 0 where a valve carries it [1]


@dataclass(frozen=True)
class LoadEstimate:
    """The load."""

    value: Scalar  # on the piston, its friction beside it [N]
    asked: Scalar  # that the torque asks for, be it possible or not [N]
    std: Scalar  # standard deviation [N]
    carried: Scalar  # load that the pressures carry [N]
    empty: Condition  # whether the held chamber has no pressure left and the other one gives no force either
    empty_share: Real  # how likely that is so for a moment, less than half a period of the mass on its oil, 0 to 1


@dataclass(frozen=True)
class LoadStep:
    """What the load observer finds of a sample."""

    motion: Motion  # of the piston
    torque: TorqueStep  # of the motor
    load: LoadEstimate  # on the piston
    z: Vector  # states of the circuit
    travel_by: tuple[Scalar, ...]  # derivatives of the travel with respect to the balance's factors [m]
    torque_by: tuple[Scalar, ...]  # of the torque that it shows of a piston that stands [N m]
    # over_pressures: torque beyond what measured pressures ask of the pump, and its standard deviation by theirs [N
    # m]; None where there are none
    over_pressures: tuple[Scalar, Scalar] | None
    # pump_heat: what leakage and friction of the pumps turn into heat [W]; None where no heat is described
    pump_heat: Scalar | None


@dataclass(frozen=True)
class StepProblem:
    """The balance's step over a sample; a call solves it."""

    balance: Balance  # of the unit
    # mean_speed, speed: of the motor, during the sample and at its end [rad/s]
    mean_speed: Scalar
    speed: Scalar
    acceleration: Scalar  # of the motor at its end [rad/s2]
    p: Vector  # the circuit's parameters
    h: Scalar  # the sample's length [s]
    factors: Sequence[Real]  # of the machine, as estimated before the sample
    held: Flag  # whether the piston is held where it is

    @classmethod
    def of(cls, sample: Sample, factors: Sequence[Real], held: Flag, warming: Real, model: MachineModel) -> StepProblem:
        """Of a sample.

        Args:
            warming: rate of the oil's temperature [K/s].
        """
        h = ca.fmax(sample.elapsed, SHORTEST_STEP)
        acceleration = (sample.motor_speed - sample.last_speed) / h
        parameters, temperature = list(model.circuit), sample.pump_temperature
        p = model.balance.parameters_at(parameters, temperature, sample.commands, warming=warming)
        return cls(model.balance, sample.mean_speed, sample.motor_speed, acceleration, p, h, factors, held)

    def __call__(
        self, z0: Vector, load: Scalar, guess: Vector, iterations: int, mean_speed: Scalar | None = None, more: int = 0
    ) -> Solution:
        """Solve it from states before it, under a load at its end [N]; `mean_speed` if another one."""
        mean = self.mean_speed if mean_speed is None else mean_speed
        return self.balance.step(
            z0,
            mean,
            self.speed,
            self.acceleration,
            load,
            self.p,
            self.h,
            factors=self.factors,
            held=self.held,
            guess=guess,
            iterations=iterations,
            more=more,
        )


@dataclass(frozen=True)
class TorqueNoise:
    """What hides a torque at a sample."""

    variance: Scalar  # of the torque [N2 m2]
    timing: Scalar  # part of it by the drive's delay [N2 m2]
    pump_friction: Scalar  # of slow pumps [N m]
    hidden: Scalar  # within which a torque at standstill shows nothing, its sign unknown [N m]; 0 while the motor turns


@dataclass(frozen=True)
class FreeStep:
    """The step under the load from before the sample."""

    before: Vector  # states before it
    solution: Solution  # of the step
    # by_load, by_large: how its states follow the load, and one that friction cannot hold [state/N]
    by_load: Vector
    by_large: Vector
    # by_first, by_initial: how the states before it and after it follow the first load [state/N]
    by_first: Vector
    by_initial: Vector
    # torque_by_load, torque_by_first: how the torque follows a load that changes, and the first one [N m/N]
    torque_by_load: Scalar
    torque_by_first: Scalar
    noise: TorqueNoise  # of the torque
    missed: Scalar  # torque less its expectation [N m]
    shown: Flag  # whether the torque of a motor that stands shows the load
    mean_speed: Scalar  # of the motor [rad/s]
    h: Scalar  # the sample's length [s]

    @property
    def hidden(self) -> Scalar:
        """Within which the torque shows nothing at standstill [N m]."""
        return self.noise.hidden

    def near(self, balance: Balance) -> Vector:
        """The states after it, within reach of those before it."""
        near: Vector = balance.near(self.solution.z, self.before, self.mean_speed, self.h)
        return near


def free_step(
    problem: StepProblem,
    before: Vector,
    load: Scalar,
    sample: Sample,
    last: Mapping[str, Scalar],
    model: MachineModel,
) -> FreeStep:
    """Solve the step under the load from before.

    Args:
        load: before it [N].
        last: expected torque [N m] and variance by timing [N2 m2] at the last sample, `torque` and `timing`.
    """
    solution = problem(before, load, before, 3)
    early = problem(before, load, solution.z, 2, problem.speed)
    # At constant speed the step from the end's speed is the same step, if the first solution has converged.
    converged = solution.settled(SETTLED_SHARE * model.torque_std)
    differs = all_of(sample.started, any_of(problem.speed != problem.mean_speed, negated(converged)))
    earlier = ca.if_else(differs, early.torque - solution.torque, 0.0)
    by_large, by_first = solution.by_large_load(), ca.DM(model.balance.rest_by_load())
    by_initial = solution.by_start(by_first, 1.0)
    torque_by_load = solution.torque_by(by_large)
    noise = torque_noise(problem, solution, earlier, sample, last, model)
    return FreeStep(
        before=before,
        solution=solution,
        by_load=solution.by_load(),
        by_large=by_large,
        by_first=by_first,
        by_initial=by_initial,
        torque_by_load=torque_by_load,
        torque_by_first=solution.torque_by(by_initial),
        noise=noise,
        missed=sample.motor_torque - solution.torque,
        shown=_shown_at_rest(solution, torque_by_load, noise.hidden, sample, model),
        mean_speed=problem.mean_speed,
        h=problem.h,
    )


def torque_noise(
    problem: StepProblem,
    solution: Solution,
    earlier: Scalar,
    sample: Sample,
    last: Mapping[str, Scalar],
    model: MachineModel,
) -> TorqueNoise:
    """What hides a torque: noise, the drive's delay, friction at standstill.

    Beside the drive's own noise: how the expected torque changes within the drive's delay, and its change if the motor
    already had the speed of the sample's end (`earlier`). Both are large where a valve opens, and fade with the delay.
    At standstill the sign of friction is unknown: a torque within it shows nothing, one beyond it does.
    """
    drive, h = model.assumed.drive, problem.h
    change = (solution.torque - last["torque"]) * ca.fmin(drive.delay / h, 1.0)
    change = ca.if_else(sample.started, change, 0.0)
    timing = ca.fmax(ca.fmax(change**2, earlier**2), last["timing"] * ca.exp(-2.0 * h / drive.delay))
    slow = 3.0 * MOTOR_TURNS  # either way; the difference is twice the friction
    up, down = (model.balance.torque(solution.z, sign * slow, 0.0, problem.p) for sign in (1.0, -1.0))
    friction = 0.5 * (up - down)
    stands = ca.fabs(sample.motor_speed) < MOTOR_TURNS
    hidden = ca.if_else(stands, FRICTION_SPREAD * friction, 0.0) + _held_back(sample, drive.standing)
    return TorqueNoise(model.torque_std**2 + sample.offset_variance + timing, timing, friction, hidden)


def _held_back(sample: Sample, standing: float) -> Real:
    """Torque that a motor which hardly turns may hold beside its pumps' friction [N m], as declared.

    A motor that drives one way only is never driven back: its pump turns it, against that torque.
    """
    backward: Real = sample.motor_speed if sample.one_way else ca.fabs(sample.motor_speed)
    return ca.if_else(backward < MIXED_FRICTION_SPEED, standing, 0.0) if standing else 0.0


def _shown_at_rest(
    solution: Solution, torque_by_load: Scalar, hidden: Scalar, sample: Sample, model: MachineModel
) -> Flag:
    """Whether the torque of a motor that stands shows the load that it holds, but for friction."""
    shown = all_of(hidden > 0.0, ca.fabs(torque_by_load) > HALF * model.travel_per_radian)
    return all_of(shown, _pump_holds(solution, sample, model))


def _pump_holds(solution: Solution, sample: Sample, model: MachineModel) -> Flag:
    """Whether the motor's torque holds the load, and no valve does.

    Behind a closed valve the other side alone may show a change, and only in one direction: drawn oil has no pressure.
    Noise would let the load grow and never shrink.
    """
    needed = sample.way * model.lift * model.travel_per_radian * model.balance.force(solution.z)
    return ca.fabs(solution.torque - needed) < (1.0 - HALF) * ca.fabs(needed) + model.torque_std
