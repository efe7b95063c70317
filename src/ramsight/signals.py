"""Columns of samples with units, as logs and tracks are handed on; a Dataset is made where one is asked for.

xarray and pandas take most of a second to be imported. What goes from a log's file to a track's file needs neither.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ramsight.arrays import Bools
from ramsight.optional import needing

if TYPE_CHECKING:
    from xarray import Dataset as Dataset
else:
    Dataset = Any  # for annotations: what makes one imports xarray

TIME = "time"


@dataclass(frozen=True)
class Signal:
    """One column."""

    values: NDArray[Any]  # shape (samples,)
    # its `units` and `long_name`, as those of a Dataset's variable
    attrs: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Signals:
    """Columns over `time`.

    Example:
        >>> position = Signal(np.array([0.2, 0.3]), {"units": "m"})
        >>> rod = Signals({"time": Signal(np.array([0.0, 0.1])), "position": position})
        >>> rod.names, len(rod), rod["position"].values.tolist(), rod.dataset()["position"].attrs["units"]
        (('position',), 2, [0.2, 0.3], 'm')
    """

    columns: Mapping[str, Signal]  # by their names, `time` among them
    attrs: Mapping[str, Any] = field(default_factory=dict)  # of all of them together

    @classmethod
    def of(cls, samples: Samples) -> Signals:
        """The columns of a Dataset over `time` alone; what are columns already stay as they are."""
        if isinstance(samples, Signals):
            return samples
        over_time = {str(name): one for name, one in samples.variables.items() if one.dims == (TIME,)}
        columns = {name: Signal(one.values, dict(one.attrs)) for name, one in over_time.items()}
        return cls(columns, dict(samples.attrs))

    def __getitem__(self, name: str) -> Signal:
        """The column of that name."""
        return self.columns[name]

    def __contains__(self, name: object) -> bool:
        """Whether there is such a column."""
        return name in self.columns

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.columns[TIME].values)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns but `time`."""
        return tuple(name for name in self.columns if name != TIME)

    def replaced(self, values: Mapping[str, NDArray[Any]]) -> Signals:
        """The same with other values in some columns."""
        return replace(self, columns={**self.columns, **{k: replace(self[k], values=v) for k, v in values.items()}})

    def rows(self, which: slice | Sequence[int] | Bools | NDArray[np.intp]) -> Signals:
        """The same columns with the samples that were chosen, by a slice, their places or a mask."""
        return replace(
            self, columns={name: replace(one, values=one.values[which]) for name, one in self.columns.items()}
        )

    def dataset(self) -> Dataset:
        """As a Dataset over `time`."""
        with needing("datasets"):
            import xarray

        data = {name: (TIME, one.values, dict(one.attrs)) for name, one in self.columns.items()}
        coords = {TIME: data.pop(TIME)}
        return xarray.Dataset(data, coords=coords, attrs=dict(self.attrs))


Samples: TypeAlias = "Signals | Dataset"
"""What has columns over `time`: `samples[name].values`."""


def joined(parts: Sequence[Signals]) -> Signals:
    """Pieces one after the other, with the names, units and attributes of the first."""
    first = parts[0]
    return first.replaced({name: np.concatenate([one[name].values for one in parts]) for name in first.columns})
