"""Duties: what a unit is asked to do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os.path import isfile
from pathlib import Path

from ramsight.argument_kinds import by_kind, whole_argument
from ramsight.duty import Duty
from ramsight.duty import lift_lower as cycles_of
from ramsight.duty.commissioning_duty import commissioning, leak_test_duty, usual_loads
from ramsight.duty.lift_lower import RAMP, SPEED, START, above_lowered_end
from ramsight.duty.loader_work import USES, loader_work
from ramsight.duty.profile import read_duty
from ramsight.duty.work_day import work_day
from ramsight.errors import DescriptionError
from ramsight.machine import Machine, Unit, load_machine, only_unit
from ramsight.plant.build import AnyUnit, build
from ramsight.plant.limits import limits_of
from ramsight.plant.unit import HydraulicUnit
from ramsight.units import argument, as_float, format_si

Quantity = float | str
Loads = Quantity | Sequence[Quantity]
TEMPERATURE = 313.15  # K
DAY = 360.0  # s
_LIFT_LOWER = {"load", "speed", "ramp", "hold", "start", "cycles", "visits"}
_TAKES = {
    "lift-lower": _LIFT_LOWER,
    "work-day": {"load", "start", "duration", "seed"},
    **{name: {"start", "duration", "seed"} for name in USES},
    "leak-test": {"load", "speed", "start"},
    "commissioning": {"load", "speed", "start"},
}
"""The duties that have a name, and the arguments that each takes."""

DUTIES = tuple(_TAKES)
SEEDED = frozenset(name for name, takes in _TAKES.items() if "seed" in takes)
"""The duties that are drawn at random."""
_OF_A_FILE = {"start"}
_LEAST_LOAD = 0.01  # of what the relief valve carries; a number of kN is no smaller


@by_kind
def lift_lower(
    machine: AnyUnit,
    load: Loads,
    oil_temperature: Quantity = TEMPERATURE,
    *,
    unit: str | None = None,
    speed: Quantity = SPEED,
    ramp: Quantity = RAMP,
    hold: Quantity | None = None,
    start: Quantity | None = None,
    cycles: int = 1,
    visits: int = 0,
) -> Duty:
    """A duty of lift-lower cycles: rest, lift at constant speed, rest, lower, with the load on the rods all the time.

    Args:
        machine: the unit, or what `build` makes one of.
        load: force against lifting [N]: ``441e3``, ``"441 kN"`` or a load that the description names; of
            several the cycles are made under each in turn.
        oil_temperature: [K], or ``"40 degC"``.
        unit: name of the unit, if the machine has several.
        speed: of the motor [rad/s], or ``"1500 rpm"``.
        ramp: time of each speed ramp [s].
        hold: time at full speed [s]; by default what moves the rod by up to 45 % of its stroke, 6.4 s at most.
        start: piston position at first [m], or ``"120 mm"``; by default a fifth of the stroke above the lowered end.
        cycles: how many under each load, 1 to 1000.
        visits: so many end stops are visited first, the lower and the upper one in turn, 0 to 100.

    Returns:
        The duty: motor speed, load and oil temperature as profiles over time, all in SI.

    Raises:
        DescriptionError: a quantity cannot be read or is out of range; names argument, value and range.

    Example:
        >>> import ramsight
        >>> duty = ramsight.lift_lower("mining-loader", "441 kN", "40 degC", unit="boom")
        >>> round(duty.duration, 1), float(duty.load(0.0)), round(duty.start_position, 3)
        (20.0, 441000.0, 0.14)
    """
    reader = _Reader(machine, unit)
    return cycles_of(
        reader.unit,
        reader.loads(load),
        reader.temperature(oil_temperature),
        motor_speed=reader.speed(speed),
        ramp=reader.read(ramp, "s", "ramp", "1 ms", "100 s"),
        hold=None if hold is None else reader.read(hold, "s", "hold", "0 s", "10000 s"),
        start_position=reader.start(start),
        cycles=reader.count(cycles, "cycles", 1, 1000),
        visits=reader.count(visits, "visits", 0, 100),
    )


@by_kind
def duty_for(
    machine: AnyUnit,
    kind: str | Path = "lift-lower",
    *,
    unit: str | None = None,
    load: Loads | None = None,
    oil_temperature: Quantity = TEMPERATURE,
    speed: Quantity | None = None,
    ramp: Quantity | None = None,
    hold: Quantity | None = None,
    start: Quantity | None = None,
    cycles: int | None = None,
    visits: int | None = None,
    duration: Quantity | None = None,
    seed: int | None = None,
) -> Duty:
    """A duty by its name, or from a table.

    - ``lift-lower``: cycles as `lift_lower` makes them.
    - ``work-day``: moves and loads at random, a visit to an end stop every 45 s.
    - ``loader-boom``, ``loader-bucket``: a wheel loader's work, with digging loads; the boom meets no end.
    - ``leak-test``: slow turning at two speeds against the closed valve; on the upper stop where the pump holds.
    - ``commissioning``: a leak test, three visits to the end stops, each load lifted and lowered, fast and slowly, and
      a last visit.
    - a file: a CSV table with ``time_s``, ``motor_speed_rpm``, ``load_kn`` and perhaps ``oil_temperature_c``.

    Moves are planned by what the unit does, as somebody works who watches the rod: give the machine as it really is.

    Args:
        machine: the unit, or what `build` makes one of.
        kind: name of the duty, or the table's file.
        unit: name of the unit, if the machine has several.
        load: force against lifting [N], or text with a unit; one or several. By default 0.2, 0.4 and 0.6 of what the
            relief valve carries; ``lift-lower`` needs them.
        oil_temperature: [K], or ``"40 degC"``.
        speed: of the motor [rad/s]; by default 1500 rpm, less where the cylinder is short.
        ramp: as `lift_lower`'s [s].
        hold: as `lift_lower`'s [s].
        start: piston position at first [m]; by default near the lowered end.
        cycles: as `lift_lower`'s.
        visits: as `lift_lower`'s.
        duration: time after which a work day begins no further move, or loader work no cycle [s]; by default 6 min.
        seed: of a work day or of loader work; the same seed gives the same.

    Returns:
        The duty: motor speed, load and oil temperature as profiles over time, all in SI.

    Raises:
        DescriptionError: there is no such duty, it does not take an argument that is passed, or a quantity cannot be
            read or is out of range.
        LogError: the table cannot be read; with line and column.

    Example:
        >>> import ramsight
        >>> loads = ["100 kN", "370 kN"]
        >>> day = ramsight.duty_for("mining-loader", "work-day", unit="boom", load=loads, duration="2 min")
        >>> day.duration > 120.0, 100e3 <= float(day.load(60.0)) <= 370e3
        (True, True)
    """
    passed = {
        "load": load, "speed": speed, "ramp": ramp, "hold": hold, "start": start, "cycles": cycles,
        "visits": visits, "duration": duration, "seed": seed,
    }  # fmt: skip
    _check_taken(str(kind), {name for name, value in passed.items() if value is not None})
    if kind == "lift-lower":
        if load is None:
            raise DescriptionError("is missing: what is to be lifted?", key="load", allowed="'441 kN'")
        cycle = {name: value for name, value in passed.items() if value is not None}
        return lift_lower(machine, oil_temperature=oil_temperature, unit=unit, **cycle)  # type: ignore[arg-type]
    reader = _Reader(machine, unit)
    built, kelvin, begin = reader.unit, reader.temperature(oil_temperature), reader.start(start)
    if str(kind) not in _TAKES:
        return read_duty(kind, built, kelvin, above_lowered_end(built, START) if begin is None else begin)
    lasts = DAY if duration is None else reader.read(duration, "s", "duration", "1 s", "24 h")
    number = 0 if seed is None else reader.count(seed, "seed", 0, 2**63)
    if str(kind) in USES:
        return loader_work(built, str(kind), kelvin, duration=lasts, start_position=begin, seed=number)
    loads = usual_loads(built) if load is None else reader.loads(load)
    if kind == "work-day":
        range_ = (min(loads), max(loads))
        return work_day(built, range_, kelvin, duration=lasts, start_position=begin, seed=number)
    made = leak_test_duty if kind == "leak-test" else commissioning
    turning = None if speed is None else reader.speed(speed)
    return made(built, loads, kelvin, motor_speed=turning, start_position=begin)


def named_loads(machine: AnyUnit, unit: str | None = None) -> Mapping[str, float]:
    """The loads that a unit's description names [N]; none of a unit that is built.

    Example:
        >>> named_loads("mining-loader", "boom")["high"]
        441000.0
    """
    if isinstance(machine, str | Path | Machine):
        described = load_machine(machine)
        machine = described.unit(only_unit(described) if unit is None else unit)
    return machine.load.loads if isinstance(machine, Unit) else {}


def with_names(load: Loads, names: Mapping[str, float]) -> Sequence[Quantity]:
    """Loads as they were given, a name replaced by its load [N].

    Raises:
        DescriptionError: a text that has no digit names no load.

    Example:
        >>> with_names(["high", "100 kN"], {"high": 441e3})
        [441000.0, '100 kN']
    """
    several = [load] if isinstance(load, str) or not isinstance(load, Sequence) else load
    for one in several:
        if isinstance(one, str) and one not in names and not any(map(str.isdigit, one)):
            allowed = ", ".join(("'441 kN'", *names))
            raise DescriptionError(
                "is no force, and no load that the description names", key="load", value=one, allowed=allowed
            )
    return [names.get(one, one) if isinstance(one, str) else one for one in several]


def check_loads(unit: HydraulicUnit, loads: Sequence[Quantity]) -> None:
    """Refuse a plain number that is a load in kN rather than in N: next to nothing, and a load in kN.

    Raises:
        DescriptionError: it is one.
    """
    carried = limits_of(unit).load
    for one in loads:
        if isinstance(one, int | float) and _LEAST_LOAD * carried <= 1e3 * abs(as_float(one)) <= carried:
            text = f"a plain number is in N, and that is next to nothing here: '{one:g} kN'?"
            raise DescriptionError(text, key="load", value=one, allowed="'441 kN', or 441e3")


def _check_taken(kind: str, passed: set[str]) -> None:
    """Reject a duty that is not there, and arguments that it does not take."""
    if kind not in _TAKES and not isfile(kind):
        raise DescriptionError(
            "no such duty, and no such file: a table of time, speed and load",
            key="duty",
            value=kind,
            allowed=", ".join((*DUTIES, "a file")),
        )
    for name in sorted(passed - _TAKES.get(kind, _OF_A_FILE)):
        takers = [other for other, takes in _TAKES.items() if name in takes]
        raise DescriptionError(f"is not for the duty {kind}", key=name, allowed=f"with {', '.join(takers)}")


class _Reader:
    """Reads what a person gives, within what a unit can do.

    Args:
        machine: the unit, or what `build` makes one of; a file is read once.
    """

    def __init__(self, machine: AnyUnit, unit: str | None) -> None:
        described = load_machine(machine) if isinstance(machine, str | Path) else machine
        self.unit = build(described, unit)
        self._named = named_loads(described, unit)

    def read(self, value: Quantity, si: str, name: str, least: str, most: str) -> float:
        """A quantity within a range."""
        return argument(value, si, name, least=least, most=most)

    def loads(self, load: Loads) -> tuple[float, ...]:
        """One load or several [N]."""
        several = with_names(load, self._named)
        if not several:
            raise DescriptionError("there is none", key="load", allowed="'441 kN'")
        check_loads(self.unit, several)
        return tuple(self.read(one, "N", "load", "-10000 kN", "10000 kN") for one in several)

    def temperature(self, oil_temperature: Quantity) -> float:
        """An oil temperature that the oil's data hold for [K]."""
        coldest, hottest = (format_si(kelvin, "degC") for kelvin in self.unit.oil.temperatures)
        return self.read(oil_temperature, "K", "oil_temperature", coldest, hottest)

    def speed(self, speed: Quantity) -> float:
        """A motor speed that the drive has [rad/s]."""
        return self.read(speed, "rad/s", "speed", "1 rpm", format_si(self.unit.max_speed, "rpm"))

    def start(self, start: Quantity | None) -> float | None:
        """A position within the stroke [m]; None by default."""
        stroke = format_si(self.unit.cylinder.stroke, "mm")
        return None if start is None else self.read(start, "m", "start", "0 mm", stroke)

    def count(self, value: int, name: str, least: int, most: int) -> int:
        """A whole number within a range."""
        return whole_argument(value, name, least, most)
