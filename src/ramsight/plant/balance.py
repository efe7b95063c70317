"""The balance of any circuit: which oil goes where in one step of time, and which torque that costs.

The laws are those of the circuit's own parts, solved implicitly over a step h as one samples a drive,

    z1 = z0 + h [f(z1, w, F, p) + (g(z0) - g(z1)) / 2],    tau = tau(z1, w, dw/dt, p),

with w the mean speed of the step and g that part of f which is leakage of pumps. It goes by the mean of the pressures
before and after: at those after alone a pump that builds up pressure, as it does at each start of a lift, would lose
half a step of leakage too much, and always the same way. What leaves one node enters another in every iteration, so no
oil is made or lost however coarse the solution is. Valves open and close within a step: the slope of a flow over its
pressure difference (`Circuit.coefficient`) is kept for an iteration and renewed for the next (Picard), where a tangent
would swing between open and closed. Everything else is Newton's method with the elimination written out for the
entries that exist.

Inertia of the cylinder is left out: whoever solves for the load finds both together, and pressures follow the load at
once. Its friction slides or holds: a piston stands as long as no more is needed than its law has beyond breakaway. End
stops are not in it; a piston that is held is a switch.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import lru_cache, reduce
from typing import Any, cast

import casadi as ca
import numpy as np

from ramsight.arrays import Array
from ramsight.engine.elimination import eliminate
from ramsight.expression import Condition, Flag, Matrix, Real, Scalar, Vector
from ramsight.plant.circuit import TANK, WARMING, Circuit, command_of
from ramsight.plant.drive import IdealDrive
from ramsight.plant.heat import case_losses
from ramsight.plant.limits import pump_reliefs
from ramsight.plant.oil import ATMOSPHERE, Oil
from ramsight.plant.unit import HydraulicUnit, initial_state

FACTORS = ("leak", "displacement", "compliance")
"""Factors by which a machine may differ from its data sheet: leakage and displacement of its pumps, and what oil and
hoses give under pressure."""
_HELD = 1e4  # 1/s; rate at which the velocity of a held piston ends, fast against any sample
_MASSLESS = 1e-4  # share of the mass that is left: oscillations are a hundred times faster than the machine's
_BEYOND = 5.0  # Stribeck velocities from which on breakaway plays no part
_SLIDES = 1e-3  # m/s; a piston that went faster the other way slides at once, a slower one stands first
# An iteration that changes a pressure by more was wrong about a valve; friction that turns round changes a tenth of it.
_SETTLED = 2e6  # Pa
_EARLY = 0.5  # share of the leakage that is that of the pressures before the step: the trapezoidal rule
_NEAR = 0.02  # share of the stroke that the oil gives at most in a step
_ITERATIONS = 3
_LOAD_STEP = 1e3  # N; for the slope of the pressures at rest over the load, which is constant


@dataclass(frozen=True)
class Solution:
    """A solved step.

    Attributes:
        balance: what was solved, for derivatives.
    """

    z: Vector  # states after it
    torque: Scalar  # at the motor [N m]
    stands: Flag  # whether friction, or a load that only resists, keeps the piston where it is
    _factors: Vector
    _torque_by_z: Vector
    _rate_by_load: Vector
    _torque_by_factors: Vector
    _sliding: tuple[Vector, Vector, Matrix]
    _before_by_z: Matrix
    _changed: Vector
    _turns: Flag
    _balance: Balance
    _h: Real

    def settled(self, torque: Real) -> Flag:
        """Whether further iterations would not change it: the last one changed the torque by no more than this [N m].

        Nor would friction hold a piston that was released in the last one, or release one that was held.
        """
        return ca.logic_and(ca.fabs(self.torque_by(self._changed)) < torque, ca.logic_not(self._turns))

    def by_load(self) -> Vector:
        """dz/dF for a load that changes at the step's beginning [state/N]."""
        return self._balance.solve(self._factors, self._rate_by_load)

    def by_large_load(self) -> Vector:
        """The same for a change that friction cannot hold [state/N]."""
        loose, by_load, _ = self._sliding
        return self._balance.solve(loose, by_load)

    def by_settled_load(self) -> Vector:
        """The same for a load that was another one before the step already, its pressures settled [state/N].

        What the oil gives way to under it is past: of the position only leakage is left.
        """
        loose, by_load, _ = self._sliding
        settled = self.by_large_load()
        settled[0] = 0.0
        return self._balance.solve(loose, self._from(settled) + by_load)

    def by_start(self, direction: Vector, load: Real = 0.0) -> Vector:
        """How `z` follows a change of the states before the step, with a change of the load beside it [N]."""
        return self._balance.solve(self._factors, self._from(direction) + self._rate_by_load * load)

    def by_factor(self, k: int, before: Vector, load: Real) -> Vector:
        """dz/dfactor from that before the step, while the load changes by `load` [N] per factor.

        Of a piston that slides: what friction holds for a while it does not hold for long.
        """
        loose, by_load, by_factors = self._sliding
        return self._balance.solve(loose, self._from(before) + by_factors[:, k] + by_load * load)

    def _from(self, before: Vector) -> Vector:
        """What a change of the states before the step adds to the right-hand side [state/s]."""
        return before / self._h + ca.mtimes(self._before_by_z, before)

    def torque_by(self, direction: Vector) -> Scalar:
        """How the torque follows a change of `z`."""
        return ca.mtimes(self._torque_by_z, direction)

    def torque_by_factor(self, k: int) -> Scalar:
        """How the torque follows a factor, the states being what they are [N m]."""
        return self._torque_by_factors[k]


class Balance:
    """The balance of a unit.

    Attributes:
        unit: without mass and end stops, with a motor whose speed is what is reported.
        states: names of the states; the position is the first.
        mass: that the piston moves [kg]; next to none of it is in the balance.
        parameters, values: names and values of the circuit's parameters, in the order of `p`.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build
        >>> bench = balance(build(machine.load_machine("eha-test-bench").unit("axis"), "axis"))
        >>> bench.states[:4]
        ('position', 'velocity', 'pressure_chamber_a', 'pressure_chamber_b')
        >>> z = bench.at_rest(0.1, 5e3)
        >>> step = bench.step(z, 100.0, 100.0, 0.0, 5e3, bench.parameters_at(bench.values, 313.15), 0.02)
        >>> bool(step.z[0] > z[0]), round(float(step.torque), 2)
        (True, 4.62)
    """

    def __init__(self, unit: HydraulicUnit) -> None:
        cylinder = replace(unit.cylinder, stop_stiffness=0.0, mass=_MASSLESS * unit.cylinder.mass)
        changed: dict[str, Any] = {"cylinder": cylinder, "drive": IdealDrive("drive", unit.drive.inertia)}
        self.mass = float(unit.cylinder.mass)
        self.unit: Any = replace(unit, **changed)
        circuit = Circuit(self.unit.oil, self.unit.tank_pressure, keep_coefficients=True)
        for part in self.unit.parts():
            circuit.add(part)
        self.model = circuit.model(unit.name, audited=False)
        # Where a valve switches on command pressures jump, and what leaks is soon that of the new ones.
        self._early = 0.0 if self.model.commands else _EARLY
        ode = self.model.ode
        self.states = tuple(state.name for state in ode.states)
        self.parameters, self.values = ode.parameters, self.model.values
        self._highest = _highest_pressure(unit)
        names = {field.name for field in fields(cylinder)}
        gone = {f"cylinder.{key}" for key in names if key.endswith("_friction") or key == "stop_stiffness"}
        self._without = gone & set(self.parameters)
        self._write(circuit)

    def _write(self, circuit: Circuit) -> None:
        """The functions of an iteration, of the coefficients and of the torque."""
        ode = self.model.ode
        z, speed, load, p = ode.x, ode.u[0], ode.u[1], ode.p
        slope, stands, factors = ode.slope[0], ca.SX.sym("stands"), ca.SX.sym("factor", len(FACTORS))
        # What friction gives, and the way in which a load that only resists does.
        friction = ca.SX.sym("friction", 2)
        kept = ca.vertcat(*(symbol for symbol, _ in circuit.coefficients))
        expressions = [expression for _, expression in circuit.coefficients]
        velocity = self.states.index("velocity")
        rates = ca.vertsplit(ode.rhs)
        resists = friction[0]
        if self.unit.cylinder.passive:
            rates[velocity] = ca.substitute(rates[velocity], load, 0.0)
            resists = resists + friction[1] * load
        slides = rates[velocity] - resists / self._parameter(p, "cylinder.mass")
        rates[velocity] = ca.if_else(stands, -_HELD * z[velocity], slides)
        rate = ca.substitute(ca.vertcat(*rates), ode.slope, ca.SX.zeros(2))
        torque = next(output.expression for output in ode.outputs if output.name == "motor_torque")
        by_factors = self._with_factors(p, factors)
        # A coefficient may hold another one: as often as there are any, and none is left.
        nothing = [ca.SX(0.0)] * len(self._without)
        gone = [p[self.parameters.index(name)] for name in sorted(self._without)]
        rate, torque, *expressions = ca.substitute([rate, torque, *expressions], gone, nothing)
        rate, torque, *expressions = ca.substitute([rate, torque, *expressions], [p], [by_factors])
        column = ca.vertcat(*expressions) if expressions else ca.SX(0, 1)
        for _ in expressions:
            column = ca.substitute(column, kept, column)
        early, leaked = ca.SX.sym("early"), ca.SX.sym("leaked", len(rates))
        leaks = _share_of(rate, factors[0])
        jacobian = ca.jacobian(rate, z)
        arguments = [z, speed, load, p, factors]
        options = {"cse": True}
        self._coefficients = ca.Function("coefficients", arguments, [column], options)
        self._leaks = ca.Function(
            "leaks",
            [*arguments, kept],
            [ca.densify(leaks), ca.densify(ca.jacobian(leaks, factors)), ca.densify(ca.jacobian(leaks, z))],
            options,
        )
        rate = rate + early * (leaked - leaks)
        arguments += [kept, stands, friction, early, leaked]
        entries = ca.project(ca.jacobian(rate, z), jacobian.sparsity())
        self._iteration = ca.Function("iteration", arguments, [rate, ca.vec(entries.nz[:])], options)
        self._sensitive = ca.Function(
            "sensitive",
            arguments,
            [ca.densify(ca.jacobian(rate, load)), ca.densify(ca.jacobian(rate, factors))],
            options,
        )
        self._friction = ca.Function("friction", [z, load, p], [*self._resists(z, load, p)], options)
        torque = ca.substitute(torque, kept, column)
        self._torque = ca.Function(
            "torque",
            [z, speed, slope, p, factors],
            [torque, ca.densify(ca.jacobian(torque, z)), ca.densify(ca.jacobian(torque, factors))],
            options,
        )
        self._elimination = eliminate(jacobian.sparsity())
        lost = ca.SX(circuit.lost(case_losses(self.unit.parts())))
        lost = ca.substitute(ca.substitute(lost, p, by_factors), kept, column)
        self._pump_heat = ca.Function("pump_heat", [z, speed, p, factors], [lost], options)

    def _parameter(self, p: Vector, name: str) -> Scalar:
        return p[self.parameters.index(name)]

    def _resists(self, z: Vector, load: Scalar, p: Vector) -> tuple[Flag, Vector]:
        """Whether friction keeps the piston where it is, and what it is where it slides [N], with its way.

        Friction is that of the cylinder's own law beyond its breakaway. At rest it is whatever is needed, up to that;
        the force that it has to hold, and the way the piston last went, decide (an active set). A load that only
        resists is friction beside it.
        """
        names = [field.name for field in fields(self.unit.cylinder) if f"cylinder.{field.name}" in self.parameters]
        cylinder = replace(self.unit.cylinder, **{n: self._parameter(p, f"cylinder.{n}") for n in names})
        velocity = z[self.states.index("velocity")]
        least = _BEYOND * cylinder.stribeck_velocity
        own = cylinder.sliding_friction(ca.fmax(ca.fabs(velocity), least), self.force(z))
        if self.unit.cylinder.passive:
            # It goes where the chambers press it, or not at all.
            force = self.unit.lift_sign * self.force(z)
            way = ca.sign(force)
            stands = ca.fabs(force) + way * own * velocity / _SLIDES < own + load
            return stands, ca.vertcat(way * own, way)
        force = self.unit.lift_sign * (self.force(z) - load)
        decides = force + own * velocity / _SLIDES
        way = ca.sign(decides)
        return ca.fabs(decides) < own, ca.vertcat(way * own, way)

    def _with_factors(self, p: Vector, factors: Vector) -> Vector:
        """The parameters with the factors on them; leakage does not grow with displacement."""
        leak, displacement, compliance = ca.vertsplit(factors)
        changed = {
            "leak_factor": lambda v: v * leak / displacement,
            "displacement": lambda v: v * displacement,
            "bulk_modulus": lambda v: v / compliance,
            "stiffening": lambda v: v / compliance,
        }
        split = ca.vertsplit(p)
        return ca.vertcat(
            *(changed.get(n.rsplit(".", 1)[-1], lambda v: v)(v) for n, v in zip(self.parameters, split, strict=True))
        )

    @property
    def expands(self) -> bool:
        """Whether the oil's volume follows its temperature."""
        return WARMING in self.parameters

    def parameters_at(
        self,
        p: Vector | Sequence[Real] | Array,
        temperature: Real,
        commands: Mapping[str, Real] | None = None,
        *,
        warming: Real = 0.0,
    ) -> Vector:
        """The parameters with what changes among them.

        Args:
            temperature: of the oil [K].
            commands: to parts, by their names.
            warming: rate of the oil's temperature [K/s]; used where the oil expands.
        """
        entries: list[Real] = list(ca.vertsplit(p)) if isinstance(p, ca.SX) else list(p)  # numbers stay numbers
        entries[self.parameters.index("oil_temperature")] = temperature
        if self.expands:
            entries[self.parameters.index(WARMING)] = warming
        for name, value in (commands or {}).items():
            entries[self.parameters.index(command_of(name))] = value
        return ca.vertcat(*entries)

    def oil_of(self, symbol: Callable[[str], Real]) -> Oil:
        """The oil with other values for its numbers, by the parameters' names."""
        names = [field.name for field in fields(self.unit.oil) if f"oil.{field.name}" in self.parameters]
        oil: Oil = replace(self.unit.oil, **{name: symbol(f"oil.{name}") for name in names})
        return oil

    def at_rest(self, position: float, load: float) -> Array:
        """States at rest at a position [m] under a load [N]."""
        return initial_state(self.unit, self.model, position, load)

    def rest_by_load(self) -> Array:
        """How the states at rest depend on a lifted load, at a fixed position [state/N]."""
        middle = 0.5 * self.unit.cylinder.stroke
        heavy = 1e2 * _LOAD_STEP
        change = self.at_rest(middle, heavy + _LOAD_STEP) - self.at_rest(middle, heavy)
        return np.asarray(change / _LOAD_STEP)

    def force(self, z: Vector) -> Scalar:
        """Load that the oil's pressures carry, those of cushions among them [N], positive against lifting."""
        c = self.unit.cylinder
        on_a, on_b = (z[self.states.index(f"pressure_{node}")] for node in (c.node_a, c.node_b))
        pressed = c.area_a * on_a - c.area_b * on_b - ATMOSPHERE * (c.area_a - c.area_b)
        if c.cushion_conductance is not None:
            pressed = pressed + c.cushion(z[0], z[self.states.index("velocity")])
        force: Scalar = self.unit.lift_sign * pressed
        return force

    def pressure(self, z: Vector, node: str, tank: Real) -> Real:
        """Absolute pressure of a node, of which the tank's is passed [Pa]."""
        return tank if node == TANK else z[self.states.index(f"pressure_{node}")]

    def chambers(self, z: Vector) -> dict[str, tuple[Scalar, str]]:
        """Pressures of both chambers, by what to call them, each with its unit."""
        c = self.unit.cylinder
        nodes = {"pressure_a": c.node_a, "pressure_b": c.node_b}
        return {name: (z[self.states.index(f"pressure_{node}")], "Pa") for name, node in nodes.items()}

    def possible(self, z: Vector) -> Vector:
        """The states without pressures below vacuum, nor beyond what relief valves from side to side let stand.

        Those valves limit a difference. What both sides have in common no torque shows, and it would creep away.
        """
        split = zip(self.states, ca.vertsplit(z), strict=True)
        return ca.vertcat(*(self._kept(v) if name.startswith("pressure_") else v for name, v in split))

    def _kept(self, pressure: Scalar) -> Scalar:
        """A pressure within what the circuit lets stand [Pa]."""
        least = ca.fmax(pressure, 0.0)
        return least if self._highest is None else ca.fmin(least, self._highest)

    def near(self, z: Vector, z0: Vector, mean_speed: Real, h: Real, gives: Real | None = None) -> Vector:
        """The states with a piston no farther away than it gets in a step, to go on with.

        A relief valve that was open in the last one may have let it through the whole cylinder, and more.

        Args:
            mean_speed: of the motor [rad/s].
            h: the step [s].
            gives: what the oil gives at most in it [m]; by default what it may ever give.
        """
        pumped = ca.fabs(mean_speed) * abs(float(self.unit.travel_per_radian)) * h
        far = (_NEAR * self.unit.cylinder.stroke if gives is None else gives) + 2.0 * pumped + ca.fabs(z0[1]) * h
        position = ca.fmin(ca.fmax(z[0], z0[0] - far), z0[0] + far)
        return ca.vertcat(position, ca.fmin(ca.fmax(z[1], -far / h), far / h), z[2:])

    def _changed(self, dz: Vector) -> Scalar:
        """The largest change of a pressure [Pa]."""
        changes = [ca.fabs(dz[k]) for k, name in enumerate(self.states) if name.startswith("pressure_")]
        return reduce(ca.fmax, changes)

    def torque(
        self, z: Vector, speed: Real, acceleration: Real, p: Vector, factors: Sequence[Real] = (1.0, 1.0, 1.0)
    ) -> Scalar:
        """Torque at the motor [N m] at states, speed [rad/s] and acceleration [rad/s2]."""
        torque: Scalar = self._torque(z, speed, acceleration, p, ca.vertcat(*factors))[0]
        return torque

    def pump_heat(self, z: Vector, speed: Real, p: Vector, factors: Sequence[Real] = (1.0, 1.0, 1.0)) -> Scalar:
        """What leakage and friction of the pumps turn into heat [W] at states and speed [rad/s].

        Example:
            >>> from ramsight import machine
            >>> from ramsight.plant.build import build
            >>> bench = balance(build(machine.load_machine("eha-test-bench").unit("axis"), "axis"))
            >>> z, p = bench.at_rest(0.1, 15e3), bench.parameters_at(bench.values, 313.15)
            >>> [round(float(bench.pump_heat(z, speed, p))) for speed in (0.0, 150.0, -150.0)]
            [118, 370, 370]
        """
        heat: Scalar = self._pump_heat(z, speed, p, ca.vertcat(*factors))
        return heat

    def solve(self, factored: Vector, right: Vector) -> Vector:
        """Solve (1/h - J) x = right."""
        solution: Vector = self._elimination.solve(factored, right)
        return solution

    def step(
        self,
        z0: Vector | Array,
        mean_speed: Real,
        speed: Real,
        acceleration: Real,
        load: Real,
        p: Vector,
        h: Real,
        *,
        factors: Sequence[Real] = (1.0, 1.0, 1.0),
        held: Condition | float = 0.0,
        guess: Vector | None = None,
        iterations: int = _ITERATIONS,
        more: int = 0,
        settles: bool = False,
    ) -> Solution:
        """Solve one step.

        Args:
            mean_speed: of the motor during the step [rad/s]; its angle over h.
            speed: at the step's end [rad/s], for the torque.
            acceleration: at the step's end [rad/s2], for the torque.
            load: at the step's end [N]; the cylinder's friction is its own law's.
            p: the circuit's parameters, from `parameters_at`.
            h: the step [s].
            factors: in the order of `FACTORS` [1].
            iterations: how many, two at least with `more`.
            more: how many more where the last but one was still far from any end.
            settles: whether it is so long that all settles: leakage goes by the pressures after it alone then.
        """
        z0 = cast("Vector", z0)
        arguments = (mean_speed, load, p, ca.vertcat(*factors))
        leaks = self._leaks(z0, *arguments, self._coefficients(z0, *arguments))
        begun = _Step(self, z0, arguments, h, cast("Condition", held), 0.0 if settles else self._early, leaks)
        z = z0 if guess is None else guess
        for _ in range(iterations - 1):
            last, z = z, begun.iterate(z).z
        if more:
            further = z
            for _ in range(more):
                further = begun.iterate(further).z
            z = ca.if_else(self._changed(z - last) > _SETTLED, further, z)
        return begun.concluded(begun.iterate(z), z, speed, acceleration)


@dataclass(frozen=True)
class _Iterated:
    """What an iteration leads to, and what it was solved with."""

    z: Vector
    kept: Vector
    stuck: Flag
    stands: Flag
    friction: Vector
    factored: Vector


@dataclass(frozen=True)
class _Step:
    """A step that is being solved."""

    balance: Balance  # whose equations these are
    z0: Vector  # states before it
    arguments: tuple[Real, Real, Vector, Vector]  # mean speed, load, parameters and factors
    h: Real  # how long it is [s]
    held: Condition  # whether the piston is held where it is
    early: float  # share of the leakage that is that before it
    leaks: tuple[Vector, Matrix, Matrix]  # what leaks before it, as rates of the states, and by factors and states

    def iterate(self, z: Vector) -> _Iterated:
        """Once from these states."""
        balance, (mean_speed, load, p, _) = self.balance, self.arguments
        z = balance.near(z, self.z0, mean_speed, self.h)
        kept = balance._coefficients(z, *self.arguments)
        stuck, friction = balance._friction(z, load, p)
        stands = ca.logic_or(self.held, stuck)
        rate, entries = balance._iteration(z, *self.arguments, kept, stands, friction, self.early, self.leaks[0])
        factored = balance._elimination.factor(entries, 1.0 / self.h)
        after = z + balance._elimination.solve(factored, rate - (z - self.z0) / self.h)
        return _Iterated(after, kept, stuck, stands, friction, factored)

    def concluded(self, last: _Iterated, before: Vector, speed: Real, acceleration: Real) -> Solution:
        """The solution after its last iteration, with what its derivatives need.

        Args:
            speed: of the motor at the step's end [rad/s].
            acceleration: of it there [rad/s2].
        """
        balance, (_, load, p, theta) = self.balance, self.arguments
        stuck, _ = balance._friction(last.z, load, p)
        leaked, leaked_by_factors, leaked_by_z = self.leaks
        at = (last.z, *self.arguments, last.kept)
        by_load, _ = balance._sensitive(*at, last.stands, last.friction, self.early, leaked)
        _, entries = balance._iteration(*at, self.held, last.friction, self.early, leaked)
        loose = balance._elimination.factor(entries, 1.0 / self.h)
        by_loose, by_factors = balance._sensitive(*at, self.held, last.friction, self.early, leaked)
        torque, torque_by_z, torque_by_factors = balance._torque(last.z, speed, acceleration, p, theta)
        return Solution(
            z=last.z,
            torque=torque,
            stands=last.stuck,
            _factors=last.factored,
            _torque_by_z=torque_by_z,
            _rate_by_load=by_load,
            _torque_by_factors=torque_by_factors,
            _sliding=(loose, by_loose, by_factors + self.early * leaked_by_factors),
            _before_by_z=self.early * leaked_by_z,
            _changed=last.z - before,
            _turns=ca.logic_and(ca.logic_not(self.held), stuck != last.stuck),
            _balance=balance,
            _h=self.h,
        )


def _share_of(expression: Vector, factor: Scalar) -> Vector:
    """That part of an expression which is there by a factor only.

    Where it grows in proportion that is its slope, without the rest being worked out twice.
    """
    slope = ca.jacobian(expression, factor)
    if ca.depends_on(slope, factor):
        without: Vector = ca.substitute(expression, factor, 0.0)
        return expression - without
    return cast("Vector", slope * factor)


def _highest_pressure(unit: HydraulicUnit) -> float | None:
    """The highest pressure that may stand in a circuit whose relief valves lead to each other's side [Pa]."""
    reliefs = pump_reliefs(unit)
    crossing = [valve.setting for valve in reliefs if any(valve.outlet == other.inlet for other in reliefs)]
    return max(crossing) + unit.tank_pressure if crossing else None


def without_friction(unit: HydraulicUnit) -> HydraulicUnit:
    """The unit with a piston that slides freely: whoever solves for its load finds the friction in it."""
    smooth: dict[str, Any] = dict.fromkeys(("coulomb_friction", "breakaway_friction", "viscous_friction"), 0.0)
    smooth["pressure_friction"] = None
    cylinder = replace(unit.cylinder, **smooth)
    changed: HydraulicUnit = replace(unit, cylinder=cylinder)
    return changed


@lru_cache(maxsize=64)
def balance(unit: HydraulicUnit) -> Balance:
    """The balance of a unit, made once."""
    return Balance(unit)
