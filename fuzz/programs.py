"""Damaged logs of measurement programs and of CAN loggers, as `logs` has those of other formats."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from harness import Section
from judge import Judge
from logs import _DBC, CAN_MAP, CASES, Prepared, check, frames, messages

_SEGMENT = 50  # samples
_TABLE_MAP = """
time = { channel = "time_s" }
speed = { channel = "motor_speed_rpm" }
torque = { channel = "motor_torque_nm" }
temperature = { channel = "oil_temperature_c" }
"""


def _columns(judge: Judge) -> dict[str, Any]:
    log = judge.log
    return {
        "time_s": log.time.values,
        "motor_speed_rpm": log.motor_speed.values * 30.0 / np.pi,
        "motor_torque_nm": log.motor_torque.values,
        "oil_temperature_c": log.oil_temperature.values - 273.15,
    }


def _tdms(path: Path, columns: dict[str, Any]) -> None:
    import nptdms

    with nptdms.TdmsWriter(path) as writer:  # piece by piece, as a program writes while it measures
        for first in range(0, len(columns["time_s"]), _SEGMENT):
            pieces = {name: one[first : first + _SEGMENT] for name, one in columns.items()}
            writer.write_segment([nptdms.ChannelObject("drive", name, one) for name, one in pieces.items()])


def _mat(path: Path, columns: dict[str, Any]) -> None:
    from scipy.io import savemat

    savemat(path, columns, do_compression=True)


def _mat_hdf5(path: Path, columns: dict[str, Any]) -> None:
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        for name, one in columns.items():
            file.create_dataset(name, data=np.atleast_2d(one), chunks=True, compression=3)


def _xlsx(path: Path, columns: dict[str, Any]) -> None:
    import openpyxl

    book = openpyxl.Workbook()
    book.active.append(list(columns))
    for row in np.column_stack(list(columns.values())).tolist():
        book.active.append(row)
    book.save(path)


def _scope(path: Path, columns: dict[str, Any]) -> None:
    names = list(columns)[1:]
    lines = ["Name\tScope", "Starttime of export\t134087976000000000", ""]
    lines += ["\t".join(f"{key}\t{one}" for one in of) for key, of in (("Name", names), ("SampleTime[ms]", ["20"] * 3))]
    for time, *values in zip(*columns.values(), strict=True):
        lines.append("\t".join(f"{1e3 * time:.0f}\t{one:.6f}" for one in values))
    path.write_text("\n".join([*lines, "EOF", ""]))


def _programs(name: str, *writers: Callable[[Path, dict[str, Any]], None], has_map: bool = True) -> Any:
    def prepare(folder: Path) -> Prepared:
        judge, contents = Judge(), []
        for writer in writers:
            writer(folder / name, _columns(judge))
            contents.append((folder / name).read_bytes())
        (folder / "map.toml").write_text(_TABLE_MAP if has_map else _TABLE_MAP.partition("\n")[2].partition("\n")[2])
        return Prepared(judge, contents, name, folder / "map.toml")

    return prepare


def _rows(name: str, header: str, row: Callable[[Any], str]) -> Any:
    """A log of frames as text, a row a frame."""

    def prepare(folder: Path) -> Prepared:
        import cantools

        import can
        from ramsight.logs.source_by_suffix import open_frames

        judge = Judge()
        lines = [row(one) for one in messages(judge, cantools.database.load_file(_DBC), can)]
        (folder / name).write_text("\n".join([header, *lines, ""]))
        (folder / "map.toml").write_text(CAN_MAP)
        first = next(open_frames(folder / name)).time
        return Prepared(judge, [(folder / name).read_bytes()], name, folder / "map.toml", first)

    return prepare


def _busmaster(message: Any) -> str:
    ticks = round((message.timestamp - 1.7e9) * 1e4) + 36_000 * 10_000
    seconds, parts = divmod(ticks, 10_000)
    clock = f"{seconds // 3600}:{seconds // 60 % 60:02d}:{seconds % 60:02d}:{parts:04d}"
    return f"{clock} Rx 1 0x{message.arbitration_id:X} s {len(message.data)} {message.data.hex(' ').upper()}"


def _savvycan(message: Any) -> str:
    data = "".join(f"{one:02X}," for one in message.data)
    stamp = round((message.timestamp - 1.7e9) * 1e6)
    return f"{stamp},{message.arbitration_id:08X},false,Rx,0,{len(message.data)},{data}"


SECTIONS = [
    Section("log TRC", CASES, frames("log.trc"), check),
    Section("log BUSMASTER", CASES, _rows("log.log", "***BUSMASTER Ver 3.2.2***\n***HEX***", _busmaster), check),
    Section(
        "log CAN CSV",
        CASES,
        _rows("log.csv", "Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8", _savvycan),
        check,
    ),
    Section("log TDMS", CASES, _programs("log.tdms", _tdms), check),
    Section("log MATLAB", CASES, _programs("log.mat", _mat, _mat_hdf5), check),
    Section("log Excel", CASES, _programs("log.xlsx", _xlsx), check),
    Section("log TwinCAT Scope", CASES, _programs("log.csv", _scope, has_map=False), check),
]
