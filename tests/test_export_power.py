"""Exported C and power that goes: at every step of a log, in the middle of a write, with starts that cannot be."""

import ctypes
import math
import re
import subprocess
from pathlib import Path
from string import Template

import numpy as np
import pytest

from ramsight import machine
from ramsight.deploy.c_folder import write_sensor
from ramsight.deploy.c_sensor import sensor_source
from ramsight.deploy.compiler import STRICT, find_compiler, library
from ramsight.logs import read_log, read_truth
from ramsight.sensor.kalman import kalman
from ramsight.sensor.status import Status

COMPILER = find_compiler()
pytestmark = [pytest.mark.slow, pytest.mark.skipif(COMPILER is None, reason="there is no C compiler")]
LOADER = machine.load_machine("mining-loader")

NOTHING, RESUMED, OLDER, MOVED = range(4)
BEFORE, ERASED, TORN, WRITTEN = range(4)
"""When the power goes: before a slot is touched, once it is erased, half written, written."""

DRIVER = """
#include <math.h>
#include <string.h>
#include "ramsight_boom.h"

static void look(unsigned char slots[2][RAMSIGHT_BOOM_BYTES], const double *row, double *out) {
  ramsight_boom again;
  ramsight_boom_inputs in;
  ramsight_boom_outputs said;
  *out++ = (double)ramsight_boom_resume(&again, 7, slots[0], slots[1]);
  in.time = 0.0;
  in.motor_speed = 0;
  in.motor_torque = (ramsight_boom_real)row[2];
  in.oil_temperature = (ramsight_boom_real)row[3];
  ramsight_boom_step(&again, &in, &said);
  *out++ = (double)said.status;
  *out++ = (double)said.position;
  *out++ = (double)said.position_std;
}

/* Go through a log; at each step the power goes in four ways, and comes back: outcome, status, position, deviation. */
int power(long count, const double *rows, double start, int announced, double *out, double *writes) {
  static unsigned char slots[2][RAMSIGHT_BOOM_BYTES], before[2][RAMSIGHT_BOOM_BYTES], bytes[RAMSIGHT_BOOM_BYTES];
  ramsight_boom sensor;
  ramsight_boom_inputs in;
  ramsight_boom_outputs said;
  memset(slots, 0xFF, sizeof slots);
  ramsight_boom_resume(&sensor, 7, slots[0], slots[1]);
  if (!ramsight_boom_start(&sensor, (ramsight_boom_real)start, (ramsight_boom_real)1e-3)) return 0;
  for (long k = 0; k < count; k++, rows += 5, out += 16) {
    in.time = rows[0];
    in.motor_speed = (ramsight_boom_real)rows[1];
    in.motor_torque = (ramsight_boom_real)rows[2];
    in.oil_temperature = (ramsight_boom_real)rows[3];
    ramsight_boom_step(&sensor, &in, &said);
    const int starts = announced && k + 1 < count && fabs(rows[6]) >= 1.0;
    const int slot = ramsight_boom_keep(&sensor, starts, bytes);
    memcpy(before, slots, sizeof slots);
    look(slots, rows, out);
    if (slot >= 0) memset(slots[slot], 0xFF, sizeof slots[slot]);
    look(slots, rows, out + 4);
    if (slot >= 0) {
      memcpy(slots[slot], bytes, sizeof bytes / 2);
      memcpy(slots[slot] + sizeof bytes / 2, before[slot] + sizeof bytes / 2, sizeof bytes - sizeof bytes / 2);
    }
    look(slots, rows, out + 8);
    if (slot >= 0) memcpy(slots[slot], bytes, sizeof bytes);
    look(slots, rows, out + 12);
    writes[k] = slot;
  }
  return 1;
}

int zeroed(void) {
  static ramsight_boom sensor;
  ramsight_boom_inputs in = {0};
  ramsight_boom_outputs out;
  unsigned char bytes[RAMSIGHT_BOOM_BYTES];
  ramsight_boom_step(&sensor, &in, &out);
  return ramsight_boom_keep(&sensor, 0, bytes) == -1 && out.position != out.position ? (int)out.status : -1;
}

int started(double position, double std, double reference, double *out) {
  ramsight_boom sensor;
  ramsight_boom_inputs in = {0};
  ramsight_boom_outputs said;
  memset(&sensor, 0x5A, sizeof sensor);
  const int taken = ramsight_boom_start(&sensor, (ramsight_boom_real)position, (ramsight_boom_real)std);
  in.motor_torque = 20;
  in.oil_temperature = 313;
  ramsight_boom_reference(&sensor, (ramsight_boom_real)reference);
  for (int k = 0; k < 50; k++) {
    in.time = 0.02 * k;
    ramsight_boom_step(&sensor, &in, &said);
  }
  out[0] = (double)said.status;
  out[1] = (double)said.position;
  out[2] = (double)said.position_std;
  return taken;
}
"""


@pytest.fixture(scope="module", params=["double", "float"])
def driver(request, boom, tmp_path_factory):
    """The C of the boom with the functions above."""
    source = sensor_source(kalman(boom), boom, "ramsight_boom", "mining-loader", single=request.param == "float")
    target = tmp_path_factory.mktemp("power") / "boom.so"
    library(COMPILER, {**source.files, "driver.c": DRIVER}, target, *STRICT)
    return ctypes.CDLL(str(target))


def table(array):
    return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


@pytest.mark.parametrize("announced", [True, False])
def test_power_lost_at_any_step_leaves_a_right_position_or_none(driver, boom, trace, announced):
    case = trace("boom_asbuilt1_workday")
    log, truth = read_log(case.log), read_truth(case.truth)["position"].values
    names = ("time", "motor_speed", "motor_torque", "oil_temperature")
    rows = np.column_stack([*(log[name].values for name in names), np.full(log.sizes["time"], np.nan)])
    count = len(rows)
    out, writes = np.empty((count, 4, 4)), np.empty(count)
    arguments = (ctypes.c_long(count), table(rows), ctypes.c_double(truth[0]), ctypes.c_int(announced))
    assert driver.power(*arguments, table(out), table(writes))
    outcome, status, position, std = np.moveaxis(out, 2, 0)
    after = np.append(truth[1:], truth[-1])[:, None]  # where the piston is a sample later
    error = np.maximum(np.abs(position - truth[:, None]), np.abs(position - after))
    usable = status < Status.NOT_REFERENCED
    assert (usable == (outcome == RESUMED)).all()
    assert (error <= 4.0 * std + 1e-3)[usable].all()
    sensor = kalman(boom)
    sensor.start(float(truth[0]))
    followed = sensor.track(log)
    said = followed["position"].values[:, None]
    assert np.abs(position - said)[usable].max() < 0.5e-3, "what the sensor said while it had power"

    # At rest for longer than a second it is there; while the motor turns it is not, but for the first samples.
    turning = np.abs(rows[:, 1]) >= 1.0
    place, moving = np.arange(count), turning | (np.abs(followed["velocity"].values) >= 1e-4)
    since = place - np.maximum.accumulate(np.where(moving, place, -1))
    to_go = np.minimum.accumulate(np.where(turning, place, count)[::-1])[::-1] - place
    rests = (since > 55) & (to_go > 3) & (place > 55)
    assert rests.sum() > 300
    assert (outcome[rests][:, WRITTEN] == RESUMED).all()
    assert not usable[turning & np.roll(turning, 2)].any()
    assert (writes >= 0).sum() < 4 * 20 + 2, "two writes a movement"


def test_a_struct_that_was_never_made_says_so(driver):
    assert driver.zeroed() == Status.STATE_INVALID


def started(driver, position, std=1e-3, reference=math.nan):
    out = np.empty(3)
    numbers = map(ctypes.c_double, (position, std, reference))
    return driver.started(*numbers, table(out)), Status(int(out[0])), out[1], out[2]


@pytest.mark.parametrize(
    ("position", "std"),
    [(math.nan, 1e-3), (math.inf, 1e-3), (-math.inf, 1e-3), (5.0, 1e-3), (-0.1, 1e-3),
     (0.2, math.nan), (0.2, math.inf), (0.2, -1e-3), (0.2, 0.8)],
)  # fmt: skip
def test_a_start_that_cannot_be_is_refused(driver, position, std):
    taken, status, said, _ = started(driver, position, std)
    assert (taken, status) == (0, Status.NOT_REFERENCED)
    assert math.isnan(said)


def test_a_start_that_can_be_is_taken_and_a_reference_of_no_number_is_none(driver):
    for reference in (math.nan, math.inf, -math.inf):
        taken, status, position, std = started(driver, 0.2, reference=reference)
        assert (taken, status) == (1, Status.REFERENCE_DUE), "an entered position may be wrong"
        assert position == pytest.approx(0.2, abs=2e-5)
        assert 0.0 < std < 5e-3


def test_the_main_loop_of_the_page_compiles(boom, tmp_path):
    page = (Path(__file__).parent.parent / "docs" / "how-to" / "c-firmware.md").read_text(encoding="utf-8")
    loop, *_ = re.findall(r"```c\n(.*?)```", page, flags=re.DOTALL)
    source = sensor_source(kalman(boom), boom, "ramsight_boom", "mining-loader", single=False)
    library(COMPILER, {**source.files, "loop.c": loop}, tmp_path / "loop.so", *STRICT, "-O0")


# ---- golden samples ----------------------------------------------------------------------------------------------

STUB = Template("""
#include "ramsight_boom.h"
#include <math.h>
#include "stub_golden.h"
static int at;
void ramsight_boom_init(ramsight_boom *s) { (void)s; }
int ramsight_boom_start(ramsight_boom *s, ramsight_boom_real p, ramsight_boom_real d) {
  (void)s; (void)p; (void)d; at = 0; return 1;
}
void ramsight_boom_reference(ramsight_boom *s, ramsight_boom_real p) { (void)s; (void)p; }
int ramsight_boom_keep(ramsight_boom *s, int starts, unsigned char *bytes) {
  (void)s; (void)starts; (void)bytes; return -1;
}
ramsight_boom_resumed ramsight_boom_resume(ramsight_boom *s, uint32_t instance, const unsigned char *a,
                                           const unsigned char *b) {
  (void)s; (void)instance; (void)a; (void)b; return RAMSIGHT_BOOM_NOTHING;
}
void ramsight_boom_step(ramsight_boom *s, const ramsight_boom_inputs *in, ramsight_boom_outputs *out) {
  const double *row = golden_out[at++ % GOLDEN];
  (void)s; (void)in;
  out->position = (ramsight_boom_real)row[0];
  out->position_std = (ramsight_boom_real)row[1];
  out->velocity = (ramsight_boom_real)row[2];
  out->load = (ramsight_boom_real)row[3];
  out->status = (ramsight_boom_status)row[4];
  $wrong
}
""")


@pytest.mark.parametrize("single", [0, 1])
@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ("if (at % 2) out->position = NAN;", "1000 missing"),
        ("if (at == 7) out->position = INFINITY;", "1 missing"),
        ("if (at == 7) out->load = NAN;", "1 missing"),
        ("out->status = RAMSIGHT_BOOM_OK;", r"[1-9]\d+ other statuses"),
        ("if (at == 7) out->position += (ramsight_boom_real)1e-3;", "difference 0.001 m"),
        ("if (at == 7) out->position_std += (ramsight_boom_real)1e-3;", "difference 0.001 m"),
        ("", "slots BAD"),
    ],
)
def test_golden_samples_that_differ_in_anything_fail(golden_folder, tmp_path, wrong, says, single):
    for file in ("ramsight_boom.h", "ramsight_boom_golden.h", "ramsight_boom_test.c"):
        (tmp_path / file).write_text((golden_folder / file).read_text())
    golden = (golden_folder / "ramsight_boom_golden.h").read_text()
    (tmp_path / "stub_golden.h").write_text(golden)
    (tmp_path / "stub.c").write_text(STUB.substitute(wrong=wrong))
    flags = ["-std=c99", f"-DRAMSIGHT_BOOM_FLOAT={single}", "-DROUNDS=1", "-w"]
    subprocess.run(
        [COMPILER, *flags, "stub.c", "ramsight_boom_test.c", "-lm", "-o", "golden"], cwd=tmp_path, check=True
    )
    ran = subprocess.run([str(tmp_path / "golden")], capture_output=True, text=True, check=False)
    assert ran.returncode == 1
    assert "FAILED" in ran.stdout
    assert re.search(says, ran.stdout)


@pytest.fixture(scope="module")
def golden_folder(tmp_path_factory):
    return write_sensor(LOADER, "boom", tmp_path_factory.mktemp("golden") / "boom", compiler="").folder
