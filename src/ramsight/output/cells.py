"""Cells of a CSV file, many at a time: digits by arithmetic on whole arrays, the same text that ``%.6f`` gives.

A column is a matrix of letters, one row a cell, in which 0 stands for no letter; columns side by side without the
zeros are the text.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ramsight.arrays import Array

DECIMALS = {
    "s": 6, "m": 6, "m_per_s": 6, "m3": 9, "m3_per_s": 9, "mm": 3, "rad_per_s": 4, "rpm": 3, "nm": 4, "n": 1,
    "pa": 0, "bar": 3, "k": 3, "c": 3, "w": 2, "j": 2,
}  # fmt: skip
"""Decimals of a column by the unit its name ends in; other columns of floats get nine significant digits."""

Letters = NDArray[np.uint8]
_EXACT = 2.0**53


@dataclass(frozen=True)
class Coded:
    """A column of words, each written as a whole number."""

    codes: NDArray[np.integer[Any]]  # whole numbers, shape (n,)
    words: Mapping[int, str]  # what each of them means

    def __len__(self) -> int:
        return len(self.codes)

    def places(self) -> tuple[list[str], NDArray[np.intp]]:
        """The words, and for each cell which of them it is."""
        codes = np.array(sorted(self.words))
        place = np.searchsorted(codes, self.codes)
        return [self.words[int(code)] for code in codes], place


Column = NDArray[Any] | Coded


def rows_text(columns: Sequence[tuple[str, Column]], formats: Mapping[str, str]) -> bytes:
    r"""Rows of a CSV file as UTF-8 text.

    Args:
        formats: for columns of floats, a format such as ``"%.12g"`` in the place of the decimals.

    Example:
        >>> rows_text([("time_s", np.array([0.5, np.nan])), ("status", np.array([0, 30]))], {})
        b'0.500000,0\n,30\n'
    """
    parts: list[Letters] = []
    for number, (name, column) in enumerate(columns):
        cells = _letters(column, name, formats.get(name))
        mark = b"\n" if number == len(columns) - 1 else b","
        parts += [cells, np.full((len(cells), 1), mark[0], dtype=np.uint8)]
    text: Letters = np.concatenate(parts, axis=1).ravel()
    return bytes(text[text != 0].tobytes())


def quoted(text: str) -> str:
    """A cell of text, in quotes where it has to be.

    Example:
        >>> quoted("motor speed, torque")
        '"motor speed, torque"'
    """
    if not any(letter in text for letter in ',"\r\n'):
        return text
    doubled = text.replace('"', '""')
    return f'"{doubled}"'


def decimals_of(name: str) -> int | None:
    """Decimals of a column by its name, None for those that get significant digits."""
    fitting = [unit for unit in DECIMALS if name.endswith(f"_{unit}")]
    return DECIMALS[max(fitting, key=len)] if fitting else None


def _letters(column: Column, name: str, form: str | None) -> Letters:
    if isinstance(column, Coded):
        words, places = column.places()
        return _from_texts([quoted(word) for word in words])[places]
    if column.dtype.kind in "iub":
        small = np.abs(column.astype(np.float64)) < _EXACT
        return _fixed(column.astype(np.float64), 0) if small.all() else _from_texts([str(int(v)) for v in column])
    if column.dtype.kind != "f":
        return _from_texts([quoted(str(value)) for value in column])
    values = column.astype(np.float64)
    decimals = decimals_of(name) if form is None else None
    if decimals is not None:
        with np.errstate(over="ignore", invalid="ignore"):
            fits = np.isnan(values) | (np.abs(values) * 10.0**decimals < _EXACT)
        if fits.all():
            return _fixed(values, decimals)
        values, form = np.round(values, decimals), f"%.{decimals}f"
    missing = np.isnan(values)
    texts = [(form or "%.9g") % value for value in (values + 0.0).tolist()]  # + 0.0 makes -0.0 a plain zero
    for index in np.flatnonzero(missing):
        texts[index] = ""
    return _from_texts(texts)


def _fixed(values: Array, decimals: int) -> Letters:
    """Numbers below 2**53 units of the last decimal, rounded half to even; NaN is an empty cell."""
    missing = np.isnan(values)
    units = np.rint(np.where(missing, 0.0, values) * 10.0**decimals)
    rest = np.abs(units).astype(np.int64)
    highest = int(rest.max(initial=0))
    whole = max(len(str(highest)) - decimals, 1)
    width = 1 + whole + (1 + decimals if decimals else 0)
    cells = np.zeros((len(values), width), dtype=np.uint8)
    cells[:, 0] = np.where(units < 0, ord("-"), 0)
    column = width
    for digit in range(whole + decimals):
        if digit == decimals and decimals:
            column -= 1
            cells[:, column] = ord(".")
        column -= 1
        tenth = rest // 10
        letters = (rest - 10 * tenth + ord("0")).astype(np.uint8)
        if digit > decimals:  # no zeros in front
            letters[rest == 0] = 0
        cells[:, column] = letters
        rest = tenth
    cells[missing] = 0
    return cells


def _from_texts(texts: list[str]) -> Letters:
    if not texts:
        return np.zeros((0, 1), dtype=np.uint8)
    packed = np.array([text.encode("utf-8") for text in texts], dtype="S")
    width = max(packed.dtype.itemsize, 1)
    return np.frombuffer(packed.tobytes().ljust(width * len(texts), b"\0"), dtype=np.uint8).reshape(len(texts), width)
