"""What parts are described by, in SI once read: oil, lines, cylinder, tank and load here, the others beside."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from ramsight.machine.base import Part
from ramsight.machine.declare import Model, count, quantity, refuse
from ramsight.machine.pump_description import Drive, Pump

#: what passes a closed valve: of data sheets of poppets 5 drops a minute, 0.3 ml/min; of a worn one 2 to 10 ml/min
ClosedLeakage = Annotated[
    float, quantity("ml/min", "past the closed valve at 250 bar, 46 mm2/s; 0 for none", least=0, most=10000)
]
RatedFlow = Annotated[float, quantity("l/min", "flow at which rated_pressure_drop is stated", least=0.001, most=10000)]
OpenDrop = Annotated[float, quantity("bar", "pressure drop of the open valve at rated_flow", least=0.001, most=100)]


class ReliefValve(Part):
    """Relief valves, one per side, from manifold to tank."""

    family: ClassVar[str] = "relief valve"

    model: Model = None
    setting: Annotated[float, quantity("bar", "opening pressure above the tank's", least=1, most=1000)]
    rated_flow: Annotated[
        float, quantity("l/min", "flow at which override_pressure is stated", least=0.001, most=10000)
    ]
    override_pressure: Annotated[float, quantity("bar", "rise above the setting at rated_flow", least=0.001, most=200)]
    closed_leakage: ClosedLeakage = 0.0
    pilot_leakage: Annotated[
        float, quantity("l/min", "of the pilot at the setting and beyond; 0 for none", least=0, most=100)
    ] = 0.0
    # Where the pilot's cone begins to leave its seat; direct acting valves have none.
    pilot_opens: Annotated[
        float, quantity("%", "share of the setting from which the pilot leaks", above=10, below=100)
    ] = 0.85
    reseats: Annotated[
        float, quantity("%", "share of the setting where it shuts again; 100 % for none", above=10, most=100)
    ] = 1.0


class AnticavitationValve(Part):
    """Check valves, one per side, from tank to manifold."""

    family: ClassVar[str] = "anticavitation valve"

    model: Model = None
    cracking_pressure: Annotated[float, quantity("bar", "pressure difference at which it opens", least=0, most=20)]
    rated_flow: RatedFlow
    rated_pressure_drop: OpenDrop
    closed_leakage: ClosedLeakage = 0.0

    @property
    def flow_coefficient(self) -> float:
        """Q/sqrt(dp) of the open valve [m3/s/sqrt(Pa)]."""
        return self.rated_flow / math.sqrt(self.rated_pressure_drop)


class SafetyValve(Part):
    """Safety valves between manifold and hose; the load side's is a check while lifting, open to lower."""

    family: ClassVar[str] = "safety valve"

    model: Model = None
    rated_flow: RatedFlow
    rated_pressure_drop: OpenDrop
    opening_speed: Annotated[
        float,
        quantity("rad/s", "motor speed in the lowering direction above which it is held open", least=0.001, most=100),
    ]
    opening_time: Annotated[
        float, quantity("ms", "until it is 95 % open or shut, first order; 0 for at once", least=0, most="10 s")
    ] = 0.0
    closed_leakage: ClosedLeakage = 0.0

    @property
    def flow_coefficient(self) -> float:
        """Q/sqrt(dp) of the open valve [m3/s/sqrt(Pa)]."""
        return self.rated_flow / math.sqrt(self.rated_pressure_drop)


class Manifold(Part):
    """Block that carries pump and valves, one side alike the other."""

    volume: Annotated[float, quantity("l", "oil in the manifold, per side", least="1e-4 l", most=100)]


class Hose(Part):
    """Hose between manifold and cylinders, one side alike the other."""

    volume: Annotated[float, quantity("l", "oil in the hose, per side", least="1e-4 l", most=1000)]
    length: Annotated[float, quantity("m", "length, for the resistance", least=0.001, most=100)]
    diameter: Annotated[float, quantity("mm", "inner diameter, for the resistance", above=1, most=200)]
    effective_bulk_modulus: Annotated[
        float, quantity("GPa", "bulk modulus of oil and hose wall together", least=0.001, most=5)
    ]
    stiffening: Annotated[
        float, quantity("1", "rise of that modulus per pressure above the atmosphere's; 0 for none", least=0, most=50)
    ] = 0.0
    regime: Annotated[
        Literal["laminar", "turbulent"], Field(description="laminar whatever the speed, or turning turbulent")
    ] = "laminar"
    segments: Annotated[int, count("segments whose oil has inertia; 0 leaves it out", least=0, most=50)] = 0


__all__ = [
    "PARTS", "AnticavitationValve", "Cylinder", "Drive", "Hose", "Load", "Manifold", "Oil", "Part", "Pump",
    "ReliefValve", "SafetyValve", "Tank",
]  # fmt: skip


class Oil(Part):
    """Hydraulic oil."""

    family: ClassVar[str] = "oil"

    model: Model = None
    viscosity_40c: Annotated[float, quantity("mm2/s", "kinematic viscosity at 40 °C", above=1, most=1000)]
    viscosity_100c: Annotated[float, quantity("mm2/s", "kinematic viscosity at 100 °C", above=0.5, most=200)]
    density: Annotated[float, quantity("kg/m3", "density at 15 °C", least=500, most=2000)]
    bulk_modulus: Annotated[float, quantity("GPa", "bulk modulus of the oil itself", least=0.05, most=5)]
    min_temperature: Annotated[float, quantity("degC", "lowest temperature the data hold for", least=-60, most=40)]
    max_temperature: Annotated[float, quantity("degC", "highest temperature the data hold for", least=40, most=200)]
    thermal_expansion: Annotated[
        float, quantity("1/K", "loss of density per kelvin, 0 for none; mineral oil 7e-4", least=0, most=0.01)
    ] = 0.0
    free_air: Annotated[
        float, quantity("%", "free air at atmospheric pressure, by volume of oil; 0 for none", least=0, most=20)
    ] = 0.0
    air_exponent: Annotated[
        float, quantity("1", "polytropic exponent of that air, 1 slow, 1.4 fast", least=1, most=1.67)
    ] = 1.4
    pressure_viscosity: Annotated[
        float, quantity("1/Pa", "a of viscosity ~ exp(a p), acts on leakage; 0 for none", least=0, most="1e-7 1/Pa")
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
    bore: Annotated[float, quantity("mm", "inner diameter of the barrel", least=1, most="1 m")]
    rod: Annotated[float, quantity("mm", "diameter of the rod, smaller than the bore", least=1, below="1 m")]
    stroke: Annotated[float, quantity("mm", "travel from end to end", least=1, most="20 m")]
    dead_volume_a: Annotated[
        float, quantity("l", "oil in the A chambers, fully retracted, all cylinders together", least="1e-4 l", most=100)
    ]
    dead_volume_b: Annotated[
        float, quantity("l", "oil in the B chambers, fully extended, all cylinders together", least="1e-4 l", most=100)
    ]
    breakaway_friction: Annotated[float, quantity("kN", "force that starts a motion, per cylinder", least=0, most=1000)]
    coulomb_friction: Annotated[float, quantity("kN", "friction of slow motion, per cylinder", least=0, most=1000)]
    viscous_friction: Annotated[
        float, quantity("kN/(m/s)", "friction added per velocity, per cylinder", least=0, most=10000)
    ]
    pressure_friction: Annotated[
        float, quantity("%", "friction added, over the force of the pressures; 0 for none", least=0, most=20)
    ] = 0.0
    stribeck_velocity: Annotated[
        float, quantity("mm/s", "velocity over which breakaway fades to Coulomb friction", least=0.001, most="1 m/s")
    ] = 5e-3
    end_stop_stiffness: Annotated[
        float, quantity("kN/mm", "stiffness of an end stop, per cylinder", least=1, most=100000)
    ] = 2.5e8
    end_stop_damping: Annotated[
        float, quantity("kN/(m/s)", "damping of an end stop, per cylinder", least=0, most="1e6 kN/(m/s)")
    ] = 5e5
    rod_a: Annotated[
        float, quantity("mm", "diameter of a second rod, through the A side; 0 for none", least=0, below="1 m")
    ] = 0.0
    seal_leakage: Annotated[
        float, quantity("l/min", "past the seals at 100 bar, 46 mm2/s, per cylinder; 0 for none", least=0, most=100)
    ] = 0.0

    cushion_length_a: Annotated[
        float, quantity("mm", "end cushion of side A, before the rod is in; 0 for none", least=0, most=200)
    ] = 0.0
    cushion_length_b: Annotated[
        float, quantity("mm", "end cushion of side B, before the rod is out; 0 for none", least=0, most=200)
    ] = 0.0
    cushion_plunger_a: Annotated[float, quantity("mm", "diameter of side A's plunger", least=0, below="1 m")] = 0.0
    cushion_plunger_b: Annotated[
        float, quantity("mm", "diameter of side B's plunger, around the rod; 0 for the rod's", least=0, below="1 m")
    ] = 0.0
    cushion_flow: Annotated[
        float, quantity("l/min", "through a cushion's needle valve at 100 bar, per cylinder", least=0.001, most=1000)
    ] = 5e-5

    @model_validator(mode="after")
    def _holds_together(self) -> Self:
        for key, rod, least in (
            ("rod", self.rod, "at least 1 mm"),
            ("rod_a", self.rod_a, "at least 0 mm"),
            ("cushion_plunger_a", self.cushion_plunger_a, "at least 0 mm"),
            ("cushion_plunger_b", self.cushion_plunger_b, "at least 0 mm"),
        ):
            if rod >= self.bore:
                raise refuse(
                    key,
                    f"{rod * 1e3:g} mm",
                    f"the {'plunger' if 'plunger' in key else 'rod'} does not fit into the bore",
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

    @property
    def cushion_area_a(self) -> float:
        """Piston area around the plunger, or a second rod, of side A's cushion, all cylinders together [m2]."""
        return self.number * math.pi / 4 * (self.bore**2 - max(self.cushion_plunger_a, self.rod_a) ** 2)

    @property
    def cushion_area_b(self) -> float:
        """The same of side B [m2]."""
        return self.number * math.pi / 4 * (self.bore**2 - max(self.cushion_plunger_b, self.rod) ** 2)


class Tank(Part):
    """Tank; in a closed circuit the pressure that it is charged to at rest."""

    pressure: Annotated[float, quantity("bar", "absolute pressure", least=0.001, most=50)]


class Load(Part):
    """What the cylinders move."""

    mass: Annotated[float, quantity("kg", "mass that moves with the rods", least=0.001, most="1e6 kg")]
    kind: Annotated[
        Literal["force", "passive"],
        Field(description="a force that also moves the rods, as a weight does, or one that only resists their motion"),
    ] = "force"
    loads: Annotated[
        dict[str, Annotated[float, quantity("kN", "named load, at the rods", least=0, most="1e5 kN")]],
        Field(description="named loads for tables and duty cycles", default_factory=dict),
    ]


#: what a unit of some kW has where nobody says more: a tank of 20 l and 10 kg of steel [J/K], 0.3 m2 of cases and 1 m2
#: of tank at 10 and 15 W/m2/K [W/K]
TANK, CASE_TO_AIR, TANK_TO_AIR = 37e3, 3.0, 15.0


class Heat(Part):
    """Heat stores: the pumps' cases, which leakage and friction of the pumps warm, and the tank."""

    case: Annotated[float, quantity("kJ/K", "heat capacity of the pumps' cases with their oil", least=0.05, most=1000)]
    case_to_tank: Annotated[
        float, quantity("W/K", "from cases to tank, by the oil that passes the pumps", least=1, most="1e5 W/K")
    ]
    tank: Annotated[float, quantity("kJ/K", "heat capacity of the tank with its oil", least=0.1, most="1e5 kJ/K")] = (
        TANK
    )
    case_to_air: Annotated[float, quantity("W/K", "from the cases to the air", least=0, most="1e4 W/K")] = CASE_TO_AIR
    tank_to_air: Annotated[float, quantity("W/K", "from the tank to the air", least=0, most="1e5 W/K")] = TANK_TO_AIR


# Around the hydraulics of a bench: motor, controller, battery, instruments. No equation uses them. They stand in the
# catalogue so that a bench is known by its parts, and so that what an instrument can tell is a number.


class Motor(Part):
    """Electric motor."""

    family: ClassVar[str] = "motor"

    rated_torque: Annotated[float, quantity("N m", "torque that it gives for ever", least=0.001, most=10000)]
    peak_torque: Annotated[float, quantity("N m", "torque that it gives for seconds", least=0.001, most=20000)]
    max_speed: Annotated[float, quantity("rpm", "highest speed", least=1, most=30000)]
    moment_of_inertia: Annotated[
        float, quantity("kg m2", "of the rotor alone", least="1e-8 kg m2", most=100)
    ]  # fmt: skip


class MotorController(Part):
    """Controller of a motor, as its bus tells speed and torque."""

    family: ClassVar[str] = "motor controller"

    speed_step: Annotated[float, quantity("rpm", "step of the reported speed", least="1e-6 rpm", most=100)]
    torque_step: Annotated[float, quantity("N m", "step of the reported torque", least="1e-6 N m", most=100)]
    torque_accuracy: Annotated[
        float, quantity("%", "of the reported torque, over the motor's rated one", least=0.0001, most=50)
    ]
    period: Annotated[float, quantity("ms", "between two reports", least=0.01, most="10 s")]


class Battery(Part):
    """Battery; several modules in series are one."""

    family: ClassVar[str] = "battery"

    voltage: Annotated[float, quantity("V", "nominal voltage", least=0.1, most=2000)]
    capacity: Annotated[float, quantity("A h", "nominal capacity", least=0.001, most=10000)]


class PressureSensor(Part):
    """Pressure sensor."""

    family: ClassVar[str] = "pressure sensor"

    span: Annotated[float, quantity("bar", "measuring range", least=0.001, most=10000)]
    accuracy: Annotated[float, quantity("%", "of the span, either way", least=0.0001, most=20)]


class Thermometer(Part):
    """Temperature sensor."""

    family: ClassVar[str] = "temperature sensor"

    accuracy: Annotated[float, quantity("delta_K", "either way", least="0.0001 K", most="50 K")]


class PositionSensor(Part):
    """Sensor of a length."""

    family: ClassVar[str] = "position sensor"

    span: Annotated[float, quantity("mm", "measuring length", least=1, most="100 m")]
    accuracy: Annotated[float, quantity("%", "of the span, either way", least=0.0001, most=20)]
    step: Annotated[float, quantity("mm", "step of the reported length", least="1e-6 mm", most=100)]


ELECTRICS: tuple[type[Part], ...] = (Motor, MotorController, Battery, PressureSensor, Thermometer, PositionSensor)
"""Kinds of parts that no equation uses."""
_LISTED: tuple[type[Part], ...] = (Oil, Pump, ReliefValve, AnticavitationValve, SafetyValve, *ELECTRICS)
#: the classes of parts that the catalogue lists, by kind
PARTS: dict[str, type[Part]] = {part.family: part for part in _LISTED}
