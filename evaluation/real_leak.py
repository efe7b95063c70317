"""Grades of leakage of a real pump as records: ZeMA's test bench, 1103 cycles (UCI, doi 10.24432/C5F31Q).

python evaluation/real_leak.py --data FOLDER

The flow law is fitted on cold, healthy cycles. What of the flow it lacks in a cycle is a leak factor over that law's
leakage, with the deviation that healthy cold cycles have: a record. The labels are not used but to judge.
"""

from __future__ import annotations

import argparse
import json
import os
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from flow_law import columns
from numpy.typing import NDArray
from real_oil import COLD, HOT, Bench, auc, design, fitted, read, viscosity

from ramsight.histories.trend import Series, explained

Array = NDArray[np.float64]
ROOT = Path(__file__).parents[1]
GRADE = "VG46"
MINUTE = 60.0
TOGETHER = 80  # cycles of a series: few enough steps for what looks for them
NEAR = 5  # records within which a step is found


def factors(bench: Bench) -> tuple[Array, float]:
    """Leak factor of each cycle [1], NaN where none can be known, and the deviation of a healthy cold one."""
    healthy = ((bench.leak == 0) & bench.stable & (bench.mean_celsius <= COLD))[:, None] & bench.open
    law = fitted(bench, healthy, GRADE)
    everywhere = np.ones_like(bench.open)
    missing = (design(bench, everywhere, GRADE) @ law.value).reshape(bench.flow.shape) - bench.flow
    leaks = -law.value[2] * columns(0.0, bench.pressure, viscosity(bench.celsius, GRADE))[..., 1]
    used = bench.open & bench.stable[:, None]
    with np.errstate(invalid="ignore"):
        found = 1.0 + np.where(used, missing, 0.0).sum(axis=1) / np.where(used, leaks, 0.0).sum(axis=1)
    rows = healthy.any(axis=1) & np.isfinite(found)
    return found, float(found[rows].std())


def study(folder: Path) -> dict[str, Any]:
    """What is written down."""
    bench = read(folder)
    factor, std = factors(bench)
    known, hot = np.isfinite(factor) & (factor > 0.0), bench.mean_celsius >= HOT
    by_grade = [factor[known & hot & (bench.leak == grade)] for grade in range(3)]
    cold = [float(np.median(factor[known & (bench.mean_celsius <= COLD) & (bench.leak == k)])) for k in range(3)]
    between = [0.5 * (one + other) for one, other in pairwise(cold)]
    named = np.searchsorted(between, factor[known & hot])
    changes = found = false = 0
    for first in range(0, len(factor) - TOGETHER, TOGETHER):
        rows = np.arange(first, first + TOGETHER)[known[first : first + TOGETHER]]
        if len(rows) < TOGETHER // 2:
            continue
        true = [k for k in range(1, len(rows)) if bench.leak[rows[k]] != bench.leak[rows[k - 1]]]
        value, zeros = np.log(factor[rows])[:, None], np.zeros((len(rows), 1))
        time = rows[:, None] * MINUTE
        steps = explained(Series(time, value, zeros + std, zeros, zeros, zeros > 1.0)).steps[0]
        said = [one.record for one in steps]
        changes += len(true)
        found += sum(any(abs(k - one) <= NEAR for one in said) for k in true)
        false += sum(all(abs(k - one) > NEAR for k in true) for one in said)
    return {
        "cycles": int(known.sum()),
        "hot_cycles": int((known & hot).sum()),
        "healthy_std": std,
        "median_cold": cold,
        "median_hot": [float(np.median(one)) for one in by_grade],
        "ordered_0_1": auc(-by_grade[0], -by_grade[1]),
        "ordered_1_2": auc(-by_grade[1], -by_grade[2]),
        "ordered_all": ordered(by_grade),
        "named_right": float(np.mean(named == bench.leak[known & hot])),
        "changes_of_grade": changes,
        "changes_found": found,
        "steps_elsewhere": false,
    }


def table(found: dict[str, Any]) -> list[str]:
    """Rows for docs/how-to/history.md."""
    cold, hot = (" / ".join(f"{one:.2f}" for one in found[f"median_{name}"]) for name in ("cold", "hot"))
    return [
        f"| leak factor of the grades 0 / 1 / 2, median of cold and of hot cycles | {cold}, {hot} |",
        f"| a hot cycle of each grade in the right order | {100 * found['ordered_all']:.1f} % of {found['hot_cycles']} "
        "cycles |",
        f"| grade of a hot cycle named by the cold ones | {100 * found['named_right']:.0f} % right |",
        f"| changes of grade found within five cycles | {found['changes_found']} of {found['changes_of_grade']}, and "
        f"{found['steps_elsewhere']} steps elsewhere |",
    ]


def ordered(grades: list[Array]) -> float:
    """Chance that of a cycle of each grade the factors are in the order of the grades."""
    low, middle, high = (np.sort(one) for one in grades)
    below = np.searchsorted(low, middle) / len(low)
    above = 1.0 - np.searchsorted(high, middle, side="right") / len(high)
    return float(np.mean(below * above))


def main() -> None:
    """Study the data, and write what came of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    usual = os.environ.get("RAMSIGHT_DATA", str(ROOT.parent / "shared" / "data"))
    parser.add_argument("--data", type=Path, default=Path(usual))
    parser.add_argument("--out", type=Path, default=ROOT / "results" / "real_leak.json")
    options = parser.parse_args()
    found = study(options.data / "uci_hydraulic")
    options.out.write_text(json.dumps(found, indent=1) + "\n")
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
