"""Inputs that are odd rather than damaged, a hundred thousand of them: nothing ends in a traceback.

Times that go back or are none, numbers in digits of other scripts, brackets by the thousand, records that lie about
their length, gzip files that unpack to much.
"""

from __future__ import annotations

import gzip
import json
import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from harness import READ, REFUSED, WARNED, WRONG, Rng, Section
from logs import CAN_MAP

CASES = 100_000
_INSPECTED = 0.25  # share of the files that are looked into before they are read
_BOMBS = 0.02  # share of packed files that unpack to much
_ROWS = 12
_NAMES = ("time_s", "motor_speed_rpm", "motor_torque_nm", "oil_temperature_c")
_DIGITS = ("0123456789", "٠١٢٣٤٥٦٧٨٩", "０１２３４５６７８９", "०१२३४५६७८९", "⁰¹²³⁴⁵⁶⁷⁸⁹")
_MARKS = (",", ";", "\t", "|", " ", "\x1f")
_TIMES = (
    "", "nan", "inf", "-inf", "1e308", "-1e308", "1e-320", "9" * 300, "0x10", "1_0", "12:00:00", "24:61:61", "-0", "+",
    "2024-02-30 00:00:00", "0000-00-00T00:00:00Z", "9999-12-31T23:59:59.999999999", "31.12.1969", "12:00:00 PM",
    "13 PM", "1970-01-01T00:00:00+99:99", "45000.5", "1e10", "1.7e18", "1,5", "1.234,5", "1'000", "\x00",
    "\u22121", "½",
)  # fmt: skip
_MAP = """
time = { channel = "time_s" }
speed = { channel = "motor_speed_rpm" }
torque = { channel = "motor_torque_nm" }
temperature = { channel = "oil_temperature_c" }
"""
_RECORDS = range(0x12)  # kinds of MCAP records, with some that are none


@dataclass
class Prepared:
    """What the cases share."""

    maps: dict[str, Path]  # channel maps, by the kind of log
    whole: bytes  # an MCAP file with nothing wrong


def prepare(folder: Path) -> Prepared:
    """Two channel maps and a file."""
    for name, text in (("table", _MAP), ("frames", CAN_MAP)):
        (folder / f"{name}.toml").write_text(text)
    maps = {name: folder / f"{name}.toml" for name in ("table", "frames")}
    return Prepared(maps, _mcap(folder / "whole.mcap", [_message(k) for k in range(_ROWS)], _schema()))


def _one_of(rng: Rng, *choices: str) -> str:
    return choices[int(rng.integers(len(choices)))]


def _number(rng: Rng) -> str:
    """A number as somebody may write it."""
    kind = int(rng.integers(6))
    if kind < 2:
        return f"{rng.normal() * 100.0:.3f}"
    if kind == 2:
        return _one_of(rng, *_TIMES)
    script = _one_of(rng, *_DIGITS)
    text = f"{rng.normal() * 10.0 ** rng.uniform(-3.0, 12.0):.{int(rng.integers(6))}f}"
    if kind == 3:
        return "".join(script[int(one)] if one.isascii() and one.isdigit() else one for one in text)
    return text.replace(".", ",") if kind == 4 else f"{text}{_one_of(rng, '', ' rpm', '%', 'e', '.', '-')}"


def _table(rng: Rng) -> str:
    """A CSV file: odd times, odd numbers, rows of other lengths."""
    mark = "," if rng.random() < 0.5 else _one_of(rng, *_MARKS)
    names = list(_NAMES) if rng.random() < 0.9 else [_one_of(rng, *_NAMES, "", '"', "t", "Zeit [ms]") for _ in range(4)]
    odd, rows = rng.random() ** 3, [mark.join(names)]
    at = 0.0
    for _ in range(int(rng.integers(_ROWS))):
        at += float(rng.choice([0.02] if odd < 0.2 else [0.02, 0.02, 0.02, 0.0, -0.02, -3600.0, 1e9]))
        cells = [_one_of(rng, *_TIMES) if rng.random() < 0.3 * odd else f"{at:.3f}"]
        cells += [_number(rng) if rng.random() < odd else "1.5" for _ in range(3)]
        rows.append(mark.join(cells[: int(rng.choice([4] * 40 + [3, 0]))] + ["9"] * int(rng.choice([0] * 40 + [2]))))
    head = _one_of(rng, "", "", "", "", "", "\ufeff", "# a log\n", "\n\n", '"', "sep=;\n")
    return (
        head
        + _one_of(rng, "\n", "\r\n", "\r").join(rows)
        + _one_of(rng, "\n", "\n", "\n", "\n", "", "\x00", '"', "\n" * 1000)
    )


def _candump(rng: Rng) -> str:
    return "\n".join(_frame(rng, f"({0.01 * k:.6f}) can0 185#{{}}", "") for k in range(int(rng.integers(_ROWS))))


def _asc(rng: Rng) -> str:
    head = _one_of(rng, "base hex timestamps absolute\n", "base dec timestamps relative\n", "date x\n", "")
    lines = (_frame(rng, f"{0.01 * k:.6f} 1 185 Rx d 8 {{}}", " ") for k in range(int(rng.integers(_ROWS))))
    return head + "\n".join(lines)


def _trc(rng: Rng) -> str:
    head = _one_of(rng, ";$FILEVERSION=1.1\n", ";$FILEVERSION=2.1\n;$COLUMNS=N,O,T,I,d,l,D\n", ";$FILEVERSION=9\n", "")
    lines = (_frame(rng, f"{k}) {10.0 * k:.1f} Rx 0185 8 {{}}", " ") for k in range(int(rng.integers(_ROWS))))
    return head + "\n".join(lines)


def _frame(rng: Rng, line: str, between: str) -> str:
    """A line of a frame, with something odd in the place of one of its words."""
    text = line.format(between.join(f"{one:02X}" for one in rng.bytes(int(rng.choice([8] * 12 + [6, 0, 9, 64])))))
    if rng.random() < 0.1:
        words = text.split(" ")
        words[int(rng.integers(len(words)))] = _number(rng)
        text = " ".join(words)
    return text


def _schema() -> bytes:
    return json.dumps({"type": "object", "properties": {name: {"type": "number"} for name in _NAMES}}).encode()


def _message(k: int) -> bytes:
    return json.dumps(dict(zip(_NAMES, (0.02 * k, 10.0, 2.0, 40.0), strict=True))).encode()


def _odd_json(rng: Rng) -> bytes:
    many = int(10 ** rng.uniform(0.0, 5.0))
    texts = ["[" * many, '{"a":' * many, "[" * many + "]" * many, "1" * many, "{", "5", "[[]]", "null", '"\\ud800"']
    texts += [f'{{"motor_speed_rpm":{_number(rng)}}}', f'{{"motor_speed_rpm":{"1" * many}}}', '{"properties":[1]}']
    texts += ['{"properties":{"a":{"type":[[1]]}}}', '{"properties":{"a":' * many, "\x00", "{" + '"a":1,' * many]
    return _one_of(rng, *texts).encode("utf-8", "surrogatepass") + (b"\xff\xfe" if rng.random() < 0.1 else b"")


def _mcap(path: Path, messages: list[bytes], schema: bytes) -> bytes:
    from mcap.writer import Writer

    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("drive", "json", writer.register_schema("drive", "jsonschema", schema))
        for k, data in enumerate(messages):
            writer.add_message(channel, log_time=20_000_000 * k, publish_time=20_000_000 * k, data=data)
        writer.finish()
    return path.read_bytes()


def _messages(rng: Rng, path: Path) -> bytes:
    """An MCAP file whose messages or schema are odd."""
    messages = [_odd_json(rng) if rng.random() < 0.05 else _message(k) for k in range(_ROWS)]
    return _mcap(path, messages, _odd_json(rng) if rng.random() < 0.3 else _schema())


def _records(rng: Rng, whole: bytes) -> bytes:
    """An MCAP file with records that nobody wrote, and lengths that are not theirs."""
    parts = [whole[:8]]
    for _ in range(int(rng.integers(1, 6))):
        content = rng.bytes(int(rng.integers(80)))
        says = int(rng.choice([len(content), len(content), 0, 1 << 31, (1 << 63) - 1, len(content) + 9]))
        parts.append(bytes([int(rng.choice(_RECORDS))]) + struct.pack("<Q", says) + content)
    place = int(rng.integers(8, len(whole)))
    return b"".join([*parts, whole[8:place] if rng.random() < 0.5 else b"", whole[place:] or b""])


def _packed(rng: Rng, text: str) -> bytes:
    """A packed table, or a bomb: so many letters that say nothing."""
    if rng.random() < _BOMBS:
        text += _one_of(rng, " ", "\n", "0", ",", '"') * int(10 ** rng.uniform(5.0, 7.5))
    packed = gzip.compress(text.encode("utf-8", "surrogatepass"), 1)
    return packed + _one_of(rng, "", "", "x" * 20).encode() + (packed if rng.random() < 0.1 else b"")


def _written(prepared: Prepared, rng: Rng, folder: Path) -> tuple[Path, Path | None]:
    """An odd file, and the channel map that goes with it."""
    texts: tuple[tuple[str, Callable[[Rng], str]], ...] = (
        ("csv", _table), ("csv.gz", _table), ("log", _candump), ("asc", _asc), ("trc", _trc),
    )  # fmt: skip
    kind = int(rng.integers(len(texts) + 2))
    if kind >= len(texts):
        path = folder / "odd.mcap"
        path.write_bytes(_messages(rng, path) if kind == len(texts) else _records(rng, prepared.whole))
        return path, prepared.maps["table"] if rng.random() < 0.5 else None
    suffix, made = texts[kind]
    path, text = folder / f"odd.{suffix}", made(rng)
    path.write_bytes(_packed(rng, text) if suffix.endswith("gz") else text.encode("utf-8", "surrogatepass"))
    if suffix.startswith("csv"):
        return path, prepared.maps["table"] if rng.random() < 0.3 else None
    return path, prepared.maps["frames"]


def _check(prepared: Prepared, rng: Rng, folder: Path) -> tuple[str, str]:
    import warnings

    from ramsight.errors import LogWarning, RamsightError
    from ramsight.logs import open_log
    from ramsight.logs.arrival import OUT_OF_ORDER
    from ramsight.logs.inspect import inspect_log
    from ramsight.logs.proposal import map_text
    from ramsight.logs.shown import inspection_table

    path, channel_map = _written(prepared, rng, folder)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", LogWarning)
        try:
            if rng.random() < _INSPECTED:
                inspection_table(found := inspect_log(path))
                map_text(found)
            caught.clear()
            times = [piece["time"].values for piece in open_log(path, channel_map)]
        except RamsightError as error:
            text = str(error)
            if len(text) > 1000 or not text.isprintable():
                raise
            return REFUSED, text
    if caught:
        return WARNED, str(caught[0].message)
    known = (one[np.isfinite(one)] for one in times)  # a time that is no number is a sample that is dropped
    if any((np.diff(one) < -OUT_OF_ORDER).any() for one in known):
        return WRONG, "time goes back without a warning"
    return READ, ""


SECTIONS = [Section("odd input", CASES, prepare, _check)]
