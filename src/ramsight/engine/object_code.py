"""Compiled functions as object files: LLVM makes one when its content is new, and loads it where it is not.

An object file is machine code and nothing else, so that nothing is unpickled. With `$RAMSIGHT_OPTIMIZE` = `no` it is
assembled as it is written: two thirds of a first call are spent on optimizing it.
"""

from __future__ import annotations

import contextlib
import ctypes
import hashlib
import os
import threading
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any

import llvmlite
import numpy as np
from llvmlite import binding

from ramsight.engine.private_folder import write_whole
from ramsight.system import is_ours, runtime_symbols

Kinds = tuple[tuple[str, int], ...]
"""Of arguments: type and number of dimensions, 0 for a number."""

ENTRY = "loop"
"""The name of a function in its module."""

Written = Callable[[Kinds], tuple[str, int]]
"""The text of a function `loop` for LLVM, for arguments of some kinds, and the size of its workspace [8 bytes]."""

_MAGIC = b"ramsight object 2\n"
_DIGEST = 32
JOINED = "contract"
"""LLVM's flag of a sum or a product that may be rounded once with the other."""
_HIGHEST = 3  # level of LLVM's optimizers
_NUMBER = ("d", 0)
_KINDS = {np.dtype(one).char: kind for one, kind in ((np.float64, "d"), (np.int64, "l"))}
"""By NumPy's letters, of which that of int64 depends on the system's C compiler."""
_lock = threading.Lock()


class NativeFunction:
    """A function of C-contiguous arrays of float64 or int64 and of numbers, which are float64; it returns an int.

    Attributes:
        loaded: how often machine code was taken from the folder.
    """

    def __init__(self, written: Written, name: str, folder: Path) -> None:
        self._written, self._name, self._folder = written, name, folder
        self._entries: dict[Kinds, Callable[..., int]] = {}
        self._engines: list[Any] = []  # keep the machine code where it is
        self.loaded = 0

    def __call__(self, *arguments: Any) -> int:
        """Run it; the interpreter's lock is released meanwhile."""
        entry, values = self._called(arguments)
        return entry(*values)

    def bound(self, *arguments: Any) -> Callable[[], int]:
        """It with arguments that stay the same arrays, to be run without another look at them."""
        entry, values = self._called(arguments)

        def run(_alive: tuple[Any, ...] = arguments) -> int:
            return entry(*values)

        return run

    def _called(self, arguments: tuple[Any, ...]) -> tuple[Callable[..., int], list[Any]]:
        """What is called for these, and with what."""
        kinds: list[tuple[str, int]] = []
        values: list[Any] = []
        for one in arguments:
            if isinstance(one, np.ndarray):
                if not one.flags.c_contiguous:
                    raise ValueError("an array that is not C-contiguous")
                if (kind := _KINDS.get(one.dtype.char)) is None:
                    raise TypeError(f"an array of {one.dtype}: float64 and int64 are taken")
                kinds.append((kind, one.ndim))
                values.append(id(one))
            else:
                kinds.append(_NUMBER)
                values.append(one)
        return self._entries.get(tuple(kinds)) or self._entry(tuple(kinds)), values

    def _entry(self, kinds: Kinds) -> Callable[..., int]:
        with _lock:
            if kinds not in self._entries:
                self._entries[kinds] = self._load(kinds) or self._make(kinds)
            return self._entries[kinds]

    def _file(self, kinds: Kinds) -> tuple[Path, bytes]:
        """Where the machine code is, and all that it depends on."""
        key = repr((self._name, kinds, *made_for())).encode()
        return self._folder / f"{self._name}-{hashlib.sha256(key).hexdigest()[:16]}.o", key

    def _load(self, kinds: Kinds) -> Callable[..., int] | None:
        """The function from its file; None if there is none that is whole and ours."""
        path, key = self._file(kinds)
        try:
            content = path.read_bytes() if is_ours(path) else b""
        except OSError:
            return None
        digest, rest = content[len(_MAGIC) : len(_MAGIC) + _DIGEST], content[len(_MAGIC) + _DIGEST :]
        if not content.startswith(_MAGIC) or hashlib.sha256(key + rest).digest() != digest:
            return None
        entry = self._linked(rest, kinds)
        self.loaded += 1
        return entry

    def _make(self, kinds: Kinds) -> Callable[..., int]:
        """Compile it, and keep the machine code if that can be done."""
        text, words = self._written(kinds)
        # Not optimized, LLVM joins products and sums in vectors, but not in scalars, and a batch would round otherwise.
        assembly = binding.parse_assembly(text if _level() else text.replace(f" {JOINED} ", " "))
        if _level():
            _optimize(assembly)
        path, key = self._file(kinds)
        rest = words.to_bytes(8, "little") + _machine().emit_object(assembly)
        with contextlib.suppress(OSError):  # without a cache it is compiled each time
            write_whole(path, _MAGIC + hashlib.sha256(key + rest).digest() + rest)
        return self._linked(rest, kinds)

    def _linked(self, content: bytes, kinds: Kinds) -> Callable[..., int]:
        """The function in object code, behind the size of its workspace."""
        words, machine_code = int.from_bytes(content[:8], "little"), content[8:]
        engine = binding.create_mcjit_compiler(binding.parse_assembly(""), _machine())
        engine.add_object_file(binding.ObjectFileRef.from_data(machine_code))
        engine.finalize_object()
        self._engines.append(engine)
        arguments = [ctypes.c_int64 if ndim else ctypes.c_double for _, ndim in kinds]
        prototype = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, *arguments)
        function: Callable[..., int] = prototype(engine.get_function_address(ENTRY))
        return _with_workspace(function, words) if words else partial(function, None)


def _with_workspace(function: Callable[..., int], words: int) -> Callable[..., int]:
    """A function with memory of its own in each thread that calls it."""
    mine = threading.local()

    def entry(*values: Any) -> int:
        try:
            return function(mine.address, *values)
        except AttributeError:
            mine.memory = np.empty(words)
            mine.address = mine.memory.ctypes.data
            return function(mine.address, *values)

    return entry


def _machine() -> Any:
    """What makes machine code for this processor."""
    _initialize()
    triple, processor, features = _target()
    target = binding.Target.from_triple(triple)
    return target.create_target_machine(cpu=processor, features=features, opt=_level(), jit=True)


def _level() -> int:
    """How much LLVM optimizes: all, or nothing where the user wants it sooner."""
    return 0 if os.environ.get("RAMSIGHT_OPTIMIZE") == "no" else _HIGHEST


@cache
def _initialize() -> None:
    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    for name, address in runtime_symbols().items():
        binding.add_symbol(name, address)


def _optimize(assembly: Any) -> None:
    options = binding.create_pipeline_tuning_options(speed_level=_HIGHEST)
    builder = binding.create_pass_builder(_machine(), options)
    builder.getModulePassManager().run(assembly, builder)


def made_for() -> tuple[str | int, ...]:
    """What machine code depends on beside what it is to do: LLVM, the processor, and how much is optimized."""
    return (llvmlite.__version__, *_target(), _level())


@cache
def _target() -> tuple[str, str, str]:
    """What the machine code is made for: triple, which implies the kind of object file, processor and its features."""
    try:
        features = binding.get_host_cpu_features().flatten()
    except RuntimeError:  # LLVM cannot tell on this system: those that every such processor has
        features = ""
    return (binding.get_default_triple(), binding.get_host_cpu_name(), features)
