"""Variables of an FMU: kinds, units as powers of base units, what an importer shows them in, and usual sizes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

from ramsight.deploy.weighing_words import WeighedAs
from ramsight.duty.simulate import SAMPLE_PERIOD
from ramsight.plant.limits import limits_of
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.status import Status
from ramsight.tracking.comparing import Verdict
from ramsight.units import FREEZING, RPM

UNKNOWN = 1e10
"""What no pressure in Pa, no angle in rad and no position in m is."""
NOTHING = "1e10 where it is not measured"
PERIOD = SAMPLE_PERIOD  # s; of the steps of a sensor that nothing behind it asks for others
ENUMERATIONS: dict[str, type[Status] | type[Verdict] | type[WeighedAs]] = {
    "status": Status, "verdict": Verdict, "quality": WeighedAs,
}  # fmt: skip
"""Kinds of variables that are whole numbers with words."""


@dataclass(frozen=True)
class Variable:
    """A variable of an FMU."""

    name: str
    kind: str  # `real`, `truth`, or one of `ENUMERATIONS`
    causality: str  # `input`, `output`, `parameter` or `independent`
    unit: str = ""  # SI unit; empty if it has none
    text: str = ""  # what it is
    start: float | None = None  # value before anything is set; outputs have none
    nominal: float | None = None  # a usual size; None where it is unknown
    # least, most: range, where there is one
    least: float | None = None
    most: float | None = None

    @property
    def enumeration(self) -> type[IntEnum] | None:
        """What its numbers mean, if they have words."""
        return ENUMERATIONS.get(self.kind)


@dataclass(frozen=True)
class DisplayUnit:
    """A unit in which values are shown: ``factor * value + offset``."""

    name: str  # of it, as FMI has it
    factor: float  # times the value in the SI unit
    offset: float = 0.0  # added to that


BASE = {
    "s": {"s": 1},
    "m": {"m": 1},
    "m2": {"m": 2},
    "m3": {"m": 3},
    "K": {"K": 1},
    "kg": {"kg": 1},
    "rad": {"rad": 1},
    "m/s": {"m": 1, "s": -1},
    "m2/s": {"m": 2, "s": -1},
    "m3/s": {"m": 3, "s": -1},
    "m3/rad": {"m": 3, "rad": -1},
    "rad/s": {"rad": 1, "s": -1},
    "rad/s2": {"rad": 1, "s": -2},
    "kg/m3": {"kg": 1, "m": -3},
    "kg.m2": {"kg": 1, "m": 2},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N/s": {"kg": 1, "m": 1, "s": -3},
    "N/m": {"kg": 1, "s": -2},
    "N.s/m": {"kg": 1, "s": -1},
    "N.m": {"kg": 1, "m": 2, "s": -2},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3},
}
"""Powers of base units, by unit."""
DISPLAY = {
    "m": DisplayUnit("mm", 1e3),
    "m2": DisplayUnit("cm2", 1e4),
    "m3": DisplayUnit("l", 1e3),
    "K": DisplayUnit("degC", 1.0, -FREEZING),
    "rad": DisplayUnit("deg", 180.0 / math.pi),
    "m/s": DisplayUnit("mm/s", 1e3),
    "m2/s": DisplayUnit("mm2/s", 1e6),
    "m3/s": DisplayUnit("l/min", 6e4),
    "m3/rad": DisplayUnit("cm3/rev", 2e6 * math.pi),
    "rad/s": DisplayUnit("rpm", 1.0 / RPM),
    "rad/s2": DisplayUnit("rpm/s", 1.0 / RPM),
    "N": DisplayUnit("kN", 1e-3),
    "N/s": DisplayUnit("kN/s", 1e-3),
    "N/m": DisplayUnit("kN/mm", 1e-6),
    "N.s/m": DisplayUnit("kN.s/m", 1e-3),
    "Pa": DisplayUnit("bar", 1e-5),
    "W": DisplayUnit("kW", 1e-3),
}
"""What a quantity is usually shown in, by SI unit; of s, N.m, kg, kg/m3, kg.m2 and J that is the SI unit itself."""
_PARAMETERS = {
    "m": ("stroke", "length", "diameter"),
    "m2": ("area_a", "area_b"),
    "m3": ("dead_volume_a", "dead_volume_b", "volume"),
    "m3/rad": ("displacement",),
    "m2/s": ("nominal_viscosity",),
    "m/s": ("stribeck_velocity",),
    "rad/s": ("nominal_speed", "threshold_speed"),
    "N": ("coulomb_friction", "breakaway_friction"),
    "N.s/m": ("viscous_friction",),
    "N/m": ("stop_stiffness",),
    "N.m": ("no_load_torque",),
    "Pa": (
        "pressure", "bulk_modulus", "setting", "cracking_pressure", "nominal_pressure", "precharge", "cut_off",
        "margin",
    ),
    "kg": ("mass",),
    "kg/m3": ("density", "nominal_density"),
    "kg.m2": ("inertia",),
    "s": ("opening_time", "switching_time", "swivel_time"),
}  # fmt: skip
_UNIT_OF = {key: unit for unit, keys in _PARAMETERS.items() for key in keys}


def parameter_unit(name: str) -> str:
    """Unit of a parameter of a circuit's equation; none where its parts give the word several, as of conductances.

    Example:
        >>> parameter_unit("relief_a.setting"), parameter_unit("relief_a.conductance")
        ('Pa', '')
    """
    return _UNIT_OF.get(name.rpartition(".")[2], "")


def usual_sizes(unit: HydraulicUnit) -> dict[str, float]:
    """Usual sizes of a unit's quantities, by SI unit, to three digits: what an importer scales by.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build
        >>> sizes = usual_sizes(build(machine.load_machine("mining-loader").unit("boom"), "boom"))
        >>> sizes["Pa"], sizes["m"]
        (21000000.0, 0.7)
    """
    limits = limits_of(unit)
    velocity = abs(unit.travel_per_radian) * limits.max_speed
    area = max(unit.cylinder.area(side) for side in "ab")
    sizes = {
        "m": unit.cylinder.stroke,
        "m/s": velocity,
        "m3/s": velocity * area,
        "rad/s": limits.max_speed,
        "Pa": limits.pressure,
        "N": limits.load,
        "N.m": limits.torque,
        "W": limits.torque * limits.max_speed,
        "K": 313.15,  # of warm oil, 40 degC
    }
    return {name: float(f"{size:.3g}") if name != "K" else size for name, size in sizes.items() if size > 0.0}
