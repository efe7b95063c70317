"""The engine and the readers of logs against other programs on the same task, into results/bench.json's `peers`.

    python benchmarks/peers.py [--quick] [--out results/bench.json]

The cycle is the one of run.py, by SUNDIALS' CVODE as scikit-sundae has it, at the loosest tolerance that keeps the
position within 1e-6 m; `pip install scikit-sundae` brings it, and without it that row stays away. The files are a work
day, repeated: what a reader makes of one is a table of numbers, and ours is a log that was checked. Runs take turns,
medians count, and the interquartile range stands beside them.
"""

from __future__ import annotations

import argparse
import json
import os
import struct
import tempfile
import time
from pathlib import Path

import numpy as np
from bench_file import keep, rounded
from run import LIMIT, ODE, POSITION, SCALE, UNIT, job

from ramsight.duty import DriveReport, report, simulate
from ramsight.duty.work_day import work_day
from ramsight.engine.run import integrate
from ramsight.logs import read_log
from ramsight.logs.drive_log import write_log

ROWS, FRAMES = 1_000_000, 200_000
MAP = """speed = { channel = "606Ch" }
torque = { channel = "6077h", rated = "100000 mN m" }
temperature = { channel = "2010h:01h", unit = "degC", scale = 0.1 }

[[can.pdo]]
cob_id = 0x181
objects = ["606Ch", "6077h", "2010h:01 INT16"]
"""


def taking_turns(ways, repeats):
    """Median and interquartile range of the times of each [s]."""
    times = {name: [] for name in ways}
    for _ in range(repeats):
        for name, way in ways.items():
            begun = time.perf_counter()
            way()
            times[name].append(time.perf_counter() - begun)
    return {
        name: [float(np.median(one)), float(np.subtract(*np.percentile(one, [75, 25])))] for name, one in times.items()
    }


def by_cvode(one, rtol):
    """Final position of the cycle by CVODE with its dense exact Jacobian, restarted at the corners."""
    import casadi as ca
    from sksundae.cvode import CVODE

    f = ODE.function
    slope = ca.Function("J", [ODE.x, ODE.u, ODE.slope, ODE.p], [ca.densify(ca.jacobian(ODE.rhs, ODE.x))])
    state, segments = one.initial, one.segments
    for k, (a, b) in enumerate(zip(segments.start, segments.end, strict=True)):
        right, jacobian = _functions(f, slope, a, segments.value[k], segments.slope[k], segments.parameters[0])
        solver = CVODE(right, method="BDF", rtol=rtol, atol=rtol * SCALE, jacfn=jacobian, max_num_steps=100_000)
        state = solver.solve(np.array([a, b]), state).y[-1]
    return float(state[POSITION])


def _functions(f, slope, begun, value, rate, p):
    """Right-hand side and Jacobian of a segment, as CVODE calls them."""

    def right(t, y, out):
        out[:] = f(y, value + rate * (t - begun), rate, p).full().ravel()

    def jacobian(t, y, yp, out):
        out[:] = slope(y, value + rate * (t - begun), rate, p).full()

    return right, jacobian


def cycle(repeats):
    """One cycle: ours and CVODE's time, and CVODE's tolerance and error."""
    try:
        import sksundae  # noqa: F401
    except ModuleNotFoundError:
        return None
    one = job(441e3, 313.15)
    last = one.segments.end[-1:]
    exact = integrate(ODE, one.initial, one.segments, last, rtol=1e-11, tolerance_scale=1e-6).state[0, POSITION]
    for rtol in (a * 10.0**-b for b in range(3, 10) for a in (1.0, 0.3)):
        error = abs(by_cvode(one, rtol) - exact)
        if error <= LIMIT:
            break
    ways = {"ours": lambda: integrate(ODE, one.initial, one.segments, last), "cvode": lambda: by_cvode(one, rtol)}
    return {"rtol": rtol, "error_m": error, **taking_turns(ways, repeats)}


def files(folder, rows, frames):
    """A work day as CSV, Parquet and MF4 of so many rows, and as a BLF file of so many frames."""
    import can

    day = report(simulate(UNIT, work_day(UNIT, (100e3, 370e3), 313.15, seed=1)), DriveReport(seed=1))
    pick = np.arange(rows) % day.sizes["time"]
    log = day.isel(time=pick).assign_coords(time=0.02 * np.arange(rows))
    for suffix in ("csv", "parquet", "mf4"):
        write_log(log, folder / f"day.{suffix}")
    rpm, permille = log["motor_speed"].values * 30.0 / np.pi, log["motor_torque"].values * 10.0
    with can.BLFWriter(folder / "day.blf") as writer:
        for k in range(frames):
            data = struct.pack("<ihh", int(rpm[k]), int(permille[k]), 400)
            writer.on_message_received(
                can.Message(timestamp=1.7e9 + 0.02 * k, arbitration_id=0x181, data=data, is_extended_id=False)
            )
    (folder / "map.toml").write_text(MAP, encoding="utf-8")


def readers(folder, repeats):
    """Times of ours and of another program for each file."""
    import pandas
    from asammdf import MDF

    import can

    def frames():
        with can.BLFReader(folder / "day.blf") as reader:
            return [(m.timestamp, m.arbitration_id, m.data) for m in reader]

    others = {
        "csv": ("pandas.read_csv", lambda: pandas.read_csv(folder / "day.csv")),
        "parquet": ("pandas.read_parquet", lambda: pandas.read_parquet(folder / "day.parquet")),
        "mf4": ("asammdf, to_dataframe", lambda: MDF(folder / "day.mf4").to_dataframe()),
        "blf": ("python-can, frames alone", frames),
    }
    found = {}
    for suffix, (name, other) in others.items():
        mapped = (folder / "map.toml",) if suffix == "blf" else ()
        ways = {
            "ours": lambda suffix=suffix, mapped=mapped: read_log(folder / f"day.{suffix}", *mapped),
            "other": other,
        }
        found[suffix] = {"by": name, **taking_turns(ways, repeats)}
    return found


def table(found):
    """Table of docs/reference/performance.md."""
    rows = ["| task | ramsight [s] | other [s] | by |", "|---|---|---|---|"]
    if found["cycle"]:
        ours, other = found["cycle"]["ours"][0], found["cycle"]["cvode"][0]
        rows.append(f"| the cycle above | {ours:.4f} | {other:.2f} | CVODE 7 by scikit-sundae, dense exact Jacobian |")
    for suffix, one in found["logs"].items():
        size = f"{found['frames']:,} frames" if suffix == "blf" else f"{found['rows']:,} rows"
        rows.append(f"| read `.{suffix}`, {size} | {one['ours'][0]:.2f} | {one['other'][0]:.2f} | {one['by']} |")
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="smaller files and fewer repeats")
    parser.add_argument("--out", type=Path, default=Path("results/bench.json"))
    options = parser.parse_args()
    rows, frames, repeats = (ROWS // 20, FRAMES // 20, 1) if options.quick else (ROWS, FRAMES, 5)
    with tempfile.TemporaryDirectory() as folder:
        files(Path(folder), rows, frames)
        found = {"rows": rows, "frames": frames, "logs": readers(Path(folder), repeats)}
    found |= {"cycle": cycle(repeats), "load_average": os.getloadavg()[0]}
    found = rounded(found)
    keep({"peers": found}, options.out)
    print(json.dumps(found, indent=1), "\n".join(table(found)), sep="\n")


if __name__ == "__main__":
    main()
