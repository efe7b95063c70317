"""MDF files as asammdf reads them, in a process of its own: a damaged file ends that one and is an error here."""

from __future__ import annotations

import atexit
import json
import os
import queue
import subprocess
import sys
import threading
import weakref
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ramsight.arrays import Array
from ramsight.errors import DescriptionError, LogError
from ramsight.logs.header import is_unit
from ramsight.logs.lines import check_file, file_name, first_line, printable
from ramsight.units import parse

_PATIENCE, _BYTES_A_SECOND = 10.0, 1e6  # s for any answer, and so much more for a large file
_ANGLES = ("deg", "°", "rad", "°CA", "deg CA")
_NO_TIME = {2: "an angle", 3: "a distance", 4: "an index"}  # sync types of MDF
_START = 120.0  # s for the process to begin
_BLOCK = 1 << 20  # bytes that are taken at once
_BEGIN = "import sys; sys.path[:] = {path!r}; from ramsight.logs.mdf_worker import main; main()"


@dataclass(frozen=True)
class Group:
    """A group of channels that share a clock."""

    cycles: int
    master: int | None  # which channel is the clock, None if none is
    names: tuple[str, ...]
    units: tuple[str, ...]  # of the channels, "" where the file states none
    kind: int = 1  # sync type of the clock, as the file states it

    @property
    def timeless(self) -> str:
        """Why the samples have no time, "" if they have one."""
        if self.master is None:
            return "has no master channel, and so no time"
        name = printable(self.names[self.master])
        if self.kind in _NO_TIME:
            return f"its master channel {name} is {_NO_TIME[self.kind]}, and no time"
        unit = self.units[self.master]
        return f"its master channel {name} is in {printable(unit)}, and no time" if not self.second else ""

    @property
    def second(self) -> float:
        """Seconds for one of its clock's numbers, 0 if they are no time; those of an unknown unit are seconds."""
        unit = "" if self.master is None else self.units[self.master]
        try:
            return parse(f"1 {unit}", "s") if unit else 1.0
        except DescriptionError:
            return 0.0 if is_unit(unit) or unit in _ANGLES else 1.0


class MdfFile:
    """An MDF file.

    Raises:
        LogError: it is no MDF file, is damaged, or asammdf is not installed.
    """

    def __init__(self, path: str | Path) -> None:
        check_file(path)
        self._file = file_name(path)
        self._patience = _PATIENCE + Path(path).stat().st_size / _BYTES_A_SECOND
        if find_spec("asammdf") is None:
            raise LogError('needs the package asammdf: pip install "ramsight[logs]"', file=self._file)
        self._reader = _reader()
        request = {"do": "open", "path": str(Path(path).absolute())}
        opened = self._ask("is no MDF file, or a damaged one", None, request)[0]
        self._number: int = opened["file"]
        self.groups = [
            Group(one["cycles"], one["master"], tuple(one["names"]), tuple(one["units"]), one["kind"])
            for one in opened["groups"]
        ]
        weakref.finalize(self, _close, self._reader, self._number)

    def clock(self, group: int) -> Array:
        """The times of a group [s].

        Raises:
            LogError: it has none: its master channel is an angle, a distance or an index; or it is damaged.
        """
        if reason := self.groups[group].timeless:
            raise LogError(f"{reason}; record it over time", file=self._file, column=f"group {group}")
        request = {"do": "clock", "file": self._number, "group": group}
        times: Array = self._ask(f"is damaged in group {group}", None, request)[1][0]
        return times * self.groups[group].second

    def values(self, group: int, index: int, start: int, count: int, *, raw: bool = False) -> tuple[Any, Any]:
        """Samples of a channel, and which of them are invalid, None if nothing states so.

        What is no number comes as an empty array of text.
        """
        request = {"do": "values", "file": self._number, "group": group, "index": index}
        request |= {"start": start, "count": count, "raw": raw}
        arrays = self._ask(f"is damaged in group {group}", self.groups[group].names[index], request)[1]
        return arrays[0], arrays[1] if len(arrays) > 1 else None

    def _ask(self, what: str, channel: str | None, request: dict[str, Any]) -> tuple[Any, list[Any]]:
        try:
            return self._reader.ask(request, self._patience)
        except _ReadingError as error:
            raise LogError(f"{what}: {first_line(error)}", file=self._file, column=channel) from None


class _ReadingError(Exception):
    """What the reading process says, or its end."""


class _Reader:
    """The process, started with the first file and used for all."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self.owner = os.getpid()
        self._process = subprocess.Popen(
            [sys.executable, "-c", _BEGIN.format(path=sys.path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            bufsize=0,
        )
        self._has_answered = False
        self._said: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._rest = b""
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    @property
    def is_alive(self) -> bool:
        """Whether it can be asked."""
        return self.owner == os.getpid() and self._process.poll() is None

    def ask(self, request: dict[str, Any], patience: float) -> tuple[Any, list[Any]]:
        """Ask, and wait for the answer for some seconds; without one the process is ended."""
        with self._lock:
            patience = patience if self._has_answered else _START
            assert self._process.stdin is not None
            try:
                self._process.stdin.write(json.dumps(request).encode() + b"\n")
                head = json.loads(self._line(patience))
                arrays = [self._array(kind, shape, patience) for kind, shape in head["arrays"]]
            except (OSError, EOFError):
                self.end()
                raise _ReadingError("the reader of MDF files broke down over it") from None
            self._has_answered = True
        if "error" in head:
            raise _ReadingError(head["error"].strip() or head["kind"])
        return head["value"], arrays

    def end(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.wait()
        self._listener.join()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()

    def end_own(self) -> None:
        """End the process, if it is this one's and not that of the process it was forked from."""
        if self.owner == os.getpid():
            self.end()

    def _listen(self) -> None:
        """Take what the process says, until its end: a pipe of Windows cannot be waited for in another way."""
        assert self._process.stdout is not None
        while data := self._process.stdout.read(_BLOCK):
            self._said.put(data)
        self._said.put(b"")

    def _line(self, patience: float) -> bytes:
        data = self._some(patience)
        while b"\n" not in data:
            data += self._some(patience)
        line, _, self._rest = data.partition(b"\n")
        return line

    def _array(self, kind: str, shape: list[int], patience: float) -> NDArray[Any]:
        dtype = np.dtype(kind)
        size = int(np.prod(shape, dtype=np.int64)) * dtype.itemsize
        data = bytearray(self._rest[:size])
        self._rest = self._rest[size:]
        while len(data) < size:
            some = self._some(patience)
            self._rest = some[size - len(data) :]
            data += some[: size - len(data)]
        return np.frombuffer(data, dtype=dtype).reshape(shape)

    def _some(self, patience: float) -> bytes:
        try:
            data = self._said.get(timeout=patience)
        except queue.Empty:
            self.end()
            raise _ReadingError(f"no progress within {patience:.0f} s") from None
        if not data:
            raise EOFError
        return data


_current: list[_Reader] = []


def _reader() -> _Reader:
    """The process of this one, begun again if it has ended."""
    if not _current or not _current[0].is_alive:
        for ended in _current:
            ended.end_own()
        _current[:] = [_Reader()]
        atexit.register(_current[0].end_own)
    return _current[0]


def _close(reader: _Reader, number: int) -> None:
    if reader.is_alive:
        try:
            reader.ask({"do": "close", "file": number}, _PATIENCE)
        except _ReadingError:
            return
