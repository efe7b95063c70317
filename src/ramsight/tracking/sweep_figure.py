"""A picture of many runs: what was kept of them over what was varied."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ramsight.errors import DescriptionError
from ramsight.optional import needing
from ramsight.signals import Dataset
from ramsight.tracking.figures import ERROR, STYLE
from ramsight.units import to_si

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_KEPT = (
    "motor_torque_most", "motor_power_most", "energy.shaft_given", "relief_share", "pressure_most",
)  # fmt: skip
_SHOWN = {"Pa": "bar", "m": "mm", "rad/s": "rpm", "K": "degC", "N": "kN", "W": "kW", "J": "kJ"}
_OTHERWISE = "position_final"
_MOST = 6  # panels in a row or a column that can be read


@dataclass(frozen=True)
class _Quantity:
    """Values over all runs in the unit in which they are shown, shape (runs,), and what they are."""

    values: Any
    label: str


def draw_sweep(runs: Dataset, title: str) -> Figure:
    """A panel for each kept figure over each value that differs between the runs, a dot a run.

    Args:
        runs: a Dataset as `ramsight.simulate_many` returns it.

    Raises:
        DescriptionError: no value differs between the runs.
    """
    with needing("figures"):
        import matplotlib as mpl
        from matplotlib.figure import Figure

    across = [_quantity(runs, str(name)) for name in runs.coords if _differs(runs, str(name))][:_MOST]
    if not across:
        raise DescriptionError("has nothing that differs from run to run", key="dataset", allowed="several runs")
    down = [_quantity(runs, name) for name in _KEPT if name in runs] or [_quantity(runs, _OTHERWISE)]
    lost = int((runs["outcome"] != "done").sum())
    with mpl.rc_context(STYLE):  # type: ignore[arg-type]
        figure = Figure(figsize=(1.2 + 2.6 * len(across), 0.8 + 1.7 * len(down)), layout="constrained")
        axes = figure.subplots(len(down), len(across), sharex="col", sharey="row", squeeze=False)
        for row, shown in zip(axes, down, strict=True):
            row[0].set_ylabel(shown.label)
            for panel, over in zip(row, across, strict=True):
                panel.plot(over.values, shown.values, ".", ms=3.0, color=ERROR, alpha=0.6)
        for panel, over in zip(axes[-1], across, strict=True):
            panel.set_xlabel(over.label)
        figure.suptitle(title + (f"; {lost} did not reach their end" if lost else ""), x=0.01, ha="left", weight="bold")
    return figure


def _differs(runs: Dataset, name: str) -> bool:
    values = runs[name].values
    return values.dtype.kind == "f" and values.size > 1 and bool(np.ptp(values) > 0.0)


def _quantity(runs: Dataset, name: str) -> _Quantity:
    whole = runs["outcome"]
    values = runs[name].broadcast_like(whole).transpose(*whole.dims).values.ravel()
    si = str(runs[name].attrs.get("units", "1"))  # of a coordinate that somebody added
    unit = _SHOWN.get(si, si)
    zero, one = to_si(0.0, unit), to_si(1.0, unit)
    words = name.removesuffix("_most").replace("_", " ").replace(".", " ")
    return _Quantity((values - zero) / (one - zero), f"{words}\n[{unit}]")
