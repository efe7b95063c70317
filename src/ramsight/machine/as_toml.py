"""A description as the TOML that it could have been read from."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from ramsight.machine.base import Value, walk

if TYPE_CHECKING:
    from ramsight.machine.description import Machine


def as_toml(machine: Machine, sources: Mapping[str, str]) -> Iterator[str]:
    """Lines of a description, a table a part; defaults that nobody gave are left out.

    Args:
        sources: where values come from, by their dotted paths.
    """
    tables: dict[str, list[str]] = {}
    for value in walk(machine):
        if value.given:
            where, _, name = value.path.rpartition(".")
            source, text = sources.get(value.path), _written(value)
            beside = {"tolerance": machine.tolerance_text(value.path), "source": source}
            more = "".join(f", {key} = {_quoted(said)}" for key, said in beside.items() if said is not None)
            line = f"{{ value = {text}{more} }}" if more else text
            tables.setdefault(where, []).append(f"{name} = {line}")
    for where, lines in tables.items():
        yield from ("", f"[{where}]") if where else ()
        yield from lines


def _written(value: Value) -> str:
    if isinstance(value.value, tuple):
        return f"[{', '.join(_quoted(one) for one in value.value)}]"
    if value.declared is None:
        return str(value.value) if isinstance(value.value, int | float) else _quoted(value.value)
    if value.declared.whole:
        return str(value.value)
    text = value.declared.show(value.value)
    return _quoted(text) if value.declared.unit != "1" or "/" in text else text


def _quoted(text: Any) -> str:
    return json.dumps(str(text), ensure_ascii=False)
