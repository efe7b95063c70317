"""Logs with commands, a shaft's angle, a motor's current, and what was measured beside them."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ramsight.errors import DescriptionError, LogError
from ramsight.logs import read_log
from ramsight.logs.align import Resampler
from ramsight.logs.channel_map import load_map
from ramsight.logs.mapped import Motor, SensorCurve
from ramsight.logs.opening import read_measured

MAP = """
time = {channel = "t", unit = "ms"}
angle = {channel = "phi", per_turn = 4096, sign = -1}
current = {channel = "i", offset = -1425, torque_constant = "0.002 N m", saturation = 5000}
temperature = {constant = "35 degC"}
align = {period = "20 ms"}
command.valve = {channel = "v", scale = 0.001, least = 0.5}
measured.position = {channel = "x", unit = "mm", scale = 0.025}
"""
TURNS = 12.3456  # a second


@pytest.fixture
def folder(tmp_path):
    """A second at 1 kHz: constant speed and current, a valve that is switched, then left alone."""
    time = np.arange(1001)
    counts = np.floor((4095.0 - TURNS * 4096.0 * time / 1000.0) % 4096.0)
    valve = np.where(time < 400, -1000, np.where(time < 600, 1000, 0))
    rows = [f"{t},{c:.0f},1525,{v},{t}" for t, c, v in zip(time, counts, valve, strict=True)]
    (tmp_path / "run.csv").write_text("t,phi,i,v,x\n" + "\n".join(rows) + "\n", encoding="utf-8")
    (tmp_path / "map.toml").write_text(MAP, encoding="utf-8")
    return tmp_path


def test_angle_current_and_command_become_speed_torque_and_command(folder):
    log = read_log(folder / "run.csv", folder / "map.toml")
    period = np.diff(log["time"].values)
    assert np.allclose(period, 0.02)
    turned = float(np.sum(log["motor_speed"].values) * 0.02 / (2.0 * math.pi))
    assert turned == pytest.approx(TURNS * 0.02 * log.sizes["time"], abs=2.0 / 4096.0)
    assert np.allclose(log["motor_torque"].values, 0.002 * 100.0 * (1.0 - 100.0 / 5000.0))
    command = log["valve_command"].values
    assert set(command[np.isfinite(command)]) == {-1.0, 1.0}
    assert np.isnan(command[-1])  # smaller than the least: none


def test_what_was_measured_never_enters_the_log(folder):
    log = read_log(folder / "run.csv", folder / "map.toml")
    measured = read_measured(folder / "run.csv", folder / "map.toml")
    assert "position" not in log
    assert set(measured.data_vars) == {"position"}
    assert np.array_equal(log["time"].values, measured["time"].values)
    assert np.allclose(measured["position"].values, 0.025e-3 * 1000.0 * measured["time"].values, atol=0.02e-3)


CURVE = "{reading = [0, 10, 25], excess = [0, 0.2, -0.1]}"


def with_position(folder, keys):
    """The map with more keys of the measured position."""
    bent = MAP.replace("scale = 0.025}", f"scale = 0.025, {keys}}}")
    assert bent != MAP
    (folder / "bent.toml").write_text(bent, encoding="utf-8")
    return folder / "bent.toml"


def test_a_position_is_what_was_read_less_the_curve_of_its_sensor(folder):
    """Linear between the readings that the map has: 0.2 mm too much at 10, 0.05 mm at 17.5, 0.1 too little at 25 mm."""
    read = read_measured(folder / "run.csv", folder / "map.toml")["position"].values
    bent = with_position(folder, f'linearity = "0.3 mm", curve = {CURVE}')
    assert load_map(bent).linearity == pytest.approx(0.3e-3)
    position = read_measured(folder / "run.csv", bent)["position"].values
    for at, excess in ((5e-3, 0.1e-3), (10e-3, 0.2e-3), (17.5e-3, 0.05e-3), (24e-3, -0.08e-3)):
        k = int(np.argmin(np.abs(read - at)))
        assert read[k] - position[k] == pytest.approx(excess, abs=0.01e-3)


@given(st.lists(st.floats(-1e-3, 1e-3), min_size=3, max_size=9), st.floats(-0.02, 0.12))
def test_a_curve_leads_to_the_reading_and_back(excess, reading):
    curve = SensorCurve(tuple(np.linspace(0.0, 0.1, len(excess))), tuple(excess))
    assert curve.is_unique
    assert float(curve.reading(curve.position(reading))) == pytest.approx(reading, abs=1e-12)


@pytest.mark.parametrize(
    ("keys", "key", "allowed"),
    [
        ('linearity = "0.2 m"', "measured.position.linearity", "0 to 100 mm"),
        ('linearity = "1 K"', "measured.position.linearity", None),
        ("curve = {reading = [0], excess = [0]}", "measured.position.curve.reading", "two or more"),
        ("curve = {reading = [0, 5], excess = [0]}", "measured.position.curve.reading", "as many"),
        ("curve = {reading = [0, 5], excess = [0, 6]}", "measured.position.curve.reading", "read once"),
        ('curve = {reading = [0, "5"], excess = [0, 1]}', "measured.position.curve.reading", "in mm"),
        ('curve = {unit = "bar", reading = [0, 5], excess = [0, 1]}', "measured.position.curve.unit", None),
        ("curve = {reading = [0, 5], excess = [0, 1], x = 1}", "measured.position.curve.x", None),
    ],
)
def test_a_curve_that_cannot_be_is_refused_with_its_key(folder, keys, key, allowed):
    with pytest.raises(DescriptionError) as raised:
        load_map(with_position(folder, keys))
    assert raised.value.key == key
    assert allowed is None or allowed in str(raised.value)


@settings(max_examples=30, deadline=None)
@given(cuts=st.lists(st.integers(1, 900), max_size=6, unique=True), seed=st.integers(0, 99))
def test_pieces_of_any_length_give_the_same_samples(cuts, seed):
    random = np.random.default_rng(seed)
    time = np.cumsum(random.uniform(0.5e-3, 2e-3, 1000))
    speed = np.cumsum(random.uniform(0.0, 0.5, 1000))
    columns = {
        "time": time,
        "motor_speed": speed,
        "motor_torque": random.standard_normal(1000),
        "valve_command": np.sign(random.standard_normal(1000)),
        "reference": np.where(random.random(1000) < 0.01, 0.1, np.nan),
    }
    ends = [0, *sorted(cuts), 1000]
    made = []
    for spans in ([(0, 1000)], list(pairwise(ends))):
        resampler = Resampler(0.02, "log", [(0.2, 0.3)], frozenset({"valve_command"}))
        pieces = [resampler.push({name: values[a:b] for name, values in columns.items()}) for a, b in spans]
        made.append({name: np.concatenate([piece[name] for piece in pieces]) for name in columns})
    for name in columns:
        assert np.allclose(made[0][name], made[1][name], rtol=1e-6, atol=1e-9, equal_nan=True), name


@pytest.mark.parametrize(("samples", "last"), [(101, 0.09), (100, 0.07), (121, 0.11)])
def test_the_last_sample_is_the_last_whose_period_is_complete(samples, last):
    time = np.arange(samples) * 1e-3
    made = Resampler(0.02, "log", None, frozenset({"valve_command"})).push(
        {"time": time, "motor_speed": 10.0 * time, "motor_torque": np.floor(time / 0.02 + 1e-9), "valve_command": time}
    )
    np.testing.assert_allclose(made["time"], np.arange(0.01, last + 1e-6, 0.02), atol=1e-12)
    np.testing.assert_allclose(made["motor_torque"], np.arange(len(made["time"])), atol=1e-12)
    np.testing.assert_allclose(made["motor_speed"], 10.0 * (made["time"] - 0.5e-3), atol=1e-9)
    np.testing.assert_allclose(made["valve_command"], made["time"], atol=1e-9)


def test_a_reference_is_taken_once():
    resampler = Resampler(0.02, "log", None, frozenset())
    time = np.arange(200) * 1e-3
    reference = np.full(200, np.nan)
    reference[57] = 0.3
    made = resampler.push({"time": time, "motor_speed": time, "reference": reference})
    assert np.isfinite(made["reference"]).sum() == 1
    assert made["time"][np.isfinite(made["reference"])][0] == pytest.approx(0.07)


def test_time_that_goes_back_is_refused():
    resampler = Resampler(0.02, "log", None, frozenset())
    with pytest.raises(LogError, match=r"time has to increase.*0\.1 s"):
        resampler.push({"time": np.array([0.0, 0.2, 0.1]), "motor_speed": np.zeros(3)})


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("per_turn = 4096, ", "", "per_turn"),
        ('torque_constant = "0.002 N m", ', "", "torque_constant"),
        ("saturation = 5000", "saturation = -1", "saturation"),
        ('period = "20 ms"', 'period = "2 s"', "8 to 100 ms"),
        ("current =", 'torque = {channel = "M", unit = "N m"}\ncurrent =', "two for one"),
        ("per_turn = 4096, ", "per_turn = 4096, modulus = 2, ", "too small to say which way"),
        ("per_turn = 4096, ", 'per_turn = 4096, modulus = "once", ', "modulus = 'once': is no number"),
        ("least = 0.5", "lest = 0.5", "did you mean 'least'"),
        ("measured.position", "measured.place", "not a key"),
    ],
)
def test_a_map_that_cannot_be_is_refused(tmp_path, old, new, match):
    assert old in MAP
    (tmp_path / "map.toml").write_text(MAP.replace(old, new), encoding="utf-8")
    with pytest.raises(DescriptionError, match=match):
        load_map(tmp_path / "map.toml")


def test_a_log_of_our_own_carries_commands(tmp_path):
    from ramsight.logs import write_log

    text = (
        "time_s,motor_speed_rpm,motor_torque_nm,oil_temperature_c,valve_command\n"
        "0,100,1,35,-1\n0.02,100,1,35,\n0.04,100,1,35,1\n"
    )
    (tmp_path / "log.csv").write_text(text, encoding="utf-8")
    log = read_log(tmp_path / "log.csv")
    assert np.allclose(log["valve_command"].values, [-1.0, np.nan, 1.0], equal_nan=True)
    write_log(log, tmp_path / "again.csv")
    assert (tmp_path / "again.csv").read_text(encoding="utf-8") == text


def test_a_saturated_motor_gives_less():
    assert Motor(0.01).torque(np.array([-50.0, 50.0])).tolist() == [-0.5, 0.5]
    assert Motor(0.01, 100.0).torque(np.array([-50.0, 50.0])).tolist() == [-0.25, 0.25]


def test_a_command_that_never_comes_is_named(folder):
    sparse = MAP.replace('align = {period = "20 ms"}', 'align = {period = "20 ms", empty = "no sample"}')
    (folder / "map.toml").write_text(sparse, encoding="utf-8")
    lines = (folder / "run.csv").read_text(encoding="utf-8").splitlines()
    silent = [",".join([*line.split(",")[:3], "", line.split(",")[4]]) for line in lines[1:]]
    (folder / "run.csv").write_text("\n".join([lines[0], *silent]) + "\n", encoding="utf-8")
    with pytest.raises(LogError, match=r"has no samples of v$"):
        read_log(folder / "run.csv", folder / "map.toml")
