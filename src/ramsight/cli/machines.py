"""Verbs about descriptions of machines: check one, look into the catalogue, begin a new one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ramsight.cli.common import Machine


def check(
    machine: Machine,
    unit: Annotated[str | None, typer.Option(help="Show this unit only, for example boom.")] = None,
) -> None:
    """Check a machine description and show what follows from it.

    Says in one line what is wrong: file, key, value and allowed range. If nothing is, shows for each unit the
    areas and ratios, the travel per motor revolution, the load at relief pressure, and for each named load
    the pressure and the motor torque while lifting and lowering.

    Example: ramsight check my-machine.toml --unit boom
    """
    from ramsight.machine import load
    from ramsight.machine.tables import show
    from ramsight.plant.summary import machine_summary

    show(machine_summary(load(machine), unit))


def catalog_list(context: typer.Context) -> None:
    """List the oils, pumps, valves and machines that ramsight knows.

    A description takes a part from the catalogue by its name (model = "PGI100-2-008") and may override its
    values.

    Example: ramsight catalog
    """
    if context.invoked_subcommand is None:
        from ramsight.machine.tables import catalogue_list, show

        show(catalogue_list())


def catalog_show(
    name: Annotated[str, typer.Argument(help="A name that 'ramsight catalog' lists.")],
) -> None:
    """Show every value of a catalogue entry, what it means and where it comes from.

    The sources are marked: [P] the paper, [S: …] elsewhere, [M] remembered from a data sheet, [D] derived,
    [G] guessed.

    Example: ramsight catalog show PGI100-2-008
    """
    from ramsight.machine.tables import catalogue_entry, show

    show(catalogue_entry(name))


def new(
    file: Annotated[Path, typer.Argument(help="Where to write it, for example loader.toml.")],
    like: Annotated[str, typer.Option(help="The machine whose values stand in it.")] = "mining-loader",
    force: Annotated[bool, typer.Option("--force", help="Replace the file if it exists.")] = False,
) -> None:
    """Write a commented machine description to start from.

    It is complete and valid: every key with its unit, its meaning and its allowed range, and the values of an
    example. Replace them by those of your machine, then check the file.

    Example: ramsight new my-machine.toml
    """
    from ramsight.errors import OutputError
    from ramsight.machine import load, template
    from ramsight.output import atomic_path

    if file.exists() and not force:
        raise OutputError(f"{file}: exists already; --force replaces it")
    text = template(load(like), name=file.stem or "my-machine")
    with atomic_path(file) as draft:
        draft.write_text(text, encoding="utf-8")
    typer.echo(f"{file}: written; put your machine's values in, then: ramsight check {file}")
