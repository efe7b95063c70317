"""Verbs of a machine's history: add logs, declare what was done, show, plot, report, export."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import Annotated, Any

import typer

from ramsight.cli import common

Store = Annotated[
    str,
    typer.Option(
        "--store", envvar="RAMSIGHT_HISTORY", help="Where records are kept: a file, or postgresql://user@host/database."
    ),
]
STORE = "history.db"
Serial = Annotated[str, typer.Option(help="Serial number of the machine, if several are described alike.")]
AnySerial = Annotated[str | None, typer.Option("--serial", help="Of this serial number alone.")]
AnyMachine = Annotated[str | None, typer.Argument(help="Name of a machine in the store [default: all of them].")]
AnyOfItsUnits = Annotated[str | None, typer.Option("--unit", help="Of this unit alone.")]


def history_add(
    machine: common.Machine,
    logs: Annotated[list[Path], typer.Argument(help=f"Logs, and folders of logs: {common.LOG}.")],
    unit: common.DrivenUnit = None,
    serial: Serial = "",
    store: Store = STORE,
    channel_map: common.ChannelMapFile = None,
    at: Annotated[
        str | None,
        typer.Option(help="When the log begins, of a single one, as ISO 8601 [default: by its clock, name or file]."),
    ] = None,
    new_description: Annotated[
        bool, typer.Option("--new-description", help="The description has changed: begin a history of its own.")
    ] = False,
    cluster: Annotated[
        str | None, typer.Option(help="Follow the logs on Dask: a scheduler's address, or 'local'.")
    ] = None,
) -> None:
    """Follow a machine's logs, and keep a record of what each says: what the pump leaks, above all.

    Each log is followed by a new sensor that knows the description alone, so that records are independent of each
    other. A log that has a record is not followed again: where this was stopped, the same command goes on. A log that
    cannot be read is left out, and the exit code is 1.

    A log's time is that of its clock if that is a date, else the one in the file's name
    (boom_2026-03-01T0630.csv, UTC), else the file's.

    Example: ramsight history add mining-loader logs/ --unit boom --serial 4711
    """
    from ramsight.api.histories import added
    from ramsight.study.datasheet.cluster import cluster as cluster_at

    with cluster_at(cluster) if cluster is not None else nullcontext() as client:
        done = added(
            store, machine, logs, unit=unit, serial=serial, channel_map=channel_map, at=at,
            new_description=new_description, client=client, progress=True, say=common.say,
        )  # fmt: skip
    for _, why in done.refused:
        common.say_error(why)
    common.give(added=list(done.records), known=list(done.known), refused=dict(done.refused))
    common.say(done.text)
    if done.refused:
        raise typer.Exit(1)


def history_event(
    machine: Annotated[str, typer.Argument(help="Name of a machine in the store.")],
    kind: Annotated[str, typer.Argument(help="'oil change', 'repair' or 'other'.")],
    at: Annotated[str, typer.Argument(help="When, as ISO 8601: 2026-03-01.")],
    unit: Annotated[str, typer.Option(help="The unit.")],
    serial: Serial = "",
    note: Annotated[str, typer.Option(help="What was done, in words.")] = "",
    store: Store = STORE,
) -> None:
    """Declare what was done to a machine, so that its trends may step there.

    Example: ramsight history event mining-loader "oil change" 2026-03-01 --unit boom --serial 4711
    """
    from ramsight.api.histories import history_event as declare

    is_new = declare(store, machine, kind, at, unit=unit, serial=serial, note=note)
    common.say(f"{kind} on {at}: {'kept' if is_new else 'known already'}")


Limits = Annotated[
    list[str] | None,
    typer.Option("--limit", help="Of a quantity over the data sheet's, leak=1.5; may be repeated [default: leak=1.5]."),
]


def history_show(
    machine: AnyMachine = None,
    unit: AnyOfItsUnits = None,
    serial: AnySerial = None,
    store: Store = STORE,
    limit: Limits = None,
) -> None:
    """Say how machines have changed: leakage and its trend, the date of its limit, likely causes, logs to look at.

    The date has an interval of 90 %. Where the records cannot say it, the reason is said in its place.

    Example: ramsight history show mining-loader --unit boom --serial 4711
    """
    from ramsight.api.histories import histories
    from ramsight.histories.history_page import fleet_table, machine_text

    found = histories(store, machine, unit, serial, limits_of(limit))
    common.give(machines=[_figures(one) for one in found])
    if len(found) > 1:
        common.say_table(fleet_table(found))
    else:
        common.say_lines(machine_text(found[0]))


def _figures(one: Any) -> dict[str, Any]:
    """What `--json` has of a machine."""
    return {
        "machine": one.history.kept.key,
        "state": one.state.value,
        "records": len(one.history.records),
        "quantities": {name: trend.figures for name, trend in one.quantities.items()},
        "causes": {cause.cause.words: cause.probability for cause in one.causes},
        "among_sisters": one.among,
        "look_at": one.looks,
    }


def history_plot(
    machine: Annotated[str, typer.Argument(help="Name of a machine in the store.")],
    out: Annotated[Path, typer.Option(help="The picture: .png, .svg or .pdf.")],
    unit: AnyOfItsUnits = None,
    serial: AnySerial = None,
    store: Store = STORE,
    limit: Limits = None,
) -> None:
    """Draw a machine's trends, with what each log says, limits, events and steps.

    Example: ramsight history plot mining-loader --unit boom --serial 4711 --out boom.png
    """
    from ramsight.api.histories import history_of_one
    from ramsight.histories.history_page import history_figure
    from ramsight.output import check_figure

    check_figure(out)
    history_figure(history_of_one(store, machine, unit, serial, limits_of(limit)), out)
    common.say_written(out)


def history_report(
    out: Annotated[Path, typer.Option(help="The page: .html.")],
    machine: AnyMachine = None,
    unit: AnyOfItsUnits = None,
    serial: AnySerial = None,
    store: Store = STORE,
    limit: Limits = None,
) -> None:
    """Write a page on a fleet that needs no other file: a row a machine, and a part a machine with its trend.

    Example: ramsight history report --out fleet.html
    """
    from ramsight.api.histories import history_report as write

    write(store, out, machine, unit=unit, serial=serial, limits=limits_of(limit))
    common.say_written(out)


def history_export(
    out: Annotated[Path, typer.Option(help="The table: .csv, .csv.gz or .parquet.")],
    machine: AnyMachine = None,
    unit: AnyOfItsUnits = None,
    serial: AnySerial = None,
    store: Store = STORE,
) -> None:
    """Write all records as a table: a row a log, with what each says over the data sheet.

    Example: ramsight history export --out records.parquet
    """
    from ramsight.api.histories import histories
    from ramsight.histories.history_dataset import table_of
    from ramsight.output import check_table, open_table

    check_table(out)
    columns = table_of(histories(store, machine, unit, serial))
    with open_table(out, formats=dict.fromkeys(columns, "%.9g")) as table:
        table.append(columns)
    common.say_written(out)


def limits_of(texts: list[str] | None) -> dict[str, float]:
    """Limits as they stand on a command line: ``leak=1.5``."""
    from ramsight.errors import DescriptionError

    found = {}
    for text in texts or []:
        name, _, number = text.partition("=")
        try:
            found[name.strip()] = float(number)
        except ValueError:
            raise DescriptionError("is no limit", key="limit", value=text, allowed="leak=1.5") from None
    return found
