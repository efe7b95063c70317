"""The parts of a direct-driven hydraulic unit: what each is described by, in SI once read."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from ramsight.machine.declare import Part, count, gearing, quantity, refuse
from ramsight.machine.efficiencies import read_efficiencies

Model = Annotated[str | None, Field(description="name of a catalogue entry that gives what is not given here")]


class Oil(Part):
    """Hydraulic oil."""

    family: ClassVar[str] = "oil"

    model: Model = None
    viscosity_40c: Annotated[
        float, quantity("mm2/s", "kinematic viscosity at 40 °C", above="1 mm2/s", most="1000 mm2/s")
    ]
    viscosity_100c: Annotated[
        float, quantity("mm2/s", "kinematic viscosity at 100 °C", above="0.5 mm2/s", most="200 mm2/s")
    ]
    density: Annotated[
        float,
        quantity("kg/m3", "density at 15 °C", least="500 kg/m3", most="2000 kg/m3"),
    ]
    bulk_modulus: Annotated[float, quantity("GPa", "bulk modulus of the oil itself", least="0.05 GPa", most="5 GPa")]
    min_temperature: Annotated[
        float,
        quantity("degC", "lowest temperature the data hold for", least="-60 degC", most="40 degC"),
    ]
    max_temperature: Annotated[
        float,
        quantity("degC", "highest temperature the data hold for", least="40 degC", most="200 degC"),
    ]
    thermal_expansion: Annotated[
        float,
        quantity("1/K", "loss of density per kelvin, 0 for none; mineral oil 7e-4", least="0 1/K", most="0.01 1/K"),
    ] = 0.0
    free_air: Annotated[
        float, quantity("%", "free air at atmospheric pressure, by volume of oil; 0 for none", least="0 %", most="20 %")
    ] = 0.0
    air_exponent: Annotated[
        float, quantity("1", "polytropic exponent of that air, 1 slow, 1.4 fast", least="1", most="1.67")
    ] = 1.4
    pressure_viscosity: Annotated[
        float,
        quantity("1/Pa", "a of viscosity ~ exp(a p), acts on leakage; 0 for none", least="0 1/Pa", most="1e-7 1/Pa"),
    ] = 0.0

    @model_validator(mode="after")
    def _thins_with_heat(self) -> Self:
        if self.viscosity_100c >= self.viscosity_40c:
            raise refuse(
                "viscosity_100c",
                f"{self.viscosity_100c * 1e6:g} mm2/s",
                "an oil is thinner at 100 °C than at 40 °C",
                f"below {self.viscosity_40c * 1e6:g} mm2/s",
            )
        return self


class Cylinder(Part):
    """Cylinders of the unit: `number` equal ones that move together; A is the piston side, B the rod side."""

    number: Annotated[int, count("cylinders that move together", least=1, most=16)]
    bore: Annotated[float, quantity("mm", "inner diameter of the barrel", above="0 mm", most="1 m")]
    rod: Annotated[float, quantity("mm", "diameter of the rod, smaller than the bore", above="0 mm", below="1 m")]
    stroke: Annotated[float, quantity("mm", "travel from end to end", above="0 mm", most="20 m")]
    dead_volume_a: Annotated[
        float,
        quantity("l", "oil in the A chambers, fully retracted, all cylinders together", above="0 l", most="100 l"),
    ]
    dead_volume_b: Annotated[
        float,
        quantity("l", "oil in the B chambers, fully extended, all cylinders together", above="0 l", most="100 l"),
    ]
    breakaway_friction: Annotated[
        float, quantity("kN", "force that starts a motion, per cylinder", least="0 kN", most="1000 kN")
    ]
    coulomb_friction: Annotated[
        float, quantity("kN", "friction of slow motion, per cylinder", least="0 kN", most="1000 kN")
    ]
    viscous_friction: Annotated[
        float,
        quantity(
            "kN/(m/s)",
            "friction added per velocity, per cylinder",
            least="0 kN/(m/s)",
            most="10000 kN/(m/s)",
        ),
    ]
    stribeck_velocity: Annotated[
        float,
        quantity("mm/s", "velocity over which breakaway fades to Coulomb friction", above="0 mm/s", most="1 m/s"),
    ] = 5e-3
    end_stop_stiffness: Annotated[
        float,
        quantity("kN/mm", "stiffness of an end stop, per cylinder", least="1 kN/mm", most="100000 kN/mm"),
    ] = 2.5e8
    end_stop_damping: Annotated[
        float,
        quantity("kN/(m/s)", "damping of an end stop, per cylinder", least="0 kN/(m/s)", most="1e6 kN/(m/s)"),
    ] = 5e5
    rod_a: Annotated[
        float, quantity("mm", "diameter of a second rod, through the A side; 0 for none", least="0 mm", below="1 m")
    ] = 0.0
    seal_leakage: Annotated[
        float,
        quantity(
            "l/min", "past the seals at 100 bar, 46 mm2/s, per cylinder; 0 for none", least="0 l/min", most="100 l/min"
        ),
    ] = 0.0

    @model_validator(mode="after")
    def _holds_together(self) -> Self:
        for key, rod, least in (("rod", self.rod, "above 0 mm"), ("rod_a", self.rod_a, "at least 0 mm")):
            if rod >= self.bore:
                raise refuse(
                    key,
                    f"{rod * 1e3:g} mm",
                    "the rod does not fit into the bore",
                    f"{least}, below {self.bore * 1e3:g} mm",
                )
        if self.breakaway_friction < self.coulomb_friction:
            raise refuse(
                "breakaway_friction",
                f"{self.breakaway_friction / 1e3:g} kN",
                "is below the Coulomb friction",
                f"at least {self.coulomb_friction / 1e3:g} kN",
            )
        return self

    @property
    def area_a(self) -> float:
        """Piston area on the A side, less a second rod's, all cylinders together [m2]."""
        return self.number * math.pi / 4 * (self.bore**2 - self.rod_a**2)

    @property
    def area_b(self) -> float:
        """Annulus area on the B (rod) side, all cylinders together [m2]."""
        return self.number * math.pi / 4 * (self.bore**2 - self.rod**2)


class Pump(Part):
    """Pump-motor with its belt: `blocks` parallel units of `chambers` chambers each."""

    family: ClassVar[str] = "pump"

    model: Model = None
    chambers: Annotated[int, count("chambers in a block", least=1, most=16)] = 1
    blocks: Annotated[int, count("parallel units", least=1, most=16)] = 1
    belt: Annotated[float, gearing("pump speed over motor speed, as a number or as teeth", above="0.01", most="100")]
    displacement: Annotated[
        float,
        quantity("cm3/rev", "displacement of one chamber", above="0 cm3/rev", most="5000 cm3/rev"),
    ]
    volumetric_efficiency: Annotated[
        float, quantity("1", "volumetric efficiency at the nominal point", above="0.5", most="1")
    ]
    hydromechanical_efficiency: Annotated[
        float, quantity("1", "hydro-mechanical efficiency at the nominal point", above="0.5", most="1")
    ]
    nominal_speed: Annotated[float, quantity("rpm", "pump speed of the nominal point", least="1 rpm", most="20000 rpm")]
    nominal_pressure: Annotated[
        float, quantity("bar", "pressure difference of the nominal point", least="1 bar", most="1000 bar")
    ]
    nominal_viscosity: Annotated[
        float,
        quantity("mm2/s", "kinematic viscosity of the nominal point", above="1 mm2/s", most="1000 mm2/s"),
    ]
    nominal_density: Annotated[
        float,
        quantity("kg/m3", "oil density of the nominal point", least="500 kg/m3", most="2000 kg/m3"),
    ]
    no_load_torque: Annotated[
        float, quantity("N m", "friction torque without pressure, per block", least="0 N m", most="1000 N m")
    ]
    max_speed: Annotated[float, quantity("rpm", "highest pump speed allowed", least="1 rpm", most="20000 rpm")]
    max_pressure: Annotated[float, quantity("bar", "highest continuous pressure", least="1 bar", most="1000 bar")]
    orifice_leakage: Annotated[
        float,
        quantity(
            "l/min", "by wear, at nominal_pressure, grows with its root, per chamber", least="0 l/min", most="100 l/min"
        ),
    ] = 0.0
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

    @model_validator(mode="after")
    def _table_is_a_grid(self) -> Self:
        if self.losses == "table":
            read_efficiencies(self.efficiency_table)
        return self

    @property
    def orifice_conductance(self) -> float:
        """Q/sqrt(dp) of the leakage by wear, all chambers and blocks [m3/s/sqrt(Pa)]."""
        return self.orifice_leakage * self.chambers * self.blocks / math.sqrt(self.nominal_pressure)

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
        quantity(
            "kg m2",
            "moment of inertia at the motor shaft, belt and pumps included",
            above="0 kg m2",
            most="10 kg m2",
        ),
    ]
    max_speed: Annotated[float, quantity("rpm", "highest motor speed", least="1 rpm", most="30000 rpm")]
    max_torque: Annotated[float, quantity("N m", "highest motor torque", above="0 N m", most="10000 N m")]
    control: Annotated[
        Literal["ideal", "servo"], Field(description="speed as commanded, or a PI speed loop limited by max_torque")
    ] = "ideal"
    proportional_gain: Annotated[
        float,
        quantity("N m s/rad", "of the speed loop, torque per speed", above="0 N m s/rad", most="10000 N m s/rad"),
    ] = 0.8
    integral_gain: Annotated[
        float, quantity("N m/rad", "of the speed loop, torque per angle", least="0 N m/rad", most="1e6 N m/rad")
    ] = 16.0
    drive_efficiency: Annotated[
        float, quantity("1", "of motor and inverter together, for energy figures", above="0.1", most="1")
    ] = 0.9
    battery_efficiency: Annotated[
        float, quantity("1", "of the battery, each way, for energy figures", above="0.1", most="1")
    ] = 0.95


class Manifold(Part):
    """Block that carries pump and valves, one side alike the other."""

    volume: Annotated[float, quantity("l", "oil in the manifold, per side", above="0 l", most="100 l")]


class Hose(Part):
    """Hose between manifold and cylinders, one side alike the other."""

    volume: Annotated[float, quantity("l", "oil in the hose, per side", above="0 l", most="1000 l")]
    length: Annotated[float, quantity("m", "length, for the resistance", above="0 m", most="100 m")]
    diameter: Annotated[float, quantity("mm", "inner diameter, for the resistance", above="1 mm", most="200 mm")]
    effective_bulk_modulus: Annotated[
        float,
        quantity("GPa", "bulk modulus of oil and hose wall together", least="0.01 GPa", most="5 GPa"),
    ]
    regime: Annotated[
        Literal["laminar", "turbulent"], Field(description="laminar whatever the speed, or turning turbulent")
    ] = "laminar"
    segments: Annotated[int, count("segments whose oil has inertia; 0 leaves it out", least=0, most=50)] = 0


class Tank(Part):
    """Tank; in a closed circuit the pressure that it is charged to at rest."""

    pressure: Annotated[float, quantity("bar", "absolute pressure", above="0 bar", most="50 bar")]


class ReliefValve(Part):
    """Relief valves, one per side, from manifold to tank."""

    family: ClassVar[str] = "relief valve"

    model: Model = None
    setting: Annotated[float, quantity("bar", "opening pressure above the tank's", least="1 bar", most="1000 bar")]
    rated_flow: Annotated[
        float,
        quantity("l/min", "flow at which override_pressure is given", above="0 l/min", most="10000 l/min"),
    ]
    override_pressure: Annotated[
        float, quantity("bar", "rise above the setting at rated_flow", above="0 bar", most="200 bar")
    ]


class AnticavitationValve(Part):
    """Check valves, one per side, from tank to manifold."""

    family: ClassVar[str] = "anticavitation valve"

    model: Model = None
    cracking_pressure: Annotated[
        float, quantity("bar", "pressure difference at which it opens", least="0 bar", most="20 bar")
    ]
    rated_flow: Annotated[
        float,
        quantity("l/min", "flow at which rated_pressure_drop is given", above="0 l/min", most="10000 l/min"),
    ]
    rated_pressure_drop: Annotated[
        float, quantity("bar", "pressure drop of the open valve at rated_flow", above="0 bar", most="100 bar")
    ]

    @property
    def flow_coefficient(self) -> float:
        """Q/sqrt(dp) of the open valve [m3/s/sqrt(Pa)]."""
        return self.rated_flow / math.sqrt(self.rated_pressure_drop)


class SafetyValve(Part):
    """Safety valves between manifold and hose; the load side's is a check while lifting, open to lower."""

    family: ClassVar[str] = "safety valve"

    model: Model = None
    rated_flow: Annotated[
        float,
        quantity("l/min", "flow at which rated_pressure_drop is given", above="0 l/min", most="10000 l/min"),
    ]
    rated_pressure_drop: Annotated[
        float, quantity("bar", "pressure drop of the open valve at rated_flow", above="0 bar", most="100 bar")
    ]
    opening_speed: Annotated[
        float,
        quantity(
            "rad/s",
            "motor speed in the lowering direction above which it is held open",
            above="0 rad/s",
            most="100 rad/s",
        ),
    ]
    opening_time: Annotated[
        float, quantity("ms", "until it is 95 % open or shut, first order; 0 for at once", least="0 ms", most="10 s")
    ] = 0.0

    @property
    def flow_coefficient(self) -> float:
        """Q/sqrt(dp) of the open valve [m3/s/sqrt(Pa)]."""
        return self.rated_flow / math.sqrt(self.rated_pressure_drop)


class Load(Part):
    """What the cylinders move."""

    mass: Annotated[float, quantity("kg", "mass that moves with the rods", above="0 kg", most="1e6 kg")]
    loads: Annotated[
        dict[str, Annotated[float, quantity("kN", "named load, at the rods", least="0 kN", most="1e5 kN")]],
        Field(description="named loads for tables and duty cycles", default_factory=dict),
    ]


#: the classes of parts that the catalogue lists, by kind
PARTS: dict[str, type[Part]] = {
    part.family: part for part in (Oil, Pump, ReliefValve, AnticavitationValve, SafetyValve)
}
