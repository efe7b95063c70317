"""What was worked out of a description, kept beside the machine code: names, orders and numbers, never a graph.

A kept thing is JSON in the cache's folder. Its name is the hash of all that it follows from: the content of the
described objects, the source of the whole package and the CasADi that is installed. A file that is damaged, of another
version or another's is as none.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ramsight.engine.private_folder import cache_directory, content_hash, write_whole
from ramsight.system import is_ours

T = TypeVar("T")

_PACKAGE = Path(__file__).parents[1]
_PLAIN = (str, int, float, bool, type(None))
_MAGIC = b"ramsight kept 1\n"
MOST = 64
"""Of one kind that are kept: whoever varies a machine a thousand times leaves no thousand files."""


def key_of(kind: str, *described: object) -> str | None:
    """The name of what follows from some objects of this package; None if one of them is not known through and through.

    Example:
        >>> key_of("sum", (1.0, 2.0)) == key_of("sum", (1.0, 2.0))
        True
        >>> key_of("sum", (1.0, 3.0)) == key_of("sum", (1.0, 2.0))
        False
        >>> key_of("sum", lambda: 1.0) is None
        True
    """
    try:
        content = "\n".join(_content(one) for one in described)
    except _UnknownError:
        return None
    return f"{kind}_{content_hash(content, _sources(), _installed('casadi'), _installed('numpy'))}"


class _UnknownError(Exception):
    """An object whose content is not known."""


def _content(value: object) -> str:
    """All that an object is, as text."""
    if isinstance(value, Enum):
        return f"{type(value).__qualname__}.{value.name}"
    if isinstance(value, np.ndarray):
        return f"array {value.dtype.str} {value.shape} {hashlib.sha256(value.tobytes()).hexdigest()}"
    if isinstance(value, np.generic):
        return f"{type(value).__name__} {value.item()!r}"
    if type(value) in _PLAIN:
        return repr(value)
    if isinstance(value, tuple | list):
        return f"{type(value).__name__}({','.join(map(_content, value))})"
    if isinstance(value, Mapping):
        return f"{{{','.join(f'{_content(key)}:{_content(one)}' for key, one in value.items())}}}"
    kind = type(value)
    if not kind.__module__.startswith("ramsight."):
        raise _UnknownError
    if is_dataclass(value):
        names = [one.name for one in fields(value)]
    elif hasattr(kind, "model_fields"):  # a part of a description
        names = list(kind.model_fields)
    else:
        raise _UnknownError
    inside = ",".join(f"{name}={_content(getattr(value, name))}" for name in names)
    return f"{kind.__module__}.{kind.__qualname__}({inside})"


@cache
def _sources() -> str:
    """The hash of every source file of the package."""
    found = hashlib.sha256()
    for folder, below, files in os.walk(_PACKAGE):
        below.sort()
        for name in sorted(files):
            if name.endswith(".py"):
                found.update(f"{os.path.relpath(folder, _PACKAGE)}/{name}\n".encode())
                with open(os.path.join(folder, name), "rb") as file:
                    found.update(file.read())
    return found.hexdigest()


def _installed(package: str) -> str:
    """What tells one installation of a package from the next, without importing it."""
    origin = getattr(find_spec(package), "origin", None)
    if origin is None:
        return ""
    stat = os.stat(origin)
    return f"{origin} {stat.st_size} {stat.st_mtime_ns}"


def read_kept(key: str | None) -> dict[str, Any] | None:
    """What is kept under a name; None if there is nothing that is whole and ours."""
    if key is None:
        return None
    path = cache_directory() / f"{key}.json"
    try:
        content = path.read_bytes() if is_ours(path) else b""
    except OSError:
        return None
    digest, _, rest = content.removeprefix(_MAGIC).partition(b"\n")
    if not content.startswith(_MAGIC) or digest != _digest(key, rest):
        return None
    with contextlib.suppress(OSError):  # used lately: what others keep meanwhile takes another one's place
        os.utime(path)
    found: dict[str, Any] = json.loads(rest)
    return found


def keep(key: str | None, found: Mapping[str, Any]) -> None:
    """Keep something under a name, if it can be kept."""
    if key is None:
        return
    rest = json.dumps(found).encode()
    folder, kind = cache_directory(), key.rpartition("_")[0]
    with contextlib.suppress(OSError):  # without a cache it is worked out each time
        write_whole(folder / f"{key}.json", _MAGIC + _digest(key, rest) + b"\n" + rest)
        by_age = sorted(folder.glob(f"{kind}_*.json"), key=_age)
        for old in by_age[:-MOST]:
            old.unlink(missing_ok=True)


def _age(path: Path) -> int:
    """When a file was written [ns]; 0 where another process has taken it away meanwhile."""
    try:
        return path.stat().st_mtime_ns
    except FileNotFoundError:
        return 0


def kept(
    key: str | None,
    make: Callable[[], T],
    described: Callable[[T], Mapping[str, Any]],
    restored: Callable[[dict[str, Any]], T],
) -> T:
    """What is kept under a name, restored; or it is made, and kept as it is described."""
    found = read_kept(key)
    if found is not None:
        return restored(found)
    made = make()
    keep(key, described(made))
    return made


def _digest(key: str, rest: bytes) -> bytes:
    return hashlib.sha256(key.encode() + rest).hexdigest().encode()
