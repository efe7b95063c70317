"""Verbs that simulate: a unit at work, and machines drawn for its data sheet."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ramsight.cli import common

if TYPE_CHECKING:
    from ramsight.duty import DriveReport
    from ramsight.duty.recorded import Recorded

_TABLES = (".csv", ".csv.gz")


def simulate(
    machine: common.Machine,
    unit: common.DrivenUnit = None,
    load: Annotated[
        list[str] | None,
        typer.Option(
            help="Load against lifting, at the rods, or the description's name of one; may be repeated; lift-lower "
            "needs one [default of work-day, leak-test and commissioning: 0.2, 0.4, 0.6 of relief]."
        ),
    ] = None,
    duty: Annotated[
        str,
        typer.Option(
            help="lift-lower, work-day, loader-boom, loader-bucket, leak-test, commissioning, or a table: time_s, "
            "motor_speed_rpm, load_kn."
        ),
    ] = "lift-lower",
    oil_temperature: Annotated[str, typer.Option(help="Oil temperature.")] = "40 degC",
    ambient: Annotated[
        str | None,
        typer.Option(
            help="Temperature of the air: the oil begins at its temperature, and what is lost in it warms it, cases of "
            "the pumps and tank apart, as the description's [heat] says [default: it keeps its temperature]."
        ),
    ] = None,
    speed: Annotated[str | None, typer.Option(help="Motor speed of lifting and lowering [default: 1500 rpm].")] = None,
    ramp: Annotated[str | None, typer.Option(help="Time of each speed ramp of lift-lower [default: 0.8 s].")] = None,
    hold: Annotated[
        str | None,
        typer.Option(help="Time at full speed of lift-lower [default: up to 45 % of the stroke, at most 6.4 s]."),
    ] = None,
    start: Annotated[
        str | None, typer.Option(help="Piston position at first, 0 = retracted [default: near the lowered end].")
    ] = None,
    cycles: Annotated[int | None, typer.Option(help="How many lift-lower cycles under each load [default: 1].")] = None,
    visits: Annotated[int | None, typer.Option(help="End stops visited before lift-lower [default: 0].")] = None,
    duration: Annotated[str | None, typer.Option(help="Length of the work day [default: 6 min].")] = None,
    leak: Annotated[
        float, typer.Option(min=0.1, max=10.0, help="The real pumps' leakage over the data sheet's.")
    ] = 1.0,
    displacement: Annotated[float, typer.Option(min=0.5, max=2.0, help="Their displacement over it.")] = 1.0,
    stiffness: Annotated[float, typer.Option(min=0.1, max=10.0, help="Of oil and hoses, over it.")] = 1.0,
    friction: Annotated[float, typer.Option(min=0.0, max=10.0, help="Of the cylinder, over it.")] = 1.0,
    relief: Annotated[float, typer.Option(min=0.5, max=1.5, help="Settings of the relief valves, over it.")] = 1.0,
    torque_gain: Annotated[
        float, typer.Option(min=0.1, max=10.0, help="Torque that the drive reports over the true one.")
    ] = 1.0,
    temperature_offset: Annotated[float, typer.Option(help="By how many K the thermometer reads too much.")] = 0.0,
    speed_step: Annotated[str, typer.Option(help="In which the drive reports speed.")] = "1 rpm",
    torque_step: Annotated[
        str | None,
        typer.Option(help="In which the drive reports torque [default: 0.0625 N m, less for a small drive]."),
    ] = None,
    torque_noise: Annotated[
        str | None,
        typer.Option(
            help="Of the reported torque, standard deviation [default: 0.5 N m, or what the description assumes if "
            "that is less]."
        ),
    ] = None,
    sample_period: Annotated[str, typer.Option(help="Distance of the samples.")] = "20 ms",
    out: Annotated[Path | None, typer.Option(help="All results: .nc, .csv or .csv.gz.")] = None,
    log: Annotated[Path | None, typer.Option(help="What a drive would log of it: .csv or .csv.gz.")] = None,
    truth: Annotated[Path | None, typer.Option(help="The true position over time: .csv or .csv.gz.")] = None,
    figure: Annotated[Path | None, typer.Option(help="A picture of it: .png, .svg or .pdf.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the log's noise, and of a work day or loader work.")] = 0,
) -> None:
    """Simulate a unit at work, and what its drive would log: a rehearsal on one's own machine.

    lift-lower: the motor rests, lifts at constant speed, rests and lowers. work-day: moves and loads at random, and end
    stops now and then. loader-boom, loader-bucket: a wheel loader's work, with digging loads; the boom meets no end
    stop. leak-test: slow turning for 'ramsight leak-test'. commissioning: leak test, end stops, and loads
    lifted and lowered, for 'ramsight identify'. The machine may differ from its data sheet (--leak 1.2), and its
    drive be off (--torque-gain 1.03): what --log writes goes to leak-test, identify and track as a real log does.

    Shows where the energy went, and how well the balances close; writes results, drive log and truth where you say.

    Example: ramsight simulate mining-loader --unit boom --load "441 kN" --oil-temperature "40 degC" --out boom.nc
    Example: ramsight simulate mining-loader --unit boom --duty commissioning --leak 1.2 --log log.csv --truth truth.csv
    """
    unit = common.named_unit(machine, unit)
    from ramsight.api.duties import SEEDED, duty_for, named_loads, with_names
    from ramsight.api.simulating import recorded, reported_how
    from ramsight.duty.run_figures import run_cautions, run_numbers, run_summary
    from ramsight.machine import load_machine
    from ramsight.plant.as_built import AsBuilt
    from ramsight.plant.build import build
    from ramsight.plant.steady import derive

    table = duty if duty.endswith(_TABLES) else None
    _check_files({"the machine": machine, "--duty": table}, out, log, truth, figure)
    described = load_machine(machine)
    built = build(described, unit)
    made = AsBuilt(leak, displacement, stiffness, friction, relief).apply(built)
    work = duty_for(
        made,
        duty,
        load=with_names(load, named_loads(described, unit)) if load else None,
        oil_temperature=oil_temperature,
        speed=speed,
        ramp=ramp,
        hold=hold,
        start=start,
        cycles=cycles,
        visits=visits,
        duration=duration,
        seed=seed if duty in SEEDED else None,
    )
    passed: dict[str, float | str | None] = {
        "speed_step": speed_step, "torque_step": torque_step, "torque_noise": torque_noise,
        "torque_gain": torque_gain, "temperature_offset": temperature_offset,
    }  # fmt: skip
    how = reported_how(passed, built, seed=seed)
    run = recorded(made, work, ambient=ambient, sample_period=sample_period, progress=True)
    _write(run, how, out, log, truth, figure)
    common.give(unit=unit, **run_numbers(run))
    common.say_lines(run_summary(run))
    common.say_cautions(run_cautions(run, described.unit(unit).drive.max_torque, derive(built).load_at_relief))
    common.say_written(out, log, truth, figure)


def _check_files(
    read: dict[str, str | Path | None], out: Path | None, log: Path | None, truth: Path | None, figure: Path | None
) -> None:
    """Reject what cannot be written, or would be written over what is read, before any work is done."""
    from ramsight.output import check_apart, check_figure, check_installed, check_target

    check_target(out, (".nc", *_TABLES))
    if out is not None:
        check_installed(out)
    check_target(log, _TABLES)
    check_target(truth, _TABLES)
    check_figure(figure)
    check_apart(read, {"--out": out, "--log": log, "--truth": truth, "--figure": figure})


def _write(
    run: Recorded, how: DriveReport, out: Path | None, log: Path | None, truth: Path | None, figure: Path | None
) -> None:
    """Write what was asked for of a run and of its drive's report."""
    from ramsight.output import column_name, write_dataset, write_table

    if out is not None and str(out).endswith(_TABLES):
        write_table({column_name(name, one.units): one.values for name, one in run.signals.items()}, out)
    elif out is not None:
        write_dataset(run.dataset(), out)
    if log is not None:
        from ramsight.duty.drive_report import reported
        from ramsight.logs import write_log

        write_log(reported(run.columns(), how), log)
    if truth is not None:
        write_table({"time_s": run["time"].values, "position_m": run["position"].values}, truth)
    if figure is not None:
        from ramsight.tracking.figures import run_figure

        run_figure(run.columns(), figure)


def datasheet(
    machine: common.Machine,
    out: Annotated[Path, typer.Option(help="Folder for the sheet and its runs; made if it is not there.")],
    unit: common.SensedUnit = None,
    duty: Annotated[
        str,
        typer.Option(
            help="work-day, loader-boom, loader-bucket, lift-lower, commissioning, or a table: time_s, "
            "motor_speed_rpm, load_kn."
        ),
    ] = "work-day",
    machines: Annotated[
        int, typer.Option(min=1, help="How many machines are drawn; more extend a finished study.")
    ] = 1000,
    sensor: Annotated[str, typer.Option(help="kalman, balance, table, or a sensor file.")] = "kalman",
    vary: Annotated[
        list[str] | None,
        typer.Option(help="A tolerance, 'torque_gain=± 3 %', in the place of the described one; may be repeated."),
    ] = None,
    budget: Annotated[
        int, typer.Option(min=0, help="Base points of Sobol's indices, a power of two; 0 for the linear budget alone.")
    ] = 0,
    cluster: Annotated[
        str | None, typer.Option(help="Where it runs: local, or the address of a Dask scheduler [default: here].")
    ] = None,
    log: Annotated[
        list[Path] | None, typer.Option(help="A recorded drive log to hold against the sheet; may be repeated.")
    ] = None,
    truth: Annotated[
        list[Path] | None, typer.Option(help="The true position of each such log, in the same order.")
    ] = None,
    duration: Annotated[str, typer.Option(help="Length of a work day.")] = "6 min",
    visit_every: Annotated[
        str | None,
        typer.Option(help="Time between visits to an end stop, of a work day [default: as required, or 45 s]."),
    ] = None,
    require: common.Requirement = None,
    method: Annotated[str, typer.Option(help="Design of the study: sobol or latin-hypercube.")] = "sobol",
    seed: Annotated[int, typer.Option(min=0, help="Seed of machines, duties and noise.")] = 0,
) -> None:
    """Say what the sensor will achieve on an axis: its data sheet and error budget.

    Machines are drawn from the tolerances of the description (what it does not say has a default, marked as such),
    simulated, reported by a drive and tracked. The sheet states how accurate the sensor is before and after references,
    in the terms of IEC 61298-2, what it says of itself, and which tolerance costs how much.

    Writes sheet.html, sheet.json and assumed.toml. The runs are in Zarr stores beside them: a study that was stopped
    goes on where it was, and one with more machines is extended. Exit code 1 if a requirement is missed.

    Example: ramsight datasheet mining-loader --unit boom --machines 1000 --out sheet
    """
    unit = common.named_unit(machine, unit)
    from contextlib import nullcontext

    from ramsight.api.studying import Study
    from ramsight.errors import DescriptionError
    from ramsight.output import check_folder
    from ramsight.study.datasheet.budget import check_base
    from ramsight.study.datasheet.cluster import cluster as cluster_at
    from ramsight.study.datasheet.sheet_page import FILES, write_sheet

    logs, truths = log or [], truth or []
    if len(logs) != len(truths):
        raise DescriptionError(
            "needs one --truth for each --log", key="--log", value=len(logs), allowed=str(len(truths))
        )
    check_folder(out)
    study = Study(
        machine, duty, sensor, unit=unit, vary=_tolerances(vary or []), machines=machines, seed=seed, method=method,
        duration=duration, visit_every=visit_every, require=require,
    )  # fmt: skip
    check_base(budget)
    out.mkdir(exist_ok=True)
    with cluster_at(cluster) if cluster is not None else nullcontext() as client:
        found = study.run(out / "machines.zarr", client, progress=True)
        split = study.budget(budget, out / "budget.zarr", client, progress=True)
    sheet = study.datasheet(found, split, list(zip(logs, truths, strict=True)))
    title = f"{study.machine.title or study.machine.name}, unit {unit}"
    judged = study.required(sheet)
    write_sheet(sheet, found, out, title, judged)
    common.give(unit=unit, sheet=sheet.numbers, requirement=None if judged is None else judged.numbers)
    common.say_lines(sheet.text)
    if judged is not None:
        common.say_lines(judged.text)
    common.report().add("written", [str(out / name) for name in FILES])
    common.say(f"{out}: {', '.join(FILES[:-1])} and {FILES[-1]} written")
    if judged is not None and not judged.is_met:
        raise typer.Exit(1)


def _tolerances(passed: list[str]) -> dict[str, str]:
    """Tolerances passed as ``name=text``."""
    from ramsight.errors import DescriptionError

    found = {}
    for one in passed:
        name, equals, text = one.partition("=")
        if not equals:
            raise DescriptionError("is no tolerance of a quantity", key="--vary", value=one, allowed="'leakage=± 10 %'")
        found[name.strip()] = text.strip()
    return found
