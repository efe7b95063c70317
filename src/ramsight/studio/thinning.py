"""A long track as what a screen can show: of the samples behind a pixel the smallest and the largest."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating]
LOWEST, HIGHEST = "low", "high"
"""Columns of which only the smallest, or the largest, is shown: a band is no narrower than it is."""


def keep(folder: Path, columns: Mapping[str, Floats]) -> None:
    """Keep columns, a file each, so that a part of them can be read without the rest.

    Args:
        columns: `time` and others, all of one shape (n,).
    """
    folder.mkdir(exist_ok=True)
    for name, values in columns.items():
        np.save(folder / f"{name}.npy", values)


def kept(folder: Path) -> dict[str, Floats]:
    """The columns that are kept in a folder; they are read where they are looked at."""
    return {file.stem: np.load(file, mmap_mode="r") for file in sorted(folder.glob("*.npy"))}


def thinned(
    columns: Mapping[str, Floats], pixels: int, begin: float | None = None, end: float | None = None
) -> dict[str, list[float | None]]:
    """Columns between two times, two values a pixel at most; NaN is None.

    Args:
        columns: `time` [s], increasing, and others, all of one shape (n,).
        begin: [s]; None for the first there is.
        end: [s]; None for the last.

    Example:
        >>> wave = {"time": np.arange(1000.0), "position": np.tile([0.0, 9.0], 500)}
        >>> thinned(wave, 2)["position"]
        [0.0, 9.0, 0.0, 9.0]
    """
    time = columns["time"]
    first = 0 if begin is None else max(int(np.searchsorted(time, begin)) - 1, 0)
    last = len(time) if end is None else min(int(np.searchsorted(time, end)) + 1, len(time))
    count = last - first
    if count <= 2 * pixels:
        return {name: _plain(values[first:last]) for name, values in columns.items()}
    edges = first + np.linspace(0, count, pixels, endpoint=False).astype(np.int64)
    starts = edges - first
    found = {}
    for name, values in columns.items():
        part = values[first:last]
        if name == "time":
            middles = first + (starts + np.append(starts[1:], count)) // 2
            found[name] = _plain(np.column_stack([time[edges], time[middles]]).ravel())
            continue
        least, most = np.fmin.reduceat(part, starts), np.fmax.reduceat(part, starts)
        pair = (least, least) if name == LOWEST else (most, most) if name == HIGHEST else (least, most)
        found[name] = _plain(np.column_stack(pair).ravel())
    return found


def _plain(values: Floats) -> list[float | None]:
    return [
        round(value, 4) if known else None for value, known in zip(values.tolist(), np.isfinite(values), strict=True)
    ]
