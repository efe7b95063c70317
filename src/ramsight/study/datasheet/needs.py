"""Packages that only studies need, imported when they are needed."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from ramsight.errors import RamsightError


class NeedsPackageError(RamsightError):
    """A package that is not installed."""


def needs(package: str, extra: str) -> Any:
    """A package that not everybody has.

    Args:
        package: to be imported.
        extra: the extra of ramsight that installs it.

    Raises:
        NeedsPackageError: it is not installed; the text says how to.

    Example:
        >>> needs("math", "study").pi > 3.0
        True
    """
    try:
        return import_module(package)
    except ImportError:
        top = package.partition(".")[0]
        raise NeedsPackageError(f'a study needs the package {top}: pip install "ramsight[{extra}]"') from None
