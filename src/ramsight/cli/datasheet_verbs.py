"""The verb that states what an axis will achieve."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ramsight.cli.common import Machine, Requirement, SensedUnit, named_unit, say, say_lines
from ramsight.cli.reporting import give, report


def datasheet(
    machine: Machine,
    out: Annotated[Path, typer.Option(help="Folder for the sheet and its runs; made if it is not there.")],
    unit: SensedUnit = None,
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
    require: Requirement = None,
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
    unit = named_unit(machine, unit)
    from contextlib import nullcontext

    from ramsight.api.studying import Study
    from ramsight.errors import DescriptionError
    from ramsight.output import check_folder
    from ramsight.study.datasheet.budget import check_base
    from ramsight.study.datasheet.cluster import cluster as cluster_at
    from ramsight.study.datasheet.sheet_files import FILES, write_sheet

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
    give(unit=unit, sheet=sheet.numbers, requirement=None if judged is None else judged.numbers)
    say_lines(sheet.text)
    if judged is not None:
        say_lines(judged.text)
    report().add("written", [str(out / name) for name in FILES])
    say(f"{out}: {', '.join(FILES[:-1])} and {FILES[-1]} written")
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
