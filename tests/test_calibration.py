"""The paper's table: its shapes, its price, and the cache that keeps it."""

from dataclasses import replace

import numpy as np
import pytest

from ramsight.calibration.cached import cache_file, calibrated
from ramsight.calibration.movement import LOADS, TEMPERATURES, _on_common_grid, calibrate, sweep, tabulate
from ramsight.calibration.sensor_file import table_hash

FEW = {"temperatures": np.array([303.15, 313.15]), "loads": 8}


@pytest.fixture(scope="module")
def sweeps(units):
    return {name: sweep(unit) for name, unit in units.items()}


@pytest.fixture(scope="module")
def tables(units, sweeps):
    return {name: tabulate(units[name], found) for name, found in sweeps.items()}


def test_the_booms_whole_table_says_how_far_it_is(units):
    runs = []
    movement = calibrate(units["boom"], advance=runs.append)
    assert LOADS >= 40
    assert len(movement.temperature) == len(TEMPERATURES) >= 6
    assert sum(runs) == 2 * LOADS * len(TEMPERATURES)


@pytest.mark.parametrize("name", ["boom", "bucket"])
def test_lifting_falls_and_lowering_rises_with_the_load_until_the_relief_valve_opens(sweeps, name):
    found = sweeps[name]
    for d, sign in ((0, -1.0), (1, 1.0)):
        for row in range(len(found.temperature)):
            clear = found.relieved[d, row] == 0.0
            assert clear.sum() > 25
            assert (sign * np.diff(found.movement[d, row][clear]) > 0.0).all()


@pytest.mark.parametrize("name", ["boom", "bucket"])
def test_hotter_oil_moves_less_up_and_more_down(sweeps, name):
    found = sweeps[name]
    clear = (found.relieved == 0.0).all(axis=(0, 1)) & (found.load > 10e3)
    assert (np.diff(found.movement[0][:, clear], axis=0) < 0.0).all()
    assert (np.diff(found.movement[1][:, clear], axis=0) > 0.0).all()


@pytest.mark.parametrize("name", ["boom", "bucket"])
def test_lifting_ends_where_the_relief_valve_takes_all_the_flow(sweeps, tables, name):
    found, table = sweeps[name], tables[name]
    assert (found.movement[0, :, -1] < 1e-3 * found.movement[0, :, 0]).all()
    assert (found.relieved[0, :, -1] > 0.3).all()
    assert 0.9 * np.abs(table.lift_torque).max() < table.relief_torque < np.abs(table.lift_torque).max()


def test_the_buckets_torque_has_the_other_sign(tables):
    assert (tables["boom"].lift_torque > 0.0).all()
    assert (tables["bucket"].lift_torque < 0.0).all()


@pytest.mark.parametrize("name", ["boom", "bucket"])
def test_a_tables_torques_increase(tables, name):
    for grid in (tables[name].temperature, tables[name].lift_torque, tables[name].lower_torque):
        assert (np.diff(grid) > 0.0).all()


def test_a_table_is_calibrated_once(units, tmp_path, monkeypatch):
    calibrate(units["boom"], **FEW)
    monkeypatch.setenv("RAMSIGHT_CACHE", str(tmp_path))
    runs = []
    first = calibrated(units["boom"], advance=runs.append, **FEW)
    assert sum(runs) == 32
    second = calibrated(units["boom"], advance=runs.append, **FEW)
    assert sum(runs) == 32
    assert table_hash(first) == table_hash(second)


def test_whatever_a_table_depends_on_names_its_cache(units):
    boom = units["boom"]
    worn = replace(boom, a=replace(boom.a, pump=replace(boom.a.pump, leak_factor=1.1)))
    files = [
        cache_file(boom), cache_file(worn), cache_file(units["bucket"]), cache_file(boom, motor_speed=100.0),
        cache_file(boom, loads=50), cache_file(boom, temperatures=np.array([300.0, 310.0])),
    ]  # fmt: skip
    assert len(set(files)) == len(files)
    assert cache_file(replace(boom)) == files[0]


@pytest.mark.parametrize("spoil", [b"", b"PK\x03\x04 no zip", None])
def test_a_damaged_cache_is_made_anew(units, tmp_path, monkeypatch, spoil):
    calibrate(units["boom"], **FEW)
    monkeypatch.setenv("RAMSIGHT_CACHE", str(tmp_path))
    good = calibrated(units["boom"], **FEW)
    file = cache_file(units["boom"], **FEW)
    whole = file.read_bytes()
    file.write_bytes(whole[: len(whole) // 2] if spoil is None else spoil)
    assert table_hash(calibrated(units["boom"], **FEW)) == table_hash(good)
    assert file.read_bytes() == whole


def test_where_nothing_can_be_kept_a_table_is_still_made(units, tmp_path, monkeypatch):
    calibrate(units["boom"], **FEW)
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    monkeypatch.setenv("RAMSIGHT_CACHE", str(blocked))
    assert calibrated(units["boom"], **FEW).unit == "boom"


def test_the_common_grid_is_that_of_the_middle_row():
    torque = np.array([[1.0, 2.0, 3.0], [1.5, 2.5, 3.5], [2.0, 3.0, 4.0]])
    grid, movement = _on_common_grid(torque[:, ::-1], 10.0 * torque[:, ::-1])
    assert grid.tolist() == [1.5, 2.5, 3.5]
    assert movement[1].tolist() == [15.0, 25.0, 35.0]
