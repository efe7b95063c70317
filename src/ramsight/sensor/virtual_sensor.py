"""What every virtual sensor is: a compiled recursion over what a drive reports, and nothing else."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ramsight.engine.recursion import Recursion, replay
from ramsight.plant.symbols import Parameters
from ramsight.sensor.status import Status

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]

INPUTS = ("time", "motor_speed", "motor_torque", "oil_temperature")
OUTPUTS = ("position", "position_std", "velocity", "load", "status")


@dataclass(frozen=True)
class Estimate:
    """What a sensor says after a sample.

    Attributes:
        position: [m].
        std: its standard deviation [m]; NaN if the sensor does not know it.
        velocity: [m/s]; NaN if unknown.
        load: [N], positive against lifting; NaN if unknown.
        status: whether to believe it, and why not.
    """

    position: float
    std: float
    velocity: float
    load: float
    status: Status


class SensorGraph:
    """Collects the states of a sensor's step while its graph is written."""

    def __init__(self) -> None:
        self.parameters = Parameters()
        self._states: dict[str, tuple[Any, float]] = {}
        self._next: dict[str, Any] = {}
        self.time, self.motor_speed, self.motor_torque, self.oil_temperature = (ca.SX.sym(n) for n in INPUTS)
        self.position = self.state("position")
        started, last_time, last_speed = self.state("started"), self.state("time"), self.state("motor_speed")
        self.elapsed = ca.if_else(started, ca.fmax(self.time - last_time, 0.0), 0.0)
        self.last_speed = ca.if_else(started, last_speed, self.motor_speed)
        self.angle = 0.5 * (self.last_speed + self.motor_speed) * self.elapsed
        self.becomes("started", 1.0)
        self.becomes("time", self.time)
        self.becomes("motor_speed", self.motor_speed)

    def state(self, name: str, initial: float = 0.0) -> Any:
        """A new state's symbol."""
        self._states[name] = (ca.SX.sym(name), initial)
        return self._states[name][0]

    def becomes(self, name: str, expression: Any) -> None:
        """What a state is after the sample."""
        self._next[name] = expression

    def sensor(
        self, kind: str, *, position: Any, velocity: Any, load: Any, std: Any, status: Any
    ) -> VirtualSensor:
        """Close the graph."""
        self.becomes("position", position)
        recursion = Recursion(
            state=tuple(self._states),
            inputs=INPUTS,
            parameters=self.parameters.names,
            outputs=OUTPUTS,
            x=ca.vertcat(*(symbol for symbol, _ in self._states.values())),
            u=ca.vertcat(self.time, self.motor_speed, self.motor_torque, self.oil_temperature),
            p=self.parameters.column,
            next_state=ca.vertcat(*(self._next[name] for name in self._states)),
            output=ca.vertcat(position, std, velocity, load, status),
        )
        initial = np.array([value for _, value in self._states.values()])
        return VirtualSensor(kind, recursion, self.parameters.values, initial)


@dataclass
class VirtualSensor:
    """Position from motor speed, motor torque and oil temperature.

    Args:
        kind: its name, for example ``balance``.
        recursion: its step.
        parameters: values of the recursion's parameters.
        initial: states before the first sample.
    """

    kind: str
    recursion: Recursion
    parameters: Array
    initial: Array
    _state: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._state = self.initial.copy()

    def start(self, position: float) -> None:
        """Forget everything and begin at a known position [m]."""
        self._state = self.initial.copy()
        self._state[self.recursion.state.index("position")] = position

    def step(self, time: float, motor_speed: float, motor_torque: float, oil_temperature: float) -> Estimate:
        """Take one sample.

        Args:
            time: [s], increasing from sample to sample.
            motor_speed: [rad/s].
            motor_torque: [N m].
            oil_temperature: [K].
        """
        sample = np.array([[time, motor_speed, motor_torque, oil_temperature]])
        position, std, velocity, load, status = replay(self.recursion, sample, self.parameters, self._state)[
            0
        ]
        return Estimate(float(position), float(std), float(velocity), float(load), Status(int(status)))

    def track(self, log: xarray.Dataset, *, advance: Callable[[int], object] | None = None) -> xarray.Dataset:
        """Go through a drive log, from the position given to `start`.

        Args:
            log: Dataset over `time` with motor_speed [rad/s], motor_torque [N m] and oil_temperature [K]; whatever
                else it may hold is not looked at.
            advance: called now and then with the number of samples done since the last call.

        Returns:
            A Dataset over the same `time` with position, position_std, velocity, load and status.
        """
        import xarray

        columns: Sequence[Any] = [log["time"].values, *(log[name].values for name in INPUTS[1:])]
        inputs = np.ascontiguousarray(np.column_stack(columns), dtype=np.float64)
        result = replay(self.recursion, inputs, self.parameters, self._state, advance=advance)
        units = {"position": "m", "position_std": "m", "velocity": "m/s", "load": "N", "status": "1"}
        data = {
            name: ("time", result[:, k], {"units": units[name], "long_name": name.replace("_", " ")})
            for k, name in enumerate(OUTPUTS)
        }
        tracked = xarray.Dataset(data, coords={"time": log["time"]}, attrs={"format": 1, "sensor": self.kind})
        tracked["status"] = tracked["status"].astype(np.int16)
        meanings = {str(int(status)): status.text for status in Status}
        tracked["status"].attrs = {
            "long_name": "status",
            "meaning": "; ".join(f"{k}: {v}" for k, v in meanings.items()),
        }
        return tracked
