"""Packages that not everybody has: which extra installs them, and the one line that states it."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from types import ModuleType
from typing import Any

from ramsight.errors import MissingPackageError

USES = {
    "can": "the encoder", "datasets": "a Dataset", "figures": "a figure", "history": "a history",
    "identify": "an identification",
    "opcua": "an OPC UA server", "study": "a study", "studio": "the studio",
}  # fmt: skip
"""What an extra is for, as messages begin."""
PACKAGES = {
    "can": ("canopen",),
    "datasets": ("xarray", "h5netcdf", "h5py"),
    "figures": ("matplotlib",),
    "history": ("xarray", "sqlalchemy"),
    "identify": ("xarray", "scipy", "tomlkit"),
    "opcua": ("asyncua",),
    "study": ("xarray", "scipy", "matplotlib", "zarr"),
    "studio": ("nicegui",),
}
"""What is needed of an extra before long work is begun."""


def imported(package: str, extra: str, refused: Callable[[str], Exception]) -> ModuleType:
    """A package that one of ramsight's extras installs.

    Args:
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
        raise refused(_needed(package, extra)) from None


def needs(package: str, extra: str) -> Any:
    """A package without types that a study needs.

    Raises:
        MissingPackageError: it is not installed; the text states how to.

    Example:
        >>> needs("math", "study").pi > 3.0
        True
    """
    return imported(package, extra, lambda text: MissingPackageError(f"a study {text}"))


@contextmanager
def needing(extra: str) -> Iterator[None]:
    """Imports of packages that one of ramsight's extras installs, as a type checker sees them.

    Raises:
        MissingPackageError: one of them is not installed.

    Example:
        >>> with needing("figures"):
        ...     import graphs
        Traceback (most recent call last):
        ramsight.errors.MissingPackageError: a figure needs the package graphs: pip install "ramsight[figures]"
    """
    try:
        yield
    except ModuleNotFoundError as error:
        raise MissingPackageError(f"{USES[extra]} {_needed(error.name or 'of it', extra)}") from None


def missing(*extras: str) -> str:
    """What is not installed of some extras, and how to get it, as messages state it; "" if all is there.

    Example:
        >>> missing()
        ''
    """
    absent = {extra: one for extra in extras for one in reversed(PACKAGES[extra]) if find_spec(one) is None}
    if not absent:
        return ""
    first = next(iter(absent))
    return f"{USES[first]} {_needed(absent[first], ','.join(absent))}"


def check_extra(*extras: str) -> None:
    """Refuse long work whose result could not be made.

    Raises:
        MissingPackageError: a package of the extras is not installed.
    """
    if text := missing(*extras):
        raise MissingPackageError(text)


def _needed(package: str, extra: str) -> str:
    return f'needs the package {package.partition(".")[0]}: pip install "ramsight[{extra}]"'
