"""The commissioning of a machine, judged from a log."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ramsight.api.arguments import AnyMap, log_argument, map_argument, truth_argument
from ramsight.api.machines import AnyUnit, build, description_of, load_machine
from ramsight.api.requirements import requirement_of
from ramsight.api.tracking import track
from ramsight.errors import DescriptionError, SimulationError
from ramsight.logs.channel_map import load_map
from ramsight.logs.mapped import ChannelMap, Mapped
from ramsight.machine import catalogue
from ramsight.machine.description import Machine
from ramsight.machine.requirement_description import DAY, Requirement
from ramsight.plant.unit import HydraulicUnit
from ramsight.progress import advancing
from ramsight.study.commissioning.commissioning_page import Channel, commissioning_page
from ramsight.study.commissioning.walk import STEPS, Commissioning, walk
from ramsight.study.datasheet.mending import mending
from ramsight.study.datasheet.studied_duties import Work
from ramsight.study.datasheet.study_plan import plan
from ramsight.tracking.position_errors import ComparisonError
from ramsight.tracking.true_position import known_position
from ramsight.units import format_si

if TYPE_CHECKING:
    import xarray

_DAY, _VISIT_EVERY = 360.0, 45.0  # s, of the work day whose sensitivities are looked at
_RATED = {"torque": "N m", "speed": "rpm", "dc_current": "A"}  # units in which 100 % is shown


def commission(
    machine: AnyUnit,
    log: str | Path | xarray.Dataset,
    truth: str | Path | xarray.Dataset | None = None,
    *,
    unit: str | None = None,
    channel_map: AnyMap | None = None,
    require: float | str | Requirement | None = None,
    progress: bool = False,
    named: Callable[[str], str] = str,
) -> Commissioning:
    """Judge a machine's commissioning from the log of its drive.

    Looked at in order: the requirement; samples; units and signs against what the machine can do; leak test; whether
    travel, torque at relief and leak test contradict the description, and which value of it is likeliest wrong (of a
    machine that is passed as a description, a name or a file); end stops; what the sensor learned, and how sure it is;
    and, if the position was measured, the sensor's errors and the data sheet's. The rest is not judged where units or
    signs are wrong.

    Args:
        machine: the unit as its data sheet has it, or what `build` makes one of.
        log: a file (as `read_log` takes), or a log: `motor_speed` [rad/s], `motor_torque` [N m] and `oil_temperature`
            [K] over `time` [s].
        truth: measured position, if there is one: a file with ``time_s`` and ``position_m``, or a Dataset with
            `position` [m] over `time` [s], on the log's clock. None: what the map names as ``measured.position`` of the
            log itself, if it does.
        unit: name of the unit, if the machine has several.
        channel_map: of a file, as `read_log`'s.
        require: error that 95 % of the position's errors have to be within [m], or ``"5 mm"``; or a `Requirement`.
            None: what the unit's description states. What misses it has failed.
        progress: show a bar on a terminal if it takes long.
        named: what errors call an argument.

    Returns:
        `verdict`, `reasons`, the `findings` of all checks in order, each with `check`, `verdict`, `found` and `remedy`,
        and what they rest on: `track`, `leak_test`, `identification`.

    Raises:
        LogError: log or truth cannot be read, or lack a variable.
        ComparisonError: log and truth have no time in common.

    Example:
        >>> import ramsight
        >>> boom = ramsight.build("mining-loader", "boom")
        >>> run = ramsight.simulate(boom, "commissioning", as_built=ramsight.AsBuilt(leak=1.1))
        >>> done = ramsight.commission(boom, ramsight.drive_report(run))
        >>> done.verdict.value, round(done.leak_test.factor, 1)
        ('passed', 1.1)
        >>> required = ramsight.commission(boom, ramsight.drive_report(run), require="5 mm")
        >>> required.verdict.value, required.reasons[0].check
        ('failed', 'requirement')
    """
    built = build(machine, unit)
    asked = requirement_of(built, require, named)
    channel_map = map_argument(channel_map)
    known = load_map(channel_map) if isinstance(channel_map, str | Path) else channel_map
    recorded = log_argument(log, known)
    true = known_position(truth_argument(truth), log, known, built.cylinder.stroke)
    if true is not None:
        _check_common(recorded, true)

    def track_of(recorded_log: xarray.Dataset) -> xarray.Dataset:
        return track(built, recorded_log, truth=true)

    with advancing(STEPS, "commissioning", shown=progress) as advance:
        return walk(
            built, recorded, track_of, true, known, advance, asked,
            lambda: _mending(machine, built, asked), description_of(machine, built.name),
        )  # fmt: skip


def _mending(machine: AnyUnit, built: HydraulicUnit, asked: Requirement | None) -> list[str]:
    """What would make the error smaller, by the data sheet's sensitivities; nothing of a unit without a description."""
    found = []
    if built.lever is not None and built.assumptions.link_angle.std == 0.0:
        found = ["an inclinometer on the body that the cylinder turns (assumptions.link_angle)"]
    if not isinstance(machine, str | Path | Machine):
        return found
    every = _VISIT_EVERY if asked is None or asked.visit_every >= DAY else asked.visit_every
    described = load_machine(machine)
    try:
        return [*mending(described, plan(described, built.name, Work("work-day", _DAY, every))), *found]
    except (DescriptionError, SimulationError):
        return found


def report_of(
    done: Commissioning, machine: Machine, unit: str, log: str | Path, truth: str | Path | None, channel_map: ChannelMap
) -> str:
    """The report of a commissioning that was just made, to be signed: HTML that needs no other file.

    Args:
        done: what was found.
        machine: as it was read, from a file or from the catalogue.
        unit: name of the one that the drive turns.
        log: file of the log.
        truth: file of the measured position, if there is one.
        channel_map: with which the log was read.
    """
    title = f"{machine.title or machine.name}, {unit}"
    sources, now = sources_of(machine, log, truth, channel_map), datetime.now().astimezone()
    return commissioning_page(done, title, sources, channels_of(channel_map), now)


def channels_of(channel_map: ChannelMap) -> list[Channel]:
    """Every channel of a map as it was used, as text.

    Args:
        channel_map: with which a log was read.
    """
    named = {**channel_map.roles, **channel_map.further, **channel_map.linked}
    named |= {f"command to {name}": one.mapped for name, one in channel_map.commands.items()}
    named |= {f"measured {name}": one for name, one in channel_map.measured.items()}
    named |= {f"reference {k}": one.mapped for k, one in enumerate(channel_map.references, 1)}
    return [
        (
            role,
            one.channel or "constant",
            one.unit or "as the file says",
            f"{one.sign:+g}",
            f"{one.scale:g}",
            f"{one.offset:g}",
            _stands_for(channel_map, role, one),
        )
        for role, one in named.items()
    ]


def _stands_for(channel_map: ChannelMap, role: str, one: Mapped) -> str:
    """What 100 % of a channel is, or one of its numbers where it is another quantity."""
    if one.constant is not None:
        return format_si(one.constant, "degC", 6)
    if one.rated is not None:
        return f"100 % is {format_si(one.rated, _RATED[role], 6)}"
    if role == "torque" and channel_map.motor is not None:
        motor = channel_map.motor
        bends = "" if motor.saturation is None else f", saturated at {motor.saturation:g}"
        return f"a current: 1 is {motor.torque_constant:g} N m{bends}"
    if role == "speed" and channel_map.angle is not None:
        return f"an angle: {channel_map.angle.per_turn:g} a turn"
    return ""


def sources_of(
    machine: Machine, log: str | Path, truth: str | Path | None, channel_map: ChannelMap
) -> list[tuple[str, str, str]]:
    """The files that a commissioning rests on: what each is, its name, and the SHA-256 of its bytes.

    Args:
        machine: as it was read, from a file or from the catalogue.
        log: file of the log.
        truth: file of the measured position, if there is one.
        channel_map: with which the log was read.
    """
    files = [("log", Path(log))]
    files += [] if truth is None else [("measured position", Path(truth))]
    files += [] if channel_map.file is None else [("channel map", Path(channel_map.file))]
    files += [("meaning of CAN frames", path) for path in channel_map.dbc]
    return [_machine_file(machine), *((what, path.name, _sha256(path)) for what, path in files)]


def _machine_file(machine: Machine) -> tuple[str, str, str]:
    origin = machine.origin
    if catalogue.has("machine", origin):
        path = catalogue.find("machine", origin).path
        what, name = "machine of the catalogue", path.name
    else:
        path, what, name = Path(origin), "machine", Path(origin).name
    if not path.is_file() or load_machine(origin) != machine:
        return what, name, "not as in any file: values were changed"
    return what, name, _sha256(path)


def _sha256(path: Any) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _check_common(log: xarray.Dataset, truth: xarray.Dataset) -> None:
    time, known = log["time"].values, truth["time"].values
    if np.nanmax(time) < known[0] or np.nanmin(time) > known[-1]:
        raise ComparisonError(
            f"the log ({np.nanmin(time):g} to {np.nanmax(time):g} s) and the truth ({known[0]:g} to {known[-1]:g} s) "
            "have no time in common"
        )


__all__ = ["channels_of", "commission", "report_of", "sources_of"]
