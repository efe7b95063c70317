"""What holds a unit's load at rest, and how fast its motor has to turn for what leaks: from the circuit's own parts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, overload

import casadi as ca
import numpy as np

from ramsight.expression import Real
from ramsight.plant.accumulator import Accumulator
from ramsight.plant.cylinder import Cylinder
from ramsight.plant.either import choose, known, least, most
from ramsight.plant.hose import Hose, Volume
from ramsight.plant.pilot_check import PilotCheckValve
from ramsight.plant.unit import HydraulicUnit, circuit, initial_state, opposite, pumped_into, reach, side_nodes
from ramsight.plant.valve import CheckValve, ReliefValve, SafetyValve

_TIGHT = (Cylinder, Hose, Volume, Accumulator, SafetyValve, CheckValve, PilotCheckValve, ReliefValve)
_BELOW_RELIEF = 0.99  # of a relief valve's setting, where it is surely shut


def holding_valves(unit: HydraulicUnit) -> tuple[SafetyValve, ...]:
    """Valves that keep the load's oil in until the motor lowers."""
    return tuple(part for part in unit.parts() if isinstance(part, SafetyValve) and part.commanded)


def opening_speed(unit: HydraulicUnit) -> float:
    """Motor speed above which they begin to open to lower [rad/s]; 0 without one."""
    return max((abs(float(valve.opening_speed)) for valve in holding_valves(unit)), default=0.0)


def _joined_to_load(unit: HydraulicUnit) -> frozenset[str]:
    """Nodes that have the pressure of the chamber which holds the load, while nothing flows."""
    chamber = unit.cylinder.node_a if unit.held == "a" else unit.cylinder.node_b
    return reach(unit.parts(), chamber, "joins")


def held_by_valve(unit: HydraulicUnit) -> bool:
    """Whether a valve keeps the load's oil where it is at rest, so that the rod stands.

    Not where a pump, an orifice, a leaking seal or an unknown part is joined to the chamber.
    """
    joined = _joined_to_load(unit)
    touching = [part for part in unit.parts() if joined & {str(value) for value in vars(part).values()}]
    return unit.cylinder.seal_leak is None and all(isinstance(part, _TIGHT) for part in touching)


@dataclass(frozen=True)
class TrappedOil:
    """Oil on the load's side of the piston, hoses among it, up to what is shut at rest; linear over the position."""

    volume: tuple[float, float]  # with the piston at 0, and at the end of its stroke [m3]
    capacity: tuple[float, float]  # the same, volume per pressure [m3/Pa]

    @classmethod
    def of(cls, unit: HydraulicUnit, pressure: float) -> TrappedOil:
        """That of a unit, its capacity at an absolute pressure [Pa].

        Example:
            >>> from ramsight import machine
            >>> from ramsight.plant.build import build
            >>> bucket = build(machine.load_machine("mining-loader").unit("bucket"), "bucket")
            >>> oil = TrappedOil.of(bucket, 100e5)  # 2 l of it in the hose
            >>> f"{1e3 * oil.volume[1]:.1f} l, {1e6 * oil.capacity[1] / bucket.cylinder.area_b**2:.3f} mm/kN"
            '2.5 l, 0.045 mm/kN'
        """
        model = circuit(unit)
        ode, nodes = model.ode, sorted(_joined_to_load(unit) & set(model.nodes))
        outputs = {output.name: output.expression for output in ode.outputs}
        sums = [sum(outputs[f"{what}_{node}"] for node in nodes) for what in ("volume", "capacity")]
        function = ca.Function("trapped", [ode.x, ode.u, ode.slope, ode.p], [ca.vertcat(*sums)])
        found = []
        for position in (0.0, unit.cylinder.stroke):
            state = initial_state(unit, model, float(position), 0.0)
            for node in nodes:
                state[ode.state_index(f"pressure_{node}")] = pressure
            found.append(np.asarray(function(state, 0.0, 0.0, model.values)).ravel())
        (low_volume, low), (high_volume, high) = found
        return cls((float(low_volume), float(high_volume)), (float(low), float(high)))


class Leaving:
    """The oil that leaves a side of the cylinder while motor and piston stand, and all of the side has one pressure.

    Whatever lets it out counts, but for relief valves that have opened: the circuit's own equation states how fast the
    side would lose its pressure. Beyond a relief valve's setting the flow is taken to grow in proportion.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build
        >>> ram = Leaving(build(machine.load_machine("press").unit("ram"), "ram"), "a")
        >>> f"{6e4 * ram.flow(100e5, 313.15):.2f} l/min at 100 bar"
        '1.05 l/min at 100 bar'
    """

    def __init__(self, unit: HydraulicUnit, side: str) -> None:
        model = circuit(unit)
        ode, inside = model.ode, side_nodes(unit, side)
        nodes = {node: ode.state_index(f"pressure_{node}") for node in model.nodes}
        above, warmth = ca.SX.sym("above"), ca.SX.sym("oil_temperature")
        state, values = ca.SX(initial_state(unit, model, 0.5 * unit.cylinder.stroke, 0.0)), ca.SX(model.values)
        for node, k in nodes.items():
            state[k] = unit.tank_pressure + (above if node in inside else 0.0)
        values[ode.parameters.index("oil_temperature")] = warmth
        capacity = {output.name: output.expression for output in ode.outputs}
        flows = [-capacity[f"capacity_{node}"] * ode.rhs[k] for node, k in nodes.items() if node in inside]
        known = [state, ca.SX.zeros(2), ca.SX.zeros(2), values]
        (flow,) = ca.substitute([ca.sum1(ca.vertcat(*flows))], [ode.x, ode.u, ode.slope, ode.p], known)
        # Called every sample: in a buffer of its own, which takes a microsecond.
        function = ca.Function("leaving", [ca.vertcat(above, warmth)], [ca.densify(flow)])
        self._arguments, self._found = np.zeros(2), np.zeros(1)
        arguments: Any = self._arguments
        found: Any = self._found
        buffer, self._run = function.buffer()
        buffer.set_arg(0, memoryview(arguments))
        buffer.set_res(0, memoryview(found))
        self._function, self._buffer = function, buffer  # which `run` needs
        reliefs = [p.setting for p in unit.parts() if isinstance(p, ReliefValve) and p.inlet in inside]
        self._most = _BELOW_RELIEF * min(reliefs, default=np.inf)

    def flow(self, pressure: Real, temperature: Real) -> Real:
        """The flow [m3/s] at a pressure above the tank's [Pa] and an oil temperature [K], numbers or graphs."""
        within = least(pressure, self._most)
        if isinstance(within, ca.SX):
            flow: Real = self._function(ca.vertcat(within, temperature))
        else:
            self._arguments[:] = within, temperature
            self._run()
            flow = float(self._found[0])
        if not np.isfinite(self._most):
            return flow
        return choose(pressure <= self._most, flow, flow * pressure / self._most)


class Holding:
    """How the motor's speed carries a load: what holds it, what leaks under it, and what is left for the piston.

    A load that presses is held by the unit's held side, one that pulls by the other side, if that has a pump.

    Attributes:
        stands: whether the rod stands while the motor does, held by a valve.
        opening_speed: motor speed above which they begin to [rad/s]; 0 without any.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build
        >>> ram = Holding(build(machine.load_machine("press").unit("ram"), "ram"))
        >>> ram.stands, f"{ram.leakage(200e3, 313.15):.1f} rad/s"
        (False, '4.3 rad/s')
    """

    def __init__(self, unit: HydraulicUnit) -> None:
        self.unit, self.valves, self.opening_speed = unit, holding_valves(unit), opening_speed(unit)
        self.stands = bool(self.valves) or held_by_valve(unit)
        # A valve holds one way only, and what pulls has no leakage worth a name on the way that it opens.
        sides = (unit.held,) if self.stands else (unit.held, opposite(unit.held))
        self._sides = [self._side(side) for side in sides if pumped_into(unit, side) != 0.0]

    def _side(self, side: str) -> tuple[Leaving, float, float]:
        return Leaving(self.unit, side), float(self.unit.cylinder.area(side)), abs(pumped_into(self.unit, side))

    @overload
    def leakage(self, load: float, temperature: float) -> float: ...
    @overload
    def leakage(self, load: Real, temperature: Real) -> Real: ...
    def leakage(self, load: Real, temperature: Real) -> Real:
        """Motor speed that only makes up for what leaks [rad/s], positive where it turns the way that lifts.

        Args:
            load: [N]; 0 if it is not known (NaN). A number or a graph, and so is what is found.
            temperature: of the oil [K].
        """
        felt = choose(known(load), load, 0.0)

        def of(way: float, side: tuple[Leaving, float, float]) -> Real:
            leaving, area, pumped = side
            return way * leaving.flow(most(way * felt, 0.0) / area, temperature) / pumped

        return self._of_the_carrying(load, of)

    @overload
    def travel_per_radian(self, load: float) -> float: ...
    @overload
    def travel_per_radian(self, load: Real) -> Real: ...
    def travel_per_radian(self, load: Real) -> Real:
        """Ideal travel per motor angle under a load [m/rad]; a number or a graph."""
        return self._of_the_carrying(load, lambda _, side: side[2] / side[1])

    def _of_the_carrying(self, load: Real, of: Callable[[float, tuple[Leaving, float, float]], Real]) -> Real:
        """What is asked for of the side that carries: of a number that side alone, of a graph both and a choice."""
        if len(self._sides) == 1:
            return of(1.0, self._sides[0])
        if not isinstance(load, ca.SX):
            return of(-1.0, self._sides[1]) if load < 0.0 else of(1.0, self._sides[0])
        return choose(load < 0.0, of(-1.0, self._sides[1]), of(1.0, self._sides[0]))
