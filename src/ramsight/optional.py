"""Packages that not everybody has, imported when they are needed."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from types import ModuleType


def imported(package: str, extra: str, refused: Callable[[str], Exception]) -> ModuleType:
    """A package that one of ramsight's extras installs.

    Args:
        package: to be imported.
        extra: the extra.
        refused: makes the error, of a text that states what is needed and how to get it.

    Raises:
        Exception: that of `refused`; the package is not installed.

    Example:
        >>> imported("math", "study", RuntimeError).pi > 3.0
        True
    """
    try:
        return importlib.import_module(package)
    except ImportError:
        top = package.partition(".")[0]
        raise refused(f'needs the package {top}: pip install "ramsight[{extra}]"') from None
