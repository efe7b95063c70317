"""The C compiler, if there is one: what it makes of exported C, how large it is and how fast."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from ramsight.errors import RamsightError

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror")
"""How exported C compiles."""


_RUNS = 3  # of the test program; the fastest counts, others were disturbed
_ROUNDS = 100  # over the golden samples in each, a third of a second


class CompilerError(RamsightError):
    """Exported C that the compiler refuses."""


@dataclass(frozen=True)
class Footprint:
    """What a sensor takes on this machine.

    Attributes:
        precision: ``double`` or ``float``.
        optimised: the compiler's level.
        code: bytes of code and constants.
        stack: bytes of the step's frame.
        state: bytes of the struct.
        saved: bytes of a slot.
        step: time of a step [s].
    """

    precision: str
    optimised: str
    code: int
    stack: int
    state: int
    saved: int
    step: float


@dataclass(frozen=True)
class ControlFootprint:
    """What a position control takes on this machine, compiled with ``-O2``.

    Attributes:
        code: bytes of code and constants.
        state: bytes of the struct.
        step: time of a step [s].
    """

    code: int
    state: int
    step: float


def find_compiler() -> str | None:
    """`$CC`, gcc, clang or cc, whichever is there first."""
    names = [os.environ.get("CC"), "gcc", "clang", "cc"]
    return next((path for name in names if name and (path := shutil.which(name))), None)


def version(compiler: str) -> str:
    """The name and version that the compiler reports."""
    return run([compiler, "--version"], Path()).splitlines()[0]


def run(command: Sequence[str], folder: Path) -> str:
    """Run a command in a folder and give its output.

    Raises:
        CompilerError: it fails; the text has the first error that it reports.
    """
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        said = (done.stderr or done.stdout).strip().splitlines()
        first = next((line for line in said if "error" in line), said[0] if said else f"exit code {done.returncode}")
        raise CompilerError(f"{Path(command[0]).name} failed: {first}")
    return done.stdout


def library(compiler: str, files: Mapping[str, str], target: Path, *options: str) -> None:
    """Compile C files into one shared library.

    Args:
        compiler: its path.
        files: text by name; all `.c` are compiled.
        target: the library.
        options: further ones.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file, text in files.items():
            (folder / file).write_text(text, encoding="utf-8")
        sources = sorted(file for file in files if file.endswith(".c"))
        run([compiler, "-O2", "-fPIC", "-shared", *options, *sources, "-o", "library.so", "-lm"], folder)
        shutil.copyfile(folder / "library.so", target)


def footprint(compiler: str, folder: Path, prefix: str, *, single: bool, optimised: str) -> Footprint:
    """Compile and run the golden samples of an exported folder, and measure.

    Args:
        compiler: its path.
        folder: the exported folder; nothing is written there.
        prefix: of the names in it.
        single: with floats.
        optimised: ``-O2`` or ``-Os``.
    """
    options = [optimised, "-fstack-usage", f"-D{prefix.upper()}_FLOAT={int(single)}"]
    with _copied(folder) as work:
        step = _timed(compiler, work, prefix, options)
        (stack,) = re.findall(rf":{prefix}_step\t([0-9]+)", (work / f"{prefix}.su").read_text(encoding="utf-8"))
        state, saved = _numbers(compiler, work, prefix, [f"sizeof({prefix})", f"{prefix.upper()}_BYTES"], options)
        code = _code_bytes(work / f"{prefix}.o")
    return Footprint("float" if single else "double", optimised, code, int(stack), state, saved, step)


def control_footprint(compiler: str, folder: Path, prefix: str) -> ControlFootprint:
    """Compile and run the golden samples of an exported control, and measure; nothing is written into the folder.

    Args:
        compiler: its path.
        folder: the exported folder.
        prefix: of the names in it.
    """
    name, options = f"{prefix}_control", ["-O2"]
    with _copied(folder) as work:
        step = _timed(compiler, work, name, options)
        (state,) = _numbers(compiler, work, name, [f"sizeof({name})"], options)
        code = _code_bytes(work / f"{name}.o")
    return ControlFootprint(code, state, step)


@contextmanager
def _copied(folder: Path) -> Iterator[Path]:
    """A folder with the C of an exported one, to be worked in."""
    with tempfile.TemporaryDirectory() as place:
        for file in folder.glob("*.[ch]"):
            shutil.copyfile(file, Path(place) / file.name)
        yield Path(place)


def _timed(compiler: str, work: Path, name: str, options: Sequence[str]) -> float:
    """Compile `name.c`, link it with its golden samples, and run them: the least time of a step [s]."""
    common = [compiler, *STRICT, *options, f"-DROUNDS={_ROUNDS}"]
    run([*common, "-c", f"{name}.c", "-o", f"{name}.o"], work)
    run([*common, f"{name}.o", f"{name}_test.c", "-lm", "-o", "golden"], work)
    return 1e-9 * min(_step_nanoseconds(run([str(work / "golden")], work)) for _ in range(_RUNS))


def _numbers(compiler: str, work: Path, name: str, asked: Sequence[str], options: Sequence[str]) -> list[int]:
    """What constant expressions are worth behind `name.h`."""
    said = " ".join(f"(int)({one})," for one in asked).rstrip(",")
    probe = f'#include <stdio.h>\n#include "{name}.h"\nint main(void) {{ printf("{" %d" * len(asked)}", {said}); '
    (work / "probe.c").write_text(probe + "return 0; }\n", encoding="utf-8")
    run([compiler, *STRICT, *options, "probe.c", "-o", "probe"], work)
    return [int(word) for word in run([str(work / "probe")], work).split()]


def _step_nanoseconds(said: str) -> int:
    return int(re.findall(r"([0-9]+) ns a step", said)[0])


def _code_bytes(file: Path) -> int:
    """Bytes of an object's code and constants, by `size` of the binutils that every gcc comes with."""
    return int(run(["size", str(file)], file.parent).splitlines()[1].split()[0])
