"""What is around the hydraulics of a test bench: motor, its controller, battery, instruments. No equation uses them.

They stand in the catalogue so that a bench is known by its parts, and so that what an instrument can tell is a number.
"""

from __future__ import annotations

from typing import Annotated, ClassVar

from ramsight.machine.base import Part
from ramsight.machine.declare import quantity


class Motor(Part):
    """Electric motor."""

    family: ClassVar[str] = "motor"

    rated_torque: Annotated[
        float, quantity("N m", "torque that it gives for ever", least="0.001 N m", most="10000 N m")
    ]
    peak_torque: Annotated[
        float, quantity("N m", "torque that it gives for seconds", least="0.001 N m", most="20000 N m")
    ]
    max_speed: Annotated[float, quantity("rpm", "highest speed", least="1 rpm", most="30000 rpm")]
    moment_of_inertia: Annotated[
        float, quantity("kg m2", "of the rotor alone", least="1e-8 kg m2", most="100 kg m2")
    ]  # fmt: skip


class MotorController(Part):
    """Controller of a motor, as its bus tells speed and torque."""

    family: ClassVar[str] = "motor controller"

    speed_step: Annotated[float, quantity("rpm", "step of the reported speed", least="1e-6 rpm", most="100 rpm")]
    torque_step: Annotated[float, quantity("N m", "step of the reported torque", least="1e-6 N m", most="100 N m")]
    torque_accuracy: Annotated[
        float, quantity("%", "of the reported torque, over the motor's rated one", least="0.0001 %", most="50 %")
    ]
    period: Annotated[float, quantity("ms", "between two reports", least="0.01 ms", most="10 s")]


class Battery(Part):
    """Battery; several modules in series are one."""

    family: ClassVar[str] = "battery"

    voltage: Annotated[float, quantity("V", "nominal voltage", least="0.1 V", most="2000 V")]
    capacity: Annotated[float, quantity("A h", "nominal capacity", least="0.001 A h", most="10000 A h")]


class PressureSensor(Part):
    """Pressure sensor."""

    family: ClassVar[str] = "pressure sensor"

    span: Annotated[float, quantity("bar", "measuring range", least="0.001 bar", most="10000 bar")]
    accuracy: Annotated[float, quantity("%", "of the span, either way", least="0.0001 %", most="20 %")]


class Thermometer(Part):
    """Temperature sensor."""

    family: ClassVar[str] = "temperature sensor"

    accuracy: Annotated[float, quantity("delta_K", "either way", least="0.0001 K", most="50 K")]


class PositionSensor(Part):
    """Sensor of a length."""

    family: ClassVar[str] = "position sensor"

    span: Annotated[float, quantity("mm", "measuring length", least="1 mm", most="100 m")]
    accuracy: Annotated[float, quantity("%", "of the span, either way", least="0.0001 %", most="20 %")]
    step: Annotated[float, quantity("mm", "step of the reported length", least="1e-6 mm", most="100 mm")]


ELECTRICS: tuple[type[Part], ...] = (Motor, MotorController, Battery, PressureSensor, Thermometer, PositionSensor)
"""Every kind of part of this module."""
