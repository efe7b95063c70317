"""What varies from machine to machine, and by how much: what the description states, else a default by kind.

Where the sensor assumes something of the machine, the default is just that: the sheet then states what is achieved by
machines as the sensor assumes them to be. The other defaults have their reason beside them; a sheet marks every
default as such.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from ramsight.errors import DescriptionError, UnknownNameError
from ramsight.machine.assumption_description import Assumptions
from ramsight.machine.base import walk
from ramsight.machine.declare import Quantity
from ramsight.machine.description import Machine, Unit
from ramsight.machine.spread import Spread, read_spread
from ramsight.machine.tolerances import CENTRES, KINDS

DEFAULT = "default"
"""Begins the source of whatever nobody has said."""

_REASONS = {
    "pump_friction": (
        "± 20 % normal",
        "a fifth of the losses, as hydro-mechanical efficiencies of one type scatter [G]",
    ),
    "friction": ("± 40 %", "seals, their age and their lubrication [G]"),
    "volumes": ("± 20 %", "lengths of hoses and shapes of blocks [G]"),
    "valves": ("± 10 % normal", "characteristics of data sheets are typical ones [G]"),
    "viscosity": ("± 10 %", "limits of a viscosity grade by ISO 3448"),
    "area": ("± 0.05 %", "a bore of tolerance H8 by ISO 286, 63 µm of 127 mm"),
    "mass": ("± 10 %", "attachments [G]"),
    "torque_offset": ("± 0.5 % normal", "offsets of current sensors [G]"),
    "torque_drift": ("± 1 % normal", "a remanence of -0.11 %/K over 10 K that the drive does not allow for [G]"),
    "thermometer_offset": ("± 3 K", "a resistance thermometer in a screw-in fitting, and where it sits [G]"),
    "oil_temperature": ("40 degC ± 15 K", "usual oil temperatures in work"),
    "warming": ("5 K ± 5 K", "of the oil in the minutes that the duty lasts [G]"),
}
"""Kinds of which the sensor assumes nothing: the default tolerance, and why it is so large."""

COVERS = {
    "leakage": ("volumetric_efficiency", "orifice_leakage"),
    "displacement": ("displacement",),
    "pump_friction": ("hydromechanical_efficiency", "no_load_torque"),
    "friction": ("breakaway_friction", "coulomb_friction", "viscous_friction", "pressure_friction"),
    "stiffness": ("bulk_modulus", "effective_bulk_modulus"),
    "volumes": ("dead_volume_a", "dead_volume_b", "volume"),
    "valves": ("rated_flow", "rated_pressure_drop"),
    "relief": ("setting",),
    "viscosity": ("viscosity_40c", "viscosity_100c"),
    "area": ("bore", "rod", "rod_a"),
    "mass": ("mass",),
    "stop": ("stroke",),
}
"""Values whose own tolerance, where a description has one, takes the place of a kind's default."""


@dataclass(frozen=True)
class Varied:
    """One quantity that varies from machine to machine."""

    name: str  # of a kind (`ramsight.machine.tolerances`), or the path of a value below its unit
    unit: str
    text: str
    spread: Spread  # how, in SI
    source: str  # where the tolerance comes from; begins with `DEFAULT` where nobody has said it

    @property
    def is_default(self) -> bool:
        """Whether this is the default, which nobody has declared."""
        return self.source.startswith(DEFAULT)


def varied(machine: Machine, unit: str, vary: Mapping[str, str] | None = None) -> tuple[Varied, ...]:
    """What varies of a unit, in an order that never changes.

    Args:
        vary: tolerances in the place of what the description states, as text: of kinds, or of values below the unit
            (``{"torque_gain": "± 3 %", "pump_a.volumetric_efficiency": "± 0.02 normal"}``); "" for one that does not
            vary.

    Raises:
        DescriptionError: a tolerance has no meaning.
        UnknownNameError: there is no such quantity.

    Example:
        >>> from ramsight import machine
        >>> found = varied(machine.load_machine("mining-loader"), "boom", {"leakage": "± 10 %", "mass": ""})
        >>> [(one.name, one.spread.half, one.is_default) for one in found][:2]
        [('leakage', 0.1, False), ('displacement', 0.016, True)]
    """
    described, passed = machine.unit(unit), dict(vary or {})
    begins = f"units.{unit}."
    beside = {
        path.removeprefix(begins): spread for path, spread in machine.tolerances.items() if path.startswith(begins)
    }
    covered = {path.rpartition(".")[2] for path in (*beside, *(name for name in passed if passed[name]))}
    found: dict[str, Varied] = {}
    for name in KINDS:
        text, source = _of_kind(machine, unit, name, passed)
        mentioned = name in passed or getattr(described.tolerances, name) is not None
        if text and (mentioned or not covered & set(COVERS.get(name, ()))):
            found[name] = _kind(described, name, text, source)
    values = {value.path: value for value in walk(described) if value.declared is not None and not value.declared.whole}
    for path, spread in beside.items():
        value = values[path]
        assert value.declared is not None
        source = machine.source_of(f"{begins}{path}") or "description"
        found[path] = Varied(path, value.declared.unit, value.text, spread, source)
    for name, text in passed.items():
        if name in KINDS:
            continue
        if name not in values:
            raise UnknownNameError("quantity that varies", name, (*KINDS, *values))
        value = values[name]
        assert value.declared is not None
        found.pop(name, None)
        if text:
            spread = _read(name, text, value.declared, value.value)
            found[name] = Varied(name, value.declared.unit, value.text, spread, "given")
    return tuple(found.values())


def default_text(name: str, assumed: Assumptions, stroke: float) -> tuple[str, str]:
    """The default tolerance of a kind and its reason; an empty text if it does not vary by default.

    Args:
        stroke: of the cylinder [m].
    """
    machine, drive, thermometer = assumed.machine, assumed.drive, assumed.thermometer
    as_assumed = {
        "leakage": (f"± {200 * machine.leak:g} % log-normal", "machine.leak"),
        "displacement": (f"± {200 * machine.displacement:g} % normal", "machine.displacement"),
        "stiffness": (f"± {200 * machine.compliance:g} % log-normal", "machine.compliance"),
        "relief": (f"± {200 * machine.relief:g} % normal", "machine.relief"),
        "stop": (f"± {2e3 * assumed.stops.std * stroke:g} mm normal", "stops.std"),
        "start": (f"± {2e3 * assumed.stops.reference:g} mm normal", "stops.reference"),
        "torque_gain": (f"± {200 * drive.torque_gain:g} % normal", "drive.torque_gain"),
        "torque_delay": (f"{500 * drive.delay:g} ms ± {500 * drive.delay:g} ms", "drive.delay"),
        "thermometer_lag": (f"{thermometer.lag:g} s ± {2 * thermometer.lag_std:g} s normal", "thermometer"),
    }
    if name in as_assumed:
        text, key = as_assumed[name]
        zero = text.startswith("± 0 ") or text.endswith("± 0 s normal")
        return ("" if zero else text), f"{DEFAULT}: as the sensor assumes, assumptions.{key}"
    text, why = _REASONS.get(name, ("", ""))
    return text, f"{DEFAULT}: {why}"


def _of_kind(machine: Machine, unit: str, name: str, passed: Mapping[str, str]) -> tuple[str, str]:
    """Text and source of a kind's tolerance."""
    described = machine.unit(unit)
    if name in passed:
        return passed[name], "given"
    said = getattr(described.tolerances, name)
    if said is not None:
        return said, machine.source_of(f"units.{unit}.tolerances.{name}") or "description"
    return default_text(name, described.assumptions, described.cylinder.stroke)


def _kind(described: Unit, name: str, text: str, source: str) -> Varied:
    spread = _read(name, text, KINDS[name], CENTRES.get(name))
    if name == "oil_temperature":  # beyond them nothing is known of the oil
        oil = described.oil
        least, most = max(spread.least, oil.min_temperature), min(spread.most, oil.max_temperature)
        spread = replace(spread, least=least, most=most)
    return Varied(name, KINDS[name].unit, KINDS[name].text, spread, source)


def _read(name: str, text: str, declared: Quantity, centre: float | None) -> Spread:
    try:
        return read_spread(text, declared, centre)
    except DescriptionError as error:
        raise DescriptionError(error.message, key=name, value=text, allowed=error.allowed) from None
