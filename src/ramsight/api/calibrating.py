"""Measuring a machine: its leakage, and how it differs from its data sheet."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ramsight.api.given import checked, truth_of
from ramsight.api.machines import AnyUnit, build
from ramsight.calibration.identify import EVALUATIONS, Identification
from ramsight.calibration.identify import identify as identify_built
from ramsight.calibration.leakage import LeakTest
from ramsight.calibration.leakage import leak_test as leak_test_built
from ramsight.duty.plausible import watched
from ramsight.logs import read_drive_log
from ramsight.progress import progress as progress_bar

if TYPE_CHECKING:
    import xarray


def leak_test(machine: AnyUnit, log: str | Path | xarray.Dataset, *, unit: str | None = None) -> LeakTest:
    """Measure a pump's leakage from slow turning against the closed safety valve, with no position reference.

    Args:
        machine: the unit as its data sheet has it, or what `build` makes one of.
        log: a file (as `read_log` takes, without faults), or a log: `motor_speed` [rad/s], `motor_torque` [N m] and
            `oil_temperature` [K] over `time` [s].
        unit: name of the unit, if the machine has several.

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
    recorded = read_drive_log(log, strict=True) if isinstance(log, str | Path) else checked(log, "log")
    return leak_test_built(built, recorded)


def identify(
    machine: AnyUnit,
    log: str | Path | xarray.Dataset,
    truth: str | Path | xarray.Dataset,
    *,
    unit: str | None = None,
    progress: bool = False,
) -> Identification:
    """Find how a machine differs from its data sheet, from a day with a position sensor on it.

    Args:
        machine: the unit as its data sheet has it, or what `build` makes one of.
        log: as `leak_test`'s, of some minutes of lifting and lowering under several loads.
        truth: a file with ``time_s`` and ``position_m``, or a Dataset with `position` [m] over `time` [s], on the
            log's clock.
        unit: name of the unit, if the machine has several.
        progress: show a bar on a terminal if it takes long.

    Returns:
        `factors` on leakage, displacement, stiffness, friction and efficiency [1], each with its 95 % interval, and
        what they rest on. `ramsight.calibration.identify_tuned.tuned` makes a description of them.

    Raises:
        IdentifyError: log and truth have no time in common, or nothing moves.
        LogError: the log or the truth cannot be read, has faults, or lacks a variable.

    Example:
        >>> import ramsight
        >>> boom = ramsight.build("mining-loader", "boom")
        >>> run = ramsight.simulate(ramsight.AsBuilt(leak=1.2).apply(boom), load="258 kN", cycles=2)
        >>> found = ramsight.identify(boom, ramsight.drive_report(run), run)
        >>> found.moves, abs(found.factors["leak"].value - 1.2) < 0.1
        (4, True)
    """
    built = build(machine, unit)
    name = log if isinstance(log, str | Path) else "log"
    recorded = read_drive_log(log, strict=True) if isinstance(log, str | Path) else checked(log, "log")
    known = truth_of(truth)
    recorded = next(watched([recorded], built, name))
    with progress_bar(EVALUATIONS, "identifying") as bar:
        return identify_built(built, recorded, known, advance=bar.advance if progress else None)
