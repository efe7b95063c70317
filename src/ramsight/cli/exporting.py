"""Verbs that bring a sensor or a plant into other runtimes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ramsight.cli.common import Machine, SensedUnit, option


def export_c(
    machine: Machine,
    unit: SensedUnit,
    out: Annotated[Path, typer.Option(help="Directory for the C; made if it is not there.")],
    single: Annotated[bool, typer.Option("--float", help="Floats in place of doubles.")] = False,
) -> None:
    """Write the kalman sensor as C99 for an electronic control unit.

    One header and one body, libm alone: no memory is taken, nothing is global. With them a test program with samples of
    a simulated log, faults among them, and what Python says of each. Where there is a C compiler it is compiled and
    run, and says what it takes of memory and time; so does the README.md.

    Example: ramsight export c mining-loader --unit boom --out boom-c
    """
    from ramsight.api.exporting import export_c as export_unit
    from ramsight.deploy.c_folder import shown

    done = export_unit(machine, unit, out=out, single=single, progress=True)
    typer.echo(
        shown(done.footprints) if done.footprints else "no C compiler was found: nothing was compiled or measured"
    )
    typer.echo(f"{out}: {', '.join(sorted(done.files))} written")


def export_fmu(
    machine: Machine,
    unit: Annotated[str, typer.Option(help="The unit, for example boom.")],
    out: Annotated[Path, typer.Option(help="The FMU: .fmu.")],
    what: Annotated[str, typer.Option(help="sensor: the kalman sensor; plant: the unit itself, simulated.")] = "sensor",
    fmi: Annotated[int, typer.Option(help="Version of the interface: 2 or 3.")] = 2,
) -> None:
    """Write a co-simulation FMU of a unit's virtual sensor, or of the unit itself with its own solver.

    Its C sources are inside, and a binary for this machine where there is a C compiler. A step of the sensor takes the
    inputs as one sample, so step it as often as the drive reports (1 to 100 ms). The plant holds its inputs through a
    step, or goes straight on by their slopes where you give them.

    Example: ramsight export fmu mining-loader --unit boom --what plant --fmi 3 --out boom.fmu
    """
    from ramsight.api.exporting import export_fmu as export_unit

    done = export_unit(machine, unit, out=out, what=what, fmi=fmi, named=option)
    binary = f"sources and a binary for {done.binary}" if done.binary else "sources alone: no C compiler was found"
    typer.echo(f"{out}: written; FMI {fmi}.0 co-simulation, {done.variables} variables, {binary}")
