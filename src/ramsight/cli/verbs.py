"""All verbs and their names, in the order in which the help lists them."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from typing import Annotated, Any

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


def offer(to: typer.Typer, verb: Callable[..., Any], name: str | None = None, *, alone: bool = False) -> None:
    """Offer a verb with its docstring as help, in which each example has a line of its own that can be copied.

    Args:
        to: the group that gets it.
        verb: the function.
        name: what it is called there; by default as the function.
        alone: it is what the group does by itself.
    """
    # \b is how Click is told to leave the lines of a paragraph as they are.
    text = re.sub(r"((?:^Example: .*\n*)+)\Z", _examples, inspect.getdoc(verb) or "", flags=re.MULTILINE)
    (to.callback(help=text) if alone else to.command(name, help=text))(verb)


def _examples(found: re.Match[str]) -> str:
    lines = [line.removeprefix("Example: ") for line in found[0].splitlines() if line]
    return "\n".join(["\b", f"Example{'s' * (len(lines) > 1)}:", *(f"  {line}" for line in lines)])


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
    offer(app, verb)

catalog = group(invoke_without_command=True)
offer(catalog, machines.catalog_list, alone=True)
offer(catalog, machines.catalog_show, "show")
app.add_typer(catalog, name="catalog")

logs = group(no_args_is_help=True, help="Look into drive logs, and send them.")
offer(logs, tracking.logs_inspect, "inspect")
offer(logs, sharing.logs_shared, "shared")
offer(logs, bus.logs_replay, "replay")
app.add_typer(logs, name="logs")

export = group(no_args_is_help=True, help="Into a control unit and into a simulator.")
offer(export, exporting.export_c, "c")
offer(export, exporting.export_fmu, "fmu")
app.add_typer(export, name="export")
