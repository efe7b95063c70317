"""A file that HDF5 can go on writing on a full disk: HDF5 does not survive an error, so the error is raised later."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import Any, Self


class ForgivingFile(io.RawIOBase):
    """A file for reading and writing that keeps what cannot be written in memory, and the error for `check`.

    Args:
        path: the file; an old one is replaced.
    """

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._file = open(path, "w+b", buffering=0)  # noqa: SIM115 - closed by `close`
        self._error: OSError | None = None
        self._unwritten: list[tuple[int, bytes]] = []
        self._place = self._size = 0

    def __enter__(self) -> Self:
        return self

    def check(self) -> None:
        """Raise the first error that there was.

        Raises:
            OSError: something could not be written.
        """
        if self._error is not None:
            raise self._error

    def readable(self) -> bool:
        """Whether it can be read: always."""
        return True

    def writable(self) -> bool:
        """Whether it can be written: always."""
        return True

    def seekable(self) -> bool:
        """Whether it has places to go to: always."""
        return True

    def tell(self) -> int:
        """The place of the next byte."""
        return self._place

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Go to a place."""
        begin = {os.SEEK_SET: 0, os.SEEK_CUR: self._place, os.SEEK_END: self._size}[whence]
        self._place = begin + offset
        return self._place

    def truncate(self, size: int | None = None) -> int:
        """Make the file this long."""
        self._size = self._place if size is None else size
        if self._error is None:
            try:
                self._file.truncate(self._size)
            except OSError as error:
                self._error = error
        return self._size

    def write(self, data: Any) -> int:
        """Write bytes; never fails."""
        content = bytes(data)
        done = 0
        if self._error is None:
            try:
                self._file.seek(self._place)
                while done < len(content):
                    done += self._file.write(content[done:]) or 0
            except OSError as error:
                self._error = error
        if done < len(content):
            self._unwritten.append((self._place + done, content[done:]))
        self._place += len(content)
        self._size = max(self._size, self._place)
        return len(content)

    def readinto(self, buffer: Any) -> int:
        """Read what was written, on the disk or not."""
        view = memoryview(buffer).cast("B")
        count = max(min(len(view), self._size - self._place), 0)
        self._file.seek(self._place)
        found = bytearray(self._file.read(count) or b"").ljust(count, b"\0")
        for place, content in self._unwritten:
            begin, end = max(place, self._place), min(place + len(content), self._place + count)
            if begin < end:
                found[begin - self._place : end - self._place] = content[begin - place : end - place]
        view[:count] = found
        self._place += count
        return count

    def close(self) -> None:
        """Close the file."""
        if not self.closed:
            self._file.close()
        super().close()
