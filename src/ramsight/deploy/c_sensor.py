"""A sensor's step as C: header, body, golden samples and the program that compares them."""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ramsight._version import __version__
from ramsight.deploy.c_function import PLAIN, Term, as_kind, literal, number, statements
from ramsight.deploy.c_sections import live_marks
from ramsight.deploy.c_text import golden_table, headings, indented, template
from ramsight.engine.cache import hold, instructions
from ramsight.engine.graph import graph_of
from ramsight.engine.recursion import Recursion
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.hypothesis import learned
from ramsight.sensor.persistence import CHANGED, CREEPING, DOUBTED, RESTING, SETTLING, TURNING
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import MEASURED, SHAFT_ANGLE, START_SLACK, VirtualSensor, is_variance

PLACES = ("position", "shown_position")
"""States that grow by little at a time; they stay doubles where reals are floats."""
CLOCKS = ("time", "clock")
"""States that are times; the step gets how far they are back. A sum of times stays a double too, or a timer of
samples would end a sample early or late at its limit."""
ANGLES = {"last_shaft_angle": SHAFT_ANGLE}
"""States that are what an input was, of which only the change counts: doubles, and the step gets the change."""
ROW = ("time [s]", "motor speed [rad/s]", "motor torque [N m]", "oil temperature [K]", "reference [m]")
"""Columns of a row of samples; what else a sensor takes comes after them."""
_SLOTS = "slots 2"
"""How the bytes of a slot are laid out; part of its identity."""
_OTHER_STATUSES = 4
"""Statuses among the golden samples in which floats may differ; doubles may in none."""
_LAST_PART = "Status: which of the detectors has spoken; and what the sensor says"
_MEANING = {
    "position": "0 = retracted",
    "position_std": "its standard deviation",
    "velocity": "positive extends",
    "load": "positive against lifting",
    "pressure_a": "chamber on the piston's side, absolute",
    "pressure_b": "chamber on the rod's side, absolute",
    "leak_factor": "leakage over the data sheet's",
    "displacement_factor": "displacement over the data sheet's",
    "compliance_factor": "compliance over the data sheet's",
    "mode": "what the piston is doing, a number of docs/kalman.md",
    "position_bound": "error that one sample in 100000 exceeds",
    "referenced_since_power_up": "whether a reference has come since the start, or since it was resumed",
    "torque_over_pressures": "reported torque less what the pressures ask for, lately",
    "speed_over_counter": "reported speed over the counter's, lately",
    "torque_missing": "torque by the drive's power less the reported one, lately",
}


@dataclass(frozen=True)
class SensorSource:
    """The C of a sensor.

    Attributes:
        prefix: with which all its names begin, for example ``ramsight_boom``.
        files: text by file name.
    """

    prefix: str
    files: Mapping[str, str]


def sensor_source(
    sensor: VirtualSensor, unit: HydraulicUnit, prefix: str, machine: str, *, single: bool
) -> SensorSource:
    """Header and body of a sensor.

    Args:
        sensor: the `kalman` sensor of the unit.
        unit: the unit.
        prefix: of all names.
        machine: the machine's name, for the comments.
        single: reals are floats by default.
    """
    recursion = sensor.recursion
    step, constants, wide = _step(sensor, prefix)
    states = tuple(sorted(recursion.state, key=lambda name: name not in wide))
    values = {name: value for name, value in zip(recursion.state, sensor.initial.tolist(), strict=True) if value}
    identity = "\n".join((_SLOTS, sensor.kind, *states, *recursion.parameters)).encode() + sensor.parameters.tobytes()
    wides, changing = len(wide), {of for state, of in ANGLES.items() if state in states}
    macro = prefix.upper()
    common = headings(prefix, machine, f"Virtual position sensor of the {unit.name}")
    header = template(
        "sensor.h",
        float=int(single),
        stroke=repr(unit.cylinder.stroke),
        further="".join(_further(sensor, prefix)),
        statuses=indented(f"{macro}_{s.name} = {int(s)}, /* {s.text} */" for s in Status),
        outputs=indented(_outputs(sensor, prefix)),
        states=indented(f"{'double' if name in wide else f'{prefix}_real'} {name};" for name in states),
        bytes=f"(16 + 8 * {wides} + (int)sizeof({prefix}_real) * {len(states) - wides})",
        **common,
    )
    body = template(
        "sensor.c",
        constants="\n".join(constants),
        initial=indented(
            f"s->{name} = {'' if name in wide else 'R'}({literal(values[name])});" for name in states if name in values
        ),
        further="".join(f"  const real u_{name} = in->{name};\n" for name in sensor.further if name not in changing),
        relative=indented(_relative(states)),
        step=indented(step),
        texts=indented((f'case {macro}_{s.name}: return "{s.text}";' for s in Status), 4),
        identity=f"0x{zlib.crc32(identity):08X}",
        wides=wides,
        count=len(states),
        stroke=repr(sensor.stroke),
        slack=START_SLACK,
        unknown=indented((f"out->{name} = (real)NAN;" for name in recursion.outputs if name != "status"), 4),
        turning=TURNING,
        creeping=CREEPING,
        resting=RESTING,
        moved=CHANGED,
        std_change=DOUBTED,
        settling=SETTLING,
        variances=indented(f"if (s->{name} < R(0.0)) return 0;" for name in states if is_variance(name)),
        learned=indented(f"to->{name} = from->{name};" for name in learned(sensor.recursion.state)),
        **common,
    )
    return SensorSource(prefix, {f"{prefix}.h": header, f"{prefix}.c": body})


def golden_source(
    source: SensorSource,
    inputs: NDArray[np.float64],
    outputs: NDArray[np.float64],
    start: float,
    std: float,
    further: Sequence[str] = (),
) -> SensorSource:
    """The same with golden samples and the program that runs them.

    Args:
        source: header and body.
        inputs: time, motor speed, torque, oil temperature, reference (NaN: none) and `further`, shape (samples, 5 and
            more).
        outputs: position, standard deviation, velocity, load and status, shape (samples, 5).
        start: the position at the start [m].
        std: its standard deviation [m].
        further: names of the columns after those of `ROW`.
    """
    text = (
        f"/* A simulated log with faults in it, and what ramsight {__version__} says of it. */\n"
        f"#define GOLDEN {len(inputs)}\n"
        f"static const double golden_start = {literal(start)}, golden_std = {literal(std)}; /* m */\n"
        f"/* {', '.join((*ROW, *further))} */\n"
        f"{golden_table('golden_in', inputs)}"
        "/* position [m], its standard deviation [m], velocity [m/s], load [N], status */\n"
        f"{golden_table('golden_out', outputs)}"
    )
    p = source.prefix
    reads = reading(p, further, "in", "sample")
    resting = "".join(f"  in.{name} = ({type_of(name, p)})NAN;\n" for name in further)
    program = template("sensor_test.c", p=p, P=p.upper(), other=_OTHER_STATUSES, further=reads, resting=resting)
    return SensorSource(p, {**source.files, f"{p}_golden.h": text, f"{p}_test.c": program})


def type_of(name: str, prefix: str) -> str:
    """C type of a further input."""
    return "double" if name in ANGLES.values() else f"{prefix}_real"


def reading(prefix: str, further: Sequence[str], sample: str, row: str) -> str:
    """Statements that fill a sample's further inputs from a row of numbers, which begins with `ROW`."""
    return "".join(
        f"    {sample}.{name} = ({type_of(name, prefix)}){row}[{k}];\n" for k, name in enumerate(further, len(ROW))
    )


def _outputs(sensor: VirtualSensor, prefix: str) -> Iterator[str]:
    for name in sensor.recursion.outputs:
        if name == "status":
            yield f"{prefix}_status status;"
            continue
        yield f"{prefix}_real {name}; /* [{sensor.units[name]}] {_meaning(name)} */"


def unit_table(sensor: VirtualSensor) -> str:
    """Inputs and outputs with their units, a row each of a Markdown table.

    Args:
        sensor: the `kalman` sensor of the unit.
    """
    rows = [
        ("`in.time`", "s", "of any clock; only differences count"),
        ("`in.motor_speed`", "rad/s", "positive extends"),
        ("`in.motor_torque`", "N m", ""),
        ("`in.oil_temperature`", "K", ""),
    ]
    rows += [(f"`in.{name}`", "1", "command, -1 to 1") for name in sensor.commands]
    rows += [(f"`in.{name}`", *MEASURED[name]) for name in sensor.optional]
    for name in sensor.recursion.outputs:
        rows.append((f"`out.{name}`", sensor.units.get(name, ""), _meaning(name) if name != "status" else "see below"))
    return "\n".join(f"| {name} | {unit} | {words} |" for name, unit, words in rows)


def _meaning(name: str) -> str:
    """What an output is, in words."""
    return _MEANING.get(name, f"standard deviation of {name.removesuffix('_std')}")


def _step(sensor: VirtualSensor, prefix: str) -> tuple[list[str], list[str], set[str]]:
    """Statements of the step, definitions of the constants that they use, and the states that are doubles."""
    recursion = sensor.recursion
    step, prepare = _marked(recursion, [found for _, found in sensor.sections])
    titles = [*(title for title, _ in sensor.sections), _LAST_PART]
    values = prepare(sensor.parameters).full().ravel()
    extra = len(values) - len(recursion.parameters)
    names = [f"k_{k}" for k in range(extra)] + [f"k_{identifier_of(name)}" for name in recursion.parameters]
    wide: set[str] = {*PLACES, *CLOCKS, *ANGLES} & set(recursion.state)
    while True:  # a sum of doubles is a double, and so is a state that it becomes
        scribe = _Scribe(recursion, prefix, names, frozenset(wide))
        lines = statements(step, scribe.read, scribe.write, PLAIN, titles, kept={0: 0})
        if scribe.sums <= wide:
            break
        wide |= scribe.sums
    constants = [
        f"static const real {name} = R({literal(float(value))});"
        for name, value in zip(names, values, strict=True)
        if name in scribe.used
    ]
    return lines, constants, wide


def _marked(recursion: Recursion, marks: list[Any]) -> tuple[ca.Function, ca.Function]:
    """The step with what its parts lead to behind its results, and the function of its held values.

    Of that only what the results need as well, so that the operations are those without it.
    """
    live = live_marks(graph_of(instructions(_split(recursion, marks)[0])), 2)
    return _split(recursion, [mark[sorted(k for of, k in live if of == 2 + n)] for n, mark in enumerate(marks)])


def _split(recursion: Recursion, marks: list[Any]) -> tuple[ca.Function, ca.Function]:
    everything = [recursion.next_state, recursion.output, *marks]
    both, q, prepare = hold(ca.densify(ca.vertcat(*everything)), recursion.p)
    parts = ca.vertsplit(both, [0, *np.cumsum([part.numel() for part in everything]).tolist()])
    names = ["x_new", "out", *(f"part_{k}" for k in range(len(marks)))]
    inputs = [recursion.x, recursion.u, q]
    return ca.Function("step", inputs, parts, ["x", "u", "q"], names, {"cse": True}), prepare


def _relative(states: Sequence[str]) -> Iterator[str]:
    """How far back clocks and angles are, of which now is 0."""
    for name in states:
        if name in CLOCKS:
            yield f"const wide x_{name} = s->{name} - in->time;"
        if name in ANGLES:
            of = ANGLES[name]
            yield f"const real u_{of} = in->{of} == in->{of} ? R(0.0) : (real)NAN;"
            yield f"const real x_{name} = (real)(s->{name} - in->{of});"


class _Scribe:
    """How a step reads and writes states, inputs, constants and outputs; keeps what it came across."""

    def __init__(self, recursion: Recursion, prefix: str, constants: list[str], wide: frozenset[str]) -> None:
        self._recursion, self._prefix, self._constants, self._wide = recursion, prefix, constants, wide
        self.used: set[str] = set()
        self.sums: set[str] = set()

    def read(self, argument: int, k: int) -> Term:
        if argument == 1:
            name = self._recursion.inputs[k]
            return Term(f"u_{name}", "wide" if name == "time" else "real")
        if argument == 2:
            self.used.add(self._constants[k])
            return Term(self._constants[k])
        name = self._recursion.state[k]
        kind = "wide" if name in self._wide and name not in ANGLES else "real"
        return Term(f"x_{name}" if name in CLOCKS or name in ANGLES else f"s->{name}", kind)

    def write(self, argument: int, k: int, term: Term) -> str:
        if argument == 1:
            name = self._recursion.outputs[k]
            value = f"({self._prefix}_status){term.text}" if name == "status" else number(term)
            return f"out->{name} = {value};"
        name = self._recursion.state[k]
        if name in CLOCKS:
            return f"if ({term.text} == 0) s->{name} = in->time;"
        if name in ANGLES:
            return f"if ({term.text} == 0) s->{name} = in->{ANGLES[name]};"
        if term.kind == "wide":
            self.sums.add(name)
        return f"s->{name} = {as_kind('wide', term) if name in self._wide else number(term)};"


def identifier_of(name: str) -> str:
    """A name as C and FMI can have it."""
    return "".join(c if c.isalnum() else "_" for c in name)


def inputs_of(rows: Any) -> NDArray[np.float64]:
    """Samples with a reference or NaN, shape (samples, 5 and more), as the recursion takes them: one column more."""
    rows = np.asarray(rows, dtype=np.float64)
    known = np.isfinite(rows[:, 4])
    columns = [rows[:, :4], np.where(known, rows[:, 4], 0.0), known, rows[:, len(ROW) :]]
    return np.ascontiguousarray(np.column_stack(columns))


def _further(sensor: VirtualSensor, prefix: str) -> list[str]:
    """What else a sample holds, a line each of the struct."""
    notes = dict.fromkeys(sensor.commands, "command, -1 ... 1; NaN: as before")
    notes |= {
        name: f"{MEASURED[name][1]} [{MEASURED[name][0]}]; NaN where it is not measured" for name in sensor.optional
    }
    return [f"  {type_of(name, prefix)} {name}; /* {notes[name]} */\n" for name in sensor.further]
