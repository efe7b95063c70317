"""What a person does next with a file that cannot be read as it is: the command, whole."""

from __future__ import annotations

import shlex


def inspect_command(file: str) -> str:
    """The command that looks into a log and writes a first channel map for it.

    Example:
        >>> inspect_command("my day.csv")
        "ramsight logs inspect 'my day.csv' --out map.toml"
    """
    return f"ramsight logs inspect {shlex.quote(file)} --out map.toml"
