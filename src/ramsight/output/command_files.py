"""The files that are passed to a command: none of those it writes is one that it reads, or one of another kind."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from ramsight.errors import OutputError, one_line

_STATE = b"ramsight state"
_LARGEST_STATE = 1 << 16


def check_apart(reads: Mapping[str, str | Path | None], writes: Mapping[str, str | Path | None]) -> None:
    """Reject to write one file twice, or over a file that is read; links are followed.

    Args:
        reads: what is read, by what messages call it, for example ``the log``; None is passed over.
        writes: what is written, for example ``--out``.

    Raises:
        OutputError: two of them are one file; names both.

    Example:
        >>> check_apart({"the log": "log.csv"}, {"--out": "./log.csv"})
        Traceback (most recent call last):
        ...
        ramsight.errors.OutputError: ./log.csv: is --out and the log; give another file
    """
    before = [(name, path) for name, path in reads.items() if path is not None and Path(path).is_file()]
    before += [(name, path) for name, path in reads.items() if path is not None and not Path(path).exists()]
    for name, path in writes.items():
        if path is None:
            continue
        for other_name, other in before:
            if _is_same(path, other):
                raise OutputError(f"{one_line(path)}: is {name} and {other_name}; give another file")
        before.append((name, path))


def check_state(path: Path | None) -> None:
    """Reject a file for a sensor's state that is something else.

    Args:
        path: the file to be; None, a file that is not there and an empty one are right.

    Raises:
        OutputError: it holds something else, or cannot be read.
    """
    if path is None or not path.exists():
        return
    try:
        if not path.is_file():
            raise OutputError(f"{one_line(path)}: is not a regular file")
        with open(path, "rb") as file:
            content = file.read(_LARGEST_STATE + 1)
    except OSError as error:
        raise OutputError(f"{one_line(path)}: cannot be read: {one_line(error.strerror or error)}") from error
    is_erased = not content.strip(b"\0") or not content.strip(b"\xff")
    if len(content) > _LARGEST_STATE or not (_STATE in content or is_erased):
        raise OutputError(f"{one_line(path)}: is there already, and is no state of a sensor; give another file")


def _is_same(one: str | Path, other: str | Path) -> bool:
    try:
        return os.path.samefile(one, other)
    except (OSError, ValueError):
        return _real(one) == _real(other)


def _real(path: str | Path) -> str:
    try:
        return os.path.realpath(path)
    except (OSError, ValueError):
        return str(path)
