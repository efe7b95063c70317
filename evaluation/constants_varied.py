"""Each constant of the sensor, times and over 1.5, on recorded and simulated logs: results/constants.json.

python evaluation/constants_varied.py --out results/constants.json [--only NAME ...] [--jobs 2]
python evaluation/constants_varied.py --tests results/constants_tested.json [--only NAME ...] [--jobs 2]

With --only the other constants in the file stay as they are. Each variant is a process of its own, which changes the
constant, and what is computed from it, before a sensor is made. Every log is tracked with an unknown start and with the
exact one. What one variant moves is compared on the machine that the others were run on.

A constant of which no log shows anything has a test of the signal on which it decides, by constants_varied.toml. With
--tests these run: as the constants are they have to pass, and with theirs times or over 1.5 to fail.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import re
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from ramsight.output import write_text
from ramsight.progress import progress

ROOT = Path(__file__).parents[1]
TRACES = ROOT / "tests" / "traces"
TESTED = Path(__file__).with_suffix(".toml")
TABLE = "ramsight.sensor.thresholds"
FACTOR = 1.5
UNITS = ("boom", "bucket")
SEED = 11
"""Of the simulated logs."""
BASE = "as they are"
"""The row of the constants that nothing has changed."""
SEEN = 1e-6
"""Change of a position [m] that is no rounding."""
HOW = (("times", FACTOR), ("over", 1.0 / FACTOR))
FIGURES = ("p95", "coverage", "wrong_and_ok", "ok", "beyond_bound")
_SIGNALS = {"motor_speed": "rad/s", "motor_torque": "N m", "oil_temperature": "K"}


def table_text() -> str:
    """Source of the table of constants."""
    spec = importlib.util.find_spec(TABLE)
    assert spec is not None
    assert spec.origin is not None
    return Path(spec.origin).read_text(encoding="utf-8")


def names() -> list[str]:
    """Of all constants, in the table's order."""
    return re.findall(r"^(\w+) = Constant\(", table_text(), re.MULTILINE)


def change(name: str, factor: float) -> None:
    """Put a table with one changed constant in the place of the sensor's, before anything imports it."""
    assert TABLE not in sys.modules
    text, there = table_text(), f"\n{name} = Constant("
    assert text.count(there) == 1, name
    spec = importlib.util.find_spec(TABLE)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    exec(compile(text.replace(there, f"\n{name} = {factor!r} * Constant("), TABLE, "exec"), module.__dict__)  # noqa: S102  # our own table
    sys.modules[TABLE] = module


def prepare(folder: Path) -> None:
    """Write all logs with their truth: recorded days, and a day and work of a loader of each unit."""
    from ramsight.duty import report, simulate
    from ramsight.duty.drive_report import declared_report
    from ramsight.duty.loader_work import loader_work
    from ramsight.logs import read_log, read_truth
    from ramsight.machine import load_machine
    from ramsight.plant.as_built import AsBuilt
    from ramsight.plant.build import build

    def keep(name: str, unit: str, log: Any, position: Any) -> None:
        columns = {one: log[one].values for one in ("time", *_SIGNALS)}
        np.savez(folder / f"{unit}-{name}.npz", position=position, **columns)

    for path in sorted(TRACES.rglob("*_truth.csv.gz")):
        name = path.name.removesuffix("_truth.csv.gz")
        unit = next((one for one in UNITS if one in name), None)
        if unit is not None and ("workday" in name or path.parent != TRACES):
            log, truth = read_log(path.with_name(f"{name}.csv.gz")), read_truth(path)
            keep(name, unit, log, np.interp(log["time"], truth["time"], truth["position"]))
    loader, worn = load_machine("mining-loader"), AsBuilt(leak=1.2, displacement=0.995, stiffness=0.8)
    for unit in UNITS:
        machine = build(loader.unit(unit), unit)
        duty = loader_work(machine, f"loader-{unit}", 313.15, duration=600.0, seed=SEED)
        run = simulate(worn.apply(machine), duty)
        keep("work", unit, report(run, declared_report(machine, SEED)), run["position"].values)


def judge_all(folder: Path, tracks: Path) -> dict[str, dict[str, float]]:
    """Figures of every log, and how far its track is from that of the constants as they are.

    Args:
        folder: with the logs.
        tracks: of the constants as they are; written if there are none.
    """
    import xarray
    from judged_errors import judge

    from ramsight.machine import load_machine
    from ramsight.plant.build import build
    from ramsight.sensor.kalman import kalman

    loader, found, kept = load_machine("mining-loader"), {}, {}
    before = dict(np.load(tracks)) if tracks.exists() else {}
    units = {name: build(loader.unit(name), name) for name in UNITS}
    sensors = {name: kalman(unit) for name, unit in units.items()}
    for path in sorted(folder.glob("*.npz")):
        log, unit = np.load(path), path.name.partition("-")[0]
        columns = {name: ("time", log[name], {"units": units_of}) for name, units_of in _SIGNALS.items()}
        data = xarray.Dataset(columns, {"time": ("time", log["time"], {"units": "s"})})
        for how, start in (("unknown", None), ("exact", float(log["position"][0]))):
            name, sensor = f"{path.stem}, {how} start", sensors[unit]
            sensor.start(start)
            track = sensor.track(data)
            figures = judge(track, log["motor_speed"], log["position"], units[unit].cylinder.stroke, after=0)
            found[name] = {one: getattr(figures, one) for one in FIGURES}
            kept[name] = track["position"].values
            kept[f"{name}: status"] = track["status"].values
            if before:
                found[name] |= _moved(track, before[name], before[f"{name}: status"])
    if not before:
        np.savez(tracks, **kept)
    return found


def _moved(track: Any, position: Any, status: Any) -> dict[str, float]:
    """How far a track is from another one: largest difference [m], share of samples of another status."""
    apart = np.abs(track["position"].values - position)
    return {
        "moves": float(np.nanmax(apart)) if np.isfinite(apart).any() else 0.0,
        "otherwise": float((track["status"].values != status).mean()),
    }


def summary(found: dict[str, Any], base: dict[str, dict[str, float]]) -> dict[str, Any]:
    """What a variant comes to over all logs: the worst of each figure, and the log with the largest change of p95.

    Args:
        found: figures of the variant, by log.
        base: of the constants as they are.
    """
    if "fails" in found:
        return found
    changes = {name: one["p95"] - base[name]["p95"] for name, one in found.items()}
    known = {name: change for name, change in changes.items() if np.isfinite(change)}
    worst = max(known, key=lambda name: known[name])
    return {
        "moves": max(one["moves"] for one in found.values()),
        "otherwise": max(one["otherwise"] for one in found.values()),
        "p95_more": known[worst],
        "in": worst,
        "coverage": float(np.nanmin([one["coverage"] for one in found.values()])),
        "wrong_and_ok": max(one["wrong_and_ok"] for one in found.values()),
        "beyond_bound": float(np.nanmax([one["beyond_bound"] for one in found.values()])),
    }


def moves(row: dict[str, Any]) -> bool:
    """Whether a constant moves anything: a position, a status, what is said of it, or whether a sensor can be made.

    Rows may be of sensors of different dates, so both variants of a row are held against each other, and not against
    the constants as they are today.
    """
    times, over = row["times"], row["over"]
    if "fails" in times or "fails" in over:
        return True
    apart = any(one["moves"] > SEEN or one["otherwise"] > 0.0 for one in (times, over))
    return apart or any(times[key] != over[key] for key in ("coverage", "wrong_and_ok", "beyond_bound"))


def tests() -> dict[str, str]:
    """The test of each constant that has one of its own."""
    return dict(tomllib.loads(TESTED.read_text(encoding="utf-8")))


def passes(name: str, factor: float, *those: str) -> bool:
    """Whether tests pass with a constant changed, in a process of its own.

    Raises:
        SystemExit: they were not run.
    """
    command = [sys.executable, __file__, "--one-test", name, str(factor), *those]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode not in {0, 1}:
        raise SystemExit(f"{those}\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
    return done.returncode == 0


def tested(chosen: list[str], jobs: int) -> Iterator[tuple[str, dict[str, Any]]]:
    """Constants with their tests, and whether these fail with either variant.

    Raises:
        SystemExit: one fails with the constants as they are.
    """
    own = tests()
    if not passes(names()[0], 1.0, *dict.fromkeys(own[name] for name in chosen)):
        raise SystemExit("a test fails with the constants as they are")

    def both(name: str) -> tuple[str, dict[str, Any]]:
        return name, {"test": own[name], **{how: not passes(name, by, own[name]) for how, by in HOW}}

    with ThreadPoolExecutor(jobs) as pool:
        yield from pool.map(both, chosen)


def table(found: dict[str, Any], by_tests: dict[str, Any]) -> list[str]:
    """The table of the constants that move something, and that of those whose own test fails."""
    base = found[BASE]
    rows = [
        "| constant | largest change, × | ÷ | p95 rises by, × | ÷ | band, least, × | ÷ | wrong and ok, most, × | ÷ |",
        "|---" * 9 + "|",
    ]
    rows += [f"| {BASE} | " + " | ".join(cell(base) for cell in _CELLS for _ in range(2)) + " |"]
    rows += [
        f"| `{name}` | " + " | ".join(cell(one) for cell in _CELLS for one in (row["times"], row["over"])) + " |"
        for name, row in found.items()
        if name != BASE and moves(row)
    ]
    rows += ["", "| constant | decides on a signal of `tests/` | × | ÷ |", "|---" * 4 + "|"]
    for name, row in by_tests.items():
        fails = " | ".join("fails" if row[how] else "passes" for how, _ in HOW)
        rows.append(f"| `{name}` | {_said(row['test'])} | {fails} |")
    return rows


def _said(test: str) -> str:
    """A test in words: its file, and its name as a sentence."""
    file, _, name = test.partition("::test_")
    words = name.replace("_", " ").replace("[", " (").replace("]", ")")
    return f"`{file}`: {words}"


def _cell(key: str, factor: float, digits: int, unit: str) -> Callable[[dict[str, Any]], str]:
    """How a figure is written."""
    return lambda one: "no sensor" if "fails" in one else f"{factor * one[key]:.{digits}f} {unit}"


_CELLS = (
    _cell("moves", 1e3, 1, "mm"),
    _cell("p95_more", 1e3, 1, "mm"),
    _cell("coverage", 100.0, 1, "%"),
    _cell("wrong_and_ok", 100.0, 2, "%"),
)


def variant(name: str, factor: float, folder: Path) -> dict[str, Any]:
    """Figures of one variant, made in a process of its own."""
    command = [sys.executable, __file__, "--one", name, str(factor), str(folder)]
    done = subprocess.run(
        command,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "RAMSIGHT_OPTIMIZE": "no"},
    )
    if done.returncode:
        return {"fails": done.stderr.strip().splitlines()[-1]}
    return dict(json.loads(done.stdout))


def study(chosen: list[str], jobs: int) -> Iterator[tuple[str, dict[str, Any]]]:
    """The constants as they are, then each with what became of both variants."""
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        (folder / "tracks").mkdir()
        prepare(folder)
        base = variant(names()[0], 1.0, folder)
        unmoved = {name: one | {"moves": 0.0, "otherwise": 0.0} for name, one in base.items()}
        yield BASE, summary(unmoved, base)

        def both(name: str) -> tuple[str, dict[str, Any]]:
            found = {how: variant(name, by, folder) for how, by in HOW}
            return name, {how: summary(one, base) for how, one in found.items()}

        with ThreadPoolExecutor(jobs) as pool:
            yield from pool.map(both, chosen)


def main() -> None:
    """Run the study or the tests, or one variant of them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, help="results of the study, JSON")
    parser.add_argument("--tests", type=Path, help="results of the tests, JSON")
    parser.add_argument("--only", nargs="*", default=None, help="these constants")
    parser.add_argument("--jobs", type=int, default=1, help="processes at a time")
    parser.add_argument("--one", nargs=3, help=argparse.SUPPRESS)
    parser.add_argument("--one-test", nargs="+", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.one:
        name, factor, folder = asked.one[0], float(asked.one[1]), Path(asked.one[2])
        change(name, factor)
        print(json.dumps(judge_all(folder, folder / "tracks" / "as_they_are.npz")))
    elif asked.one_test:
        import pytest

        change(asked.one_test[0], float(asked.one_test[1]))
        those = [str(ROOT / "tests" / one) for one in asked.one_test[2:]]
        sys.exit(pytest.main(["-q", "-x", "-p", "no:cacheprovider", *those]))
    elif asked.tests:
        chosen = asked.only or [name for name in names() if name in tests()]
        kept(asked.tests, asked.only, chosen, tested(chosen, asked.jobs))
    else:
        chosen = asked.only or names()
        kept(asked.out, asked.only, [BASE, *chosen], study(chosen, asked.jobs))


def kept(file: Path, only: list[str] | None, chosen: list[str], rows: Iterator[tuple[str, dict[str, Any]]]) -> None:
    """Write rows as they come, in the table's order; with `only` the others in the file stay."""
    found = json.loads(file.read_text(encoding="utf-8")) if only and file.exists() else {}
    with progress(len(chosen), "constants varied") as bar:
        for name, row in rows:
            found[name] = row
            ordered = {one: found[one] for one in (BASE, *names()) if one in found}
            write_text(json.dumps(ordered, indent=1) + "\n", file)
            bar.advance(1)


if __name__ == "__main__":
    main()
