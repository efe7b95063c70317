"""A real position sensor beside the virtual one: who is wrong, how soon, and how it drifts."""

import ctypes
import itertools
import subprocess
from pathlib import Path

import numpy as np
import pytest
import xarray
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

import ramsight
from ramsight import machine
from ramsight.cli import app
from ramsight.deploy.c_compare import comparison_source
from ramsight.deploy.compiler import find_compiler
from ramsight.errors import DescriptionError, LogError
from ramsight.logs import read_truth, write_log
from ramsight.plant.build import build
from ramsight.plant.limits import limits_of
from ramsight.sensor.status import Status
from ramsight.tracking.comparing import Comparison, Verdict, drift_of, verdicts

TRACES = Path(__file__).parent / "traces" / "unknown"
DT, BOUND, TOLERANCE = 0.02, 4e-3, 1e-3
TIME = np.arange(0.0, 10.0, DT)
TRUE = 0.1 + 0.02 * TIME


def judged(other, *, status=Status.OK, virtual=TRUE, bound=BOUND, **how):
    pair = Comparison(stroke=0.5, fastest=0.1, tolerance=TOLERANCE, **how)
    codes = np.broadcast_to(np.asarray(status, dtype=int), TIME.shape)
    return verdicts(pair, TIME, virtual, np.full(TIME.size, bound), codes, np.asarray(other, dtype=float))


def test_what_is_within_both_errors_agrees():
    assert (judged(TRUE + 0.9 * (BOUND + TOLERANCE)) == Verdict.AGREE).all()


def test_an_offset_is_apart_after_the_time_to_alert_and_not_before():
    creeping = 0.01 * np.clip(TIME - 5.0, 0.0, 2.0)  # past what both may be wrong by at 5.5 s
    said = judged(TRUE + creeping, time_to_alert=0.5)
    first = TIME[np.argmax(said != Verdict.AGREE)]
    assert first == pytest.approx(6.0, abs=1.5 * DT)
    assert said[-1] == Verdict.APART, "a few millimetres may be either's"


def test_a_sensor_that_leaps_stands_or_leaves_the_stroke_is_wrong_itself():
    leaps = judged(np.where(TIME < 5.0, TRUE, TRUE + 0.05))
    stands = judged(np.where(TIME < 5.0, TRUE, TRUE[250]))
    leaves = judged(np.where(TIME < 5.0, TRUE, 0.6))
    gone = judged(np.where(TIME < 5.0, TRUE, np.nan))
    for said in (leaps, stands, leaves, gone):
        assert said[-1] == Verdict.OTHER_WRONG
        assert (said[:250] == Verdict.AGREE).all()


def test_a_sensor_that_leaps_again_and_again_is_wrong_though_it_is_near():
    noisy = np.where(TIME < 5.0, TRUE, TRUE + 4e-3 * (-1.0) ** np.arange(TIME.size))
    said = judged(noisy, bound=0.02)
    assert (said[260:] == Verdict.OTHER_WRONG).all()
    once = TRUE + np.where(np.abs(TIME - 5.0) < 0.5 * DT, 4e-3, 0.0)
    assert (judged(once, bound=0.02) == Verdict.AGREE).all()


@pytest.mark.parametrize(("bound", "verdict"), [(0.499, Verdict.AGREE), (0.5, Verdict.UNCHECKED)])
def test_within_a_bound_as_wide_as_the_stroke_nothing_is_checked(bound, verdict):
    assert set(judged(TRUE, bound=bound).tolist()) == {verdict}


def test_a_fault_that_is_over_is_over():
    said = judged(np.where((TIME > 4.0) & (TIME < 6.0), TRUE + 0.05, TRUE))
    assert said[-1] == Verdict.AGREE
    assert (said == Verdict.OTHER_WRONG).sum() * DT == pytest.approx(1.8, abs=0.1)


def test_a_virtual_sensor_that_is_not_sure_is_the_one_that_is_wrong():
    assert judged(TRUE, virtual=TRUE + 0.02, status=Status.NEAR_RELIEF)[-1] == Verdict.VIRTUAL_WRONG
    assert judged(TRUE, virtual=TRUE + 0.02)[-1] == Verdict.APART
    assert (judged(TRUE, status=Status.NOT_REFERENCED) == Verdict.UNCHECKED).all()


@given(st.floats(0.0, 1.0), st.integers(0, 2**31), st.floats(1e-4, 0.02))
def test_errors_within_what_is_said_never_alert(share, seed, bound):
    random = np.random.default_rng(seed)
    virtual = TRUE + share * bound * np.sin(random.uniform(0.1, 3.0) * TIME)
    other = TRUE + TOLERANCE * random.uniform(-1.0, 1.0, TIME.size)
    assert (judged(other, virtual=virtual, bound=bound) == Verdict.AGREE).all()


def test_drift_is_found_within_what_it_says():
    random = np.random.default_rng(1)
    time = np.arange(0.0, 3600.0, 0.1)
    since = time % 45.0
    std = 0.3e-3 + 2e-5 * since
    wrong = np.repeat(random.standard_normal(80), 450)[: time.size] * std
    found = drift_of(time, 1e-3 + 2e-6 * time + wrong, std)
    assert found.offset == pytest.approx(1e-3, abs=0.3e-3)
    assert abs(found.rate - 2e-6) < 3.0 * found.rate_std
    assert found.rate_std < 0.3e-6
    assert np.isnan(drift_of(time[:100], wrong[:100], std[:100]).rate)


@pytest.fixture(scope="module")
def recorded():
    boom = ramsight.build("mining-loader", unit="boom")
    run = ramsight.simulate(boom, load="200 kN", start="120 mm")
    return boom, run, ramsight.drive_report(run, seed=2)


def test_a_dataset_in_and_alerts_out(recorded):
    boom, run, log = recorded
    fine = ramsight.compare(boom, log, run, start="120 mm")
    assert fine.alerts == []
    assert "100.0 %" in fine.text
    time = run["time"].values
    wrong = run["position"].values + np.where(time > time[-1] / 2, 0.2, 0.0)
    bad = ramsight.compare(boom, log, xarray.Dataset({"position": ("time", wrong)}, {"time": time}), start="120 mm")
    (begins, ends, what), *rest = bad.alerts
    assert what is Verdict.OTHER_WRONG
    assert begins == pytest.approx(time[-1] / 2 + 0.2, abs=0.1)
    assert ends == pytest.approx(time[-1], abs=0.1)
    assert rest == []
    assert "the other sensor is wrong" in bad.text


def test_what_cannot_be_is_refused(recorded):
    boom, run, log = recorded
    with pytest.raises(DescriptionError, match="tolerance"):
        ramsight.compare(boom, log, run, tolerance="2 m")
    with pytest.raises(DescriptionError, match="time_to_alert"):
        ramsight.compare(boom, log, run, time_to_alert="2 min")
    later = run.assign_coords(time=run["time"].values + 1e4)
    with pytest.raises(LogError, match="no time in common"):
        ramsight.compare(boom, log, later)


def test_the_command_line_compares(tmp_path, recorded):
    _, run, log = recorded
    write_log(log, tmp_path / "log.csv")
    rows = "".join(f"{t:.3f},{x:.6f}\n" for t, x in zip(run["time"].values, run["position"].values, strict=True))
    (tmp_path / "rod.csv").write_text(f"time_s,position_m\n{rows}")
    words = ["compare", "mining-loader", str(tmp_path / "log.csv"), str(tmp_path / "rod.csv"), "--unit", "boom"]
    out, figure = tmp_path / "both.csv", tmp_path / "both.png"
    done = CliRunner().invoke(app, [*words, "--start", "120 mm", "--out", str(out), "--figure", str(figure)])
    assert done.exit_code == 0, done.output
    assert "both agree" in done.output
    head, first, *_ = out.read_text().splitlines()
    assert head == "time_s,position_m,position_bound_m,other_position_m,status,verdict"
    assert first.endswith(",0,0")
    assert figure.stat().st_size > 10_000
    over = CliRunner().invoke(app, [*words, "--out", str(tmp_path / "rod.csv")])
    assert over.exit_code != 0, "an input is never written over"


@pytest.mark.slow
def test_in_hindsight_an_offset_is_seen_where_it_begins_and_the_right_one_is_named(tmp_path):
    log, truth = (TRACES / f"bucket_hot{end}.csv.gz" for end in ("", "_truth"))
    true = read_truth(truth)
    time = true["time"].values
    step = true["position"].values + np.where(time > 200.0, 0.03, 0.0)
    other = xarray.Dataset({"position": ("time", step)}, {"time": time})
    bucket = ramsight.build("mining-loader", unit="bucket")
    live, known = (ramsight.compare(bucket, log, other, hindsight=one) for one in (False, True))
    assert known.alerts[0][0] == pytest.approx(200.3, abs=0.3)
    assert known.alerts[0][2] is Verdict.OTHER_WRONG
    assert live.alerts[0][0] > 205.0, "a live sensor is not sure enough yet"
    before = known.track["verdict"].values[known.track["time"].values < 200.0]
    assert (before == Verdict.AGREE).all()
    assert (live.track["verdict"].values[: len(before)] == Verdict.UNCHECKED).any()
    words = ["compare", "mining-loader", str(log), "--unit", "bucket"]
    rod = tmp_path / "rod.csv"
    rod.write_text("time_s,position_m\n" + "".join(f"{t:.3f},{x:.6f}\n" for t, x in zip(time, step, strict=True)))
    done = CliRunner().invoke(app, [*words, str(rod), "--hindsight"])
    assert done.output.splitlines() == known.text.splitlines()
    alone = CliRunner().invoke(app, [*words, "--hindsight", *CHANCES])
    assert alone.exit_code != 0, "there is nothing to compare"


CHANCES = ("--dc", "90 %", "--false-alarms", "1e-5/h", "--other-std", "1 mm", "--drift", "20 mm")
SHIM = """
#include "ramsight_boom_compare.h"
static ramsight_boom_compare c;
void begin(double tolerance, double time_to_alert) { ramsight_boom_compare_init(&c, tolerance, time_to_alert); }
int step(double time, double position, double bound, int status, double other) {
  return ramsight_boom_compare_step(&c, time, position, bound, status, other);
}
"""


@pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")
def test_the_comparison_in_c_says_the_same(tmp_path):
    boom = build(machine.load_machine("mining-loader").unit("boom"), "boom")
    for name, text in comparison_source(boom, "ramsight_boom", "mining-loader").items():
        (tmp_path / name).write_text(text)
    (tmp_path / "shim.c").write_text(SHIM)
    flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC"]
    files = [str(tmp_path / name) for name in ("shim.c", "ramsight_boom_compare.c")]
    subprocess.run([find_compiler(), *flags, *files, "-lm", "-o", str(tmp_path / "compare.so")], check=True)
    c = ctypes.CDLL(str(tmp_path / "compare.so"))
    real = ctypes.c_double
    c.begin.argtypes, c.step.argtypes = [real, real], [real, real, real, ctypes.c_int, real]
    fastest = float(boom.travel_per_radian) * limits_of(boom).max_speed
    random, seen = np.random.default_rng(4), set()
    for fault, code in itertools.product((0.0, 0.02, 0.5, np.nan), (Status.OK, Status.NEAR_RELIEF)):
        other = np.where(TIME < 5.0, TRUE, TRUE + fault) + 1e-4 * random.standard_normal(TIME.size)
        other = np.where(TIME < 7.0, other, TRUE + np.minimum(0.01 * (TIME - 7.0), 0.01))  # creeps away
        status = np.where(TIME < 9.5, int(code), int(Status.NOT_REFERENCED))
        pair = Comparison(float(boom.cylinder.stroke), fastest, TOLERANCE)
        c.begin(TOLERANCE, pair.time_to_alert)
        expected = verdicts(pair, TIME, TRUE, np.full(TIME.size, BOUND), status, other)
        said = [c.step(*row) for row in zip(TIME, TRUE, np.full(TIME.size, BOUND), status.tolist(), other, strict=True)]
        assert said == expected.tolist()
        seen |= set(said)
    assert seen == set(map(int, Verdict))
