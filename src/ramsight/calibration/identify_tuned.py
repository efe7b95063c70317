"""The machine's description with what was found in one of its units, and where every value comes from."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ramsight.calibration.identify import Identification, IdentifyError
from ramsight.calibration.identify_report import WORDS, interval, summary
from ramsight.calibration.loss_uncertainty import rougher
from ramsight.errors import DescriptionError
from ramsight.machine.as_toml import as_toml
from ramsight.machine.description import Composed, DirectDriven, Unit
from ramsight.machine.efficiencies import COLUMNS
from ramsight.machine.parts import Hose, Pump
from ramsight.machine.reading import loads
from ramsight.normal import TWO_SIDED_95
from ramsight.units import to_si

if TYPE_CHECKING:
    from ramsight.machine.description import Machine

_THERMOMETER = 1.0
"""Error of the oil's temperature that another day may have [K]: class B of IEC 60751 has 0.5 K at 40 degC, and as much
again is between the thermometer and the oil."""
_MEASURED, _REACHED = 1e-3, 1e-4
"""Chance that a machine leaks otherwise of which leakage and its law were measured, and that a piston stops elsewhere
than at its ends that was measured at both."""
_AT_END = 2e-3
"""How near an end the measured position has to be [m]: twice what a usual position sensor is off."""


def changes(machine: Machine, unit: str, found: Identification) -> dict[str, tuple[float | str, str]]:
    """What changes in the description: dotted path to value [SI] and its source.

    Leakage is written as the volumetric efficiency that the pump has left, wear like an orifice's as its flow at the
    nominal pressure, friction and bulk moduli in proportion; of a pump with a table the table's efficiencies change.
    What the log does not tell is left alone. How well a factor is known is what the sensor assumes from then on.

    Args:
        machine: the description.
        unit: the unit's name.
        found: what was found of it.
    """
    described, factors = machine.unit(unit), found.factors
    result = dict[str, tuple[float | str, str]]()
    path = f"units.{unit}"

    def put(key: str, value: float | str, *names: str) -> None:
        words = ", ".join(f"{WORDS[n]} {interval(n, factors[n])}" for n in names if factors[n].identified)
        before = machine.source_of(f"{path}.{key}")
        result[f"{path}.{key}"] = (value, f"[identified] {words}" + (f"; was: {before}" if before else ""))

    stiffness = factors["stiffness"].value if factors["stiffness"].identified else 1.0
    moduli_of_oil = described.oil.bulk_modulus, stiffness * described.oil.bulk_modulus
    for name, pump in _placed(described, Pump).items():
        for key, value, source in _pump(pump, found, moduli_of_oil):
            put(f"{name}.{key}", value, *source)
    if factors["friction"].identified:
        names = ["coulomb_friction", "breakaway_friction", "viscous_friction"]
        names += ["pressure_friction"] if described.cylinder.pressure_friction else []
        # One after the other, and breakaway may not be below Coulomb friction in between.
        for name in names if factors["friction"].value < 1.0 else reversed(names):
            put(f"cylinder.{name}", factors["friction"].value * getattr(described.cylinder, name), "friction")
    if factors["stiffness"].identified:
        moduli = [
            (f"{n}.effective_bulk_modulus", h.effective_bulk_modulus) for n, h in _placed(described, Hose).items()
        ]
        # One after the other, and no hose may be stiffer than its oil in between.
        moduli.insert(0 if stiffness > 1.0 else len(moduli), ("oil.bulk_modulus", described.oil.bulk_modulus))
        for key, modulus in moduli:
            put(key, stiffness * modulus, "stiffness")
    for key, known, name in _known(described, found):
        put(f"assumptions.machine.{key}", known, name)
    stops = described.assumptions.stops
    low, high = found.reached
    if low < stops.retracted + _AT_END and high > described.cylinder.stroke - stops.extended - _AT_END:
        words = f"[identified] the measured position reached both ends, {1e3 * low:.1f} and {1e3 * high:.1f} mm"
        result[f"{path}.assumptions.stops.undeclared"] = min(stops.undeclared, _REACHED), words
    return result


def _known(unit: Unit, found: Identification) -> Iterator[tuple[str, float, str]]:
    """Of the sensor's assumptions: key, standard deviation of what was found [1], and the factor that it rests on.

    A thermometer or a torque that is off shifts what is found; on another day they may be off otherwise. No factor is
    assumed to be known worse than before.
    """
    assumed = unit.assumptions
    for key, name in (("leak", "leak"), ("displacement", "displacement"), ("compliance", "stiffness")):
        factor, before = found.factors[name], getattr(assumed.machine, key)
        if factor.identified:
            own = (factor.high - factor.low) / (2.0 * TWO_SIDED_95)
            torque = 100.0 * assumed.drive.torque_gain * factor.per_torque
            std = math.hypot(own, _THERMOMETER * factor.per_kelvin, torque) / factor.value
            yield key, min(std, before), name
    if found.factors["leak"].identified and found.factors["orifice"].identified:
        yield "leaks_otherwise", min(_MEASURED, assumed.machine.leaks_otherwise), "orifice"


def _placed(unit: Unit, kind: type) -> dict[str, Any]:
    """The parts of a class by their place in the unit's description."""
    if isinstance(unit, DirectDriven):
        named = {name: getattr(unit, name) for name in ("pump_a", "pump_b", "hose")}
    elif isinstance(unit, Composed):
        named = {f"parts.{name}": part for name, part in unit.parts.items()}
    else:
        raise TypeError(f"no place is known for the parts of {type(unit).__name__}")
    return {name: part for name, part in named.items() if isinstance(part, kind)}


def _left(pump: Pump, efficiency: float, pressure: float, lost: float, moduli: tuple[float, float]) -> float:
    """Volumetric efficiency with `lost` times the leakage, and what of it is the oil's compression before and after."""
    before, after = (pump.compressed(pressure, modulus) for modulus in moduli)
    return 1.0 - after - lost * (1.0 - before - efficiency)


def _pump(
    pump: Pump, found: Identification, moduli: tuple[float, float]
) -> Iterator[tuple[str, float | str, tuple[str, ...]]]:
    """Keys and values of a pump that change, and the factors that they rest on."""
    leak, orifice, size, rough = (found.factors[n] for n in ("leak", "orifice", "displacement", "efficiency"))
    if size.identified:
        yield "displacement", size.value * pump.displacement, ("displacement",)
    # Eq. 10 makes leakage proportional to displacement; the factors are independent.
    lost = leak.value / size.value
    if pump.losses == "table":
        if leak.identified or size.identified or rough.identified:
            friction = rougher(pump.hydromechanical_efficiency, rough.value)
            yield "efficiency_table", _table(pump, lost, friction, moduli), ("leak", "displacement", "efficiency")
    else:
        if leak.identified or size.identified:
            left = _left(pump, pump.volumetric_efficiency, pump.nominal_pressure, lost, moduli)
            yield "volumetric_efficiency", left, ("leak", "displacement")
        if rough.identified:
            yield "hydromechanical_efficiency", pump.hydromechanical_efficiency + rough.value, ("efficiency",)
    if orifice.identified:
        nominal = pump.displacement * pump.nominal_speed * (1.0 - pump.volumetric_efficiency)
        yield "orifice_leakage", orifice.value * nominal, ("orifice",)


def _table(pump: Pump, leak: float, friction: float, moduli: tuple[float, float]) -> str:
    """A pump's table of efficiencies with other losses, as CSV."""
    lines = [line for line in csv.reader(io.StringIO(pump.efficiency_table.strip()), skipinitialspace=True) if line]
    rows = [",".join(COLUMNS)]
    for line in lines[1:]:
        volumetric = _left(pump, float(line[3]), to_si(float(line[0]), "bar"), leak, moduli)
        hydromechanical = 1.0 / (1.0 + friction * (1.0 / float(line[4]) - 1.0))
        rows.append(",".join([*(cell.strip() for cell in line[:3]), f"{volumetric:.9g}", f"{hydromechanical:.9g}"]))
    return "\n".join(rows)


@dataclass(frozen=True)
class Tuned:
    """A tuned machine.

    Attributes:
        machine: its description, checked.
        text: the same as TOML, with the source of every value that has one.
    """

    machine: Machine
    text: str


def tuned(machine: Machine, unit: str, found: Identification, log: str, truth: str) -> Tuned:
    """The whole machine's description with what was found of one of its units.

    Args:
        machine: the description.
        unit: the unit that was identified.
        found: what was found.
        log: name of the drive log that it rests on.
        truth: name of the file with the position.

    Raises:
        IdentifyError: a value found lies outside the range that a description allows.
    """
    new = changes(machine, unit, found)
    try:
        changed = machine.replace({path: value for path, (value, _) in new.items()})
    except DescriptionError as error:
        raise IdentifyError(f"what was found is no machine that can be: {error}") from error
    sources = {path: source for path, (_, source) in new.items()}
    head = [
        f"{unit} of {machine.origin or machine.name}, tuned by ramsight identify",
        f"from the log {log} and the position in {truth}:",
        *summary(found).splitlines(),
    ]
    lines = [f"# {' '.join(line.split())}" if n < 2 else f"# {line}" for n, line in enumerate(head)]
    text = "\n".join([*lines, *as_toml(changed, {**machine.sources, **sources})]) + "\n"
    return Tuned(loads(text, "the tuned description"), text)
