"""A bench for logs: one motion of a drive, what writes it in each format, maps that read it, and how it compares."""

import gzip
import json
import math

import numpy as np
import pytest

from ramsight.logs import read_log
from ramsight.logs.inspect import inspect_log
from ramsight.logs.proposal import map_text

RPM = 2.0 * math.pi / 60.0
N = 300
TIME = np.arange(N) * 0.02
SPEED = np.round(1500.0 * np.sin(TIME))
TORQUE = np.round(12.5 + np.cos(TIME), 3)
OIL = np.full(N, 40.0)
NAMES = ("n_ist [1/min]", "M_ist [Nm]", "T_oil [degC]")
COLUMNS = dict(zip(NAMES, (SPEED, TORQUE, OIL), strict=True))
HEADER = "time_s,motor_speed_rpm,motor_torque_nm,oil_temperature_c"


def written(folder, content, name="map.toml", encoding="utf-8"):
    """A file of text or bytes; text is packed where the name ends in .gz."""
    data = content if isinstance(content, bytes) else content.encode(encoding)
    (folder / name).write_bytes(gzip.compress(data) if name.endswith(".gz") and isinstance(content, str) else data)
    return folder / name


def mapped(folder, file, **more):
    """The log by the map that is proposed, and that map."""
    text = map_text(inspect_log(file, **more))
    return read_log(file, written(folder, text)), text


def roles(speed=NAMES[0], torque=NAMES[1], temperature='constant = "40 degC"', **more):
    """A map of these channels: each a name, or what stands in its braces."""
    keys = {"speed": speed, "torque": torque, "temperature": temperature, **more}
    inside = {key: one if " = " in one else f'channel = "{one}"' for key, one in keys.items()}
    return "".join(f"{key} = {{{one}}}\n" for key, one in inside.items())


def pdo_map(cob_id=0x181, rated="10 N m", speed='channel = "606Ch"', objects=("606Ch", "6077h")):
    """A map of a drive that sends its speed and its torque in one frame."""
    text = roles(speed, f'channel = "6077h", rated = "{rated}"')
    return text + f"[[can.pdo]]\ncob_id = 0x{cob_id:X}\nobjects = {json.dumps(objects)}\n"


def is_the_drive(log, rows=slice(None)):
    """Whether a log has these samples of the motion."""
    time = TIME[rows]
    assert len(log.time) == len(time)
    np.testing.assert_allclose(log.time.values - log.time.values[0], time - time[0], atol=2e-6)
    np.testing.assert_allclose(log.motor_speed.values / RPM, SPEED[rows], atol=1e-6)
    np.testing.assert_allclose(log.motor_torque.values, TORQUE[rows], atol=1e-6)
    np.testing.assert_allclose(log.oil_temperature.values, 313.15)


def own_names(log, folder, position=None):
    """A drive's log in a file whose columns have a maker's names and units, and the map that says which is what."""
    columns = {"t": log["time"], "n": log["motor_speed"], "M": log["motor_torque"] * 10.0}
    columns |= {"T": log["oil_temperature"] - 273.15} | ({} if position is None else {"x": position * 1e3})
    rows = np.column_stack([column.values for column in columns.values()])
    np.savetxt(folder / "own.csv", rows, delimiter=",", header=",".join(columns), comments="", fmt="%.9g")
    units = {"speed": ("n", "rad/s"), "torque": ("M", 'percent", rated = "10 N m'), "temperature": ("T", "degC")}
    text = roles(time="t", **{role: f'channel = "{name}", unit = "{unit}"' for role, (name, unit) in units.items()})
    measured = "" if position is None else '[measured]\nposition = { channel = "x", unit = "mm" }\n'
    return folder / "own.csv", written(folder, text + measured)


def lines_of(separator=",", names=("Time [s]", *NAMES), time=TIME, rows=slice(None)):
    """The motion as lines of a table."""
    cells = zip(*(np.asarray(one)[rows].tolist() for one in (time, *COLUMNS.values())), strict=True)
    return [separator.join(names), *(separator.join(map(str, row)) for row in cells)]


def mf4(path, *groups, units=("1/min", "Nm", "degC"), names=("n_ist", "M_ist", "OilTemp"), master=None, master_unit=""):
    """Groups of channels, each (times, values of a channel, ...); by default speed, torque and temperature."""
    asammdf, of = pytest.importorskip("asammdf"), iter(zip(names, units, strict=True))
    with asammdf.MDF(version="4.10") as mdf:
        for times, *columns in groups:
            signals = []
            for values in columns:
                name, unit = next(of)
                more = {"master_metadata": master} if master else {}
                if isinstance(values, tuple):  # which samples are invalid
                    values, more["invalidation_bits"] = values
                signals.append(asammdf.Signal(np.asarray(values), np.asarray(times), name=name, unit=unit, **more))
            mdf.append(signals, common_timebase=True)
            if master:
                mdf.groups[-1].channels[0].unit = master_unit
        mdf.save(path, overwrite=True)
    return path


def mcap(path, messages, schema=None, encoding="json", schema_encoding="jsonschema", name="drive", **options):
    """Messages (topic, time [s], content), in their order; without a schema their fields are numbers."""
    writers = pytest.importorskip("mcap.writer")
    with path.open("wb") as file:
        writer, channels = writers.Writer(file, **options), {}
        writer.start()
        for topic, time, content in messages:
            if topic not in channels:
                fields = {"type": "object", "properties": {one: {"type": "number"} for one in content}}
                data = schema if isinstance(schema, bytes) else json.dumps(schema or fields).encode()
                number = writer.register_schema(name, schema_encoding, data)
                channels[topic] = writer.register_channel(topic, encoding, number)
            data = content if isinstance(content, bytes) else json.dumps(content).encode()
            writer.add_message(channels[topic], round(time * 1e9), data, round(time * 1e9))
        writer.finish()
    return path


def tdms(path, channels, properties=None):
    """Channels of one group, with properties that are of all or, by name, of one."""
    nptdms, of = pytest.importorskip("nptdms"), properties or {}
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([
            nptdms.ChannelObject("drive", name, np.asarray(one), dict(of.get(name, of if "wf_increment" in of else {})))
            for name, one in channels.items()
        ])  # fmt: skip
    return path


def xlsx(path, rows, others=None, merged=()):
    """A sheet `drive` of rows, and other sheets."""
    book = pytest.importorskip("openpyxl").Workbook()
    book.active.title = "drive"
    sheets = [(book.active, rows), *((book.create_sheet(title), more) for title, more in (others or {}).items())]
    for sheet, lines in sheets:
        for row in lines:
            sheet.append([one.item() if isinstance(one, np.generic) else one for one in row])
    for cells in merged:
        book.active.merge_cells(cells)
    book.save(path)
    return path


def parquet(path, columns, **options):
    """A table of columns."""
    arrow, files = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    files.write_table(arrow.table(columns), path, **options)
    return path


def mat(path, content):
    """Variables of a MATLAB file, version 5."""
    pytest.importorskip("scipy.io").savemat(path, content)
    return path
