"""The verb that holds a real position sensor against the virtual one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ramsight.cli.common import DrivenUnit, Machine, Strict, named_unit, say_written
from ramsight.cli.strictness import strictly


def compare(
    machine: Machine,
    log: Annotated[
        Path,
        typer.Argument(help="Drive log: CSV, Parquet, MF4, MCAP, TDMS, MATLAB, Excel or CAN frames, by its suffix."),
    ],
    other: Annotated[Path, typer.Argument(help="What the real sensor says: time_s and position_m, .csv or .csv.gz.")],
    unit: DrivenUnit = None,
    tolerance: Annotated[str, typer.Option(help="Of the real sensor, by its data sheet and mounting.")] = "2 mm",
    time_to_alert: Annotated[str, typer.Option(help="For which both have to be apart.")] = "0.2 s",
    start: Annotated[str | None, typer.Option(help='Piston position at the first sample: "100 mm".')] = None,
    channel_map: Annotated[
        Path | None, typer.Option("--map", help="Which of the log's channels are what: a TOML file.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Both positions and the verdicts: .csv, .csv.gz, .parquet.")] = None,
    figure: Annotated[Path | None, typer.Option(help="A picture of it: .png, .svg or .pdf.")] = None,
    strict: Strict = False,
) -> None:
    """Say whether a real position sensor and the virtual one agree, and which of them is wrong where they do not.

    They agree within the virtual sensor's bound and the real one's tolerance. Of two that are apart for longer than the
    time to alert one is wrong: the real one where it stands, leaps or leaves the stroke while the piston cannot have;
    the virtual one where its own status is not ok; else nothing tells. Also how the real one drifts.

    Example: ramsight compare mining-loader log.csv rod.csv --unit boom --tolerance "1 mm" --figure both.png
    """
    unit = named_unit(machine, unit)
    from ramsight.api.second_channel import compare as compared
    from ramsight.output import check_apart, check_installed, check_target
    from ramsight.tracking.compared_figure import compared_figure, write_compared

    check_target(out, (".csv", ".csv.gz", ".parquet"))
    if out is not None:
        check_installed(out)
    check_target(figure, (".png", ".svg", ".pdf"))
    read: dict[str, str | Path | None] = {"the machine": machine, "the log": log, "the other": other}
    check_apart(read | {"--map": channel_map}, {"--out": out, "--figure": figure})
    with strictly(is_strict=strict):
        found = compared(
            machine,
            log,
            other,
            unit=unit,
            tolerance=tolerance,
            time_to_alert=time_to_alert,
            start=start,
            channel_map=channel_map,
            progress=True,
        )
        if out is not None:
            write_compared(found.track, out)
        if figure is not None:
            compared_figure(found.track, f"{machine}, {unit}: {other.name}", figure)
        typer.echo(found.text)
        say_written(out, figure)
