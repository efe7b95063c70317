"""How things look in a notebook: a small table and a picture, HTML that needs nothing else; Datasets too."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape

import numpy as np

from ramsight.arrays import Array
from ramsight.optional import needing

_WIDE, _HIGH, _EDGE = 420.0, 90.0, 4.0  # px
_POINTS = 420  # of a curve: one a pixel
_COLOURS = ("#1f2a36", "#c8401e", "#2a6f97")
_CELL = "text-align:left;padding:2px 10px 2px 0"


def card(title: str, rows: Iterable[tuple[str, str]], picture: str = "", rest: str = "") -> str:
    """A heading, rows of names and values, and a picture beside them."""
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


def curves(time: Array, series: Mapping[str, Array], unit: str) -> str:
    """Curves over time as a small SVG, from the least to the largest value; gaps where there is no number.

    Args:
        time: [s], shape (samples,).
        series: by their names, each of shape (samples,).
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


def _path(x: Array, y: Array) -> str:
    """A path through the points that are numbers."""
    found, pen = [], "M"
    for across, down in zip(x.tolist(), y.tolist(), strict=True):
        if not np.isfinite(down):
            pen = "M"
            continue
        found.append(f"{pen}{across:.1f} {down:.1f}")
        pen = "L"
    return "".join(found)


with needing("datasets"):
    import xarray

_MM = 1e3


class ShownDataset(xarray.Dataset):  # type: ignore[no-untyped-call]  # of its __init_subclass__
    """A Dataset; in a notebook a simulated run or a track begins with a table and its position.

    Args:
        dataset: with `kind` in its attributes.
    """

    __slots__ = ()

    @classmethod
    def of(cls, dataset: xarray.Dataset) -> ShownDataset:
        """The same data."""
        return cls(dataset.data_vars, dataset.coords, dataset.attrs)

    def _repr_html_(self) -> str:
        usual = super()._repr_html_()
        if not self._is_over_time():
            return usual
        kind, unit = (str(self.attrs.get(name, "")) for name in ("kind", "unit"))
        position = _MM * self["position"].values
        shown = {"position": position}
        if "true_position" in self:
            shown = {"true position": _MM * self["true_position"].values, **shown}
        rest = f"<details><summary>all variables</summary>{usual}</details>"
        rows = [*self._rows(), ("samples", str(self.sizes["time"]))]
        return card(f"{unit}: {kind}", rows, curves(self["time"].values, shown, "mm"), rest)

    def _is_over_time(self) -> bool:
        """Whether there is a position over seconds; what was done with a Dataset may have left another one."""
        if "position" not in self or self["position"].dims != ("time",) or self.sizes["time"] == 0:
            return False
        return all(np.issubdtype(self[name].dtype, np.number) for name in ("position", "time"))

    def _rows(self) -> list[tuple[str, str]]:
        """What the run or track comes to, as names and values."""
        found = self.attrs
        rows = []
        if (torque := self.get("motor_torque")) is not None and np.isfinite(torque.values).any():
            least, most = float(np.nanmin(torque)), float(np.nanmax(torque))
            rows.append(("motor torque", f"{least:.4g} to {most:.4g} N m"))
        if {"energy.shaft_given", "energy.shaft_taken"} <= found.keys():
            given, taken = (float(found[f"energy.shaft_{way}"]) / 1e3 for way in ("given", "taken"))
            rows.append(("motor", f"gave {given:.4g} kJ, took {taken:.4g} kJ back"))
        if "sensor" in found:
            rows.append(("sensor", str(found["sensor"])))
        if {"error_largest", "error_p95"} <= found.keys():
            largest, p95 = (_MM * float(found[f"error_{name}"]) for name in ("largest", "p95"))
            rows.append(("error", f"95 % within {p95:.3g} mm, largest {largest:.3g} mm"))
        if "mistake" in found:
            rows.append(("mistake", str(found["mistake"])))
        return rows
