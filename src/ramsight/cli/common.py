"""What verbs share: groups, arguments that several take, and what they say: in words, or to scripts as JSON."""

from __future__ import annotations

import functools
import inspect
import json
import math
import os
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

import typer

from ramsight.errors import DescriptionError, one_line, printable
from ramsight.log_formats import READABLE

if TYPE_CHECKING:
    from rich.console import RenderableType


FORMAT = 1
"""Of the JSON of every verb; counts up when a key changes its meaning or goes."""
_JSON = typer.Option("--json", help="Print the figures as JSON, and nothing else on standard output; SI units.")
_QUIET = typer.Option("--quiet", "-q", help="No progress, no advice, no names of written files; warnings stay.")


class Report:
    """What a verb has to say of its work, beside its words.

    Args:
        verb: its name, ``logs-inspect`` of `ramsight logs inspect`.
    """

    def __init__(self, verb: str = "", *, as_json: bool = False, is_quiet: bool = False) -> None:
        self.as_json, self.is_quiet = as_json, is_quiet
        self.content: dict[str, Any] = {"format": f"ramsight-{verb}-{FORMAT}"}

    def add(self, name: str, values: list[str]) -> None:
        """Add to a list of texts."""
        self.content.setdefault(name, []).extend(values)

    @property
    def text(self) -> str:
        """All of it as JSON."""
        return json.dumps(plain(self.content), indent=1, ensure_ascii=True, allow_nan=False)


_current = [Report()]


def report() -> Report:
    """That of the verb that runs."""
    return _current[-1]


def give(**figures: object) -> None:
    """State figures of the verb that runs, by name: numbers, texts, dataclasses, mappings and lists of such."""
    report().content.update(figures)


_KNOWN = (type(None), bool, int, float, str, Path, Enum, Mapping, list, tuple, set, frozenset)


def plain(value: object) -> Any:
    """A value as JSON has it: what is no number is null, an enum's member its name; Datasets are left out.

    Example:
        >>> plain({"rate": math.nan, "path": Path("a.csv"), "pair": (1, 2.5)})
        {'rate': None, 'path': 'a.csv', 'pair': [1, 2.5]}
    """
    if isinstance(value, Enum):
        return value.name.lower()
    if value is None or isinstance(value, bool | str):
        return value
    if hasattr(value, "dtype") and hasattr(value, "tolist"):  # of NumPy, which a verb may do without
        return plain(value.tolist())
    if isinstance(value, int):
        return int(value)
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, Path):
        return str(value)
    if is_dataclass(value) and not isinstance(value, type):
        value = {one.name: getattr(value, one.name) for one in fields(value) if not one.name.startswith("_")}
    if isinstance(value, Mapping):
        return {str(key): plain(one) for key, one in value.items() if _is_figure(one)}
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(one) for one in (sorted(value) if isinstance(value, set | frozenset) else value)]
    raise TypeError(f"no figure: {type(value).__name__}")


def _is_figure(value: object) -> bool:
    """Whether JSON has something of that kind."""
    if hasattr(value, "data_vars"):  # a Dataset, which is a mapping, too
        return False
    if isinstance(value, _KNOWN) or type(value).__module__.partition(".")[0] == "numpy":
        return True
    return is_dataclass(value) and not isinstance(value, type)


def scripted(verb: Callable[..., Any], name: str, *, has_figures: bool) -> Callable[..., Any]:
    """A verb with ``--quiet``, and with ``--json`` if it states figures.

    Args:
        has_figures: whether it calls `give`.
    """

    @functools.wraps(verb)
    def run(*args: Any, as_json: bool = False, is_quiet: bool = False, **options: Any) -> None:
        with _reporting(Report(name, as_json=as_json, is_quiet=is_quiet)):
            verb(*args, **options)

    more: dict[str, Any] = {"as_json": _JSON} if has_figures else {}
    more["is_quiet"] = _QUIET
    known = inspect.signature(verb, eval_str=True)
    added = [
        inspect.Parameter(key, inspect.Parameter.KEYWORD_ONLY, default=False, annotation=Annotated[bool, option])
        for key, option in more.items()
    ]
    run.__signature__ = known.replace(parameters=[*known.parameters.values(), *added])  # type: ignore[attr-defined]
    run.__annotations__ = get_type_hints(verb, include_extras=True) | {one.name: one.annotation for one in added}
    return run


@contextmanager
def _reporting(current: Report) -> Iterator[None]:
    from ramsight.progress import silent

    _current.append(current)
    try:
        with silent() if current.is_quiet else nullcontext():
            yield
        _print(current)
    except typer.Exit:  # the work is done, with a verdict that is an exit code
        _print(current)
        raise
    finally:
        _current.pop()


def _print(current: Report) -> None:
    if current.as_json:
        typer.echo(printable(current.text))


LOG = f"{READABLE}, by its suffix"
Machine = Annotated[str, typer.Argument(help="A description file, or a catalogue name.")]
DrivenUnit = Annotated[
    str | None, typer.Option("--unit", help="The unit that the drive turns; may be left out where there is one.")
]
SensedUnit = Annotated[
    str | None, typer.Option("--unit", help="The unit that the sensor is for; may be left out where there is one.")
]
DriveLog = Annotated[Path, typer.Argument(help=f"Drive log: {LOG}.")]
_VERDICTS = {"passed": "green", "look twice": "yellow", "failed": "red"}
_WIDE = 140  # columns of a table where the output goes into a file or a pipe
_KINDS = {"error": "red", "warning": "yellow"}
Strict = Annotated[
    bool, typer.Option("--strict", help="Exit with 1 if there was a warning, for batch jobs; files are written.")
]
Requirement = Annotated[
    str | None,
    typer.Option(
        "--require",
        help='Error that 95 % have to be within, "5 mm": the verdict is by that [default: requirement of the unit].',
    ),
]
ChannelMapFile = Annotated[
    Path | None,
    typer.Option("--map", help="Which of the log's channels are what: a TOML file of 'ramsight logs inspect'."),
]

BesideLogs = Annotated[
    list[str] | None,
    typer.Option(help='Log of another unit of the mechanism, over the same clock: "bucket=bucket.csv"; repeatable.'),
]
StandingUnits = Annotated[
    list[str] | None,
    typer.Option(help='Where another unit stands still, or its log begins: "bucket=250 mm"; may be repeated.'),
]
EmptyLogs = Annotated[
    list[Path] | None, typer.Option("--empty", help="Log of lifts of the empty tool; may be repeated.")
]
KnownLogs = Annotated[
    list[str] | None, typer.Option("--known", help='Log of lifts of a known mass: "2 t=known.csv"; may be repeated.')
]


def group(**options: Any) -> typer.Typer:
    """A group of verbs, empty as yet; options are those of Typer."""
    return typer.Typer(rich_markup_mode=None, context_settings={"help_option_names": ["-h", "--help"]}, **options)


def coloured(word: str, colour: str) -> str:
    """A word in a colour, for a terminal; `NO_COLOR` switches it off, and a pipe has none."""
    return word if os.environ.get("NO_COLOR") else typer.style(word, fg=colour)


def say(text: object) -> None:
    """Print a line on standard output."""
    if not report().as_json:
        typer.echo(one_line(text))


def say_lines(text: object) -> None:
    """Print a text of several lines on standard output."""
    if not report().as_json:
        typer.echo(printable(text))


def say_table(what: RenderableType) -> None:
    """Print a table on standard output."""
    if report().as_json:
        return
    from rich.console import Console
    from rich.segment import Segment, Segments

    console = Console(highlight=False)
    if not console.is_terminal and "COLUMNS" not in os.environ:
        console.width = _WIDE
    # Cells are escaped after they are laid out, so that no table can forget it.
    laid_out = (Segment(printable(text), style) for text, style, control in console.render(what) if not control)
    console.print(Segments(laid_out), end="")


def say_error(text: object, kind: str = "error") -> None:
    """Say on standard error what a user can mend, on one line."""
    words = " ".join(str(text).split())
    typer.echo(f"{coloured(kind, _KINDS[kind])}: {one_line(words)}", err=True)


def say_verdicts(text: str) -> None:
    """Print lines that begin with a verdict, its words in colour."""
    for line in [] if report().as_json else text.splitlines():
        verdict = next((one for one in _VERDICTS if line.startswith(one)), "")
        typer.echo((coloured(verdict, _VERDICTS[verdict]) if verdict else "") + one_line(line[len(verdict) :]))


def say_cautions(sentences: Iterable[str]) -> None:
    """Print what is worth a second look, a line each."""
    said = list(sentences)
    report().add("look_twice", said)
    for sentence in [] if report().as_json or report().is_quiet else said:
        typer.echo(f"{coloured('look twice', 'yellow')}: {one_line(sentence)}")


def named_unit(machine: str, unit: str | None) -> str:
    """The unit that is passed, or the only one of a machine.

    Args:
        unit: of ``--unit``; None where it was left out.

    Raises:
        DescriptionError: the machine has several units, and none is named.
    """
    if unit is not None:
        return unit
    from ramsight.machine import load_machine, only_unit

    return only_unit(load_machine(machine))


def optional(text: str | None, unit: str, option: str, *, least: str, most: str) -> float | None:
    """The SI value of an option with a unit; None where it was left out."""
    from ramsight.units import parse_option

    return None if text is None else parse_option(text, unit, option, least=least, most=most)


def say_written(*paths: Path | None) -> None:
    """Say which files were written; None was not asked for."""
    written = [str(path) for path in paths if path is not None]
    report().add("written", written)
    for path in [] if report().is_quiet else written:
        say(f"{path}: written")


WARNED = 1
"""Exit code of a verb that did its work, with warnings, where none are allowed."""


@contextmanager
def strictly(*, is_strict: bool) -> Iterator[None]:
    """Count the warnings of logs meanwhile; at the end leave with `WARNED` if there were any and it is strict.

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


def known_masses(empty: Iterable[Path] | None, known: Iterable[str] | None) -> list[tuple[float | str, Path]]:
    """Masses with the logs of their lifts, as `EmptyLogs` and `KnownLogs` have them.

    Raises:
        DescriptionError: one of them has no mass or no log.
    """
    masses: list[tuple[float | str, Path]] = [(0.0, one) for one in empty or ()]
    for text in known or ():
        mass, equals, file = text.partition("=")
        if not equals or not file:
            raise DescriptionError("is not MASS=LOG", key="known", value=text, allowed="2 t=known.csv")
        masses.append((mass, Path(file)))
    return masses


def by_unit(texts: Iterable[str] | None, key: str, example: str) -> dict[str, str]:
    """Texts as they stand on a command line: ``bucket=bucket.csv``.

    Raises:
        DescriptionError: one of them has no name or no value, or a unit comes twice.
    """
    found: dict[str, str] = {}
    for text in texts or ():
        name, equals, value = text.partition("=")
        if not equals or not name or not value or name in found:
            raise DescriptionError("is not UNIT=VALUE, each unit once", key=key, value=text, allowed=example)
        found[name] = value
    return found
