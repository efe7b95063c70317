"""A sensor that was made of the same unit before: all but its graph is kept, which is made where it is asked for.

Making a sensor's graph takes the better part of a second; its machine code needs nothing of it. What is kept is what a
sensor says of itself: its names and their order, its parameters' and first values, and where its machine code is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from functools import cache
from typing import Any

import numpy as np

from ramsight.engine.kept import kept, key_of
from ramsight.engine.recursion import Graph, Recursion, Replayed
from ramsight.engine.typed_state import Leaf
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.virtual_sensor import VirtualSensor


def kept_sensor(kind: str, unit: HydraulicUnit, make: Callable[[HydraulicUnit], VirtualSensor]) -> VirtualSensor:
    """A sensor of a unit: as it was kept, or made and kept."""
    return kept(
        key_of(f"sensor_{kind}", unit),
        lambda: make(unit),
        _described,
        lambda found: _restored(found, lambda: make(unit)),
    )


def _described(sensor: VirtualSensor) -> dict[str, Any]:
    """All of a sensor but its graph."""
    recursion = sensor.recursion
    return {
        "kind": sensor.kind,
        "inputs": recursion.inputs,
        "parameters": dict(zip(recursion.parameters, sensor.parameters.tolist(), strict=True)),
        "units": {name: sensor.units[name] for name in recursion.outputs},
        "states": [
            asdict(Leaf(one.name, first, one.unit, one.learned, one.always, one.variance, one.exact))
            for one, first in zip(sensor.states, sensor.initial.tolist(), strict=True)
        ],
        "replayed": asdict(recursion.replayed),
    }


def _restored(found: dict[str, Any], make: Callable[[], VirtualSensor]) -> VirtualSensor:
    """The sensor that was described."""
    made = cache(make)

    def drawn() -> Graph:
        return made().recursion.graph

    states = tuple(Leaf(**one) for one in found["states"])
    recursion = Recursion(
        state=tuple(one.name for one in states),
        inputs=tuple(found["inputs"]),
        parameters=tuple(found["parameters"]),
        outputs=tuple(found["units"]),
        drawn=drawn,
        known=Replayed(**found["replayed"]),
    )
    return VirtualSensor(
        found["kind"],
        recursion,
        np.array(list(found["parameters"].values()), dtype=np.float64),
        np.array([one.value for one in states], dtype=np.float64),
        found["units"],
        states,
        lambda: made().sections(),
    )
