"""Which kind of log of CAN frames a file is, by its suffix."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from ramsight.errors import LogError
from ramsight.logs.frames import Frame
from ramsight.logs.lines import Advance, file_name

Reader = Callable[[str | Path, Advance | None], Iterator[Frame]]
_LOOKED_AT = 1 << 10  # bytes


def open_frames(path: str | Path, advance: Advance | None = None) -> Iterator[Frame]:
    """The frames of a log, in order, by the file's suffix: BLF, ASC, TRC, candump, BUSMASTER, MDF or a table.

    A file that breaks off is read as far as it goes, with a warning.

    Args:
        path: the file.
        advance: is passed how much of the file has been read.

    Raises:
        LogError: the file cannot be read, is damaged, or holds no frames; with the place.
    """
    frames = _reader(path)(path, advance)
    first = next(frames, None)
    if first is None:
        raise LogError("holds no CAN frames", file=file_name(path))
    yield first
    yield from frames


def _reader(path: str | Path) -> Reader:
    name = Path(path).name.lower().removesuffix(".gz")
    if name.endswith(".blf"):
        from ramsight.logs.frames_blf import blf_frames

        return blf_frames
    if name.endswith((".mf4", ".mdf")):
        from ramsight.logs.frames_mdf import mdf_frames

        return mdf_frames
    if name.endswith(".trc"):
        from ramsight.logs.frames_trc import trc_frames

        return trc_frames
    if name.endswith((".csv", ".txt", ".tsv")):
        from ramsight.logs.frames_csv import csv_frames

        return csv_frames
    return _text_reader(path, name)


def _text_reader(path: str | Path, name: str) -> Reader:
    """Of a file of lines: ASC by its suffix; BUSMASTER and candump, which share theirs, by the first line."""
    from ramsight.logs.frames_text import BEGINS, asc_frames, busmaster_frames, candump_frames
    from ramsight.logs.packed import Unpacked

    if name.endswith(".asc"):
        return asc_frames
    first = next(iter(Unpacked(path, None, _LOOKED_AT)), b"").lstrip(b"\xef\xbb\xbf \r\n")
    return busmaster_frames if first.startswith(BEGINS.encode()) else candump_frames
