"""Text of exported C: templates, lists of lines, tables of numbers, and the names that every template has."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable
from importlib import resources
from string import Template

import numpy as np
from numpy.typing import NDArray

from ramsight._version import __version__
from ramsight.deploy.c_function import literal


def template(file: str, /, **values: object) -> str:
    """A file of `deploy/c`, or a path in `deploy`, with the places `${...}` filled in."""
    return Template(asset(file if "/" in file else f"c/{file}")).substitute({k: str(v) for k, v in values.items()})


def asset(path: str) -> str:
    """Text of a file in `deploy`, as it is."""
    return (resources.files("ramsight.deploy") / path).read_text(encoding="utf-8")


def headings(prefix: str, machine: str, title: str) -> dict[str, object]:
    """What every template of a header or body is filled with."""
    return {"p": prefix, "P": prefix.upper(), "version": __version__, "machine": machine, "title": title}


def indented(statements: Iterable[str], indent: int = 2) -> str:
    r"""Statements, a line each.

    Example:
        >>> indented(["a = 1;", "b = 2;"])
        '  a = 1;\n  b = 2;'
    """
    return textwrap.indent("\n".join(statements), " " * indent)


def golden_table(name: str, values: NDArray[np.float64]) -> str:
    """Golden samples as an array of `GOLDEN` rows, shape (samples, columns)."""
    body = ",\n".join(f"  {{{', '.join(map(literal, row))}}}" for row in values.tolist())
    return f"static const double {name}[GOLDEN][{values.shape[1]}] = {{\n{body}\n}};\n"
