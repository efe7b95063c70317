"""From a TOML file to checked parts: sources set aside, catalogue names resolved, one line per mistake."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ramsight.argument_kinds import by_kind
from ramsight.errors import DescriptionError, RamsightError, UnknownNameError, first_of
from ramsight.machine import catalogue
from ramsight.machine.base import Part, part_class
from ramsight.machine.checking import validate
from ramsight.machine.declare import FROM_FILE
from ramsight.machine.description import FORMAT, IN_FULL, Composed, DirectDriven, Machine, circuits
from ramsight.machine.parts import PARTS
from ramsight.machine.placed import KINDS
from ramsight.machine.pump_map import KEY, with_map

_MOST_UNITS = 100  # cylinders or groups of them; the largest machines of construction and mining have some dozen
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")


AnyMachine = str | Path | Machine


@by_kind
def load_machine(name_or_path: AnyMachine) -> Machine:
    """A machine, by its name in the catalogue or from a file.

    Args:
        name_or_path: a catalogue name such as ``"mining-loader"``, or the path of a TOML description; a machine is
            returned as it is.

    Returns:
        The machine, checked, in SI units.

    Raises:
        DescriptionError: the file cannot be read or holds something that cannot be used; one line that names
            file, key, value and allowed range.
        UnknownNameError: no such machine, or the description names an unknown oil, pump or valve.

    Example:
        >>> import ramsight
        >>> sorted(ramsight.load_machine("mining-loader").units)
        ['boom', 'bucket']
    """
    if isinstance(name_or_path, Machine):
        return name_or_path
    if not isinstance(name_or_path, str | Path):
        allowed = "a description, its name or file; a built unit has none"
        raise DescriptionError("is no machine", key="machine", value=type(name_or_path).__name__, allowed=allowed)
    if isinstance(name_or_path, str) and catalogue.has("machine", name_or_path):
        entry = catalogue.find("machine", name_or_path)
        return _machine(catalogue.read_toml(entry.path), entry.name, entry.path.parent)
    path = Path(name_or_path)
    looks_like_path = isinstance(name_or_path, Path) or path.suffix == ".toml" or len(path.parts) != 1
    if not looks_like_path and not path.exists():
        known = [entry.name for entry in catalogue.entries() if entry.kind == "machine"]
        raise UnknownNameError("machine file or catalogue name", str(name_or_path), known)
    return _machine(catalogue.read_toml(path), str(path), path.parent)


def only_unit(machine: Machine) -> str:
    """The name of a machine's unit where it has only one.

    Args:
        machine: the machine.

    Raises:
        DescriptionError: it has several.

    Example:
        >>> only_unit(load_machine("press"))
        'ram'
    """
    if len(machine.units) > 1:
        names = ", ".join(machine.units)
        raise DescriptionError(f"{machine.name} has several units: name one", key="unit", allowed=names)
    return next(iter(machine.units))


def loads(text: str, file: str = "description") -> Machine:
    """Read a machine from the text of a description.

    Args:
        text: TOML.
        file: what to call it in errors.

    Raises:
        DescriptionError: as `load_machine`.
        UnknownNameError: as `load_machine`.
    """
    return _machine(catalogue.parse_toml(text, file), file)


def from_catalogue(kind: str, name: str, **stated: Any) -> Part:
    """Read one part of the catalogue.

    Args:
        kind: what it is, for example ``"pump"``.
        name: its name.
        stated: values that the catalogue does not have or that override it, as in a description.

    Raises:
        UnknownNameError: there is no such part.
        DescriptionError: a value is missing or cannot be used.

    Example:
        >>> round(from_catalogue("pump", "PGI100-2-008", belt=1).displacement_per_rad, 9)
        1.257e-06
    """
    entry = catalogue.find(kind, name)
    values, _ = catalogue.read(entry)
    return validate(PARTS[kind], {**values, **stated, "model": entry.name}, file=entry.name, context=FROM_FILE)


def _machine(data: dict[str, Any], file: str, folder: Path = Path()) -> Machine:
    _check_format(data, file)
    without, tolerances = catalogue.split_tolerances(data, file)
    plain, sources = catalogue.split_sources(without, file)
    wrong: dict[str, RamsightError] = {}
    if data.get("format") is None:
        wrong["format"] = DescriptionError(f"is missing; write format = {FORMAT}", file=file, key="format")
    units = plain.get("units")
    if isinstance(units, dict) and len(units) > _MOST_UNITS:
        allowed = f"up to {_MOST_UNITS}"
        raise DescriptionError(
            "too many units for a machine", file=file, key="units", value=len(units), allowed=allowed
        )
    if isinstance(units, dict):
        for name, unit in units.items():
            if not _NAME.fullmatch(name):
                text = "a unit's name starts with a letter and holds letters, digits, - and _"
                wrong[f"units.{name}"] = DescriptionError(text, file=file, key=f"units.{name}")
            elif isinstance(unit, dict):
                units[name] = _resolve(unit, f"units.{name}", sources, file, wrong)
                _read_maps(units[name], f"units.{name}", sources, file, folder, wrong)
    machine = _validated(plain, file, wrong)
    machine._sources = sources
    machine._origin, machine._tolerances = file, tolerances
    _ = machine.tolerances  # a tolerance that is none is rejected here
    return machine


def _validated(plain: Mapping[str, Any], file: str, wrong: Mapping[str, RamsightError]) -> Machine:
    """The machine, or all that is wrong with it at once.

    Args:
        wrong: what was found before, by its path; what is wrong below such a path follows from it.
    """
    try:
        machine = validate(Machine, plain, file=file, context=FROM_FILE)
    except DescriptionError as error:
        found = [error, *error.others]
        if not wrong:
            raise
    else:
        found = []
    later = [one for one in found if not any(f"{_key(one)}.".startswith(f"{path}.") for path in wrong)]
    if wrong:
        raise first_of([*wrong.values(), *later])
    return machine


def _key(error: RamsightError) -> str:
    return (error.key or "") if isinstance(error, DescriptionError) else ""


def _check_format(data: Mapping[str, Any], file: str) -> None:
    """Reject a format that this version does not read; one that is missing is the file's smallest trouble."""
    stated = data.get("format")
    if stated is None:
        return
    if isinstance(stated, int) and stated > FORMAT:
        message = f"was written for a newer ramsight; this one reads up to format {FORMAT}, update it"
        raise DescriptionError(message, file=file, key="format", value=stated)
    if isinstance(stated, bool) or stated != FORMAT:
        raise DescriptionError("is no format", file=file, key="format", value=stated, allowed=str(FORMAT))


def _resolve(
    unit: dict[str, Any], path: str, sources: dict[str, str], file: str, wrong: dict[str, RamsightError]
) -> dict[str, Any]:
    """Fill in what catalogue entries give and the description does not; what cannot be is `wrong`, by its path."""
    resolved = dict(unit)
    circuit = resolved.get("circuit", "ddh")
    composed = circuit != "ddh"
    if isinstance(circuit, str) and circuit not in (known := circuits()):
        wrong[path] = DescriptionError(  # and so are its parts: which ones is unknown
            "unknown choice", file=file, key=f"{path}.circuit", value=circuit, allowed=", ".join(known)
        )
        return resolved
    for key, field in (Composed if composed else DirectDriven).model_fields.items():
        part = part_class(field.annotation)
        if key in resolved and part is not None:
            resolved[key] = _from_model(resolved[key], part.family, f"{path}.{key}", sources, file, wrong)
    if composed and isinstance(resolved.get("parts", {}), dict) and ("parts" in resolved or circuit != IN_FULL):
        resolved["parts"] = _parts(resolved, path, sources, file, wrong)
    return resolved


def _read_maps(
    unit: dict[str, Any], path: str, sources: dict[str, str], file: str, folder: Path, wrong: dict[str, RamsightError]
) -> None:
    """Put tables of efficiencies in the place of the files that pumps name."""
    parts = unit.get("parts")
    places = [(unit, path), *([(parts, f"{path}.parts")] if isinstance(parts, dict) else [])]
    for holder, at in places:
        for key, part in holder.items():
            if isinstance(part, dict) and part.get(KEY):
                try:
                    holder[key] = with_map(part, unit.get("oil"), folder)
                except DescriptionError as error:
                    key_of = error.key if error.file is not None else f"{at}.{key}.{error.key}"
                    wrong[f"{at}.{key}"] = DescriptionError(
                        error.message, file=error.file or file, key=key_of, value=error.value, allowed=error.allowed
                    )
                else:
                    sources.setdefault(f"{at}.{key}.efficiency_table", f"[S: {part[KEY]}]")


def _parts(
    unit: Mapping[str, Any], path: str, sources: dict[str, str], file: str, wrong: dict[str, RamsightError]
) -> dict[str, Any]:
    """Fill in what the catalogue's circuit gives: kinds and nodes."""
    parts = dict(unit.get("parts", {}))
    name = unit["circuit"]
    if isinstance(name, str) and name != IN_FULL and catalogue.has("circuit", name):
        for key, template in catalogue.circuit(name).items():
            stated = parts.get(key, {})
            if isinstance(stated, dict):
                for item in template.keys() - stated.keys():
                    sources.setdefault(f"{path}.parts.{key}.{item}", f"circuit {name}: [D] by its drawing")
                parts[key] = {**template, **stated}
    for key, part in parts.items():
        kind = part.get("kind") if isinstance(part, dict) else None
        if isinstance(kind, str) and kind in KINDS:
            parts[key] = _from_model(part, KINDS[kind].family, f"{path}.parts.{key}", sources, file, wrong)
    return parts


def _from_model(
    stated: Any, family: str, path: str, sources: dict[str, str], file: str, wrong: dict[str, RamsightError]
) -> Any:
    """Fill in what the catalogue entry that a part names gives."""
    if isinstance(stated, str) and family:
        stated = {"model": stated}
    if not family or not isinstance(stated, dict) or not isinstance(stated.get("model"), str):
        return stated
    try:
        values, origins = catalogue.filled(family, stated, where=f"{file}: {path}")
    except UnknownNameError as error:
        wrong[path] = error
        return stated
    for name, source in origins.items():
        sources.setdefault(f"{path}.{name}", source)
    return values
