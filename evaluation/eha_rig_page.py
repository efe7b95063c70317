"""Writes the table of docs/validation.md from eha_rig.json and eha_rig_same.json: python evaluation/eha_rig_page.py."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pages import put

HERE = Path(__file__).parent
FOUND = HERE / "eha_rig.json"
PAGE = HERE.parent / "docs" / "validation.md"
SAME = HERE / "eha_rig_same.json"
WORDS = {"angle_current": "angle, current, valve", "angle_current_pressure": "the same and pressures"}
_HEAD = (
    "runs judged", "signals", "end of a move, largest [mm]", "95 % of them [mm]", "while it goes, largest [mm]",
    "RMS [mm]", "RMS of the worst run [mm]", "RMS without the curve [mm]",
    "inside the 95 % band", "ok beyond 4 σ, longest [s]",
)  # fmt: skip


def table(unseen: dict[str, Any], same: dict[str, Any]) -> list[str]:
    """Rows: errors and band over all judged runs, for each set of signals.

    Args:
        unseen: of runs under a load that was not identified from.
        same: of the runs that were identified from.
    """
    rows = [f"| {' | '.join(_HEAD)} |", "|---" * len(_HEAD) + "|"]
    for found, what in ((unseen, "a load not seen"), (same, "all, identified from all")):
        for name, row in found["all"].items():
            figures = (
                f"{len(found['runs'])} runs, {row['moves']} moves: {what}; {found['date']}",
                WORDS[name],
                *(
                    f"{row[key]:.2f}"
                    for key in ("largest_end_mm", "p95_end_mm", "largest_mm", "rms_mm", "largest_rms_mm")
                ),
                f"{found['all_without_curve'][name]['rms_mm']:.2f}",
                f"{row['coverage_95'] * 100.0:.1f} %",
                f"{row['ok_beyond_4_std_longest_s']:.2f}",
            )
            rows.append(f"| {' | '.join(figures)} |")
    return rows


def read() -> tuple[dict[str, Any], dict[str, Any]]:
    """What was measured."""
    unseen, same = (json.loads(file.read_text(encoding="utf-8")) for file in (FOUND, SAME))
    return unseen, same


if __name__ == "__main__":
    put(PAGE, {"rig": table(*read())})
