"""What the stages of the self-calibrating sensor hand on to each other within a sample."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ramsight.plant.balance import Balance
from ramsight.plant.limits import Limits
from ramsight.plant.oil import T40
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.case_heat import CaseHeat
from ramsight.sensor.contact import Contact, ContactWatch
from ramsight.sensor.drive_check import DriveChecks
from ramsight.sensor.hypotheses import Hypotheses, Measured
from ramsight.sensor.intake import Intake
from ramsight.sensor.judgement import Relief
from ramsight.sensor.leaking import Leaking
from ramsight.sensor.link_angle import LinkAngle
from ramsight.sensor.load import LoadObserver, LoadStep
from ramsight.sensor.virtual_sensor import SensorGraph


@dataclass(frozen=True)
class Parts:
    """What the sensor consists of, with the sample checked.

    Attributes:
        unit: the unit.
        assumed: what is assumed of it.
        graph: of the sensor.
        circuit: the unit's balance.
        limits: of the unit.
        intake: what of the sample can be.
        case: the pumps' cases as a heat store, where the unit's heat is described.
        checks: what the drive's reports say of each other.
        observer: of the load.
        leaking: how leakage follows temperature and pressure.
        watch: for contacts.
        link: the link's angle, where it is measured.
        bank: the hypotheses of machine and ends.
        referenced: whether the position was known before the sample.
        viscosity: of the oil, over its temperature [m2/s].
    """

    unit: HydraulicUnit
    assumed: Assumptions
    graph: SensorGraph
    circuit: Balance
    limits: Limits
    intake: Intake
    case: CaseHeat | None
    checks: DriveChecks
    observer: LoadObserver
    leaking: Leaking
    watch: ContactWatch
    link: LinkAngle | None
    bank: Hypotheses
    referenced: Any
    viscosity: Callable[[Any], Any]

    def symbol(self, name: str) -> Any:
        """A parameter of the sensor."""
        return self.graph.parameters.symbol(name)

    def of_circuit(self, name: str) -> Any:
        """A parameter of the circuit."""
        return self.symbol(f"circuit.{name}")

    @property
    def thinner(self) -> Any:
        """Viscosity at 40 degC over that of the oil [1]."""
        return self.viscosity(T40) / self.viscosity(self.graph.pump_temperature)


@dataclass(frozen=True)
class Stepped:
    """The balance's step.

    Attributes:
        step: what the load observer says.
        checks: of the drive's reports, pressures among them.
        around: factors, lag and exponent that the step was made with.
        travel_by, torque_by: derivatives of travel and torque with respect to those.
        warming: of the oil [K/s].
    """

    step: LoadStep
    checks: DriveChecks
    around: list[Any]
    travel_by: list[Any]
    torque_by: list[Any]
    warming: Any


@dataclass(frozen=True)
class Met:
    """What the piston may have met.

    Attributes:
        contact: that was found.
        nominal: position after the step, without it [m].
        relief: what passed a relief valve until this sample.
        usual: change of a load at rest that is usual [N].
    """

    contact: Contact
    nominal: Any
    relief: Relief
    usual: Any


@dataclass(frozen=True)
class Updated:
    """What is known after the sample.

    Attributes:
        position: [m].
        known: whether it is.
        measured: what a reference or a contact did.
        after: factors, lag and exponent.
        variance: of the position, over all hypotheses [m2].
        pending: how uncertain it is by oil that may have passed a relief valve, until a contact tells [m].
        relief: what passed a relief valve.
        disputed: whether a reference was refused.
        fault_passed: whether inputs have contradicted each other since the last reference.
    """

    position: Any
    known: Any
    measured: Measured
    after: list[Any]
    variance: Any
    pending: Any
    relief: Relief
    disputed: Any
    fault_passed: Any
