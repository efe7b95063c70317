"""The commissioning of a machine, judged from a log."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from ramsight.api.arguments import log_argument, path_argument, truth_argument
from ramsight.api.machines import description_of
from ramsight.api.requirements import required_unit
from ramsight.api.tracking import track
from ramsight.argument_kinds import by_kind
from ramsight.calibration.knowledge import MachineKnowledge, completed, of_identification, of_leak_test, of_sensor
from ramsight.calibration.tuned import tuned as tuned_by
from ramsight.errors import DescriptionError, SimulationError
from ramsight.logs.channel_map import AnyMap, known_map
from ramsight.logs.channels import FURTHER, LINK_ANGLE
from ramsight.logs.mapped import ChannelMap, Mapped
from ramsight.machine import catalogue, load_machine, loads
from ramsight.machine.description import Machine, Unit
from ramsight.machine.requirement_description import DAY, Requirement
from ramsight.optional import check_extra
from ramsight.output import write_text
from ramsight.plant.build import AnyUnit, build
from ramsight.plant.unit import HydraulicUnit
from ramsight.progress import advancing
from ramsight.sensor.inputs.sample import declared_inputs
from ramsight.signals import Dataset
from ramsight.study.commissioning import kept_values
from ramsight.study.commissioning.commissioning_page import Channel, commissioning_page
from ramsight.study.commissioning.finding import Verdict
from ramsight.study.commissioning.walk import STEPS, Commissioning, walk
from ramsight.study.datasheet.sheet_requirement import mending
from ramsight.study.datasheet.studied_duties import Work
from ramsight.study.datasheet.study_plan import plan
from ramsight.tracking.credible import known_position
from ramsight.tracking.track_errors import ComparisonError
from ramsight.units import format_si

_DAY, _VISIT_EVERY = 360.0, 45.0  # s, of the work day whose sensitivities are looked at
_RATED = {"torque": "N m", "speed": "rpm", "dc_current": "A"}  # units in which 100 % is shown


@by_kind
def commission(
    machine: AnyUnit,
    log: str | Path | Dataset,
    truth: str | Path | Dataset | None = None,
    *,
    unit: str | None = None,
    channel_map: AnyMap | None = None,
    require: float | str | Requirement | None = None,
    since: str | Path | None = None,
    keep: str | Path | None = None,
    tuned: str | Path | None = None,
    progress: bool = False,
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
        since: file that an earlier commissioning kept: this one is judged by the description that counts since then,
            and says what has changed of the machine.
        keep: file in which what is found is kept for a later `since`, unless the commissioning failed: the description,
            tuned by what was identified, and the measured values with their deviations.
        tuned: file for the description of the machine as it was found, unless the commissioning failed: identified if
            the position was measured, else as the sensor has learned it and as the leak test says. How well each value
            is known is what its sensor assumes, so that it begins where the commissioning has ended.
        progress: show a bar on a terminal if it takes long.

    Returns:
        `verdict`, `reasons`, the `findings` of all checks in order, each with `check`, `verdict`, `found` and `remedy`,
        and what they rest on: `track`, `leak_test`, `identification`; with `since` also `changes`.

    Raises:
        DescriptionError: there is no such earlier commissioning, it was of another unit, or the machine is no
            description, of which alone something can be kept.
        LogError: log or truth cannot be read, or lack a variable.
        ComparisonError: log and truth have no time in common.
        IdentifyError: a value found lies outside the range that a description allows.
        OutputError: `keep` or `tuned` cannot be written.

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
    check_extra("identify")
    before = None if since is None else _before(machine, unit, path_argument(since, "since"))
    machine = machine if before is None else before.machine
    unit = unit if before is None else before.kept.unit
    for key, asked_for in (("keep", keep), ("tuned", tuned)):
        if asked_for is not None and not isinstance(machine, str | Path | Machine):
            raise DescriptionError("is of a description, and a built unit has none", key=key, value=str(asked_for))
    built = required_unit(build(machine, unit), require)
    asked = built.requirement
    known = known_map(channel_map)
    recorded = log_argument(log, known)
    said = known_position(truth_argument(truth), log, known, built)
    true = None if said is None else said.dataset()
    if true is not None:
        _check_common(recorded, true)

    def track_of(recorded_log: Dataset) -> Dataset:
        return track(built, recorded_log, truth=true)

    with advancing(STEPS, "commissioning", shown=progress) as advance:
        done = walk(
            built, recorded, track_of, true, known, advance, asked,
            lambda: _mending(machine, built, asked), description_of(machine, built.name),
        )  # fmt: skip
    values = kept_values.measured(done.track, done.leak_test, done.identification)
    if before is not None:
        found = kept_values.changes(before.kept, values)
        done = replace(done, changes=found, findings=(*done.findings, kept_values.changed(before.kept, found)))
    if isinstance(machine, str | Path | Machine) and done.verdict is not Verdict.FAILED:
        _write(
            load_machine(machine), built, done, values,
            None if keep is None else path_argument(keep, "keep"),
            None if tuned is None else path_argument(tuned, "tuned"),
        )  # fmt: skip
    return done


@dataclass(frozen=True)
class _Before:
    """An earlier commissioning: what was kept, and the description in it."""

    kept: kept_values.Kept
    machine: Machine


def _before(machine: AnyUnit, unit: str | None, path: Path) -> _Before:
    """The earlier commissioning, of the same machine and unit."""
    kept = kept_values.read_kept(path)
    described = loads(kept.description, f"the description in {path}")
    name, of = kept.machine, unit or kept.unit
    if isinstance(machine, str | Path | Machine):
        name = load_machine(machine).name
    elif not isinstance(machine, Unit):
        of = build(machine, unit).name
    asked = (name, of)
    if asked != (kept.machine, kept.unit) or kept.unit not in described.units:
        was = f"{kept.machine}, {kept.unit}"
        raise DescriptionError("is of another machine or unit", file=str(path), value=was, allowed=", ".join(asked))
    return _Before(kept, described)


def _write(
    machine: Machine,
    built: HydraulicUnit,
    done: Commissioning,
    values: Mapping[str, kept_values.Measured],
    keep: Path | None,
    tuned: Path | None,
) -> None:
    """Write what was asked for; nothing if what was found is outside the range of a description.

    What is kept is over the tuned description if the position was measured, else over the one that it was judged by.
    """
    found, identified = None, done.identification
    if tuned is not None or (keep is not None and identified is not None):
        known = _found(machine.unit(built.name), built, done)
        found = tuned_by(machine, built.name, known, "its commissioning")
    if keep is not None:
        if found is not None and identified is not None:
            machine, values = found.machine, kept_values.over(values, identified)
        kept_values.kept_of(machine, built.name, datetime.now().astimezone(), values).write(keep)
    if found is not None and tuned is not None:
        write_text(found.text, tuned)


def _found(described: Unit, built: HydraulicUnit, done: Commissioning) -> MachineKnowledge:
    """What was identified; without a measured position what the sensor has learned, completed by the leak test.

    Raises:
        ValueError: the sensor was not asked.
    """
    if done.identification is not None:
        return of_identification(done.identification, described)
    if done.track is None:
        raise ValueError("a commissioning without a track has found nothing")
    known = of_sensor(done.track, described, built, float(np.nanmean(done.log["oil_temperature"].values)))
    return known if done.leak_test is None else completed(known, of_leak_test(done.leak_test, described))


def _mending(machine: AnyUnit, built: HydraulicUnit, asked: Requirement | None) -> list[str]:
    """What would make the error smaller, by the data sheet's sensitivities; nothing of a unit without a description."""
    there = {LINK_ANGLE.name} if built.lever is None else set()  # nothing turns a body: there is no angle
    there |= set(declared_inputs(built.assumptions))
    found = [f"{one.advice} (assumptions.{one.declared})" for one in FURTHER if one.advice and one.name not in there]
    if not isinstance(machine, str | Path | Machine):
        return found
    every = _VISIT_EVERY if asked is None or asked.visit_every >= DAY else asked.visit_every
    described = load_machine(machine)
    try:
        return [*mending(described, plan(described, built.name, Work("work-day", _DAY, every))), *found]
    except (DescriptionError, SimulationError):
        return found


def report_of(
    done: Commissioning,
    machine: Machine,
    unit: str,
    log: str | Path,
    truth: str | Path | None,
    channel_map: ChannelMap,
    since: Path | None = None,
) -> str:
    """The report of a commissioning that was just made, to be signed: HTML that needs no other file.

    Args:
        since: file that an earlier commissioning kept, if it began from one: its description is what counts.
    """
    title = f"{machine.title or machine.name}, unit {unit}"
    sources, now = sources_of(machine, log, truth, channel_map), datetime.now().astimezone()
    if since is not None:
        sources[0] = ("earlier commissioning, with the machine", since.name, _sha256(since))
    return commissioning_page(done, title, sources, channels_of(channel_map), now)


def channels_of(channel_map: ChannelMap) -> list[Channel]:
    """Every channel of a map as it was used, as text."""
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
    """The files that a commissioning rests on: what each is, its name, and the SHA-256 of its bytes."""
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


def _check_common(log: Dataset, truth: Dataset) -> None:
    time, known = log["time"].values, truth["time"].values
    if np.nanmax(time) < known[0] or np.nanmin(time) > known[-1]:
        raise ComparisonError(
            f"the log ({np.nanmin(time):g} to {np.nanmax(time):g} s) and the truth ({known[0]:g} to {known[-1]:g} s) "
            "have no time in common"
        )


__all__ = ["channels_of", "commission", "report_of", "sources_of"]
