"""What the load observer finds of a sample."""

from __future__ import annotations

from dataclasses import dataclass

from ramsight.expression import Condition, Real, Scalar, Vector


@dataclass(frozen=True)
class Motion:
    """How the piston moves.

    Attributes:
        travel: since the last sample [m].
        free_travel: what it would be had the load not changed [m].
        velocity: [m/s].
        noise: standard deviation of the position by the torque's noise [m].
        give: travel per load that the oil's compression allows [m/N].
        give_alone: the same where the other chamber has no pressure left [m/N].
        bounce: half a period of the mass on that oil [s].
        flies: how high a load that has been thrown up may fly beyond that [m]; 0 where none has.
    """

    travel: Scalar
    free_travel: Scalar
    velocity: Scalar
    noise: Scalar
    give: Scalar
    give_alone: Scalar
    bounce: Scalar
    flies: Real


@dataclass(frozen=True)
class TorqueStep:
    """How the torque compares with its expectation.

    Attributes:
        expected: after the correction [N m].
        change: of the expectation since the last sample [N m].
        innovation: torque less what was expected before the correction, beyond what friction hides [N m].
        missed: the same with all of it [N m].
        noise: standard deviation of the torque [N m].
        hidden: within which it shows nothing at standstill [N m]; 0 while the motor turns.
        shows: how much it shows of the load, 1 where virtual work holds, 0 where a valve carries it [1].
    """

    expected: Scalar
    change: Scalar
    innovation: Scalar
    missed: Scalar
    noise: Scalar
    hidden: Scalar
    shows: Scalar


@dataclass(frozen=True)
class LoadEstimate:
    """The load.

    Attributes:
        value: on the piston, its friction beside it [N].
        asked: that the torque asks for, be it possible or not [N].
        std: standard deviation [N].
        carried: load that the pressures carry [N].
        empty: whether the held chamber has no pressure left and the other one gives no force either.
        empty_share: how likely that is so for a moment, less than half a period of the mass on its oil, 0 to 1.
    """

    value: Scalar
    asked: Scalar
    std: Scalar
    carried: Scalar
    empty: Condition
    empty_share: Real


@dataclass(frozen=True)
class LoadStep:
    """What the load observer finds of a sample.

    Attributes:
        motion: of the piston.
        torque: of the motor.
        load: on the piston.
        z: states of the circuit.
        travel_by: derivatives of the travel with respect to the balance's factors [m].
        torque_by: of the torque that it shows of a piston that stands [N m].
        over_pressures: torque beyond what measured pressures ask of the pump, and its standard deviation by theirs
            [N m]; None where there are none.
        pump_heat: what leakage and friction of the pumps turn into heat [W]; None where no heat is described.
    """

    motion: Motion
    torque: TorqueStep
    load: LoadEstimate
    z: Vector
    travel_by: tuple[Scalar, ...]
    torque_by: tuple[Scalar, ...]
    over_pressures: tuple[Scalar, Scalar] | None
    pump_heat: Scalar | None
