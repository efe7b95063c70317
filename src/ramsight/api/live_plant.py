"""A machine that waits for the next command: the plant of a loop of one's own, with its oil and its drive's reports."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass, fields

import numpy as np

from ramsight.api.duties import TEMPERATURE, check_loads
from ramsight.argument_kinds import by_kind, whole_argument
from ramsight.duty.drive_report import usual_report
from ramsight.duty.drive_response import IDEAL, DriveResponse
from ramsight.duty.live import LiveUnit
from ramsight.duty.live_drive import LiveDrive
from ramsight.duty.live_further import LiveFurther
from ramsight.duty.live_warming import LiveWarming
from ramsight.duty.simulate import SAMPLE_PERIOD
from ramsight.errors import DescriptionError, UnknownNameError
from ramsight.logs.channels import column_of
from ramsight.plant.as_built import AsBuilt
from ramsight.plant.build import AnyUnit, build
from ramsight.plant.circuit import COMMANDED, command_of
from ramsight.signals import Dataset
from ramsight.units import argument, format_si

Quantity = float | str
_START = 0.3  # of the stroke
_MOST_LOAD = "100 MN"
_ROUNDING = 1e-6  # periods that an interval may be beside a whole number of them


@dataclass(frozen=True)
class LiveSample:
    """The truth about a unit at one time."""

    time: float  # [s]
    position: float  # of the piston [m]
    velocity: float  # [m/s], positive extends
    load: float  # [N], positive against lifting
    motor_speed: float  # [rad/s]
    motor_torque: float  # [N m]
    # pressure_a, pressure_b: of the chambers, absolute [Pa]
    pressure_a: float
    pressure_b: float
    oil_temperature: float  # of the oil in the pumps, by which the unit runs [K]


_UNITS = dict(
    zip((one.name for one in fields(LiveSample)), ["s", "m", "m/s", "N", "rad/s", "N m", "Pa", "Pa", "K"], strict=True)
)


class LivePlant:
    """A simulated unit that goes on by a sample with each motor speed; the loop around it is the caller's.

    Args:
        machine: the unit, or what `build` makes one of.
        unit: name of the unit, if the machine has several.
        start: of the piston, at rest [m]; by default 0.3 of the stroke.
        load: on it [N], positive against lifting.
        oil_temperature: at first [K], or ``"40 degC"``.
        ambient: temperature of the air [K]: what is lost in the oil then warms it; None: it keeps its temperature.
        as_built: how the machine differs from its data sheet; None where it does not.
        drive: how late and how well the drive follows and reports; by default at once.
        seed: of the noise of its reports.
        period: of the samples [s].

    Raises:
        DescriptionError: a quantity cannot be read or is out of range.
        UnknownNameError: no such machine or unit.

    Example:
        >>> import ramsight
        >>> plant, sensor = ramsight.LivePlant("press", start="100 mm", load="100 kN"), ramsight.sensor_for("press")
        >>> sensor.start("100 mm")
        >>> while plant.now.time < 4.0:
        ...     for report in plant.reports:
        ...         estimate = sensor.step(**report)
        ...     _ = plant.advance(motor_speed=8e3 * (0.15 - estimate.position))  # rad/s
        >>> abs(estimate.position - plant.now.position) < 1e-3, abs(plant.now.position - 0.15) < 10e-3
        (True, True)
    """

    @by_kind
    def __init__(
        self,
        machine: AnyUnit,
        unit: str | None = None,
        *,
        start: Quantity | None = None,
        load: Quantity = 0.0,
        oil_temperature: Quantity = TEMPERATURE,
        ambient: Quantity | None = None,
        as_built: AsBuilt | None = None,
        drive: DriveResponse = IDEAL,
        seed: int = 0,
        period: Quantity = SAMPLE_PERIOD,
    ) -> None:
        built = build(machine, unit)
        whole_argument(seed, "seed", 0, 2**63)
        made = built if as_built is None else as_built.apply(built)
        stroke = format_si(built.cylinder.stroke, "mm")
        at = (
            _START * built.cylinder.stroke
            if start is None
            else argument(start, "m", "start", least="0 mm", most=stroke)
        )
        warm = argument(oil_temperature, "K", "oil_temperature", least="-60 degC", most="150 degC")
        self.period = argument(period, "s", "period", least="1 ms", most="0.1 s")
        check_loads(built, [load])  # at first only: a load that changes may pass any small number
        self._load = _load(load)
        self._air = None if ambient is None else argument(ambient, "K", "ambient", least="-60 degC", most="80 degC")
        self._live = LiveUnit(made, at, self._load, warm, self.period)
        if self._air is not None:
            self._live.begin_account()
        self._unit, self._oil = made, LiveWarming(made, warm)
        self._drive = LiveDrive(drive, self.period, usual_report(built), stream=seed)
        self._further = LiveFurther(built, self.period, seed)
        known = (name.removesuffix(".command") for name in self._live.parameters if name.endswith(".command"))
        self._commands = dict.fromkeys(known, COMMANDED)
        self._columns = {column_of(name): name for name in self._commands}
        self._seen: list[LiveSample] = []
        self.now = self._look()
        self.reports: list[dict[str, float]] = []
        self._report()

    def __copy__(self) -> LivePlant:
        """A plant of its own that goes on from where this one is."""
        return deepcopy(self)

    def advance(
        self, motor_speed: Quantity, load: Quantity | None = None, dt: Quantity | None = None, **commands: float
    ) -> LiveSample:
        """Go on; what the drive reports meanwhile is in `reports`, in the words of a sensor's `step`.

        Args:
            motor_speed: command to the drive [rad/s], or ``"1500 rpm"``; it turns no faster than it can.
            load: that is reached evenly at the next sample [N]; None: as before.
            dt: how long the command holds, whole periods [s]; None: one period.
            commands: to commanded parts, -1 to 1 [1], by their names in a sensor's `commands`; each stays.

        Returns:
            The truth at the end.

        Raises:
            DescriptionError: a quantity cannot be read or is out of range.
            UnknownNameError: there is no such commanded part.
            SimulationError: the equations cannot be followed so far.
        """
        most = self._unit.max_speed
        wanted = argument(motor_speed, "rad/s", "motor_speed", least="-1e9 rad/s", most="1e9 rad/s")
        reached, periods = self._load if load is None else _load(load), self._periods(dt)
        changed = {
            self._part(column): argument(value, "1", column, least="-1", most="1") for column, value in commands.items()
        }
        self._load, self.reports = reached, []
        self._commands |= changed
        self._live.change({command_of(name): value for name, value in changed.items()})
        for _ in range(periods):
            speed = self._drive.follow(min(max(wanted, -most), most))
            self._live.advance(speed, self._load)
            self._warm()
            self.now = self._look()
            self._report()
        return self.now

    def run(self) -> Dataset:
        """All samples so far, as `simulate` returns them, for `plot` and as a `truth`: over `time` [s], in SI."""
        from ramsight.output.notebook import ShownDataset

        columns = {name: np.array([getattr(one, name) for one in self._seen]) for name in _UNITS}
        data = {name: ("time", columns[name], {"units": si}) for name, si in _UNITS.items() if name != "time"}
        attributes = {"format": 1, "kind": "simulated run", "unit": self._unit.name}
        return ShownDataset(data, {"time": ("time", columns["time"], {"units": "s"})}, attributes)

    def _periods(self, dt: Quantity | None) -> int:
        if dt is None:
            return 1
        period = format_si(self.period, "s")
        ratio = argument(dt, "s", "dt", least=period, most="1 h") / self.period
        if abs(ratio - round(ratio)) > _ROUNDING:
            raise DescriptionError(
                "is no whole number of periods", key="dt", value=dt, allowed=f"{period}, twice that, …"
            )
        return round(ratio)

    def _part(self, column: str) -> str:
        """The commanded part that a command is for."""
        if column not in self._columns:
            raise UnknownNameError("command", column, self._columns)
        return self._columns[column]

    def _warm(self) -> None:
        """Let the oil's temperature follow losses and air."""
        if self._air is None:
            return
        before = self._oil.pumps
        (account,) = self._live.accounts.values()
        self._oil.go_on(self.period, account.losses, self._air)
        self._live.change(self._oil.followed(before, self.period, self._live.parameters))

    def _look(self) -> LiveSample:
        inside, cylinder, (name,) = self._live.inside(), self._unit.cylinder, self._live.now.position
        found = LiveSample(
            time=self._live.now.time,
            position=self._live.now.position[name],
            velocity=inside["velocity"],
            load=self._load,
            motor_speed=self._live.now.motor_speed[name],
            motor_torque=self._live.now.motor_torque[name],
            pressure_a=inside[f"pressure_{cylinder.node_a}"],
            pressure_b=inside[f"pressure_{cylinder.node_b}"],
            oil_temperature=self._oil.pumps,
        )
        self._seen.append(found)
        return found

    def _report(self) -> None:
        """What the drive reports of this sample, if it arrives."""
        now = self.now
        further = self._further.sample(
            now.position, now.motor_speed, now.motor_torque, (now.pressure_a, now.pressure_b)
        )
        said = self._drive.report(now.time, now.motor_speed, now.motor_torque, self._oil.tank)
        if said is None:
            return
        commands: Mapping[str, float] = {column: self._commands[name] for column, name in self._columns.items()}
        self.reports.append({**vars(said), **further, **commands})


def _load(load: Quantity) -> float:
    return argument(load, "N", "load", least=f"-{_MOST_LOAD}", most=_MOST_LOAD)
