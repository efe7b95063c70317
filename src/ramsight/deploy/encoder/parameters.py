"""The parameters that 1010h stores and 1011h restores, in a small file that is replaced whole or not at all."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Set
from pathlib import Path

from ramsight.deploy.encoder import objects
from ramsight.deploy.encoder.server import NOT_STORED, Node, refuse
from ramsight.errors import OutputError
from ramsight.output.atomic import write_text

FORMAT = 1
SUFFIX = ".parameters"
_KEYS = {objects.code(*key): key for key in objects.STORED}

Values = dict[tuple[int, int], int]


class ParameterFile:
    """Keeps values of the object dictionary.

    Args:
        path: the file; made by the first `save`.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     kept = ParameterFile(Path(folder) / "boom.parameters")
        ...     kept.save({(0x1017, 0): 500})
        ...     kept.load()
        {(4119, 0): 500}
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)

    def save(self, values: Mapping[tuple[int, int], int]) -> None:
        """Replace the file; on return it is on the disk.

        Raises:
            OutputError: it cannot be written.
        """
        named = {objects.code(*key): value for key, value in sorted(values.items())}
        content = {"format": FORMAT, "checksum": _checksum(named), "parameters": named}
        write_text(json.dumps(content, indent=1) + "\n", self.path)

    def load(self) -> Values | None:
        """What is stored: nothing if there is no file, None if there is one that cannot be trusted."""
        try:
            content = json.loads(self.path.read_text(encoding="utf-8"))
            named = content["parameters"]
            if content["format"] != FORMAT or content["checksum"] != _checksum(named):
                return None
            return {_KEYS[name]: int(value) for name, value in named.items()}
        except FileNotFoundError:
            return {}
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            return None


def _checksum(named: Mapping[str, int]) -> str:
    return hashlib.sha256(json.dumps(named, sort_keys=True).encode()).hexdigest()


ALL = (objects.COMMUNICATION, objects.APPLICATION)
_GROUPS = {1: ALL, 2: (objects.COMMUNICATION,), 3: (objects.APPLICATION,)}
"""What the subindices of 1010h and 1011h stand for."""


class Stored:
    """The node's stored parameters.

    Args:
        file: where they are; None stores nothing.
        refusal: the abort code for a value that a parameter can never have; 0 if it can.

    Attributes:
        damaged: whether the file could not be trusted.
    """

    def __init__(
        self,
        node: Node,
        file: ParameterFile | None,
        overrides: Mapping[tuple[int, int], int],
        keep: Callable[[], bool],
        refusal: Callable[[int, int, int], int],
    ) -> None:
        self._node, self._file, self._overrides, self._keep = node, file, overrides, keep
        self._refusal = refusal
        self.damaged = False

    @property
    def is_possible(self) -> bool:
        """Whether there is a place to store in."""
        return self._file is not None

    def load(self, groups: tuple[str, ...]) -> Set[tuple[int, int]]:
        """Set the parameters of some groups to what is stored, or to their defaults; states which are stored at all."""
        stored = {} if self._file is None else self._file.load()
        if stored is not None and not all(self._is_possible(*key, value) for key, value in stored.items()):
            stored = None
        self.damaged = stored is None
        for index in {index for index, _ in objects.STORED if objects.GROUPS[index] in groups}:
            self._node.forget(index)
        values = {**(stored or {}), **self._overrides}
        for (index, subindex), value in values.items():
            if objects.GROUPS[index] in groups:
                self._node.set(index, subindex, value)
        return values.keys()

    def _is_possible(self, index: int, subindex: int, value: int) -> bool:
        entry = objects.ENTRIES[index, subindex]
        least, most = objects.limits(entry.type)
        low, high = (least if entry.low is None else entry.low), (most if entry.high is None else entry.high)
        return low <= value <= high and not self._refusal(index, subindex, value)

    def write(self, index: int, subindex: int, value: int) -> None:
        """Serve a signature written to 1010h or 1011h, or refuse it."""
        saves = index == 0x1010
        if value != (objects.SAVE if saves else objects.LOAD) or self._file is None or subindex not in _GROUPS:
            refuse(NOT_STORED)
        assert self._file is not None
        groups, kept = _GROUPS[subindex], self._file.load() or {}
        values: Values = {key: one for key, one in kept.items() if objects.GROUPS[key[0]] not in groups}
        if saves:
            values |= {key: self._node.get(*key) for key in objects.STORED if objects.GROUPS[key[0]] in groups}
        try:
            self._file.save(values)
        except OutputError:
            refuse(NOT_STORED)
        if saves and subindex == 1 and not self._keep():
            refuse(NOT_STORED)
        self.damaged = False
