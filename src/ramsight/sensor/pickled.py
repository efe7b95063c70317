"""A sensor between processes: its step goes as a serialized CasADi function, for closures cannot be pickled.

Files hold no pickles: this is what `multiprocessing` and Dask hand to their workers.
"""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import casadi as ca

from ramsight.engine.recursion import Graph, Recursion


def taken_apart(sensor: Any) -> dict[str, Any]:
    """What a `VirtualSensor` can be put together of, all of it plain."""
    graph, recursion = sensor.recursion.graph, sensor.recursion
    sections = sensor.sections()
    parts = [part for _, marks, rows in sections for part in (marks, rows)]
    step = ca.Function("step", [graph.x, graph.u, graph.p], [graph.next_state, graph.output, *parts])
    own = {one.name: getattr(sensor, one.name) for one in fields(sensor) if one.name != "_stepper"}
    # The first values of the states are in `initial`.
    states = tuple(replace(one, value=None) for one in sensor.states)
    return {
        **own,
        "recursion": {one.name: getattr(recursion, one.name) for one in fields(recursion) if one.name != "drawn"},
        "states": states,
        "sections": tuple(title for title, _, _ in sections),
        "step": step.serialize(),
    }


def put_together(kind: type[Any], parts: dict[str, Any]) -> Any:
    """The sensor again."""
    parts = dict(parts)
    step, titles = ca.Function.deserialize(parts.pop("step")), parts.pop("sections")
    x, u, p = (ca.SX.sym(name, step.numel_in(k)) for k, name in enumerate("xup"))
    next_state, output, *rest = step.call([x, u, p])
    graph = Graph(x, u, p, next_state, output)
    sections = tuple(zip(titles, rest[0::2], rest[1::2], strict=True))
    recursion = Recursion(**parts.pop("recursion"), drawn=lambda: graph)
    kept = {name: parts.pop(name) for name in ("_state", "_says")}
    sensor = kind(recursion=recursion, sections=lambda: sections, **parts)
    sensor._state, sensor._says = kept["_state"].copy(), kept["_says"].copy()
    return sensor
