"""Verbs that hold two against each other: a real position sensor and the virtual one, two units' logs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ramsight.cli import common


def compare(
    machine: common.Machine,
    log: common.DriveLog,
    other: Annotated[
        Path | None,
        typer.Argument(help="What the real sensor says: time_s and position_m, .csv or .csv.gz; not needed with --dc."),
    ] = None,
    unit: common.DrivenUnit = None,
    tolerance: Annotated[
        str | None, typer.Option(help="Of the real sensor, by its data sheet and mounting [default: 2 mm].")
    ] = None,
    dc: Annotated[
        str | None, typer.Option("--dc", help='Derive the tolerance: share of errors that is to be found, "90 %".')
    ] = None,
    false_alarms: Annotated[str | None, typer.Option(help='With --dc: false alerts accepted, "1e-5/h".')] = None,
    other_std: Annotated[
        str | None, typer.Option(help="With --dc: standard deviation of all that the real sensor may be off by.")
    ] = None,
    drift: Annotated[str | None, typer.Option(help="With --dc: size of an error of either sensor that stays.")] = None,
    within: Annotated[
        str | None, typer.Option(help="With --dc: time in which it is to be found [default: at once].")
    ] = None,
    time_to_alert: Annotated[str, typer.Option(help="For which both have to be apart.")] = "0.2 s",
    start: Annotated[str | None, typer.Option(help='Piston position at the first sample: "100 mm".')] = None,
    channel_map: Annotated[
        Path | None, typer.Option("--map", help="Which of the log's channels are what: a TOML file.")
    ] = None,
    hindsight: Annotated[
        bool,
        typer.Option(
            "--hindsight",
            help="Judge by where the piston was by all of the log, and not by what a live virtual sensor knew: the "
            "wrong one is named more often.",
        ),
    ] = False,
    out: Annotated[Path | None, typer.Option(help="Both positions and the verdicts: .csv, .csv.gz, .parquet.")] = None,
    figure: Annotated[Path | None, typer.Option(help="A picture of it: .png, .svg or .pdf.")] = None,
    strict: common.Strict = False,
) -> None:
    """Say whether a real position sensor and the virtual one agree, and which of them is wrong where they do not.

    They agree within the virtual sensor's bound and the real one's tolerance. Of two that are apart for longer than the
    time to alert one is wrong: the real one where it stands, leaps or leaves the stroke while the piston cannot have;
    the virtual one where its own status is not ok; else nothing tells. Also how the real one drifts.

    With --dc the tolerance is derived from how far both sensors may be off: the smallest one with few enough false
    alerts. If it does not find as many errors as asked, the exit code is 1, and what would be possible is listed.

    Example: ramsight compare mining-loader log.csv rod.csv --unit boom --tolerance "1 mm" --figure both.png
    Example: ramsight compare press log.csv --dc "90 %" --false-alarms "1e-5/h" --other-std "0.3 mm" --drift "20 mm"
    """
    unit = common.named_unit(machine, unit)
    common.give(unit=unit)
    asked = {"--dc": dc, "--false-alarms": false_alarms, "--other-std": other_std, "--drift": drift}
    _check_asked(asked, within, other, tolerance, {"--out": out, "--figure": figure, "--hindsight": hindsight or None})
    from ramsight.api.second_channel import compare as compared
    from ramsight.optional import check_extra
    from ramsight.output import FIGURE_FILES, check_apart, check_table, check_target
    from ramsight.tracking.compared_figure import compared_figure, write_compared
    from ramsight.tracking.comparing import TOLERANCE
    from ramsight.tracking.figures import verbatim

    check_table(out)
    check_target(figure, FIGURE_FILES)
    check_extra("datasets" if dc is None else "identify", *(["figures"] if figure is not None else []))
    read: dict[str, str | Path | None] = {"the machine": machine, "the log": log, "the other": other}
    check_apart(read | {"--map": channel_map}, {"--out": out, "--figure": figure})
    if dc is not None and false_alarms is not None and other_std is not None and drift is not None:
        from ramsight.api.tolerance_deriving import derive_tolerance

        with common.strictly(is_strict=strict):
            derived = derive_tolerance(
                machine, log, unit=unit, dc=dc, false_alarms=false_alarms, other_std=other_std, drift=drift,
                within=within or 0.0, time_to_alert=time_to_alert, start=start, channel_map=channel_map, progress=True,
            )  # fmt: skip
        common.give(derived=derived.derived)
        common.say_verdicts(derived.text)
        if derived.tolerance is None:
            raise typer.Exit(1)
        tolerance = f"{1e3 * derived.tolerance:.2f} mm"
    if other is None:
        return
    with common.strictly(is_strict=strict):
        found = compared(
            machine,
            log,
            other,
            unit=unit,
            tolerance=tolerance or TOLERANCE,
            time_to_alert=time_to_alert,
            start=start,
            channel_map=channel_map,
            hindsight=hindsight,
            progress=True,
        )
        if out is not None:
            write_compared(found.track, out)
        if figure is not None:
            compared_figure(found.track, verbatim(f"{machine}, {unit}: {other.name}"), figure)
        common.give(**found.figures)
        common.say_lines(found.text)
        common.say_written(out, figure)


def _check_asked(
    asked: dict[str, str | None],
    within: str | None,
    other: Path | None,
    tolerance: str | None,
    results: dict[str, Path | bool | None],
) -> None:
    """Refuse options that do not go together.

    Raises:
        DescriptionError: some of `asked` are missing beside others, or there is no sensor to compare with.
    """
    from ramsight.errors import DescriptionError

    passed = [name for name, value in asked.items() if value is not None]
    missing = [name for name, value in asked.items() if value is None]
    if passed and missing:
        raise DescriptionError(f"needs {', '.join(missing)} beside it", key=passed[0], value=asked[passed[0]])
    if within is not None and not passed:
        raise DescriptionError("is of a tolerance that --dc derives", key="--within", value=within)
    if passed and tolerance is not None:
        raise DescriptionError("is derived with --dc: pass one of them", key="--tolerance", value=tolerance)
    if other is None and not passed:
        raise DescriptionError("what the real sensor says is missing: a file, or --dc to derive a tolerance alone")
    for name, path in results.items():
        if other is None and path is not None:
            raise DescriptionError("needs what the real sensor says", key=name, value=str(path))


def logs_shared(
    first: Annotated[Path, typer.Argument(help=f"One drive's log: {common.LOG}.")],
    second: Annotated[Path, typer.Argument(help=f"The other drive's log: {common.LOG}.")],
    channel_map: Annotated[
        Path | None, typer.Option("--map", help="Which of the first log's channels are what: a TOML file.")
    ] = None,
    second_map: Annotated[
        Path | None, typer.Option("--second-map", help="The same of the second log; as --map without it.")
    ] = None,
) -> None:
    """Say whether the drives of two units of one machine agree on the oil and the voltage that they share.

    Both thermometers and both voltages of the DC link, as far as the logs have them; both logs have one clock. Which of
    two is wrong this cannot tell.

    Example: ramsight logs shared boom.csv bucket.csv
    """
    from ramsight.api.shared_reports import check_shared
    from ramsight.logs import read_log

    logs = [read_log(first, channel_map), read_log(second, second_map or channel_map)]
    common.say_lines(check_shared(*logs).text)
