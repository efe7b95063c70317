"""Logs in MATLAB's files (``.mat``): version 5 as SciPy reads them, 7.3 as HDF5.

Vectors are channels, columns of matrices too (``name[2]``), or rows of wide ones, those in structures
``structure.field``. Objects of classes
(timeseries, timetable, datetime) are stored in a way that only MATLAB knows.
"""

from __future__ import annotations

import math
import os
import struct
import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np

from ramsight.errors import LogError
from ramsight.logs.lines import check_file, first_line
from ramsight.logs.packed import check_unpacked, opened
from ramsight.logs.source import needs
from ramsight.logs.source_groups import Group, GroupSource, Recorded, by_length

_HDF5 = b"\x89HDF\r\n\x1a\n"
_LOOKED_AT = 2048  # bytes; MATLAB writes 512 of its own before what is HDF5
_HEADER, _TAG, _PACKED = 128, 8, 15  # bytes of a file's header and of an element's tag; its type of packed ones
_WIDEST = 64  # columns of a matrix that are channels
_DEEPEST = 8  # structures in structures
_DAMAGE = (ValueError, KeyError, TypeError, IndexError, AttributeError, OSError, EOFError, MemoryError, OverflowError,
           NotImplementedError, RuntimeError, AssertionError, zlib.error)  # fmt: skip


class MatSource(GroupSource):
    """A file of MATLAB: all vectors of one length have one clock, which is one of them."""

    def read(self) -> list[Group]:
        """The vectors of the file by their lengths."""
        check_file(self.path)
        with opened(self.path) as file:
            begins = file.read(_LOOKED_AT)
        if _HDF5 not in begins:
            check_unpacked(_unpacked(self.path, begins), self.path)
        try:
            found = dict(_hdf5(self.path, self.file) if _HDF5 in begins else _version_5(self.path, self.file))
        except _DAMAGE as error:
            raise LogError(f"is no file of MATLAB, or a damaged one: {first_line(error)}", file=self.file) from None
        if not found:
            raise LogError(
                "has no vectors of numbers: text is none, and objects (timeseries, timetable) are read by MATLAB alone;"
                " write vectors",
                file=self.file,
            )
        return by_length("mat", found)


def _unpacked(path: Any, begins: bytes) -> int:
    """Bytes that the packed elements of a file of version 5 say they unpack to; SciPy reads no more of each."""
    order, total = ("<" if begins[_HEADER - 2 : _HEADER] == b"IM" else ">"), 0
    with opened(path) as file:
        size = os.fstat(file.fileno()).st_size
        file.seek(_HEADER)
        while len(tag := file.read(_TAG)) == _TAG:
            kind, length = struct.unpack(f"{order}II", tag)
            here = file.tell()
            if kind == _PACKED:
                try:
                    inner = zlib.decompressobj().decompress(file.read(min(length, _LOOKED_AT)), _TAG)
                except zlib.error:
                    break  # the reader says what is wrong with it
                total += struct.unpack(f"{order}II", inner)[1] if len(inner) == _TAG else 0
            if here + length > size:
                break
            file.seek(here + length)
    return total


def _version_5(path: Any, file: str) -> Iterator[tuple[str, Recorded]]:
    reader: Any = needs("scipy.io", "logs", file)
    try:
        content = reader.loadmat(path, squeeze_me=True, struct_as_record=False, chars_as_strings=True)
    except reader.matlab.MatReadError as error:
        raise ValueError(str(error)) from None
    for name, value in content.items():
        if not name.startswith("__"):
            yield from _flat(name, value, 0)


def _flat(name: str, value: Any, deep: int) -> Iterator[tuple[str, Recorded]]:
    fields = getattr(value, "_fieldnames", None)
    if fields is not None and deep < _DEEPEST:
        for one in fields:
            yield from _flat(f"{name}.{one}", getattr(value, one), deep + 1)
    elif isinstance(value, np.ndarray) and value.dtype == object and value.size <= _WIDEST and deep < _DEEPEST:
        for number, one in enumerate(value.ravel(), 1):
            yield from _flat(f"{name}[{number}]", one, deep + 1)
    elif isinstance(value, np.ndarray):
        yield from _columns(name, value)


def _hdf5(path: Any, file: str) -> Iterator[tuple[str, Recorded]]:
    h5py: Any = needs("h5py", "logs", file)
    found: list[tuple[str, Any]] = []
    total = 0

    def take(name: str, one: Any) -> None:
        nonlocal total
        is_text = one.attrs.get("MATLAB_class", b"") == b"char"
        if isinstance(one, h5py.Dataset) and not name.startswith("#") and not is_text and one.dtype.kind in "iufb":
            total += one.size * one.dtype.itemsize
            check_unpacked(total, path)
            _check_stored(name, one)
            found.append((name.replace("/", "."), np.asarray(one[()]).T))  # MATLAB's order of indices

    with h5py.File(path, "r") as opened_file:
        opened_file.visititems(take)
    for name, value in found:
        yield from _columns(name, np.squeeze(value))


def _check_stored(name: str, one: Any) -> None:
    """Refuse a data set that is not stored whole: HDF5 gives zeros for what is missing; MATLAB leaves nothing out."""
    if one.chunks is None:
        is_whole = one.size == 0 or one.id.get_storage_size() > 0
    else:
        wanted = math.prod(-(-size // chunk) for size, chunk in zip(one.shape, one.chunks, strict=True))
        stored = [one.id.get_chunk_info(number) for number in range(one.id.get_num_chunks())]
        is_whole = len(stored) == wanted and not any(chunk.filter_mask for chunk in stored)
        if one.compression == "gzip":  # HDF5 gives zeros of what cannot be unpacked, too
            size = math.prod(one.chunks) * one.dtype.itemsize
            packed = (one.id.read_direct_chunk(chunk.chunk_offset)[1] for chunk in stored)
            whole = (zlib.decompressobj().decompress(data, size + 1) for data in packed)
            is_whole = is_whole and all(len(data) == size for data in whole)
    if not is_whole:
        raise ValueError(f"parts of {name} are missing")


def _columns(name: str, value: Any) -> Iterator[tuple[str, Recorded]]:
    """A vector, or the columns of a matrix; its rows where it is wider than high, as Simulink's To File writes them."""
    if value.dtype.kind not in "iufb":
        return
    if value.ndim == 1:
        yield name, Recorded(value.astype(np.float64))
    elif value.ndim == 2 and min(value.shape) <= _WIDEST:
        signals = value if value.shape[1] > value.shape[0] else value.T
        for number, one in enumerate(signals, start=1):
            yield f"{name}[{number}]", Recorded(one.astype(np.float64))
