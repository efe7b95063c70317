"""How near a batch is to what the processor's vector units can do: results/bench.json's `roofline`.

    python benchmarks/roofline.py [--quick] [--out results/bench.json]

The vector operations of a step are counted in the machine code of the batch's loop, as objdump shows it: a step is one
straight run. What an operation takes where none waits for another is measured on the same processor by small kernels in
C (peaks.c). The sum of both is what a step takes where units do not work at the same time. Runs and kernels take turns.
"""

from __future__ import annotations

import argparse
import ctypes
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from bench_file import keep, rounded

HERE = Path(__file__).parent
KINDS = {
    "fused": ("multiply and add at once", r"vfn?m(add|sub)\d+pd"),
    "either": ("add, subtract, multiply", r"v(add|sub|mul)pd"),
    "divide": ("divide", r"vdivpd"),
    "root": ("square root", r"vsqrtpd"),
    "choose": ("compare and choose", r"v(max|min|cmp\w*|blendm?v?)pd"),
}
"""Kernel of peaks.c, its words, and the vector instructions that count as it."""
FLOPS = {"fused": 2, "either": 1, "divide": 1, "root": 1, "choose": 0}
_HEADER = len(b"ramsight object 2\n") + 32 + 8  # of a kept object file: its mark, a digest, the size of a workspace
_RUNS, _ROUNDS, _TURNS = 512, 1_000_000, 9


def kernels(folder):
    """Functions that give what one operation takes [s], and on how many numbers."""
    path = folder / "peaks.so"
    command = ["gcc", "-O3", "-march=native", "-ffp-contract=fast", "-fno-math-errno", "-shared", "-fPIC"]
    subprocess.run([*command, str(HERE / "peaks.c"), "-o", str(path)], check=True)
    library, found = ctypes.CDLL(str(path)), {}
    for name in KINDS:
        found[name] = getattr(library, name)
        found[name].restype, found[name].argtypes = ctypes.c_double, [ctypes.c_long]
    return found, int(library.lanes())


def counted(cache, lanes):
    """Vector operations by kind, and vectors read and written, in the machine code of a batch's loop."""
    (path,) = cache.rglob("*integrate_lanes*.o")
    code = cache / "loop.o"
    code.write_bytes(path.read_bytes()[_HEADER:])
    shown = subprocess.run(["objdump", "-d", "--no-show-raw-insn", code], check=True, capture_output=True, text=True)
    register = "%zmm" if lanes == 8 else "%ymm"
    rows = [row.split("\t")[-1].split(maxsplit=1) for row in shown.stdout.splitlines() if register in row]
    found = Counter({name: sum(bool(re.fullmatch(of, row[0])) for row in rows) for name, (_, of) in KINDS.items()})
    return found, sum("(" in row[1] for row in rows)


def measured(quick):
    """The roofline: counts, times and shares."""
    from run import CORES, ODE, job

    from ramsight.engine.batch import batches
    from ramsight.engine.cache import WIDTH

    jobs = [job(50e3 + 391e3 * k / _RUNS, 293.15 + 50.0 * (k % 64) / 64.0) for k in range(_RUNS)]

    def step():
        begun = time.perf_counter()
        (found,) = batches(ODE, jobs, threads=1)
        return (time.perf_counter() - begun) * WIDTH / float((found.accepted + found.rejected).sum())

    step()
    with tempfile.TemporaryDirectory() as folder:
        ways, lanes = kernels(Path(folder))
        times = {name: [] for name in (*ways, "step")}
        for _ in range(3 if quick else _TURNS):
            for name, kernel in ways.items():
                times[name].append(kernel(_ROUNDS))
            times["step"].append(step())
    median = {name: sorted(values)[len(values) // 2] for name, values in times.items()}
    count, moved = counted(Path(os.environ["RAMSIGHT_CACHE"]), lanes)
    kinds = {
        name: {"count": count[name], "ns": 1e9 * median[name], "share": count[name] * median[name] / median["step"]}
        for name in KINDS
    }
    flops = lanes * sum(FLOPS[name] * count[name] for name in KINDS)
    return {
        "kinds": kinds,
        "lanes": lanes,
        "step_ns": 1e9 * median["step"] * lanes / WIDTH,
        "share": sum(one["share"] for one in kinds.values()),
        "gflops": 1e-9 * flops / median["step"] * WIDTH / lanes,
        "peak_gflops": 2e-9 * lanes / median["fused"],
        "flops_per_byte": flops / (8 * lanes * moved),
        "cores": CORES,
        "load_average": os.getloadavg()[0],
    }


def table(found):
    """Table of docs/reference/performance.md."""
    rows = [
        f"| operation on {found['lanes']} numbers | in a step | ns each | share of a step |",
        "|---|---|---|---|",
    ]
    for name, (words, _) in KINDS.items():
        one = found["kinds"][name]
        rows.append(f"| {words} | {one['count']} | {one['ns']:.2f} | {100 * one['share']:.0f} % |")
    rows.append(f"| **all of them** | | | **{100 * found['share']:.0f} %** |")
    return rows


def flops(found):
    """What that is in floating point operations, a sentence of the same page."""
    ours, peak, per_byte = found["gflops"], found["peak_gflops"], found["flops_per_byte"]
    return [
        f"In floating point operations these are {ours:.1f} GFLOP/s of the {peak:.1f} that one core does when it",
        f"multiplies and adds at once and nothing else. A step takes {found['step_ns']:.0f} ns for {found['lanes']}",
        f"runs, and does {per_byte:.2f} operations for each byte that it reads or writes, from the first-level cache.",
    ]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer repeats")
    parser.add_argument("--out", type=Path, default=Path("results/bench.json"))
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        os.environ["RAMSIGHT_CACHE"] = folder  # which the batch's machine code alone is in
        sys.path.insert(0, str(HERE))
        found = measured(options.quick)
    keep({"roofline": rounded(found)}, options.out)
    print(json.dumps(found, indent=1), "\n".join(table(found)), sep="\n")


if __name__ == "__main__":
    main()
