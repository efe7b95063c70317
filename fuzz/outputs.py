"""Outputs whose writer is killed or finds a full disk: the old file or the new one is whole, and nothing is beside."""

from __future__ import annotations

import os
import resource
import signal
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from harness import READ, REFUSED, WRONG, Rng, Section

KILLS, FULL = 300, 300
_SUFFIXES = (".csv", ".csv.gz", ".parquet", ".mf4", ".nc", "folder")
_ROWS, _PIECES = 20_000, 6


def _prepare(folder: Path) -> Any:
    """Libraries loaded once, so that a killed writer dies while it writes and not while it imports."""
    pieces = [_piece(k) for k in range(_PIECES)]
    for suffix in _SUFFIXES:
        _write(_place(folder, f"warm{suffix}"), pieces[:1])
        _read(_place(folder, f"warm{suffix}"))
    return pieces


def _place(folder: Path, name: str) -> Path:
    return folder / name


def _piece(number: int) -> Any:
    import xarray

    time_s = np.arange(_ROWS) * 0.01 + number * _ROWS * 0.01
    values = {
        "position": ("time", np.sin(time_s), {"units": "m"}),
        "velocity": ("time", np.cos(time_s), {"units": "m/s"}),
    }
    return xarray.Dataset(values, coords={"time": ("time", time_s, {"units": "s"})})


def _write(path: Path, pieces: list[Any]) -> None:
    from ramsight.output import open_dataset, whole_folder

    if path.name.endswith("folder"):
        with whole_folder(path, last="done.csv") as draft:
            for number, piece in enumerate(pieces):
                np.savetxt(draft / f"{number}.csv", piece["position"].values[:5000])
            (draft / "done.csv").write_text(str(len(pieces)))
        return
    with open_dataset(path) as writer:
        for piece in pieces:
            writer.append(piece)


def _read(path: Path) -> int:
    """How many pieces a result holds; raises if it is not whole."""
    if path.name.endswith("folder"):
        count = int((path / "done.csv").read_text())
        rows = [len(np.loadtxt(path / f"{number}.csv")) for number in range(count)]
        return count if rows == [5000] * count else -1
    if path.name.endswith((".csv", ".csv.gz")):
        from ramsight.logs.csv_table import read_columns

        return len(read_columns(path, ["time_s", "position_m", "velocity_m_per_s"])["time_s"]) // _ROWS
    if path.name.endswith(".parquet"):
        import pyarrow.parquet

        return int(pyarrow.parquet.read_table(path, use_threads=False).num_rows) // _ROWS
    if path.name.endswith(".mf4"):
        from asammdf import MDF

        with MDF(path) as mdf:
            return len(mdf.get("position_m").samples) // _ROWS
    import xarray

    with xarray.open_dataset(path) as dataset:
        return int(dataset.position.size) // _ROWS


def _forked(work: Callable[[], None], delay: float | None) -> int:
    """Do something in a process of its own; its exit code, negative for the signal that killed it."""
    child = os.fork()
    if child == 0:
        code = 3
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                work()
            code = 0
        except Exception as error:
            from ramsight.errors import OutputError

            if isinstance(error, OutputError) and len(str(error).splitlines()) == 1:
                code = 2
        finally:
            os._exit(code)
    if delay is not None:
        time.sleep(delay)
        os.kill(child, signal.SIGKILL)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def _state(path: Path, before: int) -> str:
    """What is wrong with a result and what stands beside it; "" if nothing is."""
    beside = [one.name for one in path.parent.iterdir() if one != path]
    if beside:
        return f"left behind: {beside}"
    if not path.exists():
        return "" if not before else "the old result is gone"
    if path.name.endswith("folder") and not (path / "done.csv").exists():
        return ""  # a folder that existed is renewed file by file, and says by its last file when it is whole
    try:
        count = _read(path)
    except Exception as error:
        return f"cannot be read: {type(error).__name__}: {error}"
    return "" if count in {before, _PIECES} - {0} else f"holds {count} pieces of {_PIECES}"


def _start(rng: Rng, folder: Path, pieces: list[Any]) -> tuple[Path, int]:
    import shutil

    place = folder / "results"
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir()
    suffix = _SUFFIXES[int(rng.integers(len(_SUFFIXES)))]
    path, before = place / f"out{suffix}", int(rng.integers(2))
    if before:
        _write(path, pieces[:1])
    return path, before


def _kill(pieces: list[Any], rng: Rng, folder: Path) -> tuple[str, str]:
    path, before = _start(rng, folder, pieces)
    code = _forked(lambda: _write(path, pieces), float(rng.uniform(0.0, 0.12)))
    _forked(lambda: _sweep(path), None)
    wrong = _state(path, before)
    return (WRONG, f"{path.name}: {wrong}") if wrong else (REFUSED if code < 0 else READ, "")


def _sweep(path: Path) -> None:
    """What the next run with the same output does first."""
    from ramsight.output.atomic import sweep

    sweep(path)


def _full(pieces: list[Any], rng: Rng, folder: Path) -> tuple[str, str]:
    path, before = _start(rng, folder, pieces)
    most = int(rng.integers(1 << 19))

    def write() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, resource.RLIM_INFINITY))
        _write(path, pieces)

    code = _forked(write, None)
    if code not in (0, 2):
        return WRONG, f"{path.name}: the writer ended with {code} after {most} bytes"
    wrong = _state(path, before)
    return (WRONG, f"{path.name}: {wrong}") if wrong else (REFUSED if code else READ, "")


SECTIONS = [Section("output killed", KILLS, _prepare, _kill), Section("output on a full disk", FULL, _prepare, _full)]
