"""A commissioning is judged: what is right passes, what cannot be this machine's log is refused with the reason."""

import hashlib
import re
from dataclasses import replace
from datetime import datetime
from types import SimpleNamespace

import numpy as np
import pytest
import xarray

import ramsight
from ramsight.api.commissioning import channels_of, sources_of
from ramsight.calibration.identify import FACTORS, Estimate, Identification
from ramsight.calibration.identify_report import summary
from ramsight.duty.lift_lower import lift_lower
from ramsight.errors import LogWarning
from ramsight.logs import write_log
from ramsight.logs.channel_map import load_map
from ramsight.logs.mapped import standard_map
from ramsight.sensor.contacts.mode import Mode
from ramsight.sensor.status import Status
from ramsight.study.commissioning import log_checks
from ramsight.study.commissioning.finding import Finding, Verdict
from ramsight.study.commissioning.walk import Commissioning

from .command import as_command, at_once
from .log_bench import own_names

AS_BUILT = ramsight.AsBuilt(leak=1.15, displacement=0.998, stiffness=0.9, friction=1.2)


@pytest.fixture(scope="module")
def rehearsed(boom):
    run = ramsight.simulate(boom, "commissioning", as_built=AS_BUILT)
    return ramsight.drive_report(run), run


def verdicts(done):
    return {finding.check: finding.verdict for finding in done.findings}


def test_a_rehearsal_passes_with_and_without_a_measured_position(boom, rehearsed):
    log, run = rehearsed
    done = ramsight.commission(boom, log, run[["position"]])
    assert done.verdict is Verdict.LOOK_TWICE
    assert [one.check for one in done.reasons] == ["data sheet, friction factor"]
    assert done.findings[0].check == "requirement", "it says on top that nothing is required"
    assert done.text.splitlines()[-1] == "boom: commissioned with 1 reservation"
    assert done.leak_test.factor == pytest.approx(1.15, abs=0.03)
    assert done.identification.factors["displacement"].value == pytest.approx(0.998, abs=1e-3)
    blind = ramsight.commission(boom, log)
    assert blind.reasons == ()
    assert verdicts(blind)["data sheet"] is Verdict.OPEN
    assert "truth" not in verdicts(blind)


WRONG = {
    "speed in rad/s": ({"motor_speed": np.pi / 30.0}, "units and signs of speed", "rad/s"),
    "torque with the other sign": ({"motor_torque": -1.0}, "units and signs of torque", "sign"),
    "torque in per cent": ({"motor_torque": 4.0}, "units and signs of torque", "percent"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_log_in_the_wrong_unit_or_sign_is_refused_and_the_rest_not_judged(boom, rehearsed, name):
    factors, check, word = WRONG[name]
    log = rehearsed[0].copy(deep=True)
    for variable, factor in factors.items():
        log[variable] = log[variable] * factor
    done = ramsight.commission(boom, log, rehearsed[1])
    assert done.verdict is Verdict.FAILED
    assert verdicts(done)[check] is Verdict.FAILED
    assert word in next(finding.found for finding in done.findings if finding.check == check)
    assert {verdicts(done)[one] for one in ("leak test", "end stops", "sensor", "data sheet")} == {Verdict.OPEN}
    assert done.track is None
    assert done.text.splitlines()[-1] == "boom: not commissioned"


def test_a_log_without_leak_test_and_stops_is_not_enough(boom):
    run = ramsight.simulate(boom, lift_lower(boom, [129e3, 441e3], 313.15, cycles=2))
    done = ramsight.commission(boom, ramsight.drive_report(run))
    found = verdicts(done)
    assert (found["leak test"], found["end stops"], found["sensor"]) == (
        Verdict.LOOK_TWICE, Verdict.FAILED, Verdict.FAILED,
    )  # fmt: skip
    assert done.verdict is Verdict.FAILED
    assert "ramsight simulate --duty leak-test" in done.text


@pytest.mark.slow
def test_a_machine_far_from_its_data_sheet_is_worth_a_second_look(boom):
    far = ramsight.AsBuilt(leak=1.6, displacement=0.979)
    run = ramsight.simulate(boom, "commissioning", as_built=far)
    done = ramsight.commission(boom, ramsight.drive_report(run), run)
    found = verdicts(done)
    for check in ("leak test", "data sheet, leak factor", "data sheet, displacement factor"):
        assert found[check] is Verdict.LOOK_TWICE
    assert found["data sheet, pump efficiency"] is Verdict.PASSED
    assert done.verdict is not Verdict.PASSED
    assert found["truth"] is Verdict.PASSED, "the band says how little is known"


def drive_log(time, **values):
    columns = {"motor_speed": 0.0, "motor_torque": 0.0, "oil_temperature": 313.15} | values
    return xarray.Dataset(
        {name: ("time", np.broadcast_to(value, len(time)).astype(float)) for name, value in columns.items()},
        coords={"time": time},
    )


def test_samples_that_are_missing_or_out_of_order_are_counted_and_left_out():
    time = np.arange(0.0, 100.0, 0.02)
    assert log_checks.samples(drive_log(time)).verdict is Verdict.PASSED
    assert log_checks.samples(drive_log(time[:500])).verdict is Verdict.LOOK_TWICE
    torque = np.zeros(len(time))
    torque[:200] = np.nan
    holes = drive_log(time, motor_torque=torque)
    assert log_checks.samples(holes).verdict is Verdict.LOOK_TWICE
    assert log_checks.faultless(holes).sizes["time"] == len(time) - 200
    back = time.copy()
    back[1000:1003] = 0.0
    kept = log_checks.faultless(drive_log(back))["time"].values
    assert len(kept) == len(time) - 3
    assert (np.diff(kept) > 0.0).all()
    gap = np.delete(time, slice(1000, 1100))
    assert log_checks.samples(drive_log(gap)).verdict is Verdict.LOOK_TWICE
    assert log_checks.samples(drive_log(time, motor_torque=np.nan)).verdict is Verdict.FAILED


def track_of(*runs, speed=50.0):
    """A track whose modes are these, (mode, seconds, position), with this speed of the motor [rad/s]."""
    mode = np.concatenate([np.full(int(seconds / 0.02), int(kind)) for kind, seconds, _ in runs])
    position = np.concatenate([np.full(int(seconds / 0.02), at) for _, seconds, at in runs])
    time = 0.02 * np.arange(len(mode))
    data = {"mode": ("time", mode), "position": ("time", position), "motor_speed": ("time", np.full(len(mode), speed))}
    return xarray.Dataset(data, coords={"time": time})


def test_visits_are_counted_once_and_by_where_they_are(boom):
    moves = (Mode.MOVING, 10.0, 0.3)
    track = track_of(
        moves, (Mode.HELD_RETRACTING, 1.0, 0.001), (Mode.LEAVING, 1.0, 0.0), (Mode.HELD_RETRACTING, 1.0, 0.0),
        moves, (Mode.HELD_EXTENDING, 0.1, 0.7), moves, (Mode.HELD_EXTENDING, 1.0, 0.7), moves,
        (Mode.HELD_EXTENDING, 1.0, 0.4), moves, (Mode.HELD_RETRACTING, 1.0, np.nan), moves,
    )  # fmt: skip
    seen = log_checks.contacts(track, 0.7)
    assert (seen.retracted, seen.extended, seen.elsewhere) == (1, 1, 1)
    assert log_checks.stops(track, boom).verdict is Verdict.LOOK_TWICE
    both = track_of(*[moves, (Mode.HELD_RETRACTING, 1.0, 0.0), moves, (Mode.HELD_EXTENDING, 1.0, 0.7)] * 2)
    assert log_checks.stops(both, boom).verdict is Verdict.PASSED
    assert log_checks.stops(track_of(moves), boom).verdict is Verdict.FAILED


def test_a_load_taken_off_while_the_motor_stands_is_no_obstacle():
    moves, rests = (Mode.MOVING, 10.0, 0.3), (Mode.RESTING_ON_VALVE, 10.0, 0.3)
    track = track_of(moves, rests, (Mode.HELD_RETRACTING, 1.0, 0.3), rests, (Mode.HELD_RETRACTING, 1.0, 0.0), rests)
    assert log_checks.contacts(track, 0.7).elsewhere == 1
    track["motor_speed"][int(12.0 / 0.02) :] = 0.0
    seen = log_checks.contacts(track, 0.7)
    assert (seen.elsewhere, seen.retracted) == (0, 1)
    track["motor_speed"][int(19.8 / 0.02) : int(19.9 / 0.02)] = -50.0  # pressed there until just before
    assert log_checks.contacts(track, 0.7).elsewhere == 1


@pytest.mark.parametrize(
    ("scale", "verdict"),
    [(0.5, Verdict.PASSED), (1.3, Verdict.LOOK_TWICE), (4.0, Verdict.FAILED), (np.nan, Verdict.OPEN)],
)
def test_errors_are_judged_by_the_band(scale, verdict):
    error = scale * 1e-3 * np.random.default_rng(1).standard_normal(5000)
    status = np.full(5000, int(Status.OK))
    data = {"error": ("time", error), "position_std": ("time", np.full(5000, 1e-3)), "status": ("time", status)}
    track = xarray.Dataset(data, coords={"time": np.arange(5000.0)})
    assert log_checks.truth(track).verdict is verdict
    # What the sensor says is invalid is not counted, however wrong it is.
    lost = track.copy(deep=True)
    lost["status"][:1000], lost["error"][:1000] = int(Status.TOO_UNCERTAIN), 0.5
    found = log_checks.truth(lost)
    assert found.verdict is verdict
    assert ("1000 invalid ones are not counted" in found.found) == (verdict is not Verdict.OPEN)


def test_a_visit_to_an_empty_chamber_is_one_though_noise_looks_like_letting_go(boom):
    """The contact is seen at once, and its chamber gives no force that could tell that the piston stays."""
    moves, short = (Mode.MOVING, 6.0, 0.3), (Mode.HELD_RETRACTING, 0.06, 0.0)
    kept = track_of(moves, short, (Mode.LEAVING, 4.0, 0.0), moves, (Mode.HELD_EXTENDING, 1.0, 0.7))
    found = log_checks.contacts(kept, boom.cylinder.stroke)
    assert (found.retracted, found.extended, found.elsewhere) == (1, 1, 0)
    left = track_of(moves, short, (Mode.LEAVING, 0.04, 0.0), moves)
    assert log_checks.contacts(left, boom.cylinder.stroke).retracted == 0
    between = track_of(moves, (Mode.HELD_RETRACTING, 0.06, 0.3), (Mode.LEAVING, 4.0, 0.3), moves)
    assert log_checks.contacts(between, boom.cylinder.stroke).elsewhere == 0


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("forklift-mast", {"units.lift.cylinder.bore": "60 mm"}),
        pytest.param("eha-test-bench", {}, marks=pytest.mark.slow),
    ],
)
def test_a_rehearsal_of_a_machine_as_described_is_commissioned_at_its_ends(name, changes):
    """Of a mast whose chamber empties on its lower end, and of a short cylinder that the pump presses for a minute."""
    unit = ramsight.build(ramsight.load_machine(name).replace(changes))
    run = ramsight.simulate(unit, "commissioning")
    done = ramsight.commission(unit, ramsight.drive_report(run, torque_noise="0.1 N m"))
    assert verdicts(done)["end stops"] is Verdict.PASSED
    assert done.verdict is not Verdict.FAILED


def identification(name, estimate, judged_by):
    """What was identified of one factor."""
    none = replace(estimate, identified=False)
    factors = {one: estimate if one == name else none for one in FACTORS}
    pressure, temperature, reached = (1e6, 2e6), (313.0, 314.0), (0.1, 0.6)
    return Identification(factors, none, 9, 3, 90.0, 1e-5, pressure, temperature, 4, 5, reached, {name: judged_by})


def test_a_factor_is_doubtful_where_its_whole_interval_is_beyond_what_is_expected():
    def verdict(low, high, identified=True):
        estimate = Estimate((low + high) / 2, low, high, identified)
        return log_checks.identified(identification("leak", estimate, 0.3))[0].verdict

    assert verdict(1.2, 1.4) is Verdict.PASSED
    assert verdict(1.31, 1.4) is Verdict.LOOK_TWICE
    assert verdict(0.5, 0.69) is Verdict.LOOK_TWICE
    assert verdict(1.31, 1.4, identified=False) is Verdict.OPEN
    assert verdict(0.71, 1.3) is Verdict.PASSED
    assert verdict(0.69, 1.3) is Verdict.LOOK_TWICE, "wider than what it is judged by"


def test_a_factor_that_a_log_does_not_determine_is_reported_so_by_identify_too():
    wide = identification("friction", Estimate(0.98, -0.14, 2.10, identified=True), 0.5)
    assert "friction factor: not determined by this log" in summary(wide)
    narrow = identification("friction", Estimate(0.98, 0.7, 1.2, identified=True), 0.5)
    assert "not determined" not in summary(narrow)


def test_a_finding_says_what_its_interval_does_not_hold():
    """A thermometer that is 3 K off makes a leakage of 1.2 one of 1.08, which is told exactly and is not so."""

    def found(per_kelvin, per_torque):
        estimate = Estimate(1.0, 0.99, 1.01, identified=True, per_kelvin=per_kelvin, per_torque=per_torque)
        return log_checks.identified(identification("leak", estimate, 0.3))[0].found

    assert found(-0.038, -0.011).endswith(
        "; -0.038 for each K that the oil is warmer than reported, -0.011 for each % that the torque is larger"
    )
    assert found(1e-4, -1e-4).endswith("expected 1 ± 0.3")


def test_the_worst_finding_is_the_verdict():
    def whole(*kinds):
        return Commissioning("x", tuple(Finding("a", kind, "b") for kind in kinds), drive_log(np.arange(2.0))).verdict

    assert whole(Verdict.PASSED, Verdict.OPEN) is Verdict.PASSED
    assert whole(Verdict.PASSED, Verdict.LOOK_TWICE) is Verdict.LOOK_TWICE
    assert whole(Verdict.LOOK_TWICE, Verdict.FAILED, Verdict.PASSED) is Verdict.FAILED


@pytest.mark.slow
def test_the_verb_writes_one_page_to_sign_and_its_exit_code_tells(boom, rehearsed, tmp_path):
    log, _ = rehearsed
    write_log(log, tmp_path / "log.csv.gz")
    of = ("--unit", "boom", "--out", "report.html")
    done = as_command("commission", "mining-loader", "log.csv.gz", *of, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "boom: commissioned" in done.stdout
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert page.count("data:image/png;base64,") == 1
    assert [link for link in re.findall(r'(?:src|href)="([^"]*)"', page) if not link.startswith("data:")] == []
    assert "url(" not in page
    for words in ("Signature", "motor_speed_rpm", "leak test", "Track"):
        assert words in page
    write_log(log.assign(motor_torque=-log["motor_torque"]), tmp_path / "log.csv.gz")
    refused = at_once("commission", "mining-loader", "log.csv.gz", *of, cwd=tmp_path)
    assert refused.returncode == 1
    assert "boom: not commissioned" in refused.stdout
    assert "must not be relied on" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_the_page_names_when_by_what_and_of_which_files(boom, rehearsed, tmp_path):
    log, _ = rehearsed
    write_log(log.assign(motor_torque=(log["motor_torque"] - 0.5) / 0.002 / 80.0), tmp_path / "own.csv")
    (tmp_path / "map.toml").write_text(
        'time = { channel = "time_s", unit = "s" }\nspeed = { channel = "motor_speed_rpm", unit = "rpm" }\n'
        'torque = { channel = "motor_torque_nm", unit = "permille", rated = "80 N m", scale = 2, offset = 6.25 }\n'
        'temperature = { constant = "40 degC" }\n'
    )
    (tmp_path / "mine.toml").write_text(ramsight.machine.template(), encoding="utf-8")
    done = at_once("commission", "mine.toml", "own.csv", "--map", "map.toml", "--unit", "boom", "--out", "r.html",
                   cwd=tmp_path)  # fmt: skip
    assert "passed      units and signs" in done.stdout, done.stderr
    page = (tmp_path / "r.html").read_text(encoding="utf-8")
    assert re.search(
        rf"Report of {datetime.now():%Y-%m-%d} \d\d:\d\d \(UTC[+-]\d{{4}}\), by ramsight {ramsight.__version__}, on",
        page,
    )
    for name in ("mine.toml", "own.csv", "map.toml"):
        digest = hashlib.sha256((tmp_path / name).read_bytes()).hexdigest()
        assert f"<td>{name}</td><td>{digest}</td>" in page
    cells = ("torque", "motor_torque_nm", "permille", "+1", "2", "6.25", "100 % is 80 N m")
    assert "".join(f"<td>{cell}</td>" for cell in cells) in page
    assert "<td>40 degC</td>" in page


def test_a_machine_that_was_changed_has_no_checksum_of_the_file_it_came_from(tmp_path):
    (tmp_path / "log.csv").write_text("a")
    plain, changed = ramsight.load_machine("press"), ramsight.load_machine("press").replace({"title": "other"})
    (what, name, digest), (_, _, of_log) = sources_of(plain, tmp_path / "log.csv", None, standard_map([]))
    assert (what, name, len(digest)) == ("machine of the catalogue", "press.toml", 64)
    assert of_log == hashlib.sha256(b"a").hexdigest()
    assert "changed" in sources_of(changed, tmp_path / "log.csv", None, standard_map([]))[0][2]


def test_what_a_channel_stands_for_is_told(tmp_path):
    file = tmp_path / "map.toml"
    file.write_text(
        'angle = { channel = "phi", per_turn = 4096 }\ncurrent = { channel = "i", torque_constant = "0.05 N m", '
        'saturation = 40, sign = -1 }\ntemperature = { channel = "T" }\n[measured]\nposition = { channel = "x" }\n'
    )
    found = {row[0]: row for row in channels_of(load_map(file))}
    assert found["speed"][-1] == "an angle: 4096 a turn"
    assert found["torque"][-1] == "a current: 1 is 0.05 N m, saturated at 40"
    assert found["torque"][3] == "-1"
    assert found["measured position"][1] == "x"


def test_samples_too_far_apart_are_worth_a_second_look():
    found = log_checks.samples(drive_log(np.arange(0.0, 900.0, 0.5)))
    assert found.verdict is Verdict.LOOK_TWICE
    assert "every 500 ms" in found.found
    assert "1 to 100 ms" in found.remedy


def test_a_torque_noisier_than_described_is_a_reservation_and_the_rest_is_judged(boom, rehearsed):
    log, _ = rehearsed
    noisy = log.copy(deep=True)
    noisy["motor_torque"] += 2.0 * np.random.default_rng(1).normal(size=noisy.sizes["time"])
    with pytest.warns(LogWarning, match="scatters"):
        done = ramsight.commission(boom, noisy)
    found = next(one for one in done.findings if one.check == "noise of torque")
    assert found.verdict is Verdict.LOOK_TWICE
    assert re.fullmatch(r'write torque = "2\.[5-9] %" under assumptions.drive of the unit', found.remedy)
    assert verdicts(done)["leak test"] is Verdict.PASSED


@pytest.mark.parametrize(
    ("std", "verdict"), [(1e-3, Verdict.PASSED), (17e-3, Verdict.PASSED), (19e-3, Verdict.LOOK_TWICE)]
)
def test_a_last_position_that_is_hardly_known_is_worth_a_second_look(std, verdict):
    """5 % of 700 mm are 35 mm, which 1.96 times 17.9 mm is."""
    data = {"status": ("time", np.zeros(10, dtype=int)), "position_std": ("time", np.full(10, std))}
    track = xarray.Dataset(data, coords={"time": np.arange(10.0)})
    assert log_checks.confidence(track, True, 0.7).verdict is verdict
    assert log_checks.confidence(track, False, 0.7).verdict is Verdict.LOOK_TWICE, "the motor turns"


def test_one_reservation_is_one(boom, rehearsed):
    log, _ = rehearsed
    found = (Finding("samples", Verdict.LOOK_TWICE, "few", "more"),)
    assert Commissioning("boom", found, log).text.endswith("commissioned with 1 reservation")
    assert Commissioning("boom", found * 2, log).text.endswith("commissioned with 2 reservations")


def test_a_true_position_in_another_unit_is_refused_with_a_hint(boom, rehearsed):
    log, run = rehearsed
    wrong = run[["position"]] * 1e3
    for judge in (ramsight.commission, ramsight.track):
        with pytest.raises(
            ramsight.RamsightError, match=r"true position reaches .* m, the stroke is 0.7.* is it in mm\?"
        ):
            judge(boom, log, truth=wrong)


def test_the_measured_position_that_a_map_names_is_the_truth(boom, tmp_path):
    run = ramsight.simulate(boom, lift_lower(boom, [129e3, 441e3], 313.15))
    log = ramsight.drive_report(run)
    file, channel_map = own_names(log, tmp_path, run["position"])
    done = ramsight.commission(boom, file, channel_map=channel_map)
    assert "truth" in verdicts(done)
    assert done.identification is not None


def test_the_machine_as_it_was_found_is_written_and_a_leak_test_writes_its_leakage(rehearsed, tmp_path):
    write_log(rehearsed[0], tmp_path / "log.csv")
    of = ("mining-loader", "log.csv", "--unit", "boom")
    refused = at_once("commission", *of, "--tuned", "boom.json", cwd=tmp_path)
    assert refused.returncode == 2
    assert ".toml" in refused.stderr
    done = at_once("commission", *of, "--tuned", "boom.toml", cwd=tmp_path)
    assert "boom.toml: written" in done.stdout, done.stderr
    tested = at_once("leak-test", *of, "--out", "tested.toml", cwd=tmp_path)
    assert "tested.toml: written" in tested.stdout, tested.stderr
    plain = ramsight.load_machine("mining-loader").unit("boom")
    for name in ("boom.toml", "tested.toml"):
        found = ramsight.load_machine(tmp_path / name).unit("boom")
        assert 1.0 - found.pump_a.volumetric_efficiency == pytest.approx(0.115, abs=0.005)
        assert found.assumptions.machine.leak < 0.4 * plain.assumptions.machine.leak
        assert found.assumptions.machine.leaks_otherwise == 1e-3


def test_a_commissioning_that_failed_writes_no_machine(boom, tmp_path):
    run = ramsight.simulate(boom, lift_lower(boom, [129e3], 313.15))
    done = ramsight.commission("mining-loader", ramsight.drive_report(run), unit="boom", tuned=tmp_path / "boom.toml")
    assert done.verdict is Verdict.FAILED
    assert not (tmp_path / "boom.toml").exists()


def test_a_built_unit_has_no_description_to_be_tuned(boom, rehearsed, tmp_path):
    with pytest.raises(ramsight.DescriptionError, match="a built unit has none"):
        ramsight.commission(boom, rehearsed[0], tuned=tmp_path / "boom.toml")


@pytest.mark.parametrize(
    ("visits", "verdict"),
    [
        (["retracted", "extended"], Verdict.LOOK_TWICE),
        (["retracted", "extended", "retracted"], Verdict.PASSED),
        (["retracted"] * 3, Verdict.LOOK_TWICE),
        (["retracted", "extended", "retracted", "elsewhere"], Verdict.LOOK_TWICE),
        ([], Verdict.FAILED),
    ],
    ids=lambda value: "".join(one[0] for one in value) if isinstance(value, list) else value.name,
)
def test_three_visits_with_both_ends_among_them_tell_a_machine(monkeypatch, visits, verdict):
    boom = ramsight.build("mining-loader", unit="boom")
    found = [SimpleNamespace(where=where, position=0.1) for where in visits]
    monkeypatch.setattr(log_checks, "visits", lambda track, stroke: found)
    assert log_checks.stops(None, boom).verdict is verdict
