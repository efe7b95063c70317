"""What a simulated run has, with units: for what needs no more than its numbers, and to be made a Dataset."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ramsight.signals import Signal as Column
from ramsight.signals import Signals

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class Signal:
    """One signal.

    Attributes:
        values: shape (samples,).
        units: of them, SI.
        long_name: what it is.
    """

    values: NDArray[np.float64]
    units: str
    long_name: str


@dataclass(frozen=True)
class Recorded:
    """A run.

    Attributes:
        signals: by their names, `time` [s] first.
        attrs: what the run was, and its audit.

    Example:
        >>> run = Recorded({"time": Signal(np.array([0.0, 0.1]), "s", "time")}, {"unit": "boom"})
        >>> run["time"].values.tolist(), run.dataset().sizes["time"]
        ([0.0, 0.1], 2)
    """

    signals: Mapping[str, Signal]
    attrs: Mapping[str, Any]

    def __getitem__(self, name: str) -> Signal:
        """The signal of that name."""
        return self.signals[name]

    def columns(self) -> Signals:
        """As columns over `time`."""
        return Signals(
            {
                name: Column(one.values, {"units": one.units, "long_name": one.long_name})
                for name, one in self.signals.items()
            },
            self.attrs,
        )

    def dataset(self) -> xarray.Dataset:
        """As a Dataset over `time`; xarray takes a third of a second to be imported."""
        from ramsight.output.shown_dataset import ShownDataset

        return ShownDataset.of(self.columns().dataset())
