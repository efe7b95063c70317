"""The catalogue: oils, pumps, valves, circuits and whole machines as data files, each value with its source.

Entries of one's own stand beside ramsight's in the folder that ``RAMSIGHT_CATALOG`` names, or in
``~/.config/ramsight/catalog`` (``$XDG_CONFIG_HOME``), in files of the same form, in folders as one likes.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from ramsight.bounded_toml import LARGEST, TomlError
from ramsight.bounded_toml import loads as loads_toml
from ramsight.errors import DescriptionError, UnknownNameError
from ramsight.machine.spread import halves, has_spread
from ramsight.system import config_home

__all__ = ["Entry", "circuit", "entries", "filled", "find", "has", "own_files", "own_folder", "read", "read_entry"]

VARIABLE = "RAMSIGHT_CATALOG"
"""Environment variable that names the folder of one's own entries."""
_SAID = {"kind": "machine", "name": "", "description": "", "source": ""}  # keys, and what they are if left out
_FILES = {"efficiency_file"}
_ROOT = Path(__file__).parent
_FOLDERS = ("circuits", "instruments", "machines", "oils", "pumps", "valves")


@dataclass(frozen=True)
class Entry:
    """One thing in the catalogue."""

    # `machine`, `circuit`, `oil`, `pump`, `relief valve`, `anticavitation valve`, `safety valve`; of what is around a
    # bench `motor`, `motor controller`, `battery`, `pressure sensor`, `temperature sensor`, `position sensor`
    kind: str
    name: str
    description: str
    source: str  # where its values come from, unless they say so themselves
    path: Path

    @property
    def is_own(self) -> bool:
        """Whether it is not ramsight's."""
        return _ROOT not in self.path.parents


def entries() -> tuple[Entry, ...]:
    """List everything in the catalogue, by kind and name.

    Raises:
        DescriptionError: an entry of one's own cannot be read, or has the name of another one.

    Example:
        >>> "tellus-t-32" in [entry.name for entry in entries() if entry.kind == "oil"]
        True
    """
    own = own_files()
    return _entries(tuple((path, path.stat().st_mtime_ns) for path in own)) if own else _entries(())


def own_folder() -> Path:
    """Folder of one's own entries; it need not exist unless ``RAMSIGHT_CATALOG`` names it.

    Raises:
        DescriptionError: ``RAMSIGHT_CATALOG`` names what is no folder.
    """
    named = os.environ.get(VARIABLE)
    if named:
        if not Path(named).is_dir():
            raise DescriptionError("is no folder", key=VARIABLE, value=named)
        return Path(named)
    return config_home() / "catalog"


def own_files() -> tuple[Path, ...]:
    """Files of one's own entries."""
    folder = own_folder()
    return tuple(sorted(folder.rglob("*.toml"))) if folder.is_dir() else ()


@cache
def _entries(own: tuple[tuple[Path, int], ...]) -> tuple[Entry, ...]:
    """Ramsight's entries, and one's own with the times of their last change."""
    found = [read_entry(path) for folder in _FOLDERS for path in sorted((_ROOT / folder).glob("*.toml"))]
    for path, _ in own:
        entry = read_entry(path)
        name = (entry.kind, entry.name.casefold())
        if other := next((one for one in found if (one.kind, one.name.casefold()) == name), None):
            where = other.path if other.is_own else "ramsight's catalogue"
            raise DescriptionError(f"is the name of an entry of {where}", file=str(path), key="name", value=entry.name)
        found.append(entry)
    return tuple(sorted(found, key=lambda entry: (entry.kind, entry.name)))


def read_entry(path: Path) -> Entry:
    """What an entry's file says of it.

    Raises:
        DescriptionError: it cannot be read, or has no name.
    """
    data = read_toml(path)
    texts = {key: data.get(key, default) for key, default in _SAID.items()}
    for key, text in texts.items():
        if not isinstance(text, str) or (key == "name" and not text):
            raise DescriptionError("has to be text", file=str(path), key=key, value=text or "nothing")
    return Entry(texts["kind"], texts["name"], texts["description"], texts["source"], path)


def has(kind: str, name: str) -> bool:
    """Say whether the catalogue knows a name; upper and lower case are alike."""
    return _of_name(kind, name) is not None


def find(kind: str, name: str, *, where: str | None = None) -> Entry:
    """Look a name up; upper and lower case are alike.

    Args:
        kind: one of the kinds of `Entry`; empty for any.
        name: the name.
        where: the place that asks, for the error text.

    Raises:
        UnknownNameError: the catalogue has no such name; the text lists those it has.
    """
    if (entry := _of_name(kind, name)) is not None:
        return entry
    known = [entry.name for entry in entries() if kind in ("", entry.kind)]
    raise UnknownNameError(kind or "catalogue name", name, known, where)


def circuits() -> tuple[str, ...]:
    """Names of the circuits, in order."""
    if own_files():
        return tuple(entry.name for entry in entries() if entry.kind == "circuit")
    return tuple(path.stem for path in sorted(_shipped().values()) if path.parent.name == "circuits")


def _of_name(kind: str, name: str) -> Entry | None:
    """The entry of a name; without entries of one's own no more than its file is read."""
    if own_files():
        some: Iterable[Entry] = entries()
    else:
        path = _shipped().get(name.casefold())
        some = () if path is None else (_read_shipped(path),)
    return next((one for one in some if kind in ("", one.kind) and one.name.casefold() == name.casefold()), None)


_read_shipped = cache(read_entry)


@cache
def _shipped() -> dict[str, Path]:
    """Ramsight's files by the names of their entries."""
    return {path.stem.casefold(): path for folder in _FOLDERS for path in (_ROOT / folder).glob("*.toml")}


def read(entry: Entry) -> tuple[dict[str, Any], dict[str, str]]:
    """Read a part's values as they are written, and where each comes from.

    Returns:
        Values by key, as text with units, and sources by key.
    """
    values, sources = split_sources(read_toml(entry.path)["values"], str(entry.path))
    for key in _FILES & values.keys():  # a file's name counts from the entry's own folder
        values[key] = str(entry.path.parent / str(values[key]))
    return values, {key: sources.get(key, entry.source) for key in values}


def filled(kind: str, stated: Mapping[str, Any], *, where: str | None = None) -> tuple[dict[str, Any], dict[str, str]]:
    """Values of a part that names a catalogue entry: those that are stated, and the entry's for the others.

    Args:
        kind: one of the kinds of `Entry`.
        stated: values by key, with the entry's name as ``model``.
        where: the place that asks, for the error text.

    Returns:
        Values by key, and where those of the entry come from.

    Raises:
        UnknownNameError: the catalogue has no such name; the text lists those it has.
    """
    entry = find(kind, stated["model"], where=where)
    values, origins = read(entry)
    sources = {key: f"{entry.name}: {origins.get(key, entry.source)}" for key in values.keys() - stated.keys()}
    return {**values, **stated, "model": entry.name}, sources


def circuit(name: str) -> dict[str, dict[str, Any]]:
    """Read a circuit: kind and nodes of each of its parts.

    Example:
        >>> circuit("eha-double-rod")["pump"]["outlet"]
        'port_a'
    """
    parts: dict[str, dict[str, Any]] = read_toml(find("circuit", name).path)["parts"]
    return parts


def drawing(entry: Entry) -> str:
    """A circuit's drawing in text; empty for what has none."""
    return str(read_toml(entry.path).get("drawing", "")).strip("\n")


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file.

    Raises:
        DescriptionError: it cannot be read; one line with the file and, for a slip in the syntax, the line.
    """
    try:
        if path.exists() and not (path.is_file() or path.is_dir()):
            raise DescriptionError("is not a regular file", file=str(path))
        with open(path, "rb") as file:
            content = file.read(LARGEST + 1)
        if len(content) > LARGEST:
            raise DescriptionError("is too large for a description", file=str(path), allowed="up to 1 MiB")
        text = content.decode("utf-8-sig")
    except FileNotFoundError:
        raise DescriptionError("no such file", file=str(path)) from None
    except IsADirectoryError:
        raise DescriptionError("is a directory, not a description", file=str(path)) from None
    except UnicodeDecodeError as error:
        raise DescriptionError(f"is not UTF-8 text (byte {error.start})", file=str(path)) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise DescriptionError(f"cannot be read: {reason}", file=str(path)) from None
    return parse_toml(text, str(path))


def parse_toml(text: str, file: str) -> dict[str, Any]:
    """Parse TOML text; errors name `file` and the line."""
    try:
        return loads_toml(text)
    except TomlError as error:
        first = "" if file.endswith(".toml") or not Path(file).suffix else "; the machine comes first, then a log"
        raise DescriptionError(f"is not TOML: {error}{first}", file=f"{file}, line {error.line}") from None


def split_tolerances(data: Mapping[str, Any], file: str, path: str = "") -> tuple[dict[str, Any], dict[str, str]]:
    """Take ``"0.9 ± 0.02"`` and ``{ value = "0.9", tolerance = "± 0.02" }`` apart.

    Args:
        data: what a TOML file holds.
        file: for errors.
        path: where `data` stands, empty at the top.

    Returns:
        The same data without tolerances, and these by dotted path.

    Raises:
        DescriptionError: a tolerance without a value, or one that is no text.
    """
    plain: dict[str, Any] = {}
    tolerances: dict[str, str] = {}
    for key, item in data.items():
        where = f"{path}.{key}" if path else key
        if isinstance(item, dict) and "tolerance" in item:
            if "value" not in item:
                raise DescriptionError("has a tolerance but no value", file=file, key=where)
            if not isinstance(item["tolerance"], str):
                raise DescriptionError("a tolerance is text", file=file, key=where, allowed="'± 0.02', '± 5 % normal'")
            tolerances[where] = item["tolerance"]
            plain[key] = {name: value for name, value in item.items() if name != "tolerance"}
        elif isinstance(item, dict):
            value = item.get("value")
            if isinstance(value, str) and has_spread(value) and not _of_a_kind(where):
                value, tolerances[where] = halves(value)
                item = {**item, "value": value}
            plain[key], inner = split_tolerances(item, file, where)
            tolerances.update(inner)
        elif has_spread(item) and not _of_a_kind(where):
            plain[key], tolerances[where] = halves(item)
        else:
            plain[key] = item
    return plain, tolerances


def _of_a_kind(path: str) -> bool:
    """Whether a path is in a unit's table of tolerances, or a text: there a ± is no value's."""
    words = path.split(".")
    return words[-1] in ("source", "title", "description") or (words[0] == "units" and "tolerances" in words[2:3])


def split_sources(data: Mapping[str, Any], file: str, path: str = "") -> tuple[dict[str, Any], dict[str, str]]:
    """Take `{ value = …, source = … }` apart.

    A table with a `source` of its own gives it to all values in it that have none.

    Args:
        data: what a TOML file holds.
        file: for errors.
        path: where `data` stands, empty at the top.

    Returns:
        The same data with plain values, and the sources by dotted path.

    Raises:
        DescriptionError: a source without a value, or one that is no text.
    """
    plain: dict[str, Any] = {}
    sources: dict[str, str] = {}
    for key, item in data.items():
        where = f"{path}.{key}" if path else key
        if key == "source":
            if not isinstance(item, str):
                raise DescriptionError("a source is text", file=file, key=where)
            sources[path] = item
        elif not isinstance(item, dict):
            plain[key] = item
        elif "value" in item and item.keys() <= {"value", "source"}:
            plain[key] = item["value"]
            if "source" in item:
                if not isinstance(item["source"], str):
                    raise DescriptionError("a source is text", file=file, key=f"{where}.source")
                sources[where] = item["source"]
        elif item.keys() == {"source"}:
            raise DescriptionError("has a source but no value", file=file, key=where)
        else:
            plain[key], inner = split_sources(item, file, where)
            sources.update(inner)
    return plain, sources
