"""The description of a pump and of the motor that turns it."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from ramsight.machine.base import Part
from ramsight.machine.declare import Model, count, gearing, quantity
from ramsight.machine.efficiencies import read_efficiencies


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
