"""Tables in MCAP files (``.mcap``): messages in JSON, a topic for what belongs together."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

import numpy as np

from ramsight.errors import OutputError
from ramsight.output.cells import Coded, Column
from ramsight.output.table_writer import TableWriter, clock_of, installed, numbers
from ramsight.units.algebra import NANOSECONDS

_LATEST = (1 << 63) / NANOSECONDS  # s; MCAP counts nanoseconds in 64 bits
_TEXT = json.JSONEncoder(separators=(",", ":"), ensure_ascii=False, allow_nan=False)
_ENCODING, _SCHEMA = "json", "jsonschema"
_TOPICS = (
    ("/position", ("position", "true_position", "other_position", "error", "reference", "referenced")),
    ("/velocity", ("velocity",)),
    ("/load", ("load",)),
    ("/pressure", ("pressure",)),
    ("/drive", ("motor_", "oil_temperature", "shaft_angle", "dc_", "link_angle", "speed_over", "torque_")),
    ("/status", ("status", "verdict", "mode")),
)
"""Topics, and how the names of their columns begin."""


def topic_of(column: str) -> str:
    """The topic that a column's values go to.

    Example:
        >>> topic_of("position_std_m"), topic_of("leak_factor"), topic_of("valve_command"), topic_of("flow_m3_per_s")
        ('/position', '/factors', '/commands', '/other')
    """
    if "_factor" in column:
        return "/factors"
    if column.endswith("_command"):
        return "/commands"
    return next((topic for topic, begins in _TOPICS if column.startswith(begins)), "/other")


class McapTable(TableWriter):
    """An MCAP file of chunks packed by zstd; the clock is the column ``time_s`` and becomes the messages' log time.

    A value that is not there (NaN) is left out of its message, because JSON has no word for it; units stand in the
    schemas, each field's ``unit``.
    """

    def __init__(self, path: Path, units: Mapping[str, str], shown: str) -> None:
        self._units, self._shown = units, shown
        writer: Any = installed("mcap.writer", "logs", path)
        self._file = open(path, "wb")  # noqa: SIM115 - closed by __exit__
        self._writer: Any = writer.Writer(self._file)
        self._topics: dict[str, tuple[int, list[str]]] = {}
        self._rows = 0

    def __enter__(self) -> Self:
        self._writer.start(profile="", library="ramsight")
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        try:
            if kind is None:
                self._writer.finish()
        finally:
            self._file.close()

    def _write(self, columns: dict[str, Column]) -> None:
        time, others = clock_of(columns)
        self._check(time)
        if not self._topics:
            self._begin(others)
        stamps = np.rint(time * NANOSECONDS).astype(np.int64).tolist()
        cells = {name: _cells(column) for name, column in others.items()}
        for row, stamp in enumerate(stamps):
            for number, names in self._topics.values():
                message = {name: cells[name][row] for name in names if cells[name][row] is not None}
                data = _TEXT.encode(message).encode()
                self._writer.add_message(number, stamp, data, stamp, self._rows + row)
        self._rows += len(time)

    def _check(self, time: np.ndarray[Any, Any]) -> None:
        """Refuse times that MCAP cannot say."""
        wrong = np.flatnonzero(~((time >= 0.0) & (time < _LATEST)))
        if len(wrong):
            raise OutputError(f"{self._shown}: a sample at {time[wrong[0]]:g} s; MCAP counts from 0 s on")

    def _begin(self, columns: Mapping[str, Column]) -> None:
        """Declare topics and schemas."""
        listed: dict[str, list[str]] = {}
        for name in columns:
            listed.setdefault(topic_of(name), []).append(name)
        for topic, names in listed.items():
            fields = {name: _field(columns[name], self._units.get(name, "")) for name in names}
            schema = {"title": f"ramsight{topic.replace('/', '.')}", "type": "object", "properties": fields}
            number = self._writer.register_schema(schema["title"], _SCHEMA, json.dumps(schema).encode())
            self._topics[topic] = (self._writer.register_channel(topic, _ENCODING, number), names)


def _field(column: Column, unit: str) -> dict[str, Any]:
    """What a schema says of a column."""
    if isinstance(column, Coded):
        return {"type": "string", "enum": [column.words[code] for code in sorted(column.words)]}
    kinds = {"f": "number", "i": "integer", "u": "integer", "b": "boolean"}
    kind = {"type": kinds.get(column.dtype.kind, "string")}
    return {**kind, "unit": unit, "description": f"in {unit}"} if unit else kind


def _cells(column: Column) -> list[Any]:
    """The values as JSON has them; None where there is none."""
    if isinstance(column, Coded):
        return [column.words[int(code)] for code in column.codes]
    values = numbers(column)
    if values.dtype.kind != "f":
        return list(values.tolist())
    return [
        value if known else None for value, known in zip(values.tolist(), np.isfinite(values).tolist(), strict=True)
    ]
