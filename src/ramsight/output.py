"""Results appear whole or not at all: written beside their place under another name, then moved into it."""

from __future__ import annotations

import gzip
import os
import secrets
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ramsight.errors import OutputError

if TYPE_CHECKING:
    import xarray

DECIMALS = {
    "s": 6,
    "m": 6,
    "m_per_s": 6,
    "m3": 9,
    "m3_per_s": 9,
    "mm": 3,
    "rad_per_s": 4,
    "rpm": 3,
    "nm": 4,
    "n": 1,
    "pa": 0,
    "bar": 3,
    "k": 3,
    "c": 3,
    "w": 2,
    "j": 2,
}
"""Decimals of a column by the unit its name ends in; other columns of floats get nine significant digits."""

TABLES = (".csv", ".csv.gz")
DATASETS = (".nc", *TABLES)

_ROWS_AT_ONCE = 1 << 15


@contextmanager
def atomic_path(path: str | Path) -> Iterator[Path]:
    """A temporary file in the same directory that takes the place of ``path`` once the block has ended well.

    Its name ends as that of ``path`` does, so that libraries choose the same format. If the block raises, the
    temporary file is removed and whatever stood at ``path`` stays as it was.

    Args:
        path: where the result belongs.

    Yields:
        Path of the file to write.

    Raises:
        OutputError: there is no such directory, ``path`` is something other than a file, the file cannot be
            written, or the block wrote none.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     with atomic_path(Path(folder) / "answer.txt") as file:
        ...         _ = file.write_text("42")
        ...     [file.name for file in Path(folder).iterdir()]
        ['answer.txt']
    """
    shown = _one_line(path)
    target = _target(path, shown)
    draft = target.with_name(f".{secrets.token_hex(4)}-{target.name}")
    try:
        yield draft
        _settle(draft, target, shown)
    except OSError as error:
        if error.filename is not None and os.fsdecode(error.filename) != str(draft):
            raise
        raise OutputError(f"{shown}: cannot be written: {_one_line(error.strerror or error)}") from error
    finally:
        with suppress(OSError):
            draft.unlink(missing_ok=True)


def write_table(
    columns: Mapping[str, ArrayLike], path: str | Path, *, formats: Mapping[str, str] | None = None
) -> None:
    """Columns as a CSV file with a header, compressed with gzip if the name ends in ``.csv.gz``.

    The same columns always give the same bytes. Floats get decimals by the unit that the column's name ends
    in (`DECIMALS`); NaN is written as an empty cell, true and false as 1 and 0.

    Args:
        columns: column name to values, each of shape (n,).
        path: the file, ``.csv`` or ``.csv.gz``.
        formats: for columns of floats, column name to a format such as ``"%.12g"`` in place of the decimals.

    Raises:
        OutputError: the suffix is another one, or the file cannot be written.
        ValueError: the columns are not all of the same length, or not of one dimension.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     file = Path(folder) / "rod.csv"
        ...     write_table({"time_s": [0.0, 0.02], "position_m": [0.1, float("nan")]}, file)
        ...     print(file.read_text(), end="")
        time_s,position_m
        0.000000,0.100000
        0.020000,
    """
    suffix = _suffix(path, TABLES)
    arrays = {name: np.asarray(values) for name, values in columns.items()}
    if len({array.shape for array in arrays.values()}) > 1 or any(a.ndim != 1 for a in arrays.values()):
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())
        raise ValueError(f"columns of a table have one length and one dimension: {shapes}")
    with atomic_path(path) as draft, open(draft, "wb") as file:
        if suffix.endswith(".gz"):
            with gzip.GzipFile(filename="", mode="wb", fileobj=file, mtime=0) as packed:
                for text in _csv_text(arrays, formats or {}):
                    packed.write(text.encode("utf-8"))
        else:
            for text in _csv_text(arrays, formats or {}):
                file.write(text.encode("utf-8"))


def write_dataset(dataset: xarray.Dataset, path: str | Path) -> None:
    """A `Dataset` in the format that the suffix says: NetCDF (``.nc``), or a table (``.csv``, ``.csv.gz``).

    NetCDF keeps all there is, compressed. In a table the variables over the one dimension are columns, named
    by variable and unit (``position`` in m is ``position_m``, ``pressure_a`` in Pa is ``pressure_a_pa``).

    Args:
        dataset: what to write; for a table, over one dimension.
        path: the file.

    Raises:
        OutputError: the suffix is unknown, the dataset fits into no table, or the file cannot be written.

    Example:
        >>> import tempfile
        >>> import xarray
        >>> rod = xarray.Dataset(
        ...     {"position": ("time", [0.1, 0.2], {"units": "m"})},
        ...     coords={"time": ("time", [0.0, 1.0], {"units": "s"})},
        ... )
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     write_dataset(rod, Path(folder) / "rod.csv")
        ...     print((Path(folder) / "rod.csv").read_text(), end="")
        time_s,position_m
        0.000000,0.100000
        1.000000,0.200000
    """
    if _suffix(path, DATASETS) == ".nc":
        _write_netcdf(dataset, path)
    else:
        write_table(_dataset_columns(dataset, _one_line(path)), path)


def check_target(path: Path | None, suffixes: Sequence[str]) -> None:
    """Refuse a place that cannot be written, before long work rather than after it.

    Args:
        path: the file to be; `None` is always right.
        suffixes: the suffixes that are known for it.

    Raises:
        OutputError: the suffix is another one, or there is no such directory.
    """
    if path is not None:
        _suffix(path, suffixes)
        _target(path, _one_line(path))


def column_name(name: str, units: str) -> str:
    """The name of a table's column: that of the variable and its unit.

    Args:
        name: the variable's name.
        units: its unit, for example ``rad/s``; empty or ``1`` if it has none.

    Returns:
        The two joined by an underscore, the unit in lower case.

    Example:
        >>> column_name("pressure_a", "Pa"), column_name("motor_speed", "rad/s"), column_name("status", "")
        ('pressure_a_pa', 'motor_speed_rad_per_s', 'status')
    """
    unit = units.strip().lower().replace("/", "_per_").replace("**", "").replace("^", "").replace("·", "")
    unit = unit.replace(" ", "").replace("°", "").replace("%", "percent")
    return name if unit in ("", "1") else f"{name}_{unit}"


def _one_line(text: object) -> str:
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in str(text))


def _suffix(path: str | Path, known: Sequence[str]) -> str:
    name = Path(path).name
    fitting = [suffix for suffix in known if name.endswith(suffix) and name != suffix]
    if not fitting:
        raise OutputError(f"{_one_line(path)}: unknown suffix of a result (known: {', '.join(known)})")
    return fitting[-1]


def _target(path: str | Path, shown: str) -> Path:
    """Where the file really goes, links followed; refuses what could not be replaced."""
    try:
        target = Path(os.path.realpath(path))
        if target.is_dir():
            raise OutputError(f"{shown}: is a directory, not a file")
        if target.exists() and not target.is_file():
            raise OutputError(f"{shown}: is not a regular file")
        if not target.parent.is_dir():
            raise OutputError(f"{shown}: there is no directory {_one_line(Path(path).parent)}")
    except (OSError, ValueError) as error:
        text = error.strerror if isinstance(error, OSError) else error
        raise OutputError(f"{shown}: cannot be written: {_one_line(text)}") from error
    return target


def _settle(draft: Path, target: Path, shown: str) -> None:
    """Flush the draft to the disk and move it into its place."""
    if not draft.exists():
        raise OutputError(f"{shown}: nothing was written")
    with open(draft, "rb") as file:
        os.fsync(file.fileno())
    os.replace(draft, target)
    with suppress(OSError):  # some file systems cannot flush a directory
        folder = os.open(target.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def _csv_text(arrays: Mapping[str, np.ndarray[Any, Any]], formats: Mapping[str, str]) -> Iterator[str]:
    """The header, then the rows, some ten thousand at a time."""
    yield ",".join(_quoted(name) for name in arrays) + "\n"
    length = next((array.size for array in arrays.values()), 0)
    for start in range(0, length, _ROWS_AT_ONCE):
        cells = [
            _cells(array[start : start + _ROWS_AT_ONCE], name, formats.get(name)) for name, array in arrays.items()
        ]
        yield "\n".join(map(",".join, zip(*cells, strict=True))) + "\n"


def _cells(values: np.ndarray[Any, Any], name: str, form: str | None) -> list[str]:
    if values.dtype.kind in "iub":
        return [str(int(value)) for value in values]
    if values.dtype.kind != "f":
        return [_quoted(str(value)) for value in values]
    if form is None:
        decimals = _decimals(name)
        form = "%.9g" if decimals is None else f"%.{decimals}f"
        if decimals is not None:
            values = np.round(values, decimals)
    missing = np.isnan(values)
    texts = [form % value for value in (values + 0.0).tolist()]  # + 0.0 makes -0.0 a plain zero
    for index in np.flatnonzero(missing):
        texts[index] = ""
    return texts


def _decimals(name: str) -> int | None:
    fitting = [unit for unit in DECIMALS if name.endswith(f"_{unit}")]
    return DECIMALS[max(fitting, key=len)] if fitting else None


def _quoted(text: str) -> str:
    if not any(letter in text for letter in ',"\r\n'):
        return text
    doubled = text.replace('"', '""')
    return f'"{doubled}"'


def _dataset_columns(dataset: xarray.Dataset, shown: str) -> dict[str, np.ndarray[Any, Any]]:
    dims = [str(dim) for dim in dataset.sizes]
    many = [str(name) for name, variable in dataset.variables.items() if variable.ndim > 1]
    if len(dims) != 1 or many:
        raise OutputError(f"{shown}: a table has one dimension, this has {', '.join(dims) or 'none'}; write .nc")
    length = dataset.sizes[dims[0]]
    columns: dict[str, np.ndarray[Any, Any]] = {}
    for name in [dims[0], *(name for name in dataset.variables if name != dims[0])]:
        if name in dataset.variables:
            variable = dataset.variables[name]
            column = column_name(str(name), str(variable.attrs.get("units", "")))
            columns[column] = np.broadcast_to(variable.values, (length,))
    return columns


def _write_netcdf(dataset: xarray.Dataset, path: str | Path) -> None:
    encoding = {
        name: {"zlib": True, "complevel": 4, "shuffle": True}
        for name, variable in dataset.variables.items()
        if variable.ndim and variable.dtype.kind in "iufb"
    }
    with atomic_path(path) as draft:
        try:
            dataset.to_netcdf(draft, engine="h5netcdf", encoding=encoding)
        except ImportError as error:
            raise OutputError(f"{_one_line(path)}: NetCDF cannot be written: {_one_line(error)}") from error
