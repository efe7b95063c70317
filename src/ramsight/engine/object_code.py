"""Compiled functions as object files: Numba makes one when its content is new, then LLVM alone loads it.

An object file is machine code and nothing else, so that nothing is unpickled, and Numba's own laws of types, which take
most of a second to import, are not needed where everything was compiled before.
"""

from __future__ import annotations

import contextlib
import ctypes
import hashlib
import importlib
import threading
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy as np
from llvmlite import binding

from ramsight.engine.private_folder import is_ours
from ramsight.engine.whole_file import write_whole

_FAST = ("afn", "arcp", "contract", "nsz")
OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": set(_FAST)}
"""Of the compiler."""

Kinds = tuple[tuple[str, int], ...]
"""Of arguments: type and number of dimensions, 0 for a number."""

_MAGIC = b"ramsight object 1\n"
_DIGEST = 32
_NUMBER = ("d", 0)
_DTYPES = {"d": "float64", "l": "int64"}
_lock = threading.Lock()


class NativeFunction:
    """A function of C-contiguous arrays of float64 or int64 and of numbers, which are float64.

    Args:
        function: it, as Numba knows it; it returns an int or nothing.
        name: of its files; stands for its content.
        folder: where they are.

    Attributes:
        loaded: how often machine code was taken from the folder.
    """

    def __init__(self, function: Any, name: str, folder: Path) -> None:
        self._function, self._name, self._folder = function, name, folder
        self._entries: dict[Kinds, Callable[..., int | None]] = {}
        self._engines: list[Any] = []  # keep the machine code where it is
        self.loaded = 0

    def __call__(self, *arguments: Any) -> int | None:
        """Run it; the interpreter's lock is released meanwhile."""
        kinds: list[tuple[str, int]] = []
        values: list[Any] = []
        for one in arguments:
            if isinstance(one, np.ndarray):
                if not one.flags.c_contiguous:
                    raise ValueError("an array that is not C-contiguous")
                if one.dtype.char not in _DTYPES:
                    raise TypeError(f"an array of {one.dtype}: float64 and int64 are taken")
                kinds.append((one.dtype.char, one.ndim))
                values.append(id(one))
            else:
                kinds.append(_NUMBER)
                values.append(one)
        entry = self._entries.get(tuple(kinds)) or self._entry(tuple(kinds))
        return entry(*values)

    def _entry(self, kinds: Kinds) -> Callable[..., int | None]:
        with _lock:
            if kinds not in self._entries:
                self._entries[kinds] = self._load(kinds) or self._make(kinds)
            return self._entries[kinds]

    def _file(self, kinds: Kinds) -> tuple[Path, bytes]:
        """Where the machine code is, and all that it depends on."""
        compilers = (numba.__version__, llvmlite.__version__, *_target())
        key = repr((self._name, kinds, _FAST, OPTIONS["error_model"], compilers)).encode()
        return self._folder / f"{self._name}-{hashlib.sha256(key).hexdigest()[:16]}.o", key

    def _load(self, kinds: Kinds) -> Callable[..., int | None] | None:
        """The function from its file; None if there is none that is whole and ours."""
        path, key = self._file(kinds)
        try:
            content = path.read_bytes() if is_ours(path) else b""
        except OSError:
            return None
        digest, rest = content[len(_MAGIC) : len(_MAGIC) + _DIGEST], content[len(_MAGIC) + _DIGEST :]
        if not content.startswith(_MAGIC) or hashlib.sha256(key + rest).digest() != digest:
            return None
        entry = self._linked(rest[1:], rest[:1] == b"i", kinds)
        self.loaded += 1
        return entry

    def _make(self, kinds: Kinds) -> Callable[..., int | None]:
        """Compile it, and keep the machine code if that can be done."""
        from ramsight.engine.array_entry import entry_source, names

        types: Any = numba.types
        types_of = [getattr(types, _DTYPES[kind]) for kind, _ in kinds]
        arrays = [types.Array(one, ndim, "C") if ndim else one for one, (_, ndim) in zip(types_of, kinds, strict=True)]
        self._function.compile(tuple(arrays))
        gives_int = self._function.overloads[tuple(arrays)].signature.return_type is not types.none
        scope: dict[str, Any] = {**names(), "function": self._function}
        exec(entry_source([_DTYPES[kind] for kind, _ in kinds], [ndim for _, ndim in kinds]), scope)
        signature = [types.int64 if ndim else types.float64 for _, ndim in kinds]
        made: Any = numba.cfunc((types.int64 if gives_int else types.void)(*signature), **OPTIONS)(scope["entry"])
        code = _named(_machine().emit_object(binding.parse_assembly(made.inspect_llvm())), made.native_name)
        path, key = self._file(kinds)
        rest = (b"i" if gives_int else b"-") + code
        with contextlib.suppress(OSError):  # without a cache it is compiled anew each time
            write_whole(path, _MAGIC + hashlib.sha256(key + rest).digest() + rest)
        return self._linked(code, gives_int, kinds)

    def _linked(self, code: bytes, gives_int: bool, kinds: Kinds) -> Callable[..., int | None]:
        """The function in object code, which begins with its name."""
        size = int.from_bytes(code[:4], "little")
        name, machine_code = code[4 : 4 + size].decode(), code[4 + size :]
        _register()
        engine = binding.create_mcjit_compiler(binding.parse_assembly(""), _machine())
        engine.add_object_file(binding.ObjectFileRef.from_data(machine_code))
        engine.finalize_object()
        self._engines.append(engine)
        arguments = [ctypes.c_int64 if ndim else ctypes.c_double for _, ndim in kinds]
        prototype = ctypes.CFUNCTYPE(ctypes.c_int64 if gives_int else None, *arguments)
        return prototype(engine.get_function_address(name))


def _machine() -> Any:
    """What makes machine code for this processor."""
    target = binding.Target.from_default_triple()
    features = binding.get_host_cpu_features().flatten()
    return target.create_target_machine(cpu=binding.get_host_cpu_name(), features=features, opt=3, jit=True)


def _named(code: bytes, name: str) -> bytes:
    encoded = name.encode()
    return len(encoded).to_bytes(4, "little") + encoded + code


@cache
def _target() -> tuple[str, ...]:
    """What the machine code is made for: Numba's own triple, processor and its features."""
    from numba.core.registry import cpu_target

    return tuple(map(str, cpu_target.target_context.codegen().magic_tuple()))


@cache
def _register() -> None:
    """Tell LLVM where the functions of Numba's runtime are that machine code calls: memory, errors."""
    from numba.core.registry import cpu_target

    runtime: Any = importlib.import_module("numba.core.runtime")  # which does not say what it exports
    runtime.rtsys.initialize(cpu_target.target_context)
