"""Batch jobs: a warning is an error for whoever looks at the exit code alone."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import typer

from ramsight.cli.common import say_error

WARNED = 1
"""Exit code of a verb that did its work, with warnings, where none are allowed."""


@contextmanager
def strictly(*, is_strict: bool) -> Iterator[None]:
    """Count the warnings of logs meanwhile; at the end leave with `WARNED` if there were any and it is strict.

    Args:
        is_strict: whether warnings are errors.

    Raises:
        typer.Exit: there were warnings, and it is strict.
    """
    from ramsight.errors import LogWarning

    usual, said = warnings.showwarning, 0

    def show(message: Warning | str, category: type[Warning], *rest: Any, **more: Any) -> None:
        nonlocal said
        said += issubclass(category, LogWarning)
        usual(message, category, *rest, **more)

    warnings.showwarning = show
    try:
        yield
    finally:
        warnings.showwarning = usual
    if is_strict and said:
        what = "1 warning" if said == 1 else f"{said} warnings"
        say_error(f"{what}, and --strict takes a warning for an error; what was asked for is written")
        raise typer.Exit(WARNED)
