"""Many runs of machines that vary, on all cores: the ends, the extremes and what is asked for are kept."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence, Sized
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from ramsight.argument_kinds import by_kind, whole_argument
from ramsight.duty import Duty
from ramsight.duty.run_figures import FIGURES, Figures, Work, figures_of
from ramsight.duty.simulate import SAMPLE_PERIOD, audited_circuit, check_commands, check_temperature
from ramsight.engine.batch import Job, batches
from ramsight.engine.cache import instructions
from ramsight.engine.run import DEFAULT_RTOL, Outcome
from ramsight.errors import DescriptionError, UnknownNameError
from ramsight.machine import declare, load_machine, only_unit, walk
from ramsight.machine.description import Machine, Unit
from ramsight.optional import needing
from ramsight.plant.as_built import AsBuilt
from ramsight.plant.build import AnyUnit, build
from ramsight.plant.circuit import CircuitModel, parameter_values, shape
from ramsight.plant.unit import HydraulicUnit, circuit, initial_state
from ramsight.progress import advancing
from ramsight.signals import Dataset
from ramsight.units import argument, si_unit

Quantity = float | str
_DUTIES = "what ramsight.lift_lower makes"
_MOST_THREADS = 1024  # more than any machine has cores
_OF_DUTY = (
    ("load", "N", "load at first, positive against lifting"),
    ("oil_temperature", "K", "oil temperature at first"),
    ("start_position", "m", "piston position at first"),
    ("duration", "s", "length of the duty"),
    ("speed", "rad/s", "largest motor speed"),
)


@by_kind
def simulate_many(
    machines: AnyUnit | Sequence[AnyUnit],
    duties: Duty | Iterable[Duty],
    *,
    unit: str | None = None,
    vary: Vary | None = None,
    keep: Iterable[str] = (),
    sample_period: Quantity = SAMPLE_PERIOD,
    rtol: float = DEFAULT_RTOL,
    threads: int | None = None,
    progress: bool = False,
) -> Dataset:
    """Simulate every machine through every duty, on all cores, and keep the end and the extremes of each run.

    A thousand runs at a time are in memory, however many there are; duties are taken as they are needed.

    Args:
        machines: the unit, or what `build` makes one of; or a list of them with one circuit, for example one machine
            worn in several ways (`AsBuilt(leak=1.2).apply(unit)`).
        duties: what they do, for example of `lift_lower`; at least one.
        unit: name of the unit, if the machines have several.
        vary: what differs from machine to machine, of one that is passed: lists of values, equally long, by name: a
            factor of `AsBuilt` (``leak``), or a key of the description (``cylinder.bore``), which a built unit has not.
        keep: what is kept beside the states, of `torque`, `power`, `energy`, `relief` and `pressure`.
        sample_period: distance of the samples that torque and power are taken from [s].
        rtol: relative tolerance.
        threads: how many; by default one for each core that this process may use.
        progress: show a bar on a terminal, or a line every ten seconds through a pipe, if it takes long.

    Returns:
        Over `duty` alone if one machine is passed, shape (duties,), else over `machine` and `duty`. Of every state of
        the plant, all in SI with `units`: `position_final`, `position_least`, `position_most` and so on, NaN where a
        run did not reach its end; `outcome` says ``done`` or why not; `accepted_steps`. By `keep`: `motor_torque_least`
        and `_most` [N m]; `motor_power_least` and `_most` [W], at the shaft; `energy.shaft_given` and
        `energy.shaft_taken` [J], by the motor; `relief_share` [1], what relief valves lose of that; `pressure_most`
        [Pa], in any volume.
        Coordinates of a duty: `load` [N], `oil_temperature` [K] and `start_position` [m] at first, `duration` [s],
        `speed` [rad/s], the largest; of a machine what varies, in SI.

    Raises:
        DescriptionError: there is no duty, an oil temperature is outside the oil's data, circuits differ, or an
            argument cannot be used.
        UnknownNameError: no such machine or unit, nothing of that name can vary or be kept.

    Example:
        >>> import ramsight
        >>> boom = ramsight.build("mining-loader", "boom")
        >>> loads = ["129 kN", "441 kN"]
        >>> runs = ramsight.simulate_many(boom, [ramsight.lift_lower(boom, load) for load in loads])
        >>> dict(runs.sizes), bool(runs["position_most"][0] > runs["position_most"][1])
        ({'duty': 2}, True)
        >>> duty, worn = ramsight.lift_lower(boom, "441 kN"), {"leak": [1.0, 1.3]}
        >>> runs = ramsight.simulate_many(boom, duty, vary=worn, keep=["power", "energy"])
        >>> runs["leak"].values.tolist(), bool(runs["motor_power_most"].max() < 30e3)  # W
        ([1.0, 1.3], True)
    """
    wanted = _wanted(keep)
    period = argument(sample_period, "s", "sample_period", least="0.1 ms", most="10 s")
    rtol = argument(rtol, "1", "rtol", least="1e-12", most="0.1")
    if threads is not None:
        whole_argument(threads, "threads", 1, _MOST_THREADS)
    fleet = _fleet(machines, unit, vary)
    todo = _Todo(fleet.units, audited=bool(wanted), duties=[duties] if isinstance(duties, Duty) else duties)
    with advancing(todo.total, "simulating", shown=progress) as advance:
        if wanted:
            found = list(
                figures_of(
                    fleet.units[0], todo.model, todo.works(), wanted,
                    period=period, rtol=rtol, threads=threads, advance=advance,
                )
            )  # fmt: skip
        else:
            jobs = (work.job for work in todo.works())
            done = batches(todo.model.ode, jobs, rtol=rtol, threads=threads, advance=advance)
            found = [Figures(one, {}) for one in done]
    if not found:
        raise DescriptionError("there is none", key="duties", allowed="one and more")
    several = vary is not None or isinstance(machines, list | tuple)
    return _dataset(todo, found, wanted, fleet.coordinates, several=several)


def _wanted(keep: Iterable[str]) -> list[str]:
    """What is asked for, in the order in which it is listed.

    Raises:
        UnknownNameError: nothing of that name can be kept.
    """
    asked = [keep] if isinstance(keep, str) else list(keep)
    for one in asked:
        if not isinstance(one, str) or one not in FIGURES:
            raise UnknownNameError("figure to keep", str(one), FIGURES)
    return [one for one in FIGURES if one in asked]


def _fleet(machines: AnyUnit | Sequence[AnyUnit], unit: str | None, vary: Vary | None) -> Varied:
    """The machines, and what is varied of them."""
    if vary is None:
        passed: Sequence[Any] = machines if isinstance(machines, list | tuple) else [machines]
        if not passed:
            raise DescriptionError("there is none", key="machines", allowed="one and more")
        return Varied([build(one, unit) for one in passed], {})
    if isinstance(machines, list | tuple):
        raise DescriptionError("varies one machine, and several are passed", key="vary")
    one: Any = machines
    return varied(one, unit, vary)


@dataclass
class _Todo:
    """The runs that are asked for, and what is known of their duties once they have been taken."""

    units: Sequence[HydraulicUnit]
    audited: bool
    duties: Iterable[Duty]
    described: list[tuple[float, ...]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.model, self._values = _models(self.units, audited=self.audited)
        self.total = len(self.duties) * len(self.units) if isinstance(self.duties, Sized) else 0

    def works(self) -> Iterator[Work]:
        """The runs, all units through a duty before the next."""
        for duty in self.duties:
            if not isinstance(duty, Duty):
                raise DescriptionError("is no duty", key="duties", value=duty, allowed=_DUTIES)
            load, speed, kelvin = (float(of(0.0)) for of in (duty.load, duty.motor_speed, duty.oil_temperature))
            fastest = float(np.abs(duty.motor_speed.value).max())
            self.described.append((load, kelvin, duty.start_position, duty.duration, fastest))
            check_commands(self.model, duty)
            for unit, values in zip(self.units, self._values, strict=True):
                check_temperature(unit, duty.oil_temperature)
                initial = initial_state(unit, self.model, duty.start_position, load, speed)
                yield Work(duty, Job(initial, duty.segments(values, self.model.ode.parameters)))


def _models(units: Sequence[HydraulicUnit], *, audited: bool) -> tuple[CircuitModel, list[Any]]:
    """The units' equation, and the parameters of each, in which alone they differ.

    Raises:
        DescriptionError: one has another circuit than the first.
    """
    first = units[0]
    model = audited_circuit(first) if audited else circuit(first)
    own, values = shape(first.oil, first.parts()), [model.values]
    for number, unit in enumerate(units[1:], start=1):
        if shape(unit.oil, unit.parts()) == own:
            values.append(parameter_values(model, unit.oil, unit.tank_pressure, unit.parts()))
            continue
        other = circuit(unit, audited=audited)
        same = other.ode.parameters == model.ode.parameters
        if not same or instructions(other.ode.function) != instructions(model.ode.function):
            raise DescriptionError("has another circuit than the first", key=f"machines[{number}]")
        values.append(other.values)
    return model, values


def _dataset(
    todo: _Todo,
    found: Sequence[Figures],
    wanted: Sequence[str],
    varied: Mapping[str, tuple[Any, str]],
    *,
    several: bool,
) -> Dataset:
    with needing("datasets"):
        import xarray

    dims, ode = ["machine", "duty"] if several else ["duty"], todo.model.ode

    def arranged(parts: Sequence[Any]) -> Any:
        table = np.concatenate(parts).reshape(len(todo.described), len(todo.units)).T
        return table if several else table[0]

    ended = [one.summaries for one in found]
    outcome = arranged([np.array([one.name.lower().replace("_", " ") for one in part.outcome]) for part in ended])
    done = outcome == Outcome.DONE.name.lower()
    data: dict[str, Any] = {}
    for name in (name for one in wanted for name in FIGURES[one]):
        si, text = next(one[name] for one in FIGURES.values() if name in one)
        data[name] = (dims, arranged([part.values[name] for part in found]), {"units": si, "long_name": text})
    for k, state in enumerate(ode.states):
        if state.integral:
            continue
        for name, text in (("final", "at the end"), ("least", "smallest"), ("most", "largest")):
            values = np.where(done, arranged([getattr(part, name)[:, k] for part in ended]), np.nan)
            attributes = {"units": state.unit, "long_name": f"{state.name.replace('_', ' ')}, {text}"}
            data[f"{state.name}_{name}"] = (dims, values, attributes)
    data["outcome"] = (dims, outcome, {"long_name": "how the run ended"})
    data["accepted_steps"] = (dims, arranged([part.accepted for part in ended]), {"units": "1"})
    columns = np.array(todo.described)
    coordinates: dict[str, Any] = {name: ("machine", values, {"units": si}) for name, (values, si) in varied.items()}
    coordinates |= {
        name: ("duty", columns[:, k], {"units": si, "long_name": text}) for k, (name, si, text) in enumerate(_OF_DUTY)
    }
    return xarray.Dataset(data, coords=coordinates, attrs={"format": 1, "kind": "simulated runs"})


Vary = Mapping[str, Sequence[float | str]]
_FACTORS = tuple(one.name for one in fields(AsBuilt))


@dataclass(frozen=True)
class Varied:
    """Machines, and what is varied of them."""

    units: list[HydraulicUnit]  # the machines
    # values of what is varied [SI], shape (machines,), by name, each with its unit
    coordinates: Mapping[str, tuple[Any, str]]


def varied(machine: AnyUnit, unit: str | None, vary: Vary) -> Varied:
    """Machines that differ in some values, in the order of the values.

    Args:
        vary: values of each machine by name: a factor of `AsBuilt`, or a key of the unit's description.

    Raises:
        DescriptionError: the values are not equally many, or one cannot be used.
        UnknownNameError: there is neither such a factor nor such a key.
    """
    columns = _columns(vary)
    described, name = _described(machine, unit)
    keys = {} if described is None else {one.path: one.declared for one in walk(described)}
    for one in columns:
        if one not in _FACTORS and keys.get(one) is None:
            known = [*_FACTORS, *(path for path, declared in keys.items() if declared is not None)]
            raise UnknownNameError("value to vary", one, known)
    sheet, units = build(machine, unit), []
    read: dict[str, list[float]] = {one: [] for one in columns}
    for k in range(len(next(iter(columns.values())))):
        values = {one: _value(column[k], one, keys.get(one)) for one, column in columns.items()}
        own = {one: value for one, value in values.items() if one not in _FACTORS}
        made = sheet if described is None or not own else build(described.replace(own), name)
        factors = AsBuilt(**{one: value for one, value in values.items() if one in _FACTORS})
        units.append(factors.apply(made))
        for one, value in values.items():
            read[one].append(value)
    units_of = {one: "1" if one in _FACTORS else _unit_of(keys[one]) for one in columns}
    return Varied(units, {one: (np.array(values), units_of[one]) for one, values in read.items()})


def _columns(vary: Vary) -> dict[str, list[float | str]]:
    """The values of each machine by name, equally many."""
    passed = vary if isinstance(vary, Mapping) else {}
    columns = {
        name: list(values)
        for name, values in passed.items()
        if isinstance(name, str) and isinstance(values, Iterable) and not isinstance(values, str)
    }
    counts = {len(values) for values in columns.values()}
    if len(columns) != len(passed) or len(counts) != 1 or counts == {0}:
        allowed = "{'leak': [1.0, 1.2]}"
        raise DescriptionError("needs a list of each value, all equally long", key="vary", allowed=allowed)
    return columns


def _described(machine: AnyUnit, unit: str | None) -> tuple[Unit | None, str | None]:
    """The unit's description, if the machine is one, and the unit's name."""
    if isinstance(machine, Unit):
        return machine, unit
    if isinstance(machine, str | Path | Machine):
        whole = load_machine(machine)
        name = only_unit(whole) if unit is None else unit
        return whole.unit(name), name
    return None, unit


def _value(value: float | str, name: str, declared: declare.Quantity | None) -> float:
    """A value in SI, held against its range."""
    if declared is None:
        return float(getattr(AsBuilt(**{name: value}), name))  # type: ignore[arg-type]
    try:
        return float(declared.read(value.item() if isinstance(value, np.number) else value))
    except DescriptionError as error:
        raise DescriptionError(error.message, key=f"vary.{name}", value=error.value, allowed=error.allowed) from None


def _unit_of(declared: declare.Quantity | None) -> str:
    return "1" if declared is None else si_unit(declared.unit)
