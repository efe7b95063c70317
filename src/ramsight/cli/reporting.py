"""For scripts: the figures of a verb as JSON in the place of its words, and quiet runs."""

from __future__ import annotations

import functools
import inspect
import json
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import typer

from ramsight.errors import printable

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
