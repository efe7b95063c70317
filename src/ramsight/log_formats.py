"""Kinds of logs that are read: one list, for what opens a file and for every text that names them."""

from __future__ import annotations

from typing import NamedTuple


class Format(NamedTuple):
    """A kind of log."""

    name: str
    suffixes: tuple[str, ...]
    module: str  # of `ramsight.logs`, that reads it
    source: str


CSV = Format("CSV", (".csv", ".csv.gz", ".txt", ".txt.gz", ".tsv", ".tsv.gz"), "source_csv", "CsvSource")
MDF = Format("MF4", (".mf4", ".mdf"), "source_mdf", "MdfSource")
CAN = Format("CAN frames", (".blf", ".asc", ".asc.gz", ".log", ".log.gz", ".trc", ".trc.gz"), "source_can", "CanSource")
FORMATS = (
    CSV,
    Format("Parquet", (".parquet", ".pq"), "source_parquet", "ParquetSource"),
    MDF,
    Format("MCAP", (".mcap",), "source_mcap", "McapSource"),
    Format("TDMS", (".tdms",), "source_tdms", "TdmsSource"),
    Format("MATLAB", (".mat",), "source_mat", "MatSource"),
    Format("Excel", (".xlsx", ".xlsm"), "source_xlsx", "XlsxSource"),
    CAN,
)
"""All of them; a new kind is a line, and its reader."""
*_OTHERS, _LAST = (one.name for one in FORMATS)
READABLE = f"{', '.join(_OTHERS)} or {_LAST}"
"""Their names, for a sentence."""
