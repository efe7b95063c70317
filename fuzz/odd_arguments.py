"""Every public function and method with every argument odd, one at a time: read, or refused in one line that names it.

What a function takes is what Python says of its signature, so a new argument is tried without a word here. An odd value
that has a meaning (None where it stands for a default, 0, text as a title) may be taken.
"""

from __future__ import annotations

import datetime
import decimal
import inspect
import math
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from harness import CRASHED, READ, REFUSED, Rng, Section

CASES = 3_000
_PATIENCE = 120.0  # s; what is taken is done
_LONGEST = 4000  # letters of a message
_UNIT, _LOAD, _START = "boom", "441 kN", "120 mm"
_OPEN = (inspect.Parameter.VAR_KEYWORD, inspect.Parameter.VAR_POSITIONAL)


@dataclass(frozen=True)
class Tried:
    """A function or method."""

    get: Callable[[], Callable[..., Any]]  # it, made anew for each call where it changes something
    good: Mapping[str, Any]  # arguments with which it does its work

    @property
    def names(self) -> list[str]:
        """Its arguments."""
        return [one.name for one in inspect.signature(self.get()).parameters.values() if one.kind not in _OPEN]


def odd_values() -> dict[str, Any]:
    """Values that nobody means, by what they are."""
    import xarray

    return {
        "nothing": None, "truth": True, "no text": "", "text": "x", "pressure": "5 bar", "NaN as text": "nan",
        "bytes": b"x", "no list": [], "list": [1, "x"], "no dict": {}, "dict": {"a": 1}, "array": np.array([1.0, 2.0]),
        "NaN": math.nan, "infinity": math.inf, "large": 10**400, "below zero": -1, "very large": 1e300,
        "complex": 1 + 2j, "object": object(), "class": int, "Dataset": xarray.Dataset(),
        "DataArray": xarray.DataArray([1.0]), "date": datetime.datetime(2020, 1, 1, tzinfo=datetime.UTC),
        "NumPy date": np.datetime64("2020-01-01"), "no Decimal": decimal.Decimal("sNaN"), "escape": "\x1b[2J",
        "no file": Path("nowhere/x.csv"), "set": {1}, "iterator": iter([1]), "zero": 0, "null": "a\0b",
        "half a letter": "\udc80", "long text": "x" * 100_000, "function": lambda *_: None,
        "duration": np.timedelta64(1),
    }  # fmt: skip


def prepare(folder: Path) -> dict[str, Tried]:
    """All public functions, with a run, a log and a track of the boom."""
    import ramsight

    os.chdir(folder)
    boom = ramsight.build("mining-loader", _UNIT)
    run = ramsight.simulate(boom, load=_LOAD, start=_START)
    log, profile = ramsight.drive_report(run), ramsight.Profile([0.0, 1.0], [0.0, 1.0])
    track, duty = ramsight.track(boom, log, start=_START), ramsight.lift_lower(boom, _LOAD)
    of_boom, with_log, press = {"machine": boom}, {"machine": boom, "log": log}, {"machine": "press"}
    warmth = ramsight.Profile(0.0, 313.15)
    chances = {"dc": "90 %", "false_alarms": "1e-5/h", "other_std": "1 mm", "drift": "1 mm/s"}
    good: dict[str, dict[str, Any]] = {
        "AsBuilt": {}, "DriveResponse": {}, "LivePlant": of_boom, "LiveWeighing": {"machine": "mining-loader"},
        "Profile": {"time": [0, 1], "value": [0, 1]},
        "Duty": {"motor_speed": profile, "load": profile, "oil_temperature": warmth, "start_position": 0.1},
        "Study": press, "build": press, "casadi_model": {"unit": boom}, "catalogue": {},
        "check_shared": {"first": track, "second": track}, "commission": with_log,
        "compare": {**with_log, "other": run},
        "derive_tolerance": {**with_log, **chances}, "diagnostic_coverage": {"file": "x.csv"}, "draw": of_boom,
        "drive_report": {"run": run}, "duty_for": {**of_boom, "load": _LOAD}, "export_c": {**press, "out": "c"},
        "export_fmeda": {**press, "out": "f.csv"}, "export_fmu": {**press, "out": "f.fmu"},
        "export_page": {"out": "p.html"}, "export_wasm": {**press, "out": "w"},
        "history": {"store": "h.db", "machine": "press"}, "history_add": {"store": "h.db", **press, "logs": "x.csv"},
        "history_event": {"store": "h.db", "machine": "press", "kind": "repair", "at": "2026-03-01", "unit": "press"},
        "history_report": {"store": "h.db", "out": "h.html"},
        "export_parameters": {**press, "out": "p.h"}, "export_ssp": {**press, "out": "p.ssp"}, "identify": with_log,
        "identify_values": {**press, "runs": []}, "leak_test": with_log, "lift_lower": {**of_boom, "load": _LOAD},
        "load_machine": {"name_or_path": "press"}, "named_faults": {"tracked": track}, "open_log": {"path": "x.csv"},
        "overlay": {**of_boom, "logs": [track, track]},
        "plot": {"dataset": track}, "read_log": {"log": "x.csv"}, "sensor_for": of_boom,
        "simulate": {**of_boom, "duty": duty}, "simulate_many": {"machines": boom, "duties": [duty]},
        "weigh": {"machine": "mining-loader", "logs": log, "start": _START},
        "tool_place": {"machine": "mining-loader", "tracks": {_UNIT: track}}, "track": {**with_log, "start": _START},
    }  # fmt: skip
    functions = {name: Tried(lambda name=name: getattr(ramsight, name), passed) for name, passed in good.items()}
    return functions | _methods(boom, log, duty, track)


def _methods(boom: Any, log: Any, duty: Any, track: Any) -> dict[str, Tried]:
    import ramsight

    def sensor() -> Any:
        made = ramsight.sensor_for(boom)
        made.start(_START)
        return made

    study, plant = ramsight.Study("press", machines=2), ramsight.LivePlant(boom)
    sample = {"time": 0.0, "motor_speed": 0.0, "motor_torque": 0.0, "oil_temperature": 313.15}
    return {
        "Sensor.start": Tried(lambda: sensor().start, {"position": 0.1}),
        "Sensor.step": Tried(lambda: sensor().step, sample),
        "Sensor.track": Tried(lambda: sensor().track, {"log": log}),
        "Sensor.says": Tried(lambda: sensor().says, {"output": "position"}),
        "LivePlant.advance": Tried(lambda: plant.advance, {"motor_speed": 0.0}),
        "LiveWeighing.step": Tried(
            lambda: ramsight.LiveWeighing("mining-loader").step, {"time": 0.0, "sensors": {_UNIT: sensor()}}
        ),
        "AsBuilt.apply": Tried(lambda: ramsight.AsBuilt().apply, {"unit": boom}),
        "Duty.repeated": Tried(lambda: duty.repeated, {"times": 2}),
        "Duty.commanded": Tried(lambda: duty.commanded, {"name": "x", "time": 0.0}),
        "Profile()": Tried(lambda: duty.load.__call__, {"time": 0.5}),
        "Study.run": Tried(lambda: study.run, {}),
        "Study.budget": Tried(lambda: study.budget, {"base": 0}),
        "Study.sensitivities": Tried(lambda: study.sensitivities, {"base": 0}),
        "Study.datasheet": Tried(lambda: study.datasheet, {"found": track}),
        "Study.required": Tried(lambda: study.required, {"sheet": None}),
    }


def outcome(tried: Tried, argument: str, value: Any) -> tuple[str, str]:
    """What comes of a call with one odd argument: read, refused or crashed, and what is told of it."""
    from ramsight.errors import RamsightError

    try:
        found = tried.get()(**{**tried.good, argument: value})
        if inspect.isgenerator(found):
            next(found, None)
    except RamsightError as error:
        text = str(error)
        if text.isprintable() and len(text) <= _LONGEST:
            return REFUSED, text
        return CRASHED, f"no line: {text[:200]!r}"
    except Exception as error:
        return CRASHED, f"{type(error).__name__}: {str(error)[:200]}"
    return READ, ""


def _check(prepared: dict[str, Tried], rng: Rng, _: Path) -> tuple[str, str]:
    name = list(prepared)[int(rng.integers(len(prepared)))]
    names = prepared[name].names
    argument = names[int(rng.integers(len(names)))]
    odd = odd_values()
    kind = list(odd)[int(rng.integers(len(odd)))]
    found, text = outcome(prepared[name], argument, odd[kind])
    return found, f"{name}({argument}={kind}): {text}"


SECTIONS = [Section("odd arguments of Python", CASES, prepare, _check, patience=_PATIENCE)]
