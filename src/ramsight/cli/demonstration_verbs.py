"""The verb that shows what this is about."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ramsight.cli.common import say_written


def demo(
    out: Annotated[
        Path | None,
        typer.Option(help="The picture: .png, .svg or .pdf [default: demo.png, where the extra figures is installed]."),
    ] = None,
) -> None:
    """Show what ramsight is about, on a log and a machine that ship with it.

    A loader's boom works for six minutes; its pumps leak more and deliver less than their data sheet states. The sensor
    is started without a position, finds it at the first end stop, and learns the machine; beside it stands what the
    data sheet alone would have said. The first run compiles the equations, which takes some seconds.

    Example: ramsight demo
    """
    from ramsight.demo.demonstration import demonstrated
    from ramsight.demo.showing import write_figure
    from ramsight.optional import missing
    from ramsight.output import check_figure

    lacks = missing("figures") if out is None else ""
    picture = None if lacks else out or Path("demo.png")
    check_figure(picture)
    shown = demonstrated(progress=True)
    if picture is not None:
        write_figure(shown, picture)
    typer.echo(shown.text)
    say_written(picture)
    if lacks:
        typer.echo(f"no picture: {lacks}")
