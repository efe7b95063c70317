"""Datasets as files, whole or piece by piece."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from ramsight.errors import OutputError, one_line
from ramsight.output.atomic import atomic_path, suffix_of
from ramsight.output.cells import Coded
from ramsight.output.table_file import TABLE_FILES, TABLES, open_table, write_table
from ramsight.output.table_writer import TableWriter
from ramsight.signals import Dataset, Samples, Signals

DATASETS = (".nc", *TABLES)
DATASET_FILES = (".nc", *TABLE_FILES)


class DatasetWriter(Protocol):
    """Takes pieces of a `Dataset`, or of columns; made by `open_dataset`."""

    def append(self, piece: Samples) -> None:
        """Write a piece: over the same one dimension each time, with the same variables."""


@contextmanager
def open_dataset(
    path: str | Path, *, variables: Sequence[str] | None = None, words: Mapping[str, Mapping[int, str]] | None = None
) -> Iterator[DatasetWriter]:
    """A `Dataset` to be written piece by piece, in the format that the suffix says, whole or not at all.

    Args:
        path: the file: ``.nc`` (NetCDF) keeps all there is; ``.csv``, ``.csv.gz``, ``.parquet`` and ``.mf4`` are
            tables, whose columns are called by variable and unit; so are fields of ``.mcap``, whose topics hold all.
        variables: which of them a table has besides the dimension; None for all.
        words: for variables of whole numbers, what a table says in their place.

    Yields:
        Its writer.

    Raises:
        OutputError: the suffix is unknown, a package is missing, or the file cannot be written.

    Example:
        >>> import tempfile
        >>> import xarray
        >>> def rod(time):
        ...     values = {"position": ("time", [0.1], {"units": "m"})}
        ...     return xarray.Dataset(values, coords={"time": ("time", [time], {"units": "s"})})
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     with open_dataset(Path(folder) / "rod.csv") as writer:
        ...         writer.append(rod(0.0))
        ...         writer.append(rod(1.0))
        ...     print((Path(folder) / "rod.csv").read_text(), end="")
        time_s,position_m
        0.000000,0.100000
        1.000000,0.100000
    """
    suffix = suffix_of(path, DATASET_FILES)
    if suffix == ".nc":
        from ramsight.output.netcdf import NetcdfPieces

        with atomic_path(path) as draft, NetcdfPieces(draft, one_line(path)) as pieces:
            yield pieces
        return
    units: dict[str, str] = {}
    with open_table(path, units=units) as table:
        yield _Table(table, None if suffix == ".mcap" else variables, words or {}, units, one_line(path))


def write_dataset(dataset: Dataset, path: str | Path) -> None:
    """A `Dataset` in the format that the suffix says: NetCDF (``.nc``), or a table (``.csv``, ``.csv.gz``).

    NetCDF keeps all there is, compressed. In a table the variables over the one dimension are columns, named
    by variable and unit (``position`` in m is ``position_m``, ``pressure_a`` in Pa is ``pressure_a_pa``). Tables may
    be ``.parquet``, ``.mf4`` and ``.mcap`` too.

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
    if suffix_of(path, DATASET_FILES) == ".nc":
        _write_netcdf(dataset, path)
    else:
        write_table(_columns(dataset, None, one_line(path)), path)


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


class _Table:
    """A table that takes pieces of a `Dataset`."""

    def __init__(
        self,
        table: TableWriter,
        variables: Sequence[str] | None,
        words: Mapping[str, Mapping[int, str]],
        units: dict[str, str],
        shown: str,
    ) -> None:
        self._table, self._variables, self._words, self._units, self._shown = table, variables, words, units, shown

    def append(self, piece: Samples) -> None:
        columns: dict[str, Any] = dict(_columns(piece, self._variables, self._shown))
        for name, variable in (piece.columns if isinstance(piece, Signals) else piece.variables).items():
            unit = str(variable.attrs.get("units", ""))
            self._units[column_name(str(name), unit)] = "" if unit == "1" else unit
        for name, meanings in self._words.items():
            if name in columns:
                columns[name] = Coded(columns[name], meanings)
        self._table.append(columns)


def _columns(dataset: Samples, variables: Sequence[str] | None, shown: str) -> dict[str, np.ndarray[Any, Any]]:
    if isinstance(dataset, Signals):
        wanted = [name for name in ("time", *(variables or dataset.names)) if name in dataset]
        return {column_name(name, str(dataset[name].attrs.get("units", ""))): dataset[name].values for name in wanted}
    dims = [str(dim) for dim in dataset.sizes]
    many = [str(name) for name, variable in dataset.variables.items() if variable.ndim > 1]
    if len(dims) != 1 or many:
        raise OutputError(f"{shown}: a table has one dimension, this has {', '.join(dims) or 'none'}; write .nc")
    length = dataset.sizes[dims[0]]
    columns: dict[str, np.ndarray[Any, Any]] = {}
    others = [name for name in dataset.variables if name != dims[0]] if variables is None else variables
    for name in [dims[0], *others]:
        if name in dataset.variables:
            variable = dataset.variables[name]
            column = column_name(str(name), str(variable.attrs.get("units", "")))
            columns[column] = np.broadcast_to(variable.values, (length,))
    return columns


def _write_netcdf(dataset: Dataset, path: str | Path) -> None:
    encoding = {
        str(name): {"zlib": True, "complevel": 4, "shuffle": True}
        for name, variable in dataset.variables.items()
        if variable.ndim and variable.dtype.kind in "iufb"
    }
    with atomic_path(path) as draft:
        from ramsight.output.netcdf import write_netcdf

        try:
            write_netcdf(dataset, draft, encoding)
        except ImportError as error:
            raise OutputError(f"{one_line(path)}: NetCDF cannot be written: {one_line(error)}") from error
