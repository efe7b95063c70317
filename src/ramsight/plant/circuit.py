"""Parts on nodes become one ordinary differential equation.

Every node is a volume of oil at one pressure, dp/dt = (sum Q - dV/dt)/(V/beta + C_wall), so any topology is explicit.
A part is a frozen dataclass whose `connect` adds its flows, torques and states; its float fields become parameters
of the model, its other fields shape the graph.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar, cast

import casadi as ca
import numpy as np

from ramsight.arrays import Array
from ramsight.engine.equation import OdeModel, Output, State
from ramsight.expression import Real, Scalar, scalar_symbol
from ramsight.plant.oil import Oil, held_share, torn_capacity
from ramsight.plant.symbols import Parameters

P = TypeVar("P", bound="Part")

TANK = "tank"
PRESSURE = "pressure_"
"""What the names of pressures begin with, among an equation's states; the node's follows."""
INPUTS = ("motor_speed", "load")
WARMING = "oil_temperature_rate"
"""Name of the parameter that states how fast the oil warms up [K/s], where its expansion is described."""
COMMANDED = 1.0
"""What a part is commanded to where nothing else is said."""
EXPANSION = "volume.expansion"
"""Name of the integral of the volume that oil gains without being drawn from the tank [m3], where there is any."""
_SPEED_TOLERANCE = 1e-4  # rad/s
_PRESSURE_TOLERANCE = 10.0  # Pa; with this and 1e-6 of the value a position is right to 1e-6 m


def command_of(part: str) -> str:
    """Name of the parameter that is a part's command."""
    return f"{part}.command"


class Part(Protocol):
    """What a part has to have."""

    @property
    def name(self) -> str:
        """Unique in its circuit."""

    def connect(self, circuit: Circuit) -> None:
        """Add flows, torques, states and power to the circuit."""


@dataclass(frozen=True, kw_only=True)
class Audited:
    """What a circuit's balances are made of."""

    nodes: tuple[str, ...]  # that are volumes
    # losses, works: names of the energies that leave through losses and as work
    losses: tuple[str, ...]
    works: tuple[str, ...]
    tank_flows: tuple[str, ...]  # names of flows from the tank

    @property
    def names(self) -> Audited:
        """These alone, without what they are of, which cannot go to another process."""
        return Audited(nodes=self.nodes, losses=self.losses, works=self.works, tank_flows=self.tank_flows)


@dataclass(frozen=True)
class CircuitModel(Audited):
    """A circuit as an equation, with the values of its parameters and what its audit needs."""

    ode: OdeModel  # the equation. Its integrals are `energy.*` [J] and `volume.*` [m3].
    values: Array  # the parameters' values, in the order of `ode.parameters`; the oil's temperature is among them
    commands: tuple[str, ...]  # parts that are commanded; the command is the parameter `name.command`

    def parameters(self, **changes: float) -> Array:
        """The parameters' values with some changed, by name with `__` for the dot."""
        values = self.values.copy()
        for name, value in changes.items():
            values[self.ode.parameters.index(name.replace("__", "."))] = value
        return values


@dataclass(frozen=True)
class Closed(Audited):
    """A circuit whose balances are closed: everything that an equation is made of."""

    states: tuple[tuple[State, Scalar, Real], ...]  # each with its symbol and its rate of change; integrals last
    # motor_speed, motor_acceleration: symbols of the speed that the drive is asked for, and of its slope
    motor_speed: Scalar
    motor_acceleration: Scalar
    parameters: Parameters
    outputs: tuple[Output, ...]
    commands: tuple[str, ...]  # as in `CircuitModel`


def is_pressure(state: State) -> bool:
    """Whether a state of an equation is a node's pressure."""
    return state.name.rpartition(".")[2].startswith(PRESSURE)


class Circuit:
    """Collects what parts add. Everything is made when first named, so the order of parts does not matter."""

    def __init__(self, oil: Oil, tank_pressure: float, *, keep_coefficients: bool = False) -> None:
        self._parameters = Parameters()
        self._coefficients: list[tuple[Scalar, Real]] = []
        self._keeps_coefficients = keep_coefficients
        self._states: dict[str, tuple[State, Scalar]] = {}
        self._derivatives: dict[str, Real] = {}
        self._pressure: dict[str, Scalar] = {}
        self._net: dict[str, Real] = {}
        self._volume: dict[str, Real] = {}
        self._growth: dict[str, Real] = {}
        self._wall: dict[str, Real] = {}
        self._powers: dict[str, Real] = {}
        self._losses: list[str] = []
        self._works: list[str] = []
        self._stored: dict[str, Real] = {}
        self._tank_flow: dict[str, Real] = {}
        self._expansion: Real = 0.0
        self._outputs: dict[str, Output] = {}
        self._commands: list[str] = []
        self._torque: Real = 0.0
        self._motor_torque: Real | None = None
        self._command: Scalar | None = None
        self._last: list[Callable[[], None]] = []
        self.motor_speed, self.load = scalar_symbol("motor_speed"), scalar_symbol("load")
        self.motor_acceleration, self._load_rate = scalar_symbol("motor_acceleration"), scalar_symbol("load_rate")
        self.oil: Oil = self._parameters.symbolic("oil", oil)
        self.oil_temperature = self._parameters.add("oil_temperature", 313.15)
        self._warming = None if oil.expansion is None else self._parameters.add(WARMING, 0.0)
        self.viscosity = self.oil.viscosity(self.oil_temperature)
        self.density = self.oil.density_at(self.oil_temperature)
        self._pressure[TANK] = self._parameters.add("tank.pressure", tank_pressure)

    def add(self, part: Part) -> None:
        """Add a part."""
        self.symbolic(part).connect(self)

    def symbolic(self, part: P) -> P:
        """The part with parameters of the circuit in place of its numbers."""
        return self._parameters.symbolic(part.name, part)  # type: ignore[type-var]  # every part is a dataclass

    def coefficient(self, expression: Real) -> Scalar:
        """A coefficient of a law with kinks, such as the conductance of a valve that opens.

        A circuit that simulates gets the expression itself. One whose balance is solved implicitly gets a symbol that
        keeps its value for an iteration, because a tangent at a kink leads nowhere (`ramsight.plant.balance`).
        """
        if not self._keeps_coefficients:
            return cast("Scalar", expression)
        symbol = scalar_symbol(f"coefficient_{len(self._coefficients)}")
        self._coefficients.append((symbol, expression))
        return symbol

    @property
    def coefficients(self) -> tuple[tuple[Scalar, Real], ...]:
        """The symbols that stand for coefficients, each with its expression."""
        return tuple(self._coefficients)

    def state(self, name: str, unit: str, tolerance: float) -> Scalar:
        """The symbol of a state; `tolerance` is the absolute error that a step may leave in it."""
        if name not in self._states:
            self._states[name] = (State(name, unit, tolerance), scalar_symbol(name))
        return self._states[name][1]

    def derivative(self, name: str, expression: Real) -> None:
        """Say how a state changes [its unit per second]."""
        self._derivatives[name] = expression

    def pressure(self, node: str) -> Scalar:
        """Absolute pressure of a node [Pa]."""
        if node not in self._pressure:
            state = self.state(f"pressure_{node}", "Pa", _PRESSURE_TOLERANCE)
            # Oil that is simulated tears (`oil.torn_volume`); a balance is of oil that holds together.
            self._pressure[node] = state if self._keeps_coefficients else ca.fmax(state, 0.0)
            self._net[node] = self._volume[node] = self._growth[node] = self._wall[node] = 0.0
        return self._pressure[node]

    def oil_share(self, node: str) -> Real:
        """Share of a node's volume that oil fills [1]; what draws from a torn node draws its vapour as well."""
        if node == TANK or self._keeps_coefficients:
            return 1.0
        self.pressure(node)
        return held_share(self._states[f"{PRESSURE}{node}"][1])

    def flow(self, name: str, source: str, target: str, flow: Real, *, arriving: Real | None = None) -> None:
        """Add a volume flow from one node to another.

        Args:
            flow: that leaves the source [m3/s].
            arriving: volume flow that comes to the target, where its density is another one [m3/s]; the same without.
        """
        if arriving is not None:
            self._expansion += arriving - flow
        for node, sign, moved in ((source, -1.0, flow), (target, 1.0, flow if arriving is None else arriving)):
            self.pressure(node)
            if node == TANK:
                self._tank_flow[name] = self._tank_flow.get(name, 0.0) - sign * moved
            else:
                self._net[node] += sign * moved
        self.output(f"{name}.flow", "m3/s", flow)

    def volume(self, node: str, volume: Real, rate: Real = 0.0) -> None:
        """Add oil volume [m3] to a node; `rate` [m3/s] is how the volume itself grows. The tank has its own."""
        if node == TANK:
            if not (isinstance(rate, float) and rate == 0.0):
                raise ValueError("a chamber that moves cannot be the tank itself: join it to the tank by an orifice")
            return
        self.pressure(node)
        self._volume[node] += volume
        self._growth[node] += rate

    def compliance(self, node: str, compliance: Real) -> None:
        """Add what a node's walls give [m3/Pa]."""
        if node == TANK:
            return
        self.pressure(node)
        self._wall[node] += compliance

    def shaft_torque(self, torque: Real) -> None:
        """Add torque that the motor must give [N m]."""
        self._torque += torque

    def speed_loop(self) -> tuple[Scalar, Scalar]:
        """Make the motor's speed a state, `motor_speed`: the speed that is asked for, and the actual one [rad/s]."""
        if self._command is None:
            self._command = scalar_symbol("motor_speed_command")
            self._states["motor_speed"] = (State("motor_speed", "rad/s", _SPEED_TOLERANCE), self.motor_speed)
        return self._command, self.motor_speed

    def command(self, name: str) -> Scalar:
        """The command to a part, -1 to 1: a parameter that a duty or a log brings, `COMMANDED` without one."""
        self._commands.append(name)
        return self._parameters.add(command_of(name), COMMANDED)

    def motor(self, torque: Real) -> None:
        """Say which torque [N m] the motor gives where it is not simply what the shaft takes."""
        self._motor_torque = torque

    def at_last(self, finish: Callable[[], None]) -> None:
        """Call `finish` when every part has been added, for what depends on a sum over all parts."""
        self._last.append(finish)

    @property
    def torque_taken(self) -> Real:
        """Sum of the torques that the parts take at the motor shaft [N m]; complete in `at_last`."""
        return self._torque

    def loss(self, name: str, power: Real) -> None:
        """Power that a part turns into heat [W]; never negative."""
        self._powers[name] = power
        self._losses.append(name)

    def lost(self, names: Collection[str]) -> Real:
        """Sum of the powers that parts turn into heat, of those named [W]."""
        return sum((self._powers[name] for name in sorted(names)), start=0.0)

    def work(self, name: str, power: Real) -> None:
        """Power that leaves to the outside [W]."""
        self._powers[name] = power
        if name not in self._works:
            self._works.append(name)

    def stored(self, name: str, energy: Real) -> None:
        """Energy kept in the circuit [J], a function of states and inputs."""
        self._stored[name] = energy

    def output(self, name: str, unit: str, expression: Real) -> None:
        """A quantity worth looking at."""
        self._outputs[name] = Output(name, unit, expression)

    def close(self, *, audited: bool) -> Closed:
        """Close all balances; nothing can be added afterwards.

        Args:
            audited: carry the integrals of every power and tank flow, for the energy and volume audit.
        """
        for finish in self._last:
            finish()
        nodes = tuple(node for node in self._pressure if node != TANK)
        for node in nodes:
            modulus = self.oil.bulk_modulus_at(self._pressure[node])
            if self.oil.air is not None:  # it collapses near the tank's pressure, where a tangent leads nowhere
                modulus = self.coefficient(modulus)
            capacity = self._volume[node] / modulus + self._wall[node]
            self.output(f"capacity_{node}", "m3/Pa", capacity)
            self.output(f"volume_{node}", "m3", self._volume[node])
            growth = self._growth[node]
            if not self._keeps_coefficients:
                state = self._states[f"pressure_{node}"][1]
                capacity, growth = capacity + torn_capacity(state, self._volume[node]), growth * held_share(state)
            gained = self._net[node] - growth
            if self._warming is not None:
                gained = gained + self._warms_up(node)
            self.derivative(f"pressure_{node}", gained / capacity)
        motor_torque = self._torque if self._motor_torque is None else self._motor_torque
        self.output("motor_torque", "N m", motor_torque)
        states = [(state, symbol, self._derivatives[name]) for name, (state, symbol) in self._states.items()]
        if audited:
            integrals = {f"energy.{key}": ("J", power) for key, power in self._powers.items()}
            shaft = motor_torque * self.motor_speed
            integrals["energy.shaft_given"] = ("J", ca.fmax(shaft, 0.0))
            integrals["energy.shaft_taken"] = ("J", ca.fmax(-shaft, 0.0))
            if not isinstance(self._expansion, float):
                integrals[EXPANSION] = ("m3", self._expansion)
            integrals |= {f"volume.{key}": ("m3", flow) for key, flow in self._tank_flow.items()}
            moved = self._tank_flow or self._growth  # a closed circuit has no tank: what the pistons displace
            integrals["volume.exchanged"] = ("m3", sum(ca.fabs(flow) for flow in moved.values()))
            for key, (unit, rate) in integrals.items():
                states.append((State(key, unit, float("inf"), integral=True), scalar_symbol(key), rate))
            for key, energy in self._stored.items():
                self.output(f"stored.{key}", "J", energy)
        return Closed(
            states=tuple(states),
            motor_speed=self.motor_speed if self._command is None else self._command,
            motor_acceleration=self.motor_acceleration,
            parameters=self._parameters,
            outputs=tuple(self._outputs.values()),
            nodes=nodes,
            losses=tuple(self._losses),
            works=tuple(self._works),
            tank_flows=tuple(self._tank_flow),
            commands=tuple(self._commands),
        )

    def _warms_up(self, node: str) -> Real:
        """Volume that a node's oil gains by its temperature's change [m3/s]; what it presses is work of the heat."""
        assert self._warming is not None
        rate = self.oil.trapped_expansion(self.oil_temperature) * self._volume[node] * self._warming
        self._expansion += rate
        self.work("expansion", self._powers.get("expansion", 0.0) - self._pressure[node] * rate)
        return rate

    def model(self, name: str, *, audited: bool) -> CircuitModel:
        """The circuit as an equation; arguments as `close`, and a name for messages."""
        closed = self.close(audited=audited)
        states, symbols, rates = zip(*closed.states, strict=True)
        ode = OdeModel(
            name=name,
            states=states,
            inputs=INPUTS,
            parameters=closed.parameters.names,
            x=ca.vertcat(*symbols),
            u=ca.vertcat(closed.motor_speed, self.load),
            slope=ca.vertcat(closed.motor_acceleration, self._load_rate),
            p=closed.parameters.column,
            rhs=ca.vertcat(*rates),
            outputs=closed.outputs,
        )
        return CircuitModel(ode, closed.parameters.values, closed.commands, **vars(closed.names))


def parameter_values(model: CircuitModel, oil: Oil, tank_pressure: float, parts: Sequence[Part]) -> Array:
    """Values of a model's parameters for other parts of the same circuit, without a new equation.

    Args:
        tank_pressure: absolute [Pa].
        parts: the other parts; their names and options are those of the model's.

    Raises:
        KeyError: a part has an option that the model's has not.
    """
    known = dict(zip(model.ode.parameters, model.values.tolist(), strict=True))
    passed = {f"{TANK}.pressure": tank_pressure}
    for name, part in (("oil", oil), *((part.name, part) for part in parts)):
        passed |= {f"{name}.{key}": value for key, value in vars(part).items() if isinstance(value, float)}
    if strange := passed.keys() - known.keys():
        raise KeyError(f"{min(strange)}: no parameter of {model.ode.name}")
    return np.array(list((known | passed).values()))


def shape(oil: Oil, parts: Sequence[Part]) -> tuple[object, ...]:
    """All that decides a circuit's equation except its numbers; of equal shapes `parameter_values` serves both."""
    return tuple(
        (type(part), tuple((key, None if isinstance(value, float) else (value,)) for key, value in vars(part).items()))
        for part in (oil, *parts)
    )


def join(name: str, oil: Oil, tank_pressure: float, parts: Sequence[Part], *, audited: bool = False) -> CircuitModel:
    """Join parts at their nodes into one equation.

    Args:
        tank_pressure: absolute [Pa].
    """
    circuit = Circuit(oil, tank_pressure)
    for part in parts:
        circuit.add(part)
    return circuit.model(name, audited=audited)
