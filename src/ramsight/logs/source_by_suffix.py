"""Which kind of log a file is, by its suffix: the one place that knows all of them, and loads what is needed."""

from __future__ import annotations

from pathlib import Path

from ramsight.errors import LogError
from ramsight.logs.lines import Advance, check_file, file_name
from ramsight.logs.mapped import ChannelMap
from ramsight.logs.source import Source

CSV = (".csv", ".csv.gz", ".txt", ".txt.gz", ".tsv", ".tsv.gz")
PARQUET = (".parquet", ".pq")
MDF = (".mf4", ".mdf")
MCAP = (".mcap",)
CAN = (".blf", ".asc", ".asc.gz", ".log", ".log.gz", ".trc", ".trc.gz")
READABLE = (*CSV, *PARQUET, *MDF, *MCAP, *CAN)


def open_source(path: str | Path, file_map: ChannelMap | None = None, advance: Advance | None = None) -> Source:
    """The source for a file, by its suffix.

    Args:
        path: the file.
        file_map: its channel map, if there is one.
        advance: is passed how much of the file has been read.

    Raises:
        LogError: the suffix is unknown, or the package that reads it is not installed.
    """
    name = Path(path).name.lower()
    is_can = file_map is not None and file_map.is_can
    is_frames = name.endswith(CAN) or (is_can and name.endswith(MDF)) or (name.endswith(CSV) and holds_frames(path))
    if is_can and not is_frames:
        known = ", ".join((*CAN, *MDF))
        raise LogError(f"its map is for CAN frames, which stand in {known} and tables of frames", file=file_name(path))
    if is_frames:
        from ramsight.logs.source_can import CanSource

        return CanSource(path, file_map, advance)
    if name.endswith(PARQUET):
        from ramsight.logs.source_parquet import ParquetSource

        return ParquetSource(path, file_map, advance)
    if name.endswith(MDF):
        from ramsight.logs.source_mdf import MdfSource

        return MdfSource(path, advance)
    if name.endswith(MCAP):
        from ramsight.logs.source_mcap import McapSource

        return McapSource(path, advance)
    if name.endswith(CSV):
        from ramsight.logs.source_csv import CsvSource

        return CsvSource(path, file_map, advance)
    check_file(path)
    raise LogError(f"unknown suffix of a log (known: {', '.join(READABLE)})", file=file_name(path))


def holds_frames(path: str | Path) -> bool:
    """Whether a table is one of CAN frames, a row a frame.

    Args:
        path: the file.
    """
    from ramsight.logs.frames_csv import frame_table

    return frame_table(path) is not None
