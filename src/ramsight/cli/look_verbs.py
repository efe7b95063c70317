"""Verbs to look on: the demonstration, and the studio."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ramsight.cli.common import say, say_lines, say_written


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
    from ramsight.demo.showing import demonstrated, write_figure
    from ramsight.optional import missing
    from ramsight.output import check_figure

    lacks = missing("figures") if out is None else ""
    picture = None if lacks else out or Path("demo.png")
    check_figure(picture)
    shown = demonstrated(progress=True)
    if picture is not None:
        write_figure(shown, picture)
    say_lines(shown.text)
    say_written(picture)
    if lacks:
        say(f"no picture: {lacks}")


def studio(
    machine: Annotated[str, typer.Argument(help="A description file, or a catalogue name.")] = "mining-loader",
    host: Annotated[
        str, typer.Option(help="Address to listen at; any but this machine's own needs the token that is printed.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="Port to listen at.", min=1, max=65535)] = 8080,
    visitors: Annotated[int, typer.Option(help="Visitors at a time; each has a process.", min=1, max=1000)] = 8,
    show: Annotated[bool, typer.Option("--show/--no-show", help="Open a browser.")] = True,
    history: Annotated[
        str | None, typer.Option(help="Store of 'history add', a file or postgresql://…, that a tab shows.")
    ] = None,
) -> None:
    """Open a page on this machine with a machine that runs, its circuit, and what its sensors say.

    Levers or arrow keys move it; load, oil, wear, drive and thermometer are sliders that the sensor does not see;
    faults are switches. Other tabs hold a form for descriptions, a drive log that is dropped on it, data sheets that
    fill, and how the machines of a store of histories change. Needs the extra studio. Ctrl-C ends it.

    Example: ramsight studio mining-loader --no-show
    """
    from ramsight.studio.web_server import serve

    serve(machine, host=host, port=port, show=show, visitors=visitors, history=history)
