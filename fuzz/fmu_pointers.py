"""FMUs whose C is called with pointers to nothing, variables that are none and states that somebody has changed.

A master that is a program of C can do all of that, whatever fmpy forbids. A call without what it needs is an error, a
state that was damaged is refused, a state is freed twice without harm, and nothing of it ends the process. Many
instances live side by side. An instance that is freed twice is the master's fault alone: no C can see it.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from harness import READ, REFUSED, WRONG, Rng, Section

from ramsight.deploy.compiler import find_compiler

CASES = 20_000
_CALLS, _INSTANCES, _REFERENCES = 60, 8, 6
_OK, _ERROR = 0, 3
_NULL = 0.05  # share of the pointers
_NUMBERS = (0.0, 0.02, 0.04, -1.0, -1e-300, 1e300, -1e300, float("nan"), float("inf"), float("-inf"))
_SUM = 8  # bytes at the end of a state

_SETUP = "kddkd"
"""What a function takes after the instance: k a truth, d a number, n a count, r so many references, a an array of so
many, z a size, i a kind of status, o a pointer that may be null, p one that may not, s a state, S where one is, F the
same or null, b its bytes."""
FUNCTIONS = {
    2: {
        "SetDebugLogging": "kzo", "SetupExperiment": _SETUP, "EnterInitializationMode": "",
        "ExitInitializationMode": "", "Terminate": "", "Reset": "", "GetReal": "rna", "SetReal": "rna",
        "GetInteger": "rna", "SetInteger": "rna",
        "GetBoolean": "rna", "SetBoolean": "rna", "GetString": "rna", "SetString": "rna", "GetFMUstate": "S",
        "SetFMUstate": "s", "FreeFMUstate": "F", "SerializedFMUstateSize": "op", "SerializeFMUstate": "sbz",
        "DeSerializeFMUstate": "bzS", "GetDirectionalDerivative": "rnrnaa", "SetRealInputDerivatives": "rnaa",
        "GetRealOutputDerivatives": "rnaa", "DoStep": "ddk", "CancelStep": "", "GetStatus": "ip", "GetRealStatus": "ip",
        "GetIntegerStatus": "ip", "GetBooleanStatus": "ip", "GetStringStatus": "ip",
    },
    3: {
        "SetDebugLogging": "kzo", "EnterInitializationMode": _SETUP, "ExitInitializationMode": "", "Terminate": "",
        "Reset": "", "GetFloat64": "rnan", "SetFloat64": "rnan", "GetInt64": "rnan", "SetInt64": "rnan",
        "GetBoolean": "rnan", "SetBoolean": "rnan", "GetFloat32": "rnan", "SetFloat32": "rnan", "GetInt8": "rnan",
        "GetUInt8": "rnan", "GetInt16": "rnan", "GetUInt16": "rnan", "SetInt32": "rnan", "GetUInt32": "rnan",
        "SetUInt64": "rnan", "GetString": "rnan", "SetString": "rnan", "GetFMUState": "S", "SetFMUState": "s",
        "FreeFMUState": "F", "SerializedFMUStateSize": "op", "SerializeFMUState": "sbz", "DeserializeFMUState": "bzS",
        "DoStep": "ddkoooo", "GetBinary": "rnoon", "SetBinary": "rnoon", "GetClock": "rno", "SetClock": "rno",
        "GetDirectionalDerivative": "rnrnanan", "GetAdjointDerivative": "rnrnanan", "EnterConfigurationMode": "",
        "ExitConfigurationMode": "", "EnterEventMode": "", "EnterStepMode": "", "EvaluateDiscreteStates": "",
        "EnterContinuousTimeMode": "", "GetIntervalDecimal": "rnoo", "UpdateDiscreteStates": "oooooo",
        "CompletedIntegratorStep": "koo", "SetTime": "d", "SetContinuousStates": "oz", "GetContinuousStates": "oz",
        "GetNumberOfEventIndicators": "o", "GetNumberOfContinuousStates": "o", "GetOutputDerivatives": "rnoon",
    },
}  # fmt: skip
"""The functions of both versions, by what they take."""


@dataclass
class Library:
    """An FMU's binary."""

    fmi: int  # its version
    loaded: Any
    token: bytes  # without which it makes no instance
    variables: int  # how many it has; their references are below

    def __post_init__(self) -> None:
        self.make.restype = ctypes.c_void_p

    @property
    def make(self) -> Any:
        """The function that makes an instance."""
        return getattr(self.loaded, "fmi2Instantiate" if self.fmi == 2 else "fmi3InstantiateCoSimulation")

    def call(self, name: str, *passed: Any) -> int:
        """What a function of the interface answers."""
        return int(getattr(self.loaded, f"fmi{self.fmi}{name}")(*passed))

    def instance(self, name: bytes | None, token: bytes | None) -> Any:
        """A new one, or None."""
        if self.fmi == 2:
            return self.make(name, 1, token, None, None, 0, 1)
        off, on, none = ctypes.c_bool(False), ctypes.c_bool(True), ctypes.c_void_p()
        return self.make(name, token, none, off, on, off, off, none, ctypes.c_size_t(0), none, none, none)

    def free(self, instance: Any) -> None:
        """Free one; a pointer to nothing, too."""
        free = getattr(self.loaded, f"fmi{self.fmi}FreeInstance")
        free.restype = None
        free(ctypes.c_void_p(instance))

    @cached_property
    def state_size(self) -> int:
        """Bytes of a state."""
        one, size = self.instance(b"one", self.token), ctypes.c_size_t()
        self.call(self.spelled("SerializedFMUStateSize"), ctypes.c_void_p(one), None, ctypes.byref(size))
        self.free(one)
        return size.value

    def spelled(self, name: str) -> str:
        """A function's name in this version, which differ by capitals."""
        return next(one for one in FUNCTIONS[self.fmi] if one.lower() == name.lower())


@dataclass
class Master:
    """Who calls."""

    library: Library  # that is called
    rng: Rng  # chooses
    instances: list[int] = field(default_factory=list)  # that live
    state: Any = field(default_factory=ctypes.c_void_p)  # one, or null
    kept: Any = None  # bytes of a state, which may be changed
    is_whole: bool = False  # whether their sum is right

    def __post_init__(self) -> None:
        self.kept = ctypes.create_string_buffer(self.library.state_size)

    def make(self) -> str:
        """Make an instance, perhaps one that cannot be; what is wrong, or ""."""
        token = (self.library.token, self.library.token, b"{another}", None)[int(self.rng.integers(4))]
        name = (b"one", b"one", b"", None)[int(self.rng.integers(4))]
        made = self.library.instance(name, token)
        if made is not None:
            self.instances.append(made)
        may = bool(name) and token == self.library.token
        return "" if may == (made is not None) else f"an instance of {name!r} and {token!r}: {made}"

    def free(self) -> None:
        """Free an instance, or none."""
        where = int(self.rng.integers(len(self.instances) + 1))
        self.library.free(self.instances.pop(where) if where < len(self.instances) else None)

    def change(self) -> None:
        """Change a byte of the kept state, or eight; half of the time its sum is made right again."""
        data, size = bytearray(self.kept.raw), int(self.rng.choice([1, 8]))
        place = int(self.rng.integers(len(data) - _SUM - size))
        data[place : place + size] = self.rng.bytes(size)
        self.is_whole = bool(self.rng.random() < 0.5)
        if self.is_whole:
            data[-_SUM:] = sum_of(data[:-_SUM])
        self.kept.raw = bytes(data)

    def call(self) -> tuple[str, int]:
        """Call a function by chance; what is wrong, or "", and what it answered."""
        names = FUNCTIONS[self.library.fmi]
        name = list(names)[int(self.rng.integers(len(names)))]
        instance = ctypes.c_void_p(self._instance())
        passed, lacks = self._passed(names[name])
        answer = self.library.call(name, instance, *passed)
        lacks = lacks or not instance.value
        if name.startswith("Free"):
            lacks = False
        if name.lower() == "serializefmustate" and answer == _OK:
            self.is_whole = True
        if answer not in (_OK, _ERROR) or (lacks and answer == _OK):
            return f"fmi{self.library.fmi}{name} answers {answer} to {[repr(one) for one in passed]}", answer
        return "", answer

    def _instance(self) -> int | None:
        if not self.instances or self.rng.random() < _NULL:
            return None
        return self.instances[int(self.rng.integers(len(self.instances)))]

    def _passed(self, kinds: str) -> tuple[list[Any], bool]:
        """Arguments, and whether something is missing or wrong that the call cannot do without."""
        count, passed, lacks = int(self.rng.integers(_REFERENCES + 1)), [], False
        for kind in kinds:
            null = kind in "raopSsbF" and self.rng.random() < _NULL
            one = ctypes.c_void_p() if null else self._one(kind, count)
            wrong_kept = kind == "b" and kinds.endswith("S") and not self.is_whole
            strange = kind == "r" and not null and max(one[:count], default=0) >= self.library.variables
            empty = kind == "s" and not self.state.value
            needed = (kind in "pSb") or (kind in "ra" and count > 0) or kind == "s"
            lacks = lacks or (null and needed) or wrong_kept or strange or empty
            passed.append(one)
        return passed, lacks

    def _one(self, kind: str, count: int) -> Any:
        whole, rng = self.library.fmi == 2, self.rng
        if kind == "k":
            return (ctypes.c_int if whole else ctypes.c_bool)(bool(rng.integers(2)))
        if kind == "d":
            return ctypes.c_double(_NUMBERS[int(rng.integers(len(_NUMBERS)))])
        if kind in "nz":
            return ctypes.c_size_t(count if kind == "n" else self.library.state_size - int(rng.random() < 0.1))
        if kind == "r":
            return self._references()
        if kind == "i":
            return ctypes.c_int(int(rng.integers(-1, 6)))
        states = {"s": self.state, "S": ctypes.byref(self.state), "F": ctypes.byref(self.state), "b": self.kept}
        return states[kind] if kind in states else self._values()

    def _references(self) -> Any:
        most = self.library.variables if self.rng.random() < 0.9 else 1 << 32
        return (ctypes.c_uint32 * _REFERENCES)(*self.rng.integers(most, size=_REFERENCES).tolist())

    def _values(self) -> Any:
        """Room for values of any type; also an array of them."""
        return (ctypes.c_double * (2 * _REFERENCES))(*self.rng.choice(_NUMBERS[:4], size=2 * _REFERENCES).tolist())

    def end(self) -> None:
        """Free the state twice, and all instances."""
        for _ in range(2):
            self.library.call(self.library.spelled("FreeFMUState"), None, ctypes.byref(self.state))
        while self.instances:
            self.library.free(self.instances.pop())


def sum_of(data: Sequence[int]) -> bytes:
    total = 0xCBF29CE484222325
    for one in data:
        total = ((total ^ one) * 0x100000001B3) & 0xFFFF_FFFF_FFFF_FFFF
    return total.to_bytes(_SUM, "little")


def played(library: Library, rng: Rng) -> tuple[str, int]:
    """Call by chance; what is wrong, or "", and how many calls were refused."""
    master, refused, wrong = Master(library, rng), 0, ""
    for _ in range(_CALLS):
        what = rng.random()
        if what < 0.05 and len(master.instances) < _INSTANCES:
            wrong = master.make()
        elif what < 0.08:
            master.free()
        elif what < 0.12:
            master.change()
        else:
            wrong, answer = master.call()
            refused += answer != _OK
        if wrong:
            break
    master.end()
    return wrong, refused


def prepare(folder: Path) -> list[Library]:
    """The boom's sensor and plant, in FMI 2 and 3."""
    import fmpy

    from ramsight.deploy.fmu import write_fmu
    from ramsight.machine import load_machine

    made = []
    for kind in ("sensor", "plant"):
        for fmi in (2, 3):
            written = write_fmu(load_machine("mining-loader"), "boom", folder / f"{kind}{fmi}.fmu", what=kind, fmi=fmi)
            fmpy.extract(str(written.path), unzipdir=str(folder / f"{kind}{fmi}"))
            described = fmpy.read_model_description(str(written.path))
            binary = next((folder / f"{kind}{fmi}" / "binaries").rglob("*.so"))
            made.append(Library(fmi, ctypes.CDLL(str(binary)), described.guid.encode(), written.variables))
    return made


def _check(prepared: list[Library], rng: Rng, _: Path) -> tuple[str, str]:
    wrong, refused = played(prepared[int(rng.integers(len(prepared)))], np.random.default_rng(rng.integers(1 << 63)))
    return (WRONG, wrong) if wrong else (REFUSED if refused else READ, "")


SECTIONS = [Section("FMU called with nothing", CASES, prepare, _check)] if find_compiler() and find_spec("fmpy") else []
