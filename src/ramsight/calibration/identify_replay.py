"""A unit's own circuit run along a record, for factors by which the machine may differ from its data sheet.

The circuit's equations (`ramsight.plant.balance`) follow the reported speed under a load that the torque corrects
(`ramsight.sensor.circuit.load`), at the position that was measured. What they say the piston travelled, less what
it did travel, does not change in time if the factors are right:

    content = x_circuit - x_measured - delay v

No law of the circuit is written here: whatever a part does in the plant it does in the replay.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from ramsight.arrays import Array
from ramsight.calibration.identify_record import IdentifyError, Record
from ramsight.calibration.loss_uncertainty import rougher, with_friction_factor
from ramsight.engine.recursion import replay
from ramsight.engine.typed_state import symbols
from ramsight.expression import Scalar, scalar
from ramsight.plant.balance import FACTORS, balance, without_friction
from ramsight.plant.holding import holding_valves
from ramsight.plant.limits import limits_of
from ramsight.plant.pump import Pump
from ramsight.plant.unit import HydraulicUnit, assuming, side_nodes
from ramsight.plant.valve import SETTLED, CheckValve, ReliefValve
from ramsight.sensor.balance import BalanceState
from ramsight.sensor.circuit.load import LoadState, Piston, observe_load
from ramsight.sensor.dead_reckoning import ReckoningState
from ramsight.sensor.inputs.oil_heat import WarmingState, warming_rate
from ramsight.sensor.inputs.sample import Raw, SampleState, plain_sample
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.virtual_sensor import Report, close


@dataclass(frozen=True)
class Deviation:
    """How a machine differs from its data sheet."""

    leak: float = 1.0  # leakage of all pumps by their law or table, over the data sheet's [1]
    # orifice: leakage like an orifice's at the nominal pressure, over the data sheet's laminar one there [1]
    orifice: float = 0.0
    displacement: float = 1.0  # of all pumps over the data sheet's [1]
    compliance: float = 1.0  # of oil and hoses over the data sheet's [1]
    delay: float = 0.0  # by which the position lags the log [s]
    efficiency: float = 0.0  # hydro-mechanical, of all pumps, less the data sheet's [1]
    no_load: float = 1.0  # no-load torque of all pumps over the data sheet's [1]


@dataclass(frozen=True)
class Run:
    """A record as the circuit explains it; every array has the shape (n,)."""

    content: Array  # what the piston should have travelled since the start, less what it did [m]
    force: Array  # of the oil against load and friction, in the lifting direction [N]; what the mass takes is taken off
    velocity: Array  # measured, in the lifting direction [m/s]
    give: Array  # travel per load that the oil's compression allows [m/N]
    near_relief: Array  # largest pressure difference over a relief valve's setting [1]
    suction: Array  # smallest pressure difference by which a check valve to the load's side is shut [Pa]
    pressure: Array  # in the chamber that holds the load, above tank [Pa]


def orifice_at_one(pump: Pump) -> float:
    """Orifice conductance that leaks as much at the nominal point as the data sheet's gaps do [m3/s/sqrt(Pa)]."""
    nominal = pump.displacement * pump.nominal_speed * (1.0 - pump.volumetric_efficiency)
    return float(nominal / np.sqrt(pump.nominal_pressure))


def opening_time_in_steps(opening_time: float, period: float) -> float:
    """Opening time [s] with which a valve that is solved implicitly is as far after each step as one that opens freely.

    An implicit step leaves 1/(1 + h/T1) of what a first-order lag has still to go, the lag itself exp(-h/T):

        T1 = h / (exp(h/T) - 1)

    At samples of 20 ms a valve of 30 ms would close some 40 ms late, and the pumps would leak the load's oil that long.

    Args:
        opening_time: of the valve, until it is 95 % open, three time constants T [s].
        period: of the samples, h [s].

    Example:
        >>> f"{1e3 * opening_time_in_steps(0.03, 0.02):.1f} ms"
        '9.4 ms'
    """
    return SETTLED * period / math.expm1(SETTLED * period / opening_time)


class Circuit:
    """A unit's circuit, ready to run along records."""

    def __init__(self, unit: HydraulicUnit) -> None:
        self.unit, self.limits = unit, limits_of(unit)
        self.pumps = tuple(part for part in unit.parts() if isinstance(part, Pump))
        self._recursion, values, self._initial = _written(_with_wear(unit))
        self._places = {name: k for k, name in enumerate(self._recursion.parameters)}
        self._values = values
        self.evaluations = 0

    def described(self) -> Deviation:
        """The description itself as a deviation: it may have an orifice's leakage already."""
        shares = [float(pump.orifice_leak or 0.0) / orifice_at_one(pump) for pump in self.pumps]
        return Deviation(orifice=float(np.mean(shares)))

    def run(self, record: Record, how: Deviation) -> Run:
        """The record as the circuit with a deviation explains it."""
        self.evaluations += 1
        columns = (record.time, record.motor_speed, record.motor_torque, record.oil_temperature, record.position)
        inputs = np.ascontiguousarray(np.column_stack([*columns, np.ones(len(record.time))]))
        state = self._initial.copy()
        state[self._recursion.state.index("position")] = record.position[0]
        result = replay(self._recursion, inputs, self._changed(how, record.period), state)
        found = dict(zip(self._recursion.outputs, result.T, strict=True))
        self._check(found["travel"])
        cylinder, lift = self.unit.cylinder, self.unit.lift_sign
        velocity = lift * record.velocity
        moved = np.cumsum(found["travel"]) - (record.position - record.position[0])
        acceleration = lift * np.gradient(record.motor_speed, record.time) * self.unit.travel_per_radian
        return Run(
            content=lift * moved - how.delay * velocity,
            force=found["load"] - cylinder.mass * acceleration,
            velocity=velocity,
            give=found["give"],
            near_relief=found["near_relief"],
            suction=found["suction"],
            pressure=found["pressure"],
        )

    def _check(self, travel: Array) -> None:
        """Refuse equations that a step of a sample does not solve, as with much air in oil at the tank's pressure."""
        unit, most = self.unit, 2.0 * self.unit.cylinder.stroke
        if np.all(np.abs(travel) < most):
            return
        why = "no solution of its equations from one sample to the next"
        if unit.oil.air is not None:
            why = (
                f"oil with {100.0 * unit.oil.air:.2g} % of free air (oil.free_air) is too soft near the tank's pressure"
            )
        raise IdentifyError(f"unit {unit.name!r} cannot be followed along this log: {why}; sample the log faster")

    def _changed(self, how: Deviation, period: float) -> Array:
        """The recursion's parameters under a deviation, for samples of a period [s]."""
        values = self._values.copy()
        changes: dict[str, float] = {"leak": how.leak, "displacement": how.displacement, "compliance": how.compliance}
        for pump in self.pumps:
            changes[f"circuit.{pump.name}.orifice_leak"] = how.orifice * orifice_at_one(pump)
            if pump.table is not None:
                changes[f"circuit.{pump.name}.friction_factor"] = rougher(
                    pump.hydromechanical_efficiency, how.efficiency
                )
            else:
                efficiency = pump.hydromechanical_efficiency + how.efficiency
                changes[f"circuit.{pump.name}.hydromechanical_efficiency"] = efficiency
                changes[f"circuit.{pump.name}.no_load_torque"] = pump.no_load_torque * how.no_load
        for valve in holding_valves(self.unit):
            if valve.opening_time is not None:
                changes[f"circuit.{valve.name}.opening_time"] = opening_time_in_steps(valve.opening_time, period)
        for name, value in changes.items():
            values[self._places[name]] = value
        return values


def _with_wear(unit: HydraulicUnit) -> HydraulicUnit:
    """The unit with pumps whose equations have room for what may be found of them."""

    def part(p: Any) -> Any:
        return replace(p, orifice_leak=float(p.orifice_leak or 0.0)) if isinstance(p, Pump) else p

    # A replay follows the torque alone: a record has no pressures.
    return with_friction_factor(assuming(unit.mapped(part), {"pressure.std": 0.0}))


@lru_cache(maxsize=16)
def _written(unit: HydraulicUnit) -> tuple[Any, Array, Array]:
    """The recursion of a unit, the values of its parameters and its first state."""
    model = MachineModel.of(unit, balance=balance(without_friction(unit)))
    circuit, limits, raw = model.balance, model.limits, Raw.symbols(model.balance.model.commands)
    initial = BalanceState(
        reckoning=ReckoningState(
            position=scalar(0.5 * unit.cylinder.stroke), intake=SampleState.initial(circuit.model.commands)
        ),
        warming=WarmingState() if circuit.expands else None,
        load=LoadState.initial(model),
    )
    state = symbols(initial)
    intake, sample = plain_sample(state.reckoning.intake, raw)
    factors = [model.table.add(name, 1.0) for name in FACTORS]
    warming_state, warming = (None, 0.0) if state.warming is None else warming_rate(state.warming, sample)
    load, step = observe_load(state.load, sample, Piston.free(state.reckoning.position), factors, warming, model)
    tank = model.of_circuit("tank.pressure")

    def pressure(node: str) -> Scalar:
        return scalar(0.0) + circuit.pressure(step.z, node, tank)

    near = scalar(0.0)
    suction = scalar(limits.pressure)
    side = side_nodes(unit, unit.held)
    for part in unit.parts():
        if isinstance(part, ReliefValve):
            setting = model.of_circuit(f"{part.name}.setting")
            near = ca.fmax(near, (pressure(part.inlet) - pressure(part.outlet)) / setting)
        if isinstance(part, CheckValve) and part.outlet in side:
            suction = ca.fmin(suction, pressure(part.outlet) - pressure(part.inlet))
    c = unit.cylinder
    held = pressure(c.node_a if unit.held == "a" else c.node_b) - tank
    more: Mapping[str, tuple[Scalar, str]] = {
        "travel": (step.motion.travel, "m"),
        "give": (step.motion.give, "m/N"),
        "near_relief": (near, "1"),
        "suction": (suction, "Pa"),
        "pressure": (held, "Pa"),
    }
    reckoning = replace(state.reckoning, position=raw.reference, intake=intake)
    after = BalanceState(reckoning=reckoning, warming=warming_state, load=load)
    said = Report(raw.reference, 0.0, step.motion.velocity, step.load.value, scalar(0.0), more)
    sensor = close("replay", model.table, raw, initial, state, after, said)
    return sensor.recursion, sensor.parameters, sensor.initial
