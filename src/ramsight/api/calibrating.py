"""Measuring a machine: its leakage, and how it differs from its data sheet."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from ramsight.api.arguments import log_argument, truth_argument
from ramsight.argument_kinds import by_kind
from ramsight.calibration.fit_track import FittedValues, MeasuredRun, fit_track
from ramsight.calibration.free_values import free_values
from ramsight.calibration.identify import EVALUATIONS, Identification
from ramsight.calibration.identify import identify as identify_built
from ramsight.calibration.identify_record import IdentifyError
from ramsight.calibration.leakage import LeakTest
from ramsight.calibration.leakage import leak_test as leak_test_built
from ramsight.errors import DescriptionError
from ramsight.logs import read_log
from ramsight.logs.channel_map import known_map
from ramsight.logs.drive_log import read_signals
from ramsight.logs.mapped import ChannelMap
from ramsight.logs.opening import read_measured
from ramsight.machine import AnyMachine, load_machine, only_unit
from ramsight.machine.description import Composed
from ramsight.optional import check_extra
from ramsight.plant.build import AnyUnit, build
from ramsight.progress import advancing
from ramsight.signals import Dataset
from ramsight.tracking.credible import credible_run, known_position
from ramsight.tracking.watched import watched


@by_kind
def leak_test(
    machine: AnyUnit,
    log: str | Path | Dataset,
    *,
    unit: str | None = None,
    channel_map: ChannelMap | str | Path | None = None,
) -> LeakTest:
    """Measure a pump's leakage from slow turning against the closed safety valve, with no position reference.

    Args:
        machine: the unit as its data sheet has it, or what `build` makes one of.
        log: a file (as `read_log` takes, without faults), or a log: `motor_speed` [rad/s], `motor_torque` [N m] and
            `oil_temperature` [K] over `time` [s].
        unit: name of the unit, if the machine has several.
        channel_map: of a file, as `read_log`'s.

    Returns:
        `factor`, the leakage over the data sheet's [1], its standard deviation `std`, and the stretches of the log
        that it rests on.

    Raises:
        LeakTestError: there is no leak test in the log, or it may be a slow lift.
        LogError: the log cannot be read, has faults, or lacks a variable.

    Example:
        >>> import ramsight
        >>> from ramsight.duty import Duty, Profile
        >>> boom = ramsight.build("mining-loader", "boom")
        >>> speed = Profile([0, 1, 1.5, 9.5, 10, 12, 12.5, 20.5, 21], [0, 0, 6.3, 6.3, 0, 0, 10.5, 10.5, 0])
        >>> duty = Duty(speed, Profile([0], [441e3]), Profile([0], [313.15]), start_position=0.2)
        >>> found = ramsight.leak_test(boom, ramsight.drive_report(ramsight.simulate(boom, duty)))
        >>> abs(found.factor - 1.0) < 0.02
        True
    """
    built = build(machine, unit)
    if isinstance(log, str | os.PathLike):
        return leak_test_built(built, read_signals(Path(log), channel_map, strict=True))
    return leak_test_built(built, _recorded(log, channel_map))


@by_kind
def identify(
    machine: AnyUnit,
    log: str | Path | Dataset,
    truth: str | Path | Dataset | None = None,
    *,
    unit: str | None = None,
    channel_map: ChannelMap | str | Path | None = None,
    progress: bool = False,
) -> Identification:
    """Find how a machine differs from its data sheet, from a day with a position sensor on it.

    Args:
        machine: the unit as its data sheet has it, or what `build` makes one of.
        log: as `leak_test`'s, of some minutes of lifting and lowering under several loads.
        truth: a file with ``time_s`` and ``position_m``, or a Dataset with `position` [m] over `time` [s], on the
            log's clock. None: what the map names as ``measured.position`` of the log itself.
        unit: name of the unit, if the machine has several.
        channel_map: of the log, if it is a file, as `read_log`'s.
        progress: show a bar on a terminal if it takes long.

    Returns:
        `factors` on leakage, displacement, stiffness, friction and efficiency [1], each with its 95 % interval, and
        what they rest on. `ramsight.calibration.tuned.tuned` makes a description of them.

    Raises:
        IdentifyError: log and truth have no time in common, nothing moves, or no position was measured.
        ComparisonError: the truth goes farther than this piston can.
        LogError: the log or the truth cannot be read, has faults, or lacks a variable.

    Example:
        >>> import ramsight
        >>> boom = ramsight.build("mining-loader", "boom")
        >>> run = ramsight.simulate(ramsight.AsBuilt(leak=1.2).apply(boom), load="258 kN", cycles=2)
        >>> found = ramsight.identify(boom, ramsight.drive_report(run), run)
        >>> found.moves, abs(found.factors["leak"].value - 1.2) < 0.1
        (4, True)
    """
    check_extra("identify")
    built = build(machine, unit)
    name = log if isinstance(log, str | Path) else "log"
    recorded = _recorded(log, channel_map)
    known = known_position(truth_argument(truth), log, channel_map, built)
    if known is None:
        raise IdentifyError(f"{name}: no position was measured: give a truth, or a map with measured.position")
    recorded = next(watched([recorded], built, name, channel_map))
    with advancing(EVALUATIONS, "identifying", shown=progress) as advance:
        return identify_built(built, recorded, known.dataset(), advance=advance)


@by_kind
def identify_values(
    machine: AnyMachine,
    runs: Iterable[str | Path | MeasuredRun],
    channel_map: ChannelMap | str | Path | None = None,
    *,
    unit: str | None = None,
    progress: bool = False,
) -> FittedValues:
    """Find the values of a description from runs with a measured position: those with which the sensor follows it.

    For a machine that nobody has data sheets of: sizes, losses, elasticities, valves and friction, each of its part, as
    far as the runs tell them; and the gain of the torque, where a current stands for it. The circuit has to be one of
    parts.

    Args:
        machine: the description to begin with, its name or file.
        runs: log files of a position sensor's runs, several loads and strokes; or what they hold.
        channel_map: of the files, with ``measured.position`` and, if there are any, the chambers' pressures.
        unit: name of the unit, if the machine has several.
        progress: show a bar on a terminal.

    Returns:
        The description with the values that were found, `machine`; the values with their 95 % intervals [SI]; what the
        reported torque is; the curve of the position's sensor, where the map declares its linearity; the errors of the
        position that are left [m].

    Raises:
        DescriptionError: the machine or the map cannot be read, or the unit's circuit is not one of parts.
        IdentifyError: there is no run, or one whose position was not measured.
        LogError: a log cannot be read.

    Example:
        >>> import ramsight
        >>> found = ramsight.identify_values("eha-valve-rig", [], unit="axis")
        Traceback (most recent call last):
        ramsight.calibration.identify_record.IdentifyError: there is no run
    """
    check_extra("identify")
    described = load_machine(machine)
    name = unit or only_unit(described)
    parts = described.unit(name)
    if not isinstance(parts, Composed):
        raise DescriptionError("values are found of circuits of parts; of this one, see identify", key=f"units.{name}")
    read = [run if isinstance(run, MeasuredRun) else _measured_run(run, channel_map) for run in runs]
    built = build(described, name)
    read = [replace(run, measured=credible_run(run.log, run.measured, built, run.name)) for run in read]
    with advancing(1.0, "identifying", shown=progress) as advance:
        return fit_track(described, name, read, free_values(parts), advance=advance)


def _recorded(log: str | Path | Dataset, channel_map: ChannelMap | str | Path | None) -> Dataset:
    """The log, without faults where it is a file."""
    return log_argument(log, channel_map, strict=True)  # type: ignore[no-any-return]


def _measured_run(path: str | Path, channel_map: ChannelMap | str | Path | None) -> MeasuredRun:
    if channel_map is None:
        raise DescriptionError("a map has to name the measured position", key="channel_map")
    known = known_map(channel_map)
    # An uncertain curve is fitted again, from the readings.
    bent = replace(known, curve=None) if known.linearity else known
    return MeasuredRun(Path(path).name, read_log(path, known), read_measured(path, bent), known.linearity)
