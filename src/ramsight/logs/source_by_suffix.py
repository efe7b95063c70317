"""Which kind of log a file is, by its suffix: the one place that knows all of them, and loads what is needed."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

from ramsight.errors import LogError
from ramsight.logs.lines import Advance, check_file, file_name
from ramsight.logs.mapped import ChannelMap
from ramsight.logs.source import Source

CSV = (".csv", ".csv.gz", ".txt", ".txt.gz", ".tsv", ".tsv.gz")
MDF = (".mf4", ".mdf")
CAN = (".blf", ".asc", ".asc.gz", ".log", ".log.gz", ".trc", ".trc.gz")
KINDS = {
    CAN: ("source_can", "CanSource"),
    (".parquet", ".pq"): ("source_parquet", "ParquetSource"),
    MDF: ("source_mdf", "MdfSource"),
    (".mcap",): ("source_mcap", "McapSource"),
    (".tdms",): ("source_tdms", "TdmsSource"),
    (".mat",): ("source_mat", "MatSource"),
    (".xlsx", ".xlsm"): ("source_xlsx", "XlsxSource"),
    CSV: ("source_csv", "CsvSource"),
}
"""Suffixes of each kind of log, with the module that reads it and the source there; a new kind is a line."""
READABLE = tuple(suffix for suffixes in KINDS for suffix in suffixes)
_FRAMES = KINDS[CAN]
_SCOPE = ("source_scope", "ScopeSource")


def open_source(path: str | Path, file_map: ChannelMap | None = None, advance: Advance | None = None) -> Source:
    """The source for a file, by its suffix; of a table by its header too.

    Args:
        path: the file.
        file_map: its channel map, if there is one.
        advance: is passed how much of the file has been read.

    Raises:
        LogError: the suffix is unknown, or the package that reads it is not installed.
    """
    name = Path(path).name.lower()
    found = next((kind for suffixes, kind in KINDS.items() if name.endswith(suffixes)), None)
    if found is None:
        check_file(path)
        raise LogError(f"unknown suffix of a log (known: {', '.join(READABLE)})", file=file_name(path))
    is_can = file_map is not None and file_map.is_can
    if name.endswith(CSV):
        found = _table_kind(path)
    elif is_can and name.endswith(MDF):
        found = _FRAMES
    if is_can and found != _FRAMES:
        known = ", ".join((*CAN, *MDF))
        raise LogError(f"its map is for CAN frames, which stand in {known} and tables of frames", file=file_name(path))
    module, source = found
    made: Source = getattr(import_module(f"ramsight.logs.{module}"), source)(path, file_map, advance)
    return made


def is_table(path: str | Path) -> bool:
    """Whether a file is a table of text: rows with a clock, whose layout can be guessed.

    Args:
        path: the file.
    """
    return Path(path).name.lower().endswith(CSV) and _table_kind(path) == KINDS[CSV]


def _table_kind(path: str | Path) -> tuple[str, str]:
    """What a table is: CAN frames, an export of TwinCAT Scope, or rows with a clock."""
    from ramsight.logs.frames_csv import frame_table
    from ramsight.logs.source_scope import holds_scope

    if frame_table(path) is not None:
        return _FRAMES
    return _SCOPE if holds_scope(path) else KINDS[CSV]
