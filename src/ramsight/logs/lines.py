"""Text files as blocks of whole lines: bounded memory, one spelling of line ends, exact about what is no text."""

from __future__ import annotations

import gzip
import os
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO

from ramsight.errors import LogError

BLOCK = 1 << 20
"""Bytes read at once."""

_LONGEST_LINE = 1 << 24
_SHOWN = 40

Advance = Callable[[float], object]
"""Called with the share of a file that was read since the last call; the shares add up to 1."""


def printable(text: object) -> str:
    r"""Text fit for a one-line message: control characters escaped, cut after 40 characters.

    Example:
        >>> printable("a\nb")
        'a\\nb'
    """
    shown = str(text)
    if len(shown) > _SHOWN:
        shown = shown[:_SHOWN] + "…"
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in shown)


def file_name(path: str | Path) -> str:
    """A path as messages name it: whole, and on one line."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in str(path))


def check_file(path: str | Path) -> None:
    """Refuse what is not there, or is no file.

    Raises:
        LogError: the file cannot be opened.
    """
    with _opened(path, file_name(path)):
        pass


def line_blocks(
    path: str | Path, *, encoding: str = "utf-8", advance: Advance | None = None, size: int = BLOCK
) -> Iterator[bytes]:
    """The lines of a text file, or of one compressed with gzip if its name ends in ``.gz``, some at a time.

    Args:
        path: the file.
        encoding: of its letters; blocks are UTF-8 whatever it is.
        advance: told how much of the file has been read.
        size: bytes read at once.

    Yields:
        Whole lines as UTF-8, each ended by a newline; no byte-order mark, no blank lines at the end of the file.

    Raises:
        LogError: the file cannot be read, is damaged, or is no text in this encoding.
    """
    file = file_name(path)
    rest, lines, first = b"", 0, True
    for data in _raw(path, file, advance, size):
        if first:
            _check_start(data, path, file)
            data, first = data.removeprefix(b"\xef\xbb\xbf"), False
        block, rest = _whole_lines(rest + data)
        if len(rest) > _LONGEST_LINE and rest.strip():
            raise LogError("has a line of more than 16 million characters: is it a CSV file?", file=file)
        if block:
            yield _as_utf8(block, encoding, file, lines)
            lines += block.count(b"\n")
    block, _ = _whole_lines(rest.removesuffix(b"\r") + b"\n")
    if block:
        yield _as_utf8(block, encoding, file, lines)


def _whole_lines(data: bytes) -> tuple[bytes, bytes]:
    """Lines up to the last that is not blank, and what has to wait for more."""
    held = b""
    if data.endswith(b"\r"):  # perhaps half of a CRLF
        data, held = data[:-1], b"\r"
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    end = data.rfind(b"\n") + 1
    last = len(data[:end].rstrip())
    cut = data.find(b"\n", last) + 1 if last else 0
    return data[:cut], data[cut:] + held


def _as_utf8(block: bytes, encoding: str, file: str, lines: int) -> bytes:
    if block.isascii():
        return block
    try:
        text = block.decode(encoding)
    except UnicodeDecodeError as error:
        line = lines + block.count(b"\n", 0, error.start) + 1
        kind = encoding.upper() if encoding.lower() == "utf-8" else encoding
        raise LogError(f"byte 0x{block[error.start]:02x} is not {kind} text", file=file, line=line) from None
    return block if encoding.lower() == "utf-8" else text.encode("utf-8")


def _check_start(data: bytes, path: str | Path, file: str) -> None:
    if data.startswith(b"\x1f\x8b") and not str(path).endswith(".gz"):
        raise LogError("is a gzip file; give it a name that ends in .csv.gz", file=file)
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise LogError("is UTF-16 text; save it as UTF-8", file=file)


def _opened(path: str | Path, file: str) -> IO[bytes]:
    try:
        return open(path, "rb")
    except FileNotFoundError:
        raise LogError("no such file", file=file) from None
    except IsADirectoryError:
        raise LogError("is a directory, not a file", file=file) from None
    except OSError as error:
        raise LogError(f"cannot be read: {error.strerror or error}", file=file) from None
    except ValueError as error:  # a null character in the path
        raise LogError(f"cannot be read: {error}", file=file) from None


def _raw(path: str | Path, file: str, advance: Advance | None, size: int) -> Iterator[bytes]:
    """The file's bytes, unpacked, some at a time."""
    with _opened(path, file) as stored:
        total, before = max(os.fstat(stored.fileno()).st_size, 1), 0
        stream: IO[bytes] = gzip.GzipFile(fileobj=stored, mode="rb") if str(path).endswith(".gz") else stored  # type: ignore[assignment]
        while True:
            try:
                data = stream.read(size)
            except gzip.BadGzipFile:
                raise LogError("is not a gzip file though its name ends in .gz", file=file) from None
            except EOFError:
                raise LogError("is a gzip file that breaks off before its end", file=file) from None
            except zlib.error:
                raise LogError("is a damaged gzip file", file=file) from None
            except OSError as error:
                raise LogError(f"cannot be read: {error.strerror or error}", file=file) from None
            if not data:
                return
            if advance is not None:
                now = stored.tell()
                advance((now - before) / total)
                before = now
            yield data
