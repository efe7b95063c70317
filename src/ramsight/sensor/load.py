"""The load, from the motor's torque: the circuit is simulated under a load that the torque corrects.

The reported speed drives the circuit's own equations (`ramsight.plant.balance`), and of all that is in them only the
load is unknown. A torque that is not what the equations say corrects the load and nothing else, so that oil is never
made: if the load turns out to be heavier, the oil under it gives way, and the piston moves by just that.

    nu = tau - tau(z1 | F0),    F1 = F0 + K nu,    K = P H / (H^2 P + R),    H = dtau/dF

Before the load has ever been seen it is not known how much oil the chambers hold under it: then the correction is one
of the initial pressures, at a position that is known. The two corrections share nu by their variances.

The gain is never above 1/(travel per angle), which is what virtual work allows: tau dphi = F dx.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca

from ramsight.plant.balance import FACTORS, Balance, Solution
from ramsight.plant.limits import Limits
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.pressures import MeasuredPressures
from ramsight.sensor.pumping import one_sided
from ramsight.sensor.virtual_sensor import PRESSURES, SensorGraph
from ramsight.sensor.warming import warming_of

SEEN_AT = 0.5
"""Share of what virtual work says that a torque shows of a load, from which the pump holds it and the load is seen."""
_SHORTEST = 1e-3  # s; a step that is solved even where no time passed, and not used then
_GATE = 16.0  # a torque four standard deviations away is a load that jumped, not noise
_STANDING = 1.0  # rad/s; friction of a motor slower than this has a sign that nobody knows
_MIXED = 5.0  # rad/s; slower, bearings, gears and shaft seals have mixed friction, which falls with the speed
_GIVES, _LEAST_GIVEN = 3.0, 2e-3  # what oil gives under a load's change over what it gave, and share of the stroke
_WITHIN = 0.2  # s; time constant for a torque that friction at standstill may explain
_ROUGHER = 1.25  # friction of a usual pump over the described one
_FIRST = 0.3  # of the load at relief pressure: standard deviation of one that has not been seen yet
_INERT = 0.01  # of the torque's noise; less adds nothing to it
_NOTHING = 4.0  # standard deviations of the torque; a load that shows no more may be none


@dataclass(frozen=True)
class LoadStep:
    """What the observer says of a sample.

    Attributes:
        travel: of the piston since the last sample [m].
        free_travel: what it would be had the load not changed [m].
        travel_by: derivatives of `travel` with respect to `FACTORS` [m].
        torque_by: of the torque, with respect to `FACTORS`, since the pistons stands [N m].
        surprise: torque less what was expected [N m].
        change: of the expected torque since the last sample [N m].
        noise: standard deviation of the torque [N m].
        friction: that hides a torque at standstill, its sign unknown [N m]; 0 while the motor turns.
        noise_travel: of the position from that noise [m].
        give: travel per load that the oil's compression allows [m/N].
        bounce: half a period of the mass on that oil [s].
        seen: how much the torque shows of the load, 1 where virtual work holds, 0 where it is blind [1].
        load: on the piston, its friction beside it [N].
        asked: the load that the torque asks for, be it possible or not [N].
        load_std: standard deviation of the load [N].
        carried: load that the pressures carry [N].
        empty: whether the held chamber has no pressure left and the other one gives no force either.
        may_be_empty: how likely that is so for a moment, less than half a period of the mass on its oil, 0 to 1.
        torque: as expected after the correction [N m].
        z: the circuit's states.
        velocity: of the piston [m/s].
        over_pressures: torque beyond what measured pressures ask of the pump, and its standard deviation by theirs
            [N m]; None where there are none.
        pump_heat: what leakage and friction of the pumps turn into heat [W]; None where no heat is described.
    """

    travel: Any
    free_travel: Any
    travel_by: tuple[Any, ...]
    torque_by: tuple[Any, ...]
    surprise: Any
    change: Any
    noise: Any
    friction: Any
    noise_travel: Any
    give: Any
    bounce: Any
    seen: Any
    load: Any
    asked: Any
    load_std: Any
    carried: Any
    empty: Any
    may_be_empty: Any
    torque: Any
    z: Any
    velocity: Any
    over_pressures: tuple[Any, Any] | None
    pump_heat: Any


def _beyond(value: Any, limit: Any) -> Any:
    """What is left of a value beyond a limit either way."""
    return ca.sign(value) * ca.fmax(ca.fabs(value) - limit, 0.0)


def _sunk(sinks: Any, hidden: Any, friction: Any, free_travel: Any) -> Any:
    """What a piston at rest sinks beside what its load makes of it [m].

    What friction hides of the load is taken slowly, and leaks meanwhile as the torque says; no more than the load does.

    Args:
        sinks: by leakage, per torque [m/(N m)].
        hidden: torque that no load accounts for yet [N m].
        friction: that may hide it [N m].
        free_travel: under the load [m].
    """
    most = ca.fabs(free_travel)
    return ca.fmin(ca.fmax(sinks * ca.fmin(ca.fmax(hidden, -friction), friction), -most), most)


@dataclass(frozen=True)
class _Gains:
    """Of the torque's surprise on the first load and on the load that walked, and their variances before it [N2]."""

    initial: Any
    walked: Any
    initial_variance: Any
    walked_variance: Any


@dataclass(frozen=True)
class _Solver:
    """The balance's step over a sample; a call solves it.

    Attributes:
        balance: of the unit.
        mean_speed, speed: of the motor, during the sample and at its end [rad/s].
        acceleration: of the motor at its end [rad/s2].
        p: the circuit's parameters.
        h: the sample's length [s].
        factors: as believed before the sample.
        held: whether the piston is held where it is.
    """

    balance: Balance
    mean_speed: Any
    speed: Any
    acceleration: Any
    p: Any
    h: Any
    factors: list[Any]
    held: Any

    def __call__(
        self, z0: Any, load: Any, guess: Any, iterations: int, mean_speed: Any = None, *, more: int = 0
    ) -> Solution:
        """Solve it from states before it, under a load at its end [N]; `mean_speed` if another one."""
        mean = self.mean_speed if mean_speed is None else mean_speed
        how: dict[str, Any] = {"factors": self.factors, "held": self.held, "guess": guess, "iterations": iterations}
        return self.balance.step(z0, mean, self.speed, self.acceleration, load, self.p, self.h, **how, more=more)


@dataclass(frozen=True)
class _Free:
    """The step under the load as it was believed before the sample.

    Attributes:
        before: states before it.
        first: the solved step.
        by_load, by_large: how its states follow the load, and one that friction cannot hold [state/N].
        by_first, by_initial: how the states before it and after it follow the first load [state/N].
        h_walked, h_initial: how the torque follows a load that changes, and the first one [N m/N].
        noise2: variance of the torque [N2 m2].
        pumping: friction of slow pumps [N m].
        friction: that hides a torque at standstill [N m].
        missed: torque less what was expected [N m].
        shown: whether the torque of a motor that stands shows the load.
        mean_speed: of the motor [rad/s].
        h: the sample's length [s].
    """

    before: Any
    first: Solution
    by_load: Any
    by_large: Any
    by_first: Any
    by_initial: Any
    h_walked: Any
    h_initial: Any
    noise2: Any
    pumping: Any
    friction: Any
    missed: Any
    shown: Any
    mean_speed: Any
    h: Any

    def near(self, balance: Balance) -> Any:
        """The states after it, as far as they can be."""
        return balance.near(self.first.z, self.before, self.mean_speed, self.h)


class LoadObserver:
    """States of the observer in a sensor's graph.

    Args:
        graph: gains states.
        balance: of the unit.
        limits: of the unit.
        assumptions: of drive and machine.
    """

    def __init__(self, graph: SensorGraph, balance: Balance, limits: Limits, assumptions: Assumptions) -> None:
        self._graph, self._balance, self._assumptions = graph, balance, assumptions
        add = graph.parameters.add
        self._p = [add(f"circuit.{n}", float(v)) for n, v in zip(balance.parameters, balance.values, strict=True)]
        self._per_angle = graph.parameters.symbol("travel_per_radian")
        self._relief_load, self._relief_torque = add("relief_load", limits.load), add("relief_torque", limits.torque)
        self._sigma = assumptions.drive.torque * self._relief_torque
        pull = add("relief_pull", limits.pull)
        self._passive = bool(balance.unit.cylinder.passive)
        self._least: Any = 0.0 if self._passive else -pull
        load = 0.5 * limits.load
        start = balance.at_rest(0.5 * balance.unit.cylinder.stroke, load)
        # Chambers have no volume beyond the ends; a position that is not known may be anywhere.
        stroke = float(balance.unit.cylinder.stroke)
        self._before = [ca.fmin(ca.fmax(graph.position, 0.0), stroke)]
        names = [f"circuit_{name}" for name in balance.states[1:]]
        self._before += [graph.state(n, float(v)) for n, v in zip(names, start[1:], strict=True)]
        self._names = (*names, "load")
        self._load = graph.state("load", load)
        self.expected = graph.state("expected_torque")
        self._give = graph.state("give")
        self._bounce = math.pi * ca.sqrt(add("mass", balance.mass) * self._give)
        # A load that only resists holds no oil under pressure before it is met: there is no first one to be found.
        first = (_FIRST * limits.load) ** 2
        self._walked = graph.state("load_variance", first if self._passive else 0.0)
        self._initial = graph.state("first_load_variance", 0.0 if self._passive else first)
        self._pressures = MeasuredPressures(graph, balance, assumptions) if PRESSURES[0] in graph.measured else None
        self._slopes = {name: [graph.state(f"{state}_by_{name}") for state in self._names] for name in FACTORS}

    def step(self, factors: list[Any], held: Any, leaves: Any = 0.0, warming: Any = None) -> LoadStep:
        """One sample.

        Args:
            factors: in the order of `FACTORS`, as believed before the sample.
            held: whether the piston is held where it is.
            leaves: whether it was let go, and may still stand there.
            warming: of the oil [K/s], if it is known already.
        """
        graph = self._graph
        moves = graph.elapsed > 0.0
        solve = self._solver(factors, held, warming)
        free = self._free(solve)
        surprise, slowly = self._surprise(free)
        gains = self._gains(free, surprise, held)
        d_initial, d_walked = gains.initial * surprise, gains.walked * surprise
        after_torque = (1.0 - gains.walked * free.h_walked) * gains.walked_variance
        over_pressures = None
        if self._pressures is not None:
            over_pressures = self._pressures.torque_over(free.first, free.by_large, free.h_walked, free.missed, held)
            shown_load, after_torque = self._pressures.correction(free.first, free.by_large, after_torque, free.h)
            d_walked = d_walked + ca.if_else(held, 0.0, shown_load)
        # No load beyond what relief valves carry: nothing would hold it, and the piston would run away in the model.
        asked = self._binding(free.first, surprise) + d_initial + d_walked
        corrected = ca.fmin(ca.fmax(asked, self._least), self._relief_load)
        second, solved = self._corrected(solve, free, corrected, d_initial, d_walked)
        z = ca.if_else(moves, solved, free.before)
        if self._pressures is not None:
            self._pressures.close(z, second.stands, free.h, after_torque)
        likely, may_be_empty, empty = self._is_empty(z, corrected, after_torque, free.pumping)
        goes = ca.logic_and(moves, ca.logic_not(empty))
        self._keep(z, ca.if_else(moves, corrected, self._load))
        graph.becomes("load_variance", ca.if_else(moves, after_torque, self._walked))
        kept = ca.if_else(moves, (1.0 - gains.initial * free.h_initial) * gains.initial_variance, self._initial)
        graph.becomes("first_load_variance", kept)
        believed = ca.if_else(ca.fabs(free.missed) < free.friction, slowly, 1.0)
        taken = [gains.initial * believed, gains.walked * believed]
        travel_by, torque_by = self._follow(free.first, second, free.by_first, taken, corrected == asked, moves, goes)
        free_travel = ca.if_else(goes, free.near(self._balance)[0] - free.before[0], 0.0)
        rests = 0.0 if self._passive else ca.logic_and(free.shown, ca.logic_not(ca.logic_or(held, leaves)))
        sinks = ca.if_else(ca.logic_and(goes, rests), free.first.by_settled_load()[0] / free.h_walked, 0.0)
        hidden = free.missed - free.h_initial * d_initial - free.h_walked * d_walked
        left = 1.0 - believed * (gains.initial * free.h_initial + gains.walked * free.h_walked)
        give = self._gives(free, held, may_be_empty, corrected)
        graph.becomes("expected_torque", second.torque)
        return LoadStep(
            travel=ca.if_else(goes, solved[0] - free.before[0], 0.0) + _sunk(sinks, hidden, free.friction, free_travel),
            free_travel=free_travel,
            travel_by=tuple(by - sinks * left * more for by, more in zip(travel_by, torque_by, strict=True)),
            torque_by=torque_by,
            surprise=surprise,
            change=second.torque - self.expected,
            noise=ca.sqrt(free.noise2),
            friction=free.friction,
            noise_travel=give * self._sigma / self._per_angle,
            give=give,
            bounce=self._bounce,
            seen=ca.fmin(ca.fabs(free.h_walked) / self._per_angle, 1.0),
            load=ca.if_else(moves, corrected, self._load),
            asked=asked,
            load_std=ca.sqrt(ca.fmax(gains.walked_variance + gains.initial_variance, 0.0)),
            carried=self._balance.force(z),
            empty=empty,
            may_be_empty=likely,
            torque=second.torque,
            z=z,
            velocity=z[1],
            over_pressures=over_pressures,
            pump_heat=self._heat(z, solve, factors),
        )

    def _heat(self, z: Any, solve: _Solver, factors: list[Any]) -> Any:
        balance = self._balance
        return None if balance.unit.heat is None else balance.pump_heat(z, solve.speed, solve.p, factors)

    def _solver(self, factors: list[Any], held: Any, warming: Any) -> _Solver:
        """The balance's step over this sample."""
        graph, balance = self._graph, self._balance
        h = ca.fmax(graph.elapsed, _SHORTEST)
        acceleration = (graph.motor_speed - graph.last_speed) / h
        if warming is None:
            warming = warming_of(graph) if balance.expands else 0.0
        p = balance.parameters_at(self._p, graph.pump_temperature, graph.commands, warming=warming)
        return _Solver(balance, graph.mean_speed, graph.motor_speed, acceleration, p, h, factors, held)

    def _free(self, solve: _Solver) -> _Free:
        """The step under the load as it was believed, and how the torque and the pressures would follow another one."""
        balance, before = self._balance, ca.vertcat(*self._before)
        if self._pressures is not None:
            before = self._pressures.settled(before, solve.h)
        first = solve(before, self._load, before, 3)
        early = solve(before, self._load, first.z, 2, solve.speed)
        # A motor that keeps its speed was as fast all the time: a solution that has settled is both of them.
        differs = ca.logic_or(solve.speed != solve.mean_speed, ca.logic_not(first.settled(_INERT * self._sigma)))
        differs = ca.logic_and(self._graph.held("started"), differs)
        earlier = ca.if_else(differs, early.torque - first.torque, 0.0)
        by_load, by_large = first.by_load(), first.by_large_load()
        by_first = ca.DM(balance.rest_by_load())
        by_initial = first.by_start(by_first, 1.0)
        h_walked, h_initial = first.torque_by(by_large), first.torque_by(by_initial)
        noise2, pumping, friction = self._noise(first, earlier, solve.p, solve.h)
        return _Free(
            before=before,
            first=first,
            by_load=by_load,
            by_large=by_large,
            by_first=by_first,
            by_initial=by_initial,
            h_walked=h_walked,
            h_initial=h_initial,
            noise2=noise2,
            pumping=pumping,
            friction=friction,
            missed=self._graph.motor_torque - first.torque,
            shown=self._shown(first, h_walked, friction),
            mean_speed=solve.mean_speed,
            h=solve.h,
        )

    def _corrected(self, solve: _Solver, free: _Free, load: Any, d_initial: Any, d_walked: Any) -> tuple[Solution, Any]:
        """The step under the load as it is believed now [N], and its states as far as they can be.

        Args:
            solve: the balance's step.
            free: the step under the load before.
            load: now [N].
            d_initial: what of its change is the first load's [N].
            d_walked: what of it is the load's that walked [N].
        """
        z0 = free.before + free.by_first * d_initial
        guess = self._balance.possible(free.first.z + free.by_load * d_walked + free.by_initial * d_initial)
        second = solve(z0, load, guess, 2, more=3)
        # Iterations that have not found an end leave nothing behind that cannot be.
        gives = _GIVES * self._give * ca.fabs(load - self._load) + _LEAST_GIVEN * self._balance.unit.cylinder.stroke
        z = self._balance.near(second.z, z0, solve.mean_speed, solve.h, gives)
        return second, self._balance.possible(z)

    def _gives(self, free: _Free, held: Any, may_be_empty: Any, corrected: Any) -> Any:
        """Travel per load that the oil's compression allows [m/N]."""
        # At its limit a relief valve gives way in the model, and not the oil.
        least, most = ca.fmin(self._load, corrected), ca.fmax(self._load, corrected)
        limited = ca.logic_or(least <= self._least, most >= self._relief_load)
        other = ca.logic_or(held, ca.logic_or(may_be_empty, limited))
        give = ca.if_else(other, self._give, ca.fabs(free.by_large[0]))
        self._graph.becomes("give", give)
        return give

    def _shown(self, first: Solution, h_walked: Any, friction: Any) -> Any:
        """Whether the torque of a motor that stands shows the load that it holds, but for friction."""
        shown = ca.logic_and(friction > 0.0, ca.fabs(h_walked) > SEEN_AT * self._per_angle)
        return ca.logic_and(shown, self._holds(first))

    def _surprise(self, free: _Free) -> tuple[Any, Any]:
        """What a torque says beside what was expected [N m], and the share of it that is taken within friction.

        Friction at standstill may have either sign, so what lies within it is still the likeliest, and taken slowly. A
        first load there is nothing to go on with.
        """
        slowly = ca.if_else(free.shown, ca.fmin(free.h / _WITHIN, 1.0), 0.0)
        unknown = free.h_initial**2 * self._initial
        first_share = unknown / (unknown + free.h_walked**2 * self._walked + free.noise2)
        slowly = ca.fmax(slowly, ca.if_else(free.shown, first_share, 0.0))
        beyond = _beyond(free.missed, free.friction)
        return beyond + slowly * (free.missed - beyond), slowly

    def _gains(self, free: _Free, surprise: Any, held: Any) -> _Gains:
        """How much of the surprise the first load takes, and how much the load that walked."""
        unit, h_initial, h_walked, noise2 = self._per_angle, free.h_initial, free.h_walked, free.noise2
        walked = self._walked + (self._assumptions.machine.load_walk * self._relief_load) ** 2 * free.h / (
            1.0 + self._initial * unit**2 / self._sigma**2
        )
        initial = self._initial
        total = h_initial**2 * initial + h_walked**2 * walked + noise2
        # A load that jumps: as much uncertainty as explains the torque, on whichever of the two is larger.
        anew = initial > walked
        most = ca.if_else(anew, h_initial, h_walked)
        jumps = ca.logic_and(surprise**2 > _GATE * total, ca.fabs(most) > SEEN_AT * unit)
        more = ca.if_else(jumps, (surprise**2 / _GATE - total) / ca.fmax(most**2, (SEEN_AT * unit) ** 2), 0.0)
        initial, walked = initial + ca.if_else(anew, more, 0.0), walked + ca.if_else(anew, 0.0, more)
        total = h_initial**2 * initial + h_walked**2 * walked + noise2
        gains = [h_initial * initial / total, h_walked * walked / total]
        share = ca.fmax(1.0, ca.fabs(gains[0] + gains[1]) * unit)
        k_initial, k_walked = (ca.if_else(held, 0.0, gain / share) for gain in gains)
        if self._passive:
            k_walked = ca.if_else(ca.logic_and(free.first.stands, surprise > 0.0), 0.0, k_walked)
        return _Gains(k_initial, k_walked, initial, walked)

    def _is_empty(self, z: Any, load: Any, variance: Any, friction: Any) -> tuple[Any, Any, Any]:
        """How likely oil gives the piston no force for a moment, whether it may give none, and whether it surely does.

        Then nothing in the circuit says where the piston goes, and it stays. Where the pump acts on one side only, that
        is so as soon as there may be no load and the pump does not deliver: a load that rests on something else leaves
        the oil, and the pump draws from the tank. One that bounces on its oil comes back within half a period. How
        light a load may be is how well it is known, and not what a single torque shows.

        Args:
            z: the circuit's states.
            load: after this sample [N].
            variance: of it [N2].
            friction: of slow pumps [N m], which others may have more of.
        """
        graph, balance = self._graph, self._balance
        if self._passive:  # what only resists keeps the piston where it is
            return 0.0, 0.0, 0.0
        if not one_sided(balance):
            least = _NOTHING * self._assumptions.drive.torque * self._relief_load
            held = getattr(balance.unit.cylinder, f"node_{balance.unit.held}")
            tank = self._p[balance.parameters.index("tank.pressure")]
            lost = z[balance.states.index(f"pressure_{held}")] < tank
            empty = ca.logic_and(lost, ca.fabs(balance.force(z)) < least)
            return 0.0, empty, empty
        rougher = (_ROUGHER - 1.0) * friction / self._per_angle
        lightest = _NOTHING * ca.sqrt(ca.fmax(variance, 0.0) + rougher**2)
        none = ca.logic_and(load < lightest, balance.unit.lift_sign * graph.extending_speed <= 0.0)
        since = graph.state("empty_for")
        since_1 = ca.if_else(none, since + graph.elapsed, 0.0)
        graph.becomes("empty_for", since_1)
        likely = ca.if_else(none, ca.fmin(1.0 - load / ca.fmax(lightest, 1e-3), 1.0), 0.0)
        return likely, none, since_1 > self._bounce

    def _binding(self, first: Solution, surprise: Any) -> Any:
        """The load that a correction starts from [N].

        A load that only resists is no larger than what the chambers press with, as far as a standing piston shows: one
        that is believed to be larger gives way from there on when the torque says that the piston went, and a torque
        that asks for more tells nothing of it.
        """
        if not self._passive:
            return self._load
        presses = ca.fmin(self._load, ca.fabs(self._balance.force(first.z)))
        return ca.if_else(ca.logic_and(first.stands, surprise < 0.0), presses, self._load)

    def _holds(self, first: Solution) -> Any:
        """Whether the motor's torque holds the load, and no valve does.

        Behind a closed valve the other side alone may show a change, and only one way: drawn oil has no pressure. Noise
        would let the load grow and never shrink.
        """
        balance = self._balance
        needed = self._graph.way * balance.unit.lift_sign * self._per_angle * balance.force(first.z)
        return ca.fabs(first.torque - needed) < (1.0 - SEEN_AT) * ca.fabs(needed) + self._sigma

    def _keep(self, z: Any, load: Any) -> None:
        """What the states are after the sample; the position is the filter's."""
        for k, name in enumerate(self._names[:-1], 1):
            self._graph.becomes(name, z[k])
        self._graph.becomes("load", load)

    def _noise(self, first: Solution, early: Any, p: Any, h: Any) -> tuple[Any, Any, Any]:
        """Variance of the torque at this sample [N2 m2], friction of slow pumps, and what of it hides a torque [N m].

        Beside the drive's own: how the expected torque changes within the drive's delay, and by how much it would be
        another were the motor already as fast as at the sample's end (`early`), both of which are large where a valve
        opens, and fade with the delay. At standstill friction has a sign that nobody knows: a torque within it tells
        nothing, one beyond it does.
        """
        graph, drive = self._graph, self._assumptions.drive
        timing = graph.state("timing_variance")
        change = (first.torque - self.expected) * ca.fmin(drive.delay / h, 1.0)
        change = ca.if_else(graph.held("started"), change, 0.0)
        timing_1 = ca.fmax(ca.fmax(change**2, early**2), timing * ca.exp(-2.0 * h / drive.delay))
        graph.becomes("timing_variance", timing_1)
        up, down = (self._balance.torque(first.z, sign * 3.0 * _STANDING, 0.0, p) for sign in (1.0, -1.0))
        stands = ca.fabs(graph.motor_speed) < _STANDING
        friction = 0.5 * (up - down)
        return self._sigma**2 + timing_1, friction, ca.if_else(stands, _ROUGHER * friction, 0.0) + self._holds_back()

    def _holds_back(self) -> Any:
        """Torque that a motor which hardly turns may hold beside its pumps' friction [N m], as described."""
        standing = self._assumptions.drive.standing
        slow = ca.fabs(self._graph.motor_speed) < _MIXED
        return ca.if_else(slow, standing, 0.0) if standing else 0.0

    def _follow(
        self,
        first: Solution,
        second: Solution,
        by_first: Any,
        gains: Sequence[Any],
        possible: Any,
        moves: Any,
        goes: Any,
    ) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
        """How the step would have been with other factors, the same torques correcting the load: its derivatives.

        What the torque shows is the first solution's; what the oil gives way under the load that it corrected, the
        second one's. A load that is not `possible` is the limit whatever the factors are.
        """
        travel, torque = [], []
        for k, name in enumerate(FACTORS):
            *z0, load0 = self._slopes[name]
            before = ca.vertcat(0.0, *z0)
            free = first.by_factor(k, before, load0)
            shown = first.torque_by(free) + first.torque_by_factor(k)
            initial, walked = (-gain * shown for gain in gains)
            load = ca.if_else(possible, load0 + initial + walked, 0.0)
            z = second.by_factor(k, before + by_first * initial, load)
            after = [z[i] for i in range(1, z.numel())] + [load]
            for state, old, new in zip(self._names, self._slopes[name], after, strict=True):
                self._graph.becomes(f"{state}_by_{name}", ca.if_else(moves, new, old))
            travel.append(ca.if_else(goes, z[0], 0.0))
            torque.append(shown)
        return tuple(travel), tuple(torque)

    def release(self, released: Any, held: Any, shown: Any, give: Any) -> Any:
        """Let go of a piston that was held: the load is what the pressures carry.

        Of a piston that was not held after all, the oil was compressed no more than the torque shows: its pressures go
        back by the rest of the way that they went meanwhile, and what the oil gave way by then is travel.

        Args:
            released: whether it is let go.
            held: whether it is held after the sample.
            shown: share of what its pressures did while it was held that the torque shows [1].
            give: travel per load that the oil's compression allows [m/N].

        Returns:
            That travel, extension positive [m].
        """
        graph, now, then = self._graph, [self._before[0]], [self._before[0]]
        for name in self._names[:-1]:
            after, before = graph.becoming(name), graph.state(f"unheld_{name}")
            now.append(after)
            then.append(before + shown * (after - before))
            graph.becomes(name, ca.if_else(released, then[-1], after))
            graph.becomes(f"unheld_{name}", ca.if_else(held, before, graph.becoming(name)))
        carried, carries = (self._balance.force(ca.vertcat(*z)) for z in (now, then))
        graph.becomes("load", ca.if_else(released, carries, graph.becoming("load")))
        for factor in FACTORS:
            for state in self._names:
                by = graph.becoming(f"{state}_by_{factor}")
                graph.becomes(f"{state}_by_{factor}", ca.if_else(released, shown * by, by))
        return ca.if_else(released, self._balance.unit.lift_sign * give * (carried - carries), 0.0)

    def shift(self, changes: list[Any]) -> None:
        """Let the pressures follow factors that have changed, by their derivatives.

        Args:
            changes: of the factors, in the order of `FACTORS`.
        """
        for state in self._names:
            moved = sum(
                change * self._graph.becoming(f"{state}_by_{name}")
                for name, change in zip(FACTORS, changes, strict=True)
            )
            self._graph.becomes(state, self._graph.becoming(state) + moved)
