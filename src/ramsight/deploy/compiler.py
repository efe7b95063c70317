"""The C compiler, if there is one: what it makes of exported C, how large it is and how fast."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
from base64 import b64decode, b64encode
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path

from ramsight.engine.kept import keep, key_of, read_kept
from ramsight.errors import DescriptionError, RamsightError
from ramsight.optional import imported

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror")
"""How exported C compiles."""


_RUNS = 3  # of the test program; the fastest counts, others were disturbed
_ROUNDS = 100  # over the golden samples in each, a third of a second


class CompilerError(RamsightError):
    """Exported C that the compiler refuses."""


@dataclass(frozen=True)
class Footprint:
    """What a sensor takes on this machine."""

    precision: str  # ``double`` or ``float``
    optimised: str  # the compiler's level
    code: int  # bytes of code and constants
    stack: int  # bytes of the step's frame
    state: int  # bytes of the struct
    saved: int  # bytes of a slot
    step: float  # time of a step [s]


@dataclass(frozen=True)
class ControlFootprint:
    """What a position control or a weighing takes on this machine, compiled with ``-O2``."""

    code: int  # bytes of code and constants
    state: int  # bytes of the struct
    step: float  # time of a step [s]


def find_compiler() -> str | None:
    """`$CC`, gcc, clang or cc, whichever is there first and runs: on macOS a name may have no compiler behind it."""
    names = [os.environ.get("CC"), "gcc", "clang", "cc"]
    return next((path for name in names if name and (path := shutil.which(name)) and _runs(path)), None)


@cache
def _runs(compiler: str) -> bool:
    try:
        return subprocess.run([compiler, "--version"], capture_output=True, check=False).returncode == 0
    except OSError:
        return False


def version(compiler: str) -> str:
    """The name and version that the compiler reports."""
    return run([compiler, "--version"], Path()).splitlines()[0]


def run(command: Sequence[str], folder: Path) -> str:
    """Run a command in a folder and give its output.

    Raises:
        CompilerError: it fails; the text has the first error that it reports.
    """
    # gcc quotes in UTF-8, whatever a console of Windows has.
    done = subprocess.run(command, cwd=folder, capture_output=True, check=False, encoding="utf-8", errors="replace")
    if done.returncode:
        said = (done.stderr or done.stdout).strip().splitlines()
        # What a linker lacks stands before the driver's own line, and is not called an error.
        reasons = (line for line in said if "error" in line or "undefined reference" in line)
        first = next(reasons, said[0] if said else f"exit code {done.returncode}")
        raise CompilerError(f"{Path(command[0]).name} failed: {first}")
    return done.stdout


def library(compiler: str, files: Mapping[str, str], target: Path, *options: str) -> None:
    """Compile C files into one shared library; what the same compiler made of the same files before is taken again.

    Args:
        files: text by name; all `.c` are compiled.
    """
    key = key_of("library", _identity(compiler), options, files)
    found = read_kept(key)
    if found is not None:
        target.write_bytes(b64decode(found["library"]))
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file, text in files.items():
            (folder / file).write_text(text, encoding="utf-8", newline="\n")
        sources = sorted(file for file in files if file.endswith(".c"))
        objects = compile_files([compiler, "-O2", "-fPIC", *options], sources, folder)
        run([compiler, "-shared", *options, *objects, "-o", "library.so", "-lm"], folder)
        shutil.copyfile(folder / "library.so", target)
    keep(key, {"library": b64encode(target.read_bytes()).decode()})


def footprint(compiler: str, folder: Path, prefix: str, *, single: bool, optimised: str) -> Footprint:
    """Compile and run the golden samples of an exported folder, and measure; the same C is measured once by a compiler.

    Args:
        optimised: ``-O2`` or ``-Os``.
    """
    options = [optimised, "-fstack-usage", f"-D{prefix.upper()}_FLOAT={int(single)}"]
    key = key_of("footprint", _identity(compiler), _texts(folder), prefix, options)
    if (found := read_kept(key)) is not None:
        return Footprint(**found)
    with _copied(folder) as work:
        step = _timed(compiler, work, prefix, options)
        stack = _stack(work, prefix)
        state, saved = _numbers(compiler, work, prefix, [f"sizeof({prefix})", f"{prefix.upper()}_BYTES"], options)
        code = _code_bytes(work, prefix)
    measured = Footprint("float" if single else "double", optimised, code, stack, state, saved, step)
    keep(key, asdict(measured))
    return measured


def control_footprint(compiler: str, folder: Path, name: str) -> ControlFootprint:
    """Compile and run the golden samples of what stands beside a sensor, and measure; the folder stays as it is.

    Args:
        name: of its C and its struct, for example ``ramsight_boom_control``.
    """
    options = ["-O2"]
    key = key_of("control-footprint", _identity(compiler), _texts(folder), name, options)
    if (found := read_kept(key)) is not None:
        return ControlFootprint(**found)
    with _copied(folder) as work:
        step = _timed(compiler, work, name, options)
        (state,) = _numbers(compiler, work, name, [f"sizeof({name})"], options)
        code = _code_bytes(work, name)
    measured = ControlFootprint(code, state, step)
    keep(key, asdict(measured))
    return measured


def _identity(compiler: str) -> tuple[str, int, int, str]:
    """What tells a compiler from another one."""
    path = Path(compiler).resolve()
    known = path.stat()
    return str(path), known.st_size, known.st_mtime_ns, version(compiler)


def _texts(folder: Path) -> dict[str, str]:
    """The C of an exported folder."""
    return {file.name: file.read_text(encoding="utf-8") for file in sorted(folder.glob("*.[ch]"))}


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
    objects = compile_files(common, bodies(work, name), work)
    run([*common, *objects, f"{name}_test.c", "-lm", "-o", "golden"], work)
    said = (run([str(work / "golden")], work) for _ in range(_RUNS))
    return 1e-9 * min(int(re.findall(r"([0-9]+) ns a step", one)[0]) for one in said)


def _numbers(compiler: str, work: Path, name: str, asked: Sequence[str], options: Sequence[str]) -> list[int]:
    """What constant expressions are worth behind `name.h`."""
    said = " ".join(f"(int)({one})," for one in asked).rstrip(",")
    probe = f'#include <stdio.h>\n#include "{name}.h"\nint main(void) {{ printf("{" %d" * len(asked)}", {said}); '
    (work / "probe.c").write_text(probe + "return 0; }\n", encoding="utf-8", newline="\n")
    run([compiler, *STRICT, *options, "probe.c", "-o", "probe"], work)
    return [int(word) for word in run([str(work / "probe")], work).split()]


def bodies(folder: Path, name: str) -> list[str]:
    """The files that `name.h` is the header of: its body, and the parts of its step."""
    return [f"{name}.c", *sorted(file.name for file in folder.glob(f"{name}_step_*.c"))]


def compile_files(command: Sequence[str], sources: Sequence[str], folder: Path) -> list[str]:
    """Compile files beside each other; the names of their objects."""
    objects = [source.removesuffix(".c") + ".o" for source in sources]
    pairs = sorted(zip(sources, objects, strict=True), key=lambda pair: -(folder / pair[0]).stat().st_size)
    with ThreadPoolExecutor(os.cpu_count()) as pool:  # the longest first
        list(pool.map(lambda pair: run([*command, "-c", pair[0], "-o", pair[1]], folder), pairs))
    return objects


def _stack(work: Path, prefix: str) -> int:
    """Bytes of stack of a step: its frame, with those of a part of it and of that part's function that takes most."""
    said = "".join(file.read_text(encoding="utf-8") for file in sorted(work.glob(f"{prefix}*.su")))
    frames = {name: int(taken) for name, taken in re.findall(r":(\w+)\t([0-9]+)", said)}
    deepest: dict[str, list[int]] = defaultdict(lambda: [0, 0])
    for name, taken in frames.items():
        if found := re.fullmatch(rf"{prefix}_step_([a-z_]+?)(_[0-9]+)?", name):
            levels = deepest[found[1]]
            levels[found[2] is not None] = max(levels[found[2] is not None], taken)
    return frames[f"{prefix}_step"] + max((sum(levels) for levels in deepest.values()), default=0)


def _code_bytes(folder: Path, name: str) -> int:
    """Bytes of code and constants, by `size` of the binutils that every gcc comes with."""
    objects = [body.removesuffix(".c") + ".o" for body in bodies(folder, name)]
    return sum(int(line.split()[0]) for line in run(["size", *objects], folder).splitlines()[1:])


@dataclass(frozen=True)
class Platform:
    """A machine that an FMU runs on."""

    target: str  # as zig calls it; of glibc the oldest that serves
    folders: Mapping[int, str]  # of its binaries, by the version of FMI
    suffix: str  # of a shared library


PLATFORMS = {
    "linux64": Platform("x86_64-linux-gnu.2.17", {2: "linux64", 3: "x86_64-linux"}, ".so"),
    "linux-aarch64": Platform("aarch64-linux-gnu.2.17", {2: "aarch64-linux", 3: "aarch64-linux"}, ".so"),
    "win64": Platform("x86_64-windows-gnu", {2: "win64", 3: "x86_64-windows"}, ".dll"),
    "darwin64": Platform("x86_64-macos", {2: "darwin64", 3: "x86_64-darwin"}, ".dylib"),
    "darwin-arm64": Platform("aarch64-macos", {2: "aarch64-darwin", 3: "aarch64-darwin"}, ".dylib"),
}
"""By name; FMI 2.0 has names of folders for 64-bit Intel alone, and importers take those of FMI 3.0 for others."""
# Nothing is fused, so that every platform rounds as this one does; no symbols, which would hold paths.
LIBRARY_OPTIONS = (*STRICT, "-O2", "-fPIC", "-ffp-contract=off", "-fvisibility=hidden", "-shared", "-s")
"""How a library is compiled."""


def platforms_of(text: str | None) -> tuple[str, ...] | None:
    """Names of platforms; None if nothing is asked for: then it is this machine.

    Args:
        text: names with commas between, ``all`` or ``none``.

    Raises:
        DescriptionError: there is no such platform.

    Example:
        >>> platforms_of("win64, linux64"), platforms_of("none"), len(platforms_of("all"))
        (('win64', 'linux64'), (), 5)
    """
    if text is None:
        return None
    if text in ("all", "none"):
        return tuple(PLATFORMS) if text == "all" else ()
    names = tuple(name.strip() for name in text.split(","))
    for name in names:
        if name not in PLATFORMS:
            known = ", ".join((*PLATFORMS, "all", "none"))
            raise DescriptionError("there is no such platform", key="platforms", value=name, allowed=known)
    return names


def binaries(files: Mapping[str, str], identifier: str, fmi: int, names: Iterable[str]) -> dict[str, bytes]:
    """Shared libraries of an FMU's sources, by their place in it.

    Args:
        files: sources, text by name; all `.c` are compiled.

    Raises:
        CompilerError: the package ziglang is missing, or its compiler refuses the C.
    """
    found: dict[str, bytes] = {}
    chosen = [PLATFORMS[name] for name in names]
    zig = zig_for("binaries for other platforms") if chosen else ""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for file, text in files.items():
            (folder / file).write_text(text, encoding="utf-8", newline="\n")
        sources = sorted(file for file in files if file.endswith(".c"))
        for one in chosen:
            name = f"{identifier}{one.suffix}"
            math = [] if one.suffix == ".dll" else ["-lm"]
            run([zig, "cc", "-target", one.target, *LIBRARY_OPTIONS, *sources, "-o", name, *math], folder)
            found[f"binaries/{one.folders[fmi]}/{name}"] = (folder / name).read_bytes()
    return found


def zig_for(use: str) -> str:
    """The path of the C compiler zig.

    Raises:
        CompilerError: the package ziglang is missing.
    """
    package = imported("ziglang", "platforms", lambda text: CompilerError(f"{use}: {text}"))
    (place,) = package.__path__
    return str(Path(place) / "zig")
