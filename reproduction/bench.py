"""The machine of the paper on the bench: its units, their sensors, and cycles to run them through."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ramsight import Duty, drive_report, lift_lower, simulate
from ramsight.calibration.cached import calibrated
from ramsight.duty.lift_lower import SPEED
from ramsight.duty.profile import constant, trapezoid_moves
from ramsight.machine.description import Machine
from ramsight.plant.ddh import DdhUnit, build_ddh
from ramsight.plant.steady import torque_at_load
from ramsight.sensor.balance import balance
from ramsight.sensor.kalman import kalman
from ramsight.sensor.table import MovementTable, speed_table, table
from ramsight.sensor.virtual_sensor import VirtualSensor
from ramsight.units import RPM
from reproduction.choices import UNITS, Choices, direct_driven

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]

TEMPERATURE = 313.15  # K; 40 degC, the paper's cycles
TABLE_SPEEDS = tuple(rpm * RPM for rpm in (250.0, 500.0, 1000.0, 1500.0, 2000.0, 3000.0))
_FEW_TEMPERATURES, _FEW_LOADS = np.array([303.15, 313.15, 323.15]), 16  # K; keeps six tables in one sensor small
SEED = 0
"""Of the noise of every run in the report."""
_BEFORE, _REST = 1.0, 1.5  # s
_CLOSED = 1e-5  # m; a cycle that ends so near to its begin is closed


@dataclass(frozen=True)
class Tracked:
    """A simulated run as a sensor saw it.

    Attributes:
        time: [s].
        truth: position [m].
        estimate: what the sensor said [m].
        status: of each sample.
    """

    time: Array
    truth: Array
    estimate: Array
    status: NDArray[np.int16]

    @property
    def error(self) -> Array:
        """Estimate less truth [m]."""
        return self.estimate - self.truth

    @property
    def largest_mm(self) -> float:
        """Largest magnitude of the error [mm]."""
        return float(1e3 * np.abs(self.error).max())

    @property
    def final_mm(self) -> float:
        """Magnitude of the error at the end [mm]."""
        return float(1e3 * abs(self.error[-1]))

    def lifted_mm(self, lift_sign: float) -> float:
        """Error at the end [mm], positive if the estimate stands higher than the rod."""
        return float(1e3 * lift_sign * self.error[-1])


@dataclass(frozen=True)
class Bench:
    """One unit with its loads and sensors.

    Attributes:
        unit: as its data sheet has it.
        loads: light, medium and high [N].
        ramp: of the motor's speed [s].
        machine: the description that it is of.
    """

    unit: DdhUnit
    loads: dict[str, float]
    ramp: float
    machine: Machine

    @cached_property
    def movement(self) -> MovementTable:
        """The paper's table, at its one speed."""
        return calibrated(self.unit)

    @cached_property
    def sensors(self) -> dict[str, VirtualSensor]:
        """The paper's table, the volume balance and the self-calibrating sensor, all by the data sheet."""
        return {"table": table(self.movement), "balance": balance(self.unit), "kalman": kalman(self.unit)}

    @cached_property
    def speed_tables(self) -> dict[str, VirtualSensor]:
        """Tables at `TABLE_SPEEDS`, interpolated over the speed and over its reciprocal."""
        tables = [small_table(self.unit, speed) for speed in TABLE_SPEEDS]
        return {"speed_table": speed_table(tables), "reciprocal_table": speed_table(tables, over="reciprocal")}

    def cycle(
        self,
        load: float,
        *,
        of: DdhUnit | None = None,
        temperature: float = TEMPERATURE,
        motor_speed: float = SPEED,
        hold: float | None = None,
        start: float | None = None,
        visits: int = 0,
        ramp: float | None = None,
    ) -> Duty:
        """The paper's lift-lower cycle of this unit.

        Args:
            load: [N].
            of: the unit as it was built, by default as described.
            temperature: of the oil [K].
            motor_speed: magnitude [rad/s].
            hold: as `lift_lower`'s.
            start: share of the stroke from the lowered end; by default that of `lift_lower`.
            visits: of end stops before the cycle.
            ramp: [s]; by default the bench's.
        """
        return lift_lower(
            of or self.unit,
            load,
            temperature,
            speed=motor_speed,
            ramp=self.ramp if ramp is None else ramp,
            hold=hold,
            start=None if start is None else self.at(start),
            visits=visits,
        )

    @property
    def lowered_end(self) -> float:
        """Position of the stop that the load pushes to [m]."""
        return 0.0 if self.unit.lift_sign > 0.0 else self.unit.cylinder.stroke

    def at(self, share: float) -> float:
        """Position [m] at a share of the stroke from the lowered end."""
        return self.lowered_end + share * self.unit.cylinder.stroke * self.unit.lift_sign

    def worn(self, leak_factor: float) -> DdhUnit:
        """The unit with pumps that leak so many times as much."""
        a, b = (replace(side, pump=replace(side.pump, leak_factor=leak_factor)) for side in (self.unit.a, self.unit.b))
        return replace(self.unit, a=a, b=b)

    def track(
        self,
        run: xarray.Dataset,
        sensor: VirtualSensor,
        *,
        add: Callable[[xarray.Dataset], xarray.Dataset] | None = None,
        seed: int = SEED,
        start_known: bool = True,
    ) -> Tracked:
        """Let a sensor follow what the drive reports of a run.

        Args:
            run: simulated.
            sensor: to judge.
            add: changes the log first, for example by references.
            seed: of the log's noise.
            start_known: whether the sensor starts at the known position; `kalman` alone can do without.
        """
        log = drive_report(run, seed=seed)
        sensor.start(float(run["position"][0]) if start_known else None)
        tracked = sensor.track(log if add is None else add(log))
        return Tracked(run["time"].values, run["position"].values, tracked["position"].values, tracked["status"].values)

    def closed_cycle(self, load: float, low: float, high: float, *, extra: float = 0.0) -> Duty:
        """A lift-lower cycle between two shares of the stroke that ends where it began.

        Args:
            load: [N].
            low: share of the stroke from the lowered end at which it begins.
            high: share at which it turns.
            extra: time for which it lowers longer than that [s].
        """
        up = SPEED * self.unit.lift_sign
        point = torque_at_load(self.unit, load, TEMPERATURE, SPEED)
        speeds = (SPEED * point.travel_lift, SPEED * point.travel_lower)
        holds = [(high - low) * self.unit.cylinder.stroke / speed - self.ramp for speed in speeds]

        def duty() -> Duty:
            moves = [(up, holds[0]), (-up, holds[1])]
            command = trapezoid_moves(moves, ramp=self.ramp, before=_BEFORE, rest=_REST)
            return Duty(command, constant(load), constant(TEMPERATURE), self.at(low))

        for _ in range(8):
            run = simulate(self.unit, duty())
            way = self.unit.lift_sign * (run["position"].values - self.at(low))
            short = (high - low) * self.unit.cylinder.stroke - float(way.max())
            rest = float(way[-1])
            if max(abs(short), abs(rest)) < _CLOSED:
                break
            holds = [holds[0] + short / speeds[0], holds[1] + (short + rest) / speeds[1]]
        holds[1] += extra
        return duty()


def small_table(unit: DdhUnit, speed: float = SPEED) -> MovementTable:
    """A coarser table [m/rad over N m and K] around 40 degC, at a motor speed [rad/s]; where many are made."""
    return calibrated(unit, motor_speed=speed, temperatures=_FEW_TEMPERATURES, loads=_FEW_LOADS)


def benches(choices: Choices | None = None) -> dict[str, Bench]:
    """The paper's two units by name.

    Args:
        choices: what the paper leaves open; by default as the catalogue has it.

    Raises:
        DescriptionError: the machine cannot be used.
    """
    choices = choices or Choices()
    described = choices.described()
    found = {}
    for name in UNITS:
        unit = build_ddh(name, direct_driven(described, name))
        found[name] = Bench(unit, choices.loads_of(direct_driven(described, name), unit), choices.ramp, described)
    return found
