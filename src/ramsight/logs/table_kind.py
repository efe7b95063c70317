"""What a table of text is, by its first lines: CAN frames, an export of TwinCAT Scope, or rows with a clock.

Programs that write frames agree on no names of columns, but each has its own header.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from ramsight.logs.packed import Unpacked

SCOPE_NAME = "Name"
"""Begins an export of TwinCAT Scope."""
_SCOPE_MARKS = ("SampleTime[ms]", "Starttime of export", "StartRecord", "EndRecord", "Endtime of export")
_NAMES = {
    "time": ("time", "time stamp", "timestamp", "timestampepoch", "time[s]", "time (s)", "time [s]"),
    "identifier": ("id", "identifier", "can id", "canid", "arbitration_id", "arbitration id", "message id"),
    "bus": ("bus", "channel", "chan", "chn", "buschannel", "can channel"),
    "extended": ("extended", "ide", "ext", "type"),
    "remote": ("rtr", "remote"),
    "error": ("error",),
    "length": ("len", "length", "datalength", "data length"),
    "code": ("dlc",),
    "flags": ("flags", "flag", "flg"),
    "data": ("data", "databytes", "data bytes", "payload"),
}
_BYTE = re.compile(r"(?:d|data|b|byte)[ _]?\[?([0-9]{1,2})\]?")
_LOOKED_AT = 1 << 14  # bytes, in which the header stands
_SEPARATORS = (";", ",", "\t")


@dataclass(frozen=True)
class FrameTable:
    """How a table of frames is laid out."""

    header_line: int  # line with the names of the columns, from 1
    separator: str
    names: tuple[str, ...]  # of the columns, in small letters
    places: dict[str, int]
    bytes_at: tuple[int, ...]  # places of the columns of single bytes, in order


def frame_table(path: str | Path) -> FrameTable | None:
    """The layout of a table of frames; None if the file is no such table.

    Raises:
        LogError: the file cannot be opened.
    """
    for number, line in enumerate(_first_lines(path), 1):
        for separator in _SEPARATORS:
            if separator in line and (found := _layout(number, line, separator)) is not None:
                return found
    return None


def _first_lines(path: str | Path) -> list[str]:
    """Those in which a header stands, without the mark of UTF-8."""
    first = next(iter(Unpacked(path, None, _LOOKED_AT)), b"")
    return first.decode("latin-1").removeprefix("ï»¿").splitlines()


def _layout(number: int, line: str, separator: str) -> FrameTable | None:
    names = tuple(cell.strip(' "').lower() for cell in line.lstrip("#").split(separator))
    places = {
        what: names.index(name) for what, known in _NAMES.items() for name in known[::-1] if name in names
    }  # the first of the known names that is there
    singles = sorted((int(match[1]), place) for place, name in enumerate(names) if (match := _BYTE.fullmatch(name)))
    has_data = len(singles) > 1 or "data" in places
    is_frames = {"time", "identifier"} <= places.keys() and has_data
    if not is_frames or not {"length", "code", "extended", "flags"} & places.keys():
        return None
    return FrameTable(number, separator, names, places, tuple(place for _, place in singles))


def holds_scope(path: str | Path) -> bool:
    """Whether a text file is an export of TwinCAT Scope."""
    begins = [line.replace(";", "\t").replace(",", "\t").partition("\t")[0] for line in _first_lines(path)]
    return begins[:1] == [SCOPE_NAME] and any(mark in begins for mark in _SCOPE_MARKS)
