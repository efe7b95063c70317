"""Damaged logs of every format: read, read with a warning, or refused in one line with the file's name."""

from __future__ import annotations

import gzip
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from harness import READ, REFUSED, WARNED, WRONG, Rng, Section
from judge import ROOT, Judge
from mutate import mutated

CASES = 5000
_INSPECTED = 0.2  # share of the files that are looked into before they are tracked
_DBC = ROOT / "tests" / "can" / "drive.dbc"
CAN_MAP = f"""
speed = {{ channel = "MotorSpeed" }}
torque = {{ channel = "MotorTorque" }}
temperature = {{ channel = "OilTemperature" }}
[can]
dbc = "{_DBC}"
"""


@dataclass
class Prepared:
    """What the cases of a format share: files as they were, and who judges what is read of the damaged ones."""

    judge: Judge
    contents: list[bytes]
    name: str
    channel_map: Path | None = None
    first_time: float | None = None


def tables(name: str) -> Callable[[Path], Prepared]:
    """Prepares a log as a table of some format."""

    def prepare(folder: Path) -> Prepared:
        from ramsight.logs import write_log

        judge = Judge()
        write_log(judge.log, folder / name)
        contents = [(folder / name).read_bytes()]
        if name.endswith(".mf4"):
            from asammdf import MDF

            with MDF(folder / name) as mdf:  # as many loggers write it, not packed
                contents.append(Path(mdf.save(folder / "plain.mf4", overwrite=True, compression=0)).read_bytes())
        if name.endswith(".mcap"):
            contents.append(_plain_mcap(contents[0], folder / "plain.mcap"))
        return Prepared(judge, contents, name)

    return prepare


def _plain_mcap(content: bytes, path: Path) -> bytes:
    """The same messages not packed, not in chunks and without their checksums, so that damage comes through."""
    from io import BytesIO

    from mcap.reader import make_reader
    from mcap.writer import CompressionType, Writer

    with open(path, "wb") as file:
        writer = Writer(file, use_chunking=False, compression=CompressionType.NONE, enable_crcs=False)
        writer.start(profile="", library="a recorder")
        numbers: dict[int, int] = {}
        for schema, channel, message in make_reader(BytesIO(content)).iter_messages():
            if channel.id not in numbers:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                numbers[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, number)
            stamp = message.log_time
            writer.add_message(numbers[channel.id], stamp, message.data, stamp, message.sequence)
        writer.finish()
    return path.read_bytes()


def frames(name: str, **options: Any) -> Callable[[Path], Prepared]:
    def prepare(folder: Path) -> Prepared:
        import cantools

        import can
        from ramsight.logs.source_by_suffix import open_frames

        judge = Judge()
        database = cantools.database.load_file(_DBC)
        contents = []
        for more in ({}, options) if options else ({},):
            with can.Logger(str(folder / name), **more) as logger:
                for message in messages(judge, database, can):
                    logger(message)
            contents.append((folder / name).read_bytes())
        (folder / "map.toml").write_text(CAN_MAP)
        first = next(open_frames(folder / name)).time
        return Prepared(judge, contents, name, folder / "map.toml", first)

    return prepare


def messages(judge: Judge, database: Any, can: Any) -> Any:
    log = judge.log
    speed, torque = log.motor_speed.values * 30 / np.pi, log.motor_torque.values
    for k, time in enumerate(log.time.values):
        slow = {"Page": 1, "OilTemperature": round(float(log.oil_temperature[k]) - 273.15), "TopSwitch": 0}
        state = {"MotorSpeed": speed[k], "MotorTorque": torque[k], "TorqueTarget": 0.0}
        sent = [(641, "DriveSlow", slow)] if k % 50 == 0 else []
        for number, name, values in [*sent, (385, "DriveState", state)]:
            data = database.encode_message(name, values)
            yield can.Message(timestamp=1.7e9 + time, arbitration_id=number, data=data, is_extended_id=False)


def check(prepared: Prepared, rng: Rng, folder: Path) -> tuple[str, str]:
    from ramsight.errors import LogWarning, RamsightError
    from ramsight.logs import open_log
    from ramsight.logs.inspect import inspect_log
    from ramsight.logs.proposal import map_text
    from ramsight.logs.shown import inspection_table

    path = folder / f"damaged-{prepared.name}"
    content = prepared.contents[int(rng.integers(len(prepared.contents)))]
    if prepared.name.endswith(".gz") and rng.random() < 0.5:  # packed after the damage
        path.write_bytes(gzip.compress(mutated(gzip.decompress(content), rng), 1))
    else:
        path.write_bytes(mutated(content, rng))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", LogWarning)
        try:
            if rng.random() < _INSPECTED:
                inspection_table(found := inspect_log(path))
                map_text(found)
            caught.clear()  # what inspect has said of a column that is not used
            begun = _begun(path, prepared)
            tracks = prepared.judge.track(open_log(path, prepared.channel_map), begun)
        except RamsightError as error:
            text = str(error)
            if (
                not text.startswith(str(path))
                or len(text) > 1000
                or len(text.splitlines()) > 1
                or not text.isprintable()
            ):
                raise
            return REFUSED, text
    if caught:
        return WARNED, str(caught[0].message)
    if wrong := prepared.judge.wrong(tracks, begun):
        return WRONG, wrong
    return READ, ""


def _begun(path: Path, prepared: Prepared) -> float:
    """How late the first frame is [s]; clocks of CAN logs count from there, those of tables have their own zero."""
    from ramsight.errors import RamsightError
    from ramsight.logs.source_by_suffix import open_frames

    if prepared.first_time is None:
        return 0.0
    try:
        late = next(open_frames(path)).time - prepared.first_time
    except (RamsightError, StopIteration):
        return 0.0
    return late if 0.0 < late < 27.0 else 0.0


SECTIONS = [
    Section("log CSV", CASES, tables("log.csv"), check),
    Section("log CSV.gz", CASES, tables("log.csv.gz"), check),
    Section("log Parquet", CASES, tables("log.parquet"), check),
    Section("log MF4", CASES, tables("log.mf4"), check),
    Section("log MCAP", CASES, tables("log.mcap"), check),
    Section("log BLF", CASES, frames("log.blf", compression_level=0), check),
    Section("log ASC", CASES, frames("log.asc"), check),
    Section("log candump", CASES, frames("log.log"), check),
]
