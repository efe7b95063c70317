"""SSP packages: a unit's plant and its sensor, or its control, as FMUs that are wired together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import quoteattr

from ramsight._version import __version__
from ramsight.deploy.c_step import identifier_of
from ramsight.deploy.fmu import MadeFmu, make_fmu, zipped
from ramsight.deploy.fmu_model import ACTUAL_SPEED
from ramsight.deploy.fmu_units import BASE, ENUMERATIONS, Variable
from ramsight.deploy.machine_parameters import parameter_set
from ramsight.deploy.profiles import ControlOptions
from ramsight.machine.description import Machine
from ramsight.output import atomic_path, check_target
from ramsight.sensor.inputs.sample import PRESSURES

_SPACES = {
    "ssd": "http://ssp-standard.org/SSP1/SystemStructureDescription",
    "ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon",
}


@dataclass(frozen=True)
class Part:
    """A component: an FMU."""

    name: str  # of it in the system
    source: str  # its file in the package
    variables: Mapping[str, Variable]  # of the FMU, by name


@dataclass(frozen=True)
class Wire:
    """A connection, from an output or an input of the system to an input or an output of the system."""

    of: str  # the element that it begins at; empty for the system
    begin: str  # the connector that it begins at
    to: str  # the element that it ends at; empty for the system
    end: str  # the connector that it ends at


@dataclass(frozen=True)
class Structure:
    """A system."""

    name: str
    parts: Sequence[Part]  # its components
    wires: Sequence[Wire]  # what connects them, and the system's own connectors
    parameters: str  # the file of parameters in the package
    stop: float  # end of a usual simulation [s]

    @property
    def connectors(self) -> dict[str, tuple[Variable, str]]:
        """The system's own connectors: the variable that each is of, and its kind."""
        found: dict[str, tuple[Variable, str]] = {}
        for wire in self.wires:
            if not wire.of:
                found[wire.begin] = self._variable(wire.to, wire.end), "input"
            if not wire.to:
                found[wire.end] = self._variable(wire.of, wire.begin), "output"
        return found

    def used(self, part: Part) -> list[Variable]:
        """The variables of a component that something connects, in the order of the FMU."""
        names = {wire.begin for wire in self.wires if wire.of == part.name}
        names |= {wire.end for wire in self.wires if wire.to == part.name}
        return [one for name, one in part.variables.items() if name in names]

    def _variable(self, part: str, name: str) -> Variable:
        return next(one for one in self.parts if one.name == part).variables[name]


def system_structure(structure: Structure) -> str:
    """The text of SystemStructure.ssd."""
    return "\n".join(_lines(structure)) + "\n"


def _lines(structure: Structure) -> Iterator[str]:
    spaces = " ".join(f'xmlns:{key}="{value}"' for key, value in _SPACES.items())
    name, tool = quoteattr(structure.name), quoteattr(f"ramsight {__version__}")
    yield '<?xml version="1.0" encoding="UTF-8"?>'
    yield f'<ssd:SystemStructureDescription {spaces} version="1.0" name={name} generationTool={tool}>'
    yield f"  <ssd:System name={name}>"
    yield "    <ssd:Connectors>"
    for own, (variable, kind) in structure.connectors.items():
        yield from _connector(own, kind, variable, "      ")
    yield "    </ssd:Connectors>"
    yield "    <ssd:ParameterBindings>"
    yield f'      <ssd:ParameterBinding type="application/x-ssp-parameter-set" source="{structure.parameters}"/>'
    yield "    </ssd:ParameterBindings>"
    yield "    <ssd:Elements>"
    for part in structure.parts:
        yield f'      <ssd:Component name="{part.name}" type="application/x-fmu-sharedlibrary" source="{part.source}">'
        yield "        <ssd:Connectors>"
        for variable in structure.used(part):
            yield from _connector(variable.name, variable.causality, variable, "          ")
        yield "        </ssd:Connectors>"
        yield "      </ssd:Component>"
    yield "    </ssd:Elements>"
    yield "    <ssd:Connections>"
    for wire in structure.wires:
        begin = f'startElement="{wire.of}" ' if wire.of else ""
        end = f'endElement="{wire.to}" ' if wire.to else ""
        yield f'      <ssd:Connection {begin}startConnector="{wire.begin}" {end}endConnector="{wire.end}"/>'
    yield "    </ssd:Connections>"
    yield "  </ssd:System>"
    yield from _declarations(structure)
    yield f'  <ssd:DefaultExperiment startTime="0" stopTime="{structure.stop:g}"/>'
    yield "</ssd:SystemStructureDescription>"


def _connector(name: str, kind: str, variable: Variable, indent: str) -> Iterator[str]:
    yield f'{indent}<ssd:Connector name="{name}" kind="{kind}">{_typed(variable)}</ssd:Connector>'


def _typed(variable: Variable) -> str:
    if variable.enumeration:
        return f'<ssc:Enumeration name="{variable.kind.capitalize()}"/>'
    if variable.kind == "truth":
        return "<ssc:Boolean/>"
    return f'<ssc:Real unit="{variable.unit}"/>' if variable.unit else "<ssc:Real/>"


def _declarations(structure: Structure) -> Iterator[str]:
    """Enumerations and units of the connectors."""
    used = [one for part in structure.parts for one in structure.used(part)]
    kinds = [kind for kind in ENUMERATIONS if any(one.kind == kind for one in used)]
    if kinds:
        yield "  <ssd:Enumerations>"
        for kind in kinds:
            yield f'    <ssc:Enumeration name="{kind.capitalize()}">'
            yield from (f'      <ssc:Item name="{one.name}" value="{int(one)}"/>' for one in ENUMERATIONS[kind])
            yield "    </ssc:Enumeration>"
        yield "  </ssd:Enumerations>"
    units = dict.fromkeys(one.unit for one in used if one.unit)
    if units:
        yield "  <ssd:Units>"
        for unit in units:
            base = " ".join(f'{key}="{value}"' for key, value in BASE[unit].items())
            yield f'    <ssc:Unit name="{unit}"><ssc:BaseUnit {base}/></ssc:Unit>'
        yield "  </ssd:Units>"


PLANT, SENSOR, CONTROL = "plant", "sensor", "control"
DESCRIPTION, PARAMETERS = "SystemStructure.ssd", "resources/parameters.ssv"
_STOP = 10.0  # s
_SPEEDS = ("motor_speed", "motor_acceleration")
_LOADS = ("load", "load_rate")
_STARTED = ("oil_temperature", "load")  # inputs that have a value at the start
_ORDERS = ("ask", "target", "steering", "speed")
_SAID = ("position", "position_std", "position_bound", "status")
_DECIDED = ("motor_speed_command", "activity", "reason")


@dataclass(frozen=True)
class WrittenSsp:
    """What was written."""

    path: Path  # of the package
    components: tuple[str, ...]  # names of its FMUs
    connections: int  # how many there are
    parameters: int  # how many values its parameter set has
    binaries: tuple[str, ...]  # platforms of the FMUs' binaries


def write_ssp(
    machine: Machine,
    unit: str,
    out: str | Path,
    *,
    control: ControlOptions | None = None,
    fmi: int = 2,
    platforms: Sequence[str] | None = None,
    compiler: str | None = None,
) -> WrittenSsp:
    """Write a package of a unit's plant with its sensor, or with the control that drives it.

    Args:
        control: how a control drives; None for the sensor alone.
        fmi: version of the FMUs, 2 or 3.

    Raises:
        DescriptionError: there is no such sensor or version.
        OutputError: the file cannot be written.
        CompilerError: a compiler refuses the C, or ziglang is missing.
    """
    path = Path(out)
    check_target(path, (".ssp",))
    second = CONTROL if control else SENSOR
    made = {
        name: make_fmu(machine, unit, what=name, fmi=fmi, control=control, platforms=platforms, compiler=compiler)
        for name in (PLANT, second)
    }
    parts = [Part(name, _place(name), {v.name: v for v in one.variables}) for name, one in made.items()]
    wires = tuple(_wires(parts[0], parts[1]))
    title = f"ramsight_{identifier_of(unit)}"
    numbers = dict(_numbers(made))
    structure = Structure(title, parts, wires, PARAMETERS, _STOP)
    content = {
        DESCRIPTION: system_structure(structure).encode(),
        PARAMETERS: parameter_set(f"{machine.name} {unit}", numbers).encode(),
        **{_place(name): zipped(one.content, "modelDescription.xml") for name, one in made.items()},
    }
    with atomic_path(path) as draft:
        draft.write_bytes(zipped(content, DESCRIPTION))
    return WrittenSsp(path, tuple(made), len(wires), len(numbers), made[PLANT].binaries)


def _place(name: str) -> str:
    return f"resources/{name}.fmu"


def _wires(plant: Part, second: Part) -> Iterator[Wire]:
    """What connects a plant and a sensor, alone or with its control, and the system's own inputs and outputs."""
    drives = second.name == CONTROL
    if drives:
        yield from (Wire("", name, second.name, name) for name in _ORDERS)
        yield Wire(second.name, "motor_speed_command", plant.name, "motor_speed")
    else:
        yield from (Wire("", name, plant.name, name) for name in _SPEEDS)
    yield from (Wire("", name, plant.name, name) for name in _LOADS)
    yield Wire(plant.name, ACTUAL_SPEED, second.name, "motor_speed")
    yield Wire(plant.name, "motor_torque", second.name, "motor_torque")
    for pressure, side in zip(PRESSURES, "ab", strict=True):
        if pressure in second.variables and second.variables[pressure].causality == "input":
            yield Wire(plant.name, f"pressure_chamber_{side}", second.name, pressure)
    yield from (Wire(second.name, name, "", name) for name in (*_SAID, *(_DECIDED if drives else ())))
    yield Wire(plant.name, "position", "", "true_position")


def _numbers(made: dict[str, MadeFmu]) -> Iterator[tuple[str, float | bool]]:
    """Values by their names in the system: of a plant all, of a sensor what it knows at the start."""
    place = next(v.start or 0.0 for v in made[PLANT].variables if v.name == "start_position")
    for name, one in made.items():
        for v in one.variables:
            if v.causality == "parameter" or (v.causality == "input" and v.name in _STARTED):
                yield f"{name}.{v.name}", _value(v, place)


def _value(v: Variable, place: float) -> float | bool:
    """A start value; the sensor knows where the plant begins."""
    if v.name == "start_known":
        return True
    if v.name == "start_position":
        return place
    return bool(v.start) if v.kind == "truth" else v.start or 0.0
