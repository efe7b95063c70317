"""What kinds of arguments a public function takes: what its annotations say. Any other is refused in one line, by name.

Ranges, names and units are the function's own to check; here is text where a Dataset was meant, or a list for a truth.
"""

from __future__ import annotations

import ast
import builtins
import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache, wraps
from inspect import signature
from types import NoneType, UnionType
from typing import Any, ParamSpec, TypeVar, get_args, get_origin

from ramsight.errors import DescriptionError

P = ParamSpec("P")
R = TypeVar("R")

_ANY = (int, float, complex, object, Any)
"""Kinds that say too little here: whoever reads a quantity knows what is one."""
_WORDS: dict[Any, str] = {
    str: "text", bool: "truth, True or False", NoneType: "None", Mapping: "mapping", Callable: "function",
    Iterable: "list",
    os.PathLike: "path",
}  # fmt: skip
_NULL = "\0"
_LONGEST_PATH, _LONGEST_NAME = 4096, 255  # letters, of most file systems


def by_kind(function: Callable[P, R]) -> Callable[P, R]:
    """A function that refuses arguments of a kind that its annotations do not name.

    Args:
        function: with annotations as text; those that cannot be looked up are not checked.

    Example:
        >>> @by_kind
        ... def greet(name: str, loud: bool = False) -> str:
        ...     return name.upper() if loud else name
        >>> greet("boom", loud="yes")
        Traceback (most recent call last):
        ...
        ramsight.errors.DescriptionError: loud = 'yes': is no truth, True or False
    """

    @wraps(function)
    def checked(*args: P.args, **kwargs: P.kwargs) -> R:
        # What is missing, or too much, Python says by itself.
        for name, value in (*zip(_order(function), args, strict=False), *kwargs.items()):
            check_kind(value, name, _kinds(function).get(name, (object,)))
        return function(*args, **kwargs)

    return checked


def check_kind(value: object, name: str, kinds: tuple[type, ...]) -> None:
    """Refuse a value of another kind, and a path that no file can have.

    Args:
        kinds: that it may have; `object` among them for any.

    Raises:
        DescriptionError: it is of another kind.
    """
    if not isinstance(value, kinds) and not (bool in kinds and _is_truth(value)):
        words = list(dict.fromkeys(_WORDS.get(kind, kind.__name__) for kind in kinds))
        says = f"is neither {' nor '.join(words)}" if len(words) > 1 else f"is no {words[0]}"
        raise DescriptionError(says, key=name, value=value)
    if os.PathLike in kinds:
        check_path(value, name)


def check_path(value: object, name: str) -> None:
    """Refuse text and paths that no file can have, whatever it would be: the system's own error is none of ours.

    Args:
        value: an argument; what is no path at all is not looked at.

    Raises:
        DescriptionError: it is too long, or holds a null character.
    """
    if not isinstance(value, str | os.PathLike):
        return
    text = str(value)
    if _NULL in text:
        raise DescriptionError("holds a null character", key=name, value=text)
    if len(text) > _LONGEST_PATH or max(map(len, re.split(r"[/\\]", text))) > _LONGEST_NAME:
        raise DescriptionError("is too long for a name or a path", key=name, value=text)


def whole_argument(value: Any, name: str, least: int, most: int) -> int:
    """A whole number as an argument.

    Raises:
        DescriptionError: it is none, or out of range.
    """
    if isinstance(value, bool) or not (isinstance(value, int) and least <= value <= most):
        raise DescriptionError("is out of range", key=name, value=value, allowed=f"{least} to {most}")
    return value


def _is_truth(value: object) -> bool:
    """Whether it is a truth of NumPy's, which is none of Python's."""
    numpy: Any = sys.modules.get("numpy")
    return numpy is not None and isinstance(value, numpy.bool_)


@cache
def _order(function: Callable[..., Any]) -> tuple[str, ...]:
    """Names of the arguments that may be passed by their places."""
    places = (one for one in signature(function).parameters.values() if one.kind is one.POSITIONAL_OR_KEYWORD)
    return tuple(one.name for one in places)


@cache
def _kinds(function: Callable[..., Any]) -> dict[str, tuple[type, ...]]:
    """Kinds of each argument, as far as they can be looked up."""
    names = vars(builtins) | getattr(function, "__globals__", {})
    annotations = function.__annotations__.items()
    return {name: _looked_up(text, names) for name, text in annotations if isinstance(text, str) and name != "return"}


def _looked_up(text: str, names: Mapping[str, Any]) -> tuple[type, ...]:
    found = list(_parts(ast.parse(text, mode="eval").body, names))
    return tuple(object if one is None else one for one in found)


def _parts(node: ast.expr, names: Mapping[str, Any]) -> Iterator[type | None]:
    """The kinds of a union, one after the other; None for one that is not known."""
    if isinstance(node, ast.BinOp):
        yield from (*_parts(node.left, names), *_parts(node.right, names))
    elif isinstance(node, ast.Constant) and node.value is None:
        yield NoneType
    elif isinstance(node, ast.Subscript):
        yield from _parts(node.value, names)
    else:
        yield from _classes(names.get(node.id) if isinstance(node, ast.Name) else None)


def _classes(found: Any) -> Iterator[type | None]:
    """The classes of what a name stands for."""
    if isinstance(found, UnionType):
        for one in get_args(found):
            yield from _classes(one)
        return
    kind = get_origin(found) or found
    if isinstance(kind, type) and issubclass(kind, os.PathLike):
        yield os.PathLike
    else:
        known = isinstance(kind, type) and kind not in _ANY and not getattr(kind, "_is_protocol", False)
        yield kind if known else None
