"""The truth beside a drive log: what a simulation, or a test rig with a position sensor, knows."""

from __future__ import annotations

from pathlib import Path

from ramsight.logs.channels import POSITION, PRESSURE_A, PRESSURE_B, as_signals
from ramsight.logs.csv_table import read_timed
from ramsight.signals import Dataset, Signals


def read_truth(path: str | Path) -> Dataset:
    r"""The true position from a CSV file, or from one compressed with gzip if its name ends in ``.gz``.

    The file has the columns ``time_s`` and ``position_m``, and perhaps ``pressure_a_pa`` and
    ``pressure_b_pa``, in any order; others are ignored.

    Args:
        path: the file.

    Returns:
        Over ``time`` [s], as in the file and increasing: ``position`` [m] and, if the file has them,
        ``pressure_a`` and ``pressure_b`` [Pa], absolute.

    Raises:
        MissingColumnError: a column is absent.
        LogError: the file cannot be read, or what it says cannot be; with line and column.

    Example:
        >>> import pathlib, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     file = pathlib.Path(folder) / "truth.csv"
        ...     _ = file.write_text("time_s,position_m\n0.0,0.25\n0.1,0.26\n")
        ...     truth = read_truth(file)
        >>> truth.position.values.tolist()
        [0.25, 0.26]
    """
    return truth_signals(path).dataset()


def truth_signals(path: str | Path) -> Signals:
    """The same as columns; errors as `read_truth`."""
    columns = read_timed(path, [POSITION.column], [PRESSURE_A.column, PRESSURE_B.column])
    return as_signals(columns, (POSITION, PRESSURE_A, PRESSURE_B))
