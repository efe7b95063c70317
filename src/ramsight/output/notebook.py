"""How things look in a notebook: a small table and a picture, HTML that needs nothing else."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape

import numpy as np
from numpy.typing import NDArray

_WIDE, _HIGH, _EDGE = 420.0, 90.0, 4.0  # px
_POINTS = 420  # of a curve: one a pixel
_COLOURS = ("#1f2a36", "#c8401e", "#2a6f97")
_CELL = "text-align:left;padding:2px 10px 2px 0"


def card(title: str, rows: Iterable[tuple[str, str]], picture: str = "", rest: str = "") -> str:
    """A heading, rows of names and values, and a picture beside them.

    Args:
        title: as text.
        rows: as text.
        picture: HTML or SVG.
        rest: HTML below it.
    """
    cells = "".join(
        f'<tr><th style="{_CELL};font-weight:normal;opacity:.7">{escape(name)}</th>'
        f'<td style="{_CELL}">{escape(value)}</td></tr>'
        for name, value in rows
    )
    shown = f'<div style="width:{_WIDE:g}px">{picture}</div>' if picture else ""
    return (
        f"<div><strong>{escape(title)}</strong>"
        '<div style="display:flex;flex-wrap:wrap;gap:16px;align-items:flex-start">'
        f"<table>{cells}</table>{shown}</div>{rest}</div>"
    )


def curves(time: NDArray[np.float64], series: Mapping[str, NDArray[np.float64]], unit: str) -> str:
    """Curves over time as a small SVG, from the least to the largest value; gaps where there is no number.

    Args:
        time: [s], shape (samples,).
        series: by their names, each of shape (samples,).
        unit: of the values, as text.
    """
    timed = np.isfinite(time)  # a log may lack times, and its clock may go back
    time, series = time[timed], {name: values[timed] for name, values in series.items()}
    every = max(len(time) // _POINTS, 1)
    known = [values[np.isfinite(values)] for values in series.values()]
    numbers = np.concatenate([*known, np.zeros(0)])
    if len(time) < 2 or not numbers.size:
        return ""
    low, high = float(numbers.min()), float(numbers.max())
    first, long = float(time.min()), float(time.max() - time.min())
    x = _EDGE + (time - first) / max(long, 1e-12) * (_WIDE - 2.0 * _EDGE)
    lines, names = [], []
    for colour, (name, values) in zip(_COLOURS, series.items(), strict=False):
        y = _HIGH - _EDGE - (values - low) / max(high - low, 1e-12) * (_HIGH - 2.0 * _EDGE)
        lines.append(f'<path d="{_path(x[::every], y[::every])}" fill="none" stroke="{colour}" stroke-width="1.3"/>')
        names.append(f'<span style="color:{colour}">{escape(name)}</span>')
    span = f"{low:.4g} to {high:.4g} {escape(unit)} in {long:.4g} s"
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDE:g} {_HIGH:g}" style="width:100%">'
        f"{''.join(lines)}</svg><div>{', '.join(names)}: {span}</div>"
    )


def _path(x: NDArray[np.float64], y: NDArray[np.float64]) -> str:
    """A path through the points that are numbers."""
    found, pen = [], "M"
    for across, down in zip(x.tolist(), y.tolist(), strict=True):
        if not np.isfinite(down):
            pen = "M"
            continue
        found.append(f"{pen}{across:.1f} {down:.1f}")
        pen = "L"
    return "".join(found)
