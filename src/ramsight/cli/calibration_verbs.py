"""Verbs that measure a machine, make a sensor to measure, or judge a commissioning."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ramsight.cli import common
from ramsight.errors import one_line


def calibrate(
    machine: common.Machine,
    out: Annotated[Path, typer.Option(help="The sensor file, for example boom.sensor.")],
    unit: common.SensedUnit = None,
    speed: Annotated[str, typer.Option(help="Constant motor speed of the calibration.")] = "1500 rpm",
    loads: Annotated[int, typer.Option(min=8, max=1000, help="How many loads.")] = 40,
    figure: Annotated[Path | None, typer.Option(help="A picture of the table: .png, .svg or .pdf.")] = None,
) -> None:
    """Make the paper's look-up table from simulated runs, and keep it as a sensor file.

    The unit lifts and lowers loads from 1 kN to the relief valve's opening at a constant speed, at oil
    temperatures from 20 to 70 °C; the table states how far the rod moves per motor revolution at each motor torque.

    Example: ramsight calibrate mining-loader --unit boom --out boom.sensor
    """
    unit = common.named_unit(machine, unit)
    from ramsight.calibration.cached import calibrated
    from ramsight.calibration.movement import TEMPERATURES
    from ramsight.calibration.sensor_file import SUFFIX, save
    from ramsight.machine import load_machine
    from ramsight.output import check_apart, check_figure, check_target
    from ramsight.plant.build import build
    from ramsight.progress import progress
    from ramsight.units import format_si, parse_option

    check_target(out, (SUFFIX,))
    check_figure(figure)
    check_apart({"the machine": machine}, {"--out": out, "--figure": figure})
    described = load_machine(machine).unit(unit)
    fastest = format_si(described.drive.max_speed, "rpm")
    motor_speed = parse_option(speed, "rad/s", "--speed", least="100 rpm", most=fastest)
    with progress(2 * loads * len(TEMPERATURES), "calibrating the table") as bar:
        movement = calibrated(build(described, unit), motor_speed=motor_speed, loads=loads, advance=bar.advance)
    save(movement, out)
    common.say(
        f"{out}: written; {unit}, {loads} loads at {len(TEMPERATURES)} oil temperatures, torque from "
        f"{movement.lift_torque[0]:.1f} to {movement.lift_torque[-1]:.1f} N m while lifting"
    )
    if figure is not None:
        from ramsight.calibration.pump_map_figure import movement_figure

        movement_figure(movement, f"{unit}: calibrated at {format_si(motor_speed, 'rpm')}", figure)
        common.say_written(figure)


def leak_test(
    machine: common.Machine,
    log: common.DriveLog,
    unit: common.DrivenUnit = None,
    channel_map: common.ChannelMapFile = None,
    out: Annotated[Path | None, typer.Option(help="The machine's description with that leakage: .toml.")] = None,
    strict: common.Strict = False,
) -> None:
    """Measure a pump's leakage from a drive log, with no position reference.

    Turn the motor slowly in the lifting direction under load (60 rpm, then 100 rpm, 6 s each): the safety valve stays
    closed, no oil reaches the cylinder, and what the pump moves is what leaks. Says how much it leaks over its data
    sheet, corrected for the oil's viscosity, and how sure that is. The description written to --out leaks as much, and
    its sensor takes it to be known as well as that.

    Example: ramsight leak-test mining-loader log.csv.gz --unit boom --out tested.toml
    """
    unit = common.named_unit(machine, unit)
    from ramsight.api.calibrating import leak_test
    from ramsight.calibration.knowledge import of_leak_test
    from ramsight.calibration.leakage import leak_test_summary
    from ramsight.calibration.tuned import tuned
    from ramsight.machine import load_machine
    from ramsight.output import check_apart, check_target, write_text

    check_target(out, (".toml",))
    check_apart({"the machine": machine, "the log": log, "--map": channel_map}, {"--out": out})
    described = load_machine(machine)
    with common.strictly(is_strict=strict):
        found = leak_test(described, log, unit=unit, channel_map=channel_map)
    if out is not None:
        known = of_leak_test(found, described.unit(unit))
        write_text(tuned(described, unit, known, f"ramsight leak-test from the log {one_line(log.name)}").text, out)
    common.give(unit=unit, leak_test=found)
    common.say_lines(leak_test_summary(found))
    common.say_written(out)


def identify(
    machine: common.Machine,
    logs: Annotated[list[Path], typer.Argument(help="Drive log; several with a map that names a measured position.")],
    unit: common.DrivenUnit = None,
    truth: Annotated[
        Path | None, typer.Option(help="Its measured position: time_s and position_m, .csv or .csv.gz.")
    ] = None,
    channel_map: Annotated[
        Path | None,
        typer.Option("--map", help="Which of the logs' channels are what, maybe the measured position: .toml."),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="The tuned machine's description: .toml.")] = None,
    map_out: Annotated[
        Path | None, typer.Option(help="The map with the torque of a current as it was found: .toml.")
    ] = None,
    strict: common.Strict = False,
) -> None:
    """Find how a machine differs from its data sheet, with a position sensor put on for a day.

    Work the unit under several loads for some minutes, lifting and lowering each, with the drive's log and the
    position on one clock. Fits leakage (through gaps, and like an orifice's), displacement, stiffness of oil and hoses,
    cylinder friction and the pumps' hydro-mechanical efficiency, each with a 95 % interval; what the log cannot tell
    stays at the data sheet, and is said. The unit may have any circuit, loss tables, seal leakage, free air: it is its
    own equations that run along the log.

    Loads need not be known and may change at rest; three and more, each lifted and lowered, tell the pumps' friction
    from the cylinder's. Moves of three seconds and more at steady speeds tell most; slow and fast ones tell leakage
    from displacement. End stops and relief are left out by themselves. Nothing but time_s and position_m is used of
    the truth. The tuned description goes wherever a machine goes: check, track, ...

    A --map states which of the log's channels are what; one that names the measured position replaces --truth.
    Of a circuit of parts that finds the values of the description themselves, for a machine that nobody has data sheets
    of: sizes, losses, elasticities, valves, friction, and the torque of a motor's current. It takes runs of such a
    circuit under several loads, with the position, and maybe the chambers' pressures, in the same files.

    Example: ramsight identify mining-loader log.csv.gz --unit boom --truth position.csv --out tuned.toml

    Example: ramsight identify eha-valve-rig run*.csv.gz --unit axis --map rig.toml --out rig-tuned.toml
    """
    unit = common.named_unit(machine, unit)
    from ramsight.machine import load_machine
    from ramsight.machine.description import Composed

    if truth is None and channel_map is not None and isinstance(load_machine(machine).unit(unit), Composed):
        with common.strictly(is_strict=strict):
            _identify_values(machine, logs, unit, channel_map, out, map_out)
        return
    if (truth is None and channel_map is None) or len(logs) != 1:
        raise typer.BadParameter("one log with --truth, or logs with a --map that names the measured position")
    if map_out is not None:
        raise typer.BadParameter("--map-out is for the values of a circuit of parts: a --map without --truth")
    with common.strictly(is_strict=strict):
        _identify_factors(machine, logs[0], unit, truth, channel_map, out)


def _identify_factors(
    machine: str, log: Path, unit: str, truth: Path | None, channel_map: Path | None, out: Path | None
) -> None:
    """Find the factors on a data sheet, and write what was asked for."""
    from ramsight.api.calibrating import identify as identify_unit
    from ramsight.calibration.identify_report import summary
    from ramsight.calibration.knowledge import of_identification
    from ramsight.calibration.tuned import tuned
    from ramsight.machine import load_machine
    from ramsight.output import check_apart, check_target, write_text

    check_target(out, (".toml",))
    read: dict[str, str | Path | None] = {"the machine": machine, "the log": log, "--truth": truth}
    check_apart(read | {"--map": channel_map}, {"--out": out})
    description = load_machine(machine)
    found = identify_unit(description, log, truth, unit=unit, channel_map=channel_map, progress=True)
    if out is not None:
        by = f"ramsight identify from the log {one_line(log.name)} and the position in {one_line((truth or log).name)}"
        text = tuned(description, unit, of_identification(found, description.unit(unit)), by).text
        write_text(text, out)
    common.give(unit=unit, identification=found)
    common.say_lines(summary(found))
    common.say_written(out)


def _identify_values(
    machine: str, logs: list[Path], unit: str, channel_map: Path, out: Path | None, map_out: Path | None
) -> None:
    """Find the values of a description, and write what was asked for."""
    from ramsight.api.calibrating import identify_values
    from ramsight.calibration.identify_report import described, map_with, values_summary
    from ramsight.logs.channel_map import load_map
    from ramsight.machine import load_machine
    from ramsight.output import check_apart, check_target, write_text

    for target in (out, map_out):
        check_target(target, (".toml",))
    read: dict[str, str | Path | None] = {"the machine": machine, "--map": channel_map}
    read |= {f"log {k}": log for k, log in enumerate(logs, 1)}
    check_apart(read, {"--out": out, "--map-out": map_out})
    known = load_map(channel_map)
    if map_out is not None and known.motor is None and not known.linearity:
        raise typer.BadParameter("--map-out is for a map with a [current], or with a linearity of measured.position")
    description = load_machine(machine)
    found = identify_values(description, logs, known, unit=unit, progress=True)
    if out is not None:
        write_text(described(found, unit, description, _named(logs)), out)
    if map_out is not None:
        text = map_with(channel_map.read_text(encoding="utf-8"), known, found.torque, found.curve)
        write_text(text, map_out)
    common.give(unit=unit, values=found)
    common.say_lines(values_summary(found, unit))
    common.say_written(out, map_out)


def _named(logs: list[Path]) -> str:
    return one_line(logs[0].name if len(logs) == 1 else f"{len(logs)} logs, {logs[0].name} to {logs[-1].name}")


def commission(
    machine: common.Machine,
    log: common.DriveLog,
    unit: common.DrivenUnit = None,
    truth: Annotated[Path | None, typer.Option(help="Its measured position, if there is one: .csv or .csv.gz.")] = None,
    channel_map: common.ChannelMapFile = None,
    require: common.Requirement = None,
    out: Annotated[
        Path | None, typer.Option(help="The report to sign, one page that needs no other file: .html.")
    ] = None,
    since: Annotated[
        Path | None, typer.Option(help="What an earlier commissioning kept: it begins there, and says what changed.")
    ] = None,
    keep: Annotated[Path | None, typer.Option(help="Where what is found is kept for a later --since: .json.")] = None,
    tuned: Annotated[
        Path | None,
        typer.Option(help="The description of the machine as it was found; its sensor begins there: .toml."),
    ] = None,
) -> None:
    """Judge the commissioning of a machine from the log of its drive.

    Looks, in this order, at the samples, at units and signs against what the machine can do, for a leak test and for
    visits to both end stops, at what the kalman sensor learned and how sure it is; and, where the position was measured
    (--truth), at its errors and at the data sheet against what is identified. Says of each check: passed, look twice
    (with what to do), failed. Where units or signs are wrong the rest is not judged. Exit code 1 if one failed. What
    the position is needed for (--require, or the unit's requirement) comes first: missed is failed.

    Rehearse it: ramsight simulate MACHINE --unit U --duty commissioning --log log.csv --truth position.csv

    The description that --tuned writes has the values that were found: identified where the position was measured, else
    as the sensor has learned them and as the leak test says. How well each is known is what its sensor assumes.

    Example: ramsight commission mining-loader log.csv --unit boom --truth position.csv --out report.html

    Example: ramsight commission mining-loader log.csv --unit boom --tuned boom.toml
    """
    unit = common.named_unit(machine, unit)
    from ramsight.api.commissioning import commission as commission_unit
    from ramsight.api.commissioning import report_of
    from ramsight.logs.channel_map import load_map
    from ramsight.logs.mapped import standard_map
    from ramsight.machine import load_machine
    from ramsight.optional import check_extra
    from ramsight.output import check_apart, check_target, write_text
    from ramsight.study.commissioning.finding import Verdict

    check_target(out, (".html",))
    check_extra("identify", *(["figures"] if out is not None else []))  # the report has a figure
    check_target(keep, (".json",))
    check_target(tuned, (".toml",))
    read: dict[str, str | Path | None] = {
        "the machine": machine, "the log": log, "--map": channel_map, "--truth": truth, "--since": since,
    }  # fmt: skip
    check_apart(read, {"--out": out, "--keep": keep, "--tuned": tuned})
    described = load_machine(machine)
    known = standard_map([]) if channel_map is None else load_map(channel_map)
    done = commission_unit(
        described, log, truth, unit=unit, channel_map=channel_map, require=require, since=since, keep=keep,
        tuned=tuned, progress=True,
    )  # fmt: skip
    if out is not None:
        text = report_of(done, described, unit, log, truth, known, since)
        write_text(text, out)
    common.give(verdict=done.verdict, commissioning=done)
    common.say_verdicts(done.text)
    common.say_written(out, *(() if done.verdict is Verdict.FAILED else (keep, tuned)))
    if done.verdict is Verdict.FAILED:
        raise typer.Exit(1)
