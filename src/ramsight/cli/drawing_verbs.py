"""The verb that draws a circuit."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ramsight.cli.common import Machine, say_written


def draw(
    machine: Machine,
    out: Annotated[Path, typer.Option(help="Where to write it: .svg, .png or .pdf.")],
    unit: Annotated[str | None, typer.Option(help="The unit, for example boom; needed if there are several.")] = None,
) -> None:
    """Draw a unit's circuit with the symbols of ISO 1219-1, for papers and manuals.

    The drawing is laid out from the parts and nodes of the description: the cylinder above, valves and hoses in its
    lines, pumps with their motor below, valves to the tank beside them, tank or accumulator at the bottom. Pumps show
    their displacement, relief valves their setting, cylinders their areas in true proportion.

    Example: ramsight draw mining-loader --unit boom --out boom.svg
    """
    from ramsight.api.drawing import draw as draw_unit

    draw_unit(machine, out, unit=unit)
    say_written(out)
