"""Logs that mislead: files as people's tools write them, which were read wrongly and without a word."""

import json

import numpy as np
import pytest

from ramsight.errors import LogWarning
from ramsight.logs import read_drive_log
from ramsight.logs.arrival import arrivals
from ramsight.logs.inspect import inspect_log
from ramsight.logs.proposal import map_text

RPM = 2.0 * np.pi / 60.0
N = 400
TIME = np.arange(N) * 0.02
SPEED = np.round(1500.0 * np.sin(TIME))
TORQUE = np.round(12.5 + np.cos(TIME), 3)


def written(folder, text, name="map.toml", encoding="utf-8"):
    file = folder / name
    file.write_text(text, encoding=encoding)
    return file


def mapped(folder, file, **more):
    """The log by the map that is proposed, and that map."""
    text = map_text(inspect_log(file, **more))
    return read_drive_log(file, written(folder, text)), text


def mf4(path, speed_time=TIME, torque_time=TIME, oil_time=None, **master):
    """A file with three groups."""
    asammdf = pytest.importorskip("asammdf")
    oil_time = torque_time[::25] if oil_time is None else oil_time
    mdf = asammdf.MDF(version="4.10")
    for time, values, name, unit in [
        (speed_time, SPEED, "n_ist", "1/min"),
        (torque_time, TORQUE, "M_ist", "Nm"),
        (oil_time, np.full(len(oil_time), 40.0), "OilTemp", "degC"),
    ]:
        values = values[: len(time)]
        mdf.append([asammdf.Signal(samples=values, timestamps=time, name=name, unit=unit, **master)])
    mdf.save(path, overwrite=True)
    mdf.close()
    return path


def mcap(path, messages, schema=None, encoding="json", schema_encoding="jsonschema"):
    """A file of messages: topic, time [s], content; in the order of the list."""
    writers = pytest.importorskip("mcap.writer")
    with path.open("wb") as file:
        writer = writers.Writer(file)
        writer.start()
        channels = {}
        for topic, time, content in messages:
            if topic not in channels:
                named = schema or {
                    "type": "object", "properties": {name: {"type": "number"} for name in content},
                }  # fmt: skip
                data = named if isinstance(named, bytes) else json.dumps(named).encode()
                number = writer.register_schema(topic, schema_encoding, data)
                channels[topic] = writer.register_channel(topic, encoding, number)
            stamp = round(time * 1e9)
            data = content if isinstance(content, bytes) else json.dumps(content).encode()
            writer.add_message(channels[topic], stamp, data, stamp)
        writer.finish()
    return path


# ---- clocks that are wrong


@pytest.mark.parametrize(
    ("places", "wrong"), [([100], 5e9), ([100], -5e9), ([100, 101, 102], 900.0), ([100, 101], -0.3), ([0], 77.0)]
)
def test_a_bad_time_stamp_of_a_group_costs_one_sample(tmp_path, places, wrong):
    time = TIME.copy() + 10.0
    time[places] = time[places] + wrong
    file = mf4(tmp_path / "log.mf4", speed_time=time, torque_time=TIME + 10.0)
    with pytest.warns(LogWarning, match=rf"group 0: .*sample {places[0] + 1}: ") as caught:
        log, text = mapped(tmp_path, file)
    assert "hold" not in text
    assert not [one for one in caught if "group 1" in str(one.message)]
    good = np.isfinite(log.motor_speed.values)
    assert N - len(places) - 2 <= good.sum()
    place = np.searchsorted(TIME + 10.0, log.time.values - 1e-9)
    assert np.abs(log.motor_speed.values / RPM - SPEED[place])[good].max() < 1e-6


def test_a_clock_that_goes_back_in_all_groups_is_said_and_what_follows_is_read(tmp_path):
    time = np.where(TIME < 4.0, TIME + 3600.0, TIME)
    with pytest.warns(LogWarning, match=r"time goes back once from 360\d\.\d+ s to 4"):
        log, text = mapped(tmp_path, mf4(tmp_path / "log.mf4", time, time))
    assert "hold" not in text
    assert np.isfinite(log.motor_speed.values).sum() >= N - 2
    np.testing.assert_allclose(log.motor_torque.values[-150:], TORQUE[-150:])
    np.testing.assert_allclose(log.motor_speed.values[-150:] / RPM, SPEED[-150:])


def test_groups_of_other_rates_go_back_together():
    fast = np.concatenate([np.arange(500) * 0.01 + 100.0, np.arange(500) * 0.01])
    slow = np.concatenate([np.arange(5) + 100.5, np.arange(5) + 0.5])
    found = arrivals({0: fast, 1: slow})
    assert not found[0].wild.any()
    assert (np.diff(found[0].order) >= 0).all()
    place = np.searchsorted(found[1].order, found[0].order, side="right") - 1
    known = place >= 0
    assert np.abs(fast - slow[np.maximum(place, 0)])[known & (np.arange(1000) % 500 > 60)].max() < 1.02


def test_samples_a_little_out_of_order_are_no_bad_time_stamps():
    time = TIME.copy()
    time[[50, 51]] = time[[51, 50]]
    assert not arrivals({0: time})[0].wild.any()


@pytest.mark.parametrize("jump", [1e6, -50.0])
def test_a_bad_time_stamp_in_mcap_costs_one_sample(tmp_path, jump):
    messages = []
    for number, time in enumerate(TIME + 100.0):
        stamp = time + (jump if number == 200 else 0.0)
        messages.append(("/speed", stamp, {"motor_speed_rpm": SPEED[number]}))
        messages.append(("/rest", time, {"motor_torque_nm": TORQUE[number], "oil_temperature_c": 40.0}))
    file = mcap(tmp_path / "log.mcap", messages)
    with pytest.warns(LogWarning, match="time goes back once"):
        log = read_drive_log(file)
    assert np.isfinite(log.motor_speed.values).sum() >= N - 2
    np.testing.assert_allclose(log.motor_speed.values[-150:] / RPM, SPEED[-150:])


@pytest.mark.parametrize("end", [".mf4", ".csv"])
def test_a_pause_is_no_reason_to_hold_a_value_longer(tmp_path, end):
    time = np.where(TIME < 4.0, TIME, TIME + 1800.0)
    if end == ".mf4":
        file = mf4(tmp_path / "log.mf4", time, time)
    else:
        rows = [f"{t:.3f},{n},{m},40" for t, n, m in zip(time, SPEED, TORQUE, strict=True)]
        head = "time_s,motor_speed_rpm,motor_torque_nm,oil_temperature_c"
        file = written(tmp_path, "\n".join([head, *rows]), "log.csv")
    _, text = mapped(tmp_path, file)
    assert "hold" not in text
    assert {round(one.rate) for one in inspect_log(file).channels if one.role in ("speed", "torque")} == {50}


def test_what_comes_seldom_is_held_for_longer(tmp_path):
    rows = [f"{2 * k},{n},{m},40" for k, (n, m) in enumerate(zip(SPEED, TORQUE, strict=True))]
    file = written(tmp_path, "\n".join(["time_s,motor_speed_rpm,motor_torque_nm,oil_temperature_c", *rows]), "log.csv")
    assert 'hold = "10 s"  # it comes every 2 s' in map_text(inspect_log(file))
