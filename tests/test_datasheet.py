"""A study of machines: what it is made of, that a stop loses nothing, and what the sheet says of it."""

import json
import math
import re
import signal
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats
from typer.testing import CliRunner

import ramsight
from ramsight import machine
from ramsight.cli import app
from ramsight.errors import DescriptionError, OutputError, RamsightError
from ramsight.optional import needs
from ramsight.plant.build import build
from ramsight.plant.circuit import parameter_values
from ramsight.plant.unit import circuit
from ramsight.sensor.report.detectors import CONTRADICTIONS
from ramsight.sensor.status import Status
from ramsight.study.datasheet import cluster as clusters
from ramsight.study.datasheet import machine_tasks, statistics, store
from ramsight.study.datasheet import study_plan as plans
from ramsight.study.datasheet.budget import REPORTED, differences, linear_budget
from ramsight.study.datasheet.drawn import draw, ready
from ramsight.study.datasheet.machine_tasks import runs, work_through
from ramsight.study.datasheet.measuring import GROUPS, TAUGHT, VOUCHED, Track, drift_of, measures, tracked
from ramsight.study.datasheet.statistics import (
    Known,
    indices,
    pooled_quantiles,
    quantile_of_counts,
    quantile_of_machines,
    saltelli,
    share_of,
    slope_of,
)

COUNT, TASK = 5, 2
TRACES = Path(__file__).parent / "traces"


@pytest.fixture(autouse=True)
def small_tasks(monkeypatch):
    monkeypatch.setattr(plans, "TASK", TASK)


@pytest.fixture(scope="module")
def study():
    return ramsight.Study("mining-loader", "lift-lower", unit="boom", machines=COUNT)


@pytest.fixture(scope="module")
def found(study):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(plans, "TASK", TASK)
        return study.run(threads=1)


# -- what a study is made of


@pytest.mark.parametrize("entry", [one.name for one in ramsight.catalogue("machine")])
def test_parameters_of_another_machine_are_those_of_its_own_equation(entry):
    described = machine.load_machine(entry)
    for name, unit in described.units.items():
        nominal = ready(build(unit, name))
        drawn = draw(
            unit, name, nominal, {"leakage": 1.3, "volumes": 0.9, "viscosity": 1.1, "stop": 1e-3, "area": 1.01}
        )
        other = drawn.unit
        values = parameter_values(circuit(nominal), other.oil, other.tank_pressure, other.parts())
        np.testing.assert_array_equal(values, circuit(other).values)


def test_what_is_drawn_is_what_is_simulated():
    unit = machine.load_machine("mining-loader").unit("boom")
    sheet = ready(build(unit, "boom"))
    factors = {"displacement": 1.01, "pump_friction": 1.2, "relief": 0.9, "valves": 1.1, "mass": 1.5, "viscosity": 1.2}
    made = draw(unit, "boom", sheet, {**factors, "stop": 2e-3, "hose.volume": 1e-3}).unit
    assert made.a.pump.displacement == pytest.approx(1.01 * sheet.a.pump.displacement)
    assert made.b.pump.friction_factor == pytest.approx(1.2)
    assert made.a.relief.setting == pytest.approx(0.9 * sheet.a.relief.setting)
    assert made.a.safety.conductance == pytest.approx(1.1 * sheet.a.safety.conductance)
    assert made.cylinder.mass == pytest.approx(1.5 * sheet.cylinder.mass)
    assert made.cylinder.stroke == pytest.approx(sheet.cylinder.stroke + 2e-3)
    assert made.a.hose.volume == pytest.approx(1e-3)
    for kelvin in (313.15, 373.15):
        assert float(made.oil.viscosity(kelvin)) == pytest.approx(1.2 * float(sheet.oil.viscosity(kelvin)))


def test_a_drive_reports_what_it_was_drawn_as():
    unit = machine.load_machine("mining-loader").unit("boom")
    sheet = ready(build(unit, "boom"))
    drawn = {
        "torque_gain": 1.02, "torque_offset": 0.01, "torque_delay": 0.1, "torque_noise": 0.0,
        "thermometer_offset": 2.0,
    }  # fmt: skip
    made = draw(unit, "boom", sheet, {**drawn, "thermometer_lag": 50.0})
    time = 0.02 * np.arange(6000)
    torque, oil = np.sin(time), 300.0 + 0.05 * time
    speed, reported, shown = made.reported(time, 10.0 + time, torque, oil, seed=1)
    assert np.abs(speed - 10.0 - time).max() < 0.06
    wanted = 1.02 * np.sin(time - 0.1) + 0.01 * made.relief_torque
    assert np.abs(reported - wanted)[10:].max() <= 1 / 32 + 1e-3  # half a step, and straight lines between samples
    behind = 300.0 + 0.05 * (time - 50.0 * (1.0 - np.exp(-time / 50.0))) + 2.0
    assert np.abs(shown - behind).mean() < 0.25


def test_a_small_machine_has_a_small_drive():
    for name, unit, share in (("mining-loader", "boom", 1.0), ("eha-valve-rig", "axis", 0.1)):
        described = machine.load_machine(name).unit(unit)
        made = draw(described, unit, ready(build(described, unit)), {})
        time = 0.02 * np.arange(5000)
        _, torque, _ = made.reported(time, time, 0.0 * time, 300.0 + 0.0 * time, seed=1)
        assert np.std(torque) == pytest.approx(0.5 * share, rel=0.05)
        assert np.std(torque) < 1.1 * made.unit.assumptions.drive.torque * made.relief_torque


def test_a_machine_is_the_same_whatever_is_beside_it(study, found):
    bench = study.plan.bench
    alone = work_through(bench, study.plan.order(range(3, 4)))
    for name in ("largest", "p95", "errors", "profile", "first_position"):
        np.testing.assert_array_equal(alone[name][0], found[name].values[3].astype(alone[name].dtype))


def test_threads_make_their_graphs_one_at_a_time(study, monkeypatch):
    """CasADi counts references without a lock: two threads that plan at once end the process."""
    locked, drawing = [], machine_tasks.draw

    def watched(*given):
        locked.append(machine_tasks._PLANS.locked())
        return drawing(*given)

    monkeypatch.setattr(machine_tasks, "draw", watched)
    study.run(threads=2)
    assert len(locked) >= COUNT
    assert all(locked)


def test_each_machine_has_a_duty_and_noise_of_its_own_unless_they_are_to_be_common(study):
    order = study.plan.order(range(3))
    assert len({order.seed_of(number) for number in range(100)}) == 100
    common = replace(order, common=2)
    assert {common.seed_of(number) for number in range(100)} == {order.seed_of(2)}
    assert replace(order, seed=1).seed_of(0) != order.seed_of(0)


# -- what is kept of a track


def a_track(error, status=Status.OK, std=1e-3):
    """Five visits to the ends of 0.5 m, in sweeps of 10 s, with an error that goes by time and place."""
    time = 0.02 * np.arange(2501)
    true = 0.25 + 0.251 * np.cos(np.pi * time / 10.0 + 0.5 * np.pi)
    true = np.clip(true, 0.0, 0.5)
    states = np.full(len(time), int(status))
    return Track(time, true + error(time, true), np.full(len(time), std), states, true, 0.5)


def test_errors_are_counted_by_the_references_before_them():
    track = a_track(lambda time, true: np.where(time < 20.0, 5e-3, -1e-3))
    kept = measures(track)
    assert kept["visits"] == 5
    np.testing.assert_allclose(kept["largest"], [5e-3, 5e-3, 5e-3, 1e-3, 5e-3])
    np.testing.assert_allclose(kept["mean"][[0, TAUGHT]], [5e-3, -1e-3])
    assert kept["samples"][:VOUCHED].sum() == len(track.time) == kept["samples"][VOUCHED]
    assert kept["errors"].sum(axis=1).tolist() == kept["samples"].tolist()
    assert kept["inside"][TAUGHT] == kept["samples"][TAUGHT]
    assert kept["inside"][0] == 0
    assert kept["statuses"].tolist() == [len(track.time), 0, 0, 0]
    assert kept["ok_beyond_4_std"] == (track.time < 20.0).sum()


def test_a_position_that_the_sensor_calls_invalid_is_no_error_but_a_share_of_the_time():
    kept = measures(a_track(lambda time, true: np.full(len(time), 0.1), Status.OUTSIDE_STROKE))
    assert kept["samples"].sum() == 0
    assert np.isnan(kept["largest"]).all()
    assert kept["statuses"][3] == 2501


def test_profiles_show_bending_hysteresis_and_spread():
    sweep = a_track(
        lambda time, true: 1e-3 * true / 0.5 + 2e-3 * np.sign(np.gradient(true)) * (np.abs(np.gradient(true)) > 0)
    )
    table = measures(sweep)["profile"]
    mean = table[..., 1] / table[..., 0]
    np.testing.assert_allclose(mean[0] - mean[1], 4e-3, atol=2e-4)
    np.testing.assert_allclose(mean.mean(axis=0), 1e-3 * (np.arange(10) + 0.5) / 10, atol=2e-4)


def test_drift_is_the_slope_over_the_age_of_a_reference():
    age = (np.arange(12) + 0.5) * 10.0
    table = np.column_stack([np.full(12, 100.0), 100.0 * (1e-3 + 2e-5 * age), np.zeros(12)])
    np.testing.assert_allclose(drift_of(table), [1e-3, 2e-5])
    assert np.isnan(drift_of(np.zeros((12, 3)))).all()


# -- statistics


def test_quantiles_of_counts_are_those_of_the_values():
    values = np.random.default_rng(0).lognormal(-7.0, 1.0, 20000)
    edges = np.concatenate([[0.0], np.logspace(-6, 0, 241), [np.inf]])
    counts = np.histogram(values, edges)[0].astype(float)
    for share in (0.1, 0.5, 0.95, 0.997):
        assert quantile_of_counts(counts, edges, share) == pytest.approx(np.quantile(values, share), rel=0.02)
    assert math.isnan(quantile_of_counts(np.zeros(242), edges, 0.5))


def test_intervals_hold_what_they_say():
    random = np.random.default_rng(1)
    true, machines_95 = stats.norm.ppf(0.975), stats.norm.ppf(0.95)
    edges = np.concatenate([[0.0], np.linspace(0.01, 5.0, 400), [np.inf]])
    held, kept, shares = 0, 0, 0
    for k in range(30):
        sizes = np.abs(random.normal(size=(40, 50)))
        counts = np.array([np.histogram(one, edges)[0] for one in sizes])
        (known,) = pooled_quantiles(counts, edges, (0.95,), seed=k)
        held += known.low <= true <= known.high
        several = quantile_of_machines(random.normal(size=200), 0.95)
        kept += several.low <= machines_95 <= several.high
        told = share_of(int(random.binomial(80, 0.1)), 80)
        shares += told.low <= 0.1 <= told.high
    assert min(held, kept, shares) >= 25  # of 30; 28.5 are expected
    x = random.normal(size=50)
    line = slope_of(x, 3.0 * x + random.normal(size=50))
    assert line.low < 3.0 < line.high
    assert quantile_of_machines(np.arange(10.0), 0.95).high == math.inf


@pytest.mark.parametrize(("most", "near"), [(4000, 1.6), (100, 8.0)])
def test_the_interval_of_a_pooled_quantile_is_that_of_as_many_machines(most, near, monkeypatch):
    """Each machine has one error of its own: then the quantile is one of machines, whose interval is known.

    Of a part of the machines the interval is less certain, and no wider.
    """
    monkeypatch.setattr(statistics, "_MOST", most)
    machines = 400
    edges = np.concatenate([[0.0], 1.0 + np.arange(machines + 1), [np.inf]])
    counts = np.pad(np.eye(machines), ((0, 0), (1, 1)))
    found = [pooled_quantiles(counts, edges, (0.5,), seed=k)[0] for k in range(8)]
    # Ranks 180 and 221 of 400: with 95 %, as many of 400 throws of a coin lie below 200 as that.
    known = Known(201.0, 180.5, 221.5)
    assert quantile_of_machines(1.5 + np.arange(machines), 0.5) == known
    assert np.mean([one.value for one in found]) == pytest.approx(known.value, abs=1.0)
    assert np.mean([one.low for one in found]) == pytest.approx(known.low, abs=near)
    assert np.mean([one.high for one in found]) == pytest.approx(known.high, abs=near)


# -- the error budget


def ishigami(x):
    return np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def test_indices_of_ishigamis_function_lie_within_their_intervals():
    found = indices(3, ishigami(np.pi * (2.0 * saltelli(3, 1024, seed=0) - 1.0)), seed=0)
    known_first, known_total = np.array([0.3139, 0.4424, 0.0]), np.array([0.5576, 0.4424, 0.2437])
    assert (np.abs(found.first - known_first) <= found.first_half + 1e-3).all()
    assert (np.abs(found.total - known_total) <= found.total_half + 1e-3).all()
    assert found.first_half.max() < 0.1
    assert found.runs == 1024 * 5


def test_indices_of_sobols_g_and_of_several_outcomes():
    a = np.array([0.0, 1.0, 4.5, 99.0])
    x = saltelli(4, 1024, seed=1)
    parts = (np.abs(4.0 * x - 2.0) + a) / (1.0 + a)
    partial = 1.0 / (3.0 * (1.0 + a) ** 2)
    whole = np.prod(1.0 + partial) - 1.0
    found = indices(4, parts.prod(axis=1), seed=1)
    assert (np.abs(found.first - partial / whole) <= found.first_half + 2e-3).all()
    rest = np.array([np.prod(np.delete(1.0 + partial, k)) for k in range(4)])
    assert (np.abs(found.total - partial * rest / whole) <= found.total_half + 5e-3).all()
    both = indices(4, np.column_stack([x[:, 0], 2.0 * x[:, 1], np.ones(len(x))]), seed=1)
    np.testing.assert_allclose(both.first, [0.2, 0.8, 0.0, 0.0], atol=0.02)


def test_the_linear_budget_agrees_with_finite_differences_through_the_machine(study):
    bench, quantities = study.plan.bench, study.plan.quantities
    names = ("torque_gain", "thermometer_offset", "start", "displacement", "stop")
    some = tuple(one for one in quantities if one.name in names)
    moments = np.arange(30.0, 120.0, 2.0)
    linear = linear_budget(bench, some, moments, common=0, seed=0)
    through = differences(bench, some, names, moments, common=0, seed=0)
    for name, effect in zip(names, through, strict=True):
        mine = linear.effect[linear.names.index(name)]
        if name in REPORTED or name == "start":
            np.testing.assert_allclose(mine, effect, atol=1e-9)
        else:  # beside it the machine's moves are other ones, and a contact falls into another sample: 0.1 mm
            # A press that is decided at another sample moves the rest of a visit: a tenth of the moments may be apart.
            assert np.percentile(np.abs(mine - effect), 90) < 0.3e-3, name
            assert np.corrcoef(mine, effect)[0, 1] > 0.85, name
            assert np.sqrt(np.mean(mine**2)) == pytest.approx(np.sqrt(np.mean(effect**2)), rel=0.1, abs=1e-4), name
    assert linear.shares.sum() == pytest.approx(1.0)


def test_the_tolerances_of_a_studys_runs_cost_no_accuracy(study, monkeypatch):
    """A hundredth of them moves no position by a tenth of a millimetre."""
    bench, order = study.plan.bench, study.plan.order(range(TASK))
    usual = runs(bench, order, range(TASK))
    monkeypatch.setattr(machine_tasks, "LOOSER", machine_tasks.LOOSER / 100.0)
    for one, exact in zip(usual, runs(bench, order, range(TASK)), strict=True):
        assert 0.0 < np.abs(one.true - exact.true).max() < 0.1e-3


# -- a stop loses nothing

KILLED = """
import os, signal, sys
from ramsight.study.datasheet import store, study_plan
import ramsight
study_plan.TASK = 2
kept, writes = store._write, []
def write(group, layout, rows, found):
    writes.append(rows)
    if len(writes) == 2:
        group["p95"][rows.start : rows.stop] = found["p95"]
        os.kill(os.getpid(), signal.SIGKILL)
    kept(group, layout, rows, found)
store._write = write
ramsight.Study("mining-loader", "lift-lower", unit="boom", machines=5).run(sys.argv[1], threads=1)
"""


@pytest.mark.slow
@pytest.mark.posix
def test_a_study_that_was_killed_goes_on_and_gives_the_same_to_the_last_bit(study, found, tmp_path, monkeypatch):
    path = tmp_path / "store"
    done = subprocess.run([sys.executable, "-c", KILLED, str(path)], check=False, capture_output=True, text=True)
    assert done.returncode == -signal.SIGKILL, done.stderr
    layout = study.plan.layout
    assert store.Store(path, layout, COUNT).done.tolist() == [True, True, False, False, False]
    seen, task = [], clusters._task_here
    monkeypatch.setattr(clusters, "_task_here", lambda plan, kept, rows: seen.append(rows) or task(plan, kept, rows))
    resumed = study.run(path, threads=2)
    assert sorted(one.start for one in seen) == [2, 4]
    assert resumed.identical(found)


def test_a_finished_study_is_extended_and_gives_what_the_longer_one_gives(study, found, tmp_path):
    shorter = ramsight.Study("mining-loader", "lift-lower", unit="boom", machines=3)
    first = shorter.run(tmp_path / "store", threads=1)
    assert first.sizes["machine"] == 3
    assert study.run(tmp_path / "store", threads=1).identical(found)


@pytest.mark.parametrize(
    ("other", "words"),
    [({"seed": 1}, "seed"), ({"vary": {"leakage": "± 5 %"}}, "tolerances"), ({"method": "latin-hypercube"}, "design")],
)
def test_a_store_of_another_study_is_refused(study, tmp_path, other, words):
    store.Store(tmp_path / "store", study.plan.layout, COUNT)
    another = ramsight.Study("mining-loader", "lift-lower", unit="boom", machines=COUNT, **other)
    with pytest.raises(store.StoreError, match=f"another study, with another {words}"):
        another.run(tmp_path / "store")


def test_a_folder_that_is_no_store_is_refused_and_left_as_it_is(study, tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(store.StoreError, match="holds something else"):
        study.run(tmp_path)
    assert (tmp_path / "notes.txt").read_text() == "mine"
    needs("zarr", "study").open_group(str(tmp_path / "foreign"), mode="w", attributes={"mine": 1})
    with pytest.raises(store.StoreError, match="no store of a study"):
        study.run(tmp_path / "foreign")
    with pytest.raises(store.StoreError, match="is no folder"):
        study.run(tmp_path / "notes.txt")


def test_one_that_was_stopped_while_it_was_laid_out_is_laid_out_anew(study, tmp_path):
    needs("zarr", "study").open_group(str(tmp_path / "store"), mode="w", attributes={"kind": "ramsight study"})
    assert not store.Store(tmp_path / "store", study.plan.layout, COUNT).done.any()


def test_a_full_disk_is_one_line_and_what_was_done_stays(study, tmp_path, monkeypatch):
    kept, writes = store._write, []

    def full(group, layout, rows, found):
        writes.append(rows)
        if len(writes) > 1:
            raise OSError(28, "No space left on device")
        kept(group, layout, rows, found)

    monkeypatch.setattr(store, "_write", full)
    monkeypatch.setattr(clusters, "work_through", lambda bench, order: _nothing(study.plan, order))
    with pytest.raises(OutputError, match="No space left on device"):
        study.run(tmp_path / "store", threads=1)
    assert store.Store(tmp_path / "store", study.plan.layout, COUNT).done.tolist() == [True, True, False, False, False]


def _nothing(plan, order):
    count = len(order.numbers)
    arrays = plan.layout.arrays.items()
    return {name: np.zeros((count, *sizes)) for name, (_, _, sizes) in arrays if name not in ("done", "values")}


def test_what_is_not_installed_is_said(monkeypatch):
    monkeypatch.setitem(sys.modules, "zarr", None)
    with pytest.raises(ramsight.MissingPackageError, match=r'pip install "ramsight\[study\]"'):
        needs("zarr", "study")


# -- a cluster


def test_workers_of_this_machine_keep_their_memory():
    """Dask's own limit would have every array cleared again; it is there again for others."""
    dask = pytest.importorskip("dask")
    pytest.importorskip("distributed")
    limit, place = "MALLOC_TRIM_THRESHOLD_", "distributed.nanny.pre-spawn-environ"
    before = dict(dask.config.get(place))
    with clusters._memory_kept():
        assert dask.config.get(place) == {name: value for name, value in before.items() if name != limit}
    assert dask.config.get(place) == before
    assert limit in before, "Dask no longer sets it: nothing is to be done"


@pytest.mark.filterwarnings("ignore")
def test_a_cluster_gives_the_same_as_this_process(study, found, tmp_path):
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=False, dashboard_address="127.0.0.1:0"
        ) as here,
        distributed.Client(here, set_as_default=False) as client,
    ):
        done = []
        advance = done.append
        there = clusters.run(study.plan, tmp_path / "store", client=client, advance=advance)
        assert there.identical(found)
        assert sum(done) == COUNT
        assert clusters.run(study.plan, None, client=client).identical(found)


@pytest.mark.filterwarnings("ignore")
def test_no_scheduler_is_one_line(monkeypatch):
    monkeypatch.setattr(clusters, "_PATIENCE", "300 ms")
    with (
        pytest.raises(clusters.ClusterError, match="no scheduler answers") as refused,
        clusters.cluster("tcp://127.0.0.1:9"),
    ):
        pass
    assert "\n" not in str(refused.value)


def test_a_scheduler_that_is_lost_is_one_line_and_loses_nothing(study, tmp_path):
    class Lost:
        def nthreads(self):
            return {"one": 1}

        def submit(self, *order, **options):
            raise OSError("Timed out trying to connect")

    with pytest.raises(clusters.ClusterError, match="run the same again"):
        clusters.run(study.plan, tmp_path / "store", client=Lost())
    assert not store.Store(tmp_path / "store", study.plan.layout, COUNT).done.any()


# -- the sheet


def test_the_sheet_says_what_was_found(study, found):
    sheet = study.datasheet(found, study.budget(0))
    assert (sheet.machines, sheet.failed) == (COUNT, 0)
    assert sheet.best.group == GROUPS[TAUGHT]
    taught = found["largest"].values[:, TAUGHT]
    assert sheet.best.largest == taught.max()
    assert sheet.worst[0].machine == int(taught.argmax())
    assert sheet.worst[0].values["leakage"] == found["values"].values[int(taught.argmax()), 0]
    assert sheet.best.quantiles[0].value < sheet.best.quantiles[1].value <= sheet.best.largest * 1.1
    assert sum(sheet.validity.values()) == pytest.approx(1.0)
    assert sheet.term("update time").value == 0.02
    assert 5.0 < sheet.term("time to first position").value < 30.0  # a visit comes first
    content = json.loads(sheet.to_json())
    assert content["budget"]["runs"] == 0
    assert content["accuracy"][TAUGHT]["largest"] == sheet.best.largest
    assumed = tomllib.loads(sheet.to_toml())
    assert assumed["quantities"]["leakage"]["default"]
    assert set(assumed["quantities"]) == set(study.plan.names)


def test_the_verb_writes_a_page_its_numbers_and_what_was_assumed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    log, truth = (TRACES / f"boom_441kN_40C{end}.csv.gz" for end in ("", "_truth"))
    of = ["--unit", "boom", "--duty", "lift-lower", "--machines", "2", "--out", "sheet", "--vary", "leakage=± 10 %"]
    done = CliRunner().invoke(app, ["datasheet", "mining-loader", *of, "--log", str(log), "--truth", str(truth)])
    assert done.exit_code == 0, done.output
    assert "after 3 references and more: 95 % within" in done.stdout
    assert "boom_441kN_40C.csv.gz: " in done.stdout
    page = (tmp_path / "sheet" / "sheet.html").read_text(encoding="utf-8")
    assert page.count("data:image/png;base64,") == 6
    assert [link for link in re.findall(r'(?:src|href)="([^"]*)"', page) if not link.startswith("data:")] == []
    for words in ("IEC 61298-2", "hysteresis", "Error budget", "Recorded machines", "What was assumed", "Balluff"):
        assert words in page
    assert json.loads((tmp_path / "sheet" / "sheet.json").read_text())["machines"] == 2
    assert (tmp_path / "sheet" / "machines.zarr").is_dir()


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--vary", "leakage"], "--vary = 'leakage'"), (["--budget", "3"], "--budget = 3: is no power of two"),
        (["--log", "a.csv"], "needs one --truth"), (["--machines", "1", "--duration", "1 s"], "--duration"),
    ],
)  # fmt: skip
def test_the_verb_names_its_options(more, words, tmp_path):
    done = CliRunner().invoke(
        app, ["datasheet", "mining-loader", "--unit", "boom", "--out", str(tmp_path / "o"), *more]
    )
    assert isinstance(done.exception, RamsightError)
    assert words in str(done.exception)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"vary": {"leakage": "10 %"}}, "leakage = '10 %': is no tolerance"),
        ({"vary": {"leak": "± 1 %"}}, "leakage"),
        ({"duty": "dig"}, "no such duty"),
        ({"machines": 0}, "machines = 0: is out of range"),
        ({"seed": -1}, "seed"),
        ({"method": "grid"}, "latin-hypercube"),
        ({"duration": "1 s"}, "duration"),
        ({"correlations": {"leakage-friction": 1.0}}, "no correlation matrix"),
    ],
)
def test_what_cannot_be_a_study_is_refused_in_one_line(arguments, words):
    with pytest.raises(RamsightError, match=words) as refused:
        ramsight.Study("mining-loader", unit="boom", **arguments)
    assert "\n" not in str(refused.value)


def test_base_points_are_a_power_of_two(study):
    with pytest.raises(DescriptionError, match="power of two"):
        study.budget(3)


def test_a_sensor_of_an_angle_is_not_in_a_data_sheet_yet():
    loader = machine.load_machine("mining-loader").replace({"units.boom.assumptions.link_angle.std": 0.003})
    with pytest.raises(DescriptionError, match=r"link_angle\.std = 0.003: .* without its mechanism"):
        ramsight.Study(loader, unit="boom", machines=2)


@pytest.mark.slow
def test_what_a_drive_declares_beside_is_reported_to_the_sensor():
    declared = {"shaft.std": math.radians(0.05), "power.std": 0.005, "pressure.std": 1e5, "pressure.lag": 0.1}
    changes = {f"units.boom.assumptions.{key}": value for key, value in declared.items()}
    study = ramsight.Study(machine.load_machine("mining-loader").replace(changes), unit="boom", machines=1)
    (run,) = runs(study.plan.bench, study.plan.order(range(1)), range(1))
    names = study.plan.bench.virtual.recursion.inputs
    of = {name: run.inputs[:, names.index(name)] for name in ("shaft_angle", "dc_power", "pressure_a", "pressure_b")}
    assert all(np.isfinite(values).all() for values in of.values())
    turned = np.gradient(of["shaft_angle"], run.time)
    np.testing.assert_allclose(turned[5:-5], run.true_signals[0][5:-5], atol=4.0)
    (track,) = tracked([run], [study.plan.bench.virtual])
    assert not np.isin(track.status, CONTRADICTIONS).any()
