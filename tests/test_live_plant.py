"""A loop of one's own: a plant that waits, its reports in a sensor's words, its oil, and its drive."""

import ast
import copy
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import ramsight
from ramsight.duty.live import LiveUnit
from ramsight.plant.circuit import WARMING

SPEED = 60.0  # rad/s, upwards against the leakage


@pytest.fixture(scope="module")
def press():
    return ramsight.build("press")


def lifted(press, samples=50, **how):
    plant = ramsight.LivePlant(press, start="100 mm", load="100 kN", **how)
    for _ in range(samples):
        plant.advance(SPEED)
    return plant


def test_a_live_plant_is_the_simulated_one(press):
    plant = lifted(press)
    speed = ramsight.Profile([0.0, 0.02, 1.0], [0.0, SPEED, SPEED])
    load, oil = ramsight.Profile([0.0], [100e3]), ramsight.Profile([0.0], [313.15])
    alone = ramsight.simulate(press, ramsight.Duty(speed, load, oil, start_position=0.1))
    run = plant.run()
    assert run.sizes == alone.sizes == {"time": 51}
    for name, least in (("position", 1e-6), ("velocity", 1e-4), ("pressure_a", 2e3), ("motor_speed", 1e-9)):
        np.testing.assert_allclose(run[name], alone[name], atol=least, err_msg=name)
        assert run[name].attrs["units"] == alone[name].attrs["units"]
    assert plant.now.time == pytest.approx(1.0)
    assert [axes.get_ylabel().split("\n")[0] for axes in ramsight.plot(run).axes[:1]] == ["position [mm]"]


def test_reports_are_what_a_sensor_takes(press):
    plant, sensor = ramsight.LivePlant(press, start=0.1, load=100e3), ramsight.sensor_for(press)
    sensor.start(0.1)
    while plant.now.time < 2.0:
        (report,) = plant.reports
        estimate = sensor.step(**report)
        plant.advance("600 rpm")
    assert estimate.position > 0.105
    assert abs(estimate.position - plant.run()["position"].values[-2]) < 1e-3


def test_a_command_may_hold_for_several_samples(press):
    one, several = lifted(press, 10), ramsight.LivePlant(press, start="100 mm", load="100 kN")
    several.advance(SPEED)
    now = several.advance(SPEED, dt="180 ms")
    assert now == several.now == one.now
    assert [round(report["time"], 9) for report in several.reports] == [
        0.04, 0.06, 0.08, 0.1, 0.12, 0.14, 0.16, 0.18, 0.2,
    ]  # fmt: skip


def test_a_load_is_reached_at_the_next_sample_and_stays(press):
    plant = lifted(press, 5)
    assert plant.advance(SPEED, load="150 kN").load == 150e3
    before = plant.now.pressure_a
    assert plant.advance(SPEED).load == 150e3
    assert plant.now.pressure_a > before - 1e6


def test_losses_and_air_change_the_oil(press):
    kept, warmed = lifted(press, 100), lifted(press, 100, ambient="20 degC")
    assert kept.now.oil_temperature == 313.15
    assert 1e-4 < warmed.now.oil_temperature - 313.15 < 1.0
    # Thinner oil leaks more.
    assert warmed.now.position < kept.now.position


def test_oil_that_expands_is_told_how_fast_it_warms(press, monkeypatch):
    told, usual = [], LiveUnit.change

    def change(unit, values):
        told.append(dict(values))
        usual(unit, values)

    monkeypatch.setattr(LiveUnit, "change", change)
    expands = replace(press, oil=replace(press.oil, expansion=7e-4))
    plant = ramsight.LivePlant(expands, start="100 mm", load="100 kN", ambient="20 degC")
    temperatures = [plant.advance(SPEED).oil_temperature for _ in range(2)]
    rate = told[-1][WARMING]
    assert rate == pytest.approx((temperatures[1] - temperatures[0]) / 0.02)
    assert rate > 0.0


def test_the_thermometer_is_in_the_tank(press):
    plant = ramsight.LivePlant(press, start="100 mm", load="100 kN", oil_temperature="60 degC", ambient="20 degC")
    plant.advance(SPEED, dt="2 s")
    read = [report["oil_temperature"] for report in plant.reports]
    assert len(read) == 100
    assert np.mean(read) == pytest.approx(333.15, abs=0.1)
    assert np.std(read) > 0.1, "with its noise"


def test_a_late_drive_reports_later_and_a_lossy_one_less(press):
    late = ramsight.DriveResponse(command_delay=0.04, report_delay=0.02)
    plant = ramsight.LivePlant(press, start="100 mm", load="100 kN", drive=late)
    speeds = []
    for _ in range(6):
        plant.advance(SPEED)
        speeds.append((plant.now.motor_speed, plant.reports[0]["motor_speed"]))
    assert [true for true, _ in speeds] == [0.0, 0.0, SPEED, SPEED, SPEED, SPEED]
    assert [round(said) for _, said in speeds] == [0, 0, 0, 60, 60, 60]
    lossy = ramsight.LivePlant(press, start="100 mm", load="100 kN", drive=ramsight.DriveResponse(lost=0.5))
    arrived = sum(bool(lossy.advance(0.0) and lossy.reports) for _ in range(40))
    assert 10 < arrived < 30


def test_the_same_seed_gives_the_same_reports(press):
    def last(seed):
        return lifted(press, 3, seed=seed).reports[-1]

    assert last(1) == last(1)
    assert last(1) != last(2)


def test_what_is_declared_is_reported_and_valves_are_commanded():
    rig = ramsight.load_machine("eha-valve-rig").unit("axis")
    plant = ramsight.LivePlant(rig, "axis", start="50 mm")
    (column,) = ramsight.sensor_for(rig, unit="axis").commands
    assert plant.reports[0][column] == 1.0
    with pytest.raises(ramsight.UnknownNameError, match="valve"):
        plant.advance(50.0, vavle=-1.0)
    with pytest.raises(ramsight.DescriptionError, match=column):
        plant.advance(50.0, **{column: 2.0})
    ways = []
    for command in (1.0, -1.0):
        before = plant.now.position
        plant.advance(50.0, dt="0.4 s", **{column: command})
        ways.append(plant.now.position - before)
        assert plant.reports[-1][column] == command
    assert ways[0] > 1e-4 > -1e-4 > ways[1]


def test_a_motor_turns_no_faster_than_it_can(press):
    plant = ramsight.LivePlant(press, start="100 mm", load="100 kN")
    assert plant.advance(1e4, dt="0.1 s").motor_speed == press.max_speed
    assert plant.advance(-1e4, dt="0.1 s").motor_speed == -press.max_speed


@pytest.mark.parametrize(
    ("made", "words"),
    [
        ({"start": "9 m"}, "start = '9 m'.*0 mm to 400 mm"),
        ({"load": "5 kg"}, "load = '5 kg'"),
        ({"load": 130}, "load = 130: .*'130 kN'"),
        ({"oil_temperature": 500.0}, "oil_temperature"),
        ({"ambient": "200 degC"}, "ambient"),
        ({"as_built": 1.2}, "as_built = 1.2: is neither AsBuilt nor None"),
        ({"drive": 0.04}, "drive = 0.04: is no DriveResponse"),
        ({"seed": -1}, "seed = -1: is out of range"),
        ({"seed": 1.5}, "seed = 1.5: is out of range"),
        ({"period": "1 s"}, "period"),
    ],
)
def test_a_plant_that_cannot_be_is_refused_in_one_line(press, made, words):
    with pytest.raises(ramsight.DescriptionError, match=words):
        ramsight.LivePlant(press, **made)


@pytest.mark.parametrize(
    ("told", "words"),
    [
        ({"motor_speed": "5 bar"}, "motor_speed = '5 bar'"),
        ({"motor_speed": float("nan")}, "motor_speed"),
        ({"motor_speed": 0.0, "load": "a lot"}, "load"),
        ({"motor_speed": 0.0, "dt": "30 ms"}, "dt = '30 ms': is no whole number of periods"),
        ({"motor_speed": 0.0, "dt": 0.0}, "dt"),
    ],
)
def test_a_command_that_cannot_be_is_refused_and_nothing_moves(press, told, words):
    plant = ramsight.LivePlant(press)
    with pytest.raises(ramsight.DescriptionError, match=words):
        plant.advance(**{"load": "90 kN", **told})
    assert plant.now.time == 0.0
    assert plant.advance(0.0).load == 0.0, "nor does what was told beside it stay"


def test_a_loop_of_ones_own_takes_less_than_twenty_lines():
    tree = ast.parse((Path(__file__).parent.parent / "examples" / "own_loop.py").read_text(encoding="utf-8"))
    (loop,) = [node for node in tree.body if isinstance(node, ast.While)]
    assert loop.end_lineno - loop.lineno + 1 < 20


@pytest.mark.parametrize("made", [copy.copy, copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))])
@pytest.mark.parametrize("how", [{}, {"ambient": "20 degC", "drive": ramsight.DriveResponse(report_delay="20 ms")}])
def test_a_copy_goes_on_from_where_the_plant_is_and_is_its_own(press, made, how):
    plant = lifted(press, 5, **how)
    other, before = made(plant), plant.now
    assert [other.advance(SPEED) for _ in range(5)][-1].position > before.position
    assert plant.now == before
    assert [plant.advance(SPEED) for _ in range(5)][-1] == other.now
    assert plant.reports == other.reports
