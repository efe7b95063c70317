"""The update of a covariance in floats: it stays one, however much better a measurement is than what is known."""

import casadi as ca
import numpy as np
import pytest

from ramsight.deploy.compiler import find_compiler
from ramsight.sensor.covariance import Covariance

NAMES = ["position", "leakage", "low"]
PAIRS = [(i, j) for k, i in enumerate(NAMES) for j in NAMES[k:]]
ROW = {"position": 1.0, "leakage": 0.3, "low": -1.0}
TWO = {
    ca.OP_ADD: np.add, ca.OP_SUB: np.subtract, ca.OP_MUL: np.multiply, ca.OP_DIV: np.divide, ca.OP_FMIN: np.fmin,
}  # fmt: skip
ONE = {ca.OP_SQ: np.square, ca.OP_NEG: np.negative, ca.OP_TWICE: lambda x: x + x, ca.OP_INV: np.reciprocal}


def updated(covariance, row, variance):
    return covariance.updated(row, 0.0, variance, True)[0]


def plain(covariance, row, variance):
    """P - K H P, which is the same in numbers of any length."""
    cross = {i: sum(covariance[i, j] * row[j] for j in row) for i in NAMES}
    total = sum(row[i] * cross[i] for i in row) + variance
    return Covariance({(i, j): covariance[i, j] - cross[i] / total * cross[j] for i, j in PAIRS})


@pytest.mark.parametrize("follows", [0.0, 1.0])
def test_a_quantity_that_the_first_follows_is_as_unsure_as_both(follows):
    before = Covariance({pair: ca.SX(value) for pair, value in zip(PAIRS, (4.0, 0.5, 0.3, 1.0, 0.2, 2.0), strict=True)})
    after = before.tied("low", 3.0, follows)
    found = {pair: float(ca.evalf(ca.SX(after[pair]))) for pair in PAIRS}
    expected = {("position", "position"): 4.0 + 9.0 * follows, ("position", "low"): 9.0 * follows, ("low", "low"): 9.0}
    expected |= {("position", "leakage"): 0.5, ("leakage", "leakage"): 1.0, ("leakage", "low"): 0.0}
    assert found == expected


def in_floats(update):
    """A function of the entries and the variance whose every operation is rounded to single precision."""
    entries, variance = ca.SX.sym("p", len(PAIRS)), ca.SX.sym("r")
    after = update(Covariance({pair: entries[k] for k, pair in enumerate(PAIRS)}), ROW, variance)
    function = ca.Function("update", [entries, variance], [ca.vertcat(*(after[pair] for pair in PAIRS))])

    def run(values, noise):
        work, result = [np.float32(0.0)] * function.sz_w(), np.zeros(len(PAIRS))
        for k in range(function.n_instructions()):
            code, into, of = function.instruction_id(k), function.instruction_output(k), function.instruction_input(k)
            if code == ca.OP_INPUT:
                work[into[0]] = np.float32(values[of[1]] if of[0] == 0 else noise)
            elif code == ca.OP_OUTPUT:
                result[into[1]] = work[of[0]]
            elif code == ca.OP_CONST:
                work[into[0]] = np.float32(function.instruction_constant(k))
            elif code in ONE:
                work[into[0]] = np.float32(ONE[code](work[of[0]]))
            else:
                work[into[0]] = np.float32(TWO[code](work[of[0]], work[of[1]]))
        return result

    return run


def least(values):
    """The least eigenvalue of the correlations."""
    matrix = np.zeros((len(NAMES), len(NAMES)))
    for (i, j), value in zip(PAIRS, values, strict=True):
        matrix[NAMES.index(i), NAMES.index(j)] = matrix[NAMES.index(j), NAMES.index(i)] = value
    scale = np.sqrt(np.diag(matrix))
    return np.linalg.eigvalsh(matrix / np.outer(scale, scale)).min() if (np.diag(matrix) > 0.0).all() else -1.0


def worst(update, tries=300):
    rng, run, found = np.random.default_rng(1), in_floats(update), []
    for _ in range(tries):
        root = rng.normal(size=(3, 3)) * np.array([[0.7], [0.15], [2e-4]])
        start = root @ root.T
        values = [start[NAMES.index(i), NAMES.index(j)] for i, j in PAIRS]
        found.append(least(run(values, float(10.0 ** rng.uniform(-9.0, -4.0)))))
    return min(found)


def test_a_covariance_of_floats_stays_one_where_a_measurement_is_far_better():
    assert worst(updated) > -1e-5


def test_the_plain_form_would_not():
    assert worst(plain) < -5e-5


@pytest.mark.slow
@pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")
def test_exported_c_of_floats_keeps_every_covariance_under_hostile_samples(tmp_path, script, monkeypatch):
    covariance = script("covariance", "fuzz")
    monkeypatch.setattr(covariance, "MARGIN", {"float": covariance.MARGIN["float"]})  # doubles are in make fuzz
    prepared = covariance.prepare(tmp_path, optimised=False)
    for seed in (2, 4):  # the plain form fails in them
        assert covariance.tried(prepared, "float", seed, 30_000)[0] < covariance.MARGIN["float"]
