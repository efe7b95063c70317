"""The package as others get it: what is in wheel and sdist, and whether it works where nothing else is.

    python package/check.py dist [CYCLONEDX_PY]

Looks into both files, then installs the wheel without extras into a fresh environment of each Python that is here, from
3.11 to 3.13, counts what that brings, and runs the demonstration and some work there, in an empty folder. What the
newest environment holds is the release's bill of materials (`sbom.py`), written beside the wheel.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path

import sbom

ROOT = Path(__file__).parent.parent
PINS = ROOT / "requirements" / "dev.txt"
VERSIONS = ("3.11", "3.12", "3.13")
LARGEST_WHEEL = 1_800_000  # bytes; code alone: a larger one has something in it that does not belong there
MOST_PACKAGES = 16  # that a wheel without extras brings
LARGEST_CORE = 600  # MB, those packages; CasADi and LLVM alone have 450
OF_PIP = ("pip", "setuptools", "pkg_resources", "_distutils")  # what an empty environment has
NEEDED = (
    "ramsight/py.typed",
    "ramsight/machine/catalogue/machines/mining-loader.toml",
    "ramsight/deploy/c/sensor.c",
    "ramsight/deploy/web/sensor.mjs",
    "ramsight/deploy/web/page/page.html",
    "ramsight/deploy/encoder/ramsight-encoder.eds",
    "ramsight/studio/assets/studio.js",
    "ramsight/studio/assets/uPlot.LICENSE",
    "ramsight/studio/assets/uPlot.iife.min.js",
    "ramsight/demo/workday.csv.gz",
    "ramsight/demo/workday_truth.csv.gz",
)
WHEEL_TOO = tuple(f"ramsight/studio/{page}.md" for page in ("status", "messages"))  # copies of docs/reference
SDIST_TOO = (
    "pyproject.toml",
    "README.md",
    "LICENSE",
    "CHANGELOG.md",
    "CITATION.cff",
    "Makefile",
    "tests/conftest.py",
    "docs/index.md",
    "docs/reference/status.md",
)


def main(folder: Path, program: str | None = None) -> None:
    """Check what was built; ends with an error where something is wrong.

    Args:
        folder: with wheel and sdist.
        program: that writes the bill of materials; None for none.
    """
    (wheel,), (sdist,) = (sorted(folder.glob(pattern)) for pattern in ("*.whl", "*.tar.gz"))
    check_files(wheel, sdist)
    found = list(interpreters())
    if not found:
        sys.exit("no Python to install into")
    newest, _ = found[-1]
    for version, python in found:
        print(f"Python {version}: {python}", flush=True)
        with tempfile.TemporaryDirectory() as place:
            installed(python, wheel, Path(place), optimize=version == newest)
            if version == newest and program is not None:
                sbom.main(program, Path(place) / "env" / "bin" / "python", wheel.with_suffix(".cdx.json"))


def check_files(wheel: Path, sdist: Path) -> None:
    """Refuse a wheel or an sdist that lacks something, or has what is not its own."""
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        (metadata,) = (archive.read(name).decode() for name in names if name.endswith(".dist-info/METADATA"))
    with tarfile.open(sdist) as archive:
        packed = {name.partition("/")[2] for name in archive.getnames()}
    missing = [name for name in NEEDED if name not in names or f"src/{name}" not in packed]
    missing += [name for name in WHEEL_TOO if name not in names]
    missing += [name for name in SDIST_TOO if name not in packed]
    foreign = [name for name in names if not name.startswith("ramsight") or "__pycache__" in name]
    sources = {f"{path.relative_to(ROOT / 'src')}" for path in (ROOT / "src" / "ramsight").rglob("*.py")}
    missing += sorted(sources - names)
    if missing or foreign:
        sys.exit(f"missing: {', '.join(missing) or 'nothing'}; foreign: {', '.join(foreign) or 'nothing'}")
    if wheel.stat().st_size > LARGEST_WHEEL:
        sys.exit(f"{wheel.name} has {wheel.stat().st_size} bytes, at most {LARGEST_WHEEL} are wanted")
    for words in ("Requires-Python: >=3.11", "License-Expression: MIT", "Description-Content-Type: text/markdown"):
        if words not in metadata:
            sys.exit(f"the wheel's metadata lacks {words!r}")
    print(f"{wheel.name}: {len(names)} files, {wheel.stat().st_size // 1000} kB; {sdist.name}: {len(packed)} files")


def interpreters() -> Iterator[tuple[str, str]]:
    """Each version that is here, once: on the path, or where pyenv keeps them."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    for version in VERSIONS:
        name = f"python{version}"
        kept = sorted(str(path) for path in pyenv.glob(f"versions/{version}.*/bin/{name}"))
        for python in filter(None, (shutil.which(name), *kept)):
            done = subprocess.run([python, "-c", ""], capture_output=True, check=False)
            if done.returncode == 0:
                yield version, python
                break


def check_core(listed: str, environment: Path, seconds: float) -> None:
    """Refuse an installation without extras that has too many packages, or too large ones; print what it has."""
    names = {line.partition("==")[0].lower() for line in listed.split()} - {"pip", "setuptools", "ramsight"}
    (packages,) = environment.glob("lib/python3*/site-packages")
    sizes = {one.name: size_of(one) for one in packages.iterdir() if not one.name.startswith(OF_PIP)}
    whole, largest = sum(sizes.values()), sorted(sizes, key=lambda name: -sizes[name])[:4]
    shown = ", ".join(f"{name} {sizes[name]:.0f}" for name in largest)
    print(f"without extras: {len(names)} packages, {whole:.0f} MB ({shown}), {seconds:.0f} s", flush=True)
    if len(names) > MOST_PACKAGES or whole > LARGEST_CORE:
        sys.exit(f"at most {MOST_PACKAGES} packages and {LARGEST_CORE} MB are wanted: {', '.join(sorted(names))}")


def size_of(path: Path) -> float:
    """What a file or a folder takes on the disk [MB]."""
    files = [path] if path.is_file() else [one for one in path.rglob("*") if one.is_file() and not one.is_symlink()]
    return sum(512 * one.stat().st_blocks for one in files) / 2**20


def installed(python: str, wheel: Path, place: Path, *, optimize: bool) -> None:
    """Install a wheel into a fresh environment in a folder, and work with it there.

    Args:
        python: that the environment is of.
        wheel: what is installed.
        place: the folder.
        optimize: whether machine code is optimized, which takes long and does not depend on the version of Python.
    """
    environment = {
        name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "RAMSIGHT", "MYPY"))
    }
    environment["RAMSIGHT_CACHE"] = str(place / "cache")
    if not optimize:
        environment["RAMSIGHT_OPTIMIZE"] = "no"

    def run(*command: str | Path) -> str:
        done = subprocess.run(
            [str(word) for word in command], cwd=place, env=environment, capture_output=True, text=True, check=False
        )
        if done.returncode:
            sys.exit(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
        return done.stdout

    run(python, "-m", "venv", place / "env")
    binaries = place / "env" / "bin"
    pip = (binaries / "python", "-m", "pip", "--disable-pip-version-check", "-q")
    begin = time.monotonic()
    (place / "pins.txt").write_text("\n".join(re.findall(r"^[\w.-]+==[^\s;]+", PINS.read_text(), flags=re.MULTILINE)))
    run(*pip, "install", "--constraint", place / "pins.txt", wheel.resolve())
    seconds = time.monotonic() - begin
    run(*pip, "check")
    check_core(run(*pip[:-1], "list", "--format", "freeze"), place / "env", seconds)
    work = place / "work"
    work.mkdir()
    print(run(binaries / "ramsight", "demo"), end="", flush=True)
    shutil.copy(Path(__file__).with_name("smoke.py"), work)
    print(run(binaries / "python", "-I", work / "smoke.py"), end="", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:])
