"""A reference experiment inside an FMU: inputs over time, and what Python says of them.

The files stand where the layered standard FMI-LS-REF (1.0.0-alpha.1) has related files,
`extra/org.fmi-standard.fmi-ls-ref`, with a manifest that lists them and their roles.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from ramsight.deploy.c_sensor import inputs_of
from ramsight.deploy.credentials import CARD, DESCRIPTION, FMEDA
from ramsight.deploy.fmu_variable import UNKNOWN
from ramsight.deploy.golden import faulty_day
from ramsight.deploy.machine_parameters import parameter_set
from ramsight.duty.profile import Duty, Profile, constant
from ramsight.duty.simulate import simulated
from ramsight.engine.recursion import replay
from ramsight.plant.limits import limits_of
from ramsight.plant.unit import HydraulicUnit, circuit
from ramsight.sensor.kalman import kalman
from ramsight.sensor.thresholds import START_STD
from ramsight.sensor.virtual_sensor import BOUND, VirtualSensor
from ramsight.tracking.comparing import TIME_TO_ALERT, TOLERANCE, Comparison, verdicts

Array = NDArray[np.float64]

FOLDER = "extra/org.fmi-standard.fmi-ls-ref"
"""Where the files stand in the FMU."""
IN, OUT, START, MANIFEST = "golden_in.csv", "golden_ref.csv", "golden.ssv", "fmi-ls-manifest.xml"
NOTE = "documentation/fmi-ls-ref.txt"
_NAMESPACE = "http://fmi-standard.org/fmi-ls-manifest"
_VERSION = "1.0.0-alpha.1"
_WORDS = "Layered Standard providing information on related files included in an FMU."
_SAID = ("position", "position_std", "velocity", "load", BOUND, "status")
_TIME, _WARM = 40.0, 313.15  # s of a sensor's day; K
_REFERENCE = 4  # its column in a day's rows
_STEP = 0.01  # s, of a plant
_RAMP, _HOLD, _REST = 0.8, 2.0, 1.0  # s
_SPEED_SHARE, _STROKE_SHARE, _LOAD_SHARE, _START_SHARE = 0.3, 0.3, 0.2, 0.4
_LOST_FROM = 0.5  # of the day: from when on the real sensor says nothing
SENSOR_TOLERANCE, PLANT_TOLERANCE = 1e-9, 1e-6  # m


@dataclass(frozen=True)
class Experiment:
    """Inputs, parameters and what is expected.

    Args:
        step: communication step [s].
        inputs: columns by name of the variable, `time` first; each holds from its time to the next.
        expected: the same of outputs; what is said at the end of a step.
        parameters: values before initialization.
        tolerance: within which positions have to agree [m].
    """

    step: float
    inputs: Mapping[str, Array]
    expected: Mapping[str, Array]
    parameters: Mapping[str, float | bool]
    tolerance: float


def experiment_of(unit: HydraulicUnit, what: str, sensor: VirtualSensor | None = None) -> Experiment | None:
    """The experiment of an FMU; None of a control, and of a plant with commanded parts, whose inputs are not all.

    Args:
        unit: its parts.
        what: ``sensor``, ``compare``, ``control`` or ``plant``.
        sensor: the `kalman` sensor of the unit, if it is made already.
    """
    if what == "plant":
        return None if circuit(unit).commands else _of_plant(unit)
    return None if what == "control" else _of_sensor(unit, sensor or kalman(unit), compared=what == "compare")


def _of_sensor(unit: HydraulicUnit, sensor: VirtualSensor, *, compared: bool) -> Experiment:
    """A work day without faults; beside a real sensor that agrees for half of it and then says nothing."""
    rows, start = faulty_day(unit, duration=_TIME + 5.0, every=None, seed=1, further=sensor.further)
    rows = rows[rows[:, 0] <= _TIME + 1e-9]
    rows[0, _REFERENCE] = start
    sensor.start(start)
    state = np.array([sensor.state[name] for name in sensor.recursion.state])
    said = replay(sensor.recursion, inputs_of(rows), sensor.parameters, state)
    found = dict(zip(sensor.recursion.outputs, said.T, strict=True))
    time, step = rows[:, 0], float(np.median(np.diff(rows[:, 0])))
    names = ("time", "motor_speed", "motor_torque", "oil_temperature")
    inputs = dict(zip(names, rows.T[:_REFERENCE], strict=True))
    inputs |= dict(zip(sensor.further, rows.T[_REFERENCE + 1 :], strict=True))
    known = np.isfinite(rows[:, _REFERENCE])
    inputs |= {"reference": np.where(known, rows[:, _REFERENCE], 0.0), "reference_known": known.astype(float)}
    expected = {"time": time[1:], **{name: found[name][:-1] for name in _SAID}}
    parameters: dict[str, float | bool] = {"start_position": start, "start_std": START_STD, "start_known": True}
    if compared:
        other = np.where(time > _LOST_FROM * _TIME, np.nan, found["position"])
        pair, codes = Comparison.of(unit, TOLERANCE, TIME_TO_ALERT), found["status"].astype(np.int64)
        inputs["other_position"] = other
        expected["verdict"] = verdicts(pair, time, found["position"], found[BOUND], codes, other)[:-1].astype(float)
    return Experiment(step, inputs, expected, parameters, SENSOR_TOLERANCE)


def _of_plant(unit: HydraulicUnit) -> Experiment:
    """A move out and back under a load that stays, with corners on steps."""
    stroke, limits = float(unit.cylinder.stroke), limits_of(unit)
    travel = abs(float(unit.travel_per_radian)) * (_RAMP + _HOLD)
    speed = min(_SPEED_SHARE * limits.max_speed, _STROKE_SHARE * stroke / travel)
    shape = np.array([0.0, 0.0, 1.0, 1.0, 0.0])
    lengths = np.array([_REST, _RAMP, _HOLD, _RAMP])
    times = np.concatenate([[0.0], np.cumsum(np.tile(lengths, 2)), [2 * lengths.sum() + _REST]])
    speeds = Profile(times, speed * np.concatenate([shape, -shape[1:], [0.0]]))
    duty = Duty(speeds, constant(_LOAD_SHARE * limits.load), constant(_WARM), _START_SHARE * stroke)
    run = simulated(unit, duty, sample_period=_STEP)
    time = run["time"].values
    inputs = {
        "time": time,
        "motor_speed": duty.motor_speed(time),
        "motor_acceleration": np.append(np.diff(duty.motor_speed(time)) / np.diff(time), 0.0),
        "load": duty.load(time),
        "oil_temperature": np.full(len(time), _WARM),
    }
    shown = {"position": "position", "velocity": "velocity"} | {f"pressure_chamber_{s}": f"pressure_{s}" for s in "ab"}
    expected = {"time": time, **{name: run[of].values for name, of in shown.items()}}
    return Experiment(_STEP, inputs, expected, {"start_position": duty.start_position}, PLANT_TOLERANCE)


def reference_files(
    experiment: Experiment | None, name: str, own: Sequence[str], tolerance: str = ""
) -> dict[str, str]:
    """The files of an FMU, text by their places in it.

    Args:
        experiment: that is inside, if there is one.
        name: of the FMU's model.
        own: names of the files in `resources/` that the manifest lists beside.
        tolerance: of the comparison, in words; by default that of the experiment.
    """
    files, related = {}, []
    if experiment is not None:
        words = tolerance or f"positions within {experiment.tolerance:g} m"
        files[f"{FOLDER}/{IN}"] = _table(experiment.inputs)
        files[f"{FOLDER}/{OUT}"] = _table(experiment.expected)
        files[f"{FOLDER}/{START}"] = parameter_set(f"{name} golden", experiment.parameters)
        files[NOTE] = _note(experiment, words)
        related = [
            ("text/csv", IN, "experiment/smoke-test", f"inputs over time, steps of {experiment.step:g} s"),
            ("text/csv", OUT, "result", f"expected outputs at the end of each step; {words}"),
            ("application/x-ssp-parameter-set", START, "parameter", "parameters of the experiment"),
        ]
    related += [
        (kind, f"../../resources/{file}", role, text) for file, (kind, role, text) in _OWN.items() if file in own
    ]
    files[f"{FOLDER}/{MANIFEST}"] = "\n".join(_manifest(related)) + "\n"
    return files


_OWN = {
    DESCRIPTION: ("application/toml", "model", "the machine, every value with its source"),
    CARD: ("application/x-srmd-meta-data", "meta-data", "purpose, limits and verification, as MIC Core has it"),
    FMEDA: ("text/csv", "document", "faults, shares of them that are detected, and times"),
}


def _manifest(related: Sequence[tuple[str, str, str, str]]) -> Iterator[str]:
    yield '<?xml version="1.0" encoding="UTF-8"?>'
    names = {"fmi-ls-name": "org.fmi-standard.fmi-ls-ref", "fmi-ls-version": _VERSION, "fmi-ls-description": _WORDS}
    attributes = " ".join(f"fmi-ls:{key}={quoteattr(value)}" for key, value in names.items())
    yield f'<fmiReferences xmlns:fmi-ls="{_NAMESPACE}" {attributes}>'
    for kind, source, role, text in related:
        yield f'  <Related type="{kind}" source="{source}" role="{role}" description={quoteattr(text)}/>'
    yield "</fmiReferences>"


def _note(experiment: Experiment, words: str) -> str:
    last = float(experiment.inputs["time"][-1])
    return (
        f"Reference experiment (FMI-LS-REF {_VERSION}), in {FOLDER}:\n"
        f"1. Set the parameters of {START}, and initialize at time 0.\n"
        f"2. Step by {experiment.step:g} s up to {last:g} s. Before each step set the inputs of {IN} at its begin.\n"
        f"3. Compare the outputs at the end of each step with {OUT}: {words}, and the same enumerations.\n"
        f"Inputs that {IN} does not have keep their start values.\n"
    )


def _table(columns: Mapping[str, Array]) -> str:
    """CSV with names in the first line; what nobody measures is the number that stands for it."""
    values = np.column_stack([np.where(np.isnan(one), UNKNOWN, one) for one in columns.values()])
    lines = (",".join(f"{value:.12g}" for value in row) for row in values.tolist())
    return "\n".join([",".join(columns), *lines]) + "\n"
