"""Values become parts, and what pydantic has to say of them becomes one line: file, key, value and allowed range."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, Tag, ValidationError

from ramsight.errors import MISTAKES, DescriptionError, first_of, short
from ramsight.machine.declare import declaration, explain, model_class
from ramsight.units import name_of

P = TypeVar("P", bound=BaseModel)


def validate(model: type[P], data: Mapping[str, Any], *, file: str | None = None, context: Any = None) -> P:
    """Build a part, turning what pydantic has to say into one line.

    Args:
        context: `FROM_FILE` where numbers without a unit must be rejected.

    Raises:
        DescriptionError: the first thing that is wrong, with all the others beside it.
    """
    try:
        return model.model_validate(dict(data), context=context)
    except ValidationError as error:
        problems = error.errors(include_url=False)
    # a misspelt key is both unknown and missing: the unknown one says more
    problems.sort(key=lambda problem: problem["type"] != "extra_forbidden")
    listed = [_one_line(model, dict(problem), file) for problem in problems[:MISTAKES]]
    raise first_of(listed, further=len(problems) - len(listed))


def _one_line(model: type[BaseModel], problem: dict[str, Any], file: str | None) -> DescriptionError:
    steps = [str(item) for item in problem["loc"]]
    location = [step for step in steps if not step.startswith("@")]
    context = problem.get("ctx", {})
    value, allowed = problem["input"], context.get("allowed")
    holder, field = _field_at(model, steps)
    kind = problem["type"]
    if kind == "extra_forbidden":
        known = list(holder.model_fields) if holder else []
        close = get_close_matches(short(location[-1]), known, n=1)
        hint = f"did you mean {close[0]!r}?" if close else f"known: {', '.join(known)}"
        message, value = f"unknown key; {hint}", None
    elif kind == "missing":
        message, value = f"is missing: {_describe(field)}", None
        if holder is not None and "model" in holder.model_fields:
            message += "; or name a model of the catalogue that has it"
    elif kind in ("quantity", "cross", "units"):
        message, value = context["text"], context.get("value")
        location += context["key"].split(".") if "key" in context else []
        if field is not None and (declared := declaration(field)) and not allowed:
            allowed = declared.range
    elif kind == "union_tag_not_found":
        stated = value.get("kind") if isinstance(value, dict) else None
        message = "needs the kind of part" if stated is None else "unknown choice"
        allowed = ", ".join(sorted(tag.removeprefix("@") for tag in _tagged(_field_at(model, steps[:-1])[1])))
        if isinstance(value, dict):
            location, value = [*location, "kind"], stated
        else:
            message, allowed = "expected a table of values", None
    elif kind in ("model_type", "model_attributes_type", "dict_type"):
        message = "expected a table of values"
    elif kind == "tuple_type":
        message = "expected a list of values"
    elif kind == "literal_error":
        message, allowed = "unknown choice", context.get("expected", "").replace("'", "")
    else:
        message = str(problem["msg"])
    value = value if isinstance(value, str | int | float) else None
    return DescriptionError(message, file=file, key=".".join(location), value=value, allowed=allowed)


def _field_at(model: type[BaseModel], location: list[str]) -> tuple[type[BaseModel] | None, Any]:
    """Follow a path through the classes: the class that holds its last key, and that key's field."""
    holder: type[BaseModel] | None = model
    field = None
    steps = list(location)
    while steps and holder is not None:
        field = holder.model_fields.get(steps.pop(0))
        if field is None or not steps:
            break
        inner: Any = field.annotation
        if any(step.startswith("@") for step in steps[:2]):  # one of several classes, by name
            while not steps[0].startswith("@"):
                steps.pop(0)
            tag = steps.pop(0)
            inner = _tagged(field)[tag]
            if not steps:
                field = None
            holder = inner
            continue
        if getattr(inner, "__origin__", None) is dict:
            inner = inner.__args__[1]
            steps.pop(0)
            if not steps:
                field = None
        holder = model_class(inner)
    return holder, field


def _tagged(field: Any) -> dict[str, type[BaseModel]]:
    """The classes that a field may hold, by the tag that tells them apart (`Annotated[Class, Tag("@name")]`)."""
    found: dict[str, type[BaseModel]] = {}
    left = [field.annotation, *field.metadata] if field is not None else []
    while left:
        annotation = left.pop()
        arguments = get_args(annotation)
        tags = [argument.tag for argument in arguments if isinstance(argument, Tag)]
        if tags:
            found |= dict.fromkeys(tags, arguments[0])
        left += [argument for argument in arguments if not isinstance(argument, Tag)]
    return found


def _describe(field: Any) -> str:
    if field is None:
        return "it has to be given"
    declared = declaration(field)
    part = model_class(field.annotation)
    if part is not None:
        needed = [name for name, inner in part.model_fields.items() if inner.is_required()]
        return f"{explain(field) or 'a table'}, with {', '.join(needed)}"
    if declared is None:
        return explain(field) or "a table of values"
    words = f"{declared.text} ({declared.range})" if declared.range else declared.text
    return f"{words}, {name_of(declared.unit)}"
