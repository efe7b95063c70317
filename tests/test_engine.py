"""The engine alone: machine code against CasADi, elimination against numpy, the method's order, ways to fail."""

from dataclasses import dataclass

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from ramsight.engine import elimination, rodas4
from ramsight.engine.branches import Branch, schedule
from ramsight.engine.cache import generated_module, instructions
from ramsight.engine.equation import OdeModel, Output, State
from ramsight.engine.graph import graph_of
from ramsight.engine.recursion import Graph, Live, Recursion, Stepper, replay, replay_many
from ramsight.engine.run import Outcome, Segments, integrate, outputs
from ramsight.engine.typed_state import leaf


def equation(rhs, *, names, n_parameters=0, tolerance=1e-12, extra=()):
    """A small model: `rhs(x, u, p)` gives the list of derivatives; one input."""
    x, u = ca.SX.sym("x", len(names)), ca.SX.sym("u", 1)
    slope, p = ca.SX.sym("s", 1), ca.SX.sym("p", max(n_parameters, 1))
    return OdeModel(
        name="test",
        states=tuple(State(name, "1", tolerance) for name in names),
        inputs=("u",),
        parameters=tuple(f"p{i}" for i in range(max(n_parameters, 1))),
        x=x,
        u=u,
        slope=slope,
        p=p,
        rhs=ca.vertcat(*rhs(x, u, p)),
        outputs=tuple(Output(name, "1", function(x, u)) for name, function in extra),
    )


def one_segment(end, *, parameters=(0.0,), value=0.0, slope=0.0):
    one = np.array([[0.0]])
    return Segments(np.array([0.0]), np.array([end]), one + value, one + slope, np.array([parameters], dtype=float))


ROBERTSON = equation(
    lambda x, u, p: [
        -p[0] * x[0] + p[1] * x[1] * x[2], p[0] * x[0] - p[1] * x[1] * x[2] - p[2] * x[1] ** 2, p[2] * x[1] ** 2,
    ],
    names="abc",
    n_parameters=3,
    extra=[("sum", lambda x, u: ca.sum1(x))],
)  # fmt: skip
RATES = (0.04, 1e4, 3e7)


def test_robertsons_reaction_agrees_with_radau():
    segments = one_segment(40.0, parameters=RATES)
    run = integrate(ROBERTSON, np.array([1.0, 0.0, 0.0]), segments, np.linspace(0, 40, 41), rtol=1e-9)
    reference = solve_ivp(
        lambda t, y: np.array(ROBERTSON.function(y, 0, 0, RATES)).ravel(),
        (0, 40),
        [1.0, 0.0, 0.0],
        method="Radau",
        rtol=1e-11,
        atol=1e-15,
        t_eval=run.time,
    )
    assert run.outcome is Outcome.DONE
    np.testing.assert_allclose(run.state, reference.y.T, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(outputs(ROBERTSON, segments, run.time, run.state)["sum"], 1.0, atol=1e-9)


def test_the_methods_order_is_four_and_that_of_its_interpolation_three():
    model = equation(lambda x, u, p: [-x[0] * x[1] + u, x[0] - x[1] ** 2], names="ab")
    segments = one_segment(2.0, value=1.0, slope=-0.3)
    start = np.array([1.0, 0.5])
    sample = np.append(np.sort(np.random.default_rng(0).uniform(0.0, 2.0, 500)), 2.0)
    exact = integrate(model, start, segments, sample, rtol=1e-13).state
    steps = np.array([0.1, 0.05, 0.025, 0.0125])
    errors = []
    for step in steps:
        # Tolerances out of reach leave the largest step in charge.
        run = integrate(model, start, segments, sample, rtol=1e3, tolerance_scale=1e15, max_step=step)
        error = np.abs(run.state - exact).max(axis=1)
        errors.append((error[-1], error.max()))
    order = np.diff(np.log(np.array(errors)), axis=0) / np.diff(np.log(steps))[:, None]
    assert order[-1, 0] == pytest.approx(4.0, abs=0.35)
    assert order[-1, 1] > 2.7


def test_steps_end_exactly_at_the_corners_of_the_input():
    model = equation(lambda x, u, p: [u], names="a")
    start, end = np.array([0.0, 0.3, 0.7]), np.array([0.3, 0.7, 1.0])
    value, slope = np.array([[0.0], [1.0], [1.0]]), np.array([[0.0], [0.0], [-2.0]])
    run = integrate(
        model, np.zeros(1), Segments(start, end, value, slope, np.zeros((1, 1))), np.array([1.0]), record_steps=True
    )
    assert set(end) <= set(run.step_time)
    assert run.state[-1, 0] == pytest.approx(0.4 + 0.3 - 0.3**2, abs=1e-12)


def test_a_run_that_explodes_is_reported_with_time_and_state():
    model = equation(lambda x, u, p: [x[0] ** 2], names=["growth"])
    run = integrate(model, np.ones(1), one_segment(2.0), np.array([2.0]))
    assert run.outcome in {Outcome.STEP_TOO_SMALL, Outcome.NOT_FINITE}
    assert "growth" in run.message
    assert "Check" in run.message


def test_too_many_steps_is_reported_with_the_limit():
    model = equation(lambda x, u, p: [ca.cos(1e4 * x[1]), 1.0], names="ab")
    run = integrate(model, np.zeros(2), one_segment(100.0), np.array([100.0]), max_steps=1000)
    assert run.outcome is Outcome.TOO_MANY_STEPS
    assert "1000" in run.message


def test_a_paused_run_is_the_same_run(monkeypatch):
    segments = one_segment(40.0, parameters=RATES)
    whole = integrate(ROBERTSON, np.array([1.0, 0.0, 0.0]), segments, np.array([40.0]), record_steps=True)
    monkeypatch.setattr("ramsight.engine.run._BUFFER", 7)
    paused = integrate(ROBERTSON, np.array([1.0, 0.0, 0.0]), segments, np.array([40.0]), record_steps=True)
    np.testing.assert_array_equal(whole.state, paused.state)
    np.testing.assert_array_equal(whole.step_time, paused.step_time)


@pytest.mark.parametrize("seed", range(8))
def test_elimination_solves_sparse_systems_like_numpy(seed):
    rng = np.random.default_rng(seed)
    n = 9
    dense = np.where(rng.random((n, n)) < 0.3, rng.standard_normal((n, n)), 0.0)
    jacobian = ca.DM(dense) if seed % 2 else ca.sparsify(ca.DM(dense))
    written = elimination.eliminate(jacobian.sparsity())
    b = rng.standard_normal(n)
    k = np.array(written.solve(written.factor(jacobian.nonzeros(), 7.0), b)).ravel()
    np.testing.assert_allclose((7.0 * np.eye(n) - dense) @ k, b, atol=1e-9)


def _chain(n):
    return elimination.eliminate(ca.Sparsity.banded(n, min(n - 1, 1)))


@pytest.mark.parametrize("n", [3, 5, 7])
def test_a_chain_of_states_is_eliminated_from_both_its_ends(n):
    one, two, many = (max(graph_of(instructions(_chain(k).factor)).ready()) for k in (1, 2, n))
    assert many < one + (n // 2 + 1) * (two - one), "a pivot waits for no more than half of the others"
    assert _chain(n).n_factors == ca.Sparsity.banded(n, 1).nnz(), "and none is filled"


def test_rodas4_meets_its_order_conditions():
    # Sums of the transformed weights: the first-order condition in the form that the coefficients are given in.
    a, c = np.zeros((6, 6)), np.zeros((6, 6))
    for i in range(6):
        a[i, :i], c[i, :i] = rodas4.A[i], rodas4.C[i]
    gamma_matrix = np.linalg.inv(np.diag(np.full(6, 1 / rodas4.GAMMA)) - c)
    alpha, b = a @ gamma_matrix, np.array(rodas4.M) @ gamma_matrix
    assert b.sum() == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(alpha.sum(axis=1), rodas4.ALPHA, atol=1e-12)
    np.testing.assert_allclose(gamma_matrix.sum(axis=1), rodas4.GAMMA_SUM, atol=1e-12)
    assert b @ (alpha.sum(axis=1) ** 2) == pytest.approx(1 / 3, abs=1e-9)
    beta = (alpha + gamma_matrix).sum(axis=1)
    assert b @ beta == pytest.approx(1 / 2, abs=1e-9)


_X, _Y = ca.SX.sym("x"), ca.SX.sym("y")
_POSITIVE = ca.fabs(_X) + 1e-3
_OPERATIONS = {
    "sum": _X + _Y,
    "difference": _X - _Y,
    "product": _X * _Y,
    "quotient": _X / (ca.fabs(_Y) + 1.0),
    "negative": -_X,
    "inverse": 1.0 / _POSITIVE,
    "square": _X * _X,
    "twice": 2 * _X,
    "root": ca.sqrt(_POSITIVE),
    "magnitude": ca.fabs(_X),
    "exp": ca.exp(_X / 10.0),
    "log": ca.log(_POSITIVE),
    "tanh": ca.tanh(_X),
    "power": ca.power(_POSITIVE, _Y / 20.0),
    "constant_power": ca.power(_POSITIVE, 1.4),
    "sine": ca.sin(_X),
    "cosine": ca.cos(_X),
    "angle": ca.atan2(_X, _Y),
    "smaller": ca.fmin(_X, _Y),
    "larger": ca.fmax(_X, _Y),
    "sign": ca.sign(_X),
    "floor": ca.floor(_X),
    "ceil": ca.ceil(_X),
    "less": _X < _Y,
    "at_most": _X <= _Y,
    "choice": ca.if_else(_X > _Y, _X, 3.0 * _Y),
    "both": ca.logic_and(_X > 0, _Y > 0),
    "either": ca.logic_or(_X > 0, _Y > 0),
    "not": ca.logic_not(_X > 0),
}
_ALL = ca.Function("all_operations", [_X, _Y], [ca.vertcat(*_OPERATIONS.values())], ["x", "y"], ["z"])


@pytest.fixture(scope="module")
def compiled_operations():
    return generated_module({"all_operations": _ALL}, {}, "").all_operations


@settings(max_examples=300)
@given(x=st.floats(-50, 50), y=st.floats(-50, 50))
def test_machine_code_gives_what_casadi_gives(compiled_operations, x, y):
    x, y = x + 0.0, y + 0.0  # a zero below zero is one of no sign: its angle is another one in machine code
    z = np.empty(len(_OPERATIONS))
    compiled_operations(np.array([x]), np.array([y]), z)
    expected = np.array(_ALL(x, y)).ravel()
    wrong = [n for n, a, b in zip(_OPERATIONS, z, expected, strict=True) if abs(a - b) > 4e-15 * max(1.0, abs(b))]
    assert not wrong


def test_machine_code_passes_not_a_number_on(compiled_operations):
    z = np.empty(len(_OPERATIONS))
    compiled_operations(np.array([np.nan]), np.array([1.0]), z)
    by_name = dict(zip(_OPERATIONS, z, strict=True))
    assert all(np.isnan(by_name[name]) for name in ("sum", "exp", "tanh", "root", "log", "power", "angle"))


def adding():
    """What adds up, by a factor."""
    x, u, p = ca.SX.sym("x", 2), ca.SX.sym("u", 1), ca.SX.sym("p", 1)
    graph = Graph(x, u, p, ca.vertcat(x[0] + p * u, x[0] * 0.5 + x[1]), x[0] + x[1] + u)
    return Recursion(("a", "b"), ("u",), ("p",), ("y",), lambda: graph)


def test_a_recursion_that_is_taken_sample_by_sample_is_the_same():
    recursion, state, alone = adding(), np.zeros(2), np.zeros(2)
    inputs, factor = np.random.default_rng(1).standard_normal((20, 1)), np.array([0.3])
    stepper = Stepper(recursion, factor, state)
    first, second = inputs[:10], inputs[10:]
    said = [float(stepper.step(row)[0]) for row in first]
    assert said == replay(recursion, first, factor, alone)[:, 0].tolist()
    assert state.tolist() == alone.tolist(), "the state is the caller's"
    factor[0] = 0.7
    stepper.prepare()
    said = [float(stepper.step(row)[0]) for row in second]
    assert said == replay(recursion, second, factor, alone)[:, 0].tolist()


@dataclass(frozen=True, kw_only=True)
class Sums:
    a: ca.SX = leaf("1")
    b: ca.SX = leaf("1")


def test_a_live_recursion_takes_another_parameter_and_another_state():
    live = Live(adding(), Sums(), [0.3])
    assert live.step([1.0]) == [1.0]
    live.set_parameter(0, 0.7)
    assert live.step([1.0]) == [pytest.approx(1.3)]
    assert live.state == {"a": pytest.approx(1.0), "b": pytest.approx(0.15)}
    live.set("a", 2.0)
    assert live.step([0.0]) == [pytest.approx(2.15)]
    live.state = {"a": 5.0, "b": 0.0}
    assert live.step([0.0]) == [5.0]


def test_a_recursion_steps_the_same_alone_and_in_a_row():
    recursion = adding()
    inputs = np.random.default_rng(0).standard_normal((50, 1))
    state, alone = np.zeros(2), np.zeros(2)
    together = replay(recursion, inputs, np.array([0.3]), state)
    single = [replay(recursion, row[None], np.array([0.3]), alone)[0] for row in inputs]
    np.testing.assert_array_equal(together, np.array(single))
    np.testing.assert_array_equal(state, alone)
    function = recursion.function()
    y = np.zeros(2)
    for row, out in zip(inputs, together, strict=True):
        y, expected = function(y, row, 0.3)
        assert float(expected) == pytest.approx(out[0], abs=1e-12)


def seldom():
    """A recursion in which much is done seldom: one sample in ten, by its input."""
    x, u, p = ca.SX.sym("x", 2), ca.SX.sym("u", 1), ca.SX.sym("p", 2)
    long = x[0]
    for k in range(40):
        long = ca.exp(-long * long) + p[1] * ca.sqrt(1.0 + k + x[1] ** 2)
    now = u > 0.9
    chosen = ca.if_else(now, long, x[0] * 0.5 + u)
    other = ca.if_else(now, 2.0 * long, x[1])
    new = ca.vertcat(chosen, 0.9 * other + p[0] * u)
    return Recursion(
        ("a", "b"), ("u",), ("p", "q"), ("y", "z"), lambda: Graph(x, u, p, new, ca.vertcat(chosen - x[1], other))
    )


@pytest.mark.parametrize("runs", [1, 3, 8, 19])
def test_runs_that_are_replayed_side_by_side_are_as_alone(runs):
    recursion, rng = seldom(), np.random.default_rng(runs)
    graph = recursion.graph
    function = ca.Function("f", [graph.x, graph.u, graph.p], [graph.output], {"cse": True})
    assert any(isinstance(item, Branch) for item in schedule(graph_of(instructions(function))))
    inputs = [rng.random((length, 1)) for length in rng.integers(0, 60, runs)]
    parameters, states = rng.random((runs, 2)), rng.random((runs, 2))
    first = states.copy()
    found = replay_many(recursion, inputs, parameters, states)
    np.testing.assert_array_equal(states, first)
    for k, rows in enumerate(inputs):
        np.testing.assert_allclose(found[k], replay(recursion, rows, parameters[k], states[k].copy()), rtol=1e-12)
        (alone,) = replay_many(recursion, [rows], parameters[k], states[k : k + 1])
        np.testing.assert_array_equal(found[k], alone)
        (kept,) = replay_many(recursion, [rows], parameters[k], states[k : k + 1], ["z"])
        np.testing.assert_array_equal(kept[:, 0], alone[:, 1])


def test_no_runs_are_replayed_to_none():
    assert replay_many(seldom(), [], np.zeros(2), np.zeros((0, 2))) == ()
