"""Both FMI interfaces refuse pointers to nothing, variables that are none and damaged states.

`make fuzz` calls whole FMUs so. Here a model of three variables is behind the interface, for which a compiler needs
less than a second.
"""

import ctypes

import numpy as np
import pytest

from ramsight.deploy.c_function import template
from ramsight.deploy.compiler import STRICT, find_compiler, library

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="there is no C compiler")
TOKEN = "{three}"
CONFIG = f"""
#define TOKEN "{TOKEN}"
#define REALS 3
#define WHOLES 1
#define TRUTHS 1
#define HAS_TIME 1
#define TOLERANCE 1e-6
typedef struct {{ double sum; }} Memory;
"""
MODEL = """
#include "fmu.h"
const char *const causality = "oiooi";
void model_start(Model *m) { m->real[1] = 1.0; }
void model_unknown(Model *m) { m->whole[0] = 9; }
const char *model_initialize(Model *m) { m->real[2] = m->memory.sum = 0.0; return (void *)0; }
const char *model_step(Model *m, double time, double step) {
  (void)time;
  m->real[2] = m->memory.sum += m->real[1] * step;
  return (void *)0;
}
"""


@pytest.fixture(params=(2, 3))
def small(request, tmp_path, script):
    """An FMU's interface with little behind it."""
    Library = script("fmu_pointers", "fuzz").Library
    names = ("fmu.h", "fmi_common.h", f"fmi{request.param}.h", f"fmi{request.param}.c")
    files = {name: template(name) for name in names} | {"fmu_config.h": CONFIG, "model.c": MODEL}
    library(find_compiler(), files, tmp_path / "small.so", *STRICT)
    return Library(request.param, ctypes.CDLL(str(tmp_path / "small.so")), TOKEN.encode(), 5)


def test_calls_without_what_they_need_are_errors(small):
    from fmu_pointers import played

    refused = 0
    for seed in range(200):
        wrong, count = played(small, np.random.default_rng(seed))
        assert not wrong
        refused += count
    assert refused > 1000


def test_what_is_there_is_still_answered(small):
    one = ctypes.c_void_p(small.instance(b"one", small.token))
    state, size = ctypes.c_void_p(), ctypes.c_size_t(small.state_size)
    bytes_ = ctypes.create_string_buffer(small.state_size)
    assert small.call(small.spelled("GetFMUState"), one, ctypes.byref(state)) == 0
    assert small.call(small.spelled("SerializeFMUState"), one, state, bytes_, size) == 0
    assert small.call(small.spelled("DeserializeFMUState"), one, bytes_, size, ctypes.byref(state)) == 0
    assert small.call(small.spelled("SetFMUState"), one, state) == 0
    for _ in range(2):
        assert small.call(small.spelled("FreeFMUState"), one, ctypes.byref(state)) == 0
    assert small.call(small.spelled("SetFMUState"), one, state) == 3, "it was freed"
    small.free(one.value)


def test_a_state_of_a_phase_that_is_none_is_refused(small):
    """Its sum is right, so somebody has made it: the names of phases are looked up by it."""
    from fmu_pointers import sum_of

    one = ctypes.c_void_p(small.instance(b"one", small.token))
    state, made = ctypes.c_void_p(), ctypes.c_void_p()
    kept = ctypes.create_string_buffer(small.state_size)
    size = ctypes.c_size_t(small.state_size)
    small.call(small.spelled("GetFMUState"), one, ctypes.byref(state))
    small.call(small.spelled("SerializeFMUState"), one, state, kept, size)
    data = bytearray(kept.raw)
    data[-24:-20] = (1000).to_bytes(4, "little")  # before the time and the sum
    data[-8:] = sum_of(data[:-8])
    assert small.call(small.spelled("DeserializeFMUState"), one, bytes(data), size, ctypes.byref(made)) == 3
    assert made.value is None
    small.call(small.spelled("FreeFMUState"), one, ctypes.byref(state))
    small.free(one.value)
