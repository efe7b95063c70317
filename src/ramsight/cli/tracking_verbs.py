"""Verbs from a log to a position: look into the log, track."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ramsight.cli import common

if TYPE_CHECKING:
    from ramsight.machine.description import Machine as Described
    from ramsight.machine.requirement_description import Requirement as Required
    from ramsight.plant.unit import HydraulicUnit
    from ramsight.signals import Signals
    from ramsight.tool.tool_track import ToolPoint
    from ramsight.tracking.pieces import Pieces

_STYLE = "screen"


def logs_inspect(
    file: Annotated[Path, typer.Argument(help=f"The log: {common.LOG}.")],
    dbc: Annotated[list[Path] | None, typer.Option(help="What CAN frames mean: a DBC file; may be repeated.")] = None,
    channel_map: Annotated[
        Path | None, typer.Option("--map", help="What is known already: the layout of a CSV file, PDOs, ...")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Write the proposed channel map here: .toml.")] = None,
    strict: common.Strict = False,
) -> None:
    """Show what is in a log, and propose which of its channels are speed, torque and oil temperature.

    Lists every channel with its unit, how many samples it has, how often they come and between what values they lie,
    and prints a channel map in TOML. Check it - names, units, and signs above all: positive speed extends the rod,
    positive torque drives that way - then track with it.

    Example: ramsight logs inspect day.mf4 --out map.toml
    Example: ramsight track my-machine.toml day.mf4 --unit boom --map map.toml
    """
    from ramsight.logs.inspect import inspect_log
    from ramsight.logs.proposal import map_text
    from ramsight.logs.shown import inspection_table
    from ramsight.output import check_apart, check_target, write_text
    from ramsight.progress import progress

    check_target(out, (".toml",))
    check_apart({"the log": file, "--map": channel_map}, {"--out": out})
    with common.strictly(is_strict=strict):
        with progress(1.0, "looking through") as bar:
            found = inspect_log(file, channel_map, dbc=dbc or (), advance=bar.advance)
        common.say_table(inspection_table(found))
        text = map_text(found, None if out is None else out.parent)
        common.give(file=found.file, channels=[one.figures for one in found.channels], map=text)
        if out is None:
            common.say_lines("\n" + text.removesuffix("\n"))
            return
        write_text(text, out)
        common.report().add("written", [str(out)])
        common.say(f"{out}: written; check it, signs above all")


def track(
    machine: common.Machine,
    logs: Annotated[
        list[Path],
        typer.Argument(
            metavar="log", help=f"Drive log: {common.LOG}. Several logs of one duty are laid over each other."
        ),
    ],
    unit: common.DrivenUnit = None,
    start: Annotated[
        str | None,
        typer.Option(
            help='Piston position at the first sample, 0 = retracted: "100 mm". The kalman sensor does without: it is '
            "not referenced until it meets an end stop or a reference."
        ),
    ] = None,
    start_std: Annotated[
        str,
        typer.Option(
            help="Standard deviation of that position. A start that is off by many of them is taken for leakage at the "
            "first stop: say honestly how well it is known, or leave --start out."
        ),
    ] = "1 mm",
    sensor: Annotated[
        str,
        typer.Option(
            help="kalman: calibrates itself; balance: of volumes, by the data sheet; table: the paper's look-up "
            "table; or a file of 'calibrate'."
        ),
    ] = "kalman",
    state: Annotated[
        Path | None,
        typer.Option(
            help="Resume the kalman sensor from this file if it is there, and keep its state in it at the end."
        ),
    ] = None,
    channel_map: common.ChannelMapFile = None,
    out: Annotated[Path | None, typer.Option(help="The track: .csv, .csv.gz, .parquet, .mf4, .mcap or .nc.")] = None,
    truth: Annotated[
        Path | None,
        typer.Option(help="True position, to print the errors: .csv or .csv.gz; or the map's measured.position."),
    ] = None,
    figure: Annotated[Path | None, typer.Option(help="A picture of it: .png, .svg or .pdf.")] = None,
    belief: Annotated[
        Path | None,
        typer.Option(
            help="A picture of what the sensor knows at first, at the first ends and at last: the probability of "
            "the place, by hypothesis: .png, .svg or .pdf."
        ),
    ] = None,
    width: Annotated[str | None, typer.Option(help='Of the picture: "88 mm".')] = None,
    style: Annotated[
        str, typer.Option(help="Of the picture: screen, or journal (small serif font, no title).")
    ] = _STYLE,
    alarm_limit: Annotated[
        str | None,
        typer.Option(
            help='Error that the position must not have for what it is used for, "10 mm": says how much of the time it '
            "is available for that, and how often it is not."
        ),
    ] = None,
    time_to_alert: Annotated[
        str | None, typer.Option(help="For which that may be unsure before it is an alert [default: 0.2 s].")
    ] = None,
    hindsight: Annotated[
        bool,
        typer.Option(
            "--hindsight",
            help="Say it by all that the log says, and not as a live sensor would: an end that is met at last tells "
            "where the piston was before.",
        ),
    ] = False,
    both: Annotated[
        bool, typer.Option("--both", help="Write beside it what the live sensor says, and the NIS of each measurement.")
    ] = False,
    align: Annotated[
        str | None,
        typer.Option(
            help="Of several logs, what is at 0 s of each: start, the first sample, or reference, the first end that "
            "the sensor met or the first reference [default: start]."
        ),
    ] = None,
    cursor: Annotated[
        list[str] | None,
        typer.Option(
            help='Read several logs at this instant, "12 s"; may be repeated [default: at the largest differences].'
        ),
    ] = None,
    tool: Annotated[
        str | None,
        typer.Option(help="Say where this point of the mechanism was, too: tip, payload, or BODY.NAME as bucket.edge."),
    ] = None,
    beside: common.BesideLogs = None,
    at: common.StandingUnits = None,
    tool_figure: Annotated[
        Path | None, typer.Option(help="A picture of the point's height, reach and angle: .png, .svg or .pdf.")
    ] = None,
    require: common.Requirement = None,
    strict: common.Strict = False,
) -> None:
    """Say where the piston was, from the log of a motor drive.

    The log has the columns time_s, motor_speed_rpm, motor_torque_nm and oil_temperature_c, and perhaps reference_m:
    empty, or the position that a switch knows at that instant. For any other log, and for CAN frames, a channel map
    states which channels are what: ramsight logs inspect proposes one. The track has time_s, position_m,
    position_std_m, position_low_m and position_high_m (the 95 % band), position_bound_m (an error that one sample in
    100 000 exceeds; all empty where the sensor does not know it), status and whether a reference has come; as .nc also
    velocity, load, pressures and what it learned. With a --tool also its reach, height and angle with their deviations;
    units that are neither --beside nor --at may be anywhere. With a --truth and a requirement the exit code is 1 if
    that is missed; with --strict also if no sample has a position.

    Several logs of one duty, of one machine before and after a repair or of two of a kind, are laid over each other:
    how far each is from the first, and whether their 95 % bands overlap. Where they do not, the runs differ by more
    than the sensor is unsure. The table then has a row for each sample of the first log.

    Example: ramsight track mining-loader log.csv.gz --unit boom --start "100 mm" --out track.csv
    Example: ramsight track mining-loader log.csv.gz --unit boom --hindsight --figure track.png
    Example: ramsight track mining-loader monday.csv friday.csv --unit boom --align reference --figure both.png
    Example: ramsight track mining-loader log.csv.gz --unit boom --start "100 mm" --tool tip --at "bucket=250 mm"
    """
    unit = common.named_unit(machine, unit)
    if len(logs) > 1:
        alone = {
            "--state": state, "--truth": truth, "--belief": belief, "--both": both or None, "--require": require,
            "--alarm-limit": alarm_limit, "--time-to-alert": time_to_alert, "--tool": tool,
            "--tool-figure": tool_figure, "--beside": beside or None, "--at": at or None,
        }  # fmt: skip
        _refuse(alone, "is of one log alone")
        options = {
            "start": start, "start_std": start_std, "sensor": sensor, "channel_map": channel_map, "hindsight": hindsight
        }  # fmt: skip
        with common.strictly(is_strict=strict):
            _overlaid(machine, unit, logs, (align or "start", cursor or []), options, out, (figure, width, style))
        return
    log = logs[0]
    _refuse({"--align": align, "--cursor": cursor or None}, "needs several logs")
    from ramsight.api.following import availability_of, follow, start_of, true_position
    from ramsight.api.requirements import required_unit
    from ramsight.machine import load_machine
    from ramsight.plant.build import build
    from ramsight.tracking.availability import TIME_TO_ALERT

    figures = (figure, belief, tool_figure)
    _check_files(machine, log, sensor, channel_map, truth, out, figures, state)
    _check_together(sensor, figures, tool, others=bool(beside or at), hindsight=hindsight, both=both)
    look = _look(width, style, is_drawn=figure is not None or belief is not None)
    description = load_machine(machine)
    built = required_unit(build(description, unit), require)
    position, std = start_of(built, start, start_std)
    asked = built.requirement
    available = availability_of(built, alarm_limit, TIME_TO_ALERT if time_to_alert is None else time_to_alert)
    with common.strictly(is_strict=strict):
        true = true_position(truth, log, channel_map, built)
        point = None if tool is None else _tool(description, tool, beside, at, channel_map)
        done = follow(
            built, log, channel_map, sensor=sensor, start=position, start_std=std, state=state, out=out,
            keep_track=true is not None or figure is not None or asked is not None or tool_figure is not None,
            keep_log=figure is not None or asked is not None,
            more=("mode", "reference", *(() if point is None else point.columns)),
            tool=point, available=available, hindsight=hindsight, both=both, progress=True, say=common.say_lines,
        )  # fmt: skip
        titles = [f"{description.title or description.name}, {what}: {log.name}" for what in (unit, tool)]
        _draw(done, true, titles, figures, look, (built, log, channel_map, (position, std)))
        common.give(unit=unit, **done.figures, mistake=done.mistake)
        common.say_lines(done.summary)
        if true is not None and done.track is not None:
            _say_errors(done.track, true)
        is_missed = asked is not None and _say_achieved(done, true, asked, built)
        common.say_written(out, *figures, None if done.is_contradicted else state)
        if done.mistake:
            common.say(f"likeliest mistake: {done.mistake}")
        useless = strict and not done.has_position
        if useless:
            common.say_error("no sample has a position: no end stop and no reference was met, and no --start was given")
        if useless or is_missed:
            raise typer.Exit(1)


def _look(width: str | None, style: str, *, is_drawn: bool) -> Any:
    """How a picture looks; None where none is drawn, and no look is asked for."""
    if not is_drawn and width is None and style == _STYLE:
        return None
    from ramsight.api.plotting import look_of

    return look_of(width, style, is_drawn=is_drawn)


def _draw(
    done: Pieces,
    true: Signals | None,
    titles: Iterable[str],
    figures: tuple[Path | None, Path | None, Path | None],
    look: Any,
    begun: tuple[HydraulicUnit, Path, Path | None, tuple[float | None, float]],
) -> None:
    """Draw what is asked for: the track, what the sensor knows, the tool.

    Args:
        titles: of what shows the unit, and of what shows the tool.
        begun: unit, log, map, and the position at first with its standard deviation.
    """
    if not any(figures):
        return
    from ramsight.tracking.figures import tracked_figure, verbatim

    figure, belief, tool_figure = figures
    of_unit, of_tool = map(verbatim, titles)
    if belief is not None:
        from ramsight.tracking.belief_figure import tracked_belief

        tracked_belief(*begun, true, of_unit, belief, look)
    if figure is not None and done.track is not None and done.log is not None:
        tracked_figure(done.log, done.track, true, of_unit, figure, look)
    if tool_figure is not None and done.track is not None:
        from ramsight.tool.tool_shown import draw_tool

        draw_tool(done.track, of_tool, tool_figure)


def _say_achieved(done: Pieces, true: Signals | None, asked: Required, unit: HydraulicUnit) -> bool:
    """Say what a track achieves of a requirement; whether a true position shows that it is missed."""
    from ramsight.api.requirements import achieved

    check = achieved(done, true, asked, unit)
    if check is None:
        return False
    common.give(requirement={**common.plain(check), "is_met": check.is_met, "missing": check.missing})
    common.say_lines(check.verdict)
    return true is not None and not check.is_met


def _say_errors(track: Any, true: Any) -> None:
    """Say how far a track is off, and the live sensor's where both are in it."""
    from ramsight.tracking.track_errors import error_text, errors_of, live_of

    errors = errors_of(track, true)
    common.give(errors=errors)
    common.say_lines(error_text(errors, len(track)))
    if (live := live_of(track)) is not None:
        found = errors_of(live, true)
        common.give(live_errors=found)
        common.say_lines(f"live sensor: {error_text(found, len(live))}")


def _refuse(passed: Mapping[str, object], why: str) -> None:
    """Refuse the first option that was passed and is of no use.

    Raises:
        DescriptionError: there is one.
    """
    from ramsight.errors import DescriptionError

    for name, value in passed.items():
        if value is not None:
            raise DescriptionError(why, key=name, value=value)


def _overlaid(
    machine: str,
    unit: str,
    logs: list[Path],
    asked: tuple[str, list[str]],
    options: Mapping[str, Any],
    out: Path | None,
    drawn: tuple[Path | None, str | None, str],
) -> None:
    """Several logs laid over each other.

    Args:
        asked: what is at 0 s, and at which instants to read.
    """
    from ramsight.api.second_channel import overlay
    from ramsight.optional import check_extra
    from ramsight.output import check_apart, check_figure, check_table
    from ramsight.tracking.compared_figure import overlay_figure, write_overlay
    from ramsight.tracking.figures import verbatim

    figure, width, style = drawn
    check_table(out)
    check_figure(figure)
    check_extra("datasets")
    read: dict[str, str | Path | None] = {
        "the machine": machine, "--sensor": options["sensor"], "--map": options["channel_map"],
        **{f"log {k}": log for k, log in enumerate(logs, start=1)},
    }  # fmt: skip
    check_apart(read, {"--out": out, "--figure": figure})
    look = _look(width, style, is_drawn=figure is not None)
    runs = overlay(machine, logs, unit=unit, align=asked[0], cursors=asked[1], progress=True, **options)
    if out is not None:
        write_overlay(runs, out)
    if figure is not None:
        overlay_figure(runs, verbatim(f"{machine}, {unit}: {len(logs)} runs"), figure, look)
    common.give(unit=unit, **runs.figures)
    common.say_lines(runs.text)
    common.say_written(out, figure)


def _tool(
    description: Described, tool: str, beside: list[str] | None, at: list[str] | None, channel_map: Path | None
) -> ToolPoint:
    """The point that is asked for, with what is known of the other units."""
    from ramsight.api.tool_places import others_of, tool_of
    from ramsight.plant.linked import build_linked

    linked = build_linked(description)
    logs = common.by_unit(beside, "beside", "bucket=bucket.csv")
    others = others_of(linked, logs, common.by_unit(at, "at", "bucket=250 mm"), channel_map)
    return tool_of(description, linked, tool, others)


def _check_together(
    sensor: str, figures: tuple[Path | None, ...], tool: str | None, *, others: bool, hindsight: bool, both: bool
) -> None:
    """Refuse options that need another one, or another sensor."""
    from ramsight.errors import DescriptionError

    _, belief, tool_figure = figures
    if belief is not None and sensor != "kalman":
        raise DescriptionError("has no hypotheses to draw", key="sensor", value=sensor, allowed="kalman")
    if both and not hindsight:
        raise DescriptionError("needs --hindsight beside it", key="both")
    if tool is None and (others or tool_figure is not None):
        raise DescriptionError("needs --tool beside it", key="beside, at or tool-figure")


def _check_files(
    machine: str,
    log: Path,
    sensor: str,
    channel_map: Path | None,
    truth: Path | None,
    out: Path | None,
    figures: tuple[Path | None, Path | None, Path | None],
    state: Path | None,
) -> None:
    """Refuse what cannot be written, or would be written over what is read, before any work is done."""
    from ramsight.output import DATASET_FILES, check_apart, check_figure, check_installed, check_state, check_target

    check_target(out, DATASET_FILES)
    if out is not None:
        check_installed(out)
    for figure in figures:
        check_figure(figure)
    read: dict[str, str | Path | None] = {
        "the machine": machine, "the log": log, "--sensor": sensor, "--map": channel_map, "--truth": truth,
    }  # fmt: skip
    named = dict(zip(("--figure", "--belief", "--tool-figure"), figures, strict=True))
    check_apart(read, {"--out": out, **named, "--state": state})
    check_state(state)
