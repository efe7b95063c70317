"""A run of one unit through one duty, and what a drive reports of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from ramsight.api.arguments import checked
from ramsight.api.duties import TEMPERATURE, Loads, Quantity, duty_for
from ramsight.argument_kinds import by_kind, whole_argument
from ramsight.duty import DriveReport, Duty, Magnets
from ramsight.duty import report as report_of
from ramsight.duty.drive_report import declared_report, usual_report
from ramsight.duty.oil_warming import warm_run
from ramsight.duty.recorded import Recorded
from ramsight.duty.simulate import SAMPLE_PERIOD, labelled, ran
from ramsight.engine.run import DEFAULT_RTOL
from ramsight.errors import DescriptionError
from ramsight.plant.as_built import AsBuilt
from ramsight.plant.build import AnyUnit, build
from ramsight.plant.kept_circuit import kept_circuit
from ramsight.plant.unit import HydraulicUnit
from ramsight.progress import advancing
from ramsight.signals import Dataset
from ramsight.units import argument


@by_kind
def simulate(
    machine: AnyUnit,
    duty: Duty | str | Path | None = None,
    *,
    unit: str | None = None,
    as_built: AsBuilt | None = None,
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
    ambient: Quantity | None = None,
    sample_period: Quantity = SAMPLE_PERIOD,
    rtol: float = DEFAULT_RTOL,
    progress: bool = False,
) -> Dataset:
    """Simulate a unit, through a duty of its own or through one that has a name.

    Args:
        machine: the unit, or what `build` makes one of.
        duty: what it does: a duty, the name or the file of one as `duty_for` takes it; None for the cycles of
            `lift_lower`.
        unit: name of the unit, if the machine has several.
        as_built: how the machine differs from its data sheet; None where it does not.
        load: as `duty_for`'s [N]; it and the arguments from `speed` to `seed` are not for a duty of one's own.
        oil_temperature: [K], or ``"40 degC"``; of a duty of one's own it is the duty's.
        speed: as `duty_for`'s [rad/s].
        ramp: as `duty_for`'s [s].
        hold: as `duty_for`'s [s].
        start: as `duty_for`'s [m].
        cycles: as `duty_for`'s.
        visits: as `duty_for`'s.
        duration: as `duty_for`'s [s].
        seed: as `duty_for`'s.
        ambient: temperature of the air [K], or ``"20 degC"``: the oil then begins at its temperature and is warmed by
            what is lost in it, in the heat stores of the description; None: it keeps its temperature.
        sample_period: distance of the samples [s], or ``"20 ms"``.
        rtol: relative tolerance of the integrator.
        progress: show a bar on a terminal if it takes long.

    Returns:
        Over `time` [s], shape (samples,): `position`, `velocity`, `motor_speed`, `motor_torque`, `load`, pressures,
        flows, openings and loss powers in SI, each with `units`; with `ambient` also
        `pump_temperature` [K], of the oil in the pumps' gaps. Attributes carry the audit of energy and volume.

    Raises:
        DescriptionError: a quantity cannot be read or is out of range; there is no such duty; or both a duty of one's
            own and a load are passed, or neither.
        LogError: the duty's table cannot be read.
        SimulationError: the run does not reach its end; the text states where.

    Example:
        >>> import ramsight
        >>> run = ramsight.simulate("mining-loader", unit="boom", load="441 kN", oil_temperature="40 degC")
        >>> run.sizes["time"], run["position"].attrs["units"], round(float(run["position"].max()), 2)
        (1001, 'm', 0.27)
        >>> worn = ramsight.AsBuilt(leak=1.2)
        >>> test = ramsight.simulate("mining-loader", "leak-test", unit="boom", as_built=worn, load="441 kN")
        >>> round(ramsight.leak_test("mining-loader", ramsight.drive_report(test), unit="boom").factor, 1)
        1.2
    """
    built = build(machine, unit)
    made = built if as_built is None else as_built.apply(built)
    of_duty = {
        "load": load, "speed": speed, "ramp": ramp, "hold": hold, "start": start, "cycles": cycles,
        "visits": visits, "duration": duration, "seed": seed,
    }  # fmt: skip
    if duty is None and load is None:
        raise DescriptionError("is missing, and so is a duty", key="load", allowed="'441 kN', or duty='work-day'")
    if isinstance(duty, Duty) and (more := [name for name, one in of_duty.items() if one is not None]):
        raise DescriptionError("is said by the duty already", key=more[0], value=of_duty[more[0]], allowed="None")
    if not isinstance(duty, Duty):
        kind = "lift-lower" if duty is None else duty
        duty = duty_for(made, kind, oil_temperature=oil_temperature, **of_duty)  # type: ignore[arg-type]
    run = recorded(made, duty, ambient=ambient, sample_period=sample_period, rtol=rtol, progress=progress)
    return run.dataset()


def recorded(
    unit: HydraulicUnit,
    duty: Duty,
    *,
    ambient: Quantity | None = None,
    sample_period: Quantity = SAMPLE_PERIOD,
    rtol: float = DEFAULT_RTOL,
    progress: bool = False,
) -> Recorded:
    """The same run before it is a Dataset, for whoever needs no more than its numbers; arguments as `simulate`."""
    rtol = argument(rtol, "1", "rtol", least="1e-12", most="0.1")
    period = argument(sample_period, "s", "sample_period", least="0.1 ms", most="10 s")
    if ambient is not None:
        air = argument(ambient, "K", "ambient", least="-60 degC", most="80 degC")
        run = warm_run(unit, duty, ambient=air, sample_period=period, rtol=rtol, progress=progress)
    else:
        with advancing(duty.duration, "simulating", shown=progress) as advance:
            made = ran(unit, duty, sample_period=period, rtol=rtol, advance=advance, model=kept_circuit(unit))
            run = labelled(unit, duty, made)
    return run


@by_kind
def drive_report(
    run: Dataset,
    machine: AnyUnit | None = None,
    *,
    unit: str | None = None,
    seed: int = 0,
    speed_step: Quantity = "1 rpm",
    torque_step: Quantity | None = None,
    torque_noise: Quantity | None = None,
    temperature_step: Quantity = "0.1 K",
    temperature_noise: Quantity = "0.2 K",
    torque_gain: Quantity = 1.0,
    temperature_offset: Quantity = "0 K",
    magnets: Magnets | None = None,
) -> Dataset:
    """What a drive logs of a simulated run: sampled, in steps, with noise, and off if it is to be.

    Args:
        run: of `simulate`.
        machine: the unit that ran. Where its description declares a sensor of the angle of the body that the cylinder
            turns, a counter of the shaft, power of the DC link or sensors of pressure (``assumptions.link_angle``,
            ``shaft``, ``power``, ``pressure``), the log has them, with errors drawn from what is declared.
        unit: name of the unit, if the machine has several.
        seed: of the noise; the same seed gives the same log.
        speed_step: of the motor speed [rad/s]; 0 for none.
        torque_step: of the motor torque [N m]; 0 for none. None: 0.0625 N m, less where the machine assumes less noise.
        torque_noise: its standard deviation [N m]. None: 0.5 N m, or what the machine assumes if that is less.
        temperature_step: of the oil temperature, a difference [K]; 0 for none.
        temperature_noise: its standard deviation [K].
        torque_gain: reported torque over the true one [1], 0.1 to 10.
        temperature_offset: reported temperature less the true one [K].
        magnets: of the motor, if their warming up changes its torque constant.

    Returns:
        Over the run's `time` [s], shape (samples,): `motor_speed` [rad/s], `motor_torque` [N m] and
        `oil_temperature` [K], and what is declared beside them; a drive log like those of `read_log`.

    Raises:
        DescriptionError: a quantity cannot be read or is out of range.
        MissingColumnError: the run lacks a variable.

    Example:
        >>> import ramsight
        >>> run = ramsight.simulate("mining-loader", unit="boom", load="441 kN")
        >>> sorted(ramsight.drive_report(run, torque_noise="1 N m"))
        ['motor_speed', 'motor_torque', 'oil_temperature']
    """
    passed: dict[str, Quantity | None] = {
        "speed_step": speed_step, "torque_step": torque_step, "torque_noise": torque_noise,
        "temperature_step": temperature_step, "temperature_noise": temperature_noise, "torque_gain": torque_gain,
        "temperature_offset": temperature_offset,
    }  # fmt: skip
    if machine is None and unit is not None:
        raise DescriptionError("is of a machine, and none is passed", key="unit", value=unit)
    unit_of = None if machine is None else build(machine, unit)
    return report_of(checked(run, "run"), reported_how(passed, unit_of, seed=seed, magnets=magnets))


# Unit, least and most of what is passed.
_REPORTED = {
    "speed_step": ("rad/s", "0 rpm", "1000 rpm"),
    "torque_step": ("N m", "0 N m", "1e5 N m"),
    "torque_noise": ("N m", "0 N m", "1e5 N m"),
    "temperature_step": ("delta_K", "0 K", "100 K"),
    "temperature_noise": ("delta_K", "0 K", "100 K"),
    "torque_gain": ("1", "0.1", "10"),
    "temperature_offset": ("delta_K", "-100 K", "100 K"),
}


def reported_how(
    passed: Mapping[str, Quantity | None],
    unit: HydraulicUnit | None = None,
    *,
    seed: int = 0,
    magnets: Magnets | None = None,
) -> DriveReport:
    """How a drive reports; the other arguments are those of `drive_report`, and so are the errors.

    Args:
        passed: quantities by the names that `drive_report` has for them; those left out, or None, are those of a
            usual drive of the unit's size.
    """
    read: dict[str, float] = {}
    for name, value in passed.items():
        if value is not None:
            si, least, most = _REPORTED[name]
            read[name] = argument(value, si, name, least=least, most=most)
    whole_argument(seed, "seed", 0, 2**63)
    usual = DriveReport() if unit is None else usual_report(unit)
    how = replace(usual, magnets=magnets, seed=seed, **read)  # type: ignore[arg-type]
    return how if unit is None else declared_report(unit, seed, how)
