"""What every virtual sensor is: a compiled recursion over what a drive reports, and nothing else."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any, TypeVar

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ramsight.engine.recursion import Graph, Recursion, Stepper, replay
from ramsight.engine.typed_state import Leaf, column, initial_values, leaves
from ramsight.errors import LogError, RamsightError
from ramsight.expression import Flag, Real, Scalar, all_of, negated, replaced_where
from ramsight.logs.channels import is_command
from ramsight.plant.symbols import Parameters
from ramsight.sensor.inputs.sample import INPUTS, REPORTED, Raw
from ramsight.sensor.pickled import put_together, taken_apart
from ramsight.sensor.status import Status
from ramsight.sensor.thresholds import NUMBER_LIMIT, START_STD
from ramsight.signals import Samples, Signal, Signals

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]
S = TypeVar("S")
Outputs = dict[str, tuple[Scalar, str]]
"""Expressions by the names of outputs, with their units."""

UNITS = {"position": "m", "position_std": "m", "velocity": "m/s", "load": "N", "status": "1"}
OUTPUTS = tuple(UNITS)
BOUND = "position_bound"
"""Output of a sensor that bounds its error: what one sample in 100 000 exceeds without a warning [m]."""
LOWEST, HIGHEST = "position_low", "position_high"
"""Outputs of such a sensor: the ends of its 95 % band, within the stroke [m]."""
OF_POSITION = frozenset({"position", "position_std", LOWEST, HIGHEST, BOUND})
"""Outputs that are no numbers as long as the position is unknown."""
LIVE = "live_"
"""Before the names of what a sensor said as a log came, where more is said of it by all of the log."""
STATUS = "status"
"""Output that says whether to rely on the others."""
POSITION, TIME = "position", "intake.time"
"""States of every sensor: its position [m], and the time of the last sample that counted [s]."""
IS_REFERENCED = "position_known"
"""The state of a sensor that finds its position by itself: whether it has."""
REFERENCED_NOW = "referenced_since_power_up"
"""Its state, and output: whether a reference has come since it was started, or resumed after a power loss."""
LOAD_STD, LOAD_AGE = "load_std", "load_age"
"""Outputs: standard deviation of the load [N], and how long nothing has shown it [s]."""
VARIANCE = "position_variance"
"""Its state with the position's variance [m2]."""
DISPUTED = "update.disputed"
"""Its state that is 1 from a reference that was rejected until one is accepted."""
_STROKE = "circuit.cylinder.stroke"
_LARGEST_STATE = 1e30  # of any state, as in exported C: its square is a number, too


class StartError(RamsightError):
    """A sensor that cannot begin without a position, or not with the one that was passed."""


@dataclass(frozen=True)
class Estimate:
    """What a sensor reports after a sample.

    Example:
        >>> import ramsight
        >>> sensor = ramsight.sensor_for("mining-loader", unit="boom")
        >>> sensor.start(position=0.1)  # m
        >>> now = sensor.step(time=0.0, motor_speed=0.0, motor_torque=0.0, oil_temperature=313.15)
        >>> now.position, round(now.position_std, 4), now.status.text
        (0.1, 0.0021, 'uncertain: reference due')
    """

    position: float  # [m]; NaN as long as it is unknown
    position_std: float  # its standard deviation [m]; NaN if the sensor does not know it
    velocity: float  # [m/s]; NaN if unknown
    load: float  # [N], positive against lifting; NaN if unknown
    status: Status  # whether to rely on it, and why not


@dataclass(frozen=True)
class Section:
    """A part of a sensor's step; exported C has a heading for each."""

    title: str  # of the part
    # found: what it leads to, expressions or objects that hold some; what is needed for it belongs to this part,
    # unless it was needed before
    found: object
    # alike: stages of several of a kind, as of the hypotheses, which are worked out alike: exported C has what leads
    # from one stage to the next once for all of them
    alike: tuple[Sequence[object], ...] = ()

    @property
    def marks(self) -> Any:  # a column of expressions of whatever kind
        """All that it leads to, as one column."""
        return ca.vertcat(*_expressions(self.found))

    @property
    def rows(self) -> Any:
        """What corresponds in the stages, a row each with a column for each of the kind."""
        stages = ([ca.vertcat(*_expressions(one)) for one in stage] for stage in self.alike)
        return ca.vertcat(*(ca.horzcat(*columns) for columns in stages))


@dataclass(frozen=True)
class Report:
    """What a sensor reports after a sample; a number where it is never known."""

    position: Scalar  # [m]
    std: Real  # of it [m]
    velocity: Real  # [m/s]
    load: Real  # [N]
    status: Scalar  # as a number
    more: Mapping[str, tuple[Scalar, str]] = field(default_factory=dict)  # further outputs with their units
    known: Flag | None = None  # whether there is a position; None where there always is

    @property
    def outputs(self) -> list[Real]:
        """In the order of `OUTPUTS`, then `more`: without a position, it and what is said of it are no numbers."""
        usual = dict(zip(OUTPUTS, (self.position, self.std, self.velocity, self.load, self._status), strict=True))
        found = usual | {name: value for name, (value, _) in self.more.items()}
        if self.known is not None:
            nothing = ca.if_else(self.known, 0.0, math.nan)  # added, it leads into no branch
            found |= {one: found[one] + nothing for one in OF_POSITION if one in found}
        return list(found.values())

    @property
    def _status(self) -> Scalar:
        """Without numbers there is no position, whatever the reason; a comparison with not-a-number is false."""
        said = (self.position, self.std, self.velocity, self.load)
        numbers = [ca.fabs(value) < NUMBER_LIMIT for value in said if not isinstance(value, float)]
        return replaced_where(negated(all_of(*numbers)), self.status, float(Status.STATE_INVALID))


def close(
    kind: str,
    parameters: Parameters,
    raw: Raw,
    initial: S,
    before: S,
    after: S,
    report: Report,
    sections: Sequence[Section] = (),
) -> VirtualSensor:
    """A sensor of its state, its inputs and its outputs."""
    states = tuple(leaves(initial))
    names = [one.name for one in leaves(after)]
    if names != [one.name for one in states]:
        raise ValueError(f"a state is missing after the sample: {sorted({one.name for one in states} ^ set(names))}")
    inputs = raw.inputs
    graph = Graph(
        x=column(before),
        u=ca.vertcat(*inputs),
        p=parameters.column,
        next_state=column(after),
        output=ca.vertcat(*report.outputs),
    )
    recursion = Recursion(
        state=tuple(one.name for one in states),
        inputs=tuple(symbol.name() for symbol in inputs),
        parameters=parameters.names,
        outputs=(*OUTPUTS, *report.more),
        drawn=lambda: graph,
    )
    units = {**UNITS, **{name: unit for name, (_, unit) in report.more.items()}}
    return VirtualSensor(
        kind, recursion, parameters.values, initial_values(initial), units, states,
        lambda: tuple((one.title, one.marks, one.rows) for one in sections),
    )  # fmt: skip


def _expressions(found: object) -> Iterator[Any]:
    """Expressions of CasADi that an object holds."""
    if isinstance(found, ca.SX):
        yield found
    elif isinstance(found, Mapping):
        for one in found.values():
            yield from _expressions(one)
    elif isinstance(found, list | tuple):
        for one in found:
            yield from _expressions(one)
    elif is_dataclass(found):
        yield from _expressions([getattr(found, one.name) for one in fields(found)])


@dataclass
class VirtualSensor:
    """Position from motor speed, motor torque and oil temperature."""

    kind: str  # its name, for example ``balance``
    recursion: Recursion  # its step
    parameters: Array  # values of the recursion's parameters
    initial: Array  # states before the first sample
    units: Mapping[str, str]  # of its outputs
    states: tuple[Leaf, ...] = field(repr=False)  # what is declared of each state, in the recursion's order
    # sections: gives the parts of the step in order, each a title, what it leads to, and rows of what is worked out
    # alike; the last part needs none
    sections: Callable[[], tuple[tuple[str, Any, Any], ...]] = field(default=tuple, repr=False)
    _state: Array = field(init=False, repr=False)
    _says: Array = field(init=False, repr=False)
    _stepper: Stepper | None = field(init=False, repr=False, compare=False, default=None)

    def __post_init__(self) -> None:
        self._state = self.initial.copy()
        self._says = np.full(len(self.recursion.outputs), math.nan)

    def __copy__(self) -> VirtualSensor:
        """A sensor of its own that goes on from what this one knows."""
        other = replace(self)
        other._state, other._says = self._state.copy(), self._says.copy()
        return other

    def __deepcopy__(self, memo: object) -> VirtualSensor:
        """The same: a step never changes."""
        return self.__copy__()

    def __reduce__(self) -> tuple[Any, ...]:
        """For other processes, as `multiprocessing` and Dask need it."""
        return put_together, (type(self), taken_apart(self))

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of what it says."""
        return self.recursion.outputs

    @property
    def learned(self) -> tuple[str, ...]:
        """Names of the states that describe the machine; all others describe where the piston is, or pressures."""
        return tuple(one.name for one in self.states if one.learned)

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
        """Forget everything and begin again.

        Args:
            position: where the piston is, 0 to the stroke [m]; None if unknown, which only `kalman` can work
                with.
            std: standard deviation of that, 0 to the stroke [m].

        Raises:
            StartError: the position is not known, and this sensor cannot find it by itself; or position or standard
                deviation cannot be. The sensor is then as it was.
        """
        place = self.recursion.state.index
        finds = IS_REFERENCED in self.recursion.state
        if position is None and not finds:
            raise StartError(f"the {self.kind} sensor needs to know where the piston is at first (--start)")
        if position is not None:
            self._check_start(position, std)
        self._state = self.initial.copy()
        if position is None:
            return
        self._state[place(POSITION)] = min(max(position, 0.0), self.stroke)
        if finds:
            self._state[place(IS_REFERENCED)] = self._state[place(REFERENCED_NOW)] = 1.0
            self._state[place(VARIANCE)] = std**2

    def _check_start(self, position: float, std: float) -> None:
        stroke = self.stroke
        if not (math.isfinite(position) and -START_STD <= position <= stroke + START_STD):
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
        at = math.nan if reference is None else reference
        known = math.isfinite(at)
        further = (others.get(name, math.nan) for name in names)
        given = (time, motor_speed, motor_torque, oil_temperature, at if known else 0.0, known, *further)
        self._says = self._by_sample().step(given)
        return self.estimate

    def _by_sample(self) -> Stepper:
        """Its step for one sample at a time."""
        made = self._stepper
        if made is None or made.state is not self._state or made.parameters is not self.parameters:
            made = self._stepper = Stepper(self.recursion, self.parameters, self._state)
        return made

    @property
    def estimate(self) -> Estimate:
        """What it has said last."""
        position, std, velocity, load, status = self._says[: len(OUTPUTS)].tolist()
        return Estimate(position, std, velocity, load, Status(int(status)))

    def says(self, output: str) -> float:
        """An output after the last sample, by its name [SI]; NaN before the first one, and of one that it has not."""
        names = self.recursion.outputs
        return float(self._says[names.index(output)]) if output in names else math.nan

    def track(self, log: xarray.Dataset, *, advance: Callable[[int], object] | None = None) -> xarray.Dataset:
        """Go through a drive log, from the position passed to `start`.

        Args:
            log: Dataset over `time` with motor_speed [rad/s], motor_torque [N m] and oil_temperature [K], with the
                commands that the circuit takes, and perhaps reference [m], NaN where no position is known; whatever
                else it may hold is not looked at.
            advance: called now and then with the number of samples done since the last call.

        Returns:
            A Dataset over the same `time` with position, position_std, velocity, load, status, and whatever else
            this sensor knows, each with `units`.
        """
        return self.followed(Signals.of(log), advance=advance).dataset()

    def followed(self, log: Signals, *, advance: Callable[[int], object] | None = None) -> Signals:
        """The same from columns to columns, for whoever needs no Dataset."""
        inputs = log_inputs(self, log)
        result = replay(self.recursion, inputs, self.parameters, self._state, advance=advance)
        if len(result):
            self._says = result[-1]
        columns = dict(zip(self.outputs, result.T, strict=True))
        return said_signals(self, log["time"], columns)


def said_signals(sensor: VirtualSensor, time: Signal, columns: Mapping[str, Array]) -> Signals:
    """What a sensor said of samples, with units.

    Args:
        time: of the samples [s].
    """
    found = {"time": time}
    for name, values in columns.items():
        found[name] = Signal(values, {"units": sensor.units[name], "long_name": name.replace("_", " ")})
    if STATUS in columns:
        meaning = "; ".join(f"{int(status)}: {status.text}" for status in Status)
        found[STATUS] = Signal(columns[STATUS].astype(np.int16), {"long_name": STATUS, "meaning": meaning})
    return Signals(found, {"format": 1, "sensor": sensor.kind})


def log_inputs(sensor: VirtualSensor, log: Samples) -> Array:
    """A log as the inputs of a sensor's recursion, shape (samples, inputs).

    Raises:
        LogError: the log lacks a command that the circuit takes.
    """
    for name in sensor.commands:
        if name not in log:
            raise LogError("is missing: the circuit has a part that it commands", file="log", column=name)
    columns: list[Any] = [log[name].values for name in REPORTED]
    reference = log["reference"].values if "reference" in log else np.full(len(log["time"].values), np.nan)
    known = np.isfinite(reference)
    columns += [np.where(known, reference, 0.0), known]
    columns += [log[name].values for name in sensor.commands]
    unknown = np.full(len(log["time"].values), np.nan)
    columns += [log[name].values if name in log else unknown for name in sensor.optional]
    return np.ascontiguousarray(np.column_stack(columns), dtype=np.float64)


def impossible(sensor: VirtualSensor, state: Mapping[str, float]) -> str:
    """Why a sensor cannot have a state, for example one read from a file; empty if it can.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.ddh import build_ddh
        >>> from ramsight.sensor.kalman import kalman
        >>> boom = kalman(build_ddh("boom", machine.load_machine("mining-loader").unit("boom")))
        >>> impossible(boom, boom.state), impossible(boom, {**boom.state, "position_variance": -1.0})
        ('', 'position_variance = -1.0: a variance is not negative')
    """
    wrong = next(
        (f"{name} = {value!r}: no number a sensor has" for name, value in state.items() if not _is_number(value)), ""
    )
    if wrong:
        return wrong
    position, stroke = state[POSITION], sensor.stroke
    if not -stroke <= position <= 2.0 * stroke:
        return f"position = {position!r} m: more than a stroke away from the stroke (0 to {stroke:g} m)"
    variances = [one.name for one in sensor.states if one.variance]
    negative = next((name for name in variances if state[name] < 0.0), "")
    if negative:
        return f"{negative} = {state[negative]!r}: a variance is not negative"
    for name in (IS_REFERENCED, REFERENCED_NOW):
        if state.get(name, 0.0) not in (0.0, 1.0):
            return f"{name} = {state[name]!r}: neither 0 nor 1"
    return ""


def _is_number(value: float) -> bool:
    """Whether a state can have a value; NaN and infinity are none."""
    return abs(value) <= _LARGEST_STATE
