"""The study of the paper again: `python -m reproduction --out build/paper`, or `make paper`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from ramsight import DescriptionError, RamsightError
from ramsight.output import check_folder
from ramsight.progress import progress
from ramsight.units import parse_option
from reproduction import STEPS, Choices, reproduce, write_report
from reproduction.choices import READINGS, read_values

app = typer.Typer(rich_markup_mode=None, pretty_exceptions_enable=False)


@app.command()
def paper(
    out: Annotated[Path, typer.Option(help="Directory for the report; made if it is not there.")],
    machine: Annotated[str, typer.Argument(help="A description file, or a catalogue name.")] = "mining-loader",
    ramp: Annotated[
        str, typer.Option(help="Time in which the motor comes to its speed and back; the paper does not give it.")
    ] = "0.8 s",
    loads: Annotated[
        str,
        typer.Option(
            help="stated: the forces that the machine's description names, the paper's kN; shares: a quarter, a half "
            "and three quarters of what the relief valves let each unit lift. The paper says both, and they differ."
        ),
    ] = "stated",
    values: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            help="A value of the machine in the place of the described one; may be repeated: "
            "'boom.hose.diameter=19 mm', 'boom.hose.regime=turbulent', 'boom.pump_a.volumetric_efficiency=0.92', "
            "'bucket.load.loads.high=150 kN'.",
        ),
    ] = None,
) -> None:
    """Redo the study of the paper and lay statement, result and verdict side by side.

    What the paper leaves open is an option: ramps, loads, and any value of the machine, hoses and efficiencies among
    them, so that a value that is found later can be tried. MACHINE is a description with direct-driven units boom and
    bucket, each with loads light, medium and high.

    Writes report.html (self-contained), report.pdf, report.md with its figures as PNG and SVG, and results.json with
    every number. An earlier report in the same directory is replaced; other files there stay.
    """
    check_folder(out)
    if loads not in READINGS:
        raise DescriptionError("is no reading of the loads", key="--loads", value=loads, allowed=", ".join(READINGS))
    seconds = parse_option(ramp, "s", "--ramp", least="0.05 s", most="5 s")
    choices = Choices(machine, seconds, loads, read_values(values or (), "--set"))
    with progress(STEPS, "redoing the paper") as bar:
        study = reproduce(choices, advance=bar.advance)
        write_report(study, out, advance=bar.advance)
    typer.echo(study.summary())
    typer.echo(f"{out}: report.html, report.pdf, report.md and results.json written")


if __name__ == "__main__":
    try:
        app()
    except RamsightError as error:
        sys.exit(f"error: {error}")
