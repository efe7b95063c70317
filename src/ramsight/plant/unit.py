"""What any unit is to those who run it: its parts, its cylinder and load, and a state to start from."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from ramsight.arrays import Array
from ramsight.machine.assumption_description import Assumptions
from ramsight.machine.requirement_description import Requirement
from ramsight.plant.circuit import TANK, CircuitModel, Part, join
from ramsight.plant.cylinder import Cylinder
from ramsight.plant.drive import Drive
from ramsight.plant.oil import ATMOSPHERE, Oil
from ramsight.plant.pump import Pump
from ramsight.units import format_si

if TYPE_CHECKING:
    from ramsight.plant.heat import HeatStores
    from ramsight.plant.linkage.lever import Lever


@dataclass(frozen=True, kw_only=True)
class HydraulicUnit(ABC):
    """A unit built from its description: its parts, and what is common to them."""

    name: str  # of the unit
    oil: Oil
    tank_pressure: float  # absolute; of a closed circuit, the pressure that it is charged to at rest [Pa]
    drive: Drive
    cylinder: Cylinder
    lift_sign: float  # +1 if extension lifts the load, -1 if retraction does
    max_speed: float  # highest motor speed [rad/s]
    extra: tuple[Part, ...] = ()  # further parts, for example your own, added with `dataclasses.replace`
    # Not in the text: tables made from simulated runs are kept by it, and know no assumptions.
    assumptions: Assumptions = field(default=Assumptions(), repr=False)  # what a sensor assumes of it; no law uses them
    # lever: what the angle of the body that the cylinder turns says of its position; None where it says nothing
    lever: Lever | None = field(default=None, repr=False)
    # heat: what the heat of its losses is kept in; None where that is not described
    heat: HeatStores | None = field(default=None, repr=False)
    # requirement: what its position has to achieve; None where that is not described
    requirement: Requirement | None = field(default=None, repr=False)

    @property
    def held(self) -> str:
        """The side that holds the load, "a" or "b"."""
        return "a" if self.lift_sign > 0.0 else "b"

    @cached_property
    def travel_per_radian(self) -> float:
        """Ideal travel per motor angle on the load-holding side [m/rad]."""
        return float(abs(pumped_into(self, self.held)) / self.cylinder.area(self.held))

    @abstractmethod
    def parts(self) -> tuple[Part, ...]:
        """All parts."""

    @abstractmethod
    def mapped(self, change: Callable[[Any], Any]) -> Self:  # a part of any kind, changed to one of its kind
        """The unit with its parts, but for drive and cylinder, replaced by what `change` makes of each."""

    def __str__(self) -> str:
        return f"unit {self.name}: {', '.join(f'{name} {value}' for name, value in self._sizes())}"

    def _repr_html_(self) -> str:
        """A card in a notebook: its sizes, and its circuit."""
        from ramsight.circuit_picture import circuit_picture
        from ramsight.output.notebook import card

        rows = [*self._sizes(), ("parts", ", ".join(part.name for part in self.parts()))]
        return card(f"unit {self.name}", rows, circuit_picture(self, self.name))

    def _sizes(self) -> list[tuple[str, str]]:
        cylinder = self.cylinder
        return [
            ("areas A, B", f"{1e6 * cylinder.area_a:.0f}, {1e6 * cylinder.area_b:.0f} mm2"),
            ("stroke", format_si(cylinder.stroke, "mm", 4)),
            ("travel of a motor turn", f"{1e3 * self.travel_per_radian * math.tau:.4g} mm"),
            ("motor", f"up to {format_si(self.max_speed, 'rpm', 4)}"),
            ("oil", self.oil.name),
        ]


def reach(parts: Sequence[Part], start: str, through: str) -> frozenset[str]:
    """Nodes that are joined to a node through parts; the tank joins nothing.

    Args:
        through: attribute that names the nodes that a part joins, or groups of them: "joins" for those with one
            pressure at rest, "passage" for those between which oil passes in normal work.
    """
    groups = [group - {TANK} for part in parts if hasattr(part, through) for group in _groups(getattr(part, through))]
    found, grown = {start}, True
    while grown:
        before = len(found)
        for group in groups:
            if group & found:
                found |= group
        grown = len(found) > before
    return frozenset(found)


def _groups(nodes: tuple[Any, ...]) -> list[set[str]]:  # all are names, or all are groups of names
    """Nodes that a part brings together: in one group, or, of a valve with several ways, in as many."""
    return [set(nodes)] if all(isinstance(node, str) for node in nodes) else [set(group) for group in nodes]


def opposite(side: str) -> str:
    """The other side of the cylinder: "b" of "a", "a" of "b"."""
    return "b" if side == "a" else "a"


def side_nodes(unit: HydraulicUnit, side: str) -> frozenset[str]:
    """Nodes on one side of the cylinder, "a" or "b", up to its pumps."""
    return reach(unit.parts(), unit.cylinder.node_a if side == "a" else unit.cylinder.node_b, "passage")


def pumped_into(unit: HydraulicUnit, side: str) -> float:
    """Oil that the pumps move into a side per motor angle, without leakage [m3/rad]; negative if out of it."""
    nodes = side_nodes(unit, side)
    pumps = [part for part in unit.parts() if isinstance(part, Pump)]
    return float(sum(p.geared_displacement * ((p.outlet in nodes) - (p.inlet in nodes)) for p in pumps))


def circuit(unit: HydraulicUnit, *, audited: bool = False) -> CircuitModel:
    """The unit as an equation."""
    return join(unit.name, unit.oil, unit.tank_pressure, unit.parts(), audited=audited)


def initial_state(
    unit: HydraulicUnit, model: CircuitModel, position: float, load: float, motor_speed: float = 0.0
) -> Array:
    """States of the unit at rest: the held chamber carries the load, the rest has the tank's pressure.

    Friction is not strained; a negative load is carried by the other chamber.

    Args:
        position: [m].
        load: [N].
        motor_speed: of a servo drive [rad/s].
    """
    state = np.zeros(len(model.ode.states))
    for node, level in rest_pressures(unit, model.nodes, load).items():
        state[model.ode.state_index(f"pressure_{node}")] = level
    state[model.ode.state_index("position")] = position
    if any(known.name == "motor_speed" for known in model.ode.states):
        state[model.ode.state_index("motor_speed")] = motor_speed
    return state


def rest_pressures(unit: HydraulicUnit, nodes: Sequence[str], load: float) -> dict[str, float]:
    """Pressures [Pa] of the nodes at rest under a load [N], as in `initial_state`."""
    c = unit.cylinder
    pressure = dict.fromkeys(nodes, unit.tank_pressure)
    if c.passive:  # what only resists holds the piston whatever the pressures are
        return pressure
    force = unit.lift_sign * load + ATMOSPHERE * (c.area_a - c.area_b)
    on_a, on_b = c.area_a * unit.tank_pressure, c.area_b * unit.tank_pressure
    if force > on_a - on_b:
        chamber, value = c.node_a, (force + on_b) / c.area_a
    else:
        chamber, value = c.node_b, (on_a - force) / c.area_b
    for node in reach(unit.parts(), chamber, "joins"):
        pressure[node] = value
    return pressure


def assuming(unit: HydraulicUnit, changes: Mapping[str, Any]) -> HydraulicUnit:
    """The same unit, of which a sensor assumes something else; changes as `Assumptions.replace` takes them."""
    return replace(unit, assumptions=unit.assumptions.replace(changes))
