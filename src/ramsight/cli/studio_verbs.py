"""The verb that opens the studio."""

from __future__ import annotations

from typing import Annotated

import typer


def studio(
    machine: Annotated[str, typer.Argument(help="A description file, or a catalogue name.")] = "mining-loader",
    host: Annotated[
        str, typer.Option(help="Address to listen at; any but this machine's own needs the token that is printed.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="Port to listen at.", min=1, max=65535)] = 8080,
    visitors: Annotated[int, typer.Option(help="Visitors at a time; each has a process.", min=1, max=1000)] = 8,
    show: Annotated[bool, typer.Option("--show/--no-show", help="Open a browser.")] = True,
) -> None:
    """Open a page on this machine with a machine that runs, its circuit, and what its sensors say.

    Levers or arrow keys move it; load, oil, wear, drive and thermometer are sliders that the sensor does not see;
    faults are switches. Other tabs hold a form for descriptions, a drive log that is dropped on it, and data sheets
    that fill. Needs the extra studio. Ctrl-C ends it.

    Example: ramsight studio mining-loader --no-show
    """
    from ramsight.studio.web_server import serve

    serve(machine, host=host, port=port, show=show, visitors=visitors)
