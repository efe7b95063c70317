"""A log of very many rows, tracked: `python fuzz/many_rows.py 1e6` writes it, tracks it and says time and memory.

A work day is repeated from one visit to the upper end to another, as CSV. It is silently wrong if it takes more than
500 MB, or if the position is off at the end.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from harness import READ, WRONG, Rng, Section
from judge import FARTHEST
from long_day import Prepared, prepare

ROWS = 10**8
_MOST = 500.0  # MB


def _written(prepared: Prepared, rows: int, path: Path) -> None:
    """A log of so many rows."""
    times, *columns = (np.array(one) for one in zip(*prepared.rows, strict=True))
    speed, torque, warmth = columns
    tails = [
        f",{n:.2f},{m:.4f},{k - 273.15:.1f}\n" for n, m, k in zip(30.0 * speed / np.pi, torque, warmth, strict=True)
    ]
    with path.open("w") as file:
        file.write("time_s,motor_speed_rpm,motor_torque_nm,oil_temperature_c\n")
        for turn in range(rows // len(tails) + 1):
            since = turn * prepared.length
            here = tails[: max(rows - turn * len(tails), 0)]
            file.writelines(
                f"{since + at:.2f}{tail}" for at, tail in zip(times[: len(here)].tolist(), here, strict=True)
            )


def _parts(prepared: Prepared, path: Path) -> Iterator[tuple[float, float]]:
    """Time and position at the end of each block, as the track goes."""
    from ramsight.logs import open_log

    sensor = prepared.judge.sensor
    sensor.start(prepared.true[0], 1e-3)
    for piece in open_log(path):
        found = sensor.track(piece)
        yield float(found["time"].values[-1]), float(found["position"].values[-1])


def tracked(prepared: Prepared, rows: int, folder: Path) -> tuple[str, str]:
    """Write a log of so many rows, track it, and say what it took."""
    path = folder / "long.csv"
    _written(prepared, rows, path)
    size, process, memory, last = path.stat().st_size / 1e9, psutil.Process(), [], (0.0, 0.0)
    begun, used = time.monotonic(), time.process_time()
    for here in _parts(prepared, path):
        memory.append(process.memory_info().rss / 1e6)
        last = here
    lasted, used = time.monotonic() - begun, time.process_time() - used
    path.unlink()
    true = float(np.interp((last[0] + 0.01) % prepared.length, [one[0] for one in prepared.rows], prepared.true))
    off = abs(last[1] - true)
    said = (
        f"{rows} rows, {size:.2f} GB: {lasted:.0f} s, {used:.0f} s of the processor, {1e6 * used / rows:.2f} us a row"
    )
    said += f"; {memory[min(3, len(memory) - 1)]:.0f} MB at first, {max(memory):.0f} MB at most"
    said += f"; {1e3 * off:.2f} mm off at {last[0]:.2f} s"
    return (READ if max(memory) < _MOST and off < FARTHEST else WRONG), said


def _check(prepared: Prepared, _: Rng, folder: Path) -> tuple[str, str]:
    return tracked(prepared, ROWS, folder)


def main() -> None:
    """Write, track, and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("rows", type=float)
    rows = int(parser.parse_args().rows)
    with tempfile.TemporaryDirectory() as folder:
        print(*tracked(prepare(Path()), rows, Path(folder)), sep="\n")


SECTIONS: list[Any] = [Section("log of 10^8 rows", 1, prepare, _check, 3600.0, tells=True)]

if __name__ == "__main__":
    main()
