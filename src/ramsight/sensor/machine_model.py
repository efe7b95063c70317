"""What every stage of a sensor knows of its machine: description, assumptions, balance, and parameters as symbols."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import casadi as ca

from ramsight.expression import Real, Scalar, within
from ramsight.plant.balance import Balance
from ramsight.plant.balance import balance as balance_of
from ramsight.plant.holding import TrappedOil
from ramsight.plant.limits import Limits, limits_of
from ramsight.plant.oil import T40, Oil
from ramsight.plant.symbols import Parameters
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.kind import KINDS, Kind
from ramsight.sensor.thresholds import MIXED_FRICTION_SPEED, SAMPLE, VALVE_SETTLED


@dataclass(frozen=True)
class MachineModel:
    """A machine as a sensor has it.

    The symbols are parameters of the recursion, so that one graph serves every machine with the circuit.
    """

    unit: HydraulicUnit  # its parts, as described
    assumed: Assumptions  # what is assumed of drive, thermometer, machine and stops
    balance: Balance  # of the circuit
    limits: Limits  # of the unit
    table: Parameters = field(repr=False)  # all parameters by name
    circuit: tuple[Scalar, ...] = field(repr=False)  # the circuit's parameters, in the balance's order
    travel_per_radian: Scalar  # of the piston, by the motor's angle [m/rad]
    stroke: Scalar  # of the cylinder [m]
    stop_stiffness: Scalar  # of its ends [N/m]
    relief_load: Scalar  # that the relief valves carry against lifting [N]
    relief_pull: Scalar  # that they carry the other way [N]
    relief_torque: Scalar  # of the motor at that load [N m]
    largest_torque: Scalar  # of the motor at relief pressure on either side [N m]
    max_speed: Scalar  # of the motor [rad/s]
    leak_velocity: Scalar  # of the piston by leakage at relief pressure and 40 degC [m/s]
    mass: Scalar  # that the piston moves [kg]
    # trapped: volume [m3] and capacity [m3/Pa] of the oil that is shut in with the load at rest, each with the piston
    # at 0 and at the end of its stroke
    trapped: tuple[tuple[Scalar, Scalar], tuple[Scalar, Scalar]]
    # kinds: of the hypotheses that the sensor weighs, in the order of `Kind`, the first and the last among them
    kinds: tuple[Kind, ...] = KINDS

    @classmethod
    def of(
        cls, unit: HydraulicUnit, assumed: Assumptions | None = None, balance: Balance | None = None
    ) -> MachineModel:
        """The model of a unit.

        Args:
            assumed: what is assumed; by default what the unit declares.
            balance: of the circuit, if it is another one than the unit's own.
        """
        circuit, limits, table = balance or balance_of(unit), limits_of(unit), Parameters()
        add = table.add
        oil = TrappedOil.of(unit, 0.5 * limits.pressure)
        return cls(
            unit=unit,
            assumed=assumed or unit.assumptions,
            balance=circuit,
            limits=limits,
            table=table,
            circuit=tuple(
                add(f"circuit.{name}", float(value))
                for name, value in zip(circuit.parameters, circuit.values, strict=True)
            ),
            travel_per_radian=add("travel_per_radian", float(unit.travel_per_radian)),
            stroke=add("stroke", float(unit.cylinder.stroke)),
            stop_stiffness=add("stop_stiffness", float(unit.cylinder.stop_stiffness)),
            relief_load=add("relief_load", limits.load),
            relief_pull=add("relief_pull", limits.pull),
            relief_torque=add("relief_torque", limits.torque),
            largest_torque=add("largest_torque", limits.largest_torque),
            max_speed=add("max_speed", limits.max_speed),
            leak_velocity=add("leak_velocity", limits.leak_velocity),
            mass=add("mass", circuit.mass),
            trapped=(
                (add("trapped.volume_0", oil.volume[0]), add("trapped.volume_1", oil.volume[1])),
                (add("trapped.capacity_0", oil.capacity[0]), add("trapped.capacity_1", oil.capacity[1])),
            ),
        )

    @property
    def lift(self) -> float:
        """+1 if extension lifts the load, -1 if retraction does."""
        return float(self.unit.lift_sign)

    @property
    def passive(self) -> bool:
        """Whether the load only resists, as friction does."""
        return bool(self.unit.cylinder.passive)

    @property
    def torque_std(self) -> Scalar:
        """Standard deviation of the reported torque [N m]."""
        return self.assumed.drive.torque * self.relief_torque

    def of_circuit(self, name: str) -> Scalar:
        """A parameter of the circuit, for example ``tank.pressure``."""
        found: Scalar = self.table.symbol(f"circuit.{name}")
        return found

    @property
    def oil(self) -> Oil:
        """The oil, with parameters for numbers."""
        return self.balance.oil_of(self.of_circuit)

    def trapped_oil(self, position: Scalar) -> tuple[Scalar, Scalar]:
        """Volume [m3] and capacity [m3/Pa] of the oil that is shut in with the load, by the position [m]."""
        share = within(position / self.stroke, 0.0, 1.0)
        volume, capacity = (low + share * (high - low) for low, high in self.trapped)
        return volume, capacity

    def viscosity(self, temperature: Real) -> Scalar:
        """Of the oil [m2/s] at a temperature [K]."""
        found: Scalar = self.oil.viscosity(temperature)
        return found

    def thinner(self, temperature: Real) -> Scalar:
        """Viscosity at 40 degC over that at a temperature [K]."""
        return self.viscosity(T40) / self.viscosity(temperature)

    def bounce_time(self, give: Scalar) -> Scalar:
        """Half a period of the mass on oil that gives way by so much a load [s]; `give` [m/N]."""
        return math.pi * ca.sqrt(self.mass * give)


@lru_cache(maxsize=256)
def delivers(balance: Balance, node: str, way: float) -> bool:
    """Whether the pumps press oil into a node while the motor turns one way and the piston is held.

    Args:
        way: +1 or -1, the sign of the motor's speed, or of a directional valve's command: 1 extends.
    """
    place = balance.states.index(f"pressure_{node}")
    rest = balance.at_rest(0.5 * balance.unit.cylinder.stroke, 0.0)
    # A motor that turns one way only fills either chamber as its valve is commanded.
    commands = dict.fromkeys(balance.model.commands, way)
    turns = 1.0 if commands else way
    p = balance.parameters_at(balance.values, T40, commands)
    speed = turns * MIXED_FRICTION_SPEED  # as slow as a pump surely delivers, so that no valve opens
    z: Any = rest  # an array of numbers at first, then CasADi's
    for _ in range(round(VALVE_SETTLED / SAMPLE)):
        z = balance.step(z, speed, speed, 0.0, 0.0, p, SAMPLE, held=1.0, settles=True).z
    return bool(z[place] > rest[place])


def one_sided(balance: Balance) -> bool:
    """Whether the pumps press on the held side of the piston only, whichever way the motor turns."""
    cylinder = balance.unit.cylinder
    other = cylinder.node_b if balance.unit.held == "a" else cylinder.node_a
    return not any(delivers(balance, other, way) for way in (1.0, -1.0))
