"""Sensors and plants for other runtimes."""

from __future__ import annotations

import csv
import io
import shutil
from pathlib import Path

from ramsight.api.arguments import path_argument
from ramsight.argument_kinds import by_kind, check_path, whole_argument
from ramsight.deploy.c_folder import STEPS, WrittenSensor, write_sensor
from ramsight.deploy.compiler import platforms_of
from ramsight.deploy.diagnostic_coverage import CoverageTable, read_table
from ramsight.deploy.fmeda import fmeda_table
from ramsight.deploy.fmu import WrittenFmu, write_fmu
from ramsight.deploy.machine_parameters import write_parameters
from ramsight.deploy.page import SHOWN, write_page
from ramsight.deploy.profiles import ControlOptions, profile_of
from ramsight.deploy.ssp import WrittenSsp, write_ssp
from ramsight.deploy.wasm import STEPS as WASM_STEPS
from ramsight.deploy.wasm import WrittenWasm, write_wasm
from ramsight.duty.drive_response import IDEAL, DriveResponse
from ramsight.errors import DescriptionError
from ramsight.machine import AnyMachine, load_machine, only_unit
from ramsight.machine.description import Machine
from ramsight.output import check_target, write_text
from ramsight.plant.build import AnyUnit, build
from ramsight.progress import advancing
from ramsight.tool.force_scale import Scale
from ramsight.units import argument

FMI = (2, 3)
"""The least and the newest version of FMI."""


@by_kind
def export_c(
    machine: AnyMachine,
    unit: str | None = None,
    *,
    out: str | Path,
    single: bool = False,
    parameters: bool = False,
    control: bool = False,
    speed: str | float | None = None,
    force: str | float | None = None,
    period: str | float | None = None,
    drive_delay: str | float | DriveResponse | None = None,
    weighing: bool = False,
    scale: Scale | None = None,
    profile: str = "kalman",
    measure: bool = False,
    compiler: str | None = None,
    progress: bool = False,
) -> WrittenSensor:
    """Write the kalman sensor of a unit as C99 for an electronic control unit, and a position control if it is wanted.

    Args:
        machine: a machine, its name or file.
        unit: name of the unit; may be left out where there is only one.
        out: the folder; made if it is not there, files of an earlier export are replaced.
        single: floats in place of doubles.
        parameters: the machine's numbers are a table that the sensor is handed: one build for all machines of the kind
            (`export_parameters`).
        control: the unit's position control too (docs/how-to/control.md); what follows is of it alone.
        speed: largest velocity [m/s]; by default half of what the motor could do.
        force: largest load against a motion that is pushed on [N]; by default none.
        period: of the control's samples [s]; by default 20 ms.
        drive_delay: by which the drive is late, with commands and with reports each [s], or all that is declared of it;
            by default it follows at once. The control stops a drive that does otherwise.
        weighing: a weighing of what the unit lifts too; a C that a controller weighs with.
        scale: of that, as `weigh` learned it from known masses; by default the description's.
        profile: what the sensor weighs: ``kalman``, or ``kalman-small`` or ``balance`` for fewer operations
            (docs/export.md).
        measure: compile and run it in both precisions, for speed and for size; by default once, as it is exported.
        compiler: path of the C compiler that measures it; by default the one that is found, "" for none.
        progress: show a bar on a terminal if it takes long.

    Returns:
        The folder, the names of its files, the compiler, and what it takes of memory [bytes] and time [s].

    Raises:
        DescriptionError: the machine cannot be read, or has several units and none is named; or the unit lifts nothing
            that is weighed.
        UnknownNameError: no such machine or unit.
        OutputError: the folder cannot be written.

    Example:
        >>> import ramsight, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     done = ramsight.export_c("mining-loader", "boom", out=f"{folder}/boom-c", compiler="")
        >>> "ramsight_boom.c" in done.files
        True
    """
    described, name = _unit_of(machine, unit)
    driving = _driving(control, speed, force, period, drive_delay)
    if scale is not None and not weighing:
        raise DescriptionError("is of a weighing, and none is exported", key="scale", value="a scale")
    with advancing(STEPS, "exporting", shown=progress) as advance:
        return write_sensor(
            described, name, out, single=single, tabled=parameters, control=driving, weighing=weighing, scale=scale,
            profile=profile_of(profile), measure=measure, compiler=_compiler(compiler), advance=advance,
        )  # fmt: skip


@by_kind
def export_fmu(
    machine: AnyMachine,
    unit: str | None = None,
    *,
    out: str | Path,
    what: str = "sensor",
    fmi: int = 2,
    parameters: bool = False,
    platforms: str | None = None,
    speed: str | float | None = None,
    force: str | float | None = None,
    period: str | float | None = None,
    drive_delay: str | float | DriveResponse | None = None,
    compiler: str | None = None,
) -> WrittenFmu:
    """Write a co-simulation FMU of a unit's kalman sensor, alone or with what stands behind it, or of the unit itself.

    Args:
        machine: a machine, its name or file.
        unit: name of the unit; may be left out where there is only one.
        out: the file, `.fmu`.
        what: ``sensor``, ``control`` (with a position control), ``compare`` (with the comparison with a real sensor),
            ``weighing`` (with a weighing of what the unit lifts) or ``plant``.
        fmi: 2 or 3.
        parameters: of a sensor alone, the machine's numbers are parameters of the FMU; a plant's always are.
        platforms: that it has binaries for, names with commas between (``linux64``, ``linux-aarch64``, ``win64``,
            ``darwin64``, ``darwin-arm64``), ``all`` or ``none``, by the extra ``platforms``; by default this machine.
        speed: of a control: largest velocity [m/s]; by default half of what the motor could do.
        force: of a control: largest load against a motion that is pushed on [N]; by default none.
        period: of a control's samples [s]; by default 20 ms.
        drive_delay: of a control: as `export_c` has it.
        compiler: path of the C compiler; by default the one that is found. Without one, "", it has sources alone.

    Returns:
        The file, its number of variables, and the platforms of its binaries.

    Raises:
        DescriptionError: there is no such FMU, or the machine has several units and none is named.
        UnknownNameError: no such machine or unit.
        OutputError: the file cannot be written.

    Example:
        >>> import ramsight, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     done = ramsight.export_fmu("mining-loader", "boom", out=f"{folder}/boom.fmu", compiler="")
        >>> done.path.name, done.variables > 20
        ('boom.fmu', True)
    """
    described, name = _unit_of(machine, unit)
    driving = _driving(what == "control", speed, force, period, drive_delay) or ControlOptions()
    return write_fmu(
        described, name, out, what=what, fmi=whole_argument(fmi, "fmi", *FMI), tabled=parameters, control=driving,
        platforms=platforms_of(platforms), compiler=_compiler(compiler),
    )  # fmt: skip


@by_kind
def export_ssp(
    machine: AnyMachine,
    unit: str | None = None,
    *,
    out: str | Path,
    control: bool = False,
    fmi: int = 2,
    platforms: str | None = None,
    speed: str | float | None = None,
    force: str | float | None = None,
    period: str | float | None = None,
    drive_delay: str | float | DriveResponse | None = None,
    compiler: str | None = None,
) -> WrittenSsp:
    """Write a package (SSP 1.0) of a unit's plant and its sensor, or the control that drives it, wired together.

    Args:
        machine: a machine, its name or file.
        unit: name of the unit; may be left out where there is only one.
        out: the file, `.ssp`.
        control: with the position control, which has the sensor inside, in the place of the sensor.
        fmi: version of the FMUs: 2 or 3.
        platforms: as `export_fmu` has it.
        speed: of a control: as `export_fmu` has it.
        force: of a control: as `export_fmu` has it.
        period: of a control: as `export_fmu` has it.
        drive_delay: of a control: as `export_fmu` has it.
        compiler: path of the C compiler; by default the one that is found. Without one, "", FMUs have sources alone.

    Returns:
        The file, its components, and how many connections and parameters it has.

    Raises:
        DescriptionError: there is no such FMU, or the machine has several units and none is named.
        UnknownNameError: no such machine or unit.
        OutputError: the file cannot be written.

    Example:
        >>> import ramsight, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     ramsight.export_ssp("mining-loader", "boom", out=f"{folder}/boom.ssp", compiler="").components
        ('plant', 'sensor')
    """
    described, name = _unit_of(machine, unit)
    driving = _driving(control, speed, force, period, drive_delay)
    return write_ssp(
        described,
        name,
        out,
        control=driving,
        fmi=whole_argument(fmi, "fmi", *FMI),
        platforms=platforms_of(platforms),
        compiler=_compiler(compiler),
    )


@by_kind
def export_wasm(
    machine: AnyMachine, unit: str | None = None, *, out: str | Path, progress: bool = False
) -> WrittenWasm:
    """Write the kalman sensor of a unit as WebAssembly with an ES module, for browsers, Node and gateways.

    It needs the extra ``platforms``. Where Node is installed the golden samples are run once.

    Args:
        machine: a machine, its name or file.
        unit: name of the unit; may be left out where there is only one.
        out: the folder; made if it is not there, files of an earlier export are replaced.
        progress: show a bar on a terminal if it takes long.

    Returns:
        The folder, the names of its files, the size of the module [bytes], and what the golden samples said.

    Raises:
        CompilerError: the package ziglang is missing, or the golden samples fail.
        DescriptionError: the machine cannot be read, or has several units and none is named.
        UnknownNameError: no such machine or unit.
        OutputError: the folder cannot be written.

    Example:
        >>> import ramsight, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     done = ramsight.export_wasm("mining-loader", "boom", out=f"{folder}/boom-wasm")
        >>> "ramsight_boom.wasm" in done.files, done.bytes < 200_000
        (True, True)
    """
    described, name = _unit_of(machine, unit)
    with advancing(WASM_STEPS, "exporting", shown=progress) as advance:
        return write_wasm(described, name, out, advance=advance)


@by_kind
def export_page(*, out: str | Path, progress: bool = False) -> int:
    """Write one HTML file that tries sensors of the catalogue in a browser, on an example log or one's own.

    It works from a disk, without a network, and sends nothing. It needs the extra ``platforms``.

    Args:
        out: the file, `.html`.
        progress: show a bar on a terminal if it takes long.

    Returns:
        Its size [bytes].

    Raises:
        CompilerError: the package ziglang is missing.
        OutputError: the file cannot be written.

    Example:
        >>> import ramsight, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:  # doctest: +SKIP
        ...     ramsight.export_page(out=f"{folder}/try.html")
    """
    with advancing(len(SHOWN), "exporting", shown=progress) as advance:
        return write_page(out, advance=advance)


@by_kind
def export_parameters(machine: AnyMachine, unit: str | None = None, *, out: str | Path, what: str = "sensor") -> int:
    """Write a machine's numbers for a sensor or plant that was exported of another machine of its kind.

    Args:
        machine: a machine, its name or file.
        unit: name of the unit, the same as of the export; may be left out where there is only one.
        out: the file: `.ssv` for an FMU, `.h` for C.
        what: ``sensor`` (of an export with `parameters`) or ``plant``.

    Returns:
        How many numbers there are.

    Raises:
        DescriptionError: there is no such export, or the machine has several units and none is named.
        OutputError: the file cannot be written.

    Example:
        >>> import ramsight, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     ramsight.export_parameters("press", out=f"{folder}/press.ssv", what="plant") > 40
        True
    """
    described, name = _unit_of(machine, unit)
    return write_parameters(described, name, out, what=what)


def _driving(
    wanted: bool,
    speed: str | float | None,
    force: str | float | None,
    period: str | float | None,
    drive_delay: str | float | DriveResponse | None,
) -> ControlOptions | None:
    """How a control that is exported drives; None if none is wanted.

    Raises:
        DescriptionError: one of a control's options is passed without a control.
    """
    passed = {"speed": speed, "force": force, "period": period}
    if not wanted:
        for key, value in {**passed, "drive_delay": drive_delay}.items():
            if value is not None:
                raise DescriptionError("is of a control, and none is exported", key=key, value=value)
        return None
    ranges = {"speed": ("m/s", "0.1 mm/s", "2 m/s"), "force": ("N", "1 N", "100 MN"), "period": ("s", "1 ms", "100 ms")}
    known = {
        key: argument(value, ranges[key][0], key, least=ranges[key][1], most=ranges[key][2])
        for key, value in passed.items()
        if value is not None
    }
    return ControlOptions(**known, drive=_declared(drive_delay))


def _declared(delay: str | float | DriveResponse | None) -> DriveResponse:
    """How the drive of a control that is exported is declared."""
    if isinstance(delay, DriveResponse):
        return delay
    if delay is None:
        return IDEAL
    late = argument(delay, "s", "drive_delay", least="0 s", most="0.5 s")
    return DriveResponse(command_delay=late, report_delay=late)


def _unit_of(machine: AnyMachine, unit: str | None) -> tuple[Machine, str]:
    """The description, and the name of the unit that is meant."""
    described = load_machine(machine)
    return described, unit or only_unit(described)


def _compiler(passed: str | None) -> str | None:
    """A compiler as an argument; "" for none, None for the one that is found."""
    if passed:
        check_path(passed, "compiler")
        if shutil.which(passed) is None:
            raise DescriptionError("is no program", key="compiler", value=passed, allowed="the path of a C compiler")
    return passed


@by_kind
def export_fmeda(machine: AnyUnit, unit: str | None = None, *, out: str | Path) -> int:
    """Write the faults of a unit's virtual sensor, what detects them, and how surely, as a table to fill in.

    Args:
        machine: the unit, or what `build` makes one of.
        unit: name of the unit; may be left out where there is only one.
        out: the file, `.csv`. The column ``failure_rate_fit`` is empty.

    Returns:
        How many faults there are.

    Raises:
        DescriptionError: the machine cannot be read, or has several units and none is named.
        UnknownNameError: no such machine or unit.
        OutputError: the file cannot be written.

    Example:
        >>> import ramsight, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     ramsight.export_fmeda("press", out=f"{folder}/press.csv") > 20
        True
    """
    target = path_argument(out, "out")
    check_target(target, (".csv",))
    text = fmeda_table(build(machine, unit))
    write_text(text, target)
    return len(list(csv.reader(io.StringIO(text)))) - 1


@by_kind
def diagnostic_coverage(file: str | Path) -> CoverageTable:
    """Read a table of `export_fmeda` in which failure rates are filled in.

    Args:
        file: CSV with commas, or with semicolons and decimal commas.

    Returns:
        The rows, and the diagnostic coverage `by_channel`, `by_signal` and `overall`, each with its lower end.

    Raises:
        LogError: the file cannot be read, or has a share or rate that is impossible.

    Example:
        >>> import ramsight, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = Path(folder) / "boom.csv"
        ...     _ = ramsight.export_fmeda("mining-loader", "boom", out=path)
        ...     ramsight.diagnostic_coverage(path).overall.text
        'no failure rate'
    """
    return read_table(path_argument(file, "file"))
