"""What an FMU holds: its variables, and the C of its model."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca

from ramsight.deploy.c_function import PLAIN, array_function, literal, template
from ramsight.deploy.c_sensor import sensor_source
from ramsight.deploy.c_step import field_of
from ramsight.deploy.fmu_behind import Behind
from ramsight.deploy.fmu_units import NOTHING, PERIOD, UNKNOWN, Variable, parameter_unit, usual_sizes
from ramsight.deploy.sensor_words import titled_meaning
from ramsight.engine.equation import OdeModel
from ramsight.engine.ode_module import pieces
from ramsight.engine.run import DEFAULT_RTOL
from ramsight.plant.circuit import COMMANDED, is_pressure
from ramsight.plant.oil import ATMOSPHERE
from ramsight.plant.unit import HydraulicUnit, circuit, reach
from ramsight.sensor.inputs.sample import MEASURED
from ramsight.sensor.kalman import kalman
from ramsight.sensor.kind import Kind, state_of
from ramsight.sensor.quantity import FACTOR_OF
from ramsight.sensor.thresholds import START_STD
from ramsight.sensor.virtual_sensor import REFERENCED_NOW, VARIANCE, VirtualSensor

_T0 = 313.15  # K
ACTUAL_SPEED = "motor_speed_actual"
"""Output of a plant: the speed of the motor, by its servo or as the input has it."""


@dataclass(frozen=True)
class FmuModel:
    """The model of an FMU."""

    # time first, then the other reals, the enumerations, the truths; the place is the value reference
    variables: tuple[Variable, ...]
    config: str  # C that states how many there are and what the model remembers
    files: Mapping[str, str]  # C of the model by name
    description: str  # a line of text
    step: float  # a usual communication step [s]
    linear: bool  # whether inputs may have slopes
    sensor: VirtualSensor | None = None  # that it is made of, if it is one's

    @property
    def counts(self) -> dict[str, int]:
        """How many variables of each sort: reals, enumerations, truths."""
        sorts = Counter("word" if v.enumeration else v.kind for v in self.variables)
        return {sort: sorts[sort] for sort in ("real", "word", "truth")}


def _memory(prefix: str, behind: Behind | None, tabled: bool) -> str:
    own = f" {prefix}_machine machine;" if tabled else ""
    return f"typedef struct {{ {prefix} sensor;{own}{f' {behind.member}' if behind else ''} }} Memory;"


_TIME = Variable("time", "real", "independent", "s", "time")


def sensor_model(
    unit: HydraulicUnit, prefix: str, machine: str, behind: Behind | None = None, *, tabled: bool = False
) -> FmuModel:
    """The `kalman` sensor of a unit, and what stands behind it."""
    sensor = kalman(unit)
    source = sensor_source(sensor, unit, prefix, machine, single=False, tabled=tabled)
    numbers = source.table.numbers if tabled and source.table else {}
    says = [name for name in sensor.recursion.outputs if name != "status"]
    stroke = float(unit.cylinder.stroke)
    variables = _sensor_variables(sensor, says, stroke, None if tabled else stroke, numbers, behind)
    own = 7 + len(sensor.further) + (len(behind.takes) if behind else 0)
    first = own + len(numbers)
    macros = {name.upper(): k for k, name in enumerate(v.name for v in variables[:own]) if name != "time"}
    words = {"p": prefix, "first": own, "count": len(numbers) - 2}
    config = [
        f'#include "{prefix}.h"',
        *([f'#include "{behind.header}"'] if behind else []),
        *(f"#define {name} {k}" for name, k in macros.items()),
    ]
    config += ["#define REFERENCE_KNOWN 0", "#define START_KNOWN 1", _memory(prefix, behind, tabled)]
    model = template(
        "sensor_model.c",
        p=prefix,
        P=prefix.upper(),
        unknown=behind.unknown if behind else 0,
        causality=_letters(variables),
        stroke="machine.stroke" if tabled else f"{stroke:g} m",
        machine=template("fmu_machine.c", **words) if tabled else "",
        again="  m->memory.sensor.machine = &m->memory.machine; /* of this instance, whoever kept the state */\n"
        if tabled
        else "",
        starts="\n".join(_starts(variables)),
        further="".join(f"  in.{name} = m->real[{name.upper()}];\n" for name in sensor.further),
        says="\n".join(f"  m->real[{first + k}] = out->{name};" for k, name in enumerate(says)),
        began=behind.began(first + len(says)) if behind else "",
        referred=behind.refer if behind else "",
        driven=behind.step(first + len(says)) if behind else "",
        factors="\n".join(
            f"  out.{n}_factor = s->{field_of(state_of(Kind.DESCRIBED, one))};" for n, one in FACTOR_OF.items()
        ),
        variance=field_of(VARIANCE),
    )
    return FmuModel(
        _sized(variables, unit),
        "\n".join(config),
        {**source.files, **(behind.files if behind else {}), "model.c": model},
        f"Virtual position sensor{behind.title if behind else ''} of the {unit.name} of {machine}",
        behind.period if behind else PERIOD,
        linear=False,
        sensor=sensor,
    )


def _sensor_variables(
    sensor: VirtualSensor,
    says: Sequence[str],
    stroke: float,
    most: float | None,
    numbers: Mapping[str, float],
    behind: Behind | None,
) -> tuple[Variable, ...]:
    """Inputs, parameters and outputs, in the order of their references; `most` is the largest `start_std` [m]."""
    known = "position at the start, where start_known"
    return (
        _TIME,
        Variable("motor_speed", "real", "input", "rad/s", "motor speed, positive extends", 0.0),
        Variable("motor_torque", "real", "input", "N.m", "motor torque", 0.0),
        Variable("oil_temperature", "real", "input", "K", "oil temperature", _T0),
        Variable("reference", "real", "input", "m", "position that is known, where reference_known", 0.0),
        Variable("start_position", "real", "parameter", "m", known, 0.0, None, 0.0, stroke),
        Variable("start_std", "real", "parameter", "m", "its standard deviation", START_STD, None, 0.0, most),
        *(Variable(n, "real", "input", "", "command, -1 to 1", COMMANDED, None, -1.0, 1.0) for n in sensor.commands),
        *(
            Variable(n, "real", "input", MEASURED[n][0], f"{n.replace('_', ' ')}, {NOTHING}", UNKNOWN)
            for n in sensor.optional
        ),
        *(behind.takes if behind else ()),
        *(Variable(n, "real", "parameter", "", f"{n}, in SI units", value) for n, value in numbers.items()),
        *(
            Variable(_output(n, sensor), "real", "output", _fmi_unit(sensor.units[n]), titled_meaning(n), **_chance(n))
            for n in says
        ),
        *(behind.says if behind else ()),
        Variable("status", "status", "output", "", "what the position is worth"),
        *(behind.words if behind else ()),
        Variable("reference_known", "truth", "input", "", "whether the reference counts at this sample", 0.0),
        Variable("start_known", "truth", "parameter", "", "whether the position at the start is known", 0.0),
    )


def _output(name: str, sensor: VirtualSensor) -> str:
    """What an output is called: an estimate of what is an input, too, says that it is one."""
    return f"{name}_estimated" if name in sensor.further else name


def plant_model(unit: HydraulicUnit, machine: str) -> FmuModel:
    """The simulated unit, with its solver."""
    model = circuit(unit)
    ode = model.ode
    functions, sizes = pieces(ode)
    shown = [k for k, out in enumerate(ode.outputs) if not out.name.startswith(("capacity_", "volume_", "stored."))]
    functions = {name: f for name, f in functions.items() if name not in {"dense", "extremes"}}
    functions["rest"] = _rest(unit, ode)
    stroke = float(unit.cylinder.stroke)
    kelvin = ode.parameters.index("oil_temperature")
    inputs = (
        Variable("motor_speed", "real", "input", "rad/s", "motor speed, positive extends", 0.0),
        Variable("load", "real", "input", "N", "load at the rods, positive against lifting", 0.0),
        Variable("oil_temperature", "real", "input", "K", "oil temperature, held through a step", _T0),
        Variable(
            "motor_acceleration", "real", "input", "rad/s2", "slope of motor_speed in the next step; 0 holds it", 0.0
        ),
        Variable("load_rate", "real", "input", "N/s", "slope of load in the next step; 0 holds it", 0.0),
        Variable("start_position", "real", "parameter", "m", "position at the start", 0.5 * stroke, None, 0.0, stroke),
    )
    parameters = tuple(
        _parameter(name, float(value))
        for name, value in zip(ode.parameters, model.values, strict=True)
        if name != "oil_temperature"
    )
    taken = {v.name for v in inputs}
    states = tuple(
        Variable(s.name + "_actual" * (s.name in taken), "real", "output", _fmi_unit(s.unit), s.name.replace("_", " "))
        for s in ode.states
    )
    says = tuple(
        Variable(ode.outputs[k].name, "real", "output", _fmi_unit(ode.outputs[k].unit), ode.outputs[k].name)
        for k in shown
    )
    followed = "motor_speed" in {one.name for one in ode.states}
    reached = () if followed else (Variable(ACTUAL_SPEED, "real", "output", "rad/s", "motor speed at the step's end"),)
    variables = (_TIME, *inputs, *parameters, *states, *says, *reached)
    first = {"PARAMETER": 7, "STATE": 7 + len(parameters), "OUTPUT": 7 + len(parameters) + len(states)}
    config = [f"#define {v.name.upper()} {k}" for k, v in enumerate(inputs, 1)]
    config += [f"#define FIRST_{name} {k}" for name, k in first.items()]
    config += [f"#define {name} {sizes[name]}" for name in ("N", "NU", "NJ", "NW", "NQ")]
    config += [
        f"#define NP {len(ode.parameters)}",
        f"#define NY {len(ode.outputs)}",
        f"#define TEMPERATURE_AMONG {kelvin}",
    ]
    config.append("typedef struct { double x[N], q[NQ], next, temperature, end[NU], before[NU]; } Memory;")
    text = template(
        "plant_model.c",
        functions="\n\n".join(array_function(name, f, PLAIN) for name, f in functions.items()),
        causality=_letters(variables),
        starts="\n".join(_starts(variables)),
        shown=", ".join(map(str, shown)),
        reached="" if followed else f"  m->real[FIRST_OUTPUT + {len(says)}] = u[0];\n",
        tolerances=", ".join(literal(s.tolerance) for s in ode.states),
        pressures=", ".join(str(int(is_pressure(s))) for s in ode.states),
    )
    files = {"model.c": text, "real.h": template("real.h"), "rodas4.h": template("rodas4.h")}
    description = f"Simulated {unit.name} of {machine}, with its own solver"
    return FmuModel(_sized(variables, unit), "\n".join(config), files, description, 0.01, linear=True)


def _parameter(name: str, value: float) -> Variable:
    """A number of the parts; what has a unit is a size, and not below 0."""
    unit = parameter_unit(name)
    return Variable(
        name, "real", "parameter", unit, name if unit else f"{name}, in SI units", value, None, 0.0 if unit else None
    )


def _chance(name: str) -> dict[str, float]:
    """Range of an output that is a probability, or a truth in reals."""
    return {"least": 0.0, "most": 1.0} if name.endswith(("_probability", REFERENCED_NOW)) else {}


def _sized(variables: Sequence[Variable], unit: HydraulicUnit) -> tuple[Variable, ...]:
    """Variables with their usual sizes; a parameter's is its value."""
    sizes = usual_sizes(unit)

    def size(v: Variable) -> float | None:
        uncertain = v.unit == "m" and v.name.endswith(("_std", "_bound"))
        return None if v.causality == "parameter" else START_STD if uncertain else sizes.get(v.unit)

    return tuple(replace(v, nominal=size(v)) for v in variables)


def config_text(model: FmuModel, token: str) -> str:
    """The header that an FMU's C files share."""
    counts = model.counts
    lines = [f'#define TOKEN "{token}"', f"#define REALS {counts['real']}", f"#define WHOLES {counts['word']}"]
    lines += [
        f"#define TRUTHS {counts['truth']}",
        f"#define TOLERANCE {DEFAULT_RTOL}",
        "#define HAS_TIME 1",
        model.config,
    ]
    return "#ifndef FMU_CONFIG_H\n#define FMU_CONFIG_H\n" + "\n".join(lines) + "\n#endif\n"


def _letters(variables: Sequence[Variable]) -> str:
    return "".join({"input": "i", "parameter": "p"}.get(v.causality, "o") for v in variables)


def _starts(variables: Sequence[Variable]) -> Iterator[str]:
    place = Counter[str]()
    for v in variables:
        field = "whole" if v.enumeration else v.kind
        if v.start:
            yield f"  m->{field}[{place[field]}] = {literal(v.start) if v.kind == 'real' else int(v.start)};"
        place[field] += 1


def _fmi_unit(unit: str) -> str:
    return {"N m": "N.m", "1": ""}.get(unit, unit)


def _rest(unit: HydraulicUnit, ode: OdeModel) -> ca.Function:
    """States at rest as `rest(p, position, u) -> x`, the law of `plant.unit.initial_state` for any parameters."""
    position, u, cylinder = ca.SX.sym("position"), ca.SX.sym("u", 2), unit.cylinder

    def parameter(name: str, value: float) -> Any:
        return ode.p[ode.parameters.index(name)] if name in ode.parameters else value

    area_a, area_b = (parameter(f"{cylinder.name}.area_{s}", cylinder.area(s)) for s in "ab")
    tank = parameter("tank.pressure", unit.tank_pressure)
    force = unit.lift_sign * u[1] + ATMOSPHERE * (area_a - area_b)
    on_a, on_b = area_a * tank, area_b * tank
    carries_a = force > on_a - on_b
    high_a, high_b = (reach(unit.parts(), node, "joins") for node in (cylinder.node_a, cylinder.node_b))
    x = []
    for state in ode.states:
        node = state.name.removeprefix("pressure_")
        if state.name == "position":
            x.append(position)
        elif state.name == "motor_speed":
            x.append(u[0])
        elif state.name == node:
            x.append(ca.SX(0.0))
        else:
            level = ca.if_else(carries_a, (force + on_b) / area_a, tank) if node in high_a else tank
            x.append(ca.if_else(carries_a, level, (on_a - force) / area_b) if node in high_b else level)
    return ca.Function("rest", [ode.p, position, u], [ca.vertcat(*x)], ["p", "position", "u"], ["x"])
