"""What of the study of faults the package has for its FMEDA tables, in `ramsight.deploy.fmeda`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ramsight.output import write_text
from ramsight.study.datasheet.statistics import share_of

FILE = Path(__file__).parents[1] / "src" / "ramsight" / "deploy" / "measured_faults.json"
_DIGITS = 4  # of seconds and millimetres
_SHARE_DIGITS = 6


def packaged(study: dict[str, Any]) -> str:
    """The text of the file, from what `results/study.json` has.

    A row of the virtual sensor: signal, fault, trials, detected, the lower end of that share's 95 % interval, median
    time to detection [s], and the median of the largest error [mm]. A row of the real sensor: fault, trials, detected,
    the same lower end, median and 95 % of the time to detection [s].
    """
    rows = {
        given: [
            [
                row["input"],
                row["fault"],
                row["injected"],
                detected := round(row["noticed"] * row["injected"]),
                _at_least(detected, row["injected"]),
                _rounded(row["delay_s"]),
                _rounded(row["error_median_mm"]),
            ]
            for row in one["rows"]
        ]
        for given, one in study["faults"].items()
    }
    real = [
        [
            fault,
            row["injected"],
            detected := round(row["found"] * row["injected"]),
            _at_least(detected, row["injected"]),
            _rounded(row["median_s"]),
            _rounded(row["p95_s"]),
        ]
        for fault, row in study["second_channel"]["faults"].items()
    ]
    return json.dumps({"virtual": rows, "real": real}, indent=1, ensure_ascii=False) + "\n"


def _at_least(detected: int, trials: int) -> float:
    return round(share_of(detected, trials).low, _SHARE_DIGITS)


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, _DIGITS)


def renew(study: dict[str, Any]) -> None:
    """Write the file."""
    write_text(packaged(study), FILE)
