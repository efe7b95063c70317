"""Binaries of an FMU for other machines than this one, by the C compiler of the package ziglang."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from ramsight.deploy.compiler import STRICT, CompilerError, run
from ramsight.errors import DescriptionError
from ramsight.optional import imported


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
OPTIONS = (*STRICT, "-O2", "-fPIC", "-ffp-contract=off", "-fvisibility=hidden", "-shared", "-s")
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
            run([zig, "cc", "-target", one.target, *OPTIONS, *sources, "-o", name, *math], folder)
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
