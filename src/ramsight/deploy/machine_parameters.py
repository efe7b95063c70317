"""`ramsight export parameters`: a machine's numbers for what was exported of another machine of its kind."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from xml.sax.saxutils import quoteattr

from ramsight._version import __version__
from ramsight.deploy.c_function import literal
from ramsight.deploy.c_sensor import MachineTable, machine_table, table_header
from ramsight.deploy.c_step import identifier_of
from ramsight.deploy.fmu_model import plant_model
from ramsight.errors import DescriptionError
from ramsight.machine.description import Machine
from ramsight.output import check_target, write_text
from ramsight.plant.build import build
from ramsight.sensor.kalman import kalman

_SPACE = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"


def write_parameters(machine: Machine, unit: str, out: str | Path, *, what: str = "sensor") -> int:
    """Write a machine's numbers.

    Args:
        out: `.ssv` for an FMU of FMI 2.0 or 3.0; `.h` for the C of a sensor.
        what: ``sensor`` (that was exported with its numbers as a table) or ``plant``.

    Returns:
        How many there are.

    Raises:
        DescriptionError: there is no such export.
        OutputError: the file cannot be written.
    """
    out = Path(out)
    check_target(out, (".ssv", ".h") if what == "sensor" else (".ssv",))
    built = build(machine.unit(unit), unit)
    if what == "plant":
        variables = plant_model(built, machine.name).variables
        numbers = {v.name: v.start or 0.0 for v in variables if v.causality == "parameter"}
        text = parameter_set(f"{machine.name} {unit}", numbers)
    elif what == "sensor":
        prefix = f"ramsight_{identifier_of(unit)}"
        table = machine_table(kalman(built), prefix)
        numbers, text = table.numbers, _of_sensor(table, prefix, machine.name, unit, out.suffix)
    else:
        raise DescriptionError("has no parameters", key="what", value=what, allowed="sensor, plant")
    write_text(text, out)
    return len(numbers)


def _of_sensor(table: MachineTable, prefix: str, machine: str, unit: str, suffix: str) -> str:
    if suffix == ".h":
        return table_header(table, prefix, identifier_of(machine))
    return parameter_set(f"{machine} {unit}", table.numbers)


def _valued(value: float | bool) -> str:
    """A value as an element of SSV."""
    return f'Boolean value="{str(value).lower()}"' if isinstance(value, bool) else f'Real value="{literal(value)}"'


def parameter_set(name: str, numbers: Mapping[str, float | bool]) -> str:
    """Numbers and truths as SSP's SystemStructureParameterValues 1.0.

    Example:
        >>> print(parameter_set("press ram", {"cylinder.stroke": 0.5}).splitlines()[-3].strip())
        <ssv:Parameter name="cylinder.stroke"><ssv:Real value="0.5"/></ssv:Parameter>
    """
    lines = [
        f"    <ssv:Parameter name={quoteattr(key)}><ssv:{_valued(value)}/></ssv:Parameter>"
        for key, value in numbers.items()
    ]
    tool = quoteattr(f"ramsight {__version__}")
    head = f'<ssv:ParameterSet xmlns:ssv="{_SPACE}" version="1.0" name={quoteattr(name)} generationTool={tool}>'
    body = ["  <ssv:Parameters>", *lines, "  </ssv:Parameters>", "</ssv:ParameterSet>"]
    return "\n".join(['<?xml version="1.0" encoding="UTF-8"?>', head, *body, ""])
