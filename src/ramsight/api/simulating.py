"""Runs: of one unit through one duty, and of many through many."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from ramsight.api.given import checked
from ramsight.api.machines import AnyUnit, build
from ramsight.duty import DriveReport, Duty
from ramsight.duty import lift_lower as cycles_of
from ramsight.duty import report as report_of
from ramsight.duty import simulate as run_of
from ramsight.duty.lift_lower import RAMP, SPEED
from ramsight.duty.simulate import SAMPLE_PERIOD
from ramsight.engine.run import DEFAULT_RTOL
from ramsight.errors import DescriptionError
from ramsight.progress import progress as progress_bar
from ramsight.units import argument, format_si

if TYPE_CHECKING:
    import xarray

Quantity = float | str
TEMPERATURE = 313.15  # K


def lift_lower(
    machine: AnyUnit,
    load: Quantity,
    oil_temperature: Quantity = TEMPERATURE,
    *,
    unit: str | None = None,
    speed: Quantity = SPEED,
    ramp: Quantity = RAMP,
    hold: Quantity | None = None,
    start: Quantity | None = None,
    cycles: int = 1,
    named: Callable[[str], str] = str,
) -> Duty:
    """A duty of lift-lower cycles: rest, lift at constant speed, rest, lower, with the load on the rods all the time.

    Args:
        machine: the unit, or what `build` makes one of.
        load: constant force against lifting [N]: ``441e3`` or ``"441 kN"``.
        oil_temperature: [K], or ``"40 degC"``.
        unit: name of the unit, if the machine has several.
        speed: of the motor [rad/s], or ``"1500 rpm"``.
        ramp: time of each speed ramp [s].
        hold: time at full speed [s]; by default what moves the rod by up to 45 % of its stroke, 6.4 s at most.
        start: piston position at first [m], or ``"120 mm"``; by default a fifth of the stroke above the lowered end.
        cycles: how many, 1 to 1000.
        named: what errors call an argument.

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
    built = build(machine, unit)
    stroke, fastest = format_si(built.cylinder.stroke, "mm"), format_si(built.max_speed, "rpm")
    coldest, hottest = (format_si(kelvin, "degC") for kelvin in built.oil.temperatures)
    if not (isinstance(cycles, int) and 1 <= cycles <= 1000):
        raise DescriptionError("is out of range", key=named("cycles"), value=cycles, allowed="1 to 1000")

    def read(value: Quantity, si: str, name: str, least: str, most: str) -> float:
        return argument(value, si, named(name), least=least, most=most)

    return cycles_of(
        built,
        read(load, "N", "load", "-10000 kN", "10000 kN"),
        read(oil_temperature, "K", "oil_temperature", coldest, hottest),
        motor_speed=read(speed, "rad/s", "speed", "1 rpm", fastest),
        ramp=read(ramp, "s", "ramp", "1 ms", "100 s"),
        hold=None if hold is None else read(hold, "s", "hold", "0 s", "10000 s"),
        start_position=None if start is None else read(start, "m", "start", "0 mm", stroke),
        cycles=cycles,
    )


def simulate(
    machine: AnyUnit,
    duty: Duty | None = None,
    *,
    unit: str | None = None,
    load: Quantity | None = None,
    oil_temperature: Quantity = TEMPERATURE,
    speed: Quantity = SPEED,
    ramp: Quantity = RAMP,
    hold: Quantity | None = None,
    start: Quantity | None = None,
    cycles: int = 1,
    sample_period: Quantity = SAMPLE_PERIOD,
    rtol: float = DEFAULT_RTOL,
    progress: bool = False,
) -> xarray.Dataset:
    """Simulate a unit, through a duty or through lift-lower cycles.

    Args:
        machine: the unit, or what `build` makes one of.
        duty: what it does; None for the cycles of `lift_lower` that the arguments from `load` to `cycles` say.
        unit: name of the unit, if the machine has several.
        load: as `lift_lower`'s [N]; needed where there is no duty.
        oil_temperature: as `lift_lower`'s [K].
        speed: as `lift_lower`'s [rad/s].
        ramp: as `lift_lower`'s [s].
        hold: as `lift_lower`'s [s].
        start: as `lift_lower`'s [m].
        cycles: as `lift_lower`'s.
        sample_period: distance of the samples [s], or ``"20 ms"``.
        rtol: relative tolerance of the integrator.
        progress: show a bar on a terminal if it takes long.

    Returns:
        Over `time` [s], shape (samples,): `position`, `velocity`, `motor_speed`, `motor_torque`, `load`, pressures,
        flows, openings and loss powers in SI, each with `units`. Attributes carry the audit of energy and volume.

    Raises:
        DescriptionError: a quantity cannot be read or is out of range; or both a duty and a load are given, or none.
        SimulationError: the run does not reach its end; the text says where.

    Example:
        >>> import ramsight
        >>> run = ramsight.simulate("mining-loader", unit="boom", load="441 kN", oil_temperature="40 degC")
        >>> run.sizes["time"], run["position"].attrs["units"], round(float(run["position"].max()), 2)
        (1001, 'm', 0.27)
    """
    built = build(machine, unit)
    if (duty is None) == (load is None):
        raise DescriptionError("give a duty or a load, and not both", key="load", value=load, allowed="'441 kN'")
    if duty is None and load is not None:
        duty = lift_lower(built, load, oil_temperature, speed=speed, ramp=ramp, hold=hold, start=start, cycles=cycles)
    if not isinstance(duty, Duty):
        raise DescriptionError("is no duty", key="duty", value=duty, allowed="what ramsight.lift_lower makes")
    period = argument(sample_period, "s", "sample_period", least="0.1 ms", most="10 s")
    with progress_bar(duty.duration, "simulating") as bar:
        advance = bar.advance if progress else None
        return run_of(built, duty, sample_period=period, rtol=rtol, advance=advance)


def drive_report(
    run: xarray.Dataset,
    *,
    seed: int = 0,
    speed_step: Quantity = "1 rpm",
    torque_step: Quantity = "0.0625 N m",
    torque_noise: Quantity = "0.5 N m",
    temperature_step: Quantity = "0.1 K",
    temperature_noise: Quantity = "0.2 K",
) -> xarray.Dataset:
    """What a drive logs of a simulated run: sampled, in steps, with noise.

    Args:
        run: of `simulate`.
        seed: of the noise; the same seed gives the same log.
        speed_step: of the motor speed [rad/s]; 0 for none.
        torque_step: of the motor torque [N m]; 0 for none.
        torque_noise: its standard deviation [N m].
        temperature_step: of the oil temperature, a difference [K]; 0 for none.
        temperature_noise: its standard deviation [K].

    Returns:
        Over the run's `time` [s], shape (samples,): `motor_speed` [rad/s], `motor_torque` [N m] and
        `oil_temperature` [K]; a drive log like those of `read_log`.

    Raises:
        DescriptionError: a quantity cannot be read or is out of range.
        MissingColumnError: the run lacks a variable.

    Example:
        >>> import ramsight
        >>> run = ramsight.simulate("mining-loader", unit="boom", load="441 kN")
        >>> sorted(ramsight.drive_report(run, torque_noise="1 N m"))
        ['motor_speed', 'motor_torque', 'oil_temperature']
    """
    how = DriveReport(
        speed_step=argument(speed_step, "rad/s", "speed_step", least="0 rpm", most="1000 rpm"),
        torque_step=argument(torque_step, "N m", "torque_step", least="0 N m", most="1e5 N m"),
        torque_noise=argument(torque_noise, "N m", "torque_noise", least="0 N m", most="1e5 N m"),
        temperature_step=argument(temperature_step, "delta_K", "temperature_step", least="0 K", most="100 K"),
        temperature_noise=argument(temperature_noise, "delta_K", "temperature_noise", least="0 K", most="100 K"),
        seed=seed,
    )
    return report_of(checked(run, "run"), how)
