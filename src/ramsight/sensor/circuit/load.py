"""The load, from the motor's torque: the circuit is simulated under a load that the torque corrects.

The reported speed drives the circuit's own equations (`ramsight.plant.balance`); of all that is in them the load alone
is unknown. An innovation of the torque corrects the load and nothing else, so that oil is never made: if the load turns
out to be heavier, the oil under it is compressed, and the piston moves by just that.

    nu = tau - tau(z1 | F0),    F1 = F0 + K nu,    K = P H / (H^2 P + R),    H = dtau/dF

Until the load has been observed once, the amount of oil in the chambers under it is unknown: then the correction is one
of the initial pressures, at a position that is known. The two corrections share nu by their variances.

The gain is at most 1/(travel per angle), which is what virtual work allows: tau dphi = F dx.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Condition, Flag, Real, Scalar, Vector, all_of, any_of, flag, negated, scalar, within
from ramsight.plant.balance import FACTORS, Solution
from ramsight.sensor.circuit.emptiness import EmptyState, emptiness, not_risen
from ramsight.sensor.circuit.load_step import (
    FreeStep,
    LoadEstimate,
    LoadStep,
    Motion,
    StepProblem,
    TorqueStep,
    free_step,
)
from ramsight.sensor.circuit.pressures import MeasuredPressures, PressureState
from ramsight.sensor.inputs.sample import Sample
from ramsight.sensor.machine_model import MachineModel, one_sided
from ramsight.sensor.thresholds import (
    COMPLIANCE_FACTOR_MOST,
    FIRST_LOAD_SHARE,
    HALF,
    RELEASED_TRAVEL_LEAST,
    SURE_STDS,
    TORQUE_ERROR_TIME,
)

LOAD = "load"


@dataclass(frozen=True, kw_only=True)
class LoadState:
    """The simulated circuit and its load."""

    # circuit: its states but the position, which is the filter's: velocity and pressures [m/s, Pa]
    circuit: Mapping[str, Scalar] = leaf("SI", None)
    load: Scalar = leaf("N", None)  # [N]
    variance: Scalar = leaf("N2", None)  # of a load that changes [N2]
    first_variance: Scalar = leaf("N2", None)  # of the first load, until it has been observed [N2]
    expected_torque: Scalar = leaf("N m")  # at the last sample [N m]
    timing_variance: Scalar = leaf("N2 m2")  # of the torque by the drive's delay [N2 m2]
    give: Scalar = leaf("m/N")  # travel per load that the oil's compression allows [m/N]
    # sensitivities: derivatives of the circuit's states and the load with respect to the balance's factors
    sensitivities: Mapping[str, Mapping[str, Scalar]] = leaf("SI", None)
    pressures: PressureState | None = None  # the chambers' sensors, where there are any
    empty: EmptyState | None = None  # oil that may give the piston no force, where the pumps act on one side only

    @classmethod
    def initial(cls, model: MachineModel) -> LoadState:
        """Before the first sample: at rest under half the load that the relief valves carry."""
        balance, limits = model.balance, model.limits
        load = 0.5 * limits.load
        start = balance.at_rest(0.5 * balance.unit.cylinder.stroke, load)
        circuit = {name: scalar(float(v)) for name, v in zip(balance.states[1:], start[1:], strict=True)}
        # A load that only resists holds no oil under pressure before it is met: there is no first one to be found.
        first = (FIRST_LOAD_SHARE * limits.load) ** 2
        slopes = dict.fromkeys((*circuit, LOAD), scalar(0.0))
        return cls(
            circuit=circuit,
            load=scalar(load),
            variance=scalar(first if model.passive else 0.0),
            first_variance=scalar(0.0 if model.passive else first),
            sensitivities={factor: dict(slopes) for factor in FACTORS},
            pressures=PressureState.initial(model.assumed),
            empty=EmptyState() if one_sided(balance) and not model.passive else None,
        )


@dataclass(frozen=True)
class Piston:
    """The piston before a sample."""

    position: Scalar  # [m]; one that is unknown may be anywhere
    held: Flag  # whether it is held where it is
    leaves: Flag  # whether it was released, and may still stand there

    @classmethod
    def free(cls, position: Scalar) -> Piston:
        """One that nothing holds."""
        return cls(position, flag(False), flag(False))


@dataclass(frozen=True)
class _Gains:
    """Gains of the first load and of the load that changes [N/(N m)], and their variances before the sample [N2]."""

    first: Scalar
    changing: Scalar
    first_variance: Scalar
    variance: Scalar


@dataclass(frozen=True)
class _Innovation:
    """Of the torque."""

    value: Scalar  # that corrects the load [N m]
    used: Scalar  # share of what lies within friction that is used


@dataclass(frozen=True)
class _Corrected:
    """The load after the sample, and the step under it."""

    # first, changing: corrections of the load by either cause [N]
    first: Scalar
    changing: Scalar
    asked: Scalar  # load that the torque asks for [N]
    load: Scalar  # within what is possible [N]
    variance: Scalar  # of a load that changes [N2]
    solution: Solution  # of the step under it
    z: Vector  # its states, within reach


def observe_load(
    state: LoadState,
    sample: Sample,
    piston: Piston,
    factors: Sequence[Real],
    warming: Real,
    model: MachineModel,
) -> tuple[LoadState, LoadStep]:
    """One sample of the simulated circuit.

    Args:
        warming: rate of the oil's temperature [K/s]; used where the oil expands.
    """
    moves = sample.elapsed > 0.0
    problem = StepProblem.of(sample, factors, piston.held, warming, model)
    before, pressures = _before(state, sample, piston, problem, model)
    last = {"torque": state.expected_torque, "timing": state.timing_variance}
    free = free_step(problem, before, state.load, sample, last, model)
    innovation = _innovation(state, free)
    gains = _gains(state, free, innovation.value, piston.held, model)
    over_pressures = None
    if pressures is not None:
        over_pressures = pressures.torque_over(
            free.solution, free.by_large, free.torque_by_load, free.missed, piston.held
        )
    done = _correct(state, problem, free, innovation.value, gains, pressures, piston, model)
    z = ca.if_else(moves, done.z, free.before)
    bounce = model.bounce_time(state.give)
    empty = emptiness(state.empty, z, done.load, done.variance, free.noise.pump_friction, bounce, sample, model)
    z, flies = not_risen(z, free.before, empty, sample, model)
    goes = all_of(moves, negated(empty.surely))
    used = ca.if_else(ca.fabs(free.missed) < free.hidden, innovation.used, 1.0)
    follows = _Following(state, free, done, gains, used, moves, goes)
    slopes, travel_by, torque_by = follows.derivatives()
    freely, _ = not_risen(free.near(model.balance), free.before, empty, sample, model)
    free_travel = ca.if_else(goes, freely[0] - free.before[0], 0.0)
    sinks = _sinking(free, piston, goes, model)
    left = free.missed - free.torque_by_first * done.first - free.torque_by_load * done.changing
    unused = 1.0 - used * (gains.first * free.torque_by_first + gains.changing * free.torque_by_load)
    travel = ca.if_else(goes, z[0] - free.before[0], 0.0) + _sunk(sinks, left, free.hidden, free_travel)
    give = _give(state, free, piston.held, empty.may_be, done.load, model)
    kept_first = (1.0 - gains.first * free.torque_by_first) * gains.first_variance
    after = LoadState(
        circuit={name: z[k] for k, name in enumerate(state.circuit, 1)},
        load=ca.if_else(moves, done.load, state.load),
        variance=ca.if_else(moves, done.variance, state.variance),
        first_variance=ca.if_else(moves, kept_first, state.first_variance),
        expected_torque=done.solution.torque,
        timing_variance=free.noise.timing,
        give=give,
        empty=empty.state,
        sensitivities=slopes,
        pressures=None if pressures is None else pressures.after(z, done.solution.stands, free.h, done.variance),
    )
    step = LoadStep(
        motion=Motion(
            travel=travel,
            free_travel=free_travel,
            velocity=z[1],
            noise=give * model.torque_std / model.travel_per_radian,
            give=give,
            give_alone=_give_alone(give, piston.position, model),
            bounce=bounce,
            flies=flies,
        ),
        torque=TorqueStep(
            expected=done.solution.torque,
            change=done.solution.torque - state.expected_torque,
            innovation=innovation.value,
            missed=free.missed,
            noise=ca.sqrt(free.noise.variance),
            hidden=free.hidden,
            shows=ca.fmin(ca.fabs(free.torque_by_load) / model.travel_per_radian, 1.0),
        ),
        load=LoadEstimate(
            value=after.load,
            asked=done.asked,
            std=ca.sqrt(ca.fmax(gains.variance + gains.first_variance, 0.0)),
            carried=model.balance.force(z),
            empty=empty.surely,
            empty_share=empty.share,
        ),
        z=z,
        travel_by=tuple(by - sinks * unused * more for by, more in zip(travel_by, torque_by, strict=True)),
        torque_by=torque_by,
        over_pressures=over_pressures,
        pump_heat=_heat(z, problem, model),
    )
    return after, step


def _before(
    state: LoadState, sample: Sample, piston: Piston, problem: StepProblem, model: MachineModel
) -> tuple[Vector, MeasuredPressures | None]:
    """States of the circuit before the sample, with pressures that sensors correct."""
    # Chambers have no volume beyond the ends; a position that is unknown may be anywhere.
    position = within(piston.position, 0.0, float(model.unit.cylinder.stroke))
    before = ca.vertcat(position, *state.circuit.values())
    if state.pressures is None:
        return before, None
    pressures = MeasuredPressures.of(state.pressures, sample, model, before, problem.h)
    return pressures.before, pressures


def _innovation(state: LoadState, free: FreeStep) -> _Innovation:
    """The innovation of the torque that corrects the load.

    Friction at standstill has an unknown sign: what lies within it is followed slowly. Before a first load has been
    observed, it is followed as fast as that load is uncertain.
    """
    slowly = ca.if_else(free.shown, ca.fmin(free.h / TORQUE_ERROR_TIME, 1.0), 0.0)
    unknown = free.torque_by_first**2 * state.first_variance
    first_share = unknown / (unknown + free.torque_by_load**2 * state.variance + free.noise.variance)
    slowly = ca.fmax(slowly, ca.if_else(free.shown, first_share, 0.0))
    beyond = ca.sign(free.missed) * ca.fmax(ca.fabs(free.missed) - free.hidden, 0.0)
    return _Innovation(beyond + slowly * (free.missed - beyond), slowly)


def _gains(state: LoadState, free: FreeStep, innovation: Scalar, held: Flag, model: MachineModel) -> _Gains:
    """How much of the innovation corrects the first load, and how much the load that changes."""
    per_angle, noise = model.travel_per_radian, free.noise.variance
    by_first, by_load = free.torque_by_first, free.torque_by_load
    known = 1.0 + state.first_variance * per_angle**2 / model.torque_std**2
    walk = (model.assumed.machine.load_walk * model.relief_load) ** 2 * free.h / known
    variance, first = state.variance + walk, state.first_variance
    total = by_first**2 * first + by_load**2 * variance + noise
    # A load that jumps gains as much variance as explains the torque, on whichever of the two is larger.
    on_first = first > variance
    most = ca.if_else(on_first, by_first, by_load)
    jumps = all_of(innovation**2 > SURE_STDS**2 * total, ca.fabs(most) > HALF * per_angle)
    more = (innovation**2 / SURE_STDS**2 - total) / ca.fmax(most**2, (HALF * per_angle) ** 2)
    more = ca.if_else(jumps, more, 0.0)
    first, variance = first + ca.if_else(on_first, more, 0.0), variance + ca.if_else(on_first, 0.0, more)
    total = by_first**2 * first + by_load**2 * variance + noise
    gains = [by_first * first / total, by_load * variance / total]
    share = ca.fmax(1.0, ca.fabs(gains[0] + gains[1]) * per_angle)
    k_first, k_load = (ca.if_else(held, 0.0, gain / share) for gain in gains)
    if model.passive:
        k_load = ca.if_else(all_of(free.solution.stands, innovation > 0.0), 0.0, k_load)
    return _Gains(k_first, k_load, first, variance)


def _correct(
    state: LoadState,
    problem: StepProblem,
    free: FreeStep,
    innovation: Scalar,
    gains: _Gains,
    pressures: MeasuredPressures | None,
    piston: Piston,
    model: MachineModel,
) -> _Corrected:
    """The load corrected by torque and pressures, and the step under it."""
    first, changing = gains.first * innovation, gains.changing * innovation
    variance = (1.0 - gains.changing * free.torque_by_load) * gains.variance
    if pressures is not None:
        by_pressures, variance = pressures.correction(free.solution, free.by_large, variance, free.h)
        changing = changing + ca.if_else(piston.held, 0.0, by_pressures)
    # No load is beyond what relief valves carry: nothing would hold it, and the simulated piston would run away.
    asked = _starting_load(state, free, innovation, model) + first + changing
    load = within(asked, _least_load(model), model.relief_load)
    z0 = free.before + free.by_first * first
    guess = model.balance.possible(free.solution.z + free.by_load * changing + free.by_initial * first)
    solution = problem(z0, load, guess, 2, more=3)
    # Iterations that have not converged leave nothing impossible behind.
    stroke = model.balance.unit.cylinder.stroke
    gives = COMPLIANCE_FACTOR_MOST * state.give * ca.fabs(load - state.load) + RELEASED_TRAVEL_LEAST * stroke
    z = model.balance.possible(model.balance.near(solution.z, z0, problem.mean_speed, problem.h, gives))
    return _Corrected(first, changing, asked, load, variance, solution, z)


def _least_load(model: MachineModel) -> Real:
    """The load that relief valves carry the other way [N]; one that only resists does not pull."""
    return 0.0 if model.passive else -model.relief_pull


def _starting_load(state: LoadState, free: FreeStep, innovation: Scalar, model: MachineModel) -> Scalar:
    """The load that a correction starts from [N].

    A load that only resists is no larger than what the chambers press with, as far as a standing piston shows: an
    estimate that is larger sinks from there on when the torque shows that the piston moved, and a torque that asks for
    more is no evidence.
    """
    if not model.passive:
        return state.load
    presses = ca.fmin(state.load, ca.fabs(model.balance.force(free.solution.z)))
    return ca.if_else(all_of(free.solution.stands, innovation < 0.0), presses, state.load)


@dataclass(frozen=True)
class _Following:
    """How the step would have been with other factors, the same torques correcting the load: its derivatives.

    The torque's are the first solution's; what the oil gives way under the corrected load, the second one's.
    """

    state: LoadState
    free: FreeStep
    done: _Corrected
    gains: _Gains
    used: Scalar
    moves: Flag
    goes: Flag

    def derivatives(self) -> tuple[dict[str, dict[str, Scalar]], tuple[Scalar, ...], tuple[Scalar, ...]]:
        """Of states and load after the sample by factor, and of travel and torque."""
        found = [self._of(k, name) for k, name in enumerate(FACTORS)]
        slopes = {name: slope for name, (slope, _, _) in zip(FACTORS, found, strict=True)}
        return slopes, tuple(travel for _, travel, _ in found), tuple(torque for _, _, torque in found)

    def _of(self, k: int, factor: str) -> tuple[dict[str, Scalar], Scalar, Scalar]:
        free, before = self.free, self.state.sensitivities[factor]
        first_gain, load_gain = self.gains.first * self.used, self.gains.changing * self.used
        start = ca.vertcat(0.0, *(before[name] for name in self.state.circuit))
        by_free = free.solution.by_factor(k, start, before[LOAD])
        shown = free.solution.torque_by(by_free) + free.solution.torque_by_factor(k)
        first, changing = -first_gain * shown, -load_gain * shown
        # A load at its limit is that limit whatever the factors are.
        load = ca.if_else(self.done.load == self.done.asked, before[LOAD] + first + changing, 0.0)
        z = self.done.solution.by_factor(k, start + free.by_first * first, load)
        after = {name: z[i] for i, name in enumerate(self.state.circuit, 1)} | {LOAD: load}
        kept = {name: ca.if_else(self.moves, new, before[name]) for name, new in after.items()}
        return kept, ca.if_else(self.goes, z[0], 0.0), shown


def _sinking(free: FreeStep, piston: Piston, goes: Flag, model: MachineModel) -> Real:
    """Travel by leakage per torque that no load accounts for yet, of a piston at rest on its pump [m/(N m)]."""
    if model.passive:
        return 0.0
    rests = all_of(free.shown, negated(any_of(piston.held, piston.leaves)))
    return ca.if_else(all_of(goes, rests), free.solution.by_settled_load()[0] / free.torque_by_load, 0.0)


def _sunk(sinks: Real, left: Scalar, hidden: Scalar, free_travel: Scalar) -> Scalar:
    """What a piston at rest sinks beside what its load makes of it [m].

    What friction hides of the load is followed slowly, and leaks meanwhile as the torque shows; no more than the load
    does.

    Args:
        sinks: by leakage, per torque [m/(N m)].
        left: torque that no load accounts for yet [N m].
        hidden: torque that friction may hide [N m].
        free_travel: under the load [m].
    """
    most = ca.fabs(free_travel)
    return within(sinks * ca.fmin(ca.fmax(left, -hidden), hidden), -most, most)


def _give(
    state: LoadState, free: FreeStep, held: Flag, may_be_empty: Condition, load: Scalar, model: MachineModel
) -> Scalar:
    """Travel per load that the oil's compression allows [m/N]."""
    # At its limit a relief valve gives way in the model, and not the oil.
    least, most = ca.fmin(state.load, load), ca.fmax(state.load, load)
    limited = any_of(least <= _least_load(model), most >= model.relief_load)
    other = any_of(held, any_of(may_be_empty, limited))
    return ca.if_else(other, state.give, ca.fabs(free.by_large[0]))


def _give_alone(give: Scalar, position: Scalar, model: MachineModel) -> Scalar:
    """Travel per load where the oil that is shut in with it is the only one under pressure [m/N].

    C / A^2, with its capacity C, hoses among it, and the piston's area A; two filled chambers give less.
    """
    _, capacity = model.trapped_oil(position)
    return ca.fmax(give, capacity / float(model.unit.cylinder.area(model.unit.held)) ** 2)


def _heat(z: Vector, problem: StepProblem, model: MachineModel) -> Scalar | None:
    if model.balance.unit.heat is None:
        return None
    heat: Scalar = model.balance.pump_heat(z, problem.speed, problem.p, problem.factors)
    return heat


def shifted(state: LoadState, changes: Mapping[str, Real]) -> LoadState:
    """The circuit with pressures that follow factors which have changed, by their derivatives.

    Args:
        changes: by factor [1].
    """

    def moved(name: str) -> Real:
        return sum(change * state.sensitivities[factor][name] for factor, change in changes.items())

    circuit = {name: value + moved(name) for name, value in state.circuit.items()}
    return replace(state, circuit=circuit, load=state.load + moved(LOAD))
