"""1010h and 1011h: parameters into their file and back into the dictionary."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Set

from ramsight.deploy.encoder.objects import APPLICATION, COMMUNICATION, ENTRIES, GROUPS, LOAD, SAVE, STORED, limits
from ramsight.deploy.encoder.parameters import ParameterFile, Values
from ramsight.deploy.encoder.server import NOT_STORED, Node, refuse
from ramsight.errors import OutputError

ALL = (COMMUNICATION, APPLICATION)
_GROUPS = {1: ALL, 2: (COMMUNICATION,), 3: (APPLICATION,)}
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
        for index in {index for index, _ in STORED if GROUPS[index] in groups}:
            self._node.forget(index)
        values = {**(stored or {}), **self._overrides}
        for (index, subindex), value in values.items():
            if GROUPS[index] in groups:
                self._node.set(index, subindex, value)
        return values.keys()

    def _is_possible(self, index: int, subindex: int, value: int) -> bool:
        entry = ENTRIES[index, subindex]
        least, most = limits(entry.type)
        low, high = (least if entry.low is None else entry.low), (most if entry.high is None else entry.high)
        return low <= value <= high and not self._refusal(index, subindex, value)

    def write(self, index: int, subindex: int, value: int) -> None:
        """Serve a signature written to 1010h or 1011h, or refuse it."""
        saves = index == 0x1010
        if value != (SAVE if saves else LOAD) or self._file is None or subindex not in _GROUPS:
            refuse(NOT_STORED)
        assert self._file is not None
        groups, kept = _GROUPS[subindex], self._file.load() or {}
        values: Values = {key: one for key, one in kept.items() if GROUPS[key[0]] not in groups}
        if saves:
            values |= {key: self._node.get(*key) for key in STORED if GROUPS[key[0]] in groups}
        try:
            self._file.save(values)
        except OutputError:
            refuse(NOT_STORED)
        if saves and subindex == 1 and not self._keep():
            refuse(NOT_STORED)
        self.damaged = False
