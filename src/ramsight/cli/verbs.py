"""All verbs and their names, in the order in which the help lists them."""

from __future__ import annotations

from typing import Annotated

import typer

from ramsight.cli import (
    bus,
    calibration,
    commissioning,
    comparing,
    datasheets,
    demonstration,
    drawing,
    exporting,
    machines,
    sharing,
    simulation,
    studies,
    studio,
    tracking,
)
from ramsight.cli.common import group

app = group(name="ramsight", no_args_is_help=True, pretty_exceptions_enable=False)


def _version(wanted: bool) -> None:
    if wanted:
        from ramsight import __version__

        typer.echo(f"ramsight {__version__}")
        raise typer.Exit


@app.callback()
def ramsight(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Where the piston of a hydraulic cylinder is, without a position sensor.

    A machine is a TOML file or a name in the catalogue. Begin with: ramsight demo
    """


for verb in (
    demonstration.demo,
    machines.check,
    machines.new,
    drawing.draw,
    simulation.simulate,
    tracking.track,
    comparing.compare,
    calibration.calibrate,
    studies.paper,
    calibration.leaktest,
    calibration.identify,
    commissioning.commission,
    studies.loader,
    studio.studio,
    datasheets.datasheet,
    bus.encoder,
):
    app.command()(verb)

catalog = group(invoke_without_command=True)
catalog.callback()(machines.catalog_list)
catalog.command("show")(machines.catalog_show)
app.add_typer(catalog, name="catalog")

logs = group(no_args_is_help=True, help="Look into drive logs, and send them.")
logs.command("inspect")(tracking.logs_inspect)
logs.command("shared")(sharing.logs_shared)
logs.command("replay")(bus.logs_replay)
app.add_typer(logs, name="logs")

export = group(no_args_is_help=True, help="Into a control unit and into a simulator.")
export.command("c")(exporting.export_c)
export.command("fmu")(exporting.export_fmu)
app.add_typer(export, name="export")
