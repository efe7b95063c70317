"""How time and memory grow with a machine and with a log, into results/bench.json's `growth`.

    python benchmarks/growth.py [--quick] [--out results/bench.json]

Three things grow: the parts of a circuit (a chain of hoses that ends blind), the cylinders of a mechanism (a telescope,
each of whose stages carries all further ones, so that every cylinder feels all others), and the rows of a log. Each is
run in a process of its own with an empty cache. An exponent of 1 is linear growth.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
import tomllib
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from bench_file import keep

PARTS, CYLINDERS = (12, 25, 50, 100, 200), (1, 2, 3, 4, 6, 8)
ROWS = (10**4, 10**5, 10**6, 10**7)
_REPEATS = 5
_PERIOD = 0.02  # s, of a log's rows
HEADS = {
    "parts": ("parts of a circuit", "first run [s]", "later runs [ms]", "steps"),
    "cylinders": ("cylinders of a mechanism", "first run [s]", "later runs [ms]", "steps"),
    "rows": ("rows of a log", "`ramsight track` [s]", "rows a second", "peak memory [MiB]"),
}
"""Columns of each table: what grows, and what is measured of it."""


def _catalogue(name: str) -> str:
    import ramsight

    return (Path(ramsight.__file__).parent / f"machine/catalogue/machines/{name}.toml").read_text(encoding="utf-8")


def _hose(k: int, inlet: str, outlet: str) -> str:
    return (
        f'\n[units.axis.parts.added_{k}]\nkind = "hose"\ninlet = "{inlet}"\noutlet = "{outlet}"\nvolume = "0.02 l"\n'
        'length = "0.5 m"\ndiameter = "10 mm"\neffective_bulk_modulus = "1 GPa"\n'
    )


def of_parts(count: int) -> list[float]:
    """Time of a first and of later runs of a circuit with so many parts [s], and steps."""
    from ramsight.duty import lift_lower, simulate
    from ramsight.plant.build import build

    text = _catalogue("eha-test-bench")
    bare = len(tomllib.loads(text)["units"]["axis"]["parts"])
    nodes = ["chamber_a", *(f"added_{k}" for k in range(count - bare))]
    text += "".join(_hose(k, *pair) for k, pair in enumerate(pairwise(nodes)))
    unit = build(_described(text).unit("axis"), "axis")
    duty = lift_lower(unit, 10e3, 313.15)
    return _timed(lambda: simulate(unit, duty).attrs)


def of_cylinders(count: int) -> list[float]:
    """The same of a telescope with so many cylinders."""
    from ramsight.duty.linked_duty import LinkedDuty, simulate_linked
    from ramsight.duty.profile import Profile, constant
    from ramsight.plant.linked import build_linked

    head = _catalogue("forklift-mast").partition("[linkage]")[0]
    start = head.index("[units.lift]")
    units = "".join(head[start:].replace("units.lift", f"units.lift_{k}") for k in range(count))
    stages = "".join(_stage(k) for k in range(count))
    end = f'\n[linkage.payload]\nbody = "stage_{count - 1}"\nx = "0 m"\nz = "1 m"\nrated = "500 kg"\n'
    end += f'\n[linkage.tip]\nbody = "stage_{count - 1}"\nx = "0 m"\nz = "1 m"\n'
    whole = build_linked(_described(head[:start] + units + "[linkage]\n" + stages + end))
    speed = Profile([0.0, 1.0, 2.0, 6.0, 7.0, 9.0], [0.0, 0.0, 100.0, 100.0, 0.0, 0.0])
    names = [f"lift_{k}" for k in range(count)]
    duty = LinkedDuty(dict.fromkeys(names, speed), dict.fromkeys(names, constant(313.15)), dict.fromkeys(names, 0.1))
    return _timed(lambda: simulate_linked(whole, duty).attrs)


def _stage(k: int) -> str:
    """A stage of the telescope and its cylinder."""
    below = f"stage_{k - 1}" if k else "frame"
    parent = f'parent = "{below}"\n' if k else ""
    return (
        f'\n[linkage.bodies.stage_{k}]\nkind = "sliding"\n{parent}direction = "90 deg"\nmass = "100 kg"\n'
        'centre_of_mass = { x = "0 m", z = "1 m" }\nmoment_of_inertia = "20 kg m2"\n'
        f'\n[linkage.cylinders.lift_{k}]\nbase = {{ x = "{0.1 * k} m", z = "0.1 m", body = "{below}" }}\n'
        f'rod = {{ x = "{0.1 * k} m", z = "1.9 m", body = "stage_{k}" }}\nretracted_length = "1.8 m"\n'
    )


def _described(text: str) -> Any:
    from ramsight import machine

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "grown.toml"
        path.write_text(text, encoding="utf-8")
        return machine.load_machine(path)


def _timed(run: Any) -> list[float]:
    times = []
    for _ in range(1 + _REPEATS):
        begun = time.perf_counter()
        found = run()
        times.append(time.perf_counter() - begun)
    return [times[0], float(np.median(times[1:])), float(found["accepted_steps"] + found["rejected_steps"])]


def of_rows(count: int) -> list[float]:
    """Processor time of a whole `ramsight track` of a CSV with so many rows [s], and its peak memory [MiB]."""
    from ramsight import machine
    from ramsight.duty import DriveReport, report, simulate
    from ramsight.duty.work_day import work_day
    from ramsight.plant.build import build

    unit = build(machine.load_machine("mining-loader").unit("boom"), "boom")
    log = report(simulate(unit, work_day(unit, (100e3, 370e3), 313.15, seed=1)), DriveReport(seed=1))
    speed, torque, warmth = (log[name].values for name in ("motor_speed", "motor_torque", "oil_temperature"))
    tails = [
        f",{30.0 * w / np.pi:.2f},{m:.4f},{k - 273.15:.1f}\n" for w, m, k in zip(speed, torque, warmth, strict=True)
    ]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        with path.open("w", encoding="utf-8") as file:
            file.write("time_s,motor_speed_rpm,motor_torque_nm,oil_temperature_c\n")
            for first in range(0, count, len(tails)):
                part = tails[: count - first]
                file.writelines(f"{_PERIOD * (first + k):.2f}{tail}" for k, tail in enumerate(part))
        command = [sys.executable, "-m", "ramsight", "track", "mining-loader", str(path), "--unit", "boom"]
        command += ["--out", str(Path(folder) / "track.csv")]
        if count > min(ROWS):  # the cache is warm
            subprocess.run([sys.executable, __file__, "--one", "rows", str(min(ROWS))], check=True, capture_output=True)
        tracking = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        _, status, used = os.wait4(tracking.pid, 0)  # its own: the largest of all children may be the one that warmed
        tracking.returncode = os.waitstatus_to_exitcode(status)
    if tracking.returncode:
        sys.exit(f"{' '.join(command)}: exit code {tracking.returncode}")
    spent = used.ru_utime + used.ru_stime
    return [spent, count / spent, used.ru_maxrss / 1024]


GROWN = {"parts": (of_parts, PARTS), "cylinders": (of_cylinders, CYLINDERS), "rows": (of_rows, ROWS)}


def exponent(rows: list[list[float]], column: int) -> float:
    """Slope of the logarithm of a column over that of the first one, between the last two rows."""
    (a, b), (u, v) = ((row[0] for row in rows[-2:]), (row[column] for row in rows[-2:]))
    return float(np.log(v / u) / np.log(b / a))


def table(name: str, rows: list[list[float]]) -> list[str]:
    """Table of docs/reference/performance.md."""
    shown = ["| " + " | ".join(HEADS[name]) + " |", "|---|---|---|---|"]
    for count, *values in rows:
        first, second, third = (values[0], 1e3 * values[1], values[2]) if name != "rows" else values
        shown.append(f"| {count:,.0f} | {first:.1f} | {second:,.0f} | {third:,.0f} |")
    return shown


def exponents(found: dict[str, Any]) -> list[str]:
    """How each grows between its last two rows, a sentence of the same page."""
    parts, cylinders, rows = (found[f"{name}_exponent"] for name in HEADS)
    return [
        f"Between the last two lines of each table a run's time grows with the power {parts:.1f} of the parts and",
        f"{cylinders:.1f} of the cylinders, and a track's time with the power {rows:.1f} of the rows.",
    ]


def main() -> None:
    """Grow what is asked for, each size in a process of its own."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="the smallest two sizes of each")
    parser.add_argument("--out", type=Path, default=Path("results/bench.json"))
    parser.add_argument("--one", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        name, count = options.one
        print(json.dumps(GROWN[name][0](int(count))))
        return
    found: dict[str, Any] = {}
    for name, (_, counts) in GROWN.items():
        rows = []
        for count in counts[:2] if options.quick else counts:
            with tempfile.TemporaryDirectory() as cache:
                one = [sys.executable, __file__, "--one", name, str(count)]
                child = subprocess.run(
                    one, check=True, capture_output=True, text=True, env=os.environ | {"RAMSIGHT_CACHE": cache}
                )
            rows.append([count, *(float(f"{value:.4g}") for value in json.loads(child.stdout.splitlines()[-1]))])
            print(name, rows[-1], flush=True)
        found[name] = rows
        found[f"{name}_exponent"] = round(exponent(rows, 1 if name == "rows" else 2), 2)
    keep({"growth": found}, options.out)


if __name__ == "__main__":
    main()
