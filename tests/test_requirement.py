"""A requirement decides: what misses it fails, with what is missing; what nobody requires is said to be unjudged."""

import math
from dataclasses import replace

import numpy as np
import pytest
import xarray

import ramsight
from ramsight.api.requirements import required_unit
from ramsight.machine import loads, template
from ramsight.machine.assumption_description import SURE_START, AssumedIntegrity
from ramsight.machine.requirement_description import Requirement
from ramsight.sensor.contacts.mode import Mode
from ramsight.sensor.kalman import kalman
from ramsight.sensor.status import Status
from ramsight.study.commissioning import log_checks
from ramsight.study.commissioning.finding import Verdict
from ramsight.study.datasheet.sheet_requirement import MEASURES, SheetRequirement, mending
from ramsight.tracking.requirement_check import require

from .command import at_once
from .sensor_bench import Stepped

STROKE = 0.5
NORMAL_95 = 1.959964


def track_of(std, *, error=None, status=int(Status.OK), visits=()):
    """A track of a sample a second with these deviations [m]; end visits last a second."""
    count = len(std)
    time = np.arange(float(count))
    mode = np.full(count, int(Mode.MOVING))
    position = np.full(count, 0.25)
    for at in visits:
        mode[at : at + 2], position[at : at + 2] = int(Mode.HELD_RETRACTING), 0.0
    data = {
        "position": ("time", position), "position_std": ("time", np.asarray(std, float)),
        "status": ("time", np.broadcast_to(status, count).copy()), "mode": ("time", mode),
        "motor_speed": ("time", np.full(count, 50.0)),
    }  # fmt: skip
    if error is not None:
        data["error"] = ("time", np.broadcast_to(error, count).astype(float))
    return xarray.Dataset(data, coords={"time": time})


def test_what_the_sensor_states_is_the_quantile_of_its_own_normal_errors():
    one = require(track_of(np.full(400, 1e-3)), Requirement(error=2e-3), STROKE)
    assert one.stated == pytest.approx(NORMAL_95 * 1e-3, rel=1e-4)
    assert one.is_met
    assert math.isnan(one.measured)
    drawn = np.random.default_rng(0).standard_normal(400_000) * np.tile([1e-3, 4e-3], 200_000)
    mixed = require(track_of(np.tile([1e-3, 4e-3], 200)), Requirement(error=2e-3), STROKE)
    assert mixed.stated == pytest.approx(np.quantile(np.abs(drawn), 0.95), rel=0.01)
    assert not mixed.is_met


@pytest.mark.parametrize(("error", "met"), [(4.99e-3, True), (5.01e-3, False)])
def test_a_true_position_decides_on_either_side_of_the_limit(error, met):
    check = require(track_of(np.full(200, 1e-3), error=-error), Requirement(error=5e-3), STROKE)
    assert check.is_met is met
    assert check.measured == pytest.approx(error)
    assert bool(check.missing) is not met


def test_samples_without_a_valid_position_miss_it():
    status = np.where(np.arange(1000) < 60, int(Status.TOO_UNCERTAIN), int(Status.OK))
    lost = track_of(np.full(1000, 1e-4), status=status, error=1e-5)
    assert not require(lost, Requirement(error=5e-3), STROKE).is_met
    lost["status"][40:60] = int(Status.OK)
    assert require(lost, Requirement(error=5e-3), STROKE).is_met, "4 % are fewer than 5 %"
    never = track_of(np.full(100, np.nan)).assign(position=("time", np.full(100, np.nan)))
    check = require(never, Requirement(error=5e-3), STROKE)
    assert check.missing == ("the position was never known",)


def test_before_the_first_position_nothing_is_required():
    late = track_of(np.full(200, 1e-3), error=1e-3)
    late["position"][:150] = np.nan
    late["status"][:150] = int(Status.NOT_REFERENCED)
    check = require(late, Requirement(error=5e-3, ok=1.0), STROKE)
    assert (check.samples, check.is_met) == (50, True)


def test_the_share_of_ok_is_required_apart():
    status = np.where(np.arange(100) < 30, int(Status.REFERENCE_DUE), int(Status.OK))
    track = track_of(np.full(100, 1e-3), status=status)
    assert require(track, Requirement(error=5e-3, ok=0.7), STROKE).is_met
    check = require(track, Requirement(error=5e-3, ok=0.71), STROKE)
    assert check.missing == ("ok for 70 % of 71 % of the time",)


def test_a_requirement_for_some_time_after_a_reference_counts_no_later_errors():
    age = np.arange(300.0) % 100.0
    track = track_of(1e-4 + 1e-4 * age, error=1e-4 * age, visits=(0, 100, 200))
    every = require(track, Requirement(error=2e-3), STROKE)
    assert not every.is_met
    assert every.good_for == pytest.approx(20.0), "of the ages tried: after 30 s 95 % are within 2.9 mm"
    assert "every 20 s" in every.remedy
    assert require(track, Requirement(error=2e-3, visit_every="20 s"), STROKE).is_met
    assert not require(track, Requirement(error=2e-3, visit_every="30 s"), STROKE).is_met


def test_a_band_wider_than_required_is_worth_a_second_look_though_the_errors_are_within():
    track = track_of(np.full(100, 10e-3), error=1e-3)
    found = log_checks.requirement(track, Requirement(error=5e-3), STROKE)
    assert found.verdict is Verdict.LOOK_TWICE
    blind = log_checks.requirement(track.drop_vars("error"), Requirement(error=5e-3), STROKE, lambda: ["a way"])
    assert (blind.verdict, blind.remedy) == (Verdict.FAILED, "a way")
    assert log_checks.requirement(track, None, STROKE).verdict is Verdict.OPEN


def test_a_description_states_it_and_an_argument_takes_its_place():
    described = template().replace(
        "[units.boom.cylinder]", '[units.boom.requirement]\nerror = "4 mm"\nok = "50 %"\n\n[units.boom.cylinder]'
    )
    boom = ramsight.build(loads(described))
    assert boom.requirement == Requirement(error=4e-3, ok=0.5)
    assert required_unit(boom, None).requirement == boom.requirement
    assert required_unit(boom, "7 mm").requirement == Requirement(error=7e-3, ok=0.5)
    bare = ramsight.build("mining-loader", "boom")
    assert required_unit(bare, None).requirement is None
    for wrong in ("7", "0.01 mm", "10 m", -1.0, float("nan"), "7 bar"):
        with pytest.raises(ramsight.DescriptionError, match="require"):
            required_unit(bare, wrong)


def test_a_sheet_that_misses_names_what_is_missing_and_what_mends_it():
    asked = Requirement(error=2e-3, ok=0.9)
    assert SheetRequirement(asked, 2e-3, 0.9).is_met
    missed = SheetRequirement(asked, 3e-3, 0.8, ("a thermometer",))
    assert len(missed.missing) == 2
    assert "3 mm of 2 mm" in missed.text
    assert missed.text.endswith("a thermometer")
    assert not SheetRequirement(asked, math.nan, 1.0).is_met, "an unknown error achieves nothing"


def test_measures_are_in_the_order_of_what_they_take_of_the_variance():
    study = ramsight.Study("mining-loader", unit="boom", machines=1, duration="60 s")
    budget = study.budget(0)
    found = mending(study.machine, study.plan, budget)
    shares = [float(text.split("(")[-1].split(" %")[0]) for text in found]
    assert shares == sorted(shares, reverse=True)
    assert all(10.0 <= share <= 100.0 for share in shares)
    assert {text.rpartition(" (")[0] for text in found} <= {one.name for one in MEASURES}


def test_tracking_fails_where_the_truth_misses_what_is_required(tmp_path):
    of = ("mining-loader", "--unit", "boom", "--load", "441 kN", "--start", "120 mm", "--leak", "1.5")
    run = at_once("simulate", *of, "--log", "log.csv", "--truth", "true.csv", cwd=tmp_path)
    assert run.returncode == 0, run.stderr
    track = ("track", "mining-loader", "log.csv", "--unit", "boom", "--start", "120 mm")
    met = at_once(*track, "--truth", "true.csv", "--require", "50 mm", cwd=tmp_path)
    assert (met.returncode, "requirement achieved" in met.stdout) == (0, True), met.stderr
    missed = at_once(*track, "--truth", "true.csv", "--require", "0.1 mm", cwd=tmp_path)
    assert (missed.returncode, "requirement missed" in missed.stdout) == (1, True), missed.stderr
    blind = at_once(*track, "--require", "0.1 mm", cwd=tmp_path)
    assert (blind.returncode, "requirement missed" in blind.stdout) == (0, True), "nothing is proved without a truth"
    refused = at_once(*track, "--require", "5", cwd=tmp_path)
    assert refused.returncode == 2
    assert "--require" in refused.stderr


def test_what_it_is_good_for_counts_from_the_second_reference_on():
    """Before two references have come the sensor has not learned the machine; the errors there say nothing of it."""
    error = np.where(np.arange(300) < 100, 9e-3, 1e-3)
    track = track_of(np.full(300, 1e-3), error=error, visits=(0, 100, 200))
    found = require(track, Requirement(error=2e-3), STROKE)
    assert not found.is_met
    assert found.good_for >= 60.0


def test_a_requirement_says_when_a_position_is_ok():
    plain = ramsight.build("mining-loader", "boom")
    assert plain.assumptions.integrity.due == 0.01
    asked = required_unit(plain, "2 mm")
    assert asked.assumptions.integrity.due * 0.7 == pytest.approx(2e-3 / 1.96, rel=1e-4)
    assert asked.assumptions.integrity.limit * 0.7 == pytest.approx(5.0 * 2e-3 / 1.96, rel=1e-4)
    again = required_unit(asked, "4 mm").assumptions.integrity
    assert again.due == pytest.approx(2.0 * asked.assumptions.integrity.due)
    assert again.limit == pytest.approx(2.0 * asked.assumptions.integrity.limit)
    loose = required_unit(plain, "600 mm").assumptions.integrity
    assert loose.due <= 0.5
    assert loose.limit == 0.5


def test_what_the_description_states_of_ok_itself_holds():
    loader = ramsight.load_machine("mining-loader")
    stated = loader.replace(
        {
            "units.boom.requirement": Requirement(error=2e-3),
            "units.boom.assumptions.integrity": AssumedIntegrity(limit=0.02, risk=1e-4),
        }
    )
    found = ramsight.build(stated, "boom").assumptions.integrity
    assert (found.limit, found.risk) == (0.02, 1e-4)
    assert found.due * 0.7 == pytest.approx(2e-3 / 1.96, rel=1e-4)


@pytest.mark.parametrize(("error", "status"), [("2 mm", Status.REFERENCE_DUE), ("10 mm", Status.OK)])
def test_a_position_that_is_known_to_2_mm_is_ok_for_10_mm_and_not_for_2(error, status):
    boom = required_unit(ramsight.build("mining-loader", "boom"), error)
    boom = replace(boom, assumptions=boom.assumptions.replace(SURE_START))
    sensor = Stepped(kalman(boom))
    sensor.start(0.1, 1.5e-3)
    columns = {"motor_speed": 0.0, "motor_torque": 0.0, "oil_temperature": 313.15}
    log = xarray.Dataset({name: ("time", [one]) for name, one in columns.items()}, coords={"time": [0.0]})
    assert sensor.track(log)["status"][-1] == status
