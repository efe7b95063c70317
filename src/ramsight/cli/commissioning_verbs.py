"""The verb that judges a commissioning."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ramsight.cli.common import (
    ChannelMapFile,
    DriveLog,
    DrivenUnit,
    Machine,
    Requirement,
    named_unit,
    option,
    say_verdicts,
    say_written,
)


def commission(
    machine: Machine,
    log: DriveLog,
    unit: DrivenUnit = None,
    truth: Annotated[Path | None, typer.Option(help="Its measured position, if there is one: .csv or .csv.gz.")] = None,
    channel_map: ChannelMapFile = None,
    require: Requirement = None,
    out: Annotated[
        Path | None, typer.Option(help="The report to sign, one page that needs no other file: .html.")
    ] = None,
) -> None:
    """Judge the commissioning of a machine from the log of its drive.

    Looks, in this order, at the samples, at units and signs against what the machine can do, for a leak test and for
    visits to both end stops, at what the kalman sensor learned and how sure it is; and, where the position was measured
    (--truth), at its errors and at the data sheet against what is identified. Says of each check: passed, look twice
    (with what to do), failed. Where units or signs are wrong the rest is not judged. Exit code 1 if one failed. What
    the position is needed for (--require, or the unit's requirement) comes first: missed is failed.

    Rehearse it: ramsight simulate MACHINE --unit U --duty commissioning --log log.csv --truth position.csv

    Example: ramsight commission mining-loader log.csv --unit boom --truth position.csv --out report.html
    """
    unit = named_unit(machine, unit)
    from ramsight.api.commissioning import commission as commission_unit
    from ramsight.api.commissioning import report_of
    from ramsight.api.machines import load_machine
    from ramsight.logs.channel_map import load_map
    from ramsight.logs.mapped import standard_map
    from ramsight.output import atomic_path, check_apart, check_target
    from ramsight.study.commissioning.finding import Verdict

    check_target(out, (".html",))
    read: dict[str, str | Path | None] = {
        "the machine": machine,
        "the log": log,
        "--map": channel_map,
        "--truth": truth,
    }
    check_apart(read, {"--out": out})
    described = load_machine(machine)
    known = standard_map([]) if channel_map is None else load_map(channel_map)
    done = commission_unit(
        described, log, truth, unit=unit, channel_map=channel_map, require=require, progress=True, named=option
    )
    if out is not None:
        text = report_of(done, described, unit, log, truth, known)
        with atomic_path(out) as draft:
            draft.write_text(text, encoding="utf-8")
    say_verdicts(done.text)
    say_written(out)
    if done.verdict is Verdict.FAILED:
        raise typer.Exit(1)
