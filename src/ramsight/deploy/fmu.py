"""Functional mock-up units: description, C sources and, where there is a compiler, the binary for this machine."""

from __future__ import annotations

import hashlib
import io
import platform
import sys
import tempfile
import uuid
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ramsight.deploy.c_function import template
from ramsight.deploy.c_step import identifier_of
from ramsight.deploy.compiler import STRICT, binaries, find_compiler, library
from ramsight.deploy.credentials import Export, credentials
from ramsight.deploy.fmu_behind import comparison_behind
from ramsight.deploy.fmu_description import build_description, description_2, description_3
from ramsight.deploy.fmu_model import FmuModel, config_text, plant_model, sensor_model
from ramsight.deploy.fmu_units import Variable
from ramsight.deploy.profiles import ControlOptions
from ramsight.errors import DescriptionError
from ramsight.machine.description import Machine
from ramsight.output import atomic_path, check_target
from ramsight.plant.unit import HydraulicUnit

WHAT = ("sensor", "control", "compare", "weighing", "plant")
VERSIONS = (2, 3)
_DATE = (1980, 1, 1, 0, 0, 0)  # of every file in the archive, so that the same content gives the same bytes


@dataclass(frozen=True)
class WrittenFmu:
    """What was written."""

    path: Path  # of the FMU
    variables: int  # how many it has
    binaries: tuple[str, ...]  # the platforms of its binaries; empty if there are none


@dataclass(frozen=True)
class MadeFmu:
    """An FMU that is no file yet."""

    content: Mapping[str, bytes]  # its files, by their places in it
    variables: tuple[Variable, ...]  # of its model
    binaries: tuple[str, ...]  # the platforms of its binaries


def write_fmu(
    machine: Machine,
    unit: str,
    out: str | Path,
    *,
    what: str = "sensor",
    fmi: int = 2,
    tabled: bool = False,
    control: ControlOptions | None = None,
    platforms: Sequence[str] | None = None,
    compiler: str | None = None,
) -> WrittenFmu:
    """Write a co-simulation FMU of a unit's virtual sensor, alone or with what stands behind it, or of the unit itself.

    Args:
        machine: the machine.
        unit: name of its unit.
        out: the file, `.fmu`.
        what: ``sensor``, ``control`` (with a position control), ``compare`` (with the comparison with a real sensor),
            ``weighing`` (with a weighing of what the unit lifts) or ``plant``.
        fmi: 2 or 3.
        tabled: of a sensor alone, the machine's numbers are parameters; a plant's always are.
        control: how a control drives.
        platforms: names of `PLATFORMS` that it has binaries for, by the package ziglang; by default that of this
            machine, by its compiler.
        compiler: path of the C compiler; by default the one that is found. Without one the FMU has sources alone.

    Raises:
        DescriptionError: there is no such sensor or version, or the unit lifts nothing that is weighed.
        OutputError: the file cannot be written.
        CompilerError: a compiler refuses the C, or ziglang is missing.

    Example:
        >>> import tempfile
        >>> from ramsight import machine
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     done = write_fmu(machine.load_machine("mining-loader"), "boom", f"{folder}/boom.fmu", compiler="")
        ...     done.path.name, done.variables, done.binaries
        ('boom.fmu', 36, ())
    """
    target = Path(out)
    check_target(target, (".fmu",))
    made = make_fmu(
        machine, unit, what=what, fmi=fmi, tabled=tabled, control=control, platforms=platforms, compiler=compiler
    )
    with atomic_path(target) as draft:
        draft.write_bytes(zipped(made.content, "modelDescription.xml"))
    return WrittenFmu(target, len(made.variables), made.binaries)


def make_fmu(
    machine: Machine,
    unit: str,
    *,
    what: str = "sensor",
    fmi: int = 2,
    tabled: bool = False,
    control: ControlOptions | None = None,
    platforms: Sequence[str] | None = None,
    compiler: str | None = None,
) -> MadeFmu:
    """Make an FMU; arguments and errors as `write_fmu`."""
    for key, value, known in (("what", what, WHAT), ("fmi", fmi, VERSIONS)):
        if value not in known:
            raise DescriptionError("there is no such FMU", key=key, value=value, allowed=", ".join(map(str, known)))
    if tabled and what != "sensor":
        raise DescriptionError("is of a sensor alone", key="parameters", value=what, allowed="sensor")
    from ramsight.plant.build import build

    built, driving = build(machine.unit(unit), unit), control or ControlOptions()
    model = _model(machine, built, what, driving, tabled)
    identifier = f"ramsight_{identifier_of(unit)}_{what}"
    files = _sources(model, fmi)
    token = _token(identifier, files)
    files["fmu_config.h"] = config_text(model, token)
    compiled = sorted(name for name in files if name.endswith(".c"))
    content: dict[str, bytes] = {f"sources/{name}": text.encode() for name, text in files.items()}
    if fmi == 2:
        content["modelDescription.xml"] = description_2(model, identifier, token, compiled).encode()
    else:
        content["modelDescription.xml"] = description_3(model, identifier, token).encode()
        content["sources/buildDescription.xml"] = build_description(identifier, compiled).encode()
    built_for = (
        binaries(files, identifier, fmi, platforms) if platforms is not None else _own(files, identifier, fmi, compiler)
    )
    content |= built_for
    asked = [] if platforms is None else [f"--platforms {','.join(platforms) or 'none'}"]
    options = (f"--what {what}", f"--fmi {fmi}", *(["--parameters"] if tabled else []), *asked)
    command = ("fmu", *options, *(driving.words if what == "control" else ()))
    own = credentials(Export(machine, built, what, command), content)
    content |= {f"resources/{name}": text.encode() for name, text in own.items()}
    return MadeFmu(content, model.variables, tuple(name.split("/")[1] for name in built_for))


def zipped(content: Mapping[str, bytes], first: str) -> bytes:
    """An archive, the same for the same content; one file comes first in it."""
    found = io.BytesIO()
    with zipfile.ZipFile(found, "w") as archive:
        for name in sorted(content, key=lambda name: (name != first, name)):
            entry = zipfile.ZipInfo(name, _DATE)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            entry.create_system = 3  # those are a Unix file's rights, on every system
            archive.writestr(entry, content[name])
    return found.getvalue()


def _own(files: dict[str, str], identifier: str, fmi: int, compiler: str | None) -> dict[str, bytes]:
    """The library for this machine by its own compiler, by its place in the FMU; nothing where there is none."""
    found, place = find_compiler() if compiler is None else compiler, _platform(fmi)
    if not found or place is None:
        return {}
    with tempfile.TemporaryDirectory() as folder:
        binary = Path(folder) / "library"
        library(found, files, binary, *STRICT, "-fvisibility=hidden")
        suffix = ".dylib" if sys.platform == "darwin" else ".so"
        return {f"binaries/{place}/{identifier}{suffix}": binary.read_bytes()}


def _model(machine: Machine, built: HydraulicUnit, what: str, control: ControlOptions, tabled: bool) -> FmuModel:
    if what == "plant":
        return plant_model(built, machine.name)
    prefix = f"ramsight_{identifier_of(built.name)}"
    behind = None
    if what == "control":
        from ramsight.deploy.fmu_control import control_behind

        behind = control_behind(control.block(built), built, prefix, machine.name)
    elif what == "compare":
        behind = comparison_behind(built, prefix, machine.name)
    elif what == "weighing":
        from ramsight.deploy.fmu_weighing import weighing_behind

        behind = weighing_behind(machine, built.name, prefix)
    return sensor_model(built, prefix, machine.name, behind, tabled=tabled)


def _sources(model: FmuModel, fmi: int) -> dict[str, str]:
    shared = ("fmu.h", "fmi_common.h", f"fmi{fmi}.h", f"fmi{fmi}.c")
    return {**model.files, **{name: template(name) for name in shared}}


def _token(identifier: str, files: dict[str, str]) -> str:
    """The same for the same content, another for any other."""
    digest = hashlib.sha256("\0".join((identifier, *(f"{n}\0{files[n]}" for n in sorted(files)))).encode()).digest()
    return f"{{{uuid.UUID(bytes=digest[:16], version=5)}}}"


def _platform(fmi: int) -> str | None:
    """The folder of this machine's binaries, if FMI has a name for it."""
    machine = {"AMD64": "x86_64", "arm64": "aarch64"}.get(platform.machine(), platform.machine())
    system = {"linux": "linux", "darwin": "darwin"}.get(sys.platform)
    if fmi == 3:
        return f"{machine}-{system}" if system else None
    return {("x86_64", "linux"): "linux64", ("x86_64", "darwin"): "darwin64"}.get((machine, system or ""))
