"""A sensor's step as C: header, body, golden samples and the program that compares them."""

from __future__ import annotations

import zlib
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ramsight._version import __version__
from ramsight.deploy import c_machine
from ramsight.deploy.c_function import PLAIN, Term, as_kind, literal, number, result_kinds, statements
from ramsight.deploy.c_machine import MachineTable
from ramsight.deploy.c_sections import live_marks
from ramsight.deploy.c_text import golden_table, headings, indented, template
from ramsight.deploy.sensor_words import meaning
from ramsight.engine.cache import hold, instructions
from ramsight.engine.graph import graph_of
from ramsight.engine.recursion import Recursion
from ramsight.engine.typed_state import Leaf
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.persistence import CLOCKED, STARTED, VELOCITY
from ramsight.sensor.sample import MEASURED, SHAFT_ANGLE
from ramsight.sensor.status import Status
from ramsight.sensor.thresholds import (
    COAST_TIME,
    CREEP_VELOCITY,
    MOTOR_TURNS,
    REST_TIME,
    SAVE_CHANGE,
    SAVE_STD_CHANGE,
    START_SLACK,
)
from ramsight.sensor.virtual_sensor import IS_REFERENCED, REFERENCED_NOW, VARIANCE, VirtualSensor

TIME = "time"
"""The input that clocks repeat. The step gets how far they are back. A sum of times stays a double too, or a timer of
samples would end a sample early or late at its limit."""
ROW = ("time [s]", "motor speed [rad/s]", "motor torque [N m]", "oil temperature [K]", "reference [m]")
"""Columns of a row of samples; what else a sensor takes comes after them."""
_SLOTS = "slots 3"
"""How the bytes of a slot are laid out; part of its identity."""
_OTHER_STATUSES = 4
"""Statuses among the golden samples in which floats may differ; doubles may in none."""
_LAST_PART = "Status: which of the detectors has spoken; and what the sensor says"


@dataclass(frozen=True)
class SensorSource:
    """The C of a sensor.

    Attributes:
        prefix: with which all its names begin, for example ``ramsight_boom``.
        files: text by file name.
        table: its machine's numbers; None of what is no sensor.
    """

    prefix: str
    files: Mapping[str, str]
    table: MachineTable | None = None


def sensor_source(
    sensor: VirtualSensor, unit: HydraulicUnit, prefix: str, machine: str, *, single: bool, tabled: bool = False
) -> SensorSource:
    """Header and body of a sensor.

    Args:
        sensor: the `kalman` sensor of the unit.
        unit: the unit.
        prefix: of all names.
        machine: the machine's name, for the comments.
        single: reals are floats by default.
        tabled: the machine's numbers are a table that the sensor is handed, not constants.
    """
    recursion = sensor.recursion
    step, table, wide, declared = _tabled_step(sensor, prefix)
    states = tuple(table.start)
    wides, changing = len(wide), set(_repeated(sensor).values())
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
        machines=c_machine.declared(table, prefix) if tabled else "",
        chosen=f"  const {prefix}_machine *machine;\n  uint32_t chosen; /* by `of` */\n" if tabled else "",
        of=template("machine.h", **common) if tabled else "",
        bytes=f"(20 + 8 * {wides} + (int)sizeof({prefix}_real) * {len(states) - wides})",
        **common,
    )
    body = template(
        "sensor.c",
        **(_by_table(table, prefix, common) if tabled else _by_constants(table, wide)),
        further="".join(f"  const real u_{name} = in->{name};\n" for name in sensor.further if name not in changing),
        relative=indented(_relative(sensor)),
        step=indented(step),
        texts=indented((f'case {macro}_{s.name}: return "{s.text}";' for s in Status), 4),
        wides=wides,
        count=len(states),
        slack=START_SLACK,
        unknown=indented((f"out->{name} = (real)NAN;" for name in recursion.outputs if name != "status"), 4),
        turning=MOTOR_TURNS,
        creeping=CREEP_VELOCITY,
        resting=REST_TIME,
        moved=SAVE_CHANGE,
        std_change=SAVE_STD_CHANGE,
        settling=COAST_TIME,
        variances=indented(f"if (s->{field_of(one.name)} < R(0.0)) return 0;" for one in declared if one.variance),
        learned=indented(f"to->{name} = from->{name};" for name in map(field_of, sensor.learned)),
        known=field_of(IS_REFERENCED),
        since=field_of(REFERENCED_NOW),
        variance=field_of(VARIANCE),
        velocity=field_of(VELOCITY),
        started=field_of(STARTED),
        clocked=field_of(CLOCKED),
        **common,
    )
    return SensorSource(prefix, {f"{prefix}.h": header, f"{prefix}.c": body}, table)


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
    files = {**source.files, f"{p}_golden.h": text, f"{p}_test.c": program}
    return replace(source, files=files)


def type_of(name: str, prefix: str) -> str:
    """C type of a further input."""
    return "double" if name == SHAFT_ANGLE else f"{prefix}_real"


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
        yield f"{prefix}_real {name}; /* [{sensor.units[name]}] {meaning(name)} */"


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
        rows.append((f"`out.{name}`", sensor.units.get(name, ""), meaning(name) if name != "status" else "see below"))
    return "\n".join(f"| {name} | {unit} | {words} |" for name, unit, words in rows)


def machine_table(sensor: VirtualSensor, prefix: str) -> MachineTable:
    """The numbers of a sensor's machine, as the C that `sensor_source` writes with `tabled` takes them.

    Args:
        sensor: the `kalman` sensor of the unit.
        prefix: of the C's names.
    """
    return _tabled_step(sensor, prefix)[1]


def _tabled_step(sensor: VirtualSensor, prefix: str) -> tuple[list[str], MachineTable, set[str], tuple[Leaf, ...]]:
    """Statements of the step, the machine's numbers, fields that are doubles, and the states in the struct's order."""
    recursion = sensor.recursion
    step, constants, wide = _step(sensor, prefix)
    declared = tuple(sorted(sensor.states, key=lambda one: one.name not in wide))
    values = dict(zip(recursion.state, sensor.initial.tolist(), strict=True))
    start = {field_of(one.name): float(values[one.name]) for one in declared}
    identity = "\n".join((_SLOTS, sensor.kind, *start, *recursion.parameters)).encode() + sensor.parameters.tobytes()
    kind = "\n".join((_SLOTS, *start, *constants, *step)).encode()
    table = MachineTable(zlib.crc32(kind), zlib.crc32(identity), float(sensor.stroke), start, constants)
    return step, table, {field_of(name) for name in wide}, declared


def _by_constants(table: MachineTable, wide: Container[str]) -> dict[str, str]:
    """How the body has its machine's numbers: as constants."""
    return {
        "constants": "\n".join(f"static const real {name} = R({literal(v)});" for name, v in table.constants.items()),
        "initial": indented(
            f"s->{name} = {'' if name in wide else 'R'}({literal(v)});" for name, v in table.start.items() if v
        ),
        "identity": f"UINT32_C(0x{table.identity:08X})",
        "stroked": repr(table.stroke),
        **dict.fromkeys(("begins", "keeps", "kept", "likewise", "beside"), ""),
    }


def _by_table(table: MachineTable, prefix: str, common: Mapping[str, object]) -> dict[str, str]:
    """The same as a table that it is handed."""
    defined = f"const {prefix}_machine {prefix}_described = {c_machine.initializer(table, prefix)};"
    return {
        "constants": "\n".join((defined, *(f"#define {name} (s->machine->{name})" for name in table.constants))),
        "initial": template("machine_start.c"),
        "identity": "s->machine->identity",
        "stroked": "s->machine->stroke",
        "begins": template("machine.c", **common),
        "keeps": f"  const {prefix}_machine *const machine = machine_of(s);\n"
        "  const uint32_t chosen = s->chosen == REFUSED ? REFUSED : CHOSEN;\n",
        "kept": "  s->machine = machine;\n  s->chosen = chosen;\n",
        "likewise": "  set_machine(to, machine_of(from));\n",
        "beside": template("machine_resume.c", **common),
    }


def _step(sensor: VirtualSensor, prefix: str) -> tuple[list[str], dict[str, float], set[str]]:
    """Statements of the step, the constants that they use, and the states that are doubles."""
    recursion = sensor.recursion
    step, prepare = _marked(recursion, [found for _, found in sensor.sections])
    titles = [*(title for title, _ in sensor.sections), _LAST_PART]
    values = prepare(sensor.parameters).full().ravel()
    extra = len(values) - len(recursion.parameters)
    names = [f"k_{k}" for k in range(extra)] + [f"k_{identifier_of(name)}" for name in recursion.parameters]
    wide = {one.name for one in sensor.states if one.exact}
    graph = graph_of(instructions(step))
    scribe = _Scribe(sensor, prefix, names, frozenset(wide))
    while (
        more := scribe.sums(result_kinds(graph, scribe.read, PLAIN)) - wide
    ):  # what a sum of doubles becomes is a double
        wide |= more
        scribe = _Scribe(sensor, prefix, names, frozenset(wide))
    lines = statements(step, scribe.read, scribe.write, PLAIN, titles, kept={0: 0})
    constants = {n: float(value) for n, value in zip(names, values, strict=True) if n in scribe.used}
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


def field_of(state: str) -> str:
    """The name of a state in C: ``hypotheses[2].leakage`` is `hypotheses_2_leakage` there.

    Example:
        >>> field_of("hypotheses[2].covariance[leakage,lag]")
        'hypotheses_2_covariance_leakage_lag'
    """
    return identifier_of(state.replace("]", ""))


def _repeated(sensor: VirtualSensor) -> dict[str, str]:
    """States that are what an input was, of which only the change counts, by the names of the inputs.

    They are doubles, and the step gets the change.
    """
    return {one.name: one.exact for one in sensor.states if one.exact in sensor.further}


def _relative(sensor: VirtualSensor) -> Iterator[str]:
    """How far back clocks and repeated inputs are, of which now is 0."""
    repeated = _repeated(sensor)
    for one in sensor.states:
        field = field_of(one.name)
        if one.exact == TIME:
            yield f"const wide x_{field} = s->{field} - in->time;"
        if one.name in repeated:
            of = repeated[one.name]
            yield f"const real u_{of} = in->{of} == in->{of} ? R(0.0) : (real)NAN;"
            yield f"const real x_{field} = (real)(s->{field} - in->{of});"


class _Scribe:
    """How a step reads and writes states, inputs, constants and outputs; keeps what it came across."""

    def __init__(self, sensor: VirtualSensor, prefix: str, constants: list[str], wide: frozenset[str]) -> None:
        self._recursion, self._prefix, self._constants, self._wide = sensor.recursion, prefix, constants, wide
        self._clocks = {one.name for one in sensor.states if one.exact == TIME}
        self._repeated = _repeated(sensor)
        self.used: set[str] = set()

    def sums(self, kinds: Mapping[tuple[int, int], str]) -> set[str]:
        """States that become a double, by the kinds of the step's results."""
        own = {self._recursion.state[k] for (argument, k), kind in kinds.items() if argument == 0 and kind == "wide"}
        return own - self._clocks - self._repeated.keys()

    def read(self, argument: int, k: int) -> Term:
        if argument == 1:
            name = self._recursion.inputs[k]
            return Term(f"u_{name}", "wide" if name == "time" else "real")
        if argument == 2:
            self.used.add(self._constants[k])
            return Term(self._constants[k])
        name = self._recursion.state[k]
        field, relative = field_of(name), name in self._clocks or name in self._repeated
        kind = "wide" if name in self._wide and name not in self._repeated else "real"
        return Term(f"x_{field}" if relative else f"s->{field}", kind)

    def write(self, argument: int, k: int, term: Term) -> str:
        if argument == 1:
            name = self._recursion.outputs[k]
            value = f"({self._prefix}_status){term.text}" if name == "status" else number(term)
            return f"out->{name} = {value};"
        name = self._recursion.state[k]
        field = field_of(name)
        if name in self._clocks:
            return f"if ({term.text} == 0) s->{field} = in->time;"
        if name in self._repeated:
            return f"if ({term.text} == 0) s->{field} = in->{self._repeated[name]};"
        return f"s->{field} = {as_kind('wide', term) if name in self._wide else number(term)};"


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
