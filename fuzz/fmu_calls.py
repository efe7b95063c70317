"""FMUs that are called as no master should: out of order, with steps and numbers that are none, initialized twice.

Each call that is none has to be an error. A status may be ok only where the sensor was told where the piston is and has
heard nothing that is no number since.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from harness import READ, REFUSED, WRONG, Rng, Section

from ramsight.deploy.compiler import find_compiler

CASES = 20_000
_CALLS = 40
_OK, _NOT_REFERENCED = 0, 30
_ODD = (math.nan, math.inf, -math.inf, -0.02, -1e-300, 1e308, -1e308)
_STROKE, _OUTSIDE, _ROUNDED = 0.7, 0.02, 1e-9  # m
_LARGEST = 1e150  # m, of a deviation whose square is a number
_USUAL = {
    "motor_speed": 50.0, "motor_torque": 20.0, "oil_temperature": 313.15, "load": 1e5, "start_position": 0.3,
    "start_std": 1e-3, "start_known": 1.0,
}  # fmt: skip
INSTANTIATED, INITIALIZING, STEPPING, TERMINATED = range(4)


@dataclass
class Called:
    """An FMU, and what has to be true of it."""

    fmu: Any  # fmpy's
    places: dict[str, int]  # value references, by name
    kind: str  # what it models
    fmi: int  # its version
    outputs: list[str]  # that are looked at
    phase: int = INSTANTIATED  # in which it has to be
    time: float = 0.0  # that it has reached [s]
    given: dict[str, float] = field(default_factory=dict)  # the newest value of each input and parameter that was set
    # whether all that was set so far is what a machine has; what came of the rest stays in a plant's state
    is_usual: bool = True

    def put(self, name: str, value: float) -> None:
        """Set a variable."""
        if name.endswith("known"):
            self.fmu.setBoolean([self.places[name]], [bool(value)])
        else:
            (self.fmu.setReal if self.fmi == 2 else self.fmu.setFloat64)([self.places[name]], [value])
        self.given[name] = value
        self.is_usual = self.is_usual and value == _USUAL[name]

    def get(self) -> dict[str, float]:
        """All outputs."""
        real = self.fmu.getReal if self.fmi == 2 else self.fmu.getFloat64
        whole = self.fmu.getInteger if self.fmi == 2 else self.fmu.getInt64
        return {name: (whole if name == "status" else real)([self.places[name]])[0] for name in self.outputs}

    def begin(self, start: float) -> None:
        """Enter the initialization."""
        if self.fmi == 2:
            self.fmu.setupExperiment(startTime=start)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(startTime=start)

    @property
    def starts(self) -> bool | None:
        """Whether it can begin with what it was given; None if only its equations know."""
        place, std = self.given.get("start_position", 0.35), self.given.get("start_std", 1e-3)
        if self.kind == "plant":
            return True if self.is_usual else None if math.isfinite(place) else False
        return not self.given.get("start_known") or (-_ROUNDED <= place <= _STROKE and 0.0 <= std < _LARGEST)


def prepare(folder: Path) -> list[Called]:
    """The boom's sensor and plant, in FMI 2 and 3."""
    import fmpy

    from ramsight.deploy.fmu import write_fmu
    from ramsight.machine import load_machine

    made = []
    for kind in ("sensor", "plant"):
        for fmi in (2, 3):
            written = write_fmu(load_machine("mining-loader"), "boom", folder / f"{kind}{fmi}.fmu", what=kind, fmi=fmi)
            place = fmpy.extract(str(written.path), unzipdir=str(folder / f"{kind}{fmi}"))
            made.append(_instance(fmpy.read_model_description(str(written.path)), place, kind, fmi))
    return made


def _instance(description: Any, folder: str, kind: str, fmi: int) -> Called:
    from fmpy.fmi2 import FMU2Slave, defaultCallbacks
    from fmpy.fmi3 import FMU3Slave

    fmu = (FMU2Slave if fmi == 2 else FMU3Slave)(
        guid=description.guid, unzipDirectory=folder, instanceName=kind,
        modelIdentifier=description.coSimulation.modelIdentifier,
    )  # fmt: skip
    fmu.instantiate(**({"loggingOn": False, "callbacks": defaultCallbacks} if fmi == 2 else {"loggingOn": False}))
    places = {one.name: one.valueReference for one in description.modelVariables}
    outputs = [one.name for one in description.modelVariables if one.causality == "output"]
    return Called(
        fmu, places, kind, fmi, [one for one in outputs if one in ("position", "position_std", "status", *_USUAL)]
    )


def _answered(call: Callable[[], Any]) -> bool:
    """Whether a call was no error."""
    from fmpy.fmi1 import FMICallException

    try:
        call()
    except FMICallException:
        return False
    return True


def _begins(one: Called, rng: Rng) -> tuple[bool, bool]:
    """Begin the initialization, perhaps twice, or at a time that is none; whether it may, and whether it did."""
    start = 0.0 if rng.random() < 0.9 else float(rng.choice([math.nan, math.inf, -math.inf]))
    may = one.phase == INSTANTIATED and math.isfinite(start)
    did = _answered(lambda: one.begin(start))
    if did:
        one.phase, one.time = INITIALIZING, start
    return may, did


def _ends(one: Called, _: Rng) -> tuple[bool, bool]:
    starts, did = one.starts, _answered(one.fmu.exitInitializationMode)
    may = one.phase == INITIALIZING and (did if starts is None else starts)
    if did:
        one.phase = STEPPING
    return may, did


def _stops(one: Called, rng: Rng) -> tuple[bool, bool]:
    if rng.random() < 0.8:  # seldom: nothing comes after it
        return True, True
    may = one.phase in (INITIALIZING, STEPPING)
    did = _answered(one.fmu.terminate)
    if did:
        one.phase = TERMINATED
    return may, did


def _sets(one: Called, rng: Rng) -> tuple[bool, bool]:
    names = [name for name in _USUAL if name in one.places]
    name = names[int(rng.integers(len(names)))]
    value = _USUAL[name] if name == "start_known" or rng.random() < 0.8 else float(rng.choice(_ODD))
    may = name not in one.outputs and not (name.startswith("start") and one.phase > INITIALIZING)
    before = one.given.get(name)
    did = _answered(lambda: one.put(name, value))
    if not did and before is not None:
        one.given[name] = before
    return may, did


def _steps(one: Called, rng: Rng) -> tuple[bool, bool]:
    """A step, perhaps of a length that is none; the outputs stay as they were where it is refused."""
    odd = rng.random() < 0.3
    width = float(rng.choice(_ODD[:5])) if odd else 0.02
    at = one.time if rng.random() < 0.95 else float(rng.choice([math.nan, math.inf]))
    may = one.phase == STEPPING and math.isfinite(at) and math.isfinite(width) and width >= 0.0
    heard = all(math.isfinite(one.given.get(name, 0.0)) for name in ("motor_speed", "motor_torque", "load"))
    before = one.get() if one.phase >= STEPPING else {}
    did = _answered(lambda: one.fmu.doStep(at, width))
    after = one.get() if one.phase >= STEPPING else {}
    if did:
        one.time += width
    elif any(after[name] != value and not math.isnan(value) for name, value in before.items()):
        raise AssertionError(f"{one.kind}{one.fmi}: a step that was refused has changed {before} to {after}")
    if did and not heard and after.get("status") == _OK:
        raise AssertionError(f"{one.kind}{one.fmi}: ok with an input that is no number: {one.given}, {after}")
    return (may if one.kind == "sensor" or one.is_usual else may and heard and did), did


_KINDS: tuple[Callable[[Called, Rng], tuple[bool, bool]], ...] = (
    _begins, _ends, _sets, _sets, _sets, _steps, _steps, _steps, _stops,
)  # fmt: skip


def _dishonest(one: Called, after: dict[str, float]) -> str:
    """What is wrong with outputs; "" if nothing."""
    place, status = after["position"], after.get("status")
    if one.phase == INSTANTIATED:
        known = not math.isnan(place) or (status is not None and status < _NOT_REFERENCED)
        return f"before the initialization: {after}" if known else ""
    if status == _OK and not (-_OUTSIDE <= place <= _STROKE + _OUTSIDE and math.isfinite(after["position_std"])):
        return f"ok: {after}"
    if status == _OK and not one.given.get("start_known"):
        return f"ok without a start: {after}"
    return ""


def _wrong_now(one: Called) -> str:
    """What is wrong with the outputs that can be had now; "" if nothing."""
    if one.phase == INITIALIZING and not one.starts:
        return f"outputs of a start that is none: {one.given}" if one.starts is False and _answered(one.get) else ""
    return _dishonest(one, one.get())


def _check(prepared: list[Called], rng: Rng, _: Path) -> tuple[str, str]:
    one = prepared[int(rng.integers(len(prepared)))]
    one.fmu.reset()
    one.phase, one.time, one.given, one.is_usual, refused = INSTANTIATED, 0.0, {}, True, 0
    for _ in range(_CALLS):
        kind = _KINDS[int(rng.integers(len(_KINDS)))]
        may, did = kind(one, rng)
        if may != did:
            return WRONG, f"{one.kind}{one.fmi}{kind.__name__}: {may} and {did}, phase {one.phase}, {one.given}"
        refused += not did
        if wrong := _wrong_now(one):
            return WRONG, f"{one.kind}{one.fmi}: {wrong}"
    return (REFUSED if refused else READ), ""


SECTIONS = [Section("FMU called out of order", CASES, prepare, _check)] if find_compiler() and find_spec("fmpy") else []
