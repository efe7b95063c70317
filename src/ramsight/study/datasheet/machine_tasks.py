"""From the numbers of machines to what is kept of them: drawn, simulated side by side, reported, tracked, measured."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np

from ramsight import machine as machines
from ramsight.arrays import Array
from ramsight.calibration.sensors import sensor_for
from ramsight.duty.drive_report import declared_report, further_report
from ramsight.duty.profile import Duty
from ramsight.duty.simulate import SAMPLE_PERIOD, check_commands, check_temperature
from ramsight.engine.batch import Job, sampled
from ramsight.engine.equation import OdeModel
from ramsight.engine.ode_module import compile_outputs
from ramsight.engine.run import DEFAULT_RTOL, Outcome, Segments
from ramsight.plant.build import build
from ramsight.plant.circuit import CircuitModel, parameter_values
from ramsight.plant.unit import HydraulicUnit, circuit, initial_state
from ramsight.sensor.virtual_sensor import VirtualSensor
from ramsight.study.datasheet.drawn import Drawn, draw, ready
from ramsight.study.datasheet.measuring import SHAPES, Run, first_position, measures, tracked
from ramsight.study.datasheet.studied_duties import Work

LOOSER = 30.0
"""Tolerances of a study's runs over those of `simulate`: twice as fast, and a position as exact.

Over a work day of the boom (32 drawn machines) the position is off by 25 µm in place of 6 (median of each machine's
largest), and by 0.24 mm at most either way, where a valve opens within another sample.
"""
_PLANS = threading.Lock()  # CasADi counts references to its graphs without one: one thread at a time makes them
BESIDE = 32  # machines that are simulated side by side, a task: fewer leave lanes empty at the end, more take memory


@dataclass(frozen=True)
class Bench:
    """What all machines of a study have in common; made once a process."""

    toml: str  # the description, as text
    unit: str
    work: Work
    sensor: str = "kalman"  # kind of the sensor, or its file

    _made: dict[str, Any] = field(default_factory=dict, repr=False, compare=False, hash=False)

    def _once(self, name: str, make: Any) -> Any:
        if name not in self._made:
            self._made[name] = make()
        return self._made[name]

    @property
    def described(self) -> machines.Unit:
        """The unit's description."""
        found: machines.Unit = self._once("described", lambda: machines.loads(self.toml).unit(self.unit))
        return found

    @property
    def sheet(self) -> HydraulicUnit:
        """The unit as described, which the sensor assumes."""
        found: HydraulicUnit = self._once("sheet", lambda: build(self.described, self.unit))
        return found

    @property
    def nominal(self) -> HydraulicUnit:
        """The same with the options that drawing needs."""
        found: HydraulicUnit = self._once("nominal", lambda: ready(self.sheet))
        return found

    @property
    def model(self) -> CircuitModel:
        """Equation of the unit."""
        found: CircuitModel = self._once("model", lambda: circuit(self.nominal))
        return found

    @property
    def torque(self) -> OdeModel:
        """The equation with nothing but the motor's torque to be said of a state."""

        def make() -> OdeModel:
            ode = self.model.ode
            return replace(ode, outputs=tuple(one for one in ode.outputs if one.name == "motor_torque"))

        found: OdeModel = self._once("torque", make)
        return found

    @property
    def virtual(self) -> VirtualSensor:
        """The sensor of the unit."""
        found: VirtualSensor = self._once("virtual", lambda: sensor_for(self.nominal, self.sensor))
        return found


@lru_cache(maxsize=8)
def bench_of(toml: str, unit: str, work: Work, sensor: str) -> Bench:
    """The bench of a study, the same object for the same one, with everything compiled."""
    made = Bench(toml, unit, work, sensor)
    work_through(made, Order((0,), (), np.zeros((1, 0)), common=0))
    return made


@dataclass(frozen=True)
class Order:
    """Machines that are asked for."""

    numbers: Sequence[int]  # of the machines; noise and, by default, duties follow from them
    names: Sequence[str]
    values: Array  # shape (machines, quantities) [SI]
    seed: int = 0  # of the study; with a number it decides a machine's duty and noise
    common: int | None = None  # number of the machine whose duty and noise all have; None if each has its own
    # times at which the signed error is kept [s], shape (moments,)
    moments: Array = field(default_factory=lambda: np.zeros(0))

    def seed_of(self, number: int) -> int:
        """Seed of a machine's duty and noise."""
        own = number if self.common is None else self.common
        return int(np.random.SeedSequence([self.seed, own]).generate_state(1, np.uint64)[0] >> 1)


def work_through(bench: Bench, order: Order) -> dict[str, Array]:
    """Everything that is kept of the machines of an order, by name; the first dimension is the machine.

    Whatever else is in the order, a machine's numbers are the same to the last bit.
    """
    count = len(order.numbers)
    kept = {name: np.full((count, *(size for _, size in dims)), np.nan) for name, dims in SHAPES.items()}
    kept["moment_error"] = np.full((count, len(order.moments)), np.nan)
    kept["outcome"] = np.zeros(count)
    for first in range(0, count, BESIDE):
        rows = range(first, min(first + BESIDE, count))
        ended = []
        for row, run in zip(rows, runs(bench, order, rows), strict=True):
            if isinstance(run, Outcome):
                kept["outcome"][row] = list(Outcome).index(run)
            else:
                ended.append((row, run))
        for row, found in _kept(bench, ended, order.moments):
            for name, value in found.items():
                kept[name][row] = value
    return kept


def _kept(
    bench: Bench, ended: Sequence[tuple[int, Run]], moments: Array
) -> Iterator[tuple[int, dict[str, float | Array]]]:
    """What is kept of runs, each with its row."""
    several, sensors = [run for _, run in ended], [bench.virtual] * len(ended)
    unreferenced = tracked(several, sensors, start_known=False) if bench.virtual.kind == "kalman" else []
    for k, (track, (row, _)) in enumerate(zip(tracked(several, sensors), ended, strict=True)):
        found = measures(track) | (first_position(unreferenced[k]) if unreferenced else {})
        found["moment_error"] = np.interp(moments, track.time, track.position - track.true)
        yield row, found


def runs(bench: Bench, order: Order, rows: Sequence[int]) -> list[Run | Outcome]:
    """The duties of some machines of an order, done side by side; of one that does not end, why."""
    made, duties, jobs = [], [], []
    for row in rows:
        with _PLANS:
            drawn, seed, duty, job = _planned(bench, order, row)
        made.append((drawn, seed))
        duties.append(duty)
        jobs.append(job)
    done = sampled(bench.model.ode, jobs, SAMPLE_PERIOD, rtol=LOOSER * DEFAULT_RTOL, tolerance_scale=LOOSER)
    found: list[Run | Outcome] = []
    for k, (drawn, seed) in enumerate(made):
        if done.outcome[k] is not Outcome.DONE:
            found.append(done.outcome[k])
            continue
        found.append(_reported(bench, drawn, duties[k], jobs[k].segments, done.time[k], done.state[k], seed))
    return found


def _planned(bench: Bench, order: Order, row: int) -> tuple[Drawn, int, Duty, Job]:
    """A machine of an order, the seed of its noise, its duty, and the run of it."""
    values = dict(zip(order.names, map(float, order.values[row]), strict=True))
    drawn = draw(bench.described, bench.unit, bench.nominal, values)
    kelvin = values.get("oil_temperature", _usual(bench))
    seed = order.seed_of(order.numbers[row])
    duty = bench.work.duty(bench.sheet, drawn.unit, kelvin, values.get("warming", 0.0), seed)
    check_temperature(drawn.unit, duty.oil_temperature)
    check_commands(bench.model, duty)
    return drawn, seed, duty, _job(bench, drawn, duty)


def _usual(bench: Bench) -> float:
    """The oil temperature where it does not vary [K]: 40 °C, or what is nearest to that of the oil's data."""
    least, most = bench.sheet.oil.temperatures
    return min(max(313.15, least), most)


def _job(bench: Bench, drawn: Drawn, duty: Duty) -> Job:
    unit, ode = drawn.unit, bench.model.ode
    values = parameter_values(bench.model, unit.oil, unit.tank_pressure, unit.parts())
    load, speed = float(duty.load(0.0)), float(duty.motor_speed(0.0))
    initial = initial_state(unit, bench.model, duty.start_position, load, speed)
    return Job(initial, duty.segments(values, ode.parameters))


def _reported(bench: Bench, drawn: Drawn, duty: Duty, segments: Segments, time: Array, state: Array, seed: int) -> Run:
    row, u = segments.at(time)
    held = np.minimum(row, len(segments.parameters) - 1)
    torque = np.empty((len(time), 1))
    slope = np.ascontiguousarray(segments.slope[row])
    compile_outputs(bench.torque).sample_outputs(
        state, np.ascontiguousarray(u), slope, segments.parameters, held, torque
    )
    true = _signals(bench, duty, time, state, torque[:, 0])
    signals = true["motor_speed"], true["motor_torque"], duty.oil_temperature(time)
    reports = drawn.reported(time, *signals, seed)
    further = further_report(declared_report(bench.sheet, seed), true.__getitem__)
    named = {channel.name: values for channel, values in further.items()}
    none = np.zeros(len(time))
    columns = [time, *reports, none, none]
    columns += [duty.commanded(name.removesuffix("_command"), time) for name in bench.virtual.commands]
    columns += [named[name] for name in bench.virtual.optional]
    said = duty.start_position + drawn.values.get("start", 0.0)
    inputs = np.ascontiguousarray(np.column_stack(columns))
    start = min(max(said, 0.0), float(bench.sheet.cylinder.stroke))
    return Run(drawn, time, true["position"], inputs, start, signals)


def _signals(bench: Bench, duty: Duty, time: Array, state: Array, torque: Array) -> dict[str, Array]:
    """What drives and sensors see of a run, as it is, by the names that runs have for it."""
    names, cylinder = [one.name for one in bench.model.ode.states], bench.sheet.cylinder
    return {
        "time": time,
        "motor_speed": state[:, names.index("motor_speed")] if "motor_speed" in names else duty.motor_speed(time),
        "motor_torque": torque,
        "position": state[:, names.index("position")],
        "pressure_a": state[:, names.index(f"pressure_{cylinder.node_a}")],
        "pressure_b": state[:, names.index(f"pressure_{cylinder.node_b}")],
    }
