"""The verb that simulates a unit."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ramsight.cli.common import Machine, say_written


def simulate(
    machine: Machine,
    unit: Annotated[str, typer.Option(help="The unit that works, for example boom.")],
    load: Annotated[str, typer.Option(help="Constant load against lifting, at the rods.")],
    oil_temperature: Annotated[str, typer.Option(help="Oil temperature.")] = "40 degC",
    speed: Annotated[str, typer.Option(help="Motor speed of lifting and lowering.")] = "1500 rpm",
    ramp: Annotated[str, typer.Option(help="Time of each speed ramp.")] = "0.8 s",
    hold: Annotated[
        str | None,
        typer.Option(help="Time at full speed [default: up to 45 % of the stroke, at most 6.4 s]."),
    ] = None,
    start: Annotated[
        str | None,
        typer.Option(help="Piston position at first, 0 = retracted [default: a fifth of the stroke up]."),
    ] = None,
    cycles: Annotated[int, typer.Option(min=1, max=1000, help="How many lift-lower cycles.")] = 1,
    sample_period: Annotated[str, typer.Option(help="Distance of the samples.")] = "20 ms",
    out: Annotated[Path | None, typer.Option(help="All results: .nc, .csv or .csv.gz.")] = None,
    log: Annotated[Path | None, typer.Option(help="What a drive would log of it: .csv or .csv.gz.")] = None,
    truth: Annotated[Path | None, typer.Option(help="The true position over time: .csv or .csv.gz.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the log's noise.")] = 0,
) -> None:
    """Simulate lift-lower cycles of one unit.

    The motor rests, lifts at constant speed, rests and lowers, with the load on the rods all the time. Shows where
    the energy went, and how well the balances close; writes results, drive log and truth where you say.

    Example: ramsight simulate mining-loader --unit boom --load "441 kN" --oil-temperature "40 degC" --out boom.nc
    """
    from ramsight.api.simulating import lift_lower
    from ramsight.duty import DriveReport, report
    from ramsight.duty import simulate as run_unit
    from ramsight.duty.summary import run_summary
    from ramsight.logs import write_drive_log
    from ramsight.machine import load as load_machine
    from ramsight.output import check_apart, check_target, write_dataset, write_table
    from ramsight.plant.build import build
    from ramsight.progress import progress
    from ramsight.units import parse_option

    for path, suffixes in (
        (out, (".nc", ".csv", ".csv.gz")),
        (log, (".csv", ".csv.gz")),
        (truth, (".csv", ".csv.gz")),
    ):
        check_target(path, suffixes)
    check_apart({"the machine": machine}, {"--out": out, "--log": log, "--truth": truth})
    built = build(unit, load_machine(machine).unit(unit))
    duty = lift_lower(
        built,
        load,
        oil_temperature,
        speed=speed,
        ramp=ramp,
        hold=hold,
        start=start,
        cycles=cycles,
        named=lambda name: f"--{name.replace('_', '-')}",
    )
    period = parse_option(sample_period, "s", "--sample-period", least="0.1 ms", most="10 s")
    with progress(duty.duration, "simulating") as bar:
        run = run_unit(built, duty, sample_period=period, advance=bar.advance)
    if out is not None:
        write_dataset(run, out)
    if log is not None:
        write_drive_log(report(run, DriveReport(seed=seed)), log)
    if truth is not None:
        write_table({"time_s": run["time"].values, "position_m": run["position"].values}, truth)
    typer.echo(run_summary(run))
    say_written(out, log, truth)
