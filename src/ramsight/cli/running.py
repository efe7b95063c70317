"""Running the command line: what a user can mend is a line each on standard error, and exit code 2."""

from __future__ import annotations

import gc
import os
import sys
from contextlib import nullcontext
from io import TextIOWrapper
from typing import Any

from ramsight.cli.common import say_error
from ramsight.cli.verbs import app


def main() -> None:
    """Run the command line: a line on standard error for each thing that a user can mend, and exit code 2."""
    from ramsight.errors import RamsightError
    from ramsight.progress import spoken

    _say_warnings()
    if isinstance(sys.stdout, TextIOWrapper):  # ± and µ on a terminal that has ASCII alone
        sys.stdout.reconfigure(errors="backslashreplace")
    # Graphs are many objects and no circles: to look for some takes a tenth of the time.
    gc.set_threshold(50_000, 20, 20)
    _without_other_arrays()
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # to look for some reads all that is installed
    try:
        with nullcontext() if _SERVING & set(sys.argv[1:3]) else spoken(" ".join(["ramsight", *sys.argv[1:2]])):
            app()
    except RamsightError as error:
        for one in (error, *error.others):
            say_error(one)
        sys.exit(2)
    except OSError as error:
        say_error(f"{_cause(error)}{error.strerror or error}")
        sys.exit(2)


_SERVING = {"encoder", "replay", "studio"}
"""Verbs that run until they are stopped."""


OTHER_ARRAYS = ("dask", "pint")


def _without_other_arrays() -> None:
    """Where these are installed xarray loads them, half a second, to ask each array whether it is one of theirs.

    No verb has such arrays. Dask itself is needed by who asks for its workers. An xarray that is there already may have
    found them, and would look for them in vain.
    """
    if "xarray" not in sys.modules and not any(word.startswith("--cluster") for word in sys.argv):
        for name in OTHER_ARRAYS:
            sys.modules.setdefault(name, None)  # type: ignore[arg-type]


def _say_warnings() -> None:
    """Warnings about logs are a line on standard error each; what other libraries log is not shown."""
    import logging
    import warnings

    from ramsight.engine.private_folder import FolderWarning
    from ramsight.errors import LogWarning

    shown = (LogWarning, FolderWarning)
    logging.getLogger().addHandler(logging.NullHandler())
    usual = warnings.showwarning

    def show(message: Warning | str, category: type[Warning], *rest: Any, **more: Any) -> None:
        if issubclass(category, shown):
            say_error(message, "warning")
        else:
            usual(message, category, *rest, **more)

    warnings.showwarning = show
    for kind in shown:
        warnings.simplefilter("always", kind)


def _cause(error: OSError) -> str:
    """What could not be read or written: a file, or standard output if that is full or gone."""
    if error.filename is not None:
        return f"{os.fsdecode(error.filename)}: "
    frame = error.__traceback__
    while frame is not None and frame.tb_next is not None:
        frame = frame.tb_next
    module = "" if frame is None else str(frame.tb_frame.f_globals.get("__name__", ""))
    if module.partition(".")[0] not in ("click", "rich", "typer"):
        return ""
    sys.stdout = open(os.devnull, "w")  # noqa: SIM115 - for the interpreter's last flush
    return "standard output: "
