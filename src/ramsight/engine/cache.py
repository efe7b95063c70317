"""Generated modules, named by the hash of all they depend on; their machine code is kept on disk."""

from __future__ import annotations

import hashlib
import inspect
import json
import os
import sys
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import casadi as ca

from ramsight.engine import branches, graph, llvm
from ramsight.engine.object_code import NativeFunction
from ramsight.engine.private_folder import private_folder

WIDTH = 8
"""Runs side by side: one AVX-512 register of doubles, two of AVX2."""
_loaded: dict[str, CompiledModule] = {}


def cache_directory() -> Path:
    """Where compiled models are kept; the folder exists, and nobody else can write into it.

    `$RAMSIGHT_CACHE`, else `ramsight` in the user's cache directory. Where that cannot be written, or others may
    write into it, another one that is ours alone (`engine.private_folder`).
    """
    given = os.environ.get("RAMSIGHT_CACHE")
    base = os.environ.get("XDG_CACHE_HOME")
    wanted = Path(given) if given else (Path(base) if base else Path.home() / ".cache") / "ramsight"
    return private_folder(wanted, "remove it, or set RAMSIGHT_CACHE to a folder of your own")


def instructions(function: ca.Function) -> list[list[Any]]:
    """The elementary operations of an SX function, in order: `[operation, target, sources, constant]`.

    Registers are those of CasADi; `target` and `sources` are pairs (argument, element) for inputs and outputs.
    """
    listing = []
    for k in range(function.n_instructions()):
        code = function.instruction_id(k)
        target, sources = function.instruction_output(k), function.instruction_input(k)
        value = function.instruction_constant(k) if code == ca.OP_CONST else 0.0
        listing.append([code, target, sources, value])
    return listing


def content_hash(*parts: Any) -> str:
    """A short hash of JSON-able content; the same content always has the same one."""
    text = json.dumps(parts, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:24]


def _wrapper(name: str, function: ca.Function, width: int) -> list[str]:
    """Source of the compiled function `name(inputs..., outputs...)`; an output named like an input overwrites it."""
    inputs, outputs = function.name_in(), [out.removesuffix("_new") for out in function.name_out()]
    arguments = ", ".join(dict.fromkeys(inputs + outputs))
    return [
        f"_{name} = operations(lambda: load({name!r}), {width})",
        "@inner",
        f"def {name}({arguments}):",
        f"    _{name}(({', '.join(inputs)},), ({', '.join(outputs)},))",
        "",
    ]


def generated_module(
    functions: Mapping[str, ca.Function],
    constants: Mapping[str, object],
    body: str,
    widths: Mapping[str, int] | None = None,
) -> CompiledModule:
    """A compiled module made of SX functions and of Python source that calls them.

    Compiling takes seconds when the content is new and a fraction of a second when it was seen before here.

    Args:
        functions: SX functions by name; each becomes `name(inputs..., outputs...)` on float64 arrays. The sparse
            entries of an input or output are its nonzeros. An output `b_new` is written over the input `b`.
        constants: module-level names that `body` uses.
        body: source of further functions; `def` at the left margin is compiled.
        widths: functions that work on several runs side by side, and on how many; their arrays are (n, width).
    """
    programs = {name: instructions(function) for name, function in functions.items()}
    lines = ['"""Generated; may be deleted at any time."""', "import numpy as np", "import numba as nb"]
    lines += ["from ramsight.engine.llvm import operations", "from ramsight.engine.object_code import OPTIONS", ""]
    lines += [f"{name} = {value!r}" for name, value in constants.items()]
    # What only other compiled functions call becomes part of their code, and is compiled with it.
    inner = "nb.njit(inline='always', **OPTIONS)" if body else "compiled"
    lines += ["compiled = nb.njit(**OPTIONS)", f"inner = {inner}"]
    lines += [""]
    for name, function in functions.items():
        lines += _wrapper(name, function, (widths or {}).get(name, 1))
    lines += [line if not line.startswith("def ") else f"@compiled\n{line}" for line in body.splitlines()]
    source = "\n".join(lines) + "\n"
    name = "model_" + content_hash(
        programs,
        source,
        *map(inspect.getsource, (graph, branches, llvm)),
        ca.CasadiMeta.version(),
        sys.version_info[:2],
    )
    if name not in _loaded:
        _loaded[name] = CompiledModule(name, source, programs)
    return _loaded[name]


class CompiledModule:
    """A generated module. Source and operations come from memory; only machine code is kept in the cache's folder.

    Args:
        name: of the module and its files.
        source: its text.
        programs: the operations of its functions, by name.
    """

    def __init__(self, name: str, source: str, programs: Mapping[str, graph.Program]) -> None:
        self._folder = cache_directory()
        self._module = ModuleType(name)
        self._module.__dict__["load"] = programs.__getitem__
        sys.modules[name] = self._module
        exec(compile(source, f"<{name}>", "exec"), self._module.__dict__)

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._module, name)
        if hasattr(value, "overloads"):
            value = NativeFunction(value, f"{self._module.__name__}.{name}", self._folder)
        self.__dict__[name] = value
        return value


def hold(expression: Any, parameters: Any) -> tuple[Any, Any, ca.Function]:
    """Take out of an expression what depends on parameters alone, to be computed once.

    Returns:
        The reduced expression, the symbols `q` that stand for what was taken out (and for the parameters), and the
        function `prepare(p) -> q`.
    """
    reduced, symbols, values = ca.extract_parametric(ca.cse(expression), parameters)
    q = ca.vertcat(*symbols, parameters)
    result = ca.densify(ca.vertcat(*values, parameters))
    return reduced, q, ca.Function("prepare", [parameters], [result], ["p"], ["q"], {"cse": True})
