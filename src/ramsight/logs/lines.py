"""Text files as blocks of whole lines: bounded memory, one spelling of line ends, exact about what is no text."""

from __future__ import annotations

import codecs
import shlex
from collections.abc import Iterator
from pathlib import Path

from ramsight.errors import LogError, one_line, short, warn_of_log
from ramsight.logs.packed import Advance, Unpacked, check_file, file_name

__all__ = ["BLOCK", "Advance", "check_file", "cut_short", "file_name", "first_line", "line_blocks", "printable"]

BLOCK = 1 << 20
"""Bytes read at once."""

_LONGEST_LINE = 1 << 24
_MOST_BLANK = 1 << 16  # blank lines, one after the other, before a line with text
_BLANK = b" \n\x0b\x0c"
_SHOWN = 40


def printable(text: object) -> str:
    r"""Text fit for a one-line message: control characters escaped, cut after 40 characters.

    Example:
        >>> printable("a\nb")
        'a\\nb'
    """
    shown = str(text)
    if len(shown) > _SHOWN:
        shown = shown[:_SHOWN] + "…"
    return one_line(shown)


def first_line(error: BaseException) -> str:
    r"""What an error of another library says, short and on one line.

    Example:
        >>> first_line(ValueError("cannot be\nread"))
        'cannot be'
    """
    text = str(error).strip().splitlines()
    said = one_line(text[0] if text else "")
    return short(said) or type(error).__name__


def cut_short(file: str, line: int) -> None:
    """Warn that the last line of a file is left out because its end is missing."""
    warn_of_log(
        f"the file breaks off in this line, which is left out; read up to line {line - 1}", file=file, line=line
    )


def line_blocks(
    path: str | Path,
    *,
    encoding: str = "utf-8",
    advance: Advance | None = None,
    size: int = BLOCK,
    blank: bytes = _BLANK,
) -> Iterator[bytes]:
    """The lines of a text file, or of one compressed with gzip if its name ends in ``.gz``, some at a time.

    What a power cut leaves behind is read up to the last whole line, with a warning: a gzip file without its end, null
    characters after the last line.

    Args:
        encoding: of its letters; blocks are UTF-8 whatever it is.
        blank: what makes a line blank; no tab unless said, because it separates cells.

    Yields:
        Whole lines as UTF-8, each ended by a newline; no byte-order mark, no blank lines at the end of the file. If the
        file does not end in a newline its last line comes alone, last and without one.

    Raises:
        LogError: the file cannot be read, is damaged, or is no text in this encoding.
    """
    lines = _Lines(path, encoding, blank)
    unpacked = Unpacked(path, advance, size)
    for data in unpacked:
        if block := lines.push(data):
            yield block
    if last := lines.end(unpacked.is_cut):
        yield last


class _Lines:
    """Turns pieces of a file into blocks of whole lines; keeps the unfinished one and counts blank ones."""

    def __init__(self, path: str | Path, encoding: str, blank: bytes) -> None:
        self._blanks = blank
        self._path, self._file, self._encoding = path, file_name(path), encoding
        self._rest, self._blank, self._lines, self._first = b"", 0, 0, True
        self._wide: codecs.IncrementalDecoder | None = None

    def push(self, data: bytes) -> bytes:
        """Take a piece; the lines up to the last that is not blank, "" if there is none."""
        if self._first:
            _check_start(data, self._path, self._file)
            if data.startswith((b"\xff\xfe", b"\xfe\xff")):
                self._wide, self._encoding = codecs.getincrementaldecoder("utf-16")(), "utf-8"
            data, self._first = data.removeprefix(b"\xef\xbb\xbf"), False
        if self._wide is not None:
            data = self._from_wide(data)
        data, held = self._rest + data, b""
        if data.endswith(b"\r"):  # perhaps half of a CRLF
            data, held = data[:-1], b"\r"
        if b"\r" in data:
            data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
        end = data.rfind(b"\n") + 1
        self._rest = data[end:] + held
        if len(self._rest) > _LONGEST_LINE:
            if self._rest.strip(b"\0"):
                raise LogError("has a line of more than 16 million characters: is it a CSV file?", file=self._file)
            self._rest = b"\0"
        filled = len(data[:end].rstrip(self._blanks))
        if not filled:
            self._blank += data.count(b"\n", 0, end)
            return b""
        cut = data.find(b"\n", filled) + 1
        block, blank = self._after_blank(data[:cut]), data.count(b"\n", cut, end)
        self._blank = blank
        return self._as_utf8(block)

    def _from_wide(self, data: bytes) -> bytes:
        """UTF-16 as UTF-8."""
        assert self._wide is not None
        try:
            return self._wide.decode(data).encode("utf-8")
        except UnicodeError:
            raise LogError("is not UTF-16 text though it begins so", file=self._file, line=self._lines + 1) from None

    def end(self, is_cut: bool) -> bytes:
        """The last line, "" if there is none or it broke off."""
        rest = self._rest
        if rest.endswith(b"\r"):
            rest = rest[:-1] + b"\n"
        if not rest.strip(_BLANK + b"\t"):
            rest = b""
        if is_cut:
            if not self._lines:
                what = "is a gzip file that breaks off before its first line has ended"
                raise LogError(what, file=self._file)
            warn_of_log(
                f"is a gzip file that breaks off before its end; read up to line {self._lines}", file=self._file
            )
            return b""
        if not rest:
            return b""
        if rest.endswith(b"\0") and self._lines:
            cut_short(self._file, self._lines + self._blank + 1)
            return b""
        return self._as_utf8(self._after_blank(rest))

    def _after_blank(self, block: bytes) -> bytes:
        """Lines with the blank ones before them."""
        if self._blank > _MOST_BLANK:
            raise LogError(f"{self._blank} blank lines follow: is it a log?", file=self._file, line=self._lines + 1)
        return b"\n" * self._blank + block

    def _as_utf8(self, block: bytes) -> bytes:
        encoding, before = self._encoding, self._lines
        self._lines += block.count(b"\n")
        if block.isascii():
            return block
        try:
            text = block.decode(encoding)
        except UnicodeDecodeError as error:
            line = before + block.count(b"\n", 0, error.start) + 1
            if error.reason == "unexpected end of data" and before and error.end == len(block):
                cut_short(self._file, line)
                return b""
            kind = encoding.upper() if encoding.lower() == "utf-8" else encoding
            what = f"byte 0x{block[error.start]:02x} is not {kind} text"
            if kind == "UTF-8":
                what += f"; save it as UTF-8, or, for a log, {inspect_command(self._file)} finds its encoding"
            raise LogError(what, file=self._file, line=line) from None
        return block if encoding.lower() == "utf-8" else text.encode("utf-8")


def _check_start(data: bytes, path: str | Path, file: str) -> None:
    if data.startswith(b"\x1f\x8b") and not str(path).endswith(".gz"):
        raise LogError("is a gzip file; give it a name that ends in .csv.gz", file=file)


def inspect_command(file: str) -> str:
    """The command that looks into a log and writes a first channel map for it.

    Example:
        >>> inspect_command("my day.csv")
        "ramsight logs inspect 'my day.csv' --out map.toml"
    """
    return f"ramsight logs inspect {shlex.quote(file)} --out map.toml"
