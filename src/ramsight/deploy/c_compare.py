"""The comparison with another position sensor as C, beside a sensor's own."""

from __future__ import annotations

import casadi as ca

from ramsight.deploy.c_function import PLAIN, array_function, headings, indented, template
from ramsight.plant.limits import limits_of
from ramsight.plant.unit import HydraulicUnit
from ramsight.tracking.comparing import Verdict, comparison_graph


def comparison_source(unit: HydraulicUnit, prefix: str, machine: str) -> dict[str, str]:
    """Header and body of the comparison, text by file name."""
    recursion = comparison_graph()
    graph = recursion.graph
    step = ca.Function(
        "advance",
        [graph.x, graph.u, graph.p],
        [graph.next_state, graph.output],
        ["x", "u", "p"],
        ["x_new", "out"],
        {"cse": True},
    )
    title = f"Virtual position sensor of the {unit.name}"
    common = headings(prefix, machine, title) | {"states": len(recursion.state)}
    listed = indented(f"{prefix.upper()}_{one.name} = {int(one)}, /* {one.text} */" for one in Verdict)
    header = template("compare.h", verdicts=listed, sets=len(recursion.parameters), **common)
    body = template(
        "compare.c",
        real=template("real.h"),
        function=array_function("advance", step, PLAIN),
        stroke=repr(float(unit.cylinder.stroke)),
        fastest=repr(float(unit.travel_per_radian) * limits_of(unit).max_speed),
        **common,
    )
    return {f"{prefix}_compare.h": header, f"{prefix}_compare.c": body}
