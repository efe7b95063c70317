"""Data sets that a caller gives: whether they have what is needed of them."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ramsight.errors import DescriptionError, MissingColumnError
from ramsight.logs import read_truth
from ramsight.sensor.sample import REPORTED

if TYPE_CHECKING:
    import xarray


def checked(passed: Any, name: str, needed: Iterable[str] = REPORTED) -> xarray.Dataset:
    """A Dataset that has what is needed of it.

    Args:
        passed: an argument.
        name: of the argument, for messages.
        needed: names of variables; by default those of a drive log.

    Raises:
        DescriptionError: it is none.
        MissingColumnError: a variable is absent.
    """
    import xarray

    if not isinstance(passed, xarray.Dataset):
        allowed = "a file, or an xarray.Dataset over time"
        raise DescriptionError("is no Dataset", key=name, value=passed, allowed=allowed)
    missing = [one for one in needed if one not in passed.variables]
    if missing:
        raise MissingColumnError(file=name, missing=missing, found=[str(one) for one in passed.variables])
    return passed


def truth_argument(truth: str | Path | xarray.Dataset | None) -> str | Path | xarray.Dataset | None:
    """A true position as an argument: a file, which is read later, or a Dataset that has what is needed of it.

    Raises:
        DescriptionError: it is neither file nor Dataset.
        MissingColumnError: a variable is absent.
    """
    return truth if truth is None or isinstance(truth, str | Path) else checked(truth, "truth", ("time", "position"))


def truth_of(truth: str | Path | xarray.Dataset) -> xarray.Dataset:
    """The true position, from a file or as it is passed.

    Raises:
        LogError: the file cannot be read, or a variable is absent.
        DescriptionError: it is neither file nor Dataset.
    """
    return read_truth(truth) if isinstance(truth, str | Path) else checked(truth, "truth", ("time", "position"))
