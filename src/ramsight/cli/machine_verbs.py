"""Verbs about descriptions of machines: check one, draw it, look into the catalogue, begin a new one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ramsight.cli.common import Machine, give, named_unit, report, say, say_lines, say_table, say_written

if TYPE_CHECKING:
    from ramsight.machine import Machine as MachineDescription


def check(
    machine: Machine,
    unit: Annotated[str | None, typer.Option(help="Show this unit only, for example boom.")] = None,
    figure: Annotated[
        Path | None, typer.Option(help="A picture of its pumps' measured efficiencies: .png, .svg or .pdf.")
    ] = None,
    channel_map: Annotated[
        Path | None, typer.Option("--map", help="Of an encoder: what of its bus tells that the drive's data are alive.")
    ] = None,
) -> None:
    """Check a machine description and show what follows from it.

    Says in one line what is wrong: file, key, value and allowed range. If nothing is, shows for each unit the
    areas and ratios, the travel per motor revolution, the load at relief pressure, for each named load
    the pressure and the motor torque while lifting and lowering, and which sensors, tests and exports it can have.
    With a channel map of CAN frames: which of sequence, noise, state word and heartbeat an encoder lacks on its bus.

    Example: ramsight check my-machine.toml --unit boom
    """
    from ramsight.api.abilities import abilities
    from ramsight.machine import load_machine
    from ramsight.machine.tables import rows_of
    from ramsight.optional import check_extra
    from ramsight.output import check_figure
    from ramsight.plant.machine_tables import machine_summary

    check_figure(figure)
    if channel_map is not None:
        check_extra("can")
    described = load_machine(machine)
    say_table(machine_summary(described, unit))
    names = list(described.units) if unit is None else [unit]
    give(machine=described.name, units={name: _figures(described, name) for name in names} if report().as_json else {})
    for name in names:
        say_lines(f"\nwhat {name} can have")
        say_table(rows_of((one.what, "yes" if one.can else "no", one.how) for one in abilities(described, unit=name)))
    if channel_map is not None:
        from ramsight.deploy.encoder.listening import witnesses
        from ramsight.logs.channel_map import load_map

        found = witnesses(load_map(channel_map))
        say_lines("\nwhat tells that the drive's data are alive")
        say_table(rows_of((name, "yes" if there else "no", how) for name, there, how in found))
    if figure is not None:
        from ramsight.calibration.pump_map_figure import pump_map_figure
        from ramsight.plant.build import build

        pump_map_figure(build(described, named_unit(machine, unit)), figure)
        say_written(figure)


def _figures(described: MachineDescription, name: str) -> dict[str, object]:
    from ramsight.api.abilities import abilities
    from ramsight.plant.machine_tables import unit_figures

    return {**unit_figures(described, name), "abilities": abilities(described, unit=name)}


def catalog_list(context: typer.Context) -> None:
    """List the oils, pumps, valves, machines and parts of test benches that ramsight knows.

    A description takes a part from the catalogue by its name (model = "PGI100-2-008") and may override its
    values.

    Example: ramsight catalog
    """
    if context.invoked_subcommand is None:
        from ramsight.machine.tables import catalogue_list

        say_table(catalogue_list())


def catalog_check() -> None:
    """Check the entries of one's own catalogue: unknown keys, values that cannot be, sources that are missing.

    One's own entries are TOML files in ~/.config/ramsight/catalog, or in the folder that RAMSIGHT_CATALOG or
    'ramsight --catalog DIR' names: kind, name, description, source and a table [values], as 'ramsight catalog show'
    lists them; or whole machines. Exit code 1 if one cannot be used.

    Example: ramsight --catalog parts catalog check
    """
    from ramsight.cli.common import say_cautions, say_error
    from ramsight.machine.catalogue import entries, own_folder
    from ramsight.machine.own_entries import check_own

    found = check_own()
    if not found:
        say(f"{own_folder()}: no entries of one's own")
    for one in found:
        for text in one.errors:
            say_error(text)
        say_cautions(f"{one.path}: {text}" for text in one.cautions)
        if not one.errors:
            say(f"{one.path}: {one.what} can be used")
    if any(one.errors for one in found):
        raise typer.Exit(1)
    entries()  # refuses a name that is there twice


def catalog_show(name: Annotated[str, typer.Argument(help="A name that 'ramsight catalog' lists.")]) -> None:
    """Show every value of a catalogue entry, what it means and where it comes from.

    The sources are marked: [P] the paper, [S: …] elsewhere, [M] remembered from a data sheet, [D] derived,
    [G] guessed.

    Example: ramsight catalog show PGI100-2-008
    """
    from ramsight.machine.tables import catalogue_entry

    say_table(catalogue_entry(name))


def new(
    file: Annotated[Path, typer.Argument(help="Where to write it, for example loader.toml.")],
    like: Annotated[
        str | None, typer.Option(help="The machine whose values stand in it [default: mining-loader].")
    ] = None,
    circuit: Annotated[
        str | None, typer.Option(help="One unit with this circuit: ddh, or one that 'ramsight catalog' lists.")
    ] = None,
    unit: Annotated[str | None, typer.Option(help="Its name, for example lift [default: as in the example].")] = None,
    minimal: Annotated[bool, typer.Option("--minimal", help="What is needed alone, without defaults.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace the file if it exists.")] = False,
) -> None:
    """Write a commented machine description to start from.

    It is complete and valid: every key with its unit, its meaning and its allowed range, and the values of an
    example; with --minimal what is needed alone. Replace the values by those of your machine, then check the file.

    Example: ramsight new my-machine.toml
    Example: ramsight new my-lift.toml --circuit ddh --unit lift --minimal
    """
    from ramsight.errors import DescriptionError, OutputError, one_line
    from ramsight.machine import load_machine, template
    from ramsight.machine.template_text import alone, example_of
    from ramsight.machine.template_text import minimal as minimal_text
    from ramsight.output import write_text

    if file.exists() and not force:
        raise OutputError(f"{file}: exists already; --force replaces it")
    if circuit is not None and like is not None:
        raise DescriptionError("give a circuit or a machine to be like, and not both", key="--circuit", value=circuit)
    if circuit is None and unit is not None:
        raise DescriptionError("names the unit of a circuit", key="--unit", value=unit, allowed="with --circuit")
    if circuit is not None:
        machine, of = example_of(circuit)
        machine = alone(machine, of, unit or of)
    else:
        machine = load_machine(like or "mining-loader")
    text = (minimal_text if minimal else template)(machine, name=one_line(file.stem) or "my-machine")
    write_text(text, file)
    say(f"{file}: written; put your machine's values in, then: ramsight check {file}")


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
    from ramsight.api.plotting import draw as draw_unit

    draw_unit(machine, out, unit=unit)
    say_written(out)


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
