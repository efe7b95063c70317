"""Verbs that study the sensor: the paper redone, a loader at work."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ramsight.cli.common import Machine


def paper(
    out: Annotated[Path, typer.Option(help="Directory for the report; made if it is not there.")],
    machine: Machine = "mining-loader",
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

    Example: ramsight paper --out paper --ramp "0.6 s" --set boom.pump_a.volumetric_efficiency=0.92
    """
    from ramsight.errors import DescriptionError
    from ramsight.optional import check_extra
    from ramsight.output import check_folder
    from ramsight.progress import progress
    from ramsight.reproduction import STEPS, Choices, reproduce, write_report
    from ramsight.reproduction.choices import READINGS, read_values
    from ramsight.units import parse_option

    check_extra("datasets", "figures")
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


def loader(
    out: Annotated[Path, typer.Option(help="Directory for the results; made if it is not there.")],
    machine: Machine = "mining-loader",
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
    position, and what the virtual sensors make of motor speed, torque and oil temperature is all that the controls
    know. The sensors assume the data sheet: give the real machine another leakage, or a thermometer that reads too
    much, and see what it costs, and what more references mend. Their drives are late, as real ones are, and the
    controls know by how much.

    Writes loader.html (open it and drag through the run; dashed is what the sensors estimate), loader.gif, control.png
    and control.svg (targets, errors with the sensors' 95 % bands, motor speeds, torques), and results.json in SI units.

    Example: ramsight loader --out loader --leak 1.2 --temperature-offset 3 --references 3
    Example: ramsight loader --out late --drive-delay "100 ms"
    """
    from ramsight.machine import load_machine
    from ramsight.optional import check_extra
    from ramsight.output import check_folder
    from ramsight.plant.linked import build_linked
    from ramsight.progress import progress
    from ramsight.showcase.loader.loading_cycle import Options, work
    from ramsight.showcase.loader.report import summary, write_work
    from ramsight.units import format_si, parse_option

    check_extra("datasets", "figures")
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
