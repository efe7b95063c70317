"""A machine under a lever, with sensors that see what its drives report: what the studio shows, without a page."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ramsight.calibration.sensors import sensor_for
from ramsight.duty.drive_report import Magnets, usual_report
from ramsight.duty.drive_response import DriveResponse
from ramsight.duty.live import Instant, LiveMachine, LiveUnit
from ramsight.duty.live_drive import LiveDrive
from ramsight.duty.live_energy import EnergyAccount
from ramsight.duty.live_further import LiveFurther
from ramsight.duty.live_warming import LiveWarming
from ramsight.duty.simulate import SAMPLE_PERIOD
from ramsight.errors import DescriptionError
from ramsight.logs.channels import column_of
from ramsight.machine.description import Machine
from ramsight.plant.as_built import AsBuilt
from ramsight.plant.build import build
from ramsight.plant.directional import DirectionalValve
from ramsight.plant.linked import LinkedMachine, build_linked
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.persistence import StateFile
from ramsight.sensor.thresholds import START_STD
from ramsight.sensor.virtual_sensor import Estimate, VirtualSensor
from ramsight.studio.knobs import FAULTS, KINDS, SENSORS, UNSURE, Knobs
from ramsight.studio.known import Known
from ramsight.studio.lifts import Lifts
from ramsight.studio.marks import Marks
from ramsight.studio.playing import Playing
from ramsight.studio.recorder import Recorder, reported
from ramsight.studio.transducer import Compared, Transducer
from ramsight.units import FREEZING

_OBSTACLE = 0.02  # m beyond where the piston is, extending
_SPEED_GAIN = 1.03  # [G] of a drive that gets its speed wrong: more than displacements differ by
_MAGNETS = Magnets(torque=1.0).coefficient  # 1/K, of the torque constant
_RAMP = 1.0  # s, in which a motor gets from rest to its highest speed
_HEATER = 0.5  # K/s, at most, by which oil is brought to another temperature
_OIL_EVERY = 5  # samples; in 0.1 s oil changes its temperature by no more than the 0.05 K of `warming.warmed`
_SHARE = 0.5  # of the highest motor speed at a lever's end: what a machine works with
START = 0.4  # of the stroke, where the pistons are at first


@dataclass(frozen=True)
class Row:
    """One sample of one unit; all in SI."""

    time: float  # [s]
    position: float  # the true one [m]
    # motor_speed, motor_torque: the true ones [rad/s, N m]
    motor_speed: float
    motor_torque: float
    # pressure_a, pressure_b: of the chambers [Pa]
    pressure_a: float
    pressure_b: float
    estimates: Mapping[str, Estimate]  # of each sensor that has reported; empty while the drive is without power
    # what a real position sensor reports beside them; None without one, or without power
    second: Compared | None = None


class Rig:
    """A machine, its drives and its sensors.

    Args:
        machine: the description; with a mechanism all of its units move together, without one its first unit alone.
        period: of the samples [s].

    Raises:
        DescriptionError: what is described cannot be built.

    Example:
        >>> from ramsight import machine
        >>> rig = Rig(machine.load_machine("press"))
        >>> rig.levers["ram"] = 1.0
        >>> before = rig.step()["ram"].position
        >>> for _ in range(100):
        ...     row = rig.step()["ram"]
        >>> row.position > before + 0.02, abs(row.estimates["kalman"].position - row.position) < 1e-3
        (True, True)
    """

    def __init__(self, machine: Machine, period: float = SAMPLE_PERIOD) -> None:
        self.name, self.period = machine.title or machine.name, period
        self.linked, self.sheet = parts_of(machine)
        self._described, self._largest = machine, self._largest_load(machine)
        self.faults: set[str] = set()
        self.begin()

    def _largest_load(self, machine: Machine) -> float:
        """Rated payload [kg], or the largest named load [N]."""
        if machine.linkage is not None:
            payload = machine.linkage.payload
            return 0.0 if payload is None else payload.rated
        loads = next(iter(machine.units.values())).load.loads
        return max(loads.values(), default=0.0)

    def begin(self, *, known: bool = True) -> None:
        """Begin again: pistons, knobs and sensors as at first, no fault, nobody at the levers.

        Args:
            known: whether `kalman` is given the positions, as the other sensors are.
        """
        if "power" in self.faults:
            self._saved.cleanup()
        self.faults.clear()
        self.knobs, self.levers = Knobs(), dict.fromkeys(self.sheet, 0.0)
        self._playing: Playing | None = None
        self._speeds = dict.fromkeys(self.sheet, 0.0)
        self._references: dict[str, float] = {}
        self._frozen: dict[str, float] = {}
        self._obstacles: dict[str, float] = {}
        self._passed: set[str] = set()  # units whose piston is still beyond its obstacle, which lets it come back
        self._drives: dict[str, LiveDrive] = {}
        self._said: tuple[float, float, float] | None = None
        self.second: dict[str, Transducer] = {}
        self._compared: dict[str, Compared] = {}
        self._begin()
        if not known:
            for sensors in self.sensors.values():
                sensors["kalman"].start(None)

    def _begin(self) -> None:
        begin = {name: START * unit.cylinder.stroke for name, unit in self.sheet.items()}
        load, warm = self.knobs.load * self._largest, self.knobs.oil_temperature
        self._plant = live_plant(self.linked, self.sheet, begin, warm, load, self.period)
        self._plant.begin_account()
        self._load, self.holds_oil, self._samples, self._entered_at = load, False, 0, 0.0
        self._magnets = self.knobs.magnets
        self._further = {name: LiveFurther(unit, self.period, k) for k, (name, unit) in enumerate(self.sheet.items())}
        self._aim: float | None = None  # that the oil is being brought to [K]
        self.oil = {name: LiveWarming(unit, warm) for name, unit in self.sheet.items()}
        self.sensors: dict[str, dict[str, VirtualSensor]] = {
            name: {kind: _sensor(unit, kind) for kind in SENSORS} for name, unit in self.sheet.items()
        }
        for name, sensors in self.sensors.items():
            for sensor in sensors.values():
                sensor.start(begin[name])
        self._knowledge: dict[str, Known] = {}
        weighs = self.linked is not None and self._largest > 0.0
        self.lifts = Lifts(self._described, self.period) if weighs else None
        self._referred: dict[str, float] = {}
        self._at = dict(begin)
        self.recorders = {name: Recorder(self.period) for name in self.sheet}
        self.marks = Marks({name: unit.cylinder.stroke for name, unit in self.sheet.items()})
        self._last: dict[str, dict[str, Estimate]] = {name: {} for name in begin}
        self._apply(self.knobs)

    # -- what can be done to it

    def turn(self, knobs: Knobs) -> None:
        """Turn knobs; the machine changes from now on.

        Raises:
            DescriptionError: the oil has no such temperature.
        """
        for unit in self.sheet.values():
            low, high = unit.oil.temperatures
            if not low <= knobs.oil_temperature <= high:
                raise DescriptionError(
                    "outside the oil's data", key="oil_temperature", value=f"{knobs.oil_temperature - FREEZING:g} degC",
                    allowed=f"{low - FREEZING:g} to {high - FREEZING:g} degC",
                )  # fmt: skip
        self._apply(knobs)
        if knobs.oil_temperature != self.knobs.oil_temperature:
            self._aim = knobs.oil_temperature
        self.knobs = knobs

    def hold_oil(self, *, on: bool) -> None:
        """Bring the oil to its knob's temperature and keep it there, whatever is lost in it, or stop doing so."""
        self.holds_oil = on
        self._aim = self.knobs.oil_temperature if on else None

    def start_sensors(self, *kinds: str, off: float = 0.0) -> None:
        """Start sensors again at the true positions: a value that is no number has ended the plain balance.

        Args:
            off: by which the positions are wrong, further in where there is no room further out [m].
        """
        std = UNSURE if off else START_STD
        for name, sensors in self.sensors.items():
            stroke = self.sheet[name].cylinder.stroke
            at = self._at[name] + (off if self._at[name] + off <= stroke else -off)
            for sensor in (one for kind, one in sensors.items() if not kinds or kind in kinds):
                sensor.start(min(max(at, 0.0), stroke), std)

    def sense(self, kind: str, *, on: bool) -> None:
        """Switch a sensor of `KINDS` on, at the true positions, or off.

        Raises:
            RamsightError: the machine cannot have this sensor.
        """
        if kind not in KINDS:
            raise ValueError(f"no sensor {kind!r}; there are {', '.join(KINDS)}")
        made = {name: _sensor(unit, kind) for name, unit in self.sheet.items()} if on else {}
        for name, unit in self.sheet.items():
            self.sensors[name].pop(kind, None)
            self._last[name].pop(kind, None)
            if on:
                at = min(max(self._at[name], 0.0), unit.cylinder.stroke)
                made[name].start(at)
                self.sensors[name][kind] = made[name]

    def add_second(self, unit: str) -> None:
        """Put a real position sensor on a unit; it is compared with `kalman`."""
        self.second[unit] = Transducer(self.sheet[unit])

    @property
    def duty(self) -> str | None:
        """The duty cycle that plays, or None."""
        return None if self._playing is None else self._playing.name

    def play(self, name: str | None) -> None:
        """Play a duty of `playing.DUTIES` from now on; None leaves the levers to whoever holds them."""
        signs = {unit: float(built.lift_sign) for unit, built in self.sheet.items()}
        speeds = {unit: _SHARE * built.max_speed for unit, built in self.sheet.items()}
        self._playing = None if name is None else Playing(name, signs, speeds)
        self.levers = dict.fromkeys(self.sheet, 0.0)

    def _played(self) -> None:
        """Move the levers, and the load, as the duty that plays wants them."""
        if self._playing is not None:
            shares = {name: self._at[name] / unit.cylinder.stroke for name, unit in self.sheet.items()}
            self.levers = self._playing.levers(shares, self.period)
            if self._playing.load is not None:
                self.knobs = replace(self.knobs, load=self._playing.load)

    def refer(self, unit: str, off: float = 0.0) -> None:
        """Tell the sensors of a unit its true position at the next sample, as a switch would, off by this much [m]."""
        self._references[unit] = off
        self.marks.add(self._plant.now.time, "reference" if off == 0.0 else "wrong reference", unit)

    def fault(self, name: str, *, on: bool) -> None:
        """Switch a fault of `FAULTS` on or off."""
        if name not in FAULTS:
            raise ValueError(f"no fault {name!r}; there are {', '.join(FAULTS)}")
        if name == "power" and on != (name in self.faults):
            self._power(on=on)
        if on != (name in self.faults):
            self.marks.add(self._plant.now.time, FAULTS[name] if on else f"{FAULTS[name]}: over")
        (self.faults.add if on else self.faults.discard)(name)
        self._frozen.clear()
        if name == "obstacle":
            self.obstruct({unit: at + _OBSTACLE for unit, at in self._at.items()} if on else {})

    def obstruct(self, places: Mapping[str, float]) -> None:
        """Put obstacles in the way of extending pistons.

        Args:
            places: where they stand [m], by unit; none anywhere else. One that a piston has passed already stands there
                once the piston is back.
        """
        self._obstacles = dict(places)
        self._passed = {name for name, place in places.items() if self._at[name] > place}
        self._apply(self.knobs)

    def _power(self, *, on: bool) -> None:
        """Power goes, or comes back: the sensors that can save their state resume it, the others begin again."""
        if on:
            self._saved = tempfile.TemporaryDirectory(prefix="ramsight-")
        for unit, sensors in self.sensors.items():
            if "kalman" not in sensors:
                continue
            state = StateFile(Path(self._saved.name) / f"{unit}.state", sensors["kalman"], unit)
            if on:
                state.save()
            else:
                state.resume()
        if not on:
            self._saved.cleanup()

    def _apply(self, knobs: Knobs) -> None:
        built = AsBuilt(
            leak=knobs.leak, displacement=knobs.displacement, stiffness=knobs.stiffness, friction=knobs.friction
        )
        known = set(self._plant.parameters)
        for name, unit in self.sheet.items():
            worn, prefix = built.apply(unit), f"{name}." if self.linked is not None else ""
            values: dict[str, float] = {}
            for part_name, part in (("oil", worn.oil), *((part.name, part) for part in worn.parts())):
                values |= {f"{prefix}{part_name}.{key}": v for key, v in vars(part).items() if isinstance(v, float)}
            values |= self._in_the_way(name, worn, prefix)
            self._plant.change({key: value for key, value in values.items() if key in known})
        response = DriveResponse(report_delay=knobs.report_delay)
        said = (knobs.torque_step, knobs.report_delay, knobs.temperature_offset)
        if said != self._said:  # a drive that is as it was goes on with what it has on its way
            for k, (name, unit) in enumerate(self.sheet.items()):
                how = replace(usual_report(unit), temperature_offset=knobs.temperature_offset)
                how = replace(how, torque_step=knobs.torque_step) if knobs.torque_step > 0.0 else how
                self._drives[name] = LiveDrive(response, self.period, how, stream=k)
        self._said = said

    def _in_the_way(self, name: str, worn: HydraulicUnit, prefix: str) -> dict[str, float]:
        """An obstacle, as an end stop nearer than the cylinder's; what is beyond it stays in the chamber."""
        cylinder = worn.cylinder
        obstacle = math.inf if name in self._passed else self._obstacles.get(name, math.inf)
        place = min(obstacle, cylinder.stroke)
        beyond = cylinder.area_b * (cylinder.stroke - place)
        of = f"{prefix}{cylinder.name}"
        return {f"{of}.stroke": place, f"{of}.dead_volume_b": cylinder.dead_volume_b + beyond}

    def begin_account(self) -> None:
        """Account for the energy again from now on."""
        self._warm_up()
        self._plant.begin_account()
        for oil in self.oil.values():
            oil.begin_account()

    def known(self, name: str, time: float) -> dict[str, Any] | None:
        """What the kalman sensor of a unit knows; None while there is none or its drive is silent.

        Args:
            time: now [s].
        """
        sensor, said = self.sensors[name].get("kalman"), self._last[name].get("kalman")
        if sensor is None or said is None or "power" in self.faults:
            return None
        own = self._knowledge.get(name)
        if own is None or own.sensor is not sensor:
            self._referred.pop(name, None)
            own = self._knowledge[name] = Known(sensor, self.sheet[name].cylinder.stroke)
        return own.look(time, said, self._referred.get(name, math.nan))

    @property
    def load(self) -> float:
        """On the unit [N], or what the mechanism carries [kg], now."""
        return self._load

    @property
    def accounts(self) -> dict[str, EnergyAccount]:
        """Energies since the account began, by unit."""
        return self._plant.accounts

    # -- a sample

    def step(self) -> dict[str, Row]:
        """Go on to the next sample.

        Raises:
            SimulationError: the equations cannot be followed so far.
        """
        self._played()
        speeds = {name: self._followed(name) for name in self.sheet}
        aim = self.knobs.load * self._largest
        most = self._largest * self.period / _RAMP
        self._load += min(max(aim - self._load, -most), most)
        most = _HEATER * self.period
        self._magnets += min(max(self.knobs.magnets - self._magnets, -most), most)
        commands = self._commands()
        now = advanced(self._plant, speeds, self._load)
        self.inside = self._plant.inside()
        rows, self._heard = {}, math.nan
        for name in self.sheet:
            truth = now.motor_speed[name], now.motor_torque[name]
            self._at[name] = now.position[name]
            self.recorders[name].truth(now.time, now.position[name])
            self.marks.moved(now.time, name, now.position[name])
            chambers = (self.of(name, f"pressure_{self.sheet[name].cylinder.node_a}"),
                        self.of(name, f"pressure_{self.sheet[name].cylinder.node_b}"))  # fmt: skip
            further = self._further[name].sample(now.position[name], *truth, chambers, self._magnets)
            self._sense(name, now.time, truth, now.position[name], commands[name] | further)
            silent = "power" in self.faults
            said, second = ({}, None) if silent else (dict(self._last[name]), self._compared.get(name))
            rows[name] = Row(now.time, now.position[name], *truth, *chambers, said, second)
        back = {name for name in self._passed if self._at[name] <= self._obstacles[name]}
        if back:
            self._passed -= back
            self._apply(self.knobs)
        self._weigh(now.time)
        self._samples += 1
        if self._samples % _OIL_EVERY == 0:
            self._warm_up()
        return rows

    def _weigh(self, time: float) -> None:
        """What the sensors of all units make of a lift; what is carried is kept beside them."""
        if self.lifts is None:
            return
        self.lifts.truth(time, self._load)
        sensors = {name: kinds["kalman"] for name, kinds in self.sensors.items() if "kalman" in self._last[name]}
        if math.isnan(self._heard) or len(sensors) < len(self.sheet):
            return
        found = self.lifts.step(self._heard, sensors)
        if found is not None:
            self.marks.add(time, f"weighed {found.mass:.0f} kg" if found.is_good else "bad weighing")

    def _warm_up(self) -> None:
        """Let the oil's temperature follow losses and air, or whoever heats and cools it."""
        passed, self._entered_at = self._plant.now.time - self._entered_at, self._plant.now.time
        if passed <= 0.0:
            return
        accounts, there = self.accounts, True
        for name, oil in self.oil.items():
            before, losses = oil.pumps, accounts[name].losses
            if self._aim is None:
                oil.go_on(passed, losses, self.knobs.ambient)
            else:
                there = oil.bring(passed, losses, self._aim, _HEATER) and there
            prefix = f"{name}." if self.linked is not None else ""
            self._plant.change(oil.followed(before, passed, self._plant.parameters, prefix))
        if there and not self.holds_oil:
            self._aim = None

    def of(self, unit: str, name: str) -> float:
        """What the equation knows of a unit by this name; NaN if nothing."""
        return self.inside.get(f"{unit}.{name}" if self.linked is not None else name, math.nan)

    def _followed(self, name: str) -> float:
        """Motor speed at the next sample [rad/s]: towards the lever, no faster than the ramp."""
        unit = self.sheet[name]
        aim = 0.0 if "power" in self.faults else self.levers[name] * _SHARE * unit.max_speed
        valve = self._valve(name)
        if valve is not None:  # the motor turns one way, the valve states which
            aim = abs(aim)
        most = unit.max_speed * self.period / _RAMP
        speed = self._speeds[name]
        self._speeds[name] = speed + min(max(aim - speed, -most), most)
        return self._drives[name].follow(self._speeds[name])

    def _valve(self, name: str) -> DirectionalValve | None:
        return next((part for part in self.sheet[name].parts() if isinstance(part, DirectionalValve)), None)

    def _commands(self) -> dict[str, dict[str, float]]:
        """Commands of directional valves, by unit: where the lever points; they stay where it is in the middle."""
        found: dict[str, dict[str, float]] = {name: {} for name in self.levers}
        for name, lever in self.levers.items():
            valve = self._valve(name)
            if valve is not None and lever != 0.0:
                self._plant.change({f"{valve.name}.command": math.copysign(1.0, lever)})
                found[name][column_of(valve.name)] = math.copysign(1.0, lever)
        return found

    def _sense(
        self, name: str, time: float, truth: tuple[float, float], position: float, further: Mapping[str, float]
    ) -> None:
        """What the drive reports, with its faults, and what the sensors make of it."""
        torque = truth[1] * self.knobs.torque_gain / (1.0 + _MAGNETS * self._magnets)
        said = self._drives[name].report(time, truth[0], torque, self.oil[name].tank)
        if said is None or "power" in self.faults:
            return
        if "temperature" in self.faults:
            said = replace(said, oil_temperature=math.nan)
        if "torque" in self.faults:
            said = replace(said, motor_torque=self._frozen.setdefault(name, said.motor_torque))
        if "speed" in self.faults:
            said = replace(said, motor_speed=said.motor_speed * _SPEED_GAIN)
        self._heard = said.time
        off = self._references.pop(name, None)
        reference = None if off is None else position + off
        if reference is not None:
            self._referred[name] = said.time
        self.recorders[name].report(said.time, reported(said, reference, further))
        for kind, sensor in self.sensors[name].items():
            others = {column: further[column] for column in sensor.further if column in further}
            values = said.motor_speed, said.motor_torque, said.oil_temperature
            passed = None if kind == "unreferenced" else reference
            self._last[name][kind] = sensor.step(said.time, *values, passed, **others)
        if name in self.second and "kalman" in self._last[name]:
            pair = self.sensors[name]["kalman"], self._last[name]["kalman"]
            self._compared[name] = self.second[name].step(said.time, position, *pair)


def parts_of(machine: Machine) -> tuple[LinkedMachine | None, dict[str, HydraulicUnit]]:
    """What runs of a machine: its mechanism with the units that move it, or its first unit alone.

    Raises:
        DescriptionError: what is described cannot be built.
    """
    if machine.linkage is not None:
        linked = build_linked(machine)
        return linked, {unit.name: unit for unit in linked.units}
    name = next(iter(machine.units))
    return None, {name: build(machine.unit(name), name)}


def live_plant(
    linked: LinkedMachine | None,
    sheet: Mapping[str, HydraulicUnit],
    begin: Mapping[str, float],
    warm: float,
    load: float,
    period: float = SAMPLE_PERIOD,
) -> LiveMachine | LiveUnit:
    """A machine that waits for its first command.

    Args:
        linked: its mechanism; None of a unit alone.
        sheet: its units.
        begin: where the pistons are [m].
        warm: temperature of the oil [K].
        load: on the unit [N], or what the mechanism carries [kg].
        period: of the samples [s].
    """
    if linked is not None:
        return LiveMachine(linked, begin, dict.fromkeys(begin, warm), load, period)
    ((name, unit),) = sheet.items()
    return LiveUnit(unit, begin[name], load, warm, period)


def advanced(plant: LiveMachine | LiveUnit, speeds: Mapping[str, float], load: float) -> Instant:
    """A machine at the next sample.

    Args:
        speeds: of the motors [rad/s], by unit.
        load: on the unit [N], or what the mechanism carries [kg].

    Raises:
        SimulationError: the equations cannot be followed so far.
    """
    if isinstance(plant, LiveMachine):
        return plant.advance(speeds, load)
    (speed,) = speeds.values()
    return plant.advance(speed, load)


def _sensor(unit: HydraulicUnit, kind: str) -> VirtualSensor:
    return sensor_for(unit, "kalman" if kind == "unreferenced" else kind)
