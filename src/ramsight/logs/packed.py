"""The bytes of a file, unpacked if it is a gzip file: bounded memory, and what a power cut left is read."""

from __future__ import annotations

import os
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO

from ramsight.errors import LogError, one_line

Advance = Callable[[float], object]
"""Called with the share of a file that was read since the last call; the shares add up to 1."""

_MOST, _TIMES = 1 << 30, 200  # bytes unpacked, times packed ones; logs are packed to a tenth, zeros to a thousandth
_GZIP = 31  # zlib's window size for a gzip header and trailer
_HELD, _HELD_TIMES = 64 << 20, 50  # bytes unpacked that are held at once, times packed ones; doubles pack to a quarter


def check_unpacked(size: int, path: str | Path) -> None:
    """Reject a file that is unpacked as a whole and is nothing but packed zeros, before it is.

    Args:
        size: what it unpacks to [bytes], by what it says of itself.

    Raises:
        LogError: it is more than any log of this size.
    """
    packed = max(Path(path).stat().st_size, 1)
    if size > max(_HELD, _HELD_TIMES * packed):
        text = f"unpacks to {size >> 20} MiB, {size // packed} times its size: no log does"
        raise LogError(text, file=file_name(path))


def file_name(path: str | Path) -> str:
    """A path as messages name it: whole, and on one line."""
    return one_line(path)


def check_file(path: str | Path) -> None:
    """Reject what is not there, or is no file.

    Raises:
        LogError: the file cannot be opened.
    """
    with opened(path):
        pass


def opened(path: str | Path) -> IO[bytes]:
    """A file for reading.

    Raises:
        LogError: it cannot be opened, or is no regular file.
    """
    file = file_name(path)
    try:
        if Path(path).exists() and not Path(path).is_file() and not Path(path).is_dir():
            raise LogError("is not a regular file", file=file)
        return open(path, "rb")
    except FileNotFoundError:
        raise LogError("no such file", file=file) from None
    except IsADirectoryError:
        raise LogError("is a directory, not a file", file=file) from None
    except OSError as error:
        raise LogError(f"cannot be read: {error.strerror or error}", file=file) from None
    except ValueError as error:  # a null character in the path
        raise LogError(f"cannot be read: {error}", file=file) from None


class Unpacked:
    """The bytes of a file, some at a time; of what it holds if its name ends in ``.gz``.

    Attributes:
        is_cut: after the last byte, whether the gzip file broke off before its end.
    """

    def __init__(self, path: str | Path, advance: Advance | None, size: int) -> None:
        self._path, self._file, self._advance, self._size = path, file_name(path), advance, size
        self.is_cut = False

    def __iter__(self) -> Iterator[bytes]:
        with opened(self._path) as stored:
            stored_blocks = self._stored(stored)
            if not str(self._path).endswith(".gz"):
                yield from stored_blocks
                return
            yield from self._members(stored_blocks)

    def _stored(self, stored: IO[bytes]) -> Iterator[bytes]:
        total = max(os.fstat(stored.fileno()).st_size, 1)
        try:
            while data := stored.read(self._size):
                if self._advance is not None:
                    self._advance(len(data) / total)
                yield data
        except OSError as error:
            raise LogError(f"cannot be read: {error.strerror or error}", file=self._file) from None

    def _members(self, stored: Iterator[bytes]) -> Iterator[bytes]:
        """What the members of a gzip file hold, one after the other; never more than `size` bytes at once."""
        unpacking, number, begun, total, packed = zlib.decompressobj(_GZIP), 0, False, 0, 0
        for data in stored:
            packed += len(data)
            while data:
                if not begun and number and not (data := data.lstrip(b"\0")):  # a tape's padding
                    break
                if not begun and not b"\x1f\x8b".startswith(data[:2]):
                    what = "is not a gzip file though its name ends in .gz" if not number else "is a damaged gzip file"
                    raise LogError(what, file=self._file)
                begun = True
                try:
                    unpacked = unpacking.decompress(data, self._size)
                except zlib.error:
                    raise LogError("is a damaged gzip file", file=self._file) from None
                total += len(unpacked)
                if total > _MOST and total > _TIMES * packed:
                    what = f"unpacks to more than {_MOST >> 30} GiB, over {_TIMES} times what it has: is it a log?"
                    raise LogError(f"{what} Unpack it first", file=self._file)
                if unpacked:
                    yield unpacked
                data = unpacking.unconsumed_tail
                if unpacking.eof:
                    data, begun, number = unpacking.unused_data, False, number + 1
                    unpacking = zlib.decompressobj(_GZIP)
        self.is_cut = begun
