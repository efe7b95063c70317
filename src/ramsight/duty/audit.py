"""The energy and volume audit of a run: all that goes in comes out, stays in, or turns into heat.

The powers and flows of every part were integrated beside the states; what is stored is recomputed from the
pressures and positions along the accepted steps, without using any flow. A run ends where a node has no oil left: what
the equations say of it then means nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ramsight.arrays import Array
from ramsight.engine.equation import OdeModel
from ramsight.engine.run import Segments, Trajectory, outputs
from ramsight.errors import SimulationError
from ramsight.plant.circuit import EXPANSION, PRESSURE, Audited, CircuitModel, is_pressure
from ramsight.plant.oil import DRY

if TYPE_CHECKING:
    from ramsight.plant.linked import LinkedModel

_LEAST_ENERGY = 1e-9  # J, so that a run at rest divides by something
_LEAST_VOLUME = 1e-12  # m3


def audit(circuit: CircuitModel, segments: Segments, run: Trajectory) -> dict[str, float]:
    """Sum up a run.

    Returns:
        `energy.*` [J] for the shaft, each work, each loss and each store; `energy_residual` and `volume_residual` as
        shares of the energy that the shaft gave and took, and of the volume that was exchanged with the tank.
    """
    along = outputs(circuit.ode, segments, run.step_time, run.step_state)
    one = _balances(circuit.ode, circuit, segments, run, along)
    return one.energies | {
        "energy_residual": one.missing_energy / max(one.turned_over, _LEAST_ENERGY),
        "volume_residual": one.missing_volume / max(one.exchanged, _LEAST_VOLUME),
    }


def audit_linked(model: LinkedModel, segments: Segments, run: Trajectory) -> dict[str, float]:
    """Sum up a run of a machine with a mechanism.

    Returns:
        For each unit what `audit` returns, its names with the unit's before them; the work of its rods is
        `UNIT.energy.rods`. Of the mechanism `linkage.energy.*` [J]: received from the rods, from the force on the tip,
        with payload that came, and what is stored; `linkage.energy_residual`. Of all together `energy_residual` and
        `volume_residual`. All residuals are shares of what the shafts of all units gave and took, and of the volume
        that all exchanged: a unit that rests still holds.
    """
    along = outputs(model.ode, segments, run.step_time, run.step_state)
    terms = model.audit_terms.items()
    circuits = {name: _balances(model.ode, own, segments, run, along, f"{name}.") for name, own in terms}
    turned_over = max(sum(one.turned_over for one in circuits.values()), _LEAST_ENERGY)
    exchanged = max(sum(one.exchanged for one in circuits.values()), _LEAST_VOLUME)
    found: dict[str, float] = {}
    for name, one in circuits.items():
        found |= {f"{name}.{key}": value for key, value in one.energies.items()}
        found[f"{name}.energy_residual"] = one.missing_energy / turned_over
        found[f"{name}.volume_residual"] = one.missing_volume / exchanged
    received = {key: _integral(run, model.ode, f"energy.{key}") for key in ("rods", "tip", "payload")}
    stored = {f"stored_{key}": float(along[key][-1] - along[key][0]) for key in ("kinetic", "potential")}
    found |= {f"linkage.energy.{key}": value for key, value in (received | stored).items()}
    found["linkage.energy_residual"] = (sum(received.values()) - sum(stored.values())) / turned_over
    return found | {
        "energy_residual": sum(value for key, value in found.items() if key.endswith(".energy_residual")),
        "volume_residual": sum(value for key, value in found.items() if key.endswith(".volume_residual")),
    }


@dataclass(frozen=True)
class _Balances:
    """One circuit's energies by name [J]; what is missing, and what that is a share of [J, m3]."""

    energies: dict[str, float]
    missing_energy: float
    turned_over: float
    missing_volume: float
    exchanged: float


def _integral(run: Trajectory, ode: OdeModel, name: str) -> float:
    """An integral's last value."""
    return float(run.step_state[-1, ode.state_index(name)])


def _balances(
    ode: OdeModel, audited: Audited, segments: Segments, run: Trajectory, along: Mapping[str, Array], prefix: str = ""
) -> _Balances:
    """One circuit's balances; `along`: all outputs along the accepted steps; names of its own begin with `prefix`."""

    def total(name: str) -> float:
        return _integral(run, ode, f"{prefix}{name}")

    own = {key.removeprefix(prefix): value for key, value in along.items() if key.startswith(prefix)}
    stored = {name: float(own[name][-1] - own[name][0]) for name in own if name.startswith("stored.")}
    compressed_energy = compressed_volume = 0.0
    for node in audited.nodes:
        pressure = run.step_state[:, ode.state_index(f"{prefix}pressure_{node}")]
        capacity = own[f"capacity_{node}"]
        between = 0.5 * (capacity[1:] + capacity[:-1])
        torn = own[f"volume_{node}"] * np.maximum(pressure / DRY, 0.0)  # as `plant.oil.torn_volume`
        compressed_energy += float(np.sum(between * 0.5 * np.diff(np.maximum(pressure, 0.0) ** 2)))
        compressed_volume += float(np.sum(between * np.diff(pressure))) - float(torn[-1] - torn[0])
    stored["stored.compression"] = compressed_energy
    drawn = sum(total(f"volume.{name}") for name in audited.tank_flows)
    tank_pressure = segments.parameters[0, ode.parameters.index(f"{prefix}tank.pressure")]
    works = {f"energy.{name}": total(f"energy.{name}") for name in audited.works}
    works["energy.tank"] = -float(tank_pressure) * drawn
    losses = {f"energy.{name}": total(f"energy.{name}") for name in audited.losses}
    given, taken = total("energy.shaft_given"), total("energy.shaft_taken")
    shaft = given - taken
    rest = shaft - sum(works.values()) - sum(losses.values()) - sum(stored.values())
    grown = sum(float(own[f"volume_{node}"][-1] - own[f"volume_{node}"][0]) for node in audited.nodes)
    expands = any(state.name == f"{prefix}{EXPANSION}" for state in ode.states)
    missing = drawn - grown - compressed_volume + (total(EXPANSION) if expands else 0.0)
    energies = {
        "energy.shaft": shaft,
        "energy.shaft_given": given,
        "energy.shaft_taken": taken,
        **works,
        **losses,
        **{name.replace("stored.", "energy.stored_"): value for name, value in stored.items()},
    }
    return _Balances(energies, rest, given + taken, missing, total("volume.exchanged"))


def refuse_dry(ode: OdeModel, time: Array, state: Array) -> None:
    """Refuse a run in which a pump or a valve draws from a node that has no oil left (`plant.oil.torn_volume`).

    Args:
        time: of the states [s], shape (samples,).
        state: shape (samples, states).

    Raises:
        SimulationError: there is one; the text names node, time, cause and remedy.
    """
    places = [k for k, one in enumerate(ode.states) if is_pressure(one)]
    below = state[:, places] < DRY
    if not below.any():
        return
    sample = int(below.any(axis=1).argmax())
    name = ode.states[places[int(below[sample].argmax())]].name.replace(PRESSURE, "")
    raise SimulationError(
        f"{ode.name}: node {name} runs dry at {time[sample]:.2f} s: more oil is drawn from it than comes in, and its "
        "pressure would fall below the vapour's; a reservoir with more gas or less precharge, more pressure in the "
        "tank or an anti-cavitation valve keeps it filled"
    )
