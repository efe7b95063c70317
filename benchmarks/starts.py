"""Processor time of whole commands, from the shell to their ends, with a warm cache; adds to results/bench.json.

    python benchmarks/starts.py --out results/bench.json [--runs 5] [--source FOLDER ...]

Processor time, user and system, is what a command costs whoever else uses the machine. With several sources (folders
with a `ramsight` package, for example of an older commit) their runs alternate, and only the first one's are written.
"""

import argparse
import os
import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median

from bench_file import keep

ROOT = Path(__file__).parents[1]
LOG = ROOT / "tests" / "traces" / "boom_441kN_40C.csv.gz"
BOOM = ("mining-loader", "--unit", "boom")
COMMANDS = {
    "track": ("track", BOOM[0], str(LOG), *BOOM[1:], "--start", "100 mm", "--out", "track.csv"),
    "simulate": ("simulate", *BOOM, "--load", "441 kN", "--out", "run.csv"),
    "help": ("--help",),
    "export_c": ("export", "c", *BOOM, "--out", "c"),
    "export_fmu": ("export", "fmu", *BOOM, "--out", "sensor.fmu"),
}
_EXPORTS = 3  # runs of an export, which takes longer


def spent(words, folder, source):
    """Processor time of a command and all that it starts [s]."""
    for left in ("c", "sensor.fmu"):
        path = folder / left
        shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
    known = os.environ | {"PYTHONPATH": str(source), "RAMSIGHT_CACHE": str(folder / "cache")}
    known |= {"PYTHONPYCACHEPREFIX": str(folder / "bytecode"), "PYTHONDONTWRITEBYTECODE": ""}  # as for a user
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, "-m", "ramsight", *words]
    subprocess.run(command, check=True, capture_output=True, cwd=folder, env=known)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("results/bench.json"))
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--source", type=Path, action="append", help="a folder with the package; may be repeated")
    parser.add_argument("--only", nargs="*", choices=COMMANDS, help="some of the commands")
    options = parser.parse_args()
    sources = [path.resolve() for path in options.source or [ROOT / "src"]]
    results: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as place:
        folders = [Path(place) / str(k) for k, _ in enumerate(sources)]
        for folder in folders:
            folder.mkdir()
        for name in options.only or COMMANDS:
            pairs = list(zip(folders, sources, strict=True))
            first = [spent(COMMANDS[name], *pair) for pair in pairs]
            runs = min(options.runs, _EXPORTS) if name.startswith("export") else options.runs
            times = list(zip(*([spent(COMMANDS[name], *pair) for pair in pairs] for _ in range(runs)), strict=True))
            print(
                f"{name:<11} first {first[0]:.2f} s, then {' against '.join(f'{median(one):.2f}' for one in times)} s"
            )
            results[f"{name}_processor_s"] = float(f"{median(times[0]):.3g}")
            results[f"{name}_first_processor_s"] = float(f"{first[0]:.3g}")
    keep(results, options.out)


if __name__ == "__main__":
    main()
