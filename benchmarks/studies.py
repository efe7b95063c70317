"""Measures how many machines of a study a second are simulated and tracked, here and on Dask, into results/bench.json.

    python benchmarks/studies.py [--quick] [--out results/bench.json]

Runs take turns, so that a slow moment of the machine hits all alike, and the least time of each counts; workers have
everything compiled before that.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path

import numpy as np
from bench_file import keep, rounded

import ramsight.study.datasheet.machine_tasks as working
from ramsight import machine
from ramsight.study.datasheet.cluster import cluster, run
from ramsight.study.datasheet.measuring import measures, tracked
from ramsight.study.datasheet.studied_duties import Work
from ramsight.study.datasheet.study_plan import TASK, plan

CORES = len(os.sched_getaffinity(0))
MACHINES, QUICK = 12 * TASK, 2 * TASK  # enough that to lay out and to read the store is little


def study(count):
    return plan(machine.load_machine("mining-loader"), "boom", Work(), count=count)


def warm(spec):
    """Make what a worker needs before its time counts."""
    toml, unit, work, sensor = spec
    return working.bench_of(toml, unit, Work(**work), sensor).unit


def timed(function):
    start = time.perf_counter()
    function()
    return time.perf_counter() - start


def parts(whole, seconds):
    """Processor time of each part of a machine's work, on one thread [ms]."""
    order, rows = whole.order(range(TASK)), range(working.BESIDE)
    bench, spent = whole.bench, {}

    def measured(name, function, *given, **how):
        begun = time.process_time()
        found = function(*given, **how)
        spent.setdefault(name, []).append(1e3 * (time.process_time() - begun) / len(rows))
        return found

    kept = working.sampled
    for _ in range(seconds):
        working.sampled = partial(measured, "simulated", kept)
        done = measured("until_reported", working.runs, bench, order, rows)
        working.sampled, sensors = kept, [bench.virtual] * len(done)
        tracks = measured("tracked", tracked, done, sensors)
        measured("tracked_untold", partial(tracked, start_known=False), done, sensors)
        measured("measured", lambda several: [measures(one) for one in several], tracks)
    found = {name: float(np.median(values)) for name, values in spent.items()}
    found["drawn_and_reported"] = found.pop("until_reported") - found["simulated"]
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer machines and repeats")
    parser.add_argument("--out", type=Path, default=Path("results/bench.json"))
    parser.add_argument("--peak", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.peak:
        run(study(int(options.peak)), None)
        peak = next(row for row in Path("/proc/self/status").read_text().splitlines() if row.startswith("VmHWM"))
        print(float(peak.split()[1]) / 1024)
        return
    count, repeats = (QUICK, 1) if options.quick else (MACHINES, 4)
    whole = study(count)
    results = {"study_ms_of_a_machine": parts(whole, repeats)}
    spec = (whole.toml, whole.unit, asdict(whole.work), whole.sensor)
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        clients = {n: stack.enter_context(cluster("local", n)) for n in (1, 2)}
        for client in clients.values():
            client.run(warm, spec)
        number = 0

        def into(**how):
            nonlocal number
            number += 1
            run(replace(whole), Path(folder) / str(number), **how)

        into(threads=CORES)
        chunks = [file for file in (Path(folder) / "1").rglob("*") if file.is_file() and "c" in file.parts]
        results["study_store_bytes_per_machine"] = sum(file.stat().st_size for file in chunks) / count
        results["study_store_files_per_task"] = len(chunks) * TASK / count
        ways = {
            "plain_1": {"threads": 1}, "dask_1": {"client": clients[1]},
            "plain_2": {"threads": 2}, "dask_2": {"client": clients[2]},
        }  # fmt: skip
        times = {name: [] for name in ways}
        for _ in range(repeats):
            for name, how in ways.items():
                times[name].append(timed(lambda how=how: into(**how)))
                shutil.rmtree(Path(folder) / str(number))
    least = {name: min(values) for name, values in times.items()}
    results["study_load_average"] = os.getloadavg()[0]
    results["study_machines"] = count
    results["study_machines_per_s"] = count / least["plain_2"]
    results["study_machines_per_s_one_thread"] = count / least["plain_1"]
    results["study_dask_machines_per_s"] = count / least["dask_2"]
    results["study_dask_scaling"] = least["dask_1"] / least["dask_2"]
    results["study_dask_over_plain"] = least["dask_2"] / least["plain_2"]
    results["study_task_s"] = TASK * least["plain_1"] / count
    peak = subprocess.run(
        [sys.executable, __file__, "--peak", str(count)], check=True, capture_output=True, text=True
    ).stdout
    results["study_peak_mib"] = float(peak)
    parts_of_it = {k: float(f"{v:.3g}") for k, v in results["study_ms_of_a_machine"].items()}
    keep(rounded(results) | {"study_ms_of_a_machine": parts_of_it}, options.out)
    print(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
