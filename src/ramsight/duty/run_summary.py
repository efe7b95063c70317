"""What to say of a simulated run."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ramsight.arrays import Array
from ramsight.duty.recorded import Recorded

_LONG = 0.1  # s beyond a limit that are worth a word
_FAR = 3.0  # times the motor's torque, not even for a moment: the overload of common servo motors, [M]
_SHOWN = 1e-3  # share of the largest energy below which a line is left out


def run_cautions(run: Recorded, max_torque: float, load_at_relief: float) -> tuple[str, ...]:
    """What an engineer would look at twice in a run: torque that no motor has, a load that nothing holds, torn oil.

    Args:
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
        f"the oil tears in {node}, for {lasts:.1f} s of {time[-1]:.1f} s: vapour and air fill the room, and until "
        "they are gone no oil holds the rod from that side"
        for node, lasts in _torn(run)
    ]
    return tuple(found)


def _torn(run: Recorded) -> Iterator[tuple[str, float]]:
    """Chambers and other nodes whose oil tears for longer than a moment, and for how long in all [s]."""
    period = _period(run["time"].values)
    for name, one in run.signals.items():
        if not name.startswith("pressure_"):
            continue
        if (lasts := period * float(np.count_nonzero(one.values <= 0.0))) > _LONG:
            node = name.removeprefix("pressure_")
            yield (f"chamber {node.upper()}" if node in ("a", "b") else node.replace("_", " ")), lasts


def _period(time: Array) -> float:
    return float(np.median(np.diff(time))) if len(time) > 1 else 0.0


def run_numbers(run: Recorded) -> dict[str, Any]:
    """The figures of a run, in SI: how long it is, extremes and ends of each signal, energies and balances."""
    extremes = {
        name: {
            "first": float(one.values[0]),
            "least": float(one.values.min()),
            "most": float(one.values.max()),
            "last": float(one.values[-1]),
            "unit": one.units,
        }
        for name, one in run.signals.items()
        if name != "time"
    }
    said = {key: value for key, value in run.attrs.items() if key not in ("format", "kind")}
    return {"duration": float(run["time"].values[-1]), "signals": extremes, "run": said}


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
