"""Writes the table of docs/validation.md from results/eha_rig.json: python evaluation/eha_rig_page.py."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pages import put

HERE = Path(__file__).parent
FOUND = HERE.parent / "results" / "eha_rig.json"
PAGE = HERE.parent / "docs" / "validation.md"
WORDS = {"angle_current": "angle, current, valve", "angle_current_pressure": "the same and pressures"}
_HEAD = (
    "identified on", "judged on", "signals", "ends of moves, largest / 95 % [mm]", "RMS [mm]",
    "RMS of the worst run [mm]", "RMS without the curve [mm]", "inside the 95 % band, all / least run",
    "ok beyond 4 σ, longest [s]",
)  # fmt: skip


def table(found: dict[str, Any]) -> list[str]:
    """Rows: errors and band over all judged runs, for each pair of days and each set of signals.

    Args:
        found: what `eha_rig.py` has written, by what was identified on.
    """
    rows = [f"| {' | '.join(_HEAD)} |", "|---" * len(_HEAD) + "|"]
    for fit, one in found.items():
        for judged, of_it in one["judged"].items():
            for name, row in of_it["all"].items():
                worst = max(of_it["runs"], key=lambda run, of=of_it, by=name: of["runs"][run][by]["rms_mm"])
                figures = (
                    fit,
                    f"{judged}: {len(of_it['runs'])} runs, {row['moves']} moves",
                    WORDS[name],
                    f"{row['largest_end_mm']:.2f} / {row['p95_end_mm']:.2f}",
                    f"{row['rms_mm']:.2f}",
                    f"{row['largest_rms_mm']:.2f} ({worst.partition('.')[0].replace('_', ', ')})",
                    f"{of_it['all_without_curve'][name]['rms_mm']:.2f}",
                    f"{row['coverage_95'] * 100.0:.1f} / {row['least_coverage_95'] * 100.0:.1f} %",
                    f"{row['ok_beyond_4_std_longest_s']:.2f}",
                )
                rows.append(f"| {' | '.join(figures)} |")
    return rows


def read() -> dict[str, Any]:
    """What was measured."""
    found: dict[str, Any] = json.loads(FOUND.read_text(encoding="utf-8"))
    return found


if __name__ == "__main__":
    put(PAGE, {"rig": table(read())})
