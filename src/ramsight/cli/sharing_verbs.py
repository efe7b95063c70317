"""The verb that holds two units' logs of one machine against each other."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ramsight.cli.common import LOG


def logs_shared(
    first: Annotated[Path, typer.Argument(help=f"One drive's log: {LOG}.")],
    second: Annotated[Path, typer.Argument(help=f"The other drive's log: {LOG}.")],
    channel_map: Annotated[
        Path | None, typer.Option("--map", help="Which of the first log's channels are what: a TOML file.")
    ] = None,
    second_map: Annotated[
        Path | None, typer.Option("--second-map", help="The same of the second log; as --map without it.")
    ] = None,
) -> None:
    """Say whether the drives of two units of one machine agree on the oil and the voltage that they share.

    Both thermometers and both voltages of the DC link, as far as the logs have them; both logs have one clock. Which of
    two is wrong this cannot tell.

    Example: ramsight logs shared boom.csv bucket.csv
    """
    from ramsight.api.shared_reports import check_shared
    from ramsight.logs import read_log

    logs = [read_log(first, channel_map), read_log(second, second_map or channel_map)]
    typer.echo(check_shared(*logs).text)
