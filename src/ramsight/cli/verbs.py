"""All verbs and their names, in the sections in which the help lists them, and how the command line runs them."""

from __future__ import annotations

import gc
import inspect
import os
import re
import sys
from collections import UserDict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from importlib import import_module
from io import TextIOWrapper
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from ramsight.cli.common import group, say, say_error, scripted
from ramsight.errors import DescriptionError, printable


@dataclass(frozen=True)
class Group:
    """Verbs under one word.

    Attributes:
        verbs: the module of each, by its name.
        help: what they are for.
        alone: the module of what the word does by itself, `catalog_list` of ``catalog``; empty where it needs a verb.
    """

    verbs: Mapping[str, str]
    help: str = ""
    alone: str = ""


SECTIONS: dict[str, dict[str, str]] = {
    "Describe": dict.fromkeys(("new", "check", "draw"), "machine_verbs"),
    "Simulate and study": dict.fromkeys(("simulate", "datasheet"), "simulation_verbs"),
    "Follow a log": {"track": "tracking_verbs", "compare": "comparing_verbs", "weigh": "weighing_verbs"},
    "Calibrate and commission": dict.fromkeys(
        ("leak-test", "identify", "calibrate", "commission"), "calibration_verbs"
    ),
    "Deploy": {"encoder": "bus_verbs", "fmeda": "exporting_verbs"},
    "Look on": dict.fromkeys(("demo", "studio"), "machine_verbs"),
}
"""The module of each verb by what it is for, as the help lists them; groups of verbs join theirs in `GROUPS`.

A verb's function has its name: `leak_test` of ``leak-test``, `logs_inspect` of ``logs inspect``.
"""
GROUPS: dict[str, tuple[str, Group]] = {
    "catalog": ("Describe", Group(dict.fromkeys(("show", "check"), "machine_verbs"), alone="machine_verbs")),
    "logs": (
        "Follow a log",
        Group(
            {"inspect": "tracking_verbs", "shared": "comparing_verbs", "replay": "bus_verbs"},
            "Look into drive logs, and send them.",
        ),
    ),
    "history": (
        "Calibrate and commission",
        Group(
            dict.fromkeys(("add", "event", "show", "plot", "report", "export"), "history_verbs"),
            "How a machine changes over months, and a fleet of them.",
        ),
    ),
    "export": (
        "Deploy",
        Group(
            dict.fromkeys(("c", "wasm", "page", "fmu", "ssp", "parameters", "fmeda"), "exporting_verbs"),
            "Into a control unit, a simulator and a browser.",
        ),
    ),
}
FIGURES = {
    "check", "simulate", "datasheet", "track", "compare", "weigh", "leak-test", "identify", "commission",
    "logs-inspect", "history-add", "history-show",
}  # fmt: skip
"""Verbs with ``--json``: what they say are figures (docs/reference/scripts.md)."""


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

    def __init__(self, **more: Any) -> None:
        super().__init__(**more)
        alone = {name: home for homes in SECTIONS.values() for name, home in homes.items()}
        self.commands: Any = Offered({**alone, **{name: one for name, (_, one) in GROUPS.items()}})

    def make_context(self, *words: Any, **more: Any) -> Any:  # noqa: D102 - as in Click
        with _escaped():
            return super().make_context(*words, **more)

    def invoke(self, ctx: Any) -> Any:  # noqa: D102 - as in Click
        with _escaped():
            return super().invoke(ctx)

    def format_commands(self, ctx: Any, formatter: Any) -> None:  # noqa: D102 - as in Click
        sections = {title: list(homes) for title, homes in SECTIONS.items()}
        for name, (title, _) in GROUPS.items():
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


class Offered(UserDict[str, Any]):
    """Commands by name. Each is made, and the module of its verb loaded, when it is asked for first.

    Args:
        homes: the module of each verb, or a group of verbs.
        under: the word before them.
    """

    def __init__(self, homes: Mapping[str, str | Group], under: str = "") -> None:
        super().__init__(homes)
        self._under = under

    def __getitem__(self, name: str) -> Any:
        home = self.data[name]
        if isinstance(home, Group):
            self.data[name] = _made_group(name, home)
        elif isinstance(home, str):
            self.data[name] = _made_verb(name, home, f"{self._under}-{name}" if self._under else name)
        return self.data[name]


def _made_verb(name: str, home: str, formatted: str) -> Any:
    """A verb as the command line has it.

    Args:
        formatted: the name in its JSON: the group's with it.
    """
    verb = _function(home, formatted)
    one = group(add_completion=False)
    one.command(name, cls=Verb, help=_help(verb))(scripted(verb, formatted, has_figures=formatted in FIGURES))
    return typer.main.get_command(one)


def _made_group(name: str, what: Group) -> Any:
    """Verbs under one word as the command line has them."""
    verb = _function(what.alone, f"{name}-list") if what.alone else lambda: None
    one = group(
        name=name, add_completion=False, invoke_without_command=bool(what.alone), no_args_is_help=not what.alone
    )
    one.callback(help=what.help or _help(verb))(verb)
    made: Any = typer.main.get_command(one)
    made.commands = Offered(what.verbs, name)
    return made


def _function(home: str, formatted: str) -> Any:
    return getattr(import_module(f"ramsight.cli.{home}"), formatted.replace("-", "_"))


def _help(verb: Any) -> str:
    """A verb's docstring, in which each example has a line of its own that can be copied."""
    # \b makes Click leave the lines of a paragraph as they are.
    return re.sub(r"((?:^Example: .*\n*)+)\Z", _examples, inspect.getdoc(verb) or "", flags=re.MULTILINE)


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
