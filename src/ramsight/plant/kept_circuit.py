"""A unit's audited equation that was made before: all but its graph is kept, which is made where it is asked for."""

from __future__ import annotations

from dataclasses import asdict
from functools import lru_cache
from typing import Any

import numpy as np

from ramsight.engine.equation import OdeModel, State
from ramsight.engine.kept import kept, key_of
from ramsight.engine.ode_module import Integrated, integrated
from ramsight.plant.circuit import CircuitModel
from ramsight.plant.unit import HydraulicUnit, circuit

_NAMES = ("nodes", "losses", "works", "tank_flows", "commands")


@lru_cache(maxsize=32)
def kept_circuit(unit: HydraulicUnit) -> CircuitModel:
    """The unit's equation with its audit's integrals, as it was kept, or made and kept."""
    return kept(
        key_of("circuit", unit), lambda: circuit(unit, audited=True), _described, lambda found: _restored(found, unit)
    )


def _described(model: CircuitModel) -> dict[str, Any]:
    ode = model.ode
    return {
        "name": ode.name,
        "states": [asdict(one) for one in ode.states],
        "inputs": ode.inputs,
        "parameters": dict(zip(ode.parameters, model.values.tolist(), strict=True)),
        "outputs": {one.name: one.unit for one in ode.outputs},
        "integrated": asdict(integrated(ode)),
        **{name: getattr(model, name) for name in _NAMES},
    }


def _restored(found: dict[str, Any], unit: HydraulicUnit) -> CircuitModel:
    ode = OdeModel.late(
        found["name"],
        tuple(State(**one) for one in found["states"]),
        tuple(found["inputs"]),
        tuple(found["parameters"]),
        found["outputs"],
        lambda: circuit(unit, audited=True).ode,
        Integrated(**found["integrated"]),
    )
    values = np.array(list(found["parameters"].values()), dtype=np.float64)
    return CircuitModel(ode, values, **{name: tuple(found[name]) for name in _NAMES})
