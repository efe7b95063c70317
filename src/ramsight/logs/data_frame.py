"""Data frames of other libraries as logs: whatever hands its columns to Arrow, pandas and polars among it."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ramsight.errors import LogError, MissingColumnError
from ramsight.logs.source import needs

_FRAME = "DataFrame"  # what messages call it, as they call a file by its name
_MAP = "channel_map says which is which"


def is_data_frame(passed: object) -> bool:
    """Whether something is a DataFrame of any library that can hand its columns to Arrow."""
    return hasattr(passed, "__dataframe__") or hasattr(passed, "__arrow_c_stream__")


def arrow_table(frame: Any) -> Any:
    """The columns of a DataFrame as an Arrow table; its index too, where that has a name.

    Raises:
        LogError: Arrow is not installed, or cannot read it.
    """
    arrow = needs("pyarrow", "logs", _FRAME)
    try:
        if hasattr(frame, "reset_index") and getattr(getattr(frame, "index", None), "name", None) is not None:
            frame = frame.reset_index()
        if hasattr(frame, "__arrow_c_stream__"):
            return arrow.table(frame)
        from pyarrow.interchange import from_dataframe

        return from_dataframe(frame)
    except (arrow.ArrowException, TypeError, ValueError) as error:
        raise LogError(f"cannot be read: {' '.join(str(error).split())}", file=_FRAME) from None


@contextmanager
def as_file(frame: Any) -> Iterator[Path]:
    """A DataFrame as a file that is read as any other, gone again afterwards; errors of that do not name the file.

    Raises:
        LogError: it cannot be read.
    """
    parquet, table = needs("pyarrow.parquet", "logs", _FRAME), arrow_table(frame)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"{_FRAME}.parquet"
        parquet.write_table(table, file)
        try:
            yield file
        except MissingColumnError as error:
            missing, found = error.missing, error.found
            raise MissingColumnError(file=_FRAME, missing=missing, found=found, what_next=_MAP) from None
        except LogError as error:
            error.file, error.args = _FRAME, (str(error).replace(str(file), _FRAME),)
            raise
