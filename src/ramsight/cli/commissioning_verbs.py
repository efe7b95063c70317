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
    say_verdicts,
    say_written,
)
from ramsight.cli.reporting import give


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
    since: Annotated[
        Path | None, typer.Option(help="What an earlier commissioning kept: it begins there, and says what changed.")
    ] = None,
    keep: Annotated[Path | None, typer.Option(help="Where what is found is kept for a later --since: .json.")] = None,
    tuned: Annotated[
        Path | None,
        typer.Option(help="The description of the machine as it was found; its sensor begins there: .toml."),
    ] = None,
) -> None:
    """Judge the commissioning of a machine from the log of its drive.

    Looks, in this order, at the samples, at units and signs against what the machine can do, for a leak test and for
    visits to both end stops, at what the kalman sensor learned and how sure it is; and, where the position was measured
    (--truth), at its errors and at the data sheet against what is identified. Says of each check: passed, look twice
    (with what to do), failed. Where units or signs are wrong the rest is not judged. Exit code 1 if one failed. What
    the position is needed for (--require, or the unit's requirement) comes first: missed is failed.

    Rehearse it: ramsight simulate MACHINE --unit U --duty commissioning --log log.csv --truth position.csv

    The description that --tuned writes has the values that were found: identified where the position was measured, else
    as the sensor has learned them and as the leak test says. How well each is known is what its sensor assumes.

    Example: ramsight commission mining-loader log.csv --unit boom --truth position.csv --out report.html

    Example: ramsight commission mining-loader log.csv --unit boom --tuned boom.toml
    """
    unit = named_unit(machine, unit)
    from ramsight.api.commissioning import commission as commission_unit
    from ramsight.api.commissioning import report_of
    from ramsight.logs.channel_map import load_map
    from ramsight.logs.mapped import standard_map
    from ramsight.machine import load_machine
    from ramsight.optional import check_extra
    from ramsight.output import check_apart, check_target, write_text
    from ramsight.study.commissioning.finding import Verdict

    check_target(out, (".html",))
    check_extra("identify", *(["figures"] if out is not None else []))  # the report has a figure
    check_target(keep, (".json",))
    check_target(tuned, (".toml",))
    read: dict[str, str | Path | None] = {
        "the machine": machine, "the log": log, "--map": channel_map, "--truth": truth, "--since": since,
    }  # fmt: skip
    check_apart(read, {"--out": out, "--keep": keep, "--tuned": tuned})
    described = load_machine(machine)
    known = standard_map([]) if channel_map is None else load_map(channel_map)
    done = commission_unit(
        described, log, truth, unit=unit, channel_map=channel_map, require=require, since=since, keep=keep,
        tuned=tuned, progress=True,
    )  # fmt: skip
    if out is not None:
        text = report_of(done, described, unit, log, truth, known, since)
        write_text(text, out)
    give(verdict=done.verdict, commissioning=done)
    say_verdicts(done.text)
    say_written(out, *(() if done.verdict is Verdict.FAILED else (keep, tuned)))
    if done.verdict is Verdict.FAILED:
        raise typer.Exit(1)
