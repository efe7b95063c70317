"""Runs end where a node has no oil left: what the equations say of it then means nothing."""

from __future__ import annotations

from ramsight.arrays import Array
from ramsight.engine.equation import OdeModel
from ramsight.errors import SimulationError
from ramsight.plant.circuit import PRESSURE, is_pressure
from ramsight.plant.oil import DRY


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
