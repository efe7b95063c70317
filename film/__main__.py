"""A loader at work as a film: `python -m film --out build/film`, or `make film`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from film.loading_cycle import Options, work
from film.report import summary, write_work
from ramsight import RamsightError, load_machine
from ramsight.output import check_folder
from ramsight.plant.linked import build_linked
from ramsight.progress import progress
from ramsight.units import format_si, parse_option

app = typer.Typer(rich_markup_mode=None, pretty_exceptions_enable=False)


@app.command()
def film(
    out: Annotated[Path, typer.Option(help="Directory for the results; made if it is not there.")],
    machine: Annotated[str, typer.Argument(help="A description file, or a catalogue name.")] = "mining-loader",
    payload: Annotated[str | None, typer.Option(help="In the full bucket [default: the rated one].")] = None,
    oil_temperature: Annotated[str, typer.Option(help="Oil temperature of both units.")] = "40 degC",
    leak: Annotated[float, typer.Option(help="Leakage of the real pumps over their data sheet's: 1.2.")] = 1.0,
    temperature_offset: Annotated[float, typer.Option(help="By how many K the thermometers read too much.")] = 0.0,
    references: Annotated[
        int, typer.Option(min=1, max=9, help="Visits of each unit to an end stop before it works; three teach it.")
    ] = 1,
    drive_delay: Annotated[
        str, typer.Option(help="By which the drives are late, with commands and with reports each; '0 ms': not at all.")
    ] = "40 ms",
    seed: Annotated[int, typer.Option(min=0, help="Seed of the drives' noise.")] = 0,
) -> None:
    """Let a loader work without position sensors, and show how well it goes.

    Boom and bucket visit an end stop to find where they are, then dig, lift, dump and return; every move goes to a
    position, and the virtual sensors are the only feedback of the controls. They assume the data sheet: give the real
    machine another leakage, or a thermometer that reads too much, and see what it costs, and what more references mend.

    Writes loader.html (open it and drag through the run; dashed is what the sensors estimate), loader.gif, control.png
    and control.svg (targets, errors with the sensors' 95 % bands, motor speeds, torques), and results.json in SI units.
    """
    check_folder(out)
    description = load_machine(machine)
    built = build_linked(description)
    lowest, highest = (
        format_si(edge(unit.oil.temperatures[k] for unit in built.units), "degC") for k, edge in enumerate((max, min))
    )
    options = Options(
        payload=None if payload is None else parse_option(payload, "kg", "--payload", least="0 kg", most="1000 t"),
        oil_temperature=parse_option(oil_temperature, "K", "--oil-temperature", least=lowest, most=highest),
        leak=parse_option(str(leak), "1", "--leak", least="0.1", most="10"),
        temperature_offset=temperature_offset,
        references=references,
        seed=seed,
        delay=parse_option(drive_delay, "s", "--drive-delay", least="0 s", most="0.5 s"),
    )
    with progress(2.0, "working") as bar:
        done = work(built, options, advance=bar.advance)
        title = f"{description.title or description.name}: sensorless position control, {options.late}"
        write_work(done, options, out, title=title, advance=bar.advance)
    typer.echo(summary(done))
    typer.echo(f"{out}: loader.html, loader.gif, control.png, control.svg and results.json written")


if __name__ == "__main__":
    try:
        app()
    except RamsightError as error:
        sys.exit(f"error: {error}")
