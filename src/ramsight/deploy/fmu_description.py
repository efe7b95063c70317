"""modelDescription.xml of FMI 2.0 and 3.0, and buildDescription.xml."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from xml.sax.saxutils import quoteattr

from ramsight._version import __version__
from ramsight.deploy.c_function import literal
from ramsight.deploy.fmu_model import FmuModel
from ramsight.deploy.fmu_units import BASE, DISPLAY, ENUMERATIONS, Variable

_HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'
TOOL = f"ramsight {__version__}"


def _attributes(**values: object) -> str:
    return "".join(f" {name}={quoteattr(str(value))}" for name, value in values.items() if value not in (None, ""))


def _units(variables: Sequence[Variable]) -> str:
    lines = []
    for unit in dict.fromkeys(v.unit for v in variables if v.unit):
        shown = DISPLAY.get(unit)
        said = _attributes(name=shown.name, factor=repr(shown.factor), offset=shown.offset or None) if shown else ""
        display = f"<DisplayUnit{said}/>" if shown else ""
        lines.append(f"    <Unit name={quoteattr(unit)}><BaseUnit{_attributes(**BASE[unit])}/>{display}</Unit>")
    return "\n".join(["  <UnitDefinitions>", *lines, "  </UnitDefinitions>"])


def _types(variables: Sequence[Variable]) -> list[str]:
    """The enumerations that the variables are of, by their kinds."""
    return [kind for kind in ENUMERATIONS if any(v.kind == kind for v in variables)]


def _items(kind: str, indent: str) -> list[str]:
    of = ENUMERATIONS[kind]
    return [f"{indent}<Item{_attributes(name=one.name, value=int(one), description=one.text)}/>" for one in of]


def _until_variables(model: FmuModel, types: Iterable[str]) -> Iterator[str]:
    """What stands before the variables."""
    yield _units(model.variables)
    yield from types
    yield from ("  <LogCategories>", '    <Category name="logStatusError"/>', "  </LogCategories>")
    yield f"  <DefaultExperiment{_attributes(startTime='0', stopTime='10', stepSize=model.step)}/>"
    yield "  <ModelVariables>"


def _said(reference: int, v: Variable, model: FmuModel) -> str:
    """Attributes of a variable that every kind has."""
    discrete = v.kind != "real" or (v.causality == "output" and not model.linear)
    variability = "fixed" if v.causality == "parameter" else "discrete" if discrete else "continuous"
    initial = {"input": None, "independent": None, "parameter": "exact"}.get(v.causality, "calculated")
    about = {"description": v.text, "causality": v.causality, "variability": variability, "initial": initial}
    return _attributes(name=v.name, valueReference=reference, **about)


def _number(v: Variable) -> str:
    """Attributes of a value: unit, range, usual size and start."""
    shown = DISPLAY.get(v.unit)
    ends = {name: None if end is None else literal(end) for name, end in (("min", v.least), ("max", v.most))}
    return _attributes(
        declaredType=v.kind.capitalize() if v.enumeration else None,
        unit=v.unit,
        displayUnit=shown.name if shown else None,
        **ends,
        nominal=v.nominal,
        start=_start(v),
    )


def _start(v: Variable) -> str | None:
    if v.start is None:
        return None
    return literal(v.start) if v.kind == "real" else str(bool(v.start)).lower()


def description_2(model: FmuModel, identifier: str, token: str, sources: Sequence[str]) -> str:
    """modelDescription.xml of FMI 2.0."""
    variables = model.variables
    lines = [
        f"<fmiModelDescription{_attributes(fmiVersion='2.0', modelName=identifier, guid=token)}"
        f"{_attributes(description=model.description, generationTool=TOOL, variableNamingConvention='structured')}"
        ' numberOfEventIndicators="0">',
        f"  <CoSimulation{_attributes(modelIdentifier=identifier, canHandleVariableCommunicationStepSize='true')}"
        f"{_attributes(canInterpolateInputs=str(model.linear).lower(), canGetAndSetFMUstate='true')}"
        ' canSerializeFMUstate="true" canNotUseMemoryManagementFunctions="true">',
        "    <SourceFiles>",
        *(f"      <File name={quoteattr(name)}/>" for name in sources),
        "    </SourceFiles>",
        "  </CoSimulation>",
        *_until_variables(model, _types_2(variables)),
    ]
    for k, v in enumerate(variables):
        kind = "Enumeration" if v.enumeration else {"real": "Real", "truth": "Boolean"}[v.kind]
        lines.append(f"    <ScalarVariable{_said(k, v, model)}><{kind}{_number(v)}/></ScalarVariable>")
    outputs = [k for k, v in enumerate(variables, 1) if v.causality == "output"]
    unknowns = [f'      <Unknown index="{k}"/>' for k in outputs]
    lines += ["  </ModelVariables>", "  <ModelStructure>", "    <Outputs>", *unknowns, "    </Outputs>"]
    lines += ["    <InitialUnknowns>", *unknowns, "    </InitialUnknowns>", "  </ModelStructure>"]
    lines.append("</fmiModelDescription>")
    return _HEAD + "\n".join(lines) + "\n"


def description_3(model: FmuModel, identifier: str, token: str) -> str:
    """modelDescription.xml of FMI 3.0; arguments as `description_2`."""
    variables = model.variables
    lines = [
        f"<fmiModelDescription{_attributes(fmiVersion='3.0', modelName=identifier, instantiationToken=token)}"
        f"{_attributes(description=model.description, generationTool=TOOL, variableNamingConvention='structured')}>",
        f"  <CoSimulation{_attributes(modelIdentifier=identifier, canHandleVariableCommunicationStepSize='true')}"
        ' canGetAndSetFMUState="true" canSerializeFMUState="true"/>',
        *_until_variables(model, _types_3(variables)),
    ]
    for k, v in enumerate(variables):
        kind = "Enumeration" if v.enumeration else {"real": "Float64", "truth": "Boolean"}[v.kind]
        lines.append(f"    <{kind}{_said(k, v, model)}{_number(v)}/>")
    outputs = [k for k, v in enumerate(variables) if v.causality == "output"]
    lines += ["  </ModelVariables>", "  <ModelStructure>"]
    lines += [f'    <Output valueReference="{k}"/>' for k in outputs]
    lines += [f'    <InitialUnknown valueReference="{k}"/>' for k in outputs]
    lines += ["  </ModelStructure>", "</fmiModelDescription>"]
    return _HEAD + "\n".join(lines) + "\n"


def _types_2(variables: Sequence[Variable]) -> Iterator[str]:
    kinds = _types(variables)
    if kinds:
        yield "  <TypeDefinitions>"
        for kind in kinds:
            yield f'    <SimpleType name="{kind.capitalize()}">'
            yield "      <Enumeration>"
            yield from _items(kind, "        ")
            yield "      </Enumeration>"
            yield "    </SimpleType>"
        yield "  </TypeDefinitions>"


def _types_3(variables: Sequence[Variable]) -> Iterator[str]:
    kinds = _types(variables)
    if kinds:
        yield "  <TypeDefinitions>"
        for kind in kinds:
            yield f'    <EnumerationType name="{kind.capitalize()}">'
            yield from _items(kind, "      ")
            yield "    </EnumerationType>"
        yield "  </TypeDefinitions>"


def build_description(identifier: str, sources: Sequence[str]) -> str:
    """buildDescription.xml of FMI 3.0: how to compile the sources."""
    files = "\n".join(f"      <SourceFile name={quoteattr(name)}/>" for name in sources)
    return (
        f'{_HEAD}<fmiBuildDescription fmiVersion="3.0">\n'
        f"  <BuildConfiguration modelIdentifier={quoteattr(identifier)}>\n"
        f'    <SourceFileSet language="C99">\n{files}\n    </SourceFileSet>\n'
        "  </BuildConfiguration>\n</fmiBuildDescription>\n"
    )
