"""Datasets of runs and tracks, which show themselves in a notebook by what they are."""

from __future__ import annotations

import numpy as np

from ramsight.optional import needing
from ramsight.output.notebook import card, curves

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
