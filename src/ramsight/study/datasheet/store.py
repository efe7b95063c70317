"""Where a study's results are while it runs: a Zarr store, a chunk a task, that knows which machines are done.

The whole of it is laid out first, empty. A task writes its own chunks and nobody else's, `done` last; a file of a chunk
is written beside its place and moved into it. So whatever is stopped, and however, has lost the tasks that were not
done, and they give the same again.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ramsight.arrays import Array, Bools
from ramsight.errors import OutputError, RamsightError, one_line
from ramsight.optional import needing, needs
from ramsight.signals import Dataset
from ramsight.study.datasheet.measuring import AGE, AGES, COUNTS, EDGES, GROUPS, PLACES, SHAPES, UNITS

FORMAT = 2
_MACHINE, _KIND = "machine", "ramsight study"


class StoreError(RamsightError):
    """A store that cannot be gone on with."""


@dataclass(frozen=True)
class Layout:
    """What a store is laid out for."""

    study: Mapping[str, Any]  # what makes the study what it is; a store of another one is rejected
    names: Sequence[str]
    units: Sequence[str]
    moments: Array  # times at which signed errors are kept [s]
    task: int

    @property
    def arrays(self) -> dict[str, tuple[str, tuple[str, ...], tuple[int, ...]]]:
        """Type, dimensions and sizes beside the machines of everything that is kept."""
        found = {
            name: ("uint32" if name in COUNTS else "float64", tuple(d for d, _ in dims), tuple(n for _, n in dims))
            for name, dims in SHAPES.items()
        }
        found["values"] = ("float64", ("quantity",), (len(self.names),))
        found["moment_error"] = ("float64", ("moment_time",), (len(self.moments),))
        found["outcome"] = ("uint32", (), ())
        found["done"] = ("uint8", (), ())
        return found


class Store:
    """A study's store, made or gone on with.

    Args:
        path: folder of the store; `None` keeps all in memory.

    Raises:
        StoreError: there is another study's, or something that is no store.
        OutputError: it cannot be written.
    """

    def __init__(self, path: Path | None, layout: Layout, count: int) -> None:
        self.path, self._layout = path, layout
        with _read(path):
            self._group = self._opened(count)

    def _opened(self, count: int) -> Any:
        zarr = needs("zarr", "study")
        if self.path is None:
            return self._laid_out(zarr.storage.MemoryStore(), count)
        if self.path.exists() and not self.path.is_dir():
            raise StoreError(f"{one_line(self.path)}: is no folder, so no store of a study")
        if not (self.path / "zarr.json").exists():
            if self.path.exists() and any(self.path.iterdir()):
                raise StoreError(f"{one_line(self.path)}: holds something else; give a folder that is new or empty")
            return self._laid_out(str(self.path), count)
        group = zarr.open_group(str(self.path), mode="r+")
        if group.attrs.get("kind") != _KIND:
            raise StoreError(f"{one_line(self.path)}: is no store of a study; give a folder that is new or empty")
        if "study" not in group.attrs:  # stopped while it was laid out: nothing is in it
            return self._laid_out(str(self.path), count)
        if group.attrs["format"] != FORMAT:
            raise StoreError(
                f"{one_line(self.path)}: is of format {group.attrs['format']}; this ramsight reads {FORMAT}"
            )
        if other := _difference(group.attrs["study"], _plain(self._layout.study)):
            raise StoreError(f"{one_line(self.path)}: is the store of another study, with another {other}")
        if group["done"].shape[0] < count:
            self._extended(group, count)
        return group

    def _laid_out(self, where: Any, count: int) -> Any:
        """Lay out everything; the attributes that make it a store come last."""
        zarr = needs("zarr", "study")
        group = zarr.open_group(where, mode="w", attributes={"kind": _KIND})
        layout = self._layout
        for name, (dtype, dims, sizes) in layout.arrays.items():
            group.create_array(
                name,
                shape=(count, *sizes),
                chunks=(layout.task, *(max(size, 1) for size in sizes)),
                dtype=dtype,
                fill_value=np.nan if dtype == "float64" else 0,
                dimension_names=(_MACHINE, *dims),
                attributes={"units": UNITS.get(name, "1")},
            )
        coordinates = {
            "bin": EDGES[1:], "age": (np.arange(AGES) + 0.5) * AGE,
            "place": (np.arange(PLACES) + 0.5) / PLACES, "moment_time": layout.moments,
        }  # fmt: skip
        for name, values in coordinates.items():
            array = group.create_array(name, shape=values.shape, dtype=values.dtype, dimension_names=(name,))
            array[:] = values
        group.attrs.update({"quantities": list(layout.names), "quantity_units": list(layout.units)})
        group.attrs.update({"format": FORMAT, "study": _plain(layout.study)})
        return group

    def _extended(self, group: Any, count: int) -> None:
        for name, (_, _, sizes) in self._layout.arrays.items():
            if name != "done":
                group[name].resize((count, *sizes))
        group["done"].resize((count,))

    @property
    def done(self) -> Bools:
        """Which machines are done, shape (machines,)."""
        with _read(self.path):
            return np.asarray(self._group["done"][:]).astype(bool)

    def tasks(self, count: int) -> Iterator[range]:
        """The machines of each task that is not done yet."""
        done, task = self.done, self._layout.task
        for first in range(0, count, task):
            rows = range(first, min(first + task, count))
            if not done[rows.start : rows.stop].all():
                yield rows

    def write(self, rows: range, found: Mapping[str, Array]) -> None:
        """Write a task's results; that they are there last.

        Args:
            found: everything that is kept of them, by name.

        Raises:
            OutputError: they cannot be written; the task counts as not done.
        """
        with _said(self.path):
            _write(self._arrays, self._layout, rows, found)

    @cached_property
    def _arrays(self) -> dict[str, Any]:
        """What is written, opened once: that takes half as long as to write it."""
        return {name: self._group[name] for name in self._layout.arrays}

    def dataset(self, count: int) -> Dataset:
        """What is there of the first machines, those that are done, over `machine`."""
        with needing("study"):
            import xarray

        with _read(self.path):
            done = np.flatnonzero(self.done[:count])
            data: dict[str, Any] = {}
            for name, (_, dims, _) in self._layout.arrays.items():
                array = self._group[name]
                data[name] = ((_MACHINE, *dims), np.asarray(array[:])[done], dict(array.attrs))
            names = ("bin", "age", "place", "moment_time")
            coordinates = {name: (name, np.asarray(self._group[name][:])) for name in names}
        attributes = {"format": FORMAT, "kind": "study", "study": json.dumps(_plain(self._layout.study))}
        whole = xarray.Dataset(
            data,
            {"machine": done, "quantity": list(self._layout.names), "group": list(GROUPS), **coordinates},
            attributes,
        )
        return whole.drop_vars("done").assign_coords(quantity_units=("quantity", list(self._layout.units)))


def write_apart(path: Path, layout: Layout, rows: range, found: Mapping[str, Array]) -> None:
    """Write a task's results from a process that did not lay the store out; arguments as `Store` and `Store.write`."""
    with _said(path):
        _write(needs("zarr", "study").open_group(str(path), mode="r+"), layout, rows, found)


def _write(arrays: Any, layout: Layout, rows: range, found: Mapping[str, Array]) -> None:
    for name, (dtype, _, _) in layout.arrays.items():
        if name != "done":
            values = np.nan_to_num(found[name]) if dtype == "uint32" else found[name]
            arrays[name][rows.start : rows.stop] = values.astype(dtype)
    arrays["done"][rows.start : rows.stop] = 1


def _plain(study: Mapping[str, Any]) -> Any:
    """The description of a study as it comes back from a file."""
    return json.loads(json.dumps(study))


def _difference(there: Any, wanted: Mapping[str, Any]) -> str:
    """What two studies differ in; empty if in nothing."""
    if not isinstance(there, dict):
        return "kind"
    return next((key for key in wanted if there.get(key) != wanted[key]), "")


@contextmanager
def _read(path: Path | None) -> Iterator[None]:
    """The same, and what zarr has to say of a store that is damaged."""
    try:
        with _said(path):
            yield
    except (ValueError, KeyError, TypeError) as error:
        raise StoreError(f"{one_line(path)}: cannot be read: {one_line(error)}; remove it") from error


@contextmanager
def _said(path: Path | None) -> Iterator[None]:
    """Whatever the disk has to say, in one line."""
    try:
        yield
    except OSError as error:
        raise OutputError(f"{one_line(path)}: cannot be written: {one_line(error.strerror or error)}") from error
