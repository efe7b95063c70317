"""Many runs side by side: the same as one at a time, on any processor; and a cache that mends itself."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from ramsight import machine
from ramsight.duty import Duty, Profile, lift_lower
from ramsight.duty.profile import constant
from ramsight.engine.batch import Job, batches, sampled
from ramsight.engine.run import Outcome, integrate
from ramsight.plant.build import build
from ramsight.plant.ddh import build_ddh
from ramsight.plant.unit import circuit, initial_state

UNIT = build_ddh("boom", machine.load_machine("mining-loader").unit("boom"))
MODEL = circuit(UNIT)


def job(duty):
    segments = duty.segments(MODEL.values, MODEL.ode.parameters)
    return Job(initial_state(UNIT, MODEL, duty.start_position, float(duty.load(0.0))), segments)


def jobs(count, seed=0):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield job(lift_lower(UNIT, rng.uniform(50e3, 441e3), 273.15 + rng.uniform(20, 70), hold=rng.uniform(0.2, 1.5)))


@pytest.mark.parametrize(("count", "threads"), [(1, 1), (3, 2), (8, 1), (29, 2)])
def test_a_batch_gives_what_single_runs_give(count, threads):
    runs = list(jobs(count))
    (found,) = batches(MODEL.ode, runs, threads=threads)
    assert found.outcome == [Outcome.DONE] * count
    for k, one in enumerate(runs):
        alone = integrate(MODEL.ode, one.initial, one.segments, one.segments.end[-1:], record_steps=True)
        np.testing.assert_allclose(found.final[k], alone.state[0], rtol=1e-12, atol=1e-15)
        np.testing.assert_allclose(found.most[k], alone.step_state.max(axis=0), rtol=1e-12, atol=1e-15)
        np.testing.assert_allclose(found.least[k], alone.step_state.min(axis=0), rtol=1e-12, atol=1e-15)
        assert (found.accepted[k], found.rejected[k]) == (alone.accepted, alone.rejected)


def test_samples_of_runs_side_by_side_are_those_of_single_runs():
    runs = list(jobs(11))
    found = sampled(MODEL.ode, runs, 0.02)
    assert found.outcome == [Outcome.DONE] * len(runs)
    for k in (0, 7, 10):
        alone = integrate(MODEL.ode, runs[k].initial, runs[k].segments, found.time[k])
        assert found.time[k][-1] <= runs[k].segments.end[-1] + 1e-9 < found.time[k][-1] + 0.02
        np.testing.assert_allclose(found.state[k], alone.state, rtol=1e-12, atol=1e-15)
    few = sampled(MODEL.ode, runs[6:8], 0.02)
    np.testing.assert_array_equal(few.state[1], found.state[7])  # to the last bit, whatever is beside it


def test_runs_may_differ_in_corners_and_temperature():
    still = Duty(constant(0.0), constant(2e5), constant(300.0), 0.3, end=1.0)
    warming = Duty(
        Profile([0.0, 0.5, 1.5], [0.0, 100.0, 100.0]), constant(1e5), Profile([0.0, 1.5], [300.0, 301.0]), 0.2
    )
    runs = [job(duty) for duty in (still, warming, lift_lower(UNIT, 3e5, 320.0, hold=0.3))]
    (found,) = batches(MODEL.ode, runs)
    for k, one in enumerate(runs):
        alone = integrate(MODEL.ode, one.initial, one.segments, one.segments.end[-1:])
        np.testing.assert_allclose(found.final[k], alone.state[0], rtol=1e-12, atol=1e-15)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "unit", "changes"),
    [("mining-loader", "boom", {"drive.control": "servo", "oil.free_air": "0.5 %"}), ("eha-single-rod", "axis", {})],
)
def test_other_circuits_and_options_run_in_lanes_too(name, unit, changes):
    built = build(machine.load_machine(name).unit(unit).replace(changes), unit)
    model = circuit(built)
    runs = []
    for k in range(9):
        duty = lift_lower(built, 9e3 + 1.5e3 * k, 300.0 + 3.0 * k, hold=0.4)
        segments = duty.segments(model.values, model.ode.parameters)
        start = initial_state(built, model, duty.start_position, float(duty.load(0.0)))
        runs.append(Job(start, segments))
    (found,) = batches(model.ode, runs)
    assert found.outcome == [Outcome.DONE] * len(runs)
    for k, one in enumerate(runs):
        alone = integrate(model.ode, one.initial, one.segments, one.segments.end[-1:])
        np.testing.assert_allclose(found.final[k], alone.state[0], rtol=1e-12, atol=1e-15)


def test_jobs_are_taken_as_they_are_needed(monkeypatch):
    monkeypatch.setattr("ramsight.engine.batch._CHUNK", 4)
    taken = []

    def supply():
        for k, one in enumerate(jobs(10)):
            taken.append(k)
            yield one

    stream = batches(MODEL.ode, supply())
    assert len(next(stream).final) == 4
    assert len(taken) == 4
    assert [len(part.final) for part in stream] == [4, 2]


def test_a_run_that_takes_too_long_does_not_hold_up_the_others():
    (found,) = batches(MODEL.ode, list(jobs(9)), max_steps=300)
    assert set(found.outcome) == {Outcome.TOO_MANY_STEPS}
    assert np.all(found.accepted + found.rejected == 300)


_CHILD = """
import sys, json
import casadi as ca, numpy as np
from ramsight.engine.equation import OdeModel, State
from ramsight.engine.run import Segments, integrate
from ramsight.engine.batch import Job, batches
if "modest" in sys.argv:
    from llvmlite import binding
    binding.get_host_cpu_name = lambda: "x86-64"
    binding.get_host_cpu_features = lambda: binding.FeatureMap({"sse2": True})
x, u, s, p = ca.SX.sym("x", 2), ca.SX.sym("u", 1), ca.SX.sym("s", 1), ca.SX.sym("p", 1)
rhs = ca.vertcat(x[1], p * (1 - x[0] ** 2) * x[1] - x[0] + u + ca.tanh(x[0]) * ca.exp(-x[1] ** 2))
model = OdeModel("v", (State("a", "1", 1e-9), State("b", "1", 1e-9)), ("u",), ("p",), x, u, s, p, rhs)
one = np.array([[0.1]])
segments = Segments(np.array([0.0]), np.array([3.0]), one, one, np.array([[5.0]]))
run = integrate(model, np.array([2.0, 0.0]), segments, np.array([3.0]))
result = run.state[0].tolist()
if "batch" in sys.argv:
    (many,) = batches(model, [Job(np.array([2.0, 0.1 * k]), segments) for k in range(11)])
    assert np.allclose(many.final[0], run.state[0], rtol=1e-12, atol=0)
    result += many.final.ravel().tolist()
print(json.dumps(result))
"""


def child(folder, *arguments, **environment):
    return subprocess.Popen(
        [sys.executable, "-c", _CHILD, *arguments],
        env=os.environ | {"RAMSIGHT_CACHE": str(folder)} | environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def answer(process):
    out, err = process.communicate(timeout=240)
    assert process.returncode == 0, err
    return json.loads(out)


@pytest.fixture(scope="module")
def cached(tmp_path_factory):
    """A cache that two processes filled at once, and what they found."""
    folder = tmp_path_factory.mktemp("cache")
    both = [child(folder), child(folder)]
    first, second = (answer(process) for process in both)
    assert first == second
    return folder, first


def spoil(file, how):
    content = bytearray(file.read_bytes())
    if how == "flip":
        content[len(content) // 2] ^= 0x10
    file.write_bytes(b"" if how == "empty" else content)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "how"), [("*.o", "empty"), ("*.o", "flip")])
def test_a_damaged_cache_is_made_again(cached, kind, how):
    folder, expected = cached
    files = [file for file in folder.rglob(kind) if file.is_file()]
    assert files
    for file in files:
        spoil(file, how)
    assert answer(child(folder)) == expected


@pytest.mark.slow
def test_a_cache_that_cannot_be_written_is_done_without(cached, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    assert answer(child(blocked / "below", TMPDIR=str(tmp_path))) == cached[1]


@pytest.mark.slow
def test_lanes_are_right_without_wide_registers(tmp_path, cached):
    modest = answer(child(tmp_path, "batch", "modest"))
    here = answer(child(cached[0], "batch"))
    np.testing.assert_allclose(modest, here, rtol=1e-9)
