"""Damaged save slots of exported C, compiled here, and power lost anywhere: resumed, the log goes on.

Where there is no C compiler there is no such section.
"""

from __future__ import annotations

import ctypes
import struct
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from harness import READ, REFUSED, WARNED, WRONG, Rng, Section
from judge import START, WORK_DAY, Judge
from slots import History
from states import chosen

from ramsight.deploy.compiler import STRICT, find_compiler, library

CASES = 20_000
_TRACKED = 500  # samples, 10 s
_STATES_AT = 16
_RESUMED, _OLDER = 1, 2

_DRIVER = """
#include <math.h>
#include <string.h>
#include "ramsight_boom.h"

int bytes_of_a_slot(void) { return RAMSIGHT_BOOM_BYTES; }

static void take(ramsight_boom *sensor, const double *row, ramsight_boom_outputs *out) {
  ramsight_boom_inputs in;
  in.time = row[0];
  in.motor_speed = (ramsight_boom_real)row[1];
  in.motor_torque = (ramsight_boom_real)row[2];
  in.oil_temperature = (ramsight_boom_real)row[3];
  ramsight_boom_step(sensor, &in, out);
}

/* Follow a log; which slot is to be written after each sample, and with what. */
void follow(long count, const double *rows, double start, int *slots, unsigned char *bytes) {
  static ramsight_boom sensor;
  ramsight_boom_outputs out;
  ramsight_boom_resume(&sensor, 7, NULL, NULL);
  ramsight_boom_start(&sensor, (ramsight_boom_real)start, (ramsight_boom_real)1e-3);
  for (long k = 0; k < count; k++, rows += 4, bytes += RAMSIGHT_BOOM_BYTES) {
    take(&sensor, rows, &out);
    slots[k] = ramsight_boom_keep(&sensor, k + 1 < count && fabs(rows[5]) >= 1.0, bytes);
  }
}

/* Resume two slots and follow a log: position, deviation and status after each sample; what was resumed. */
int resume(const unsigned char *slot_0, const unsigned char *slot_1, long count, const double *rows, double *said) {
  static ramsight_boom sensor;
  ramsight_boom_outputs out;
  memset(&sensor, 0x5A, sizeof sensor);
  const int resumed = (int)ramsight_boom_resume(&sensor, 7, slot_0, slot_1);
  for (long k = 0; k < count; k++, rows += 4, said += 3) {
    take(&sensor, rows, &out);
    said[0] = (double)out.position;
    said[1] = (double)out.position_std;
    said[2] = (double)out.status;
  }
  return resumed;
}
"""


@dataclass
class Prepared:
    """What the cases share."""

    judge: Judge  # who knows the truth
    rows: Any  # time, speed, torque, temperature of the log
    built: list[tuple[Any, History]]  # in double and in float: the functions above, and what the slots held


def prepare(folder: Path) -> Prepared:
    """Compile the C in either precision and follow the work day with it."""
    from ramsight.deploy.c_sensor import sensor_source

    compiler, judge, built = find_compiler() or "", Judge(WORK_DAY), []
    names = ("time", "motor_speed", "motor_torque", "oil_temperature")
    rows = np.ascontiguousarray(np.column_stack([judge.log[name].values for name in names]))
    for single in (False, True):
        source = sensor_source(judge.sensor, judge.unit, "ramsight_boom", "mining-loader", single=single)
        target = folder / f"slots{int(single)}.so"
        files = {name: text for name, text in source.files.items() if not name.endswith("_test.c")}
        library(compiler, {**files, "driver.c": _DRIVER}, target, *STRICT)
        compiled = ctypes.CDLL(str(target))
        built.append((compiled, _followed(compiled, rows, 4 if single else 8)))
    return Prepared(judge, rows, built)


def _followed(compiled: Any, rows: Any, real: int) -> History:
    size = compiled.bytes_of_a_slot()
    slots, content = (ctypes.c_int * len(rows))(), ctypes.create_string_buffer(len(rows) * size)
    compiled.follow(ctypes.c_long(len(rows)), _table(rows), ctypes.c_double(START), slots, content)
    erased = b"\xff" * size
    pairs, samples = [(erased, erased)], [-1]
    for k, slot in enumerate(slots):
        if slot >= 0:
            new, (zero, one) = content.raw[k * size : (k + 1) * size], pairs[-1]
            pairs.append((new, one) if slot == 0 else (zero, new))
            samples.append(k)
    return History(pairs, samples, lambda slot, value, rng: _sealed(slot, value, rng, real))


def _sealed(slot: bytes, value: float, rng: Rng, real: int) -> bytes:
    """States of the struct: doubles first, then reals; most are reals."""
    content = bytearray(slot[:-4])
    count = (len(content) - _STATES_AT) // real
    place = _STATES_AT + real * int(rng.integers(count))
    with np.errstate(over="ignore"):
        content[place : place + real] = np.array(value, dtype=f"<f{real}").tobytes()
    return bytes(content) + struct.pack("<I", zlib.crc32(content))


def _check(prepared: Prepared, rng: Rng, folder: Path) -> tuple[str, str]:
    compiled, history = prepared.built[int(rng.integers(2))]
    size, count = compiled.bytes_of_a_slot(), len(prepared.rows)
    sample, pair = chosen(history, count, rng)
    slots = [slot[:size].ljust(size, b"\xff") for slot in pair]
    given = [None if rng.random() < 0.02 else ctypes.create_string_buffer(slot, size) for slot in slots]
    rows = prepared.rows[sample : sample + _TRACKED]
    said = np.empty((len(rows), 3))
    resumed = compiled.resume(*given, ctypes.c_long(len(rows)), _table(rows), _table(said))
    position, std, status = said.T
    if wrong := prepared.judge.silent(rows[:, 0], position, std, status):
        return WRONG, f"power lost at sample {sample}: {wrong}"
    usable = status < _not_referenced()
    if not np.isfinite(said[usable]).all():
        return WRONG, f"power lost at sample {sample}: no number with a usable status"
    return {_RESUMED: READ, _OLDER: WARNED}.get(resumed, REFUSED), ""


def _not_referenced() -> int:
    from ramsight.sensor.status import Status

    return int(Status.NOT_REFERENCED)


def _table(array: Any) -> Any:
    return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


SECTIONS = [Section("C slots", CASES, prepare, _check)] if find_compiler() else []
