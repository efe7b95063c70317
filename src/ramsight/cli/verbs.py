"""All verbs and their names, in the sections in which the help lists them, and how the command line runs them."""

from __future__ import annotations

import gc
import inspect
import os
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from io import TextIOWrapper
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from ramsight.cli import (
    bus_verbs,
    calibration_verbs,
    comparing_verbs,
    exporting_verbs,
    history_verbs,
    machine_verbs,
    simulation_verbs,
    tracking_verbs,
    weighing_verbs,
)
from ramsight.cli.common import group, say, say_error, scripted
from ramsight.errors import DescriptionError, printable


class Verb(TyperCommand):
    """A verb whose errors name ``--oil-temperature`` where the function below it named ``oil_temperature``."""

    def invoke(self, ctx: Any) -> Any:  # noqa: D102 - as in Click
        try:
            return super().invoke(ctx)
        except DescriptionError as error:
            found = self._of_option(error)
            if found is error:
                raise
            raise found from None

    def _of_option(self, error: DescriptionError) -> DescriptionError:
        """The same error with the option's name; what stands in a file keeps its key."""
        names = {one.name: one.opts[0] for one in self.params if one.opts[0].startswith("--")}
        if error.file is not None or error.key not in names:
            return error
        found = type(error)(error.message, key=names[error.key], value=error.value, allowed=error.allowed)
        found.others = error.others
        return found


class Sectioned(TyperGroup):
    """The verbs in sections, by what they are for; what it refuses of a command line is escaped when it is repeated."""

    def make_context(self, *words: Any, **more: Any) -> Any:  # noqa: D102 - as in Click
        with _escaped():
            return super().make_context(*words, **more)

    def invoke(self, ctx: Any) -> Any:  # noqa: D102 - as in Click
        with _escaped():
            return super().invoke(ctx)

    def format_commands(self, ctx: Any, formatter: Any) -> None:  # noqa: D102 - as in Click
        sections = {title: [verb_name(verb) for verb in verbs] for title, verbs in SECTIONS.items()}
        for name, title in GROUPS.items():
            sections[title].append(name)
        limit = formatter.width - 6 - max(map(len, self.commands))
        for title, names in sections.items():
            with formatter.section(title):
                formatter.write_dl([(name, self.commands[name].get_short_help_str(limit)) for name in names])


_Usage: Any = typer.BadParameter.__bases__[0]
"""Every mistake on a command line; Typer has a Click of its own and offers this one kind of it."""


@contextmanager
def _escaped() -> Iterator[None]:
    """Names of files are words of a command line, too."""
    try:
        yield
    except _Usage as error:
        error.message = printable(error.message)
        raise


app = group(name="ramsight", cls=Sectioned, no_args_is_help=True, pretty_exceptions_enable=False)


def offer(to: typer.Typer, verb: Callable[..., Any], name: str | None = None, *, alone: bool = False) -> None:
    """Offer a verb with its docstring as help, in which each example has a line of its own that can be copied.

    Args:
        name: what it is called there; by default as the function, with hyphens.
    """
    # \b makes Click leave the lines of a paragraph as they are.
    text = re.sub(r"((?:^Example: .*\n*)+)\Z", _examples, inspect.getdoc(verb) or "", flags=re.MULTILINE)
    if alone:
        to.callback(help=text)(verb)
    else:
        called = name or verb_name(verb)
        formatted = f"{to.info.name}-{called}" if to is not app else called
        to.command(called, cls=Verb, help=text)(scripted(verb, formatted, has_figures=verb in FIGURES))


def verb_name(verb: Callable[..., Any]) -> str:
    """What a verb is called on the command line, ``leak-test`` of `leak_test`."""
    return verb.__name__.replace("_", "-")


def _examples(found: re.Match[str]) -> str:
    lines = [line.removeprefix("Example: ") for line in found[0].splitlines() if line]
    return "\n".join(["\b", f"Example{'s' * (len(lines) > 1)}:", *(f"  {line}" for line in lines)])


def _version(wanted: bool) -> None:
    if wanted:
        from ramsight._version import __version__

        say(f"ramsight {__version__}")
        raise typer.Exit


@app.callback()
def ramsight(
    version: Annotated[
        bool, typer.Option("--version", "-V", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
    own: Annotated[
        str | None, typer.Option("--catalog", help="Folder of your own parts [default: $RAMSIGHT_CATALOG].")
    ] = None,
) -> None:
    """Where the piston of a hydraulic cylinder is, without a position sensor.

    A machine is a TOML file or a name in the catalogue. Begin with: ramsight demo
    """
    if own is not None:
        from ramsight.machine.catalogue import VARIABLE

        os.environ[VARIABLE] = own


SECTIONS: dict[str, tuple[Callable[..., Any], ...]] = {
    "Describe": (machine_verbs.new, machine_verbs.check, machine_verbs.draw),
    "Simulate and study": (simulation_verbs.simulate, simulation_verbs.datasheet),
    "Follow a log": (tracking_verbs.track, comparing_verbs.compare, weighing_verbs.weigh),
    "Calibrate and commission": (
        calibration_verbs.leak_test,
        calibration_verbs.identify,
        calibration_verbs.calibrate,
        calibration_verbs.commission,
    ),
    "Deploy": (bus_verbs.encoder, exporting_verbs.fmeda),
    "Look on": (machine_verbs.demo, machine_verbs.studio),
}
"""Verbs by what they are for, as the help lists them; groups of verbs join theirs in `GROUPS`."""
FIGURES = (
    machine_verbs.check,
    simulation_verbs.simulate,
    simulation_verbs.datasheet,
    tracking_verbs.track,
    tracking_verbs.logs_inspect,
    comparing_verbs.compare,
    weighing_verbs.weigh,
    calibration_verbs.leak_test,
    calibration_verbs.identify,
    calibration_verbs.commission,
    history_verbs.history_add,
    history_verbs.history_show,
)
"""Verbs with ``--json``: what they say are figures (docs/reference/scripts.md)."""
GROUPS = {"catalog": "Describe", "logs": "Follow a log", "history": "Calibrate and commission", "export": "Deploy"}

for verbs in SECTIONS.values():
    for verb in verbs:
        offer(app, verb)

catalog = group(name="catalog", invoke_without_command=True)
offer(catalog, machine_verbs.catalog_list, alone=True)
offer(catalog, machine_verbs.catalog_show, "show")
offer(catalog, machine_verbs.catalog_check, "check")
app.add_typer(catalog, name="catalog")

logs = group(name="logs", no_args_is_help=True, help="Look into drive logs, and send them.")
offer(logs, tracking_verbs.logs_inspect, "inspect")
offer(logs, comparing_verbs.logs_shared, "shared")
offer(logs, bus_verbs.logs_replay, "replay")
app.add_typer(logs, name="logs")

history = group(name="history", no_args_is_help=True, help="How a machine changes over months, and a fleet of them.")
offer(history, history_verbs.history_add, "add")
offer(history, history_verbs.history_event, "event")
offer(history, history_verbs.history_show, "show")
offer(history, history_verbs.history_plot, "plot")
offer(history, history_verbs.history_report, "report")
offer(history, history_verbs.history_export, "export")
app.add_typer(history, name="history")

export = group(name="export", no_args_is_help=True, help="Into a control unit, a simulator and a browser.")
offer(export, exporting_verbs.export_c, "c")
offer(export, exporting_verbs.export_wasm, "wasm")
offer(export, exporting_verbs.export_page, "page")
offer(export, exporting_verbs.export_fmu, "fmu")
offer(export, exporting_verbs.export_ssp, "ssp")
offer(export, exporting_verbs.export_parameters, "parameters")
offer(export, exporting_verbs.export_fmeda, "fmeda")
app.add_typer(export, name="export")


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
