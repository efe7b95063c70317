"""What all parts of a description have in common: SI inside, checked, copied with other values, walked through."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self, TypeVar

from pydantic import BaseModel, ConfigDict
from pydantic.fields import FieldInfo

from ramsight.errors import UnknownNameError
from ramsight.machine import catalogue
from ramsight.machine.checking import validate
from ramsight.machine.declare import Quantity, declaration, explain, model_class

P = TypeVar("P", bound="Part")


class Part(BaseModel):
    """Base of everything that a description holds: frozen, SI inside, unknown keys rejected."""

    model_config = ConfigDict(extra="forbid", frozen=True, protected_namespaces=(), defer_build=True)

    #: the kind under which the catalogue lists such parts; empty if it does not
    family: ClassVar[str] = ""

    def replace(self, changes: Mapping[str, Any]) -> Self:
        """Return a copy with some values changed, checked like values from a file.

        A model of the catalogue brings all the values that it has, as in a description; others of the same part may be
        changed beside it.

        Args:
            changes: dotted path to value; an SI number, or text with a unit. For a part that the catalogue lists, a
                path may end in ``.model`` or at the part, and its value is the name there.

        Raises:
            DescriptionError: a value cannot be used.
            UnknownNameError: there is no such key, or no such model.

        Example:
            >>> from ramsight import machine
            >>> boom = machine.load_machine("mining-loader").unit("boom")
            >>> boom.replace({"cylinder.bore": "6 in"}).cylinder.bore
            0.1524
            >>> smaller = boom.replace({"pump_b.model": "PGI100-2-005"}).pump_b
            >>> round(smaller.displacement_per_rad * 2e6 * 3.14159265, 3)  # cm3/rev
            5.3
        """
        return _changed(self, with_models(self, changes)[0])


def part_class(annotation: Any) -> type[Part] | None:
    """The class of parts that a field holds, be the part optional or not; `None` if it holds something else."""
    found = model_class(annotation)
    return found if found is not None and issubclass(found, Part) else None


def with_models(part: Part, changes: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, str]]:
    """Changes of which each that names a model of the catalogue stands with all the values of that model.

    Returns:
        Changes value by value, and where those of the catalogue come from, by dotted path.

    Raises:
        UnknownNameError: the catalogue has no such model.
    """
    result: dict[str, Any] = {}
    sources: dict[str, str] = {}
    for path, value in changes.items():
        holder = path.rpartition(".")[0] if path.rpartition(".")[2] == "model" else path
        family = _family_at(part, holder)
        given = value if isinstance(value, Mapping) else {"model": value}
        if not family or not isinstance(given.get("model"), str):
            result[path] = value
            continue
        filled, origins = catalogue.filled(family, given)
        before = f"{holder}." if holder else ""
        sources |= {f"{before}{key}": source for key, source in origins.items() if f"{before}{key}" not in changes}
        if value is given or _at(part, holder) is None:  # a whole part, in place of another or of none
            result[holder] = filled
        else:
            values = {f"{before}{key}": item for key, item in filled.items()}
            result |= {key: item for key, item in values.items() if key == path or key not in changes}
    return result, sources


def _at(part: Part, path: str) -> Any:
    """What stands at a dotted path; `None` if nothing does."""
    found: Any = part
    for step in path.split(".") if path else ():
        found = found.get(step) if isinstance(found, dict) else getattr(found, step, None)
    return found


def _family_at(part: Part, path: str) -> str:
    """The kind under which the catalogue lists the part at a dotted path; empty if it does not."""
    found = _at(part, path)
    kind = type(found) if isinstance(found, Part) else None
    if found is None:  # an optional part that is not there yet
        before, _, key = path.rpartition(".")
        around = _at(part, before)
        field = type(around).model_fields.get(key) if isinstance(around, Part) else None
        kind = part_class(field.annotation) if field else None
    return kind.family if kind is not None and "model" in kind.model_fields else ""


def _changed(part: P, changes: Mapping[str, Any]) -> P:
    """A part with other values, which may stand in parts of it."""
    fields = type(part).model_fields
    own, nested = _by_head(changes)
    for head in (*own, *nested):
        if head not in fields:
            raise UnknownNameError("key", head, fields)
    for head, inner in nested.items():
        there = own.get(head, getattr(part, head))
        if isinstance(there, Part):
            own[head] = _changed(there, inner)
        elif isinstance(there, dict):
            own[head] = _changed_in(there, inner)
        else:
            raise UnknownNameError("key", f"{head}.{next(iter(inner))}", fields)
    given = {name: value for name, value in part if name in part.model_fields_set}  # a default stays one
    return validate(type(part), {**given, **own})


def _changed_in(parts: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """The same of a dictionary of parts or of values."""
    own, nested = _by_head(changes)
    result = {**parts, **own}
    for head, inner in nested.items():  # all of a part at once: a bore and its rod may both be too small for the other
        if head not in parts:
            raise UnknownNameError("key", head, parts)
        result[head] = _changed(result[head], inner)
    return result


def _by_head(changes: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
    """Changes of what a part holds itself, and of what those parts hold, by the first word of their path."""
    own: dict[str, Any] = {}
    nested: dict[str, dict[str, Any]] = {}
    for path, value in changes.items():
        head, _, rest = path.partition(".")
        if rest:
            nested.setdefault(head, {})[rest] = value
        else:
            own[head] = value
    return own, nested


@dataclass(frozen=True)
class Value:
    """One value of a description: where it stands, what it is, how it reads, and if it is more than a default."""

    path: str
    value: Any  # of a list the texts of its items
    declared: Quantity | None  # how; None of what is no physical value
    text: str
    given: bool = True

    @property
    def shown(self) -> str:
        """The value as a person would write it."""
        if isinstance(self.value, tuple):
            return ", ".join(self.value)
        return self.declared.show(self.value) if self.declared else str(self.value)


def walk(part: Part, prefix: str = "") -> Iterator[Value]:
    """Yield every value of a part and of the parts in it, in the order of their declaration.

    Args:
        part: a part, a unit or a machine.
        prefix: path of the part, ending in a dot, or empty.
    """
    for name, field in type(part).model_fields.items():
        given = name in part.model_fields_set
        yield from _walk_value(getattr(part, name), f"{prefix}{name}", field, given)


def _walk_value(value: Any, path: str, field: FieldInfo, given: bool) -> Iterator[Value]:
    if isinstance(value, Part):
        yield from walk(value, f"{path}.")
    elif isinstance(value, dict):
        inner = declared_items(field)
        for key, item in value.items():
            if isinstance(item, Part):
                yield from walk(item, f"{path}.{key}.")
            else:
                yield Value(f"{path}.{key}", item, inner, inner.text if inner else explain(field))
    elif isinstance(value, tuple):
        items = declared_items(field)
        yield Value(path, tuple(items.show(one) if items else str(one) for one in value), None, explain(field), given)
    elif value is not None:
        yield Value(path, value, declaration(field), explain(field), given)


def declared_items(field: FieldInfo) -> Quantity | None:
    """The declaration of the values of a dictionary or a tuple of `Annotated[float, quantity(...)]`."""
    for argument in getattr(field.annotation, "__args__", ()):
        for item in getattr(argument, "__metadata__", ()):
            if isinstance(item, Quantity):
                return item
    return None
