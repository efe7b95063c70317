"""Generated modules on disk: written whole, named by the hash of all they depend on, compiled and cached by Numba."""

from __future__ import annotations

import hashlib
import inspect
import json
import os
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import casadi as ca
from numba import config
from numba.core.caching import NullCache

from ramsight.engine import llvm
from ramsight.engine.private_folder import is_ours, private_folder

_OPTIONS = "nogil=True, error_model='numpy', fastmath={'contract', 'nsz', 'arcp', 'afn'}"
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


def _write_whole(path: Path, text: str) -> None:
    """Write a file so that another process sees either nothing or all of it."""
    descriptor, temporary = tempfile.mkstemp(dir=path.parent, prefix=path.name)
    with os.fdopen(descriptor, "w") as stream:
        stream.write(text)
    os.replace(temporary, path)


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
    lines += ["from ramsight.engine.llvm import operations", ""]
    lines += [f"{name} = {value!r}" for name, value in constants.items()]
    # What only other compiled functions call becomes part of their code, and is compiled with it.
    inner = f"nb.njit(inline='always', {_OPTIONS})" if body else "compiled"
    lines += [f"compiled = nb.njit(cache=True, {_OPTIONS})", f"inner = {inner}"]
    lines += [""]
    for name, function in functions.items():
        lines += _wrapper(name, function, (widths or {}).get(name, 1))
    lines += [line if not line.startswith("def ") else f"@compiled\n{line}" for line in body.splitlines()]
    source = "\n".join(lines) + "\n"
    name = "model_" + content_hash(
        programs, source, inspect.getsource(llvm), ca.CasadiMeta.version(), sys.version_info[:2]
    )
    if name not in _loaded:
        _loaded[name] = CompiledModule(name, source, programs)
    return _loaded[name]


class CompiledModule:
    """A generated module whose functions mend their own cache.

    Source and operations come from memory; the source's file is there only for Numba to date its own files by. What
    Numba left on disk is held against the checksums taken when it was made, and is thrown away if it differs or is
    somebody else's; if it cannot be loaded all the same, it is made again.

    Args:
        name: of the module and its files.
        source: its text.
        programs: the operations of its functions, by name.
    """

    def __init__(self, name: str, source: str, programs: Mapping[str, llvm.Program]) -> None:
        self._path, self._source, self._programs = cache_directory() / f"{name}.py", source, programs
        self._module = self._load()

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._module, name)
        if hasattr(value, "overloads"):
            value = self._guarded(name)
        self.__dict__[name] = value
        return value

    def _load(self) -> ModuleType:
        if not is_ours(self._path) or self._path.read_bytes() != self._source.encode():
            _write_whole(self._path, self._source)
        if any(self._checksum(name) not in {None, known} for name, known in self._known_checksums().items()):
            self._forget()
        if not all(is_ours(file) for file in self._files()):
            self._forget()
        module = ModuleType(self._path.stem)
        module.__file__ = str(self._path)
        module.__dict__["load"] = self._programs.__getitem__
        sys.modules[module.__name__] = module
        exec(compile(self._source, module.__file__, "exec"), module.__dict__)
        for function in vars(module).values():
            self._confine(function)
        return module

    def _confine(self, function: Any) -> None:
        """Keep Numba from a folder that nobody has checked, which it takes where ours cannot be written."""
        found = getattr(getattr(function, "_cache", None), "cache_path", None)
        if found is None or getattr(config, "CACHE_DIR", False):  # the user has chosen a folder for all of Numba
            return
        if Path(found) != self._path.parent / "__pycache__":
            function._cache = NullCache()

    def _guarded(self, name: str) -> Callable[..., Any]:
        function = getattr(self._module, name)

        def call(*arguments: Any) -> Any:
            nonlocal function
            if function.overloads:
                return function(*arguments)
            try:
                result = function(*arguments)
            except Exception:  # whatever a damaged file makes Numba raise; a second failure is a real one
                self._forget()
                self._module = self._load()
                function = getattr(self._module, name)
                result = function(*arguments)
            self._seal()
            return result

        return call

    def _files(self) -> list[Path]:
        """What Numba keeps of this module."""
        folder = self._path.parent / "__pycache__"
        if folder.is_symlink():
            folder.unlink()
        return sorted(folder.glob(f"{self._path.stem}.*.nb*"))

    def _checksum(self, name: str) -> str | None:
        try:
            return hashlib.sha256((self._path.parent / "__pycache__" / name).read_bytes()).hexdigest()
        except OSError:
            return None

    def _known_checksums(self) -> dict[str, str]:
        try:
            known = json.loads(self._path.with_suffix(".sums").read_text())
            return known if isinstance(known, dict) else {}
        except (OSError, ValueError):
            return {}

    def _seal(self) -> None:
        sums = {file.name: self._checksum(file.name) for file in self._files()}
        if sums != self._known_checksums():
            _write_whole(self._path.with_suffix(".sums"), json.dumps(sums))

    def _forget(self) -> None:
        for file in self._files():
            file.unlink(missing_ok=True)


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
