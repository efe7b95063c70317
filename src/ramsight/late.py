"""Names of a room's face that are imported from their homes when they are asked for first."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def late(face: str, homes: Mapping[str, tuple[str, ...]]) -> Callable[[str], Any]:
    """The `__getattr__` of a face.

    Args:
        face: dotted name of the room.
        homes: names by the module of the room that has them.

    Example:
        >>> late("ramsight.units", {"conversion": ("RPM",)})("RPM") > 0.1
        True
    """
    home_of = {name: home for home, names in homes.items() for name in names}

    def found(name: str) -> Any:
        if name not in home_of:
            raise AttributeError(f"module {face!r} has no attribute {name!r}")
        one = getattr(import_module(f"{face}.{home_of[name]}"), name)
        setattr(sys.modules[face], name, one)
        return one

    return found
