"""The simulated circuit when a piston that was held is released: the load is what the pressures carry."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Flag, Scalar, scalar
from ramsight.sensor.circuit.load import LoadState
from ramsight.sensor.machine_model import MachineModel


@dataclass(frozen=True, kw_only=True)
class UnheldState:
    """The circuit when the piston was last not held."""

    circuit: Mapping[str, Scalar] = leaf("SI", None, inline=True)  # its states but the position [m/s, Pa]

    @classmethod
    def initial(cls, load: LoadState) -> UnheldState:
        """Before the first sample."""
        return cls(circuit=dict.fromkeys(load.circuit, scalar(0.0)))


@dataclass(frozen=True)
class Release:
    """Whether a held piston is released at a sample."""

    released: Flag  # whether it is
    held: Flag  # whether it is held after the sample
    shown: Scalar  # share of the change of its pressures while it was held that the torque shows [1]


def release_load(
    state: UnheldState, load: LoadState, position: Scalar, release: Release, give: Scalar, model: MachineModel
) -> tuple[UnheldState, LoadState, Scalar]:
    """The circuit after the sample, and what its oil gave back as travel [m], extension positive.

    Of a piston that was not held after all, the oil was compressed no more than the torque shows: its pressures go back
    by the rest of the way that they went meanwhile, and what the oil gave way by then is travel.

    Args:
        position: before the sample, within the stroke [m].
        give: travel per load that the oil's compression allows [m/N].
    """
    released, shown = release.released, release.shown
    then = {name: state.circuit[name] + shown * (now - state.circuit[name]) for name, now in load.circuit.items()}
    circuit = {name: ca.if_else(released, then[name], now) for name, now in load.circuit.items()}
    unheld = {name: ca.if_else(release.held, state.circuit[name], now) for name, now in circuit.items()}
    carried, carries = (model.balance.force(ca.vertcat(position, *values.values())) for values in (load.circuit, then))
    slopes = {
        factor: {name: ca.if_else(released, shown * by, by) for name, by in of_state.items()}
        for factor, of_state in load.sensitivities.items()
    }
    after = replace(load, circuit=circuit, load=ca.if_else(released, carries, load.load), sensitivities=slopes)
    travel = ca.if_else(released, model.lift * give * (carried - carries), 0.0)
    return UnheldState(circuit=unheld), after, travel
