"""Weighings while a machine works: those of a log of the same samples, bit for bit."""

from dataclasses import astuple

import numpy as np
import pytest

import ramsight
from ramsight import machine
from ramsight.api.live_weighing import weigher_for
from ramsight.duty.linked_duty import simulate_linked, unit_run
from ramsight.duty.loading import lifting
from ramsight.plant.linked import build_linked
from ramsight.sensor.virtual_sensor import HIGHEST, LOWEST
from ramsight.tool.weighing_events import Quality

LINKED = build_linked(machine.load_machine("mining-loader"))
STARTS = {"boom": "70 mm", "bucket": "250 mm"}
REPORTED = ("time", "motor_speed", "motor_torque", "oil_temperature")


def worked(logs, names=("boom", "bucket"), **how):
    """A machine's sensors and its weighing, given what its drives report; also when weighings came [s]."""
    sensors = {name: ramsight.sensor_for("mining-loader", unit=name) for name in names}
    for name, one in sensors.items():
        one.start(STARTS[name])
    live, came = ramsight.LiveWeighing("mining-loader", **how), []
    columns = [np.column_stack([logs[name][key].values for key in REPORTED]).tolist() for name in names]
    for samples in zip(*columns, strict=True):
        for one, sample in zip(sensors.values(), samples, strict=True):
            one.step(*sample)
        if live.step(samples[0][0], sensors) is not None:
            came.append((samples[0][0], live.weighings[-1]))
    return live, came


def same(live, whole):
    for one, other in zip(live, whole, strict=True):
        for a, b in zip(astuple(one), astuple(other), strict=True):
            assert np.array_equal(a, b, equal_nan=True) if isinstance(a, float | np.ndarray) else a == b


def whole(logs, **how):
    beside = {"beside": {"bucket": logs["bucket"]}} if "bucket" in logs else {}
    return ramsight.weigh("mining-loader", logs["boom"], start="70 mm", at={"bucket": "250 mm"}, **beside, **how)


def test_from_both_sensors_they_are_those_of_both_logs(logs):
    live, came = worked(logs)
    assert live.finish() is None
    found = whole(logs)
    same(live.weighings, found.weighings)
    assert [one.is_good for one in live.weighings] == [True, True]
    assert (live.total, live.total_std, live.cycles) == (found.total, found.total_std, found.cycles)
    for (time, _), one in zip(came, found.weighings, strict=True):
        assert time - (one.time + 0.5 * one.duration) < 0.7, "it comes at the end of its lift"


def test_with_a_learned_scale_on_a_slope_and_a_bucket_that_stands(logs):
    taught = ramsight.weigh(
        "mining-loader", logs["boom"], start="70 mm", at={"bucket": "250 mm"}, lowered_empty=True, inclination="1 deg"
    )
    live, _ = worked({"boom": logs["boom"]}, ["boom"], at={"bucket": "250 mm"}, scale=taught.scale, inclination="1 deg")
    same(live.weighings, taught.weighings)


def test_a_log_that_ends_in_a_lift_and_one_that_is_in_pieces(logs):
    """A gap in a lift, a sample that comes twice, samples every 0.15 s, and no end of the last motion."""
    boom = logs["boom"]
    time = boom["time"].values
    second = time[-1] - 16.0
    kept = np.flatnonzero(~((time > 7.0) & (time < 7.3)) & (time < second))
    twice, slow = np.sort([*kept, kept[400], kept[700]]), kept[::7]
    for rows, count in ((kept, 3), (twice, 3), (kept[:420], 2), (slow, 0)):
        cut = {"boom": boom.isel(time=rows)}
        live, _ = worked(cut, ["boom"], at={"bucket": "250 mm"})
        live.finish()
        found = whole(cut).weighings
        assert len(live.weighings) == len(found) == count, "every 0.15 s is no motion"
        same(live.weighings, found)


def test_up_and_down_of_one_load_are_averaged_once_it_is_lowered(logs):
    run = simulate_linked(LINKED, lifting(LINKED, [0.0]))
    empty = {"boom": ramsight.drive_report(unit_run(run, "boom"))}
    live, came = worked(empty, ["boom"], at={"bucket": "250 mm"})
    assert [one.direction for _, one in came] == ["up", "both"]
    same(live.weighings, whole(empty).weighings)


def test_a_motion_is_weighed_once(logs):
    live, _ = worked(logs)
    assert live.finish() is None
    assert live.finish() is None


class Says:
    """A sensor that says what it is asked to."""

    outputs = ("position", "position_std", "velocity", "load", "load_std", "load_age", LOWEST, HIGHEST, "status")

    def __init__(self, **says):
        self.says = says.__getitem__


def motion(seconds, start=0.0, **says):
    """Samples of a rod that moves, and of one that rests after it."""
    known = {"load": 3e5, "load_std": 2e3, "load_age": 0.0, "status": 0.0, "position_std": 1e-3} | says
    for k in range(round(50 * (seconds + 0.5))):
        moves = k < 50 * seconds
        place = 0.1 + 0.02 * min(0.02 * k, seconds)
        off = known["position_std"] * 1.96
        yield start + 0.02 * k, Says(**known, position=place, velocity=0.02 * moves,
                                     **{LOWEST: place - off, HIGHEST: place + off})  # fmt: skip


def test_a_clock_that_goes_back_and_comes_again_is_one_clock():
    again, plain = (weigher_for("mining-loader", at={"bucket": "250 mm"}) for _ in range(2))
    rows = list(motion(5.0))
    for time, one in rows:
        plain.step(time, {"boom": one})
    for k, (time, one) in enumerate(rows):
        for at in (time, time - 0.02, time) if k == 120 else (time,):
            again.step(at, {"boom": one})
    assert again.tally.last.mass == plain.tally.last.mass


def test_a_clock_that_begins_again_ends_a_motion_and_goes_on():
    live = weigher_for("mining-loader", at={"bucket": "250 mm"})
    for start in (5000.0, 0.0):
        for time, one in list(motion(5.0, start))[: 250 if start else None]:
            live.step(time, {"boom": one})
    assert live.tally.count == 2
    assert live.tally.last.duration == pytest.approx(3.7, abs=0.1)
    assert live.tally.last.time == pytest.approx(2.7, abs=0.1)


def test_a_position_whose_band_leads_out_of_the_mechanism_is_not_known():
    live = weigher_for("mining-loader", at={"bucket": "250 mm"})
    for time, one in motion(5.0, position_std=0.5):
        live.step(time, {"boom": one})
    assert live.tally.last.quality is Quality.UNKNOWN_POSITION


def test_a_motion_of_a_quarter_of_an_hour_is_one_weighing():
    """Whatever is kept of it has a fixed size."""
    live = weigher_for("mining-loader", at={"bucket": "250 mm"})
    moves = next(motion(1.0))[1]
    for k in range(45_000):
        live.step(0.02 * k, {"boom": moves})
    assert live.finish().duration == pytest.approx(900.0 - 1.3, abs=0.2)
    assert live.tally.count == 1


def test_an_unknown_position_is_bad_live_too(logs):
    sensor, live = ramsight.sensor_for("mining-loader", unit="boom"), ramsight.LiveWeighing("mining-loader")
    for sample in np.column_stack([logs["boom"][key].values for key in REPORTED])[:900].tolist():
        sensor.step(*sample)
        live.step(sample[0], {"boom": sensor})
    live.finish()
    assert [one.quality for one in live.weighings] == [Quality.UNKNOWN_POSITION]


@pytest.mark.parametrize(
    ("sensors", "message"),
    [
        ({"bucket": ("bucket", "kalman")}, "lack the unit that lifts"),
        ({"ram": ("boom", "kalman")}, "unit of the mechanism"),
        ({"boom": ("boom", "balance")}, "kalman"),
        ({}, "lack the unit"),
        ({"boom": None}, "sensors boom"),
    ],
)
def test_sensors_that_cannot_be_are_refused(sensors, message):
    made = {name: one and ramsight.sensor_for("mining-loader", one[1], unit=one[0]) for name, one in sensors.items()}
    with pytest.raises(ramsight.RamsightError, match=message):
        ramsight.LiveWeighing("mining-loader").step(0.0, made)


def test_other_sensors_than_before_are_refused():
    boom, bucket = (ramsight.sensor_for("mining-loader", unit=name) for name in STARTS)
    live = ramsight.LiveWeighing("mining-loader")
    live.step(0.0, {"boom": boom})
    with pytest.raises(ramsight.DescriptionError, match="others than before"):
        live.step(0.1, {"boom": boom, "bucket": bucket})
    with pytest.raises(ramsight.DescriptionError, match="time"):
        live.step("5 bar", {"boom": boom})
