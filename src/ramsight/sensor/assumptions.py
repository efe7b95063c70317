"""What a sensor assumes of a drive, a thermometer and a machine: standard deviations and rates, in one place.

None of it is fitted to a machine. A value is a property of usual drives, of the data sheets of usual parts, or a
probability; its source stands beside it. `make study` prints what each of them is worth.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Drive:
    """What the drive's report is like.

    Args:
        torque: standard deviation of the reported torque over the torque at relief pressure, noise and steps [1].
        torque_gain: of its gain; 3 % is what data sheets of drives say, 1 % is what is left once references have
            taught the leakage that belongs to it [1].
        delay: by which speed, torque and valves may be apart [s]; filters of drives take 10 ... 40 ms.
        correlation: time for which an error of the torque, as large as its gain's, stays what it is [s].
    """

    torque: float = 0.007
    torque_gain: float = 0.01
    delay: float = 0.02
    correlation: float = 5.0


@dataclass(frozen=True)
class Machine:
    """How far a machine may be from its description, and how that changes.

    Args:
        leak, displacement, compliance: standard deviations of the factors of a new machine [1].
        leak_exponent: of the exponent by which leakage grows less with pressure than described; orifices have 0.5 [1].
        other_leak, other_exponent: of leakage and its exponent of a machine that leaks otherwise than believed, by a
            law that the description does not have [1].
        leaks_otherwise: probability of that as long as no reference has taught the leakage [1].
        leak_walk, displacement_walk, compliance_walk: how these change in time [1/sqrt(s)].
        leak_by_viscosity: how much leakage may change with the logarithm of the viscosity, as the root of a sum of
            squares: the oil in the gaps is not the oil at the thermometer [1].
        load_walk: how a load changes while the piston moves, over the load at relief pressure [1/sqrt(s)].
        unseen_load: by how much a load may change at rest, where nothing shows it, over the same [1].
        walk: of the position over the way it goes [m/sqrt(m)]: steps and delays of the reported speed.
        relief: standard deviation of the relief valves' settings over them, with the torque's gain in it [1].
    """

    leak: float = 0.16
    displacement: float = 0.003
    compliance: float = 0.25
    leak_exponent: float = 0.03
    other_leak: float = 0.6
    other_exponent: float = 0.15
    leaks_otherwise: float = 0.1
    leak_walk: float = 1.5e-4
    displacement_walk: float = 1e-6
    compliance_walk: float = 1e-4
    leak_by_viscosity: float = 0.3
    load_walk: float = 0.015
    unseen_load: float = 0.25
    walk: float = 0.2e-3
    relief: float = 0.03


@dataclass(frozen=True)
class Thermometer:
    """Where the oil's temperature comes from.

    Args:
        lag: mean by which it is behind the oil in the pumps' gaps; it sits in the tank [s].
        lag_std: standard deviation of that [s].
    """

    lag: float = 30.0
    lag_std: float = 40.0


@dataclass(frozen=True)
class Stops:
    """End stops and other contacts.

    Args:
        std: standard deviation of a declared stop's place over the stroke [1].
        contact: of a single contact with it, over the stroke [1].
        elsewhere: of the place of a stop that is not where the description says, over the stroke [1].
        undeclared: probability that a machine has such a stop, for each end [1].
        obstacle: probability that a contact is with neither [1].
        lies: probability that a switch, or a position given by hand, is wrong [1].
        wrong: probability that the position is not what was believed, before any contact [1].
        reference: standard deviation of a switch or of a position given by hand [m].
    """

    std: float = 3e-4
    contact: float = 3e-4
    elsewhere: float = 0.1
    undeclared: float = 0.1
    obstacle: float = 0.2
    lies: float = 0.05
    wrong: float = 1e-3
    reference: float = 1e-3


@dataclass(frozen=True)
class Assumptions:
    """All of them together."""

    drive: Drive = Drive()
    machine: Machine = Machine()
    thermometer: Thermometer = Thermometer()
    stops: Stops = Stops()
