"""Many runs: units through duties on all cores, of which only the ends and extremes are kept."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence, Sized
from typing import TYPE_CHECKING, Any

import numpy as np

from ramsight.api.machines import AnyUnit, build
from ramsight.duty import Duty
from ramsight.duty.simulate import check_commands, check_temperature
from ramsight.engine.batch import Job, Summaries, batches
from ramsight.engine.cache import instructions
from ramsight.engine.outcome import Outcome
from ramsight.engine.run import DEFAULT_RTOL
from ramsight.errors import DescriptionError
from ramsight.plant.circuit import CircuitModel
from ramsight.plant.unit import HydraulicUnit, circuit, initial_state
from ramsight.progress import advancing

if TYPE_CHECKING:
    import xarray

Described = tuple[float, float, float, float]
_OF_DUTY = (
    ("load", "N", "load at first, positive against lifting"),
    ("oil_temperature", "K", "oil temperature at first"),
    ("start_position", "m", "piston position at first"),
    ("duration", "s", "length of the duty"),
)


def simulate_many(
    machines: AnyUnit | Sequence[AnyUnit],
    duties: Iterable[Duty],
    *,
    unit: str | None = None,
    rtol: float = DEFAULT_RTOL,
    threads: int | None = None,
    progress: bool = False,
) -> xarray.Dataset:
    """Simulate every unit through every duty, on all cores, and keep the end and the extremes of each run.

    A thousand runs at a time are in memory, however many there are; duties are taken as they are needed.

    Args:
        machines: the unit, or what `build` makes one of; or a list of them with one circuit, for example one machine
            worn in several ways (`AsBuilt(leak=1.2).apply(unit)`).
        duties: what they do, for example of `lift_lower`; at least one.
        unit: name of the unit, if the machines have several.
        rtol: relative tolerance of the integrator.
        threads: how many; by default one for each core that this process may use.
        progress: show a bar on a terminal if it takes long.

    Returns:
        Over `duty` alone if one machine is passed, shape (duties,), else over `machine` and `duty`. Of every state of
        the plant, all in SI with `units`: `position_final`, `position_least`, `position_most` and so on, NaN where a
        run did not reach its end; `outcome` says ``done`` or why not; `accepted_steps`. Coordinates of a duty: `load`
        [N], `oil_temperature` [K] and `start_position` [m] at first, `duration` [s].

    Raises:
        DescriptionError: there is no duty, an oil temperature is outside the oil's data, or circuits differ.
        UnknownNameError: no such machine or unit.

    Example:
        >>> import ramsight
        >>> boom = ramsight.build("mining-loader", "boom")
        >>> loads = ["129 kN", "441 kN"]
        >>> runs = ramsight.simulate_many(boom, [ramsight.lift_lower(boom, load) for load in loads])
        >>> dict(runs.sizes), bool(runs["position_most"][0] > runs["position_most"][1])
        ({'duty': 2}, True)
        >>> worn = [boom, ramsight.AsBuilt(leak=1.3).apply(boom)]
        >>> runs = ramsight.simulate_many(worn, [ramsight.lift_lower(boom, load) for load in loads])
        >>> dict(runs.sizes), bool((runs["position_most"][0] > runs["position_most"][1]).all())
        ({'machine': 2, 'duty': 2}, True)
    """
    several = isinstance(machines, list | tuple)
    passed: Sequence[Any] = machines if isinstance(machines, list | tuple) else [machines]
    units = [build(one, unit) for one in passed]
    models = _models(units)
    of_duties: list[Described] = []
    jobs = _jobs(units, models, duties, of_duties)
    total = len(duties) * len(units) if isinstance(duties, Sized) else 0
    with advancing(total, "simulating", shown=progress and bool(total)) as advance:
        found = list(batches(models[0].ode, jobs, rtol=rtol, threads=threads, advance=advance))
    if not found:
        raise DescriptionError("there is none", key="duties", allowed="one and more")
    return _dataset(models[0], found, of_duties, len(units), several)


def _models(units: Sequence[HydraulicUnit]) -> list[CircuitModel]:
    """The units' equations, which differ in their parameters alone.

    Raises:
        DescriptionError: there is none, or one has another circuit than the first.
    """
    if not units:
        raise DescriptionError("there is none", key="machines", allowed="one and more")
    models = [circuit(unit) for unit in units]
    first = instructions(models[0].ode.function) if len(models) > 1 else None
    for number, model in enumerate(models[1:], start=1):
        if model.ode.parameters != models[0].ode.parameters or instructions(model.ode.function) != first:
            raise DescriptionError("has another circuit than the first", key=f"machines[{number}]")
    return models


def _jobs(
    units: Sequence[HydraulicUnit], models: Sequence[CircuitModel], duties: Iterable[Duty], described: list[Described]
) -> Iterator[Job]:
    """The runs, all units through a duty before the next; what each duty is goes into `described`."""
    for duty in duties:
        if not isinstance(duty, Duty):
            raise DescriptionError("is no duty", key="duties", value=duty, allowed="what ramsight.lift_lower makes")
        load, speed, kelvin = (float(of(0.0)) for of in (duty.load, duty.motor_speed, duty.oil_temperature))
        described.append((load, kelvin, duty.start_position, duty.duration))
        for unit, model in zip(units, models, strict=True):
            check_temperature(unit, duty.oil_temperature)
            check_commands(model, duty)
            initial = initial_state(unit, model, duty.start_position, load, speed)
            yield Job(initial, duty.segments(model.values, model.ode.parameters))


def _dataset(
    model: CircuitModel, found: Sequence[Summaries], described: Sequence[Described], machines: int, several: bool
) -> xarray.Dataset:
    import xarray

    dims = ["machine", "duty"] if several else ["duty"]

    def arranged(parts: Sequence[Any]) -> Any:
        table = np.concatenate(parts).reshape(len(described), machines).T
        return table if several else table[0]

    outcome = arranged([np.array([one.name.lower().replace("_", " ") for one in part.outcome]) for part in found])
    done = outcome == Outcome.DONE.name.lower()
    data: dict[str, Any] = {}
    for k, state in enumerate(model.ode.states):
        for name, text in (("final", "at the end"), ("least", "smallest"), ("most", "largest")):
            values = np.where(done, arranged([getattr(part, name)[:, k] for part in found]), np.nan)
            attributes = {"units": state.unit, "long_name": f"{state.name.replace('_', ' ')}, {text}"}
            data[f"{state.name}_{name}"] = (dims, values, attributes)
    data["outcome"] = (dims, outcome, {"long_name": "how the run ended"})
    data["accepted_steps"] = (dims, arranged([part.accepted for part in found]), {"units": "1"})
    columns = np.array(described)
    coordinates = {
        name: ("duty", columns[:, k], {"units": si, "long_name": text}) for k, (name, si, text) in enumerate(_OF_DUTY)
    }
    return xarray.Dataset(data, coords=coordinates, attrs={"format": 1, "kind": "simulated runs"})
