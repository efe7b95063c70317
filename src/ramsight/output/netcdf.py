"""Datasets in NetCDF files, piece by piece, as xarray writes and reads them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

import numpy as np

from ramsight.errors import OutputError
from ramsight.optional import needing
from ramsight.output.forgiving import ForgivingFile
from ramsight.signals import Dataset, Samples, Signals

_CHUNK = 1 << 15


class NetcdfPieces:
    """A NetCDF file whose one dimension grows."""

    def __init__(self, path: Path, shown: str) -> None:
        with needing("datasets"):
            import h5netcdf

        self._disk = ForgivingFile(path)
        self._file: Any = h5netcdf.File(self._disk, "w")
        self._shown, self._length = shown, 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        try:
            self._file.close()
        finally:
            self._disk.close()
        if kind is None:
            self._disk.check()

    def append(self, samples: Samples) -> None:
        """Write a piece."""
        piece = samples.dataset() if isinstance(samples, Signals) else samples
        if len(piece.sizes) != 1:
            dims = ", ".join(map(str, piece.dims))
            raise OutputError(f"{self._shown}: pieces run over one dimension, not over {dims}")
        dim, length = next((str(name), size) for name, size in piece.sizes.items())
        if not self._length:
            self._begin(piece, dim)
        after = self._length + length
        self._file.resize_dimension(dim, after)
        for name, variable in piece.variables.items():
            if variable.ndim:
                self._file.variables[str(name)][self._length : after] = variable.values
        self._length = after
        self._disk.check()

    def _begin(self, piece: Dataset, dim: str) -> None:
        self._file.dimensions[dim] = None
        for name, value in piece.attrs.items():
            self._file.attrs[str(name)] = value
        for name, variable in piece.variables.items():
            values = np.asarray(variable.values)
            if not variable.ndim:
                made = self._file.create_variable(str(name), (), values.dtype, data=values)
            else:
                made = self._file.create_variable(
                    str(name),
                    (dim,),
                    values.dtype,
                    fillvalue=np.nan if values.dtype.kind == "f" else None,
                    chunks=(_CHUNK,),
                    compression="gzip",
                    compression_opts=1,
                    shuffle=True,
                )
            for key, value in variable.attrs.items():
                made.attrs[str(key)] = value


def write_netcdf(dataset: Dataset, path: Path, encoding: Mapping[str, Mapping[str, Any]]) -> None:
    """A whole `Dataset` as xarray writes it.

    Args:
        dataset: what to write.
        path: the file.
        encoding: how variables are packed.

    Raises:
        OSError: it cannot be written.
    """
    with needing("datasets"):
        import h5netcdf
        from xarray.backends import H5NetCDFStore

    with ForgivingFile(path) as disk:
        with h5netcdf.File(disk, "w") as file:
            dataset.dump_to_store(H5NetCDFStore(file), encoding=encoding)
        disk.check()
