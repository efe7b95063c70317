"""The picture of docs/safety.md: a real sensor that begins to drift, beside the virtual one, on a recorded log."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import ramsight
from ramsight.logs import read_truth
from ramsight.tracking.compared_figure import compared_figure

ROOT = Path(__file__).parents[1]
LOG = ROOT / "tests" / "traces" / "person" / "person_bucket_datasheet"
_BEGINS, _DRIFT = 400.0, 0.01 / 60.0  # s, m/s


def main() -> None:
    """Make it."""
    other = read_truth(f"{LOG}_truth.csv.gz")
    time = other["time"].values
    wrong = other["position"].values + _DRIFT * np.clip(time - _BEGINS, 0.0, None)
    found = ramsight.compare(
        "mining-loader", f"{LOG}.csv.gz", other.assign(position=("time", wrong)), unit="bucket", tolerance="1 mm"
    )
    print(found.text)
    compared_figure(
        found.track, "A real sensor that drifts by 10 mm a minute from 400 s on", ROOT / "docs/images/compare.png"
    )


if __name__ == "__main__":
    main()
