"""A sensor's step as C: header, body, golden samples and the program that compares them."""

from __future__ import annotations

import zlib
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ramsight._version import __version__
from ramsight.deploy.c_cut import LONGEST
from ramsight.deploy.c_function import golden_table, headings, indented, literal, template
from ramsight.deploy.c_step import WrittenStep, field_of, written_step
from ramsight.deploy.sensor_words import meaning
from ramsight.engine.typed_state import Leaf
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.inputs.sample import MEASURED, SHAFT_ANGLE
from ramsight.sensor.persistence import CLOCKED, STARTED, VELOCITY
from ramsight.sensor.status import Status
from ramsight.sensor.thresholds import CREEP_VELOCITY, MOTOR_TURNS, REST_TIME, SAVE_CHANGE, START_STD
from ramsight.sensor.virtual_sensor import IS_REFERENCED, REFERENCED_NOW, VARIANCE, VirtualSensor


@dataclass(frozen=True)
class MachineTable:
    """All that differs between the sensors of machines of one kind."""

    kind: int  # of the step's text: tables of the same kind are of the same circuit, options and assumptions
    identity: int  # of machine and sensor, for slots
    stroke: float  # of the cylinder [m]
    start: Mapping[str, float]  # states before the first sample, in the struct's order
    constants: Mapping[str, float]  # what the step reads, by name

    @property
    def numbers(self) -> dict[str, float]:
        """All of it, by the names of an FMU's parameters, in the struct's order."""
        head = {"kind": float(self.kind), "identity": float(self.identity), "stroke": self.stroke}
        return {
            **{f"machine.{name}": value for name, value in head.items()},
            **{f"machine.start.{name}": value for name, value in self.start.items()},
            **{f"machine.constant.{name.removeprefix('k_')}": value for name, value in self.constants.items()},
        }


def declared_struct(table: MachineTable, prefix: str) -> str:
    """The struct of a table, and the one of the machine that was exported."""
    macro = prefix.upper()
    fields = indented(f"{prefix}_real {name};" for name in table.constants)
    return f"""/* The numbers of a machine; `ramsight export parameters` writes those of another one of this kind. */
#define {macro}_KIND UINT32_C(0x{table.kind:08X})
typedef struct {{
  uint32_t kind, identity;
  double stroke; /* [m] */
  double start[{len(table.start)}]; /* states before the first sample */
{fields}
}} {prefix}_machine;
extern const {prefix}_machine {prefix}_described; /* the machine that was exported */

"""


def initializer(table: MachineTable, prefix: str) -> str:
    """The value of a table."""
    start = ", ".join(map(literal, table.start.values()))
    numbers = ",\n".join(f"  ({prefix}_real)({literal(v)}) /* {name} */" for name, v in table.constants.items())
    head = f"UINT32_C(0x{table.kind:08X}), UINT32_C(0x{table.identity:08X}), {literal(table.stroke)}"
    return f"{{\n  {head},\n  {{{start}}},\n{numbers}\n}}"


def table_header(table: MachineTable, prefix: str, name: str) -> str:
    """A header with the table of a machine."""
    guard = f"{prefix}_{name}_MACHINE_H".upper()
    return (
        f"/* The numbers of {name}, for {prefix}_of(). Pass it before init, start or resume. */\n"
        f'#ifndef {guard}\n#define {guard}\n\n#include "{prefix}.h"\n\n'
        f"static const {prefix}_machine {prefix}_of_{name} = {initializer(table, prefix)};\n\n#endif\n"
    )


ROW = ("time [s]", "motor speed [rad/s]", "motor torque [N m]", "oil temperature [K]", "reference [m]")
"""Columns of a row of samples; what else a sensor takes comes after them."""
_SLOTS = "slots 3"
"""How the bytes of a slot are laid out; part of its identity."""
_OTHER_STATUSES = 4
"""Statuses among the golden samples in which floats may differ; doubles may in none."""


@dataclass(frozen=True)
class SensorSource:
    """The C of a sensor."""

    prefix: str  # with which all its names begin, for example `ramsight_boom`
    files: Mapping[str, str]  # text by file name
    table: MachineTable | None = None  # its machine's numbers; None of what is no sensor


def sensor_source(
    sensor: VirtualSensor,
    unit: HydraulicUnit,
    prefix: str,
    machine: str,
    *,
    single: bool,
    tabled: bool = False,
    longest: int = LONGEST,
) -> SensorSource:
    """Header and body of a sensor.

    Args:
        single: reals are floats by default.
        tabled: the machine's numbers are a table that the sensor is handed, not constants.
        longest: statements of a function, nearly; checkers whose time grows faster than a function take short ones.
    """
    recursion = sensor.recursion
    step, table, wide, declared = _tabled_step(sensor, prefix, tabled=tabled, longest=longest)
    states, wides = tuple(table.start), len(wide)
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
        machines=declared_struct(table, prefix) if tabled else "",
        chosen=f"  const {prefix}_machine *machine;\n  uint32_t chosen; /* by `of` */\n" if tabled else "",
        of=template("machine.h", **common) if tabled else "",
        bytes=f"(20 + 8 * {wides} + (int)sizeof({prefix}_real) * {len(states) - wides})",
        **common,
    )
    numbers = _by_table(table, prefix, common) if tabled else _by_constants(table, wide)
    body = template(
        "sensor.c",
        **numbers,
        begun=indented(step.begun),
        calls=indented(step.functions.calls),
        texts=indented((f'case {macro}_{s.name}: return "{s.text}";' for s in Status), 4),
        wides=wides,
        count=len(states),
        slack=START_STD,
        unknown=indented((f"out->{name} = (real)NAN;" for name in recursion.outputs if name != "status"), 4),
        turning=MOTOR_TURNS,
        creeping=CREEP_VELOCITY,
        resting=REST_TIME,
        moved=SAVE_CHANGE,
        std_change=START_STD,
        settling=2.0 * REST_TIME,
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
    each = len({one.name.partition(".")[0] for one in declared if one.name.startswith("hypotheses[")})
    inner = _inner_header(step, numbers["constants"], each, prefix, common)
    parts = {
        f"{name}.c": template("step.c", part=step.titles[name], functions=text, **common)
        for name, text in step.functions.texts.items()
    }
    return SensorSource(prefix, {f"{prefix}.h": header, f"{prefix}.c": body, f"{prefix}_step.h": inner, **parts}, table)


def _inner_header(step: WrittenStep, constants: str, each: int, prefix: str, common: Mapping[str, object]) -> str:
    """What the parts of a step share.

    Args:
        each: hypotheses.
    """
    return template(
        "step.h",
        constants=constants,
        alike=template("step_each.h", p=prefix, each=each, of_each=indented(step.functions.each)) if each else "",
        each=f"  {prefix}_of_each each[EACH];\n" if each else "",
        fields=indented(step.functions.work),
        declared="\n".join(step.functions.headers),
        **common,
    )


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
    """Inputs and outputs with their units, a row each of a Markdown table."""
    rows = [(f"in.{name}", *said) for name, said in input_words(sensor).items()]
    rows += [(f"out.{name}", *said) for name, said in output_words(sensor).items()]
    return "\n".join(f"| `{name}` | {unit} | {words} |" for name, unit, words in rows)


def input_words(sensor: VirtualSensor) -> dict[str, tuple[str, str]]:
    """Unit and meaning of each input, in the order in which C has them."""
    return {
        "time": ("s", "of any clock; only differences count"),
        "motor_speed": ("rad/s", "positive extends"),
        "motor_torque": ("N m", ""),
        "oil_temperature": ("K", ""),
        **dict.fromkeys(sensor.commands, ("1", "command, -1 to 1")),
        **{name: MEASURED[name] for name in sensor.optional},
    }


def output_words(sensor: VirtualSensor) -> dict[str, tuple[str, str]]:
    """Unit and meaning of each output, in the order in which C has them; of the status, where to look."""
    return {
        name: (sensor.units.get(name, ""), "see below" if name == "status" else meaning(name))
        for name in sensor.recursion.outputs
    }


def machine_table(sensor: VirtualSensor, prefix: str) -> MachineTable:
    """The numbers of a sensor's machine, as the C that `sensor_source` writes with `tabled` takes them."""
    return _tabled_step(sensor, prefix, tabled=True)[1]


def _tabled_step(
    sensor: VirtualSensor, prefix: str, *, tabled: bool, longest: int = LONGEST
) -> tuple[WrittenStep, MachineTable, frozenset[str], tuple[Leaf, ...]]:
    """The step, the machine's numbers, fields that are doubles, and the states in the struct's order."""
    recursion = sensor.recursion
    step = written_step(sensor, prefix, tabled=tabled, longest=longest)
    wide, constants = step.wide, step.constants
    declared = tuple(sorted(sensor.states, key=lambda one: one.name not in wide))
    values = dict(zip(recursion.state, sensor.initial.tolist(), strict=True))
    start = {field_of(one.name): float(values[one.name]) for one in declared}
    identity = "\n".join((_SLOTS, sensor.kind, *start, *recursion.parameters)).encode() + sensor.parameters.tobytes()
    kind = "\n".join((_SLOTS, *start, *constants, *step.begun, *step.functions.texts.values())).encode()
    table = MachineTable(zlib.crc32(kind), zlib.crc32(identity), float(sensor.stroke), start, dict(constants))
    return step, table, frozenset(map(field_of, wide)), declared


def _by_constants(table: MachineTable, wide: Container[str]) -> dict[str, str]:
    """How the body has its machine's numbers: as constants."""
    return {
        "constants": "\n".join(f"static const real {name} = R({literal(v)});" for name, v in table.constants.items()),
        "initial": indented(
            f"s->{name} = {'' if name in wide else 'R'}({literal(v)});" for name, v in table.start.items() if v
        ),
        "identity": f"UINT32_C(0x{table.identity:08X})",
        "stroked": repr(table.stroke),
        **dict.fromkeys(("defined", "begins", "keeps", "kept", "likewise", "beside"), ""),
    }


def _by_table(table: MachineTable, prefix: str, common: Mapping[str, object]) -> dict[str, str]:
    """The same as a table that it is handed."""
    defined = f"const {prefix}_machine {prefix}_described = {initializer(table, prefix)};"
    return {
        "constants": "\n".join(f"#define {name} (s->machine->{name})" for name in table.constants),
        "defined": f"{defined}\n\n",
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
