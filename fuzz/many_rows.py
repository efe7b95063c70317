"""How a log of very many rows is tracked: `python fuzz/many_rows.py 1e8` writes it, tracks it and says time and memory.

A work day is repeated from one visit to the upper end to another, as CSV.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import psutil
from long_day import Prepared, prepare


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


def _parts(path: Path) -> Iterator[tuple[float, float]]:
    """Time and position at the end of each block, as the track goes."""
    from ramsight.logs import open_log

    judge = prepare(Path()).judge
    judge.sensor.start(0.7, 1e-3)
    for piece in open_log(path):
        found = judge.sensor.track(piece)
        yield float(found["time"].values[-1]), float(found["position"].values[-1])


def main() -> None:
    """Write, track, and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("rows", type=float)
    rows = int(parser.parse_args().rows)
    with tempfile.TemporaryDirectory() as folder:
        path, prepared = Path(folder) / "long.csv", prepare(Path())
        _written(prepared, rows, path)
        print(f"{rows} rows, {path.stat().st_size / 1e9:.2f} GB", flush=True)
        process, begun, memory, last = psutil.Process(), time.process_time(), [], (0.0, 0.0)
        for here in _parts(path):
            memory.append(process.memory_info().rss / 2**20)
            last = here
        used = time.process_time() - begun
        true = float(np.interp((last[0] + 0.01) % prepared.length, [one[0] for one in prepared.rows], prepared.true))
        print(f"{used:.0f} s of the processor, {1e6 * used / rows:.2f} us a row; {len(memory)} blocks")
        print(f"{memory[min(3, len(memory) - 1)]:.0f} MiB at first, {max(memory):.0f} MiB at most")
        print(f"at {last[0]:.2f} s the position is {1e3 * abs(last[1] - true):.2f} mm off")


if __name__ == "__main__":
    main()
