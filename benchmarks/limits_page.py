"""Writes the tables of docs/reference/performance.md from results/bench.json, between their marks."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import growth
import peers
import roofline

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "reference" / "performance.md"


def tables(found: dict[str, Any]) -> dict[str, list[str]]:
    """Every table of the page, by its mark."""
    grown = found["growth"]
    return {
        "roofline": roofline.table(found["roofline"]),
        "roofline_flops": roofline.flops(found["roofline"]),
        **{f"growth_{name}": growth.table(name, grown[name]) for name in growth.HEADS},
        "growth_exponents": growth.exponents(grown),
        "peers": peers.table(found["peers"]),
    }


def main() -> None:
    """Put each table between its marks."""
    sys.path.insert(0, str(ROOT / "evaluation"))
    from pages import put

    put(PAGE, tables(json.loads((ROOT / "results" / "bench.json").read_text())))


if __name__ == "__main__":
    main()
