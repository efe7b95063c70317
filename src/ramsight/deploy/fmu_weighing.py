"""A weighing behind the sensor of an FMU."""

from __future__ import annotations

import math

from ramsight.deploy.c_step import identifier_of
from ramsight.deploy.c_weighing import scale_of, weighing_scene, weighing_source
from ramsight.deploy.fmu_behind import Behind
from ramsight.deploy.fmu_units import NOTHING, PERIOD, UNKNOWN, Variable
from ramsight.deploy.weighing_words import WeighedAs
from ramsight.machine.description import Machine
from ramsight.tool.force_scale import TERMS, UNITS, Scale
from ramsight.tool.weighing_events import Scene

_SAID = {
    "mass": ("mass", "kg", "of the last lift"),
    "mass_half_band": ("half_band", "kg", "half its 95 % band"),
    "weighings": ("count", "", "how many there were; one more with each lift"),
    "total": ("total", "kg", "mass of all cycles, one good weighing of each"),
    "total_half_band": ("total_half_band", "kg", "half its 95 % band"),
    "rated_share": ("rated_share", "", "largest load moment of the last lift over the rated one"),
    "rated_share_half_band": ("rated_share_half_band", "", "half its 95 % band"),
}
"""Members of the struct by the names of the outputs, with unit and text."""
_QUALITY = Variable("quality", "quality", "output", "", "whether the mass of the last lift may be used")
_STEEPEST = math.radians(30.0)


def weighing_behind(machine: Machine, unit: str, prefix: str) -> Behind:
    """A weighing.

    Raises:
        DescriptionError: the unit lifts nothing that is weighed.
    """
    scene, of = weighing_scene(machine, unit), f"{prefix}_weighing"
    takes = (*_others(scene), *_scale(scale_of(scene, None)))
    return Behind(
        weighing_source(scene, prefix, machine.name).files,
        f"{of}.h",
        f"{of} weighing;",
        takes,
        tuple(Variable(name, "real", "output", unit_of, text) for name, (_, unit_of, text) in _SAID.items()),
        (_QUALITY,),
        lambda place: _began(of) + _says(place),
        lambda place: _stepped(scene, of) + _says(place),
        " and weighing",
        PERIOD,
        unknown=int(WeighedAs.NONE),
    )


def _others(scene: Scene) -> list[Variable]:
    """Inputs of the units beside the one that lifts."""
    found = []
    for one in scene.machine.units:
        if one.name != scene.unit:
            name = identifier_of(one.name)
            found += [
                Variable(f"{name}_position", "real", "input", "m", f"of the {one.name}, {NOTHING}", UNKNOWN),
                Variable(f"{name}_std", "real", "input", "m", "its standard deviation", scene.others.held_std),
                Variable(f"{name}_velocity", "real", "input", "m/s", f"of the {one.name}", 0.0),
            ]
    return found


def _scale(scale: Scale) -> list[Variable]:
    """Parameters: slope, terms of the scale, and the upper triangle of their covariance."""
    text = "of the machine, its front up"
    found = [Variable("inclination", "real", "parameter", "rad", text, 0.0, None, -_STEEPEST, _STEEPEST)]
    for name, unit, value in zip(TERMS, UNITS, scale.value, strict=True):
        text = f"{name.replace('_', ' ')} of the scale, as known masses teach it"
        found.append(Variable(f"scale_{name}", "real", "parameter", unit.strip("1"), text, float(value)))
    for k, one in enumerate(TERMS):
        for n, other in enumerate(TERMS[k:], k):
            text = f"of {one.replace('_', ' ')} and {other.replace('_', ' ')}, in SI units"
            name = f"scale_covariance_{k + 1}{n + 1}"
            found.append(Variable(name, "real", "parameter", "", text, float(scale.covariance[k, n])))
    return found


def _began(of: str) -> str:
    terms = ", ".join(f"m->real[SCALE_{name.upper()}]" for name in TERMS)
    pairs = [(k, n) for k in range(1, len(TERMS) + 1) for n in range(k, len(TERMS) + 1)]
    covariance = ", ".join(f"m->real[SCALE_COVARIANCE_{k}{n}]" for k, n in pairs)
    return (
        f"  if (!(fabs(m->real[INCLINATION]) <= {_STEEPEST!r}))\n"
        '    return "inclination has to be from -30 to 30 degrees";\n'
        f"  const double terms[] = {{{terms}}};\n"
        f"  const double covariance[] = {{{covariance}}};\n"
        f"  {of}_init(&m->memory.weighing);\n"
        f"  {of}_scale(&m->memory.weighing, terms, covariance);\n"
        "  m->memory.weighing.inclination = m->real[INCLINATION];\n"
    )


def _stepped(scene: Scene, of: str) -> str:
    lines = [f"{of}_inputs at;", f"{of}_sense(&at, &in, &out);"]
    for one in scene.machine.units:
        if one.name != scene.unit:
            name, stroke = identifier_of(one.name), float(one.cylinder.stroke)
            macro = f"{name.upper()}_POSITION"
            known = f"fabs(m->real[{macro}]) <= 1e9"
            lines += [
                f"at.{name}_position = {known} ? m->real[{macro}] : {0.5 * stroke!r};",
                f"at.{name}_std = {known} ? m->real[{name.upper()}_STD] : {stroke / math.sqrt(12.0)!r};",
                f"at.{name}_velocity = m->real[{name.upper()}_VELOCITY];",
            ]
    lines.append(f"{of}_step(&m->memory.weighing, &at);")
    return "".join(f"  {line}\n" for line in lines)


def _says(place: int) -> str:
    lines = [f"m->real[{place + k}] = (double)m->memory.weighing.{of};" for k, (of, *_) in enumerate(_SAID.values())]
    return "".join(f"  {line}\n" for line in [*lines, "m->whole[1] = (int)m->memory.weighing.quality;"])
