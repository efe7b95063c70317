"""What every virtual sensor is: a compiled recursion over what a drive reports, and nothing else."""

from __future__ import annotations

import math
from collections.abc import Callable
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

REPORTED = ("time", "motor_speed", "motor_torque", "oil_temperature")
INPUTS = (*REPORTED, "reference", "reference_known")
"""What a step takes: what the drive reports, and a position known at that sample, if one is."""
_RELIEF_PASSES = 0.1  # s; five samples of a usual drive, so that noise alone does not lose the position

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
        self.inputs = [ca.SX.sym(name) for name in INPUTS]
        self.time, self.motor_speed, self.motor_torque, self.oil_temperature = self.inputs[:4]
        self.reference, self.referenced = self.inputs[4:]
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

    def lost(self, relief_open: Any) -> Any:
        """Whether the position is lost: the relief valve has let oil pass, and no reference came since.

        Args:
            relief_open: whether this sample looks like it; noise is told from it by how long it lasts.
        """
        since, lost = self.state("relief_open_for"), self.state("position_lost")
        since_1 = ca.if_else(relief_open, since + self.elapsed, 0.0)
        lost_1 = ca.if_else(self.referenced, 0.0, ca.fmax(lost, since_1 > _RELIEF_PASSES))
        self.becomes("relief_open_for", since_1)
        self.becomes("position_lost", lost_1)
        return lost_1

    def sensor(self, kind: str, *, position: Any, velocity: Any, load: Any, std: Any, status: Any) -> VirtualSensor:
        """Close the graph. A reference, where there is one, takes the place of the position."""
        position = ca.if_else(self.referenced, self.reference, position)
        self.becomes("position", position)
        recursion = Recursion(
            state=tuple(self._states),
            inputs=INPUTS,
            parameters=self.parameters.names,
            outputs=OUTPUTS,
            x=ca.vertcat(*(symbol for symbol, _ in self._states.values())),
            u=ca.vertcat(*self.inputs),
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

    def step(
        self,
        time: float,
        motor_speed: float,
        motor_torque: float,
        oil_temperature: float,
        reference: float | None = None,
    ) -> Estimate:
        """Take one sample.

        Args:
            time: [s], increasing from sample to sample.
            motor_speed: [rad/s].
            motor_torque: [N m].
            oil_temperature: [K].
            reference: position known at this sample [m], from a switch or a stop; None or NaN if none is.
        """
        known = reference is not None and not math.isnan(reference)
        at = reference if known else 0.0
        sample = np.array([[time, motor_speed, motor_torque, oil_temperature, at, known]], dtype=np.float64)
        position, std, velocity, load, status = replay(self.recursion, sample, self.parameters, self._state)[0]
        return Estimate(float(position), float(std), float(velocity), float(load), Status(int(status)))

    def track(self, log: xarray.Dataset, *, advance: Callable[[int], object] | None = None) -> xarray.Dataset:
        """Go through a drive log, from the position given to `start`.

        Args:
            log: Dataset over `time` with motor_speed [rad/s], motor_torque [N m] and oil_temperature [K], and
                perhaps reference [m], NaN where no position is known; whatever else it may hold is not looked at.
            advance: called now and then with the number of samples done since the last call.

        Returns:
            A Dataset over the same `time` with position, position_std, velocity, load and status.
        """
        import xarray

        columns: list[Any] = [log[name].values for name in REPORTED]
        reference = log["reference"].values if "reference" in log else np.full(log.sizes["time"], np.nan)
        known = np.isfinite(reference)
        columns += [np.where(known, reference, 0.0), known]
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
