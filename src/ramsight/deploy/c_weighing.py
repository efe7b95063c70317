"""A weighing as C, beside the sensor of the unit that lifts: the graphs of lifts and of their tally."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca

from ramsight._version import __version__
from ramsight.deploy.c_function import PLAIN, array_function, golden_table, headings, indented, literal, template
from ramsight.deploy.c_sensor import SensorSource
from ramsight.deploy.c_step import field_of, identifier_of
from ramsight.deploy.golden_weighing import WEIGHED, golden_weighing
from ramsight.deploy.weighing_words import WeighedAs
from ramsight.engine.recursion import Recursion
from ramsight.engine.typed_state import initial_values
from ramsight.errors import DescriptionError
from ramsight.machine.description import Machine
from ramsight.normal import TWO_SIDED_95
from ramsight.plant.linked import build_linked
from ramsight.sensor.status import LEAST
from ramsight.tool.force_scale import TERMS, Scale, described_scale
from ramsight.tool.lift_law import CalledLift, called_lift
from ramsight.tool.load_chart import LoadChart
from ramsight.tool.tally_law import tally_law
from ramsight.tool.unit_tracks import Others
from ramsight.tool.weigher import law_of
from ramsight.tool.weighing_events import Scene
from ramsight.tool.weighing_tally import Tally, settings_of

_SAID = {
    "count": "count", "cycles": "total.cycles", "total": "total.mass", "total_std": "total_std", "new": "new",
    "cycle": "cycle", "quality": "quality", "mass": "mass", "std": "std", "time": "time", "duration": "duration",
    "share": "rated_share", "share_std": "rated_share_std",
}  # fmt: skip


def weighing_scene(machine: Machine, unit: str) -> Scene:
    """What a unit's lifts are weighed with, the other units in the middle of their strokes.

    Raises:
        DescriptionError: the unit lifts nothing that is weighed.
    """
    linkage = machine.linkage
    if linkage is None or linkage.payload is None or unit not in linkage.cylinders:
        allowed = "a unit of a mechanism with a payload"
        raise DescriptionError("lifts nothing that is weighed", key="unit", value=unit, allowed=allowed)
    linked = build_linked(machine)
    held = {one.name: 0.5 * one.cylinder.stroke for one in linked.units if one.name != unit}
    return Scene(linked, unit, Others(held=held), chart=LoadChart.of(linkage))


def scale_of(scene: Scene, scale: Scale | None) -> Scale:
    """A scale, or the description's."""
    return described_scale(scene.machine.unit(scene.unit), scene.weight) if scale is None else scale


def weighing_source(scene: Scene, prefix: str, machine: str, scale: Scale | None = None) -> SensorSource:
    """Header and body of a weighing.

    Args:
        scale: that it begins with; by default the description's.
    """
    unit = scene.machine.unit(scene.unit)
    law, called = law_of(scene), called_lift(scene.machine.mechanism, unit, scene.chart)
    tally = tally_law(len(scene.other_strokes) + 1)
    lift, count = law.recursion, tally.recursion
    settings = settings_of(scale_of(scene, scale), scene.other_strokes, scene.rated)
    others = [one for one in law.units if one != scene.unit]
    common = headings(prefix, machine, f"Weighing with the {scene.unit}") | {
        "lifts": len(lift.state),
        "tallies": len(count.state),
        "settings": len(settings),
        "count": len(TERMS),
        "pairs": len(TERMS) * (len(TERMS) + 1) // 2,
    }
    macro = prefix.upper()
    header = template(
        "weighing.h",
        qualities=indented(f"{macro}_QUALITY_{q.name} = {int(q)}, /* {q.text} */" for q in WeighedAs),
        inputs=indented(_inputs(law.units, scene.unit)),
        example="".join(_example(one) for one in others),
        terms=", ".join(one.replace("_", " ") for one in TERMS),
        **common,
    )
    places = {f"o_{name}": count.outputs.index(output) for name, output in _SAID.items()}
    body = template(
        "weighing.c",
        real=template("real.h"),
        half=literal(TWO_SIDED_95),
        lift="\n\n".join(array_function(f.name(), f, PLAIN) for f in _pieces(called)),
        points=(called.rests + called.moments) * (len(law.units) + 1),
        found=2 * (called.rests + called.moments),
        lookups=_lookups(called, len(law.units) + 1),
        tally=array_function("tally", _step(count, "tally"), PLAIN),
        lift_initial=", ".join(map(literal, initial_values(law.initial).tolist())),
        tally_initial=", ".join(map(literal, initial_values(tally.initial).tolist())),
        described=", ".join(map(literal, settings)),
        scale_at=len(others),
        unit=identifier_of(scene.unit),
        invalid=int(LEAST[-1]),
        row=", ".join(f"at->{field_of(name)}" for name in lift.inputs),
        ended=len(lift.outputs),
        said=len(count.outputs),
        texts=indented((f'case {macro}_QUALITY_{q.name}: return "{q.text}";' for q in WeighedAs), 4),
        **places,
        **common,
    )
    return SensorSource(prefix, {f"{prefix}_weighing.h": header, f"{prefix}_weighing.c": body})


def golden_weighing_source(source: SensorSource, scene: Scene, scale: Scale | None = None) -> SensorSource:
    """The same with a recorded run and the program that compares."""
    p = source.prefix
    known = scale_of(scene, scale)
    golden = golden_weighing(scene, Tally(known, scene.other_strokes, scene.rated))
    inputs = law_of(scene).recursion.inputs
    weighed = golden_table("golden_weighed", golden.weighed).replace("[GOLDEN]", "[WEIGHED]")
    text = (
        f"/* A simulated run of lifts, and what ramsight {__version__} weighs of it. */\n#include <math.h>\n"
        f"#define GOLDEN {len(golden.rows)}\n#define WEIGHED {len(golden.weighed)}\n"
        f"/* {', '.join(inputs)} */\n{golden_table('golden_in', golden.rows)}"
        f"/* {', '.join(WEIGHED)} */\n{weighed}"
    )
    program = template("weighing_test.c", p=p, row=", ".join(f"row[{k}]" for k in range(len(inputs))))
    files = {**source.files, f"{p}_weighing_golden.h": text, f"{p}_weighing_test.c": program}
    return replace(source, files=files)


def _step(recursion: Recursion, name: str) -> ca.Function:
    of = recursion.graph
    both = ca.densify(ca.vertcat(of.next_state, of.output))
    new, out = ca.vertsplit(both, [0, len(recursion.state), both.numel()])
    return ca.Function(name, [of.x, of.u, of.p], [new, out], ["x", "u", "p"], ["x_new", "out"], {"cse": True})


def _pieces(called: CalledLift) -> list[ca.Function]:
    """The functions of a lift, those that are called first."""
    return [called.where, called.at_rest, *([] if called.moment is None else [called.moment]), called.advance]


def _lookups(called: CalledLift, size: int) -> str:
    """Loops that ask the mechanism's laws at all points, each of so many numbers."""
    lines = [f"for (int k = 0; k < {called.rests}; k++) at_rest(points + {size} * k, found + 2 * k);"]
    if called.moments:
        at = f"points + {size} * ({called.rests} + k), found + 2 * ({called.rests} + k)"
        lines.append(f"for (int k = 0; k < {called.moments}; k++) moment({at});")
    return indented(lines, 4)


def _inputs(units: tuple[str, ...], lifts: str) -> list[str]:
    """Members of the struct of a sample."""
    found = []
    for unit in units:
        name = identifier_of(unit)
        found.append(f"double {name}_position; /* of its piston [m]; NaN where it is not known */")
        found.append(f"double {name}_velocity; /* [m/s] */")
        found.append(f"double {name}_std; /* standard deviation of the position [m] */")
    found.append("double time; /* of any clock [s] */")
    found.append(f"double load, load_std; /* at the rods of the {lifts}, and its standard deviation [N] */")
    return [*found, "double load_age; /* how old that is; 0 while the motor's torque shows it [s] */"]


def _example(unit: str) -> str:
    """Lines of the header's example for a unit beside the one that lifts."""
    name = identifier_of(unit)
    return (
        f" *     at.{name}_position = ...; at.{name}_velocity = ...;   // of its sensor, or where it stands\n"
        f" *     at.{name}_std = ...;                                  // half its 95 % band / 1.96\n"
    )
