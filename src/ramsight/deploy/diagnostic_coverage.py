"""Diagnostic coverage from an FMEDA table in which an engineer has filled in the failure rates.

A fault's coverage is the share of it that is detected. That of several is their mean, weighed by the failure rates:

    DC = Σ λ_i c_i / Σ λ_i

At least it is the same with each share at the lower end of its 95 % interval. A fault without a measured share counts
as never detected.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ramsight.deploy.fmeda import COLUMNS
from ramsight.errors import LogError, first_of

CLASSES = ((0.99, "high"), (0.90, "medium"), (0.60, "low"), (0.0, "none"))
"""Least diagnostic coverage of each class of ISO 13849-1."""
_READ = ("channel", "signal", "fault", "detected_percent", "detected_at_least_percent", "failure_rate_fit")
_LARGEST = 4_000_000  # bytes of a table


@dataclass(frozen=True)
class RatedFault:
    """A row of the table."""

    channel: str  # that it is in
    signal: str  # that it is of
    fault: str  # what is wrong
    share: float  # that is detected; 0 where it was not measured
    at_least: float  # lower end of its interval
    rate: float | None  # failures in 10⁹ h; None where nobody has filled it in
    measured: bool  # whether there is a share


@dataclass(frozen=True)
class Coverage:
    """Diagnostic coverage of some faults."""

    rate: float  # their failures in 10⁹ h
    share: float  # diagnostic coverage
    at_least: float  # the same with all shares at the lower ends of their intervals

    @classmethod
    def of(cls, rows: Iterable[RatedFault]) -> Coverage:
        """Of rows; NaN where no rate is above 0.

        Example:
            >>> often, never = (RatedFault("a", "b", "c", share, share - 0.1, 100.0, True) for share in (0.9, 0.1))
            >>> Coverage.of([often, never])
            Coverage(rate=200.0, share=0.5, at_least=0.4)
        """
        rated = [(one.rate, one.share, one.at_least) for one in rows if one.rate]
        total = math.fsum(rate for rate, *_ in rated)
        if not total > 0.0:
            return cls(0.0, math.nan, math.nan)
        detected, least = (math.fsum(one[0] * one[k] for one in rated) for k in (1, 2))
        return cls(total, detected / total, least / total)

    @property
    def grade(self) -> str:
        """Class of ISO 13849-1 that the lower end is in; ``none`` without a failure rate."""
        return next((name for least, name in CLASSES if self.at_least >= least), "none")

    @property
    def text(self) -> str:
        """The coverage in a line."""
        if math.isnan(self.share):
            return "no failure rate"
        return f"DC {100 * self.share:.1f} % (at least {100 * self.at_least:.1f} %, {self.grade}) of {self.rate:g} FIT"


@dataclass(frozen=True)
class CoverageTable:
    """A table that was read back."""

    rows: tuple[RatedFault, ...]  # of it
    cells: tuple[Mapping[str, str], ...]  # all columns of each row, as they stand in the file
    mark: str = ","  # between columns, a comma or a semicolon; behind semicolons decimals have commas

    @property
    def overall(self) -> Coverage:
        """Of all rows."""
        return Coverage.of(self.rows)

    @property
    def by_channel(self) -> dict[str, Coverage]:
        """By channel, in the order of the table."""
        return {name: Coverage.of(one for one in self.rows if one.channel == name) for name in self._names("channel")}

    @property
    def by_signal(self) -> dict[tuple[str, str], Coverage]:
        """By channel and signal, in the order of the table."""
        keys = dict.fromkeys((one.channel, one.signal) for one in self.rows)
        return {key: Coverage.of(one for one in self.rows if (one.channel, one.signal) == key) for key in keys}

    def _names(self, field: str) -> list[str]:
        return list(dict.fromkeys(getattr(one, field) for one in self.rows))

    @property
    def text(self) -> str:
        """Coverage by channel, by signal and of all; how many rows have no rate, or no share."""
        lines = []
        signals = self.by_signal
        for channel, found in self.by_channel.items():
            lines.append(f"{channel}: {found.text}")
            rated = {signal: one for (of, signal), one in signals.items() if of == channel and one.rate}
            lines += [f"  {signal}: {one.text}" for signal, one in rated.items()]
        lines.append(f"overall: {self.overall.text}")
        without = sum(one.rate is None for one in self.rows)
        unmeasured = sum(bool(one.rate) and not one.measured for one in self.rows)
        if without:
            lines.append(f"{without} of {len(self.rows)} faults have no failure rate and do not count")
        if unmeasured:
            lines.append(f"{unmeasured} with a failure rate were not measured and count as never detected")
        return "\n".join(lines)

    def filled(self) -> str:
        """The table with the coverage of each rated fault, by its lower end, and the rate that stays undetected."""
        text = io.StringIO()
        table = csv.DictWriter(text, self.cells[0], delimiter=self.mark, lineterminator="\n")
        table.writeheader()
        for row, cells in zip(self.rows, self.cells, strict=True):
            rate = row.rate
            known = {} if rate is None else _known(row.at_least, rate)
            point = _decimal(self.mark)
            table.writerow({**cells, **{name: value.replace(".", point) for name, value in known.items()}})
        return text.getvalue()


def _decimal(mark: str) -> str:
    return "," if mark == ";" else "."


def _known(share: float, rate: float) -> dict[str, str]:
    return {"diagnostic_coverage_percent": f"{100 * share:.2f}", "undetected_fit": f"{rate * (1 - share):.6g}"}


def read_table(file: str | Path) -> CoverageTable:
    """A table that `fmeda_table` wrote and somebody has filled in.

    Args:
        file: CSV with commas, or with semicolons and decimal commas, as spreadsheets write it.

    Raises:
        LogError: it cannot be read, lacks a column, or has a share or rate that is impossible.
    """
    path = Path(file)
    text = _text(path)
    head, *_ = text.splitlines() or [""]
    mark = ";" if head.count(";") > head.count(",") else ","
    reader = csv.DictReader(io.StringIO(text, newline=None), delimiter=mark, restval="")
    there = _header(reader, str(path))
    names = list(dict.fromkeys((*there, *COLUMNS)))
    rows, cells, wrong = [], [], []
    for row, line in _filled_rows(reader, str(path)):
        try:
            rows.append(_rated(row, str(path), line, _decimal(mark)))
            cells.append({name: row.get(name) or "" for name in names})
        except LogError as error:
            wrong.append(error)
    if wrong:
        raise first_of(wrong)
    if not rows:
        raise LogError("has no rows", file=str(path))
    return CoverageTable(tuple(rows), tuple(cells), mark)


def _header(reader: csv.DictReader[str], file: str) -> Sequence[str]:
    """The names of the columns."""
    try:
        there = reader.fieldnames or ()
    except csv.Error as error:
        raise LogError(f"is no CSV: {error}", file=file, line=1) from error
    for name in _READ:
        if name not in there:
            raise LogError("column is missing", file=file, line=1, column=name)
    return there


def _filled_rows(reader: csv.DictReader[str], file: str) -> Iterator[tuple[dict[str, str], int]]:
    """Rows and their lines; spreadsheets leave rows of empty cells behind the last one."""
    try:
        for row in reader:
            if any(row[name] for name in _READ):
                yield row, reader.line_num
    except csv.Error as error:
        raise LogError(f"is no CSV: {error}", file=file, line=reader.line_num) from error


def _text(path: Path) -> str:
    try:
        with path.open("rb") as stream:
            content = stream.read(_LARGEST + 1)
    except OSError as error:
        raise LogError(f"cannot be read: {error.strerror or error}", file=str(path)) from error
    if len(content) > _LARGEST:
        raise LogError(f"is larger than {_LARGEST} bytes", file=str(path))
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise LogError("is not UTF-8 text", file=str(path)) from error


def _rated(row: Mapping[str, str], file: str, line: int, decimal: str) -> RatedFault:
    def number(column: str, most: float) -> float | None:
        text = (row[column] or "").strip()
        if not text:
            return None
        try:
            value = float(text.replace(decimal, "."))
        except ValueError:
            value = math.nan
        if not 0.0 <= value <= most:
            raise LogError(f"{text[:40]!r} is not a number from 0 to {most:g}", file=file, line=line, column=column)
        return value

    share, least = (number(name, 100.0) for name in ("detected_percent", "detected_at_least_percent"))
    if (share is None) != (least is None) or (least or 0.0) > (share or 0.0):
        text = "needs a share, and a lower end that is not above it; or neither"
        raise LogError(text, file=file, line=line, column="detected_at_least_percent")
    rate = number("failure_rate_fit", 1e12)
    found = [0.0 if value is None else value / 100.0 for value in (share, least)]
    return RatedFault(row["channel"], row["signal"], row["fault"], found[0], found[1], rate, share is not None)
