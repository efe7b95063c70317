"""The description of a pump, its table of efficiencies as CSV text, and the motor that turns it."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from ramsight.machine.base import Part
from ramsight.machine.declare import Model, count, gearing, quantity, refuse
from ramsight.units import to_si

COLUMNS = ("pressure_bar", "speed_rpm", "viscosity_mm2s", "volumetric_efficiency", "hydromechanical_efficiency")
_UNITS = ("bar", "rpm", "mm2/s", "1", "1")
_LEAST, _MOST = (0.001, 0.01, 0.01, 0.001, 0.001), (1e4, 3e4, 1e5, 1.0, 1.0)
_RANGES = tuple((to_si(low, unit), to_si(high, unit)) for low, high, unit in zip(_LEAST, _MOST, _UNITS, strict=True))
_ALLOWED = "0.001 to 10000 bar, 0.01 to 30000 rpm, 0.01 to 100000 mm2/s, efficiencies 0.001 to 1"
_KEY = "efficiency_table"


@dataclass(frozen=True)
class Efficiencies:
    """Efficiencies of pump operation on a full grid, in SI."""

    pressure: tuple[float, ...]  # pressure rises [Pa], increasing
    speed: tuple[float, ...]  # pump speeds [rad/s], increasing
    viscosity: tuple[float, ...]  # [m2/s], increasing
    # volumetric, hydromechanical: efficiencies by viscosity, speed, pressure
    volumetric: tuple[tuple[tuple[float, ...], ...], ...]
    hydromechanical: tuple[tuple[tuple[float, ...], ...], ...]


@lru_cache(maxsize=64)
def read_efficiencies(text: str) -> Efficiencies:
    r"""Read the table.

    Args:
        text: CSV with the columns of `COLUMNS`, one row for each combination of pressure, speed and viscosity.

    Raises:
        PydanticCustomError: it is no such table; the text names the line.

    Example:
        >>> header = ",".join(COLUMNS)
        >>> table = read_efficiencies(header + "\n100, 1500, 46, 0.95, 0.92\n200, 1500, 46, 0.9, 0.94")
        >>> table.pressure, table.volumetric
        ((10000000.0, 20000000.0), (((0.95, 0.9),),))
    """
    try:
        lines = [line for line in csv.reader(io.StringIO(text.strip()), skipinitialspace=True) if line]
    except csv.Error as error:
        raise refuse(_KEY, text.strip()[:60], f"is no CSV text: {error}") from None
    if not lines or tuple(name.strip() for name in lines[0]) != COLUMNS:
        raise refuse(_KEY, text.strip()[:60], "the table needs a first line with its columns", ", ".join(COLUMNS))
    points: dict[tuple[float, float, float], tuple[float, float]] = {}
    for number, line in enumerate(lines[1:], 2):
        row = _row(line, number)
        if row[:3] in points:
            raise refuse(_KEY, f"line {number}", "the same pressure, speed and viscosity stand in an earlier line")
        points[row[0], row[1], row[2]] = row[3], row[4]
    axes = [tuple(sorted({point[k] for point in points})) for k in range(3)]
    if not points or math.prod(map(len, axes)) != len(points):
        words = " x ".join(str(len(axis)) for axis in axes)
        raise refuse(_KEY, f"{len(points)} rows", f"is no full grid of {words} pressures, speeds and viscosities")

    def grid(which: int) -> tuple[tuple[tuple[float, ...], ...], ...]:
        return tuple(tuple(tuple(points[p, w, nu][which] for p in axes[0]) for w in axes[1]) for nu in axes[2])

    return Efficiencies(axes[0], axes[1], axes[2], grid(0), grid(1))


def _row(line: list[str], number: int) -> tuple[float, float, float, float, float]:
    try:
        if not all(cell.isascii() for cell in line):  # float() takes digits of every script
            raise ValueError
        values = [to_si(float(cell), unit) for cell, unit in zip(line, _UNITS, strict=True)]
    except ValueError:
        raise refuse(_KEY, f"line {number}", "is not five numbers", ", ".join(COLUMNS)) from None
    if not all(low <= value <= high for value, (low, high) in zip(values, _RANGES, strict=True)):
        raise refuse(_KEY, f"line {number}", "is out of range", _ALLOWED)
    return values[0], values[1], values[2], values[3], values[4]


class Pump(Part):
    """Pump-motor with its belt: `blocks` parallel units of `chambers` chambers each."""

    family: ClassVar[str] = "pump"

    model: Model = None
    chambers: Annotated[int, count("chambers in a block", least=1, most=16)] = 1
    blocks: Annotated[int, count("parallel units", least=1, most=16)] = 1
    belt: Annotated[
        float, gearing("pump speed over motor speed, as a number or as teeth", above="0.01", most="100")
    ] = 1.0
    displacement: Annotated[float, quantity("cm3/rev", "displacement of one chamber", least=0.001, most=5000)]
    volumetric_efficiency: Annotated[
        float, quantity("1", "volumetric efficiency at the nominal point", above=0.5, most=1)
    ]
    hydromechanical_efficiency: Annotated[
        float, quantity("1", "hydro-mechanical efficiency at the nominal point", above=0.5, most=1)
    ]
    nominal_speed: Annotated[float, quantity("rpm", "pump speed of the nominal point", least=1, most=20000)]
    nominal_pressure: Annotated[float, quantity("bar", "pressure difference of the nominal point", least=1, most=1000)]
    nominal_viscosity: Annotated[
        float, quantity("mm2/s", "kinematic viscosity of the nominal point", above=1, most=1000)
    ]
    nominal_density: Annotated[float, quantity("kg/m3", "oil density of the nominal point", least=500, most=2000)]
    no_load_torque: Annotated[float, quantity("N m", "friction torque without pressure, per block", least=0, most=1000)]
    max_speed: Annotated[float, quantity("rpm", "highest pump speed allowed", least=1, most=20000)]
    max_pressure: Annotated[float, quantity("bar", "highest continuous pressure", least=1, most=1000)]
    orifice_leakage: Annotated[
        float, quantity("l/min", "by wear, at nominal_pressure, grows with its root, per chamber", least=0, most=100)
    ] = 0.0
    viscous_drag: Annotated[
        float, quantity("N m s/rad", "torque per pump speed at nominal_viscosity, per block", least=0, most=10)
    ] = 0.0
    hydrodynamic_drag: Annotated[
        float, quantity("N m s2/rad2", "torque per squared pump speed, per block", least=0, most=0.1)
    ] = 0.0
    # Tooth belts pass on 97 to 98 % of the torque, V-belts 95 to 97 %; a V-belt creeps by 0.5 to 1 %, a tooth belt not.
    belt_efficiency: Annotated[
        float, quantity("%", "torque that the belt passes on, either way", above=50, most=100)
    ] = 1.0
    belt_creep: Annotated[
        float, quantity("%", "by which it falls behind its ratio at nominal_pressure's torque", least=0, most=10)
    ] = 0.0
    # Data sheets ask for 0.6 to 0.8 bar; 0 is a pump that fills whatever its inlet's pressure.
    min_inlet_pressure: Annotated[
        float, quantity("bar", "absolute, from which it fills at max_speed", least=0, most=10)
    ] = 0.0
    # Flow at the outlet's density is what ISO 4409 takes the volumetric efficiency from.
    compression: Annotated[
        Literal["none", "in efficiency", "beside efficiency"],
        Field(
            description="of the pumped oil: left out, or with the volumetric efficiency measured by the flow at the "
            "outlet, which has it in it, or by that at low pressure, which has not"
        ),
    ] = "none"
    losses: Annotated[
        Literal["analytic", "table"], Field(description="from the nominal point, or from efficiency_table")
    ] = "analytic"
    efficiency_table: Annotated[
        str,
        Field(
            description="CSV text with the columns pressure_bar, speed_rpm, viscosity_mm2s, volumetric_efficiency, "
            "hydromechanical_efficiency: pump operation on a full grid"
        ),
    ] = ""

    efficiency_file: Annotated[
        str,
        Field(
            description="CSV file beside the description in the place of efficiency_table: pressure_bar, speed_rpm, "
            "temperature_c or viscosity_mm2s, flow_l_min or volumetric_efficiency, torque_nm or "
            "hydromechanical_efficiency"
        ),
    ] = ""

    @model_validator(mode="after")
    def _table_is_a_grid(self) -> Self:
        if self.losses == "table":
            read_efficiencies(self.efficiency_table)
        return self

    def compressed(self, pressure: float, bulk_modulus: float) -> float:
        """Share of a flow that its efficiency has as compression at a pressure rise [1]; both in Pa."""
        return -math.expm1(-pressure / bulk_modulus) if self.compression == "in efficiency" else 0.0

    @property
    def orifice_conductance(self) -> float:
        """Q/sqrt(dp) of the leakage by wear, all chambers and blocks [m3/s/sqrt(Pa)]."""
        return self.orifice_leakage * self.chambers * self.blocks / math.sqrt(self.nominal_pressure)

    @property
    def filling_conductance(self) -> float:
        """Flow over the root of the inlet's pressure up to which it fills, 0 without a limit [m3/s/sqrt(Pa)]."""
        if not self.min_inlet_pressure:
            return 0.0
        return self.displacement_per_rad * self.max_speed / math.sqrt(self.min_inlet_pressure)

    @property
    def displacement_per_rad(self) -> float:
        """Displacement D of all chambers and blocks, per pump radian [m3/rad]."""
        return self.displacement * self.chambers * self.blocks

    @property
    def geared_displacement(self) -> float:
        """Displacement per motor radian, D times belt [m3/rad]."""
        return self.displacement_per_rad * self.belt

    @property
    def total_no_load_torque(self) -> float:
        """No-load torque tau0 of all blocks, at the pump shaft [N m]."""
        return self.no_load_torque * self.blocks


class Drive(Part):
    """Electric motor that turns both pumps."""

    family: ClassVar[str] = "drive"

    model: Model = None
    moment_of_inertia: Annotated[
        float,
        quantity("kg m2", "moment of inertia at the motor shaft, belt and pumps included", least="1e-8 kg m2", most=10),
    ]
    max_speed: Annotated[float, quantity("rpm", "highest motor speed", least=1, most=30000)]
    max_torque: Annotated[float, quantity("N m", "highest motor torque", least=0.001, most=10000)]
    control: Annotated[
        Literal["ideal", "servo"], Field(description="speed as commanded, or a PI speed loop limited by max_torque")
    ] = "ideal"
    proportional_gain: Annotated[
        float, quantity("N m s/rad", "of the speed loop, torque per speed", least="1e-6 N m s/rad", most=10000)
    ] = 0.8
    integral_gain: Annotated[
        float, quantity("N m/rad", "of the speed loop, torque per angle", least=0, most="1e6 N m/rad")
    ] = 16.0
    drive_efficiency: Annotated[
        float, quantity("1", "of motor and inverter together, for energy figures", above=0.1, most=1)
    ] = 0.9
    battery_efficiency: Annotated[
        float, quantity("1", "of the battery, each way, for energy figures", above=0.1, most=1)
    ] = 0.95
