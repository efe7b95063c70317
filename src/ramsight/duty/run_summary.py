"""What to say of a simulated run."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ramsight.duty.recorded import Recorded
from ramsight.errors import SimulationError

_LONG = 0.1  # s beyond a limit that are worth a word
_FAR = 3.0  # times the motor's torque, not even for a moment: the overload of common servo motors, [M]
_PULLS = 0.1  # share of a run's largest pressure: a chamber that pulls harder moves the rod as no oil does
_SHOWN = 1e-3  # share of the largest energy below which a line is left out


def run_cautions(run: Recorded, max_torque: float, load_at_relief: float) -> tuple[str, ...]:
    """What an engineer would look at twice in a run: torque that no motor has, a load that nothing holds, torn oil.

    Args:
        run: a run.
        max_torque: that the motor has [N m]; an ideal drive gives whatever is asked for.
        load_at_relief: load that the relief valve carries [N].

    Returns:
        One sentence each; none if nothing stands out.
    """
    time, torque, load = run["time"].values, np.abs(run["motor_torque"].values), run["load"].values
    period = _period(time)
    found, beyond = [], period * float(np.count_nonzero(torque > max_torque))
    if beyond > _LONG or torque.max() > _FAR * max_torque:
        found.append(
            f"the motor would need up to {torque.max():.1f} N m, it has {max_torque:g} N m: {beyond:.2g} s of "
            f"{time[-1]:.1f} s are beyond that, and a real drive would lag"
        )
    if load.max() > load_at_relief:
        found.append(
            f"the load, up to {load.max() / 1e3:.4g} kN, is more than the {load_at_relief / 1e3:.4g} kN that the "
            "relief valve carries: what lifts it passes the valve, and where nothing else holds it the rod sinks"
        )
    found += [
        f"{fall.said}, for {fall.lasts:.1f} s of {time[-1]:.1f} s: oil would tear there, and the rod go otherwise than "
        "simulated"
        for fall in _falls(run, 0.0)
    ]
    return tuple(found)


def refuse_torn_oil(run: Recorded) -> None:
    """Refuse a run in which oil pulls as no oil does: it tears, and the rod goes otherwise than the equations say.

    Args:
        run: a run.

    Raises:
        SimulationError: an absolute pressure is far below zero for longer than a moment.
    """
    largest = max((one.max() for one in _pressures(run).values()), default=0.0)
    for fall in _falls(run, -_PULLS * largest):
        raise SimulationError(
            f"{run.attrs['unit']}: {fall.said}, first at {fall.begins:.2f} s, and is far below zero for "
            f"{fall.lasts:.1f} s of {run['time'].values[-1]:.1f} s: oil tears there, and the rod goes otherwise than "
            "could be simulated; a reservoir with more gas or less precharge, more pressure in the tank or an "
            "anti-cavitation valve keeps it filled"
        )


class _Fall(NamedTuple):
    """A chamber whose pressure is below a limit: what to say of it, since when, and for how long in all [s]."""

    said: str
    begins: float
    lasts: float


def _falls(run: Recorded, limit: float) -> Iterator[_Fall]:
    """The chambers that are below an absolute pressure [Pa] for longer than a moment."""
    time = run["time"].values
    for side, pressure in _pressures(run).items():
        below = pressure < limit
        if (lasts := _period(time) * float(np.count_nonzero(below))) > _LONG:
            said = f"chamber {side} falls to {pressure.min() / 1e5:.1f} bar absolute"
            yield _Fall(said, float(time[int(np.argmax(below))]), lasts)


def _pressures(run: Recorded) -> dict[str, NDArray[np.float64]]:
    """Of the chambers that a run has, by their letters [Pa]."""
    return {side.upper(): run[name].values for side in "ab" if (name := f"pressure_{side}") in run.signals}


def _period(time: NDArray[np.float64]) -> float:
    return float(np.median(np.diff(time))) if len(time) > 1 else 0.0


def run_summary(run: Recorded) -> str:
    """Travel, torque, where the energy went and how well the balances close, as lines of text."""
    position, torque = run["position"].values, run["motor_torque"].values
    energies = {name.removeprefix("energy."): value for name, value in run.attrs.items() if name.startswith("energy.")}
    lines = [
        f"{run.attrs['unit']}: {run['time'].values[-1]:.1f} s in {run.attrs['accepted_steps']} steps; position "
        f"{1e3 * position[0]:.1f} mm at first, {1e3 * position.min():.1f} to {1e3 * position.max():.1f} mm, "
        f"{1e3 * position[-1]:.1f} mm at last; motor torque {torque.min():.1f} to {torque.max():.1f} N m",
        f"energy [kJ]: the motor gave {energies.pop('shaft_given') / 1e3:.2f} and took "
        f"{energies.pop('shaft_taken') / 1e3:.2f} back; of the difference {energies.pop('shaft') / 1e3:.2f} went to",
    ]
    largest = max(abs(value) for value in energies.values())
    for name, value in sorted(energies.items(), key=lambda item: -abs(item[1])):
        if abs(value) >= _SHOWN * largest:
            lines.append(f"  {value / 1e3:10.3f}  {name.replace('_', ' ').replace('.', ': ')}")
    if "electrical_energy_given" in run.attrs:
        given, recovered = run.attrs["electrical_energy_given"], run.attrs["electrical_energy_recovered"]
        lines.append(f"battery [kJ]: gave {given / 1e3:.2f}, took {recovered / 1e3:.2f} back")
    lines.append(
        f"balances: energy closes to {100 * abs(run.attrs['energy_residual']):.2g} %, "
        f"volume to {100 * abs(run.attrs['volume_residual']):.2g} %"
    )
    return "\n".join(lines)
