"""A clock whose rate changes while the machine moves: in Python, exported C of doubles and floats, FMI 2.0 and 3.0.

The samples of a work day come with times that are a tenth to five times as far apart as they were, for half a second to
ten. The position may not be ok and wrong for more than half a second.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import long_day
import numpy as np
from harness import READ, WRONG, Rng, Section
from judge import LASTING, Judge
from soak import silent

from ramsight.deploy.compiler import STRICT, find_compiler, library

CASES = 300
_RATES, _LASTS = (0.1, 5.0), (0.5, 10.0)  # 1, s
_PERIOD = 0.02  # s
_MOVES = 30.0  # rad/s
_STD = 1e-3  # m, of the start
_NAMES = ("position", "position_std", "status")
_INPUTS = ("motor_speed", "motor_torque", "oil_temperature")

_DRIVER = """
#include "ramsight_boom.h"

/* Follow a log of time, speed, torque and temperature: position, deviation and status after each sample. */
void track(long count, const double *rows, double start, double std, double *said) {
  static ramsight_boom sensor;
  ramsight_boom_outputs out;
  ramsight_boom_init(&sensor);
  ramsight_boom_start(&sensor, (ramsight_boom_real)start, (ramsight_boom_real)std);
  for (long k = 0; k < count; k++, rows += 4, said += 3) {
    ramsight_boom_inputs in;
    in.time = rows[0];
    in.motor_speed = (ramsight_boom_real)rows[1];
    in.motor_torque = (ramsight_boom_real)rows[2];
    in.oil_temperature = (ramsight_boom_real)rows[3];
    ramsight_boom_step(&sensor, &in, &out);
    said[0] = (double)out.position;
    said[1] = (double)out.position_std;
    said[2] = (double)out.status;
  }
}
"""


@dataclass
class Prepared:
    """What the cases share."""

    rows: Any  # time, speed, torque and temperature of a work day
    true: Any  # position at each of them [m]
    # what follows such rows, by its name: position, deviation and status after each
    built: dict[str, Callable[[Any], Any]]


def prepare(folder: Path) -> Prepared:
    """The boom's sensor in all its forms."""
    day = long_day.prepare(folder)
    start, judge = day.true[0], day.judge
    built: dict[str, Callable[[Any], Any]] = {"Python": lambda rows: _stepped(judge, start, rows)}
    for precision in ("double", "float"):
        built[f"C of {precision}s"] = _compiled(judge, start, folder, precision)
    if find_spec("fmpy"):
        for fmi in (2, 3):
            built[f"FMI {fmi}.0"] = _fmu(start, folder, fmi)
    return Prepared(np.array(day.rows), np.array(day.true), built)


def _stepped(judge: Judge, start: float, rows: Any) -> Any:
    judge.sensor.start(start, _STD)
    found = [judge.sensor.step(*row) for row in rows.tolist()]
    return np.array([[getattr(one, name) for name in _NAMES] for one in found], dtype=float)


def _compiled(judge: Judge, start: float, folder: Path, precision: str) -> Callable[[Any], Any]:
    from ramsight.deploy.c_sensor import sensor_source

    single = precision == "float"
    source = sensor_source(judge.sensor, judge.unit, "ramsight_boom", "mining-loader", single=single)
    files = {name: text for name, text in source.files.items() if not name.endswith("_test.c")}
    target = folder / f"rates_{precision}.so"
    library(find_compiler() or "", {**files, "driver.c": _DRIVER}, target, *STRICT)
    track = ctypes.CDLL(str(target)).track

    def follow(rows: Any) -> Any:
        rows, said = np.ascontiguousarray(rows), np.empty((len(rows), len(_NAMES)))
        table = ctypes.POINTER(ctypes.c_double)
        track(
            ctypes.c_long(len(rows)), rows.ctypes.data_as(table), ctypes.c_double(start), ctypes.c_double(_STD),
            said.ctypes.data_as(table),
        )  # fmt: skip
        return said

    return follow


def _fmu(start: float, folder: Path, fmi: int) -> Callable[[Any], Any]:
    import fmpy
    from fmpy.fmi2 import FMU2Slave, defaultCallbacks
    from fmpy.fmi3 import FMU3Slave

    from ramsight.deploy.fmu import write_fmu
    from ramsight.machine import load_machine

    written = write_fmu(load_machine("mining-loader"), "boom", folder / f"rates{fmi}.fmu", what="sensor", fmi=fmi)
    described = fmpy.read_model_description(str(written.path))
    fmu = (FMU2Slave if fmi == 2 else FMU3Slave)(
        guid=described.guid, unzipDirectory=fmpy.extract(str(written.path), unzipdir=str(folder / f"rates{fmi}")),
        instanceName="one", modelIdentifier=described.coSimulation.modelIdentifier,
    )  # fmt: skip
    fmu.instantiate(**({"loggingOn": False, "callbacks": defaultCallbacks} if fmi == 2 else {"loggingOn": False}))
    place = {one.name: one.valueReference for one in described.modelVariables}
    put, get = (fmu.setReal, fmu.getReal) if fmi == 2 else (fmu.setFloat64, fmu.getFloat64)
    whole = fmu.getInteger if fmi == 2 else fmu.getInt64

    def follow(rows: Any) -> Any:
        fmu.reset()
        put([place["start_position"], place["start_std"]], [start, _STD])
        fmu.setBoolean([place["start_known"]], [True])
        if fmi == 2:
            fmu.setupExperiment(startTime=0.0)
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        inputs, outputs = [place[name] for name in _INPUTS], [place[name] for name in _NAMES[:2]]
        said = []
        for at, *values in rows.tolist():
            put(inputs, values)
            fmu.doStep(at, 0.0)
            said.append([*get(outputs), *whole([place["status"]])])
        return np.array(said, dtype=float)

    return follow


def changed(prepared: Prepared, rng: Rng) -> tuple[Any, str]:
    """The work day with another rate for a while, from a moment in motion on; and what it is."""
    rows = prepared.rows.copy()
    rate, lasts = (float(np.exp(rng.uniform(*np.log(ends)))) for ends in (_RATES, _LASTS))
    moving = np.flatnonzero(np.abs(rows[:, 1]) > _MOVES)
    first = int(moving[int(rng.integers(len(moving)))])
    ticks = np.diff(rows[:, 0], prepend=rows[0, 0])
    ticks[first : first + math.ceil(lasts / _PERIOD)] *= rate
    rows[:, 0] = np.cumsum(ticks)
    return rows, f"{rate:.3f} times the period from {_PERIOD * first:.2f} s on for {lasts:.2f} s"


def _check(prepared: Prepared, rng: Rng, _: Path) -> tuple[str, str]:
    rows, what = changed(prepared, rng)
    name = list(prepared.built)[int(rng.integers(len(prepared.built)))]
    said = prepared.built[name](rows)
    if (lasting := silent(said, prepared.true)) > LASTING:
        error = np.abs(said[:, 0] - prepared.true)[said[:, 2] == 0]
        return WRONG, f"{name}, {what}: ok and wrong for {lasting:.2f} s, {1e3 * np.nanmax(error):.1f} mm at most"
    return READ, ""


SECTIONS = [Section("another rate", CASES, prepare, _check)] if find_compiler() else []
