"""What verbs share: how a group of them behaves, arguments that several take, how they say what was written."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

Machine = Annotated[str, typer.Argument(help="A description file, or a catalogue name.")]
DrivenUnit = Annotated[str, typer.Option(help="The unit that the drive turns, for example boom.")]
SensedUnit = Annotated[str, typer.Option(help="The unit that the sensor is for, for example boom.")]
DriveLog = Annotated[
    Path, typer.Argument(help="Drive log: CSV, Parquet, MF4, MCAP, TDMS, MATLAB, Excel or CAN frames, by its suffix.")
]
Strict = Annotated[
    bool, typer.Option("--strict", help="Exit with 1 if there was a warning, for batch jobs; files are written.")
]
Requirement = Annotated[
    str | None,
    typer.Option(
        "--require",
        help='Error that 95 % have to be within, "5 mm": the verdict is by that [default: requirement of the unit].',
    ),
]
ChannelMapFile = Annotated[
    Path | None,
    typer.Option("--map", help="Which of the log's channels are what: a TOML file of 'ramsight logs inspect'."),
]


def group(**options: Any) -> typer.Typer:
    """A group of verbs, empty as yet; options are those of Typer."""
    return typer.Typer(rich_markup_mode=None, context_settings={"help_option_names": ["-h", "--help"]}, **options)


def option(argument: str) -> str:
    """What messages call an argument of a function: ``--oil-temperature`` of ``oil_temperature``."""
    return f"--{argument.replace('_', '-')}"


def say_written(*paths: Path | None) -> None:
    """Say which files were written; None was not asked for."""
    for path in paths:
        if path is not None:
            typer.echo(f"{path}: written")
