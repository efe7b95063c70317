"""Loops in machine code do what their Python does."""

import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ramsight.engine.cache import generated_module
from ramsight.engine.terms import LoopError

_CONSTANTS = {"N": 5, "HALF": 0.5}
_LOOPS = '''
FIRST, LAST = -1, 7

def counted(x, out):
    """Ranges with a beginning, a step, and none; a count that is changed inside."""
    for k in range(2, x.shape[0]):
        out[k] = out[k - 1] + x[k]
    for k in range(0, len(x), 3):
        out[k] += 1
        k = 100
        out[0] += k

def searched(x, limit, out):
    k, found = 0, FIRST
    while True:
        if k >= x.shape[0]:
            break
        k += 1
        if x[k - 1] < limit:
            continue
        found = k - 1
        break
    out[0] = found
    while k > 0 and x[k - 1] > limit or k == LAST:
        k -= 1
        if k == 3:
            return 33
    return k

def chosen(a, b, out):
    out[0], out[1] = max(a, b), min(a, b)
    out[2] = a if a > b else b - a
    out[3] = -abs(a) * HALF / 4
    out[4] = int(a) * 2
    several = a != b
    out[5] = out[6] = 1.0 if several else 0.0
    if not np.isfinite(b):
        out[7] = 1.0
    elif b <= 0.0:
        out[7] = 2.0
    else:
        out[7] = 3.0

def made(x, whole, out):
    a, b, c = np.zeros(N), np.ones(N), np.full((2, N), HALF)
    n, m = np.zeros(N, np.int64), np.full(N, LAST)
    for i in range(N):
        a[i] += x[1, i]
        n[i] = whole[i] * m[i]
        c[1, i] = a[i] + n[i] * b[i]
    row, rest = x[0], x[1, 2:]
    for i in range(N):
        out[i] = c[0, i] + c[1, i] + row[i]
    for i in range(rest.shape[0]):
        out[i] += 10 * rest[i]

def stepped(x, k, out):
    i = 1
    for j in range(x.shape[0]):
        if x[j] > 0.0:
            step(j, x[j:], out)
        k += i
    out[0] = k

def step(k, x, out):
    """It has names of its own, and its caller's arrays."""
    i = k
    for j in range(x.shape[0]):
        if x[j] < 0.0:
            break
        i += 1
        out[k] += x[j]
    k = i
    out[7] += k
'''


@pytest.fixture(scope="module")
def both():
    """The loops as machine code, and as Python."""
    scope = {"np": np, **_CONSTANTS}
    exec(_LOOPS, scope)
    return generated_module({}, _CONSTANTS, _LOOPS), scope


def same(both, name, *arguments, size=8):
    compiled, python = both
    found, expected = np.zeros(size), np.zeros(size)
    returned = getattr(compiled, name)(*arguments, found), python[name](*arguments, expected)
    np.testing.assert_array_equal(found, expected)
    assert returned[0] == (returned[1] or 0)


NUMBERS = st.floats(-5.0, 5.0)


@given(x=st.lists(NUMBERS, min_size=2, max_size=8))
def test_ranges_count_as_pythons(both, x):
    same(both, "counted", np.array(x))


@given(x=st.lists(st.integers(-3, 3), max_size=9), limit=st.integers(-3, 3))
def test_a_loop_is_left_and_gone_on_with(both, x, limit):
    same(both, "searched", np.array(x, dtype=float), float(limit))


@given(a=NUMBERS, b=st.one_of(NUMBERS, st.sampled_from([np.inf, np.nan])), equal=st.booleans())
def test_choices_are_pythons(both, a, b, equal):
    same(both, "chosen", a, a if equal else b)


def test_arrays_that_a_loop_makes_begin_anew_each_time(both):
    x, whole = np.random.default_rng(1).random((2, 5)), np.arange(5)
    for _ in range(2):
        same(both, "made", x, whole)


@given(x=st.lists(NUMBERS, min_size=1, max_size=6), k=st.floats(0.0, 5.0))
def test_a_step_of_a_loop_has_names_of_its_own_and_the_arrays_of_its_caller(both, x, k):
    same(both, "stepped", np.array(x), k)


def test_a_step_that_returns_is_an_error():
    module = generated_module({}, {}, "def loop(x):\n    step(x)\n\ndef step(x):\n    return\n")
    with pytest.raises(LoopError, match="a step of a loop returns: step"):
        module.loop(np.ones(3))


def test_threads_have_their_own_arrays(both):
    """Machine code runs without the interpreter's lock."""
    compiled, _ = both
    whole = np.zeros(5, np.int64)
    wrong = []

    def work(seed):
        x, out, first = np.full((2, 5), float(seed)), np.zeros(5), np.zeros(5)
        compiled.made(x, whole, first)
        for _ in range(3000):
            out[:] = 0.0
            compiled.made(x, whole, out)
            if not np.array_equal(out, first):
                wrong.append(seed)

    threads = [threading.Thread(target=work, args=(seed,)) for seed in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []


@pytest.mark.parametrize(
    "line",
    [
        "x[:] = out", "x[0] = out", "x[1:2] = out", "x.y = 1", "k = x[0, 1]", "k = x[:2]", "k = x.T", "k = x[1] ** 2",
        "k = 3 // 2", "k = ~3", "k = 0 < x[0] < 1", "k = sum(x)", "k = 'text'", "k = missing", "k = 1\n    k = 2.5",
        "print(x)", "unknown(x)", "(lambda: 1)()", "for k in x: pass", "with x: pass",
    ],
)  # fmt: skip
def test_what_is_not_known_is_an_error(line):
    module = generated_module({}, {}, f"def loop(x, out):\n    {line}\n")
    with pytest.raises(LoopError):
        module.loop(np.ones(3), np.ones(3))


def test_a_name_that_nothing_has_is_an_error():
    with pytest.raises(AttributeError, match="nothing"):
        _ = generated_module({}, {}, "").nothing
