"""The energy and volume audit of a run: all that goes in comes out, stays in, or turns into heat.

The powers and flows of every part were integrated beside the states; what is stored is computed anew from the
pressures and positions along the accepted steps, without using any flow.
"""

from __future__ import annotations

import numpy as np

from ramsight.engine.run import Segments, Trajectory, outputs
from ramsight.plant.circuit import CircuitModel


def audit(circuit: CircuitModel, segments: Segments, run: Trajectory) -> dict[str, float]:
    """Sum up a run.

    Args:
        circuit: the audited circuit.
        segments: its inputs.
        run: its trajectory, with recorded steps.

    Returns:
        `energy.*` [J] for the shaft, each work, each loss and each store; `energy_residual` and `volume_residual` as
        shares of the energy that the shaft gave and took, and of the volume that was exchanged with the tank.
    """
    ode = circuit.ode
    last = run.step_state[-1]

    def total(name: str) -> float:
        return float(last[ode.state_index(name)])

    along = outputs(ode, segments, run.step_time, run.step_state)
    stored = {name: float(along[name][-1] - along[name][0]) for name in along if name.startswith("stored.")}
    compressed_energy = compressed_volume = 0.0
    for node in circuit.nodes:
        pressure, capacity = run.step_state[:, ode.state_index(f"pressure_{node}")], along[f"capacity_{node}"]
        between = 0.5 * (capacity[1:] + capacity[:-1])
        compressed_energy += float(np.sum(between * 0.5 * np.diff(pressure**2)))
        compressed_volume += float(np.sum(between * np.diff(pressure)))
    stored["stored.compression"] = compressed_energy
    drawn = sum(total(f"volume.{name}") for name in circuit.tank_flows)
    tank_pressure = segments.parameters[0, ode.parameters.index("tank.pressure")]
    works = {f"energy.{name}": total(f"energy.{name}") for name in circuit.works}
    works["energy.tank"] = -float(tank_pressure) * drawn
    losses = {f"energy.{name}": total(f"energy.{name}") for name in circuit.losses}
    given, taken = total("energy.shaft_given"), total("energy.shaft_taken")
    shaft = given - taken
    rest = shaft - sum(works.values()) - sum(losses.values()) - sum(stored.values())
    grown = sum(float(along[f"volume_{node}"][-1] - along[f"volume_{node}"][0]) for node in circuit.nodes)
    missing = drawn - grown - compressed_volume
    exchanged = total("volume.exchanged")
    return {
        "energy.shaft": shaft,
        "energy.shaft_given": given,
        "energy.shaft_taken": taken,
        **works,
        **losses,
        **{name.replace("stored.", "energy.stored_"): value for name, value in stored.items()},
        "energy_residual": rest / max(given + taken, 1e-9),
        "volume_residual": missing / max(exchanged, 1e-12),
    }
