"""The verb from a log to what was lifted."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ramsight.cli import common


def weigh(
    machine: common.Machine,
    logs: Annotated[list[Path], typer.Argument(help=f"Logs of the unit that lifts: {common.LOG}.")],
    unit: Annotated[
        str | None, typer.Option("--unit", help="The unit that lifts [default: the mechanism's first].")
    ] = None,
    start: Annotated[
        str | None, typer.Option(help='Position of its piston at the beginning of each log: "50 mm".')
    ] = None,
    beside: common.BesideLogs = None,
    at: common.StandingUnits = None,
    empty: common.EmptyLogs = None,
    known: common.KnownLogs = None,
    lowered_empty: Annotated[
        bool, typer.Option("--lowered-empty", help="What the logs lower is an empty tool: teaches the zero.")
    ] = False,
    inclination: Annotated[str, typer.Option(help='Of the machine, its front up: "3 deg".')] = "0 deg",
    channel_map: common.ChannelMapFile = None,
    out: Annotated[Path | None, typer.Option(help="A row a weighing: .csv, .csv.gz or .parquet.")] = None,
    figure: Annotated[Path | None, typer.Option(help="A picture of them: .png, .svg or .pdf.")] = None,
) -> None:
    """Say what each lift of a log weighed, with its 95 % band, and why a weighing is bad.

    The force is from the motor's torque, the lever from the mechanism at the piston's position. By the description
    alone the band is some per cent of the rated load; one known mass makes it a third of that. A weighing needs a
    steady lift of 3 s. It is no scale for trade, and no safety function.

    Where the description has a load chart, each lift has its largest load moment over the rated one, the probability
    that the rated load was exceeded, and a status for the machine's own logic: within, near, exceeded or unknown. It
    makes no safety claim, and takes the place of no rated capacity limiter.

    Example: ramsight weigh mining-loader log.csv.gz --start "100 mm" --at "bucket=250 mm"
    """
    from ramsight.api.weighing import weigh as weigh_logs
    from ramsight.output import check_apart, check_figure, check_table, open_table
    from ramsight.tool.tool_shown import draw_weighings, weighings_table

    check_table(out)
    check_figure(figure)
    masses = common.known_masses(empty, known)
    read = {f"log {k + 1}": one for k, one in enumerate([*logs, *(file for _, file in masses)])}
    check_apart({"the machine": machine, "--map": channel_map, **read}, {"--out": out, "--figure": figure})
    found = weigh_logs(
        machine, logs, unit=unit, start=start, beside=common.by_unit(beside, "beside", "bucket=bucket.csv"),
        at=common.by_unit(at, "at", "bucket=250 mm"), known=masses, lowered_empty=lowered_empty,
        inclination=inclination, channel_map=channel_map,
    )  # fmt: skip
    common.give(**found.figures)
    if found.weighings:
        common.say_table(weighings_table(found.weighings, rated=found.has_chart))
    common.say_lines(found.text)
    if out is not None:
        with open_table(out, formats=dict.fromkeys(found.columns, "%.9g")) as table:
            table.append(found.columns)
    if figure is not None:
        draw_weighings(found.weighings, found.logs, figure)
    common.say_written(out, figure)
