"""Damaged DBC files, channel maps and truths beside a log that is whole: used, or refused in one line.

What such a file says cannot be judged (another sign is another machine), so nothing here is silently wrong.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

from harness import READ, REFUSED, Rng, Section
from judge import ROOT, TRACE
from mutate import mutated

CASES = 2000
_DBC = ROOT / "tests" / "can" / "drive.dbc"
_MAP = """time = { channel = "time_s", unit = "s" }
speed = { channel = "motor_speed_rpm", unit = "rpm", sign = 1, scale = 1.0, offset = 0.0, hold = "0.5 s" }
[torque]
channel = "motor_torque_nm"
unit = "percent"
rated = "35 N m"
[temperature]
channel = "oil_temperature_c"
unit = "degC"
[[reference]]
channel = "motor_torque_nm"
position = "790 mm"
edge = "rising"
[align]
base = "torque"
empty = "no sample"
[csv]
header_line = 1
separator = ","
encoding = "utf-8"
"""
_CAN_MAP = 'speed = {{channel = "{0}"}}\ntorque = {{channel = "{1}"}}\ntemperature = {{channel = "{2}"}}\n[can]\n'


def _dbc(folder: Path) -> bytes:
    import can

    with can.Logger(str(folder / "log.blf")) as logger:
        for k in range(200):
            for number in (385, 641):
                logger(
                    can.Message(
                        timestamp=k * 0.01, arbitration_id=number, data=bytes([1]) + bytes(7), is_extended_id=False
                    )
                )
    text = _CAN_MAP.format("MotorSpeed", "MotorTorque", "OilTemperature")
    (folder / "map.toml").write_text(text + 'dbc = "damaged.dbc"\n')
    return _DBC.read_bytes()


def _plain(content: bytes) -> Callable[[Path], bytes]:
    def prepare(folder: Path) -> bytes:
        import gzip

        (folder / "log.csv").write_bytes(gzip.decompress(Path(f"{TRACE}.csv.gz").read_bytes()))
        return content or gzip.decompress(Path(f"{TRACE}_truth.csv.gz").read_bytes())

    return prepare


def _checked(use: Callable[[Path], Any], name: str) -> Callable[[Any, Rng, Path], tuple[str, str]]:
    def check(content: Any, rng: Rng, folder: Path) -> tuple[str, str]:
        from ramsight.errors import RamsightError

        (folder / name).write_bytes(mutated(content, rng))
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                use(folder)
        except RamsightError as error:
            text = str(error)
            if len(text) > 2000 or len(text.splitlines()) > 1 or not text.isprintable():
                raise
            return REFUSED, text
        return READ, ""

    return check


def _read_frames(folder: Path) -> None:
    from ramsight.logs import read_log
    from ramsight.logs.inspect import inspect_log
    from ramsight.logs.proposal import map_text

    read_log(folder / "log.blf", folder / "map.toml")
    map_text(inspect_log(folder / "log.blf", folder / "map.toml"))


def _read_mapped(folder: Path) -> None:
    from ramsight.logs import read_log

    read_log(folder / "log.csv", folder / "map.toml")


def _read_truth(folder: Path) -> None:
    from ramsight.logs import read_truth

    read_truth(folder / "truth.csv")


SECTIONS = [
    Section("DBC file", CASES, _dbc, _checked(_read_frames, "damaged.dbc")),
    Section("channel map", CASES, _plain(_MAP.encode()), _checked(_read_mapped, "map.toml")),
    Section("truth CSV", CASES, _plain(b""), _checked(_read_truth, "truth.csv")),
]
