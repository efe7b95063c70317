"""Measures the engine against others on the same equations, in one run, and writes results/bench.json.

    python benchmarks/run.py [--quick]

Every time is the median of repeats that take turns, so that a slow moment of the machine hits all alike.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import casadi as ca
import numpy as np
from bench_file import keep
from c_engine import CEngine
from scipy.integrate import solve_ivp

from ramsight import machine
from ramsight.duty import DriveReport, lift_lower, report, simulate
from ramsight.duty.linked_duty import starting
from ramsight.duty.loading import loading_cycle
from ramsight.duty.work_day import work_day
from ramsight.engine.batch import Job, batches
from ramsight.engine.cache import WIDTH
from ramsight.engine.recursion import replay, replay_many
from ramsight.engine.run import DEFAULT_RTOL, integrate, outputs
from ramsight.logs.drive_log import write_log
from ramsight.plant import linked
from ramsight.plant.ddh import build_ddh
from ramsight.plant.unit import circuit, initial_state
from ramsight.sensor.kalman import kalman

LIMIT = 1e-6  # m, what every engine has to keep
RUNS = 1024
CORES = len(os.sched_getaffinity(0))
UNIT = build_ddh("boom", machine.load_machine("mining-loader").unit("boom"))
MODEL = circuit(UNIT)
ODE = MODEL.ode
POSITION = ODE.state_index("position")
ATOL = np.array([state.tolerance for state in ODE.states])
SCALE = np.array(
    [1e5 if state.unit == "Pa" else 1e-2 for state in ODE.states]
)  # what a state's tolerance is a share of


def job(load, kelvin, cycles=1, start=None):
    """Lift-lower cycles of the boom."""
    duty = lift_lower(UNIT, load, kelvin, cycles=cycles, start_position=start)
    segments = duty.segments(MODEL.values, ODE.parameters)
    return Job(initial_state(UNIT, MODEL, duty.start_position, load), segments)


def timed(function):
    start = time.perf_counter()
    function()
    return time.perf_counter() - start


def take_turns(functions, repeats):
    """Median time of each function, run one after the other, again and again."""
    times = {name: [] for name in functions}
    for _ in range(repeats):
        for name, function in functions.items():
            times[name].append(timed(function))
    return {name: float(np.median(values)) for name, values in times.items()}


def by_scipy(one, method, rtol, times):
    """The cycle by scipy, restarted at the corners; the right-hand side is the CasADi function."""
    state, rows, f = one.initial, [], ODE.function
    for k, (a, b) in enumerate(zip(one.segments.start, one.segments.end, strict=True)):
        value, slope, p = one.segments.value[k], one.segments.slope[k], one.segments.parameters[0]
        inside = times[(times >= a) & (times < b)]
        solved = solve_ivp(
            lambda t, y, a=a, value=value, slope=slope, p=p: f(y, value + slope * (t - a), slope, p).full().ravel(),
            (a, b), state, method=method, rtol=rtol, atol=rtol * SCALE,
            t_eval=np.append(inside, b),
        )  # fmt: skip
        rows.append(solved.y[POSITION, :-1])
        state = solved.y[:, -1]
    return np.append(np.concatenate(rows), state[POSITION])


class Cvodes:
    """The cycle by CasADi's CVODES with its exact sparse Jacobian."""

    def __init__(self, rtol):
        p = ca.vertcat(ODE.p, ODE.slope, u0 := ca.SX.sym("u0", ODE.u.numel()), t0 := ca.SX.sym("t0"))
        t = ca.SX.sym("t")
        right = ca.substitute(ODE.rhs, ODE.u, u0 + ODE.slope * (t - t0))
        self.problem, self.options = {"x": ODE.x, "p": p, "ode": right, "t": t}, {"reltol": rtol, "abstol": rtol * 1e-2}
        self.cache = {}

    def __call__(self, one, times):
        state, rows = one.initial, []
        for k, (a, b) in enumerate(zip(one.segments.start, one.segments.end, strict=True)):
            inside = times[(times >= a) & (times < b)]
            grid = np.append(inside[inside > a], b)
            if k not in self.cache:
                self.cache[k] = ca.integrator("cycle", "cvodes", self.problem, float(a), grid.tolist(), self.options)
            p = np.concatenate([one.segments.parameters[0], one.segments.slope[k], one.segments.value[k], [a]])
            found = self.cache[k](x0=state, p=p)["xf"].full()
            if len(inside) and inside[0] == a:
                rows.append([state[POSITION]])
            rows.append(found[POSITION, :-1])
            state = found[:, -1]
        return np.append(np.concatenate(rows), state[POSITION])


def loosest(make, tolerances, reference):
    """The loosest tolerance that keeps the limit, and the error there."""
    for tolerance in tolerances:
        try:
            error = float(np.abs(make(tolerance) - reference).max())
        except RuntimeError:
            continue
        if error <= LIMIT:
            return tolerance, error
    raise SystemExit("an engine does not reach the limit")


def single(results, quick, folder):
    one = job(441e3, 313.15)
    end = one.segments.end[-1]
    times = np.append(np.arange(0.0, end - 1e-9, 0.1), end)
    reference = integrate(ODE, one.initial, one.segments, times, rtol=1e-11, tolerance_scale=1e-6).state[:, POSITION]
    compiled = CEngine(ODE, folder)
    ours = integrate(ODE, one.initial, one.segments, times)
    results["single_error_m"] = float(np.abs(ours.state[:, POSITION] - reference).max())
    results["single_steps"] = [ours.accepted, ours.rejected]
    results["c_error_m"] = abs(compiled.one(one.initial, one.segments, DEFAULT_RTOL, ATOL)[POSITION] - reference[-1])
    tolerances = [a * 10.0**-b for b in range(3, 10) for a in (1.0, 0.3)]
    lsoda, results["scipy_lsoda_error_m"] = loosest(lambda r: by_scipy(one, "LSODA", r, times), tolerances, reference)
    solvers = {}

    def cvodes_of(rtol):
        solvers[rtol] = Cvodes(rtol)
        return solvers[rtol](one, times)

    cvodes, results["casadi_cvodes_error_m"] = loosest(cvodes_of, tolerances, reference)
    results["scipy_lsoda_rtol"], results["casadi_cvodes_rtol"] = lsoda, cvodes
    last = np.array([end])
    fast = take_turns(
        {
            "ours": lambda: integrate(ODE, one.initial, one.segments, last),
            "c": lambda: compiled.one(one.initial, one.segments, DEFAULT_RTOL, ATOL),
            "cvodes": lambda: solvers[cvodes](one, times),
        },
        15 if quick else 101,
    )
    slow = take_turns(
        {
            "ours": lambda: integrate(ODE, one.initial, one.segments, last),
            "lsoda": lambda: by_scipy(one, "LSODA", lsoda, last),
        },
        1 if quick else 3,
    )
    results["single_ms"], results["single_c_ms"] = 1e3 * fast["ours"], 1e3 * fast["c"]
    results["single_vs_c"] = fast["ours"] / fast["c"]
    results["casadi_cvodes_vs_single"] = fast["cvodes"] / fast["ours"]
    results["scipy_lsoda_vs_single"] = slow["lsoda"] / fast["ours"]
    return compiled


def batch(results, quick, compiled):
    rng = np.random.default_rng(0)
    loads, kelvin = rng.uniform(50e3, 441e3, RUNS), rng.uniform(20.0, 70.0, RUNS) + 273.15
    jobs = [job(load, t) for load, t in zip(loads, kelvin, strict=True)]
    states = np.array([j.initial for j in jobs])
    corners = np.column_stack([jobs[0].segments.start, jobs[0].segments.end])
    values, slopes = (np.array([getattr(j.segments, name) for j in jobs]) for name in ("value", "slope"))
    parameters = np.array([j.segments.parameters[0] for j in jobs])
    pool, share = ThreadPoolExecutor(CORES), -(-RUNS // CORES)

    def in_c():
        parts = [slice(k, k + share) for k in range(0, RUNS, share)]
        arguments = [(states[p], corners, values[p], slopes[p], parameters[p], DEFAULT_RTOL, ATOL) for p in parts]
        return np.concatenate(list(pool.map(lambda a: compiled.many(*a), arguments)))

    def ours():
        return next(iter(batches(ODE, jobs, threads=CORES)))

    found, other = ours(), in_c()
    checked = range(0, RUNS, 16)
    tight = {"rtol": 1e-11, "tolerance_scale": 1e-6}
    exact = np.array(
        [
            integrate(ODE, one.initial, one.segments, one.segments.end[-1:], **tight).state[0, POSITION]
            for one in (jobs[k] for k in checked)
        ]
    )
    results["batch_error_m"] = float(np.abs(found.final[list(checked), POSITION] - exact).max())
    results["batch_c_error_m"] = float(np.abs(other[list(checked), POSITION] - exact).max())
    results["batch_steps_mean"] = float(np.mean(found.accepted + found.rejected))
    times = take_turns({"ours": ours, "c": in_c}, 3 if quick else 15)
    results["batch_cycles_per_s"], results["batch_c_cycles_per_s"] = RUNS / times["ours"], RUNS / times["c"]
    results["batch_vs_c"] = times["ours"] / times["c"]


def growth(results, quick):
    cycles = [1, 2, 4, 8, 16, 32]
    seconds = []
    for count in cycles:
        # A load that hardly sinks, so that no stop is reached.
        one = job(50e3, 313.15, count, start=0.4)
        run = partial(integrate, ODE, one.initial, one.segments, one.segments.end[-1:])
        seconds.append([float(one.segments.end[-1]), float(np.median([timed(run) for _ in range(5)]))])
    results["time_over_simulated_s"] = seconds
    counts = [512, 1024, 2048] if quick else [1024, 2048, 4096, 8192, 16384]
    rows = []
    for count in counts:
        child = subprocess.run(
            [sys.executable, __file__, "--many", str(count)], check=True, capture_output=True, text=True
        )
        rows.append([count, *map(float, child.stdout.split())])
    results["runs_seconds_and_peak_mib"] = rows


def many(count):
    """A batch of `count` runs in a process of its own: prints seconds and peak memory in MiB."""
    rng = np.random.default_rng(1)
    jobs = (job(rng.uniform(50e3, 441e3), 273.15 + rng.uniform(20.0, 70.0)) for _ in range(count))
    highest = 0.0
    list(batches(ODE, [job(441e3, 313.15)]))

    def work():
        nonlocal highest
        for part in batches(ODE, jobs):
            highest = max(highest, float(part.most[:, POSITION].max()))

    seconds = timed(work)
    assert highest > 0.2
    # Not ru_maxrss: that begins with the parent's.
    peak = next(row for row in Path("/proc/self/status").read_text().splitlines() if row.startswith("VmHWM"))
    print(seconds, float(peak.split()[1]) / 1024)


def loader(results, quick):
    """Both units of the loader and its mechanism over one loading cycle: simulated seconds per second of one core."""
    whole = linked.build_linked(machine.load_machine("mining-loader"))
    model, duty = linked.linked_model(whole), loading_cycle(whole)
    segments, state = duty.segments(whole.mechanism.cylinders, model), starting(whole, model, duty)
    times = np.append(np.arange(0.0, duty.duration - 1e-9, 0.1), duty.duration)

    def positions(run):
        found = outputs(model.ode, segments, times, run.state)
        return np.column_stack([found[f"{unit.name}.position"] for unit in whole.units])

    reference = integrate(model.ode, state, segments, times, rtol=1e-11, tolerance_scale=1e-6)
    ours = integrate(model.ode, state, segments, times)
    results["loader_error_m"] = float(np.abs(positions(ours) - positions(reference)).max())
    results["loader_steps"] = [ours.accepted, ours.rejected]
    seconds = [timed(partial(integrate, model.ode, state, segments, times)) for _ in range(5 if quick else 25)]
    results["loader_cycle_s"] = duty.duration
    results["loader_realtime_factor"] = duty.duration / float(np.median(seconds))


def sensor(results, quick):
    """The kalman sensor on a work day that is repeated: replay on one core, and single samples from Python."""
    duty = work_day(UNIT, (100e3, 370e3), 313.15, seed=1)
    log = report(simulate(UNIT, duty), DriveReport(seed=1))
    rows = np.column_stack([log[name].values for name in ("time", "motor_speed", "motor_torque", "oil_temperature")])
    days = 10 if quick else 50
    many = np.tile(np.column_stack([rows, np.zeros((len(rows), 2))]), (days, 1))
    many[:, 0] = 0.02 * np.arange(len(many))
    virtual = kalman(UNIT)
    virtual.start(duty.start_position)
    state = virtual.initial.copy()
    run = partial(replay, virtual.recursion, many, virtual.parameters, state)
    run()
    results["kalman_replay_samples_per_s"] = len(many) / float(np.median([timed(run) for _ in range(5)]))
    several, states = [many[: len(many) // WIDTH]] * WIDTH, np.tile(virtual.initial, (WIDTH, 1))
    beside = partial(replay_many, virtual.recursion, several, virtual.parameters, states)
    beside()
    found = sum(map(len, several)) / float(np.median([timed(beside) for _ in range(5)]))
    results["kalman_replay_of_many_samples_per_s"] = found
    samples = [tuple(map(float, row)) for row in rows[:10_000]]

    def live():
        virtual.start(duty.start_position)
        for sample in samples:
            virtual.step(*sample)

    live()
    results["kalman_step_us"] = 1e6 * float(np.median([timed(live) for _ in range(5)])) / len(samples)


def track_start(results, quick):
    """`ramsight track` of a log of a minute, from the shell to its end, with a warm cache."""
    duty = work_day(UNIT, (100e3, 370e3), 313.15, duration=60.0, seed=1)
    log = report(simulate(UNIT, duty), DriveReport(seed=1)).sel(time=slice(0.0, 60.0))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "minute.csv"
        write_log(log, file)
        command = [sys.executable, "-m", "ramsight", "track", "mining-loader", str(file), "--unit", "boom"]
        run = partial(subprocess.run, command, check=True, capture_output=True)
        run()
        results["track_start_s"] = float(np.median([timed(run) for _ in range(3 if quick else 9)]))


def starts(results, quick):
    command = [sys.executable, "-m", "ramsight", "simulate", "mining-loader", "--unit", "boom", "--load", "441 kN"]
    cold, warm, asked = [], [], []
    for _ in range(1 if quick else 3):
        with tempfile.TemporaryDirectory() as cache:
            run = partial(
                subprocess.run, command, check=True, capture_output=True, env=os.environ | {"RAMSIGHT_CACHE": cache}
            )
            cold.append(timed(run))
            warm += [timed(run) for _ in range(3)]
        ask = partial(subprocess.run, [*command[:3], "--help"], check=True, capture_output=True)
        asked += [timed(ask) for _ in range(3)]
    results["cold_start_s"], results["warm_start_s"] = float(np.median(cold)), float(np.median(warm))
    results["help_s"] = float(np.median(asked))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer repeats")
    parser.add_argument("--out", type=Path, default=Path("results/bench.json"))
    parser.add_argument("--many", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.many:
        many(options.many)
        return
    processor = next((r for r in Path("/proc/cpuinfo").read_text().splitlines() if r.startswith("model name")), "")
    results = {"cores": CORES, "processor": processor.partition(":")[2].strip() or platform.processor()}
    with tempfile.TemporaryDirectory() as folder:
        compiled = single(results, options.quick, folder)
        batch(results, options.quick, compiled)
    growth(results, options.quick)
    loader(results, options.quick)
    sensor(results, options.quick)
    starts(results, options.quick)
    track_start(results, options.quick)
    results = {k: float(f"{v:.4g}") if isinstance(v, float) else v for k, v in results.items()}
    keep(results, options.out)
    print(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
