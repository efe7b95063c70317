"""Names of a face that are imported from their homes when they are asked for first."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import cache
from importlib import import_module
from typing import Any

_CHECKED = "TYPE_CHECKING"


def late(face: str) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """The `__getattr__` and `__dir__` of a face: what it imports under ``if TYPE_CHECKING`` is there for others, too.

    Args:
        face: dotted name of the room.

    Example:
        >>> from ramsight import logs
        >>> late("ramsight.logs")[0]("load_map").__module__
        'ramsight.logs.channel_map'
    """

    def found(name: str) -> Any:
        if name not in (homes := _homes(face)):
            raise AttributeError(f"module {face!r} has no attribute {name!r}")
        one = getattr(import_module(homes[name]), name)
        setattr(sys.modules[face], name, one)
        return one

    return found, lambda: sorted(sys.modules[face].__all__)


@cache
def _homes(face: str) -> dict[str, str]:
    """The module of each name, from the source: nothing is read before a name is asked for."""
    import ast
    from pkgutil import get_data

    body = ast.parse(get_data(face, "__init__.py") or b"").body  # from an archive as well
    checked = [one for one in body if isinstance(one, ast.If) and ast.unparse(one.test) == _CHECKED]
    imports = [one for block in checked for one in block.body if isinstance(one, ast.ImportFrom)]
    return {alias.name: str(one.module) for one in imports for alias in one.names}
