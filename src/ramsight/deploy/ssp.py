"""SSP packages: a unit's plant and its sensor, or its control, as FMUs that are wired together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from ramsight.deploy.c_step import identifier_of
from ramsight.deploy.control_options import ControlOptions
from ramsight.deploy.fmu import MadeFmu, make_fmu, zipped
from ramsight.deploy.fmu_model import ACTUAL_SPEED
from ramsight.deploy.fmu_variable import Variable
from ramsight.deploy.machine_parameters import parameter_set
from ramsight.deploy.ssd import Part, Structure, Wire, system_structure
from ramsight.machine.description import Machine
from ramsight.output import atomic_path, check_target
from ramsight.sensor.inputs.sample import PRESSURES

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
    """What was written.

    Attributes:
        path: of the package.
        components: names of its FMUs.
        connections: how many there are.
        parameters: how many values its parameter set has.
        binaries: platforms of the FMUs' binaries.
    """

    path: Path
    components: tuple[str, ...]
    connections: int
    parameters: int
    binaries: tuple[str, ...]


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
        machine: the machine.
        unit: name of its unit.
        out: the file, `.ssp`.
        control: how a control drives; None for the sensor alone.
        fmi: version of the FMUs, 2 or 3.
        platforms: as `write_fmu`.
        compiler: as `write_fmu`.

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
