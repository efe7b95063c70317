"""What every virtual sensor is: a compiled recursion over what a drive reports, and nothing else."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ramsight.engine.recursion import Recursion, replay
from ramsight.errors import LogError, RamsightError
from ramsight.logs.channels import column_of, is_command
from ramsight.plant.circuit import COMMANDED
from ramsight.plant.symbols import Parameters
from ramsight.sensor.status import Status

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]

REPORTED = ("time", "motor_speed", "motor_torque", "oil_temperature")
INPUTS = (*REPORTED, "reference", "reference_known")
"""What a step takes: what the drive reports, and a position known at that sample, if one is."""
_RELIEF_PASSES = 0.1  # s; five samples of a usual drive, so that noise alone does not lose the position

PRESSURES = ("pressure_a", "pressure_b")
LINK_ANGLE = "link_angle"
SHAFT_ANGLE = "shaft_angle"
DC_POWER = "dc_power"
MOTOR_TEMPERATURE = "motor_temperature"
MEASURED = {
    **dict.fromkeys(PRESSURES, ("Pa", "absolute")),
    LINK_ANGLE: ("rad", "of the body that the cylinder turns, against what it hangs on, 0 as drawn"),
    SHAFT_ANGLE: ("rad", "that the drive's counter says of the shaft, growing where speed is positive"),
    DC_POWER: ("W", "that the drive takes from its DC link, negative where it gives"),
    MOTOR_TEMPERATURE: ("K", "of the motor, as its drive reports it"),
}
"""Inputs that a sensor takes where they are measured, no number where one shows nothing: unit, and what they are."""
LAST_SHAFT_ANGLE, SHAFT_BEGUN = "last_shaft_angle", "shaft_begun"
"""States: the counter when it was last there, and whether that was at the last sample."""

UNITS = {"position": "m", "position_std": "m", "velocity": "m/s", "load": "N", "status": "1"}
OUTPUTS = tuple(UNITS)
BOUND = "position_bound"
"""Output of a sensor that bounds its error: what one sample in 100 000 exceeds without a warning [m]."""


IS_REFERENCED = "is_referenced"
"""The state of a sensor that finds its position by itself: whether it has."""
REFERENCED_NOW = "referenced_since_power_up"
"""Its state, and output: whether a reference has come since it was started, or resumed after a power loss."""
VARIANCE = "covariance_00"
"""Its state with the position's variance [m2]."""
START_STD = 1e-3  # m, of a position given by hand
START_SLACK = 1e-3  # m by which it may lie outside the stroke: a stop gives way, and numbers are rounded
_STROKE = "circuit.cylinder.stroke"
_COMMANDS = 1.5  # a command beyond is none; from 1 to here it is rounded
MEASURABLE = 1e9  # rad, W, Pa or m; what is beyond, or no number, is not measured
_LARGEST = 1e12  # of any output, in SI units
_LARGEST_STATE = 1e30  # of any state, as in exported C: its square is a number, too


class StartError(RamsightError):
    """A sensor that cannot begin without a position, or not with the one that it was given."""


@dataclass(frozen=True)
class Estimate:
    """What a sensor says after a sample.

    Attributes:
        position: [m].
        std: its standard deviation [m]; NaN if the sensor does not know it.
        velocity: [m/s]; NaN if unknown.
        load: [N], positive against lifting; NaN if unknown.
        status: whether to believe it, and why not.

    Example:
        >>> import ramsight
        >>> sensor = ramsight.sensor_for("mining-loader", unit="boom")
        >>> sensor.start(position=0.1)  # m
        >>> now = sensor.step(time=0.0, motor_speed=0.0, motor_torque=0.0, oil_temperature=313.15)
        >>> now.position, round(now.std, 4), now.status.text
        (0.1, 0.0019, 'ok')
    """

    position: float
    std: float
    velocity: float
    load: float
    status: Status


class SensorGraph:
    """Collects the states of a sensor's step while its graph is written.

    Args:
        commands: commanded parts of the circuit, whose commands are inputs after `INPUTS`.
        measured: what else is an input after those, of the keys of `MEASURED`.
    """

    def __init__(self, commands: Sequence[str] = (), measured: Sequence[str] = ()) -> None:
        self.parameters = Parameters()
        self._states: dict[str, tuple[Any, float]] = {}
        self._next: dict[str, Any] = {}
        self._always: set[str] = set()
        self._passed_over: Any = 0.0
        self._sections: list[tuple[str, Any]] = []
        self.inputs = [ca.SX.sym(name) for name in INPUTS]
        self.time, self.motor_speed, self.motor_torque, self.oil_temperature = self.inputs[:4]
        self.reference, self.referenced = self.inputs[4:]
        self.inputs += [ca.SX.sym(column_of(part)) for part in commands]
        self.measured = {name: ca.SX.sym(name) for name in measured}
        self.inputs += self.measured.values()
        self.position = self.state("position")
        started, last_time, last_speed = self.state("started"), self.state("time"), self.state("motor_speed")
        self.elapsed = ca.if_else(started, ca.fmax(self.time - last_time, 0.0), 0.0)
        self.last_speed = ca.if_else(started, last_speed, self.motor_speed)
        self.mean_speed = 0.5 * (self.last_speed + self.motor_speed)
        self.angle = self.mean_speed * self.elapsed
        self.becomes("started", 1.0)
        self.becomes("time", self.time)
        self.becomes("motor_speed", self.motor_speed)
        if SHAFT_ANGLE in self.measured:
            self._count(self.measured[SHAFT_ANGLE])
        last_commands = [self.state(column_of(part), COMMANDED) for part in commands]
        places = range(len(INPUTS), len(INPUTS) + len(commands))
        self.commands = {
            part: self._command(self.inputs[place], last)
            for part, place, last in zip(commands, places, last_commands, strict=True)
        }
        self.way, self.last_way = _way(list(self.commands.values())), _way(last_commands)
        self.warmer: Any = 0.0

    def _count(self, angle: Any) -> None:
        """Remember the shaft's counter, and whether there was one."""
        last, _ = self.state(LAST_SHAFT_ANGLE), self.state(SHAFT_BEGUN)
        there = ca.fabs(angle) < _LARGEST
        self.becomes(LAST_SHAFT_ANGLE, ca.if_else(there, angle, last))
        self.becomes(SHAFT_BEGUN, there)

    def _command(self, given: Any, last: Any) -> Any:
        """A command, -1 to 1; the last one where there is none."""
        value = ca.if_else(ca.fabs(given) <= _COMMANDS, ca.fmin(ca.fmax(given, -1.0), 1.0), last)
        self.becomes(last.name(), value)
        return value

    @property
    def pump_temperature(self) -> Any:
        """Of the oil in the pumps' gaps [K]: the reported one, where nothing says by how much they are `warmer`."""
        return self.oil_temperature + self.warmer

    @property
    def extending_speed(self) -> Any:
        """Motor speed, positive where it extends the piston [rad/s]."""
        return self.way * self.motor_speed

    @property
    def last_extending_speed(self) -> Any:
        """The same at the last sample [rad/s]."""
        return self.last_way * self.last_speed

    @property
    def extending_angle(self) -> Any:
        """Angle of the motor since the last sample, positive where it extends the piston [rad]."""
        return self.way * self.angle

    def state(self, name: str, initial: float = 0.0) -> Any:
        """A new state's symbol.

        Raises:
            ValueError: there is one of that name already.
        """
        if name in self._states:
            raise ValueError(f"two states are named {name}")
        self._states[name] = (ca.SX.sym(name), initial)
        return self._states[name][0]

    def initially(self, name: str, value: float) -> None:
        """Another value of a state before the first sample."""
        self._states[name] = (self._states[name][0], value)

    def held(self, name: str) -> Any:
        """The symbol of a state that is there already."""
        return self._states[name][0]

    def becomes(self, name: str, expression: Any, *, always: bool = False) -> None:
        """What a state is after the sample; `always`, even if the sample is passed over."""
        self._next[name] = expression
        if always:
            self._always.add(name)

    def becoming(self, name: str) -> Any:
        """What a state is after the sample, as far as it has been said."""
        return self._next[name]

    @property
    def said(self) -> list[Any]:
        """What states are after the sample, as far as it has been said."""
        return list(self._next.values())

    def pass_over(self, condition: Any) -> None:
        """Samples after which every state is what it was, as if they had never come."""
        self._passed_over = condition

    def section(self, title: str, *found: Any) -> None:
        """Name the part of the step that ends here; exported C says where it begins.

        Args:
            title: of the part.
            found: what it leads to, expressions or objects that hold some; what is needed for it belongs to this part,
                unless it was needed before.
        """
        self._sections.append((title, ca.vertcat(*(one for each in found for one in _expressions(each)))))

    def lost(self, relief_open: Any, found: Any) -> Any:
        """Whether the position is lost: the relief valve has let oil pass, and no reference came since.

        Args:
            relief_open: whether this sample looks like it; noise is told from it by how long it lasts.
            found: whether a reference comes with this sample.
        """
        since, lost = self.state("relief_open_for"), self.state("position_lost")
        since_1 = ca.if_else(relief_open, since + self.elapsed, 0.0)
        lost_1 = ca.if_else(found, 0.0, ca.fmax(lost, since_1 > _RELIEF_PASSES))
        self.becomes("relief_open_for", since_1)
        self.becomes("position_lost", lost_1)
        return lost_1

    def sensor(
        self,
        kind: str,
        *,
        position: Any,
        velocity: Any,
        load: Any,
        std: Any,
        status: Any,
        more: Mapping[str, tuple[Any, str]] | None = None,
    ) -> VirtualSensor:
        """Close the graph.

        Args:
            kind: the sensor's name.
            position: after a sample [m].
            velocity: [m/s].
            load: [N].
            std: of the position [m].
            status: as a number.
            more: further outputs with their units.
        """
        more = more or {}
        # Without numbers there is no position, whatever the reason; a comparison with NaN is false.
        numbers = [ca.fabs(value) < _LARGEST for value in (position, std, velocity, load) if not _is_nan(value)]
        for number in numbers:
            status = ca.if_else(number, status, float(Status.STATE_INVALID))
        after = []
        for name, (before, _) in self._states.items():
            after.append(
                self._next[name] if name in self._always else ca.if_else(self._passed_over, before, self._next[name])
            )
        recursion = Recursion(
            state=tuple(self._states),
            inputs=tuple(symbol.name() for symbol in self.inputs),
            parameters=self.parameters.names,
            outputs=(*OUTPUTS, *more),
            x=ca.vertcat(*(symbol for symbol, _ in self._states.values())),
            u=ca.vertcat(*self.inputs),
            p=self.parameters.column,
            next_state=ca.vertcat(*after),
            output=ca.vertcat(position, std, velocity, load, status, *(value for value, _ in more.values())),
        )
        initial = np.array([value for _, value in self._states.values()])
        units = {**UNITS, **{name: unit for name, (_, unit) in more.items()}}
        return VirtualSensor(kind, recursion, self.parameters.values, initial, units, tuple(self._sections))

    def counting(self, kind: str, *, position: Any, **said: Any) -> VirtualSensor:
        """Close the graph of a sensor that believes every reference: it takes the place of the position.

        Args:
            kind: the sensor's name.
            position: after a sample without a reference [m].
            said: the rest, as `sensor` takes it.
        """
        position = ca.if_else(self.referenced, self.reference, position)
        self.becomes("position", position)
        return self.sensor(kind, position=position, **said)


def _way(commands: list[Any]) -> Any:
    """The way in which positive motor speed moves the piston, 1 extends.

    Where a directional valve chooses the chamber that the pump fills, its command says it.
    """
    way: Any = 1.0
    for value in commands:
        way = way * ca.if_else(value < 0.0, -1.0, 1.0)
    return way


def _expressions(found: Any) -> Iterator[Any]:
    """Expressions of CasADi that an object holds."""
    if isinstance(found, ca.SX):
        yield found
    elif isinstance(found, list | tuple):
        for one in found:
            yield from _expressions(one)
    elif is_dataclass(found):
        yield from _expressions([getattr(found, one.name) for one in fields(found)])


def _is_nan(value: Any) -> bool:
    """Whether an output is one that the sensor never knows."""
    return isinstance(value, float) and math.isnan(value)


@dataclass
class VirtualSensor:
    """Position from motor speed, motor torque and oil temperature.

    Args:
        kind: its name, for example ``balance``.
        recursion: its step.
        parameters: values of the recursion's parameters.
        initial: states before the first sample.
        units: of its outputs.
        sections: parts of the step in order, each a title and what it leads to; the last part needs none.
    """

    kind: str
    recursion: Recursion
    parameters: Array
    initial: Array
    units: Mapping[str, str]
    sections: tuple[tuple[str, Any], ...] = field(default=(), repr=False)
    _state: Array = field(init=False, repr=False)
    _says: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._state = self.initial.copy()
        self._says = np.full(len(self.recursion.outputs), math.nan)

    @property
    def commands(self) -> tuple[str, ...]:
        """Commands that it takes beside what a drive reports, named as in logs, for example `valve_command`."""
        return tuple(name for name in self.further if is_command(name))

    @property
    def further(self) -> tuple[str, ...]:
        """All inputs beside what a drive reports and a reference; the commands, then what is `optional`."""
        return self.recursion.inputs[len(INPUTS) :]

    @property
    def optional(self) -> tuple[str, ...]:
        """What it takes beside that where it is measured, the chambers' pressures of a unit with sensors for them."""
        return tuple(name for name in self.further if not is_command(name))

    @property
    def stroke(self) -> float:
        """Of its unit [m]; infinite if the sensor does not know it, as the table does not."""
        names = self.recursion.parameters
        return float(self.parameters[names.index(_STROKE)]) if _STROKE in names else math.inf

    def start(self, position: float | None, std: float = START_STD) -> None:
        """Forget everything and begin anew.

        Args:
            position: where the piston is, 0 to the stroke [m]; None if nobody knows, which only `kalman` can work
                with.
            std: standard deviation of that, 0 to the stroke [m].

        Raises:
            StartError: the position is not known, and this sensor cannot find it by itself; or position or standard
                deviation cannot be. The sensor is then as it was.
        """
        place = self.recursion.state.index
        finds = IS_REFERENCED in self.recursion.state
        if position is None and not finds:
            raise StartError(f"the {self.kind} sensor has to be told where the piston is at first (--start)")
        if position is not None:
            self._check_start(position, std)
        self._state = self.initial.copy()
        if position is None:
            return
        self._state[place("position")] = min(max(position, 0.0), self.stroke)
        if finds:
            self._state[place(IS_REFERENCED)] = self._state[place(REFERENCED_NOW)] = 1.0
            self._state[place(VARIANCE)] = std**2

    def _check_start(self, position: float, std: float) -> None:
        stroke = self.stroke
        if not (math.isfinite(position) and -START_SLACK <= position <= stroke + START_SLACK):
            raise StartError(f"position at the start = {position!r} m: outside the stroke (allowed: 0 to {stroke:g} m)")
        if not (math.isfinite(std) and 0.0 <= std <= stroke):
            raise StartError(f"standard deviation at the start = {std!r} m: cannot be (allowed: 0 to {stroke:g} m)")

    @property
    def state(self) -> dict[str, float]:
        """Everything the sensor knows, by name."""
        return dict(zip(self.recursion.state, self._state.tolist(), strict=True))

    @state.setter
    def state(self, values: Mapping[str, float]) -> None:
        if set(values) != set(self.recursion.state):
            raise ValueError(f"not a state of the {self.kind} sensor")
        wrong = impossible(self, values)
        if wrong:
            raise ValueError(f"not a state of the {self.kind} sensor: {wrong}")
        self._state = np.array([values[name] for name in self.recursion.state], dtype=np.float64)

    def step(
        self,
        time: float,
        motor_speed: float,
        motor_torque: float,
        oil_temperature: float,
        reference: float | None = None,
        **others: float,
    ) -> Estimate:
        """Take one sample.

        Args:
            time: [s], increasing from sample to sample.
            motor_speed: [rad/s].
            motor_torque: [N m].
            oil_temperature: [K].
            reference: position known at this sample [m], from a switch or a stop; None or no finite number if none is.
            others: commands to the circuit's commanded parts, -1 to 1, by their names in `commands`; one that is left
                out, or NaN, is as before. And what is `optional`, in SI.

        Raises:
            ValueError: the sensor takes no such input.
        """
        names = self.further
        if unknown := set(others) - set(names):
            raise ValueError(f"unknown input {min(unknown)!r} (known: {', '.join(names) or 'none'})")
        known = reference is not None and math.isfinite(reference)
        at = reference if known else 0.0
        given = (others.get(name, math.nan) for name in names)
        sample = np.array([[time, motor_speed, motor_torque, oil_temperature, at, known, *given]], dtype=np.float64)
        self._says = replay(self.recursion, sample, self.parameters, self._state)[0]
        position, std, velocity, load, status = self._says[:5]
        return Estimate(float(position), float(std), float(velocity), float(load), Status(int(status)))

    def says(self, output: str) -> float:
        """An output after the last `step`, by its name [SI]; NaN before the first one, and of one that it has not."""
        names = self.recursion.outputs
        return float(self._says[names.index(output)]) if output in names else math.nan

    def track(self, log: xarray.Dataset, *, advance: Callable[[int], object] | None = None) -> xarray.Dataset:
        """Go through a drive log, from the position given to `start`.

        Args:
            log: Dataset over `time` with motor_speed [rad/s], motor_torque [N m] and oil_temperature [K], with the
                commands that the circuit takes, and perhaps reference [m], NaN where no position is known; whatever
                else it may hold is not looked at.
            advance: called now and then with the number of samples done since the last call.

        Returns:
            A Dataset over the same `time` with position, position_std, velocity, load, status, and whatever else
            this sensor knows, each with `units`.
        """
        import xarray

        inputs = log_inputs(self, log)
        result = replay(self.recursion, inputs, self.parameters, self._state, advance=advance)
        data = {
            name: ("time", result[:, k], {"units": self.units[name], "long_name": name.replace("_", " ")})
            for k, name in enumerate(self.recursion.outputs)
        }
        tracked = xarray.Dataset(data, coords={"time": log["time"]}, attrs={"format": 1, "sensor": self.kind})
        tracked["status"] = tracked["status"].astype(np.int16)
        meanings = {str(int(status)): status.text for status in Status}
        tracked["status"].attrs = {
            "long_name": "status",
            "meaning": "; ".join(f"{k}: {v}" for k, v in meanings.items()),
        }
        return tracked


def log_inputs(sensor: VirtualSensor, log: xarray.Dataset) -> Array:
    """A log as the inputs of a sensor's recursion, shape (samples, inputs).

    Raises:
        LogError: the log lacks a command that the circuit takes.
    """
    for name in sensor.commands:
        if name not in log:
            raise LogError("is missing: the circuit has a part that it commands", file="log", column=name)
    columns: list[Any] = [log[name].values for name in REPORTED]
    reference = log["reference"].values if "reference" in log else np.full(log.sizes["time"], np.nan)
    known = np.isfinite(reference)
    columns += [np.where(known, reference, 0.0), known]
    columns += [log[name].values for name in sensor.commands]
    unknown = np.full(log.sizes["time"], np.nan)
    columns += [log[name].values if name in log else unknown for name in sensor.optional]
    return np.ascontiguousarray(np.column_stack(columns), dtype=np.float64)


def impossible(sensor: VirtualSensor, state: Mapping[str, float]) -> str:
    """Why a sensor cannot have a state, for example one read from a file; empty if it can.

    Args:
        sensor: whose state it would be.
        state: a value for each of its states.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.ddh import build_ddh
        >>> from ramsight.sensor.kalman import kalman
        >>> boom = kalman(build_ddh("boom", machine.load("mining-loader").unit("boom")))
        >>> impossible(boom, boom.state), impossible(boom, {**boom.state, "covariance_00": -1.0})
        ('', 'covariance_00 = -1.0: a variance is not negative')
    """
    wrong = next(
        (f"{name} = {value!r}: no number a sensor has" for name, value in state.items() if not _is_number(value)), ""
    )
    if wrong:
        return wrong
    position, stroke = state["position"], sensor.stroke
    if not -stroke <= position <= 2.0 * stroke:
        return f"position = {position!r} m: more than a stroke away from the stroke (0 to {stroke:g} m)"
    negative = next((name for name, value in state.items() if value < 0.0 and is_variance(name)), "")
    if negative:
        return f"{negative} = {state[negative]!r}: a variance is not negative"
    for name in (IS_REFERENCED, REFERENCED_NOW):
        if state.get(name, 0.0) not in (0.0, 1.0):
            return f"{name} = {state[name]!r}: neither 0 nor 1"
    return ""


def is_variance(state: str) -> bool:
    """Whether a state is the variance of something: an entry of a covariance's diagonal.

    Example:
        >>> is_variance("covariance_00"), is_variance("low_covariance_33"), is_variance("low_covariance_35")
        (True, True, False)
    """
    _, is_one, entry = state.rpartition("covariance_")
    return bool(is_one) and len(entry) == 2 and entry[0] == entry[1]


def _is_number(value: float) -> bool:
    """Whether a state can have a value; NaN and infinity are none."""
    return abs(value) <= _LARGEST_STATE
