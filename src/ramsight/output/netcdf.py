"""Datasets in NetCDF files, piece by piece, as xarray writes and reads them."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

import numpy as np

from ramsight.errors import OutputError
from ramsight.optional import needing
from ramsight.signals import Dataset, Samples, Signals


class ForgivingFile(io.RawIOBase):
    """A file for reading and writing that keeps what cannot be written in memory, and the error for `check`.

    HDF5 does not survive an error of a full disk, so the error is raised later.
    """

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._file = open(path, "w+b", buffering=0)  # noqa: SIM115 - closed by `close`
        self._error: OSError | None = None
        self._unwritten: list[tuple[int, bytes]] = []
        self._place = self._size = 0

    def __enter__(self) -> Self:
        return self

    def check(self) -> None:
        """Raise the first error that there was.

        Raises:
            OSError: something could not be written.
        """
        if self._error is not None:
            raise self._error

    def readable(self) -> bool:
        """Whether it can be read: always."""
        return True

    def writable(self) -> bool:
        """Whether it can be written: always."""
        return True

    def seekable(self) -> bool:
        """Whether it has places to go to: always."""
        return True

    def tell(self) -> int:
        """The place of the next byte."""
        return self._place

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Go to a place."""
        begin = {os.SEEK_SET: 0, os.SEEK_CUR: self._place, os.SEEK_END: self._size}[whence]
        self._place = begin + offset
        return self._place

    def truncate(self, size: int | None = None) -> int:
        """Make the file this long."""
        self._size = self._place if size is None else size
        if self._error is None:
            try:
                self._file.truncate(self._size)
            except OSError as error:
                self._error = error
        return self._size

    def write(self, data: Any) -> int:
        """Write bytes; never fails."""
        content = bytes(data)
        done = 0
        if self._error is None:
            try:
                self._file.seek(self._place)
                while done < len(content):
                    done += self._file.write(content[done:]) or 0
            except OSError as error:
                self._error = error
        if done < len(content):
            self._unwritten.append((self._place + done, content[done:]))
        self._place += len(content)
        self._size = max(self._size, self._place)
        return len(content)

    def readinto(self, buffer: Any) -> int:
        """Read what was written, on the disk or not."""
        view = memoryview(buffer).cast("B")
        count = max(min(len(view), self._size - self._place), 0)
        self._file.seek(self._place)
        found = bytearray(self._file.read(count) or b"").ljust(count, b"\0")
        for place, content in self._unwritten:
            begin, end = max(place, self._place), min(place + len(content), self._place + count)
            if begin < end:
                found[begin - self._place : end - self._place] = content[begin - place : end - place]
        view[:count] = found
        self._place += count
        return count

    def close(self) -> None:
        """Close the file."""
        if not self.closed:
            self._file.close()
        super().close()


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
