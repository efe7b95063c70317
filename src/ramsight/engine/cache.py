"""Generated modules on disk: written whole, named by the hash of all they depend on, compiled and cached by Numba."""

from __future__ import annotations

import hashlib
import importlib.util
import inspect
import json
import os
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import casadi as ca

from ramsight.engine import llvm

_COMPILE = "nb.njit(cache=True, nogil=True, error_model='numpy', fastmath={'contract', 'nsz', 'arcp', 'afn'})"
_loaded: dict[str, ModuleType] = {}


def cache_directory() -> Path:
    """Where compiled models are kept: `$RAMSIGHT_CACHE`, else `ramsight` in the user's cache directory."""
    given = os.environ.get("RAMSIGHT_CACHE")
    if given:
        return Path(given)
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "ramsight"


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


def program_loader(module_file: str) -> Any:
    """A function that gives a program of the generated module by name; reads the file when first asked."""
    content: dict[str, Any] = {}

    def load(name: str) -> llvm.Program:
        if not content:
            content.update(json.loads(Path(module_file).with_suffix(".json").read_text()))
        program: llvm.Program = content[name]
        return program

    return load


def _write_whole(path: Path, text: str) -> None:
    """Write a file so that another process sees either nothing or all of it."""
    descriptor, temporary = tempfile.mkstemp(dir=path.parent, prefix=path.name)
    with os.fdopen(descriptor, "w") as stream:
        stream.write(text)
    os.replace(temporary, path)


def _wrapper(name: str, function: ca.Function) -> list[str]:
    """Source of the compiled function `name(inputs..., outputs...)`; an output named like an input overwrites it."""
    inputs, outputs = function.name_in(), [out.removesuffix("_new") for out in function.name_out()]
    arguments = ", ".join(dict.fromkeys(inputs + outputs))
    return [
        f"_{name} = operations(lambda: load({name!r}))",
        "@compiled",
        f"def {name}({arguments}):",
        f"    _{name}(({', '.join(inputs)},), ({', '.join(outputs)},))",
        "",
    ]


def generated_module(functions: Mapping[str, ca.Function], constants: Mapping[str, object], body: str) -> ModuleType:
    """A compiled module made of SX functions and of Python source that calls them.

    Compiling takes seconds when the content is new and a fraction of a second when it was seen before here.

    Args:
        functions: SX functions by name; each becomes `name(inputs..., outputs...)` on float64 arrays. The sparse
            entries of an input or output are its nonzeros. An output `b_new` is written over the input `b`.
        constants: module-level names that `body` uses.
        body: source of further functions; `def` at the left margin is compiled.
    """
    programs = {name: instructions(function) for name, function in functions.items()}
    lines = ['"""Generated; may be deleted at any time."""', "import numpy as np", "import numba as nb"]
    lines += [
        "from ramsight.engine.cache import program_loader",
        "from ramsight.engine.llvm import operations",
        "",
    ]
    lines += [f"{name} = {value!r}" for name, value in constants.items()]
    lines += [f"compiled = {_COMPILE}", "load = program_loader(__file__)", ""]
    for name, function in functions.items():
        lines += _wrapper(name, function)
    lines += [line if not line.startswith("def ") else f"@compiled\n{line}" for line in body.splitlines()]
    source = "\n".join(lines) + "\n"
    name = "model_" + content_hash(
        programs, source, inspect.getsource(llvm), ca.CasadiMeta.version(), sys.version_info[:2]
    )
    if name in _loaded:
        return _loaded[name]
    folder = cache_directory()
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.py"
    if not path.with_suffix(".json").exists():
        _write_whole(path.with_suffix(".json"), json.dumps(programs))
    if not path.exists():
        _write_whole(path, source)
    specification = importlib.util.spec_from_file_location(name, path)
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    sys.modules[name] = module
    specification.loader.exec_module(module)
    _loaded[name] = module
    return module


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
