"""The machine's description with what was found in one of its units, and where every value comes from."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ramsight.calibration.identify import AS_DESCRIBED, Estimate, IdentifyError
from ramsight.calibration.identify_report import words_of
from ramsight.calibration.knowledge import MachineKnowledge
from ramsight.calibration.loss_uncertainty import rougher
from ramsight.errors import DescriptionError
from ramsight.machine.as_toml import as_toml
from ramsight.machine.description import Composed, DirectDriven, Unit
from ramsight.machine.parts import Hose, Pump
from ramsight.machine.pump_description import COLUMNS
from ramsight.machine.reading import loads
from ramsight.units import to_si

if TYPE_CHECKING:
    from ramsight.machine.description import Machine


def changes(machine: Machine, unit: str, known: MachineKnowledge) -> dict[str, tuple[float | str, str]]:
    """What changes in the description: dotted path to value [SI] and its source.

    Leakage is written as the volumetric efficiency that the pump has left, wear like an orifice's as its flow at the
    nominal pressure, friction and bulk moduli in proportion; of a pump with a table the table's efficiencies change.
    What the log does not tell is left alone. How well a factor is known is what the sensor assumes from then on.
    """
    described = machine.unit(unit)
    factors = {name: one for name, one in known.factors.items() if one.identified}
    result = dict[str, tuple[float | str, str]]()
    path = f"units.{unit}"

    def put(key: str, value: float | str, *names: str) -> None:
        words = ", ".join(words_of(n, factors[n]) for n in names if n in factors)
        before = machine.source_of(f"{path}.{key}")
        result[f"{path}.{key}"] = (value, f"[{known.origin}] {words}" + (f"; was: {before}" if before else ""))

    stiffness = factors["stiffness"].value if "stiffness" in factors else 1.0
    moduli_of_oil = described.oil.bulk_modulus, stiffness * described.oil.bulk_modulus
    for name, pump in _placed(described, Pump).items():
        for key, value, source in _pump(pump, factors, moduli_of_oil):
            put(f"{name}.{key}", value, *source)
    if "friction" in factors:
        names = ["coulomb_friction", "breakaway_friction", "viscous_friction"]
        names += ["pressure_friction"] if described.cylinder.pressure_friction else []
        # One after the other, and breakaway may not be below Coulomb friction in between.
        for name in names if factors["friction"].value < 1.0 else reversed(names):
            put(f"cylinder.{name}", factors["friction"].value * getattr(described.cylinder, name), "friction")
    if "stiffness" in factors:
        moduli = [
            (f"{n}.effective_bulk_modulus", h.effective_bulk_modulus) for n, h in _placed(described, Hose).items()
        ]
        # One after the other, and no hose may be stiffer than its oil in between.
        moduli.insert(0 if stiffness > 1.0 else len(moduli), ("oil.bulk_modulus", described.oil.bulk_modulus))
        for key, modulus in moduli:
            put(key, stiffness * modulus, "stiffness")
    for key, (value, words) in known.assumed.items():
        result[f"{path}.assumptions.{key}"] = value, f"[{known.origin}] {words}"
    return result


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
    pump: Pump, factors: Mapping[str, Estimate], moduli: tuple[float, float]
) -> Iterator[tuple[str, float | str, tuple[str, ...]]]:
    """Keys and values of a pump that change, and the factors that they rest on."""

    def value(name: str) -> float:
        return factors[name].value if name in factors else AS_DESCRIBED[name]

    size, rough = value("displacement"), value("efficiency")
    # Eq. 10 makes leakage proportional to displacement; the factors are independent.
    lost = value("leak") / size
    has_flow = "leak" in factors or "displacement" in factors
    if "displacement" in factors:
        yield "displacement", size * pump.displacement, ("displacement",)
    if pump.losses == "table":
        if has_flow or "efficiency" in factors:
            friction = rougher(pump.hydromechanical_efficiency, rough)
            yield "efficiency_table", _table(pump, lost, friction, moduli), ("leak", "displacement", "efficiency")
    else:
        if has_flow:
            left = _left(pump, pump.volumetric_efficiency, pump.nominal_pressure, lost, moduli)
            yield "volumetric_efficiency", left, ("leak", "displacement")
        if "efficiency" in factors:
            yield "hydromechanical_efficiency", pump.hydromechanical_efficiency + rough, ("efficiency",)
    if "orifice" in factors:
        nominal = pump.displacement * pump.nominal_speed * (1.0 - pump.volumetric_efficiency)
        yield "orifice_leakage", value("orifice") * nominal, ("orifice",)


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
    """A tuned machine."""

    machine: Machine  # its description, checked
    text: str  # the same as TOML, with the source of every value that has one


def tuned(machine: Machine, unit: str, known: MachineKnowledge, by: str) -> Tuned:
    """The whole machine's description with what was found of one of its units.

    Args:
        machine: the description.
        unit: name of the unit that was measured.
        known: its factors [1] and what its sensor may assume [SI].
        by: what found them, and from which files, for the first line of the text.

    Raises:
        IdentifyError: a value found lies outside the range that a description allows.

    Example:
        >>> from ramsight.calibration.knowledge import of_leak_test
        >>> from ramsight.calibration.leakage import LeakTest
        >>> from ramsight.machine import load_machine
        >>> loader = load_machine("mining-loader")
        >>> test = LeakTest(factor=1.2, std=0.02, per_kelvin=-0.04, per_torque=-0.01, stretches=())
        >>> worn = tuned(loader, "boom", of_leak_test(test, loader.unit("boom")), "a leak test").machine.unit("boom")
        >>> worn.pump_a.volumetric_efficiency, worn.assumptions.machine.leak
        (0.88, 0.0382)
    """
    new = changes(machine, unit, known)
    try:
        changed = machine.replace({path: value for path, (value, _) in new.items()})
    except DescriptionError as error:
        raise IdentifyError(f"a value found is outside the range of a description: {error}") from error
    sources = {path: source for path, (_, source) in new.items()}
    head = f"{unit} of {machine.origin or machine.name}, tuned by {by}:"
    lines = [f"# {' '.join(head.split())}", *(f"# {line}" for line in known.lines)]
    text = "\n".join([*lines, *as_toml(changed, {**machine.sources, **sources})]) + "\n"
    return Tuned(loads(text, "the tuned description"), text)
