"""Figures of runs: of one in words, of many as arrays."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from typing import Any

import numpy as np

from ramsight.arrays import Array
from ramsight.duty.profile import Duty
from ramsight.duty.recorded import Recorded
from ramsight.engine.batch import Job, Sampled, Summaries, sampled
from ramsight.engine.equation import OdeModel
from ramsight.engine.ode_module import compile_outputs
from ramsight.engine.run import Outcome
from ramsight.plant.circuit import CircuitModel
from ramsight.plant.unit import HydraulicUnit
from ramsight.plant.valve import ReliefValve
from ramsight.system import processors

BESIDE = 32  # runs that are simulated side by side on a thread: fewer leave lanes empty at the end, more take memory
_LEAST_ENERGY = 1e-9  # J, so that a run at rest divides by something

FIGURES: Mapping[str, Mapping[str, tuple[str, str]]] = {
    "torque": {
        "motor_torque_least": ("N m", "motor torque, smallest"),
        "motor_torque_most": ("N m", "motor torque, largest"),
    },
    "power": {
        "motor_power_least": ("W", "power at the motor shaft, smallest; negative where the motor brakes"),
        "motor_power_most": ("W", "power at the motor shaft, largest"),
    },
    "energy": {
        "energy.shaft_given": ("J", "energy that the motor gave at its shaft"),
        "energy.shaft_taken": ("J", "energy that it took back"),
    },
    "relief": {"relief_share": ("1", "energy lost at relief valves, over the energy that the motor gave")},
    "pressure": {"pressure_most": ("Pa", "largest pressure of any volume, absolute")},
}
"""Names, units and texts of what is kept of a run, by what it is asked for as."""


@dataclass(frozen=True)
class Work:
    """One run: the duty, and the engine's job of it."""

    duty: Duty
    job: Job


@dataclass(frozen=True)
class Figures:
    """What is kept of some runs, in their order: the engine's summaries, and figures by name, shape (runs,)."""

    summaries: Summaries
    values: Mapping[str, Array]


def figures_of(
    unit: HydraulicUnit,
    model: CircuitModel,
    works: Iterable[Work],
    keep: Iterable[str],
    *,
    period: float,
    rtol: float,
    threads: int | None,
    advance: Callable[[int], object],
) -> Iterator[Figures]:
    """Do runs on all cores and keep their figures; samples of a few dozen runs a thread are in memory at a time.

    Args:
        period: distance of the samples that torque and power are taken from [s].
    """
    names = [name for one in FIGURES if one in set(keep) for name in FIGURES[one]]
    threads = threads or processors()
    torque = tuple(one for one in model.ode.outputs if one.name == "motor_torque")
    torque_of = compile_outputs(replace(model.ode, outputs=torque)).sample_outputs
    do = partial(_done, unit, model, torque_of, names=names, period=period, rtol=rtol)
    supply = iter(works)
    with ThreadPoolExecutor(threads) as pool:
        while chunk := list(islice(supply, BESIDE * threads)):
            for done in pool.map(do, [chunk[k : k + BESIDE] for k in range(0, len(chunk), BESIDE)]):
                yield done
                advance(len(done.summaries.outcome))


def _done(
    unit: HydraulicUnit,
    model: CircuitModel,
    torque_of: Callable[..., None],
    works: Sequence[Work],
    *,
    names: Sequence[str],
    period: float,
    rtol: float,
) -> Figures:
    run = sampled(model.ode, [one.job for one in works], period, rtol=rtol)
    values = {name: np.full(len(works), np.nan) for name in names}
    needs_torque = any(name.startswith("motor_") for name in names)
    for k, work in enumerate(works):
        if run.outcome[k] is not Outcome.DONE:
            continue
        found = _integrals(unit, model, run.summaries.final[k], run.summaries.most[k])
        if needs_torque:
            found |= _at_the_shaft(model.ode, torque_of, work, run, k)
        for name in names:
            values[name][k] = found[name]
    return Figures(run.summaries, values)


def _integrals(unit: HydraulicUnit, model: CircuitModel, final: Array, most: Array) -> dict[str, float]:
    """Figures of the audit's integrals, and the largest pressure."""
    ode = model.ode
    valves = tuple(f"energy.{part.name}." for part in unit.parts() if isinstance(part, ReliefValve))
    at_relief = sum(
        float(final[k]) for k, one in enumerate(ode.states) if valves and one.integral and one.name.startswith(valves)
    )
    given, taken = (float(final[ode.state_index(f"energy.shaft_{way}")]) for way in ("given", "taken"))
    return {
        "energy.shaft_given": given,
        "energy.shaft_taken": taken,
        "relief_share": at_relief / max(given, _LEAST_ENERGY),
        "pressure_most": max(float(most[ode.state_index(f"pressure_{node}")]) for node in model.nodes),
    }


def _at_the_shaft(ode: OdeModel, torque_of: Callable[..., None], work: Work, run: Sampled, k: int) -> dict[str, float]:
    """Extremes of torque and power over the samples."""
    segments, time, state = work.job.segments, run.time[k], run.state[k]
    row, u = segments.at(time)
    held = np.minimum(row, len(segments.parameters) - 1)
    found = np.empty((len(time), 1))
    slope = np.ascontiguousarray(segments.slope[row])
    torque_of(state, np.ascontiguousarray(u), slope, segments.parameters, held, found)
    torque, own = found[:, 0], [one.name for one in ode.states]
    speed = state[:, own.index("motor_speed")] if "motor_speed" in own else work.duty.motor_speed(time)
    power = torque * speed
    return {
        "motor_torque_least": float(torque.min()),
        "motor_torque_most": float(torque.max()),
        "motor_power_least": float(power.min()),
        "motor_power_most": float(power.max()),
    }


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
