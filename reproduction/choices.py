"""What the paper leaves open, as it is chosen for a run of the study: machine, ramps, loads, values of the machine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ramsight import DescriptionError, load_machine
from ramsight.duty.lift_lower import RAMP
from ramsight.machine.description import DirectDriven, Machine
from ramsight.plant.ddh import DdhUnit
from ramsight.plant.steady import derive

MACHINE = "mining-loader"
UNITS = ("boom", "bucket")
LOADS = {"light": 0.25, "medium": 0.5, "high": 0.75}
"""Names of the paper's loads, and the shares of the largest load that it calls them."""
READINGS = ("stated", "shares")
"""The two readings of the paper's loads: the forces that it states, or the shares that it names."""


@dataclass(frozen=True)
class Choices:
    """What the paper does not say, and this run of the study takes.

    Args:
        machine: name in the catalogue or file of a description with the direct-driven units boom and bucket.
        ramp: time in which the motor comes to its speed and back [s].
        loads: "stated", the forces that the description names (the paper's kN), or "shares", a quarter, a half and
            three quarters of what the relief valves let each unit lift.
        values: of the machine in the place of the description's, as ``("boom.hose.diameter", "25.4 mm")``.
    """

    machine: str | Path = MACHINE
    ramp: float = RAMP
    loads: str = READINGS[0]
    values: tuple[tuple[str, str], ...] = ()

    def described(self) -> Machine:
        """The machine's description with the values put in.

        Raises:
            DescriptionError: it cannot be read, lacks what the study needs, or a value cannot be.
            UnknownNameError: there is no such machine.

        Example:
            >>> changed = Choices(values=(("boom.hose.diameter", "25.4 mm"),)).described()
            >>> round(changed.unit("boom").hose.diameter, 4)  # m
            0.0254
        """
        found = load_machine(self.machine)
        for name in UNITS:
            direct_driven(found, name)
        changes = {f"units.{key}": value for key, value in self.values}
        return found.replace(changes) if changes else found

    @property
    def said(self) -> tuple[str, ...]:
        """What differs from the default, a sentence each; empty if nothing does."""
        plain, found = Choices(), []
        if self.machine != plain.machine:
            found.append(f"This run of the study took the machine {self.machine}.")
        if self.ramp != plain.ramp:
            found.append(f"It took ramps of {self.ramp:g} s; what the chapter on ramps fits holds for 0.8 s.")
        if self.loads != plain.loads:
            found.append("It took the loads as shares of the largest, not as stated.")
        found += [f"It took {key} = {value}." for key, value in self.values]
        return tuple(found)

    def loads_of(self, described: DirectDriven, unit: DdhUnit) -> dict[str, float]:
        """The three loads of a unit [N], by the paper's names.

        Args:
            described: the unit's description.
            unit: the unit built from it.
        """
        if self.loads == "stated":
            return {name: described.load.loads[name] for name in LOADS}
        largest = derive(unit).load_at_relief_after_friction
        return {name: share * largest for name, share in LOADS.items()}


def direct_driven(found: Machine, name: str) -> DirectDriven:
    """A unit of a machine that the study can be done with.

    Args:
        found: the machine.
        name: of the unit.

    Raises:
        DescriptionError: there is no such unit, it has another circuit, or a load of the paper's has no value.
    """
    file, key = found.origin or None, f"units.{name}"
    if name not in found.units:
        others = ", ".join(found.units)
        raise DescriptionError("the study needs the units boom and bucket", file=file, key="units", value=others)
    unit = found.units[name]
    if not isinstance(unit, DirectDriven):
        text = "the study needs a direct-driven unit"
        raise DescriptionError(text, file=file, key=f"{key}.circuit", value=unit.circuit, allowed="ddh")
    missing = ", ".join(load for load in LOADS if load not in unit.load.loads)
    if missing:
        text, allowed = "the study needs loads of these names", ", ".join(LOADS)
        raise DescriptionError(text, file=file, key=f"{key}.load.loads", value=missing, allowed=allowed)
    return unit


def read_values(passed: Sequence[str], option: str) -> tuple[tuple[str, str], ...]:
    """Read values passed as ``KEY=VALUE``.

    Args:
        passed: such as ``"boom.pump_a.volumetric_efficiency=0.92"``; keys are those below ``units`` of a description.
        option: that they were passed with, for the message.

    Raises:
        DescriptionError: one is no such pair.

    Example:
        >>> read_values(["boom.hose.diameter = 25.4 mm"], "--set")
        (('boom.hose.diameter', '25.4 mm'),)
    """
    pairs = []
    for text in passed:
        key, sign, value = (part.strip() for part in text.partition("="))
        if not (key and sign and value):
            allowed = "UNIT.PART.KEY=VALUE, such as 'boom.hose.diameter=25.4 mm'"
            raise DescriptionError("is no value with its key", key=option, value=text, allowed=allowed)
        pairs.append((key, value))
    return tuple(pairs)
