"""Which kind of log a file is, and which kind of log of CAN frames, by its suffix; what reads it is loaded then."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from ramsight.errors import LogError
from ramsight.log_formats import CAN, CSV, FORMATS, MDF, Format
from ramsight.logs.lines import Advance, check_file, file_name
from ramsight.logs.mapped import ChannelMap
from ramsight.logs.source import Source
from ramsight.logs.table_kind import frame_table, holds_scope

if TYPE_CHECKING:
    from ramsight.logs.frames import Frame

    Reader = Callable[[str | Path, Advance | None], Iterator[Frame]]

_SCOPE = Format(CSV.name, CSV.suffixes, "source_scope", "ScopeSource")


def open_source(path: str | Path, file_map: ChannelMap | None = None, advance: Advance | None = None) -> Source:
    """The source for a file, by its suffix; of a table by its header too.

    Raises:
        LogError: the suffix is unknown, or the package that reads it is not installed.
    """
    name = Path(path).name.lower()
    found = next((one for one in FORMATS if name.endswith(one.suffixes)), None)
    if found is None:
        check_file(path)
        known = ", ".join(suffix for one in FORMATS for suffix in one.suffixes)
        raise LogError(f"unknown suffix of a log (known: {known})", file=file_name(path))
    is_can = file_map is not None and file_map.is_can
    if name.endswith(CSV.suffixes):
        found = _table_kind(path)
    elif is_can and name.endswith(MDF.suffixes):
        found = CAN
    if is_can and found != CAN:
        known = ", ".join((*CAN.suffixes, *MDF.suffixes))
        raise LogError(f"its map is for CAN frames, which stand in {known} and tables of frames", file=file_name(path))
    made: Source = getattr(import_module(f"ramsight.logs.{found.module}"), found.source)(path, file_map, advance)
    return made


def is_table(path: str | Path) -> bool:
    """Whether a file is a table of text: rows with a clock, whose layout can be guessed."""
    return Path(path).name.lower().endswith(CSV.suffixes) and _table_kind(path) == CSV


def _table_kind(path: str | Path) -> Format:
    """What a table is: CAN frames, an export of TwinCAT Scope, or rows with a clock."""
    if frame_table(path) is not None:
        return CAN
    return _SCOPE if holds_scope(path) else CSV


_LOOKED_AT = 1 << 10  # bytes


def open_frames(path: str | Path, advance: Advance | None = None) -> Iterator[Frame]:
    """The frames of a log, in order, by the file's suffix: BLF, ASC, TRC, candump, BUSMASTER, MDF or a table.

    A file that breaks off is read as far as it goes, with a warning.

    Raises:
        LogError: the file cannot be read, is damaged, or holds no frames; with the place.
    """
    frames = _reader(path)(path, advance)
    first = next(frames, None)
    if first is None:
        raise LogError("holds no CAN frames", file=file_name(path))
    yield first
    yield from frames


_READERS = {
    (".blf",): ("frames_blf", "blf_frames"),
    (".mf4", ".mdf"): ("source_mdf", "mdf_frames"),
    (".trc",): ("frames_trc", "trc_frames"),
    (".csv", ".txt", ".tsv"): ("frames_csv", "csv_frames"),
}


def _reader(path: str | Path) -> Reader:
    name = Path(path).name.lower().removesuffix(".gz")
    for suffixes, (module, reader) in _READERS.items():
        if name.endswith(suffixes):
            found: Reader = getattr(import_module(f"ramsight.logs.{module}"), reader)
            return found
    return _text_reader(path, name)


def _text_reader(path: str | Path, name: str) -> Reader:
    """Of a file of lines: ASC by its suffix; BUSMASTER and candump, which share theirs, by the first line."""
    from ramsight.logs.frames_text import BEGINS, asc_frames, busmaster_frames, candump_frames
    from ramsight.logs.packed import Unpacked

    if name.endswith(".asc"):
        return asc_frames
    first = next(iter(Unpacked(path, None, _LOOKED_AT)), b"").lstrip(b"\xef\xbb\xbf \r\n")
    return busmaster_frames if first.startswith(BEGINS.encode()) else candump_frames
