"""What a sensor assumes of a machine, its drive and its thermometer, as a part of the description.

Standard deviations, probabilities and rates. No default is fitted to a machine: each is a property of usual drives, of
the data sheets of usual parts, or a probability. `make study` prints what each of them is worth. Who knows a machine
better states so; what is not said stays as it is here. The ranges are those within which the sensor's equations hold.
"""

from __future__ import annotations

import math
from types import MappingProxyType
from typing import Annotated

from pydantic import Field

from ramsight.machine.base import Part
from ramsight.machine.declare import quantity
from ramsight.units import RPM


class AssumedDrive(Part):
    """What the drive's report is like."""

    torque: Annotated[
        float, quantity("%", "noise and steps of the torque, over that at relief pressure, std", least=0.01, most=20)
    ] = 0.007
    # Data sheets of drives report 3 %; 1 % is what is left once references have taught the leakage that belongs to it.
    torque_gain: Annotated[float, quantity("%", "of the torque's gain, std", least=0, most=30)] = 0.01
    # Filters of drives take 10 ... 40 ms.
    delay: Annotated[float, quantity("ms", "by which speed, torque and valves may be apart", least=0.1, most="1 s")] = (
        0.02
    )
    correlation: Annotated[
        float, quantity("s", "for which an error as large as the torque's gain's stays what it is", least=0, most="1 h")
    ] = 5.0
    # A current's sensor that was not zeroed, or whose zero wanders with its temperature.
    zero: Annotated[
        float, quantity("N m", "of the torque reported without one, std; learned at rest", least=0, most="1 kN m")
    ] = 0.0
    zero_walk: Annotated[float, quantity("N m/sqrt(s)", "random walk of that zero", least=0, most=10)] = 0.0
    # Brushes, cogging, seals of the shaft, gears that do not turn back: what it takes to move a motor that has stood.
    standing: Annotated[
        float, quantity("N m", "torque that a slow motor may hold beside its pumps' friction", least=0, most="1 kN m")
    ] = 0.0
    # A drive that reports its command: under load a supply that sags leaves 5 to 10 % of it.
    slip: Annotated[
        float, quantity("%", "by which the shaft may turn less than reported, of the way, std", least=0, most=30)
    ] = 0.0
    # A drive that releases it within 0.2 s makes a decay of 60 ms faster by 30 %.
    release: Annotated[
        float, quantity("%", "of a torque's decay at standstill, by a drive that releases it, std", least=0, most=200)
    ] = 0.3


class AssumedMachine(Part):
    """How far the machine may be from its description, and how that changes."""

    leak: Annotated[float, quantity("%", "of a new machine's leakage, std", least=0.1, most=200)] = 0.16
    # 99 of 100 pumps, pairs of pumps and worn ones among them, are within ± 2 % of their data sheets. The sensor keeps
    # the factor itself within 3 %.
    displacement: Annotated[float, quantity("%", "of a new machine's displacement, std", least=0.01, most=3)] = 0.008
    compliance: Annotated[
        float, quantity("%", "of a new machine's compliance of oil and hoses, std", least=0.1, most=100)
    ] = 0.25
    # Of an orifice it is 0.5.
    leak_exponent: Annotated[
        float,
        quantity("1", "exponent by which leakage grows less with pressure than described, std", least=0, most=0.5),
    ] = 0.03
    other_leak: Annotated[
        float, quantity("%", "of the leakage of a machine that leaks otherwise, std", least=0.1, most=200)
    ] = 0.6
    other_exponent: Annotated[
        float, quantity("1", "of that exponent of a machine that leaks otherwise, std", least=0, most=0.5)
    ] = 0.15
    leaks_otherwise: Annotated[
        float, quantity("%", "chance of that, before the first reference", least=0.0001, most=90)
    ] = 0.1
    leak_walk: Annotated[float, quantity("%/sqrt(h)", "change of the leakage in time, std", least=0, most=100)] = 1e-3
    displacement_walk: Annotated[
        float, quantity("%/sqrt(h)", "change of the displacement in time, std", least=0, most=3)
    ] = 1e-6
    compliance_walk: Annotated[
        float, quantity("%/sqrt(h)", "change of the compliance in time, std", least=0, most=100)
    ] = 1e-4
    # The oil in the gaps is not the oil at the thermometer. The root of a sum of squares.
    leak_by_viscosity: Annotated[
        float, quantity("1", "change of the leakage over that of the viscosity's logarithm, std", least=0, most=3)
    ] = 0.3
    load_walk: Annotated[
        float, quantity("%/sqrt(s)", "change of a moving load over that at relief pressure, std", least=0.01, most=100)
    ] = 0.015
    unseen_load: Annotated[
        float, quantity("%", "change at rest, where nothing shows it, over the same, std", least=0.1, most=200)
    ] = 0.25
    # Worn poppets and checks let 2 to 10 ml/min pass at 250 bar, new ones 5 drops a minute.
    closed_leakage: Annotated[
        float, quantity("ml/min", "past closed valves at 250 bar, unknown, std", least=0, most=10000)
    ] = 5e-6 / 60.0
    # Oil in a cylinder is neither in the tank nor as warm, and a hose expands otherwise than steel.
    expansion: Annotated[
        float, quantity("%", "of oil's change of volume by temperature where it is shut in, std", least=0, most=300)
    ] = 0.3
    # Steps and delays of the reported speed.
    walk: Annotated[float, quantity("mm/sqrt(m)", "of the position over the way it goes, std", least=0, most=100)] = (
        0.2e-3
    )
    # Data sheets ask for 0.6 to 0.8 bar, 7 % of the flow either way; tank and strainer take as much again.
    filling: Annotated[float, quantity("%", "of what a pump that starves draws, std", least=0, most=100)] = 0.1
    # With the torque's gain in it.
    relief: Annotated[float, quantity("%", "of the relief valves' settings, std", least=0.1, most=30)] = 0.03


class AssumedThermometer(Part):
    """Where the oil's temperature comes from; usually the tank."""

    # Tanks of mobile machines hold what the pumps deliver in about a minute, and oil that is mixed is late by that.
    lag: Annotated[float, quantity("s", "by which it is behind the oil in the pumps, mean", least=0, most="1 h")] = 60.0
    lag_std: Annotated[float, quantity("s", "standard deviation of that", least=0, most="1 h")] = 40.0
    # Cases of working pumps are some kelvins warmer than their tank.
    offset: Annotated[
        float, quantity("K", "oil in the pumps over the reported, steady part, std; 0 unlearned", least=0, most=50)
    ] = 0.0


class AssumedPressure(Part):
    """Sensors of the chambers' pressures; a sensor takes them only where they are declared."""

    std: Annotated[float, quantity("bar", "noise of each, std; 0 where there are none", least=0, most=100)] = 0.0
    lag: Annotated[float, quantity("ms", "by which they are behind the oil, first order", least=0, most="1 s")] = 0.0


class AssumedShaft(Part):
    """The drive's counter of the shaft's position beside its speed; a sensor takes it only where it is declared."""

    std: Annotated[
        float, quantity("deg", "steps and errors of its angle, std; 0 where there is none", least=0, most=90)
    ] = 0.0
    # Drives report whole revolutions a minute.
    speed: Annotated[
        float, quantity("rpm", "by which the reported speed may be off all the time", least=0, most=100)
    ] = RPM


class AssumedPower(Part):
    """The drive's power from its DC link; a sensor takes it only where it is declared.

    What the motor and its inverter lose is P0 + (copper (torque/torque_r)^2 + iron speed/speed_r) torque_r speed_r,
    with the torque at relief pressure and the highest speed.
    """

    # Current sensors of inverters have 1 ... 2 % of their range.
    std: Annotated[
        float, quantity("%", "noise, over torque_r speed_r, std; 0 where there is none", least=0, most=20)
    ] = 0.0
    gain: Annotated[float, quantity("%", "of the reading and of the torque together, std", least=0.1, most=30)] = 0.02
    # Magnets that warm by 60 K within half an hour take 7 % of the torque.
    walk: Annotated[float, quantity("%/sqrt(h)", "change of that in time, std", least=0, most=100)] = 0.02 / 60.0
    standby: Annotated[float, quantity("W", "that the inverter takes at rest", least=0, most=10000)] = 50.0
    # Motors with permanent magnets and their inverters have 90 ... 93 % at their rating.
    copper: Annotated[float, quantity("%", "loss that goes with the torque squared", least=0, most=50)] = 0.05
    iron: Annotated[float, quantity("%", "loss that goes with the speed", least=0, most=50)] = 0.03
    losses: Annotated[float, quantity("%", "of those losses, std", least=1, most=100)] = 0.2


class AssumedMotorTemperature(Part):
    """The motor's temperature as its drive reports it; a sensor corrects the torque by it only where it is declared."""

    # 10 K between a sensor in the windings and the magnets, and a tenth of the coefficient at 60 K.
    std: Annotated[
        float, quantity("%", "of the torque's gain that is left, std; 0 where there is none", least=0, most=30)
    ] = 0.0
    # Neodymium magnets lose 0.09 to 0.12 % of their remanence a kelvin, ferrites 0.2 %.
    loss: Annotated[float, quantity("1/K", "of the torque's constant", least=0, most=0.01)] = 1.1e-3
    reference: Annotated[float, quantity("degC", "for which the drive knows that constant", least=-40, most=200)] = (
        298.15
    )


class AssumedInertia(Part):
    """Moment of inertia at the motor shaft; a sensor holds the torque of ramps against it only where it is declared."""

    # Of a motor by its data sheet 10 %, with belt and pumps that nobody has weighed a third.
    std: Annotated[float, quantity("%", "of its value, std; 0 where ramps are not looked at", least=0, most=100)] = 0.0


class AssumedStops(Part):
    """End stops, other contacts, switches and positions entered by hand."""

    # A frame, a rack or the ground may stop the machine before the cylinder's end does.
    retracted: Annotated[
        float, quantity("mm", "from the cylinder's retracted end to what stops it there", least=0, most="10 m")
    ] = 0.0
    extended: Annotated[
        float, quantity("mm", "from what stops it there to the cylinder's extended end", least=0, most="10 m")
    ] = 0.0
    std: Annotated[
        float, quantity("%", "of a stop's place as described, over the stroke, std", least=0.001, most=10)
    ] = 3e-4
    contact: Annotated[
        float, quantity("%", "of a single contact with it, over the stroke, std", least=0.001, most=10)
    ] = 3e-4
    elsewhere: Annotated[
        float, quantity("%", "of a stop that is elsewhere than described, over the stroke, std", least=1, most=100)
    ] = 0.1
    undeclared: Annotated[float, quantity("%", "chance of such a stop, for each end", least=0.0001, most=45)] = 0.1
    obstacle: Annotated[float, quantity("%", "chance that a contact is with neither stop", least=0.0001, most=90)] = (
        0.05
    )
    lies: Annotated[float, quantity("%", "chance that a switch is wrong", least=0.0001, most=90)] = 0.05
    # Somebody reads a scale, and not always the one of this cylinder.
    entered: Annotated[float, quantity("%", "chance that an entered position is wrong", least=0.0001, most=50)] = 0.01
    wrong: Annotated[
        float, quantity("%", "chance that an estimated position is wrong, before a contact", least=0.0001, most=50)
    ] = 1e-3
    reference: Annotated[
        float, quantity("mm", "of a switch or of a position entered by hand, std", least=0.01, most="1 m")
    ] = 1e-3


SURE_START = MappingProxyType({"stops.entered": 1e-6})
"""What is assumed of a position at the start that cannot be wrong, as in a simulation or beside a second sensor."""


class AssumedLinkAngle(Part):
    """Sensor of the angle of the body that the cylinder turns: an inclinometer on it, and one on what it hangs on.

    A sensor takes it only where it is declared. The defaults are of usual inclinometers on machines that shake.
    """

    std: Annotated[
        float, quantity("deg", "noise, vibration and acceleration, std; 0 where there is none", least=0, most=20)
    ] = 0.0
    # Data sheets of inclinometers for mobile machines: 0.1 ... 0.5 degrees over all; mounting and zero are in it.
    offset: Annotated[float, quantity("deg", "error that stays, std", least=0, most=20)] = math.radians(0.2)
    # Data sheets: 0.005 ... 0.02 degrees a kelvin, of a sensor that warms by some 10 K an hour.
    drift: Annotated[float, quantity("deg/sqrt(h)", "change of that in time, std", least=0, most=20)] = (
        math.radians(0.05) / 60.0
    )
    correlation: Annotated[
        float, quantity("s", "for which vibration and acceleration stay what they are", least="10 ms", most="1 min")
    ] = 0.5
    lag: Annotated[
        float, quantity("ms", "by which it is behind the body, mean; filters of inclinometers", least=0, most="5 s")
    ] = 0.0


class AssumedReading(Part):
    """An occasional reading of the position: a draw wire, a laser, a camera, a scale that somebody reads.

    A sensor takes it only where it is declared. It may come ten times a second or once an hour.
    """

    std: Annotated[float, quantity("mm", "of a reading's own error; 0 where there are none", least=0, most="10 m")] = (
        0.0
    )
    offset: Annotated[
        float, quantity("mm", "error that all readings share, mounting and zero, std", least=0, most="10 m")
    ] = 0.0
    correlation: Annotated[
        float, quantity("s", "for which a reading's own error stays what it is", least=0, most="1 h")
    ] = 0.1
    delay: Annotated[
        float, quantity("ms", "by which a reading is behind the piston, mean", least="0 s", most="10 s")
    ] = 0.0
    # A beam that something crosses, a target that is mistaken, a number that is mistyped.
    wrong: Annotated[float, quantity("%", "chance that a reading is of something else", least=0.0001, most=50)] = 0.01
    every: Annotated[
        float, quantity("s", "time between readings, where they are simulated", least="1 ms", most="1 d")
    ] = 60.0


class AssumedIntegrity(Part):
    """When a position is ok: it is certain enough, and a larger error than the limit is less likely than the risk.

    Where the unit states a requirement, what is left out here follows from that.
    """

    due: Annotated[
        float,
        quantity("%", "standard deviation, over the stroke, above which a reference is due", least=0.001, most=50),
    ] = 0.01
    limit: Annotated[float, quantity("%", "largest error that is accepted, over the stroke", least=0.01, most=50)] = (
        0.05
    )
    risk: Annotated[float, quantity("%", "chance of a larger one while the status is ok", least=0.0001, most=20)] = 1e-3


class Assumptions(Part):
    """What a sensor assumes, all of it together."""

    integrity: Annotated[AssumedIntegrity, Field(description="when a position is ok")] = AssumedIntegrity()

    drive: Annotated[AssumedDrive, Field(description="what the drive's report is like")] = AssumedDrive()
    machine: Annotated[AssumedMachine, Field(description="how far the machine may be from its description")] = (
        AssumedMachine()
    )
    thermometer: Annotated[AssumedThermometer, Field(description="where the oil's temperature comes from")] = (
        AssumedThermometer()
    )
    stops: Annotated[AssumedStops, Field(description="end stops, other contacts and references")] = AssumedStops()
    pressure: Annotated[AssumedPressure, Field(description="sensors of the chambers' pressures")] = AssumedPressure()
    shaft: Annotated[AssumedShaft, Field(description="the drive's counter of the shaft's position")] = AssumedShaft()
    power: Annotated[AssumedPower, Field(description="the drive's power from its DC link")] = AssumedPower()
    inertia: Annotated[AssumedInertia, Field(description="moment of inertia at the motor shaft")] = AssumedInertia()
    motor_temperature: Annotated[AssumedMotorTemperature, Field(description="the motor's temperature")] = (
        AssumedMotorTemperature()
    )
    link_angle: Annotated[AssumedLinkAngle, Field(description="sensor of the moved body's angle")] = AssumedLinkAngle()
    absolute_position: Annotated[AssumedReading, Field(description="an occasional absolute position")] = (
        AssumedReading()
    )
