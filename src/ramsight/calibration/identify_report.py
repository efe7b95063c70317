"""What to say of an identification, and the machine's description with what was found in it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ramsight.calibration.identify import Estimate, Identification, IdentifyError
from ramsight.errors import DescriptionError
from ramsight.machine.declare import Value, walk
from ramsight.machine.description import DirectDriven
from ramsight.machine.reading import loads

if TYPE_CHECKING:
    from ramsight.machine.description import Machine

WORDS = {
    "leak": "leak factor",
    "orifice": "orifice leak",
    "displacement": "displacement factor",
    "friction": "friction factor",
    "stiffness": "stiffness factor",
}
_WHY = {
    "leak": "needs moves under load, both ways",
    "orifice": "needs loads of different pressure, or oil of different temperatures",
    "displacement": "needs moves both ways",
    "friction": "needs the same load lifted and lowered",
    "stiffness": "needs loads that differ between moves, at best changed at rest",
}


def summary(found: Identification) -> str:
    """The factors with their intervals and what they depend on, as lines of text."""
    low, high = (1e-5 * p for p in found.pressure)
    cold, hot = (t - 273.15 for t in found.temperature)
    rows: list[tuple[str, ...]] = [
        ("", "of the", "95 % interval", "oil 1 K", "torque 1 %", "pumps 1 %"),
        ("", "data sheet", "", "warmer", "larger", "rougher"),
    ]
    notes = []
    for name, words in WORDS.items():
        estimate = found.factors[name]
        if estimate.told:
            interval = f"{max(estimate.low, 0.0):.4f} to {estimate.high:.4f}"
            shifts = (f"{estimate.per_kelvin:+.4f}", f"{estimate.per_torque:+.4f}", f"{estimate.per_efficiency:+.4f}")
            rows.append((words, f"{estimate.value:.4f}", interval, *shifts))
        else:
            rows.append((words, f"{estimate.value:.4f}", "not told by this log", "", "", ""))
            notes.append(_untold(name, estimate))
    if not found.factors["orifice"].told:
        notes.append("  the leak factor counts all leakage at this log's pressures and temperatures as laminar")
    table = [f"{a:<20} {b:>10}  {c:<21} {d:>8}  {e:>10}  {f:>9}".rstrip() for a, b, c, d, e, f in rows]
    lag = found.delay
    lines = [
        f"{found.moves} moves ({found.lifts} lifting, {found.lowers} lowering), {found.duration:.0f} s, "
        f"{low:.0f} to {high:.0f} bar, {cold:.1f} to {hot:.1f} degC; "
        f"unexplained within a move {1e3 * found.residual:.3f} mm",
        *table,
        *notes,
    ]
    if lag.told and lag.low * lag.high > 0.0:
        lines.append(
            f"  the position lags the drive by {1e3 * lag.value:.1f} ms "
            f"({1e3 * lag.low:.1f} to {1e3 * lag.high:.1f}); this is taken off"
        )
    return "\n".join(lines)


def _untold(name: str, estimate: Estimate) -> str:
    half = estimate.high - estimate.value
    words = WORDS[name]
    if name == "orifice" and half < 1.0 and estimate.value == 0.0:
        return f"  {words}: none found, at most {half:.3f}; {_WHY[name]}"
    wide = f", its interval would be ± {half:.2f}" if half < 1e3 else ""
    return f"  {words}: left at the data sheet{wide}; {_WHY[name]}"


def changes(machine: Machine, unit: str, found: Identification) -> dict[str, tuple[float, str]]:
    """What changes in the description: dotted path to value [SI] and its source.

    Leakage is written as the volumetric efficiency that the pump has left, wear like an orifice's as its flow at the
    nominal pressure; friction and bulk moduli in proportion. What the log does not tell is left alone.

    Args:
        machine: the description.
        unit: the unit's name.
        found: what was found of it.

    Raises:
        IdentifyError: the unit has another circuit.
    """
    described = machine.unit(unit)
    if not isinstance(described, DirectDriven):
        raise IdentifyError(f"unit {unit!r} is no direct driven unit")
    factors, result = found.factors, dict[str, tuple[float, str]]()
    path = f"units.{unit}"

    def put(key: str, value: float, *names: str) -> None:
        words = ", ".join(f"{WORDS[n]} {_plus_minus(factors[n])}" for n in names if factors[n].told)
        before = machine.source_of(f"{path}.{key}")
        result[f"{path}.{key}"] = (value, f"[identified] {words}" + (f"; was: {before}" if before else ""))

    leak, orifice, size = (factors[name] for name in ("leak", "orifice", "displacement"))
    for name in ("pump_a", "pump_b"):
        pump = getattr(described, name)
        if size.told:
            put(f"{name}.displacement", size.value * pump.displacement, "displacement")
        if leak.told or size.told:
            # Eq. 10 makes leakage proportional to displacement; the factors are independent.
            lost = leak.value / size.value * (1.0 - pump.volumetric_efficiency)
            put(f"{name}.volumetric_efficiency", 1.0 - lost, "leak", "displacement")
        if orifice.told:
            nominal = pump.displacement * pump.nominal_speed * (1.0 - pump.volumetric_efficiency)
            put(f"{name}.orifice_leakage", orifice.value * nominal, "orifice")
    if factors["friction"].told:
        for name in ("breakaway_friction", "coulomb_friction", "viscous_friction"):
            put(f"cylinder.{name}", factors["friction"].value * getattr(described.cylinder, name), "friction")
    if factors["stiffness"].told:
        stiffness = factors["stiffness"].value
        put("oil.bulk_modulus", stiffness * described.oil.bulk_modulus, "stiffness")
        put("hose.effective_bulk_modulus", stiffness * described.hose.effective_bulk_modulus, "stiffness")
    return result


def _plus_minus(estimate: Estimate) -> str:
    return f"{estimate.value:.4f} (95 %: {max(estimate.low, 0.0):.4f} to {estimate.high:.4f})"


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
    text = "\n".join([*lines, *_toml(changed, {**machine.sources, **sources})]) + "\n"
    return Tuned(loads(text, "the tuned description"), text)


def _toml(machine: Machine, sources: dict[str, str]) -> Iterator[str]:
    """A description as TOML, a table a part; defaults that nobody gave are left out."""
    tables: dict[str, list[str]] = {}
    for value in walk(machine):
        if value.given:
            where, _, key = value.path.rpartition(".")
            source, text = sources.get(value.path), _written(value)
            line = text if source is None else f"{{ value = {text}, source = {_quoted(source)} }}"
            tables.setdefault(where, []).append(f"{key} = {line}")
    for where, lines in tables.items():
        yield from ("", f"[{where}]") if where else ()
        yield from lines


def _written(value: Value) -> str:
    if value.declared is None:
        return str(value.value) if isinstance(value.value, int | float) else _quoted(value.value)
    if value.declared.whole:
        return str(value.value)
    text = value.declared.show(value.value)
    return _quoted(text) if value.declared.unit != "1" or "/" in text else text


def _quoted(text: Any) -> str:
    return json.dumps(str(text), ensure_ascii=False)
