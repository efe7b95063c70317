"""All verbs and their names, in the order in which the help lists them."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from typing import Annotated, Any

import typer

from ramsight.cli import (
    bus_verbs,
    calibration_verbs,
    commissioning_verbs,
    comparing_verbs,
    datasheet_verbs,
    demonstration_verbs,
    drawing_verbs,
    exporting_verbs,
    machine_verbs,
    sharing_verbs,
    simulation_verbs,
    studio_verbs,
    study_verbs,
    tracking_verbs,
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
    # \b makes Click leave the lines of a paragraph as they are.
    text = re.sub(r"((?:^Example: .*\n*)+)\Z", _examples, inspect.getdoc(verb) or "", flags=re.MULTILINE)
    (to.callback(help=text) if alone else to.command(name, help=text))(verb)


def _examples(found: re.Match[str]) -> str:
    lines = [line.removeprefix("Example: ") for line in found[0].splitlines() if line]
    return "\n".join(["\b", f"Example{'s' * (len(lines) > 1)}:", *(f"  {line}" for line in lines)])


def _version(wanted: bool) -> None:
    if wanted:
        from ramsight._version import __version__

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
    demonstration_verbs.demo,
    machine_verbs.check,
    machine_verbs.new,
    drawing_verbs.draw,
    simulation_verbs.simulate,
    tracking_verbs.track,
    comparing_verbs.compare,
    calibration_verbs.calibrate,
    study_verbs.paper,
    calibration_verbs.leaktest,
    calibration_verbs.identify,
    commissioning_verbs.commission,
    study_verbs.loader,
    studio_verbs.studio,
    datasheet_verbs.datasheet,
    bus_verbs.encoder,
):
    offer(app, verb)

catalog = group(invoke_without_command=True)
offer(catalog, machine_verbs.catalog_list, alone=True)
offer(catalog, machine_verbs.catalog_show, "show")
app.add_typer(catalog, name="catalog")

logs = group(no_args_is_help=True, help="Look into drive logs, and send them.")
offer(logs, tracking_verbs.logs_inspect, "inspect")
offer(logs, sharing_verbs.logs_shared, "shared")
offer(logs, bus_verbs.logs_replay, "replay")
app.add_typer(logs, name="logs")

export = group(no_args_is_help=True, help="Into a control unit and into a simulator.")
offer(export, exporting_verbs.export_c, "c")
offer(export, exporting_verbs.export_fmu, "fmu")
offer(export, exporting_verbs.export_parameters, "parameters")
app.add_typer(export, name="export")
