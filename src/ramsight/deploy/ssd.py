"""SystemStructure.ssd of SSP 1.0: components, their connectors, and what connects them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

from ramsight._version import __version__
from ramsight.deploy.fmu_units import BASE
from ramsight.deploy.fmu_variable import ENUMERATIONS, Variable

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
