"""Packages that only studies need, imported when they are needed."""

from __future__ import annotations

from typing import Any

from ramsight.errors import MissingPackageError
from ramsight.optional import imported


def needs(package: str, extra: str) -> Any:
    """A package that not everybody has.

    Args:
        package: to be imported.
        extra: the extra of ramsight that installs it.

    Raises:
        MissingPackageError: it is not installed; the text states how to.

    Example:
        >>> needs("math", "study").pi > 3.0
        True
    """
    return imported(package, extra, lambda text: MissingPackageError(f"a study {text}"))
