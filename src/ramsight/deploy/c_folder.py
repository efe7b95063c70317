"""`ramsight export c`: a sensor's C in a folder, with golden samples, a test program and what it takes of a machine."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from ramsight.arrays import Array
from ramsight.deploy.c_compare import comparison_source
from ramsight.deploy.c_function import headings, indented, template
from ramsight.deploy.c_sensor import SensorSource, golden_source, inputs_of, sensor_source, unit_table
from ramsight.deploy.c_step import identifier_of
from ramsight.deploy.compiler import ControlFootprint, Footprint, control_footprint, find_compiler, footprint, version
from ramsight.deploy.credentials import Export, credentials
from ramsight.deploy.golden import SAMPLES, faulty_day
from ramsight.deploy.profiles import ControlOptions, Profile
from ramsight.engine.recursion import replay
from ramsight.errors import DescriptionError
from ramsight.machine.description import Machine
from ramsight.output import check_folder, whole_folder
from ramsight.plant.build import build
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.thresholds import START_STD
from ramsight.sensor.virtual_sensor import VirtualSensor
from ramsight.tool.force_scale import Scale

STEPS = 5
"""Sum of what `advance` is called with while a sensor is written."""
_LAST = "README.md"  # moved last: where it is, the folder is whole
_FMEDA_ROW = "| fmeda.csv | faults of its inputs, shares of them that are detected, and a column for failure rates |\n"
_BUILDS = ((False, "-O2"), (False, "-Os"), (True, "-O2"), (True, "-Os"))


@dataclass(frozen=True)
class WrittenSensor:
    """What was written."""

    folder: Path  # where
    files: tuple[str, ...]  # names of the files
    compiler: str | None  # what compiled it; None if there is no compiler here
    footprints: tuple[Footprint, ...]  # what it takes on this machine, a row a build
    control: ControlFootprint | None = None  # what the control takes, if there is one and a compiler
    weighing: ControlFootprint | None = None  # what the weighing takes, likewise


def write_sensor(
    machine: Machine,
    unit: str,
    out: str | Path,
    *,
    single: bool = False,
    tabled: bool = False,
    control: ControlOptions | None = None,
    weighing: bool = False,
    scale: Scale | None = None,
    profile: Profile = Profile.KALMAN,
    measure: bool = False,
    compiler: str | None = None,
    advance: Callable[[int], object] = lambda count: None,
) -> WrittenSensor:
    """Write the C of a unit's `kalman` sensor into a folder, which appears whole or not at all.

    Args:
        machine: the machine.
        unit: name of its unit.
        out: the folder; made if it is not there. Files of an earlier export are replaced, others stay.
        single: reals are floats by default; the other precision is a macro away in either case.
        tabled: the machine's numbers are a table that the sensor is handed; those of another machine by
            `write_parameters`.
        control: write a position control beside the sensor, driving so.
        weighing: write a weighing of the machine's lifts beside the sensor.
        scale: that it begins with, as known masses taught it; by default the description's.
        profile: what the sensor weighs.
        measure: compile and run it in both precisions, for speed and for size; by default once, as it is exported.
        compiler: path of the C compiler that measures; by default the one that is found, "" for none.
        advance: called with the parts of the work, of `STEPS`, that are done.

    Raises:
        DescriptionError: no sensor knows the unit's circuit, a table of numbers is of another profile, or the unit
            lifts nothing that is weighed.
        OutputError: the folder cannot be written.
        CompilerError: the compiler refuses the C, or the test program fails.

    Example:
        >>> import tempfile
        >>> from ramsight import machine
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     done = write_sensor(machine.load_machine("mining-loader"), "boom", f"{folder}/boom-c", compiler="")
        ...     sorted(done.files)  # doctest: +NORMALIZE_WHITESPACE
        ['CMakeLists.txt', 'README.md', 'card.srmd', 'description.toml', 'fmeda.csv', 'library.json', 'ramsight.json',
         'ramsight_boom.c', 'ramsight_boom.h', 'ramsight_boom_compare.c', 'ramsight_boom_compare.h',
         'ramsight_boom_golden.h', 'ramsight_boom_step.h', 'ramsight_boom_step_balance.c',
         'ramsight_boom_step_contacts.c', 'ramsight_boom_step_input_check.c', 'ramsight_boom_step_results.c',
         'ramsight_boom_step_status.c', 'ramsight_boom_step_update.c', 'ramsight_boom_test.c', 'zephyr/module.yml']
    """
    out = Path(out)
    check_folder(out)
    built = build(machine, unit)
    if single:
        _check_floats(built)
    _check_profile(profile, tabled=tabled, control=control is not None, weighing=weighing)
    sensor, prefix = profile.sensor(built), f"ramsight_{identifier_of(unit)}"
    plain = sensor_source(sensor, built, prefix, machine.name, single=single, tabled=tabled)
    source, samples = _with_rows(plain, sensor, built)
    advance(1)
    driven = _control(control, built, prefix, machine.name).files if control else {}
    beside = {} if profile is Profile.BALANCE else comparison_source(built, prefix, machine.name)
    lifted = _weighing(machine, unit, prefix, scale).files if weighing else {}
    files = {**source.files, **beside, **driven, **lifted}
    files |= build_files(files, prefix, machine.name, unit)
    with whole_folder(out, _LAST) as draft:
        for name, text in files.items():
            (draft / name).parent.mkdir(exist_ok=True)
            (draft / name).write_text(text, encoding="utf-8", newline="\n")
        found = find_compiler() if compiler is None else compiler
        measured = []
        # Floats are not good enough where a load only resists.
        good = tuple(one for one in _BUILDS if not (one[0] and built.cylinder.passive))
        builds = good if measure else ((single, "-O2"),)
        for floats, level in builds:
            if found:
                measured.append(footprint(found, draft, prefix, single=floats, optimised=level))
            advance((STEPS - 1) // len(builds))
        compiler = version(found) if found else None
        driving = control_footprint(found, draft, f"{prefix}_control") if found and control else None
        lifting = control_footprint(found, draft, f"{prefix}_weighing") if found and weighing else None
        text = template(
            "README.md",
            p=prefix,
            P=prefix.upper(),
            unit=unit,
            machine=machine.name,
            precision="float" if single else "double",
            samples=samples,
            units=unit_table(sensor),
            measured=_table(measured, compiler),
            control=_about_control(prefix, driving) if control else "",
            weighing=_about_weighing(prefix, lifting) if weighing else "",
            beside=_about_comparison(prefix) if beside else "",
            fmeda=_FMEDA_ROW if profile is Profile.KALMAN else "",
        )
        options = [*(["--single"] if single else []), *(["--parameters"] if tabled else [])]
        options += ["--weighing"] if weighing else []
        options += [] if profile is Profile.KALMAN else [f"--profile {profile.value}"]
        command = ("c", *options, *(("--control", *control.words) if control else ()))
        passed = f"golden samples passed by {compiler}, builds {len(measured)}" if compiler else ""
        own = credentials(
            Export(machine, built, "control" if control else "sensor", command, passed, profile=profile),
            {name: text.encode() for name, text in files.items()},
        )
        for name, said in {**own, _LAST: text}.items():
            (draft / name).write_text(said, encoding="utf-8", newline="\n")
    return WrittenSensor(out, (*files, *own, _LAST), compiler, tuple(measured), driving, lifting)


def _check_profile(profile: Profile, *, tabled: bool, control: bool, weighing: bool) -> None:
    """Refuse what a profile has not."""
    both = f"kalman, {Profile.KALMAN_SMALL.value}"
    for is_asked, is_there, lacks, allowed in (
        (tabled, profile is Profile.KALMAN, "has no table of numbers", "kalman"),
        (control, profile is not Profile.BALANCE, "has no control", both),
        (weighing, profile is not Profile.BALANCE, "says nothing of a load's age", both),
    ):
        if is_asked and not is_there:
            raise DescriptionError(lacks, key="profile", value=profile.value, allowed=allowed)


def _check_floats(unit: HydraulicUnit) -> None:
    """Refuse floats where they are too few digits."""
    if unit.cylinder.passive:
        raise DescriptionError(
            "is not for floats: a piston that its load holds stands or goes by the last digits",
            key=f"units.{unit.name}.load.kind",
            value="passive",
            allowed="doubles",
        )


def _with_rows(plain: SensorSource, sensor: VirtualSensor, unit: HydraulicUnit) -> tuple[SensorSource, int]:
    """A sensor's C with rows of a day of faults and the reports of Python's sensor on them, and the number of rows."""
    rows, said, start = golden_samples(sensor, unit)
    return golden_source(plain, rows, said, start, START_STD, sensor.further), len(rows)


def golden_samples(sensor: VirtualSensor, unit: HydraulicUnit) -> tuple[Array, Array, float]:
    """A day of faults and what Python's sensor says of it, which starts at the true position with `START_STD`.

    Args:
        sensor: the `kalman` sensor of the unit; it is started.

    Returns:
        Samples, shape (samples, 5 and more) as `faulty_day` has them; position [m], its standard deviation [m],
        velocity [m/s], load [N] and status, shape (samples, 5); and the position at the start [m].
    """
    rows, start = faulty_day(unit, duration=45.0, every=30.0, seed=1, further=sensor.further)
    rows = rows[:SAMPLES]
    sensor.start(start)
    state = sensor.initial.copy()
    state[:] = [sensor.state[name] for name in sensor.recursion.state]
    return rows, replay(sensor.recursion, inputs_of(rows), sensor.parameters, state)[:, :5], start


def _control(options: ControlOptions, unit: HydraulicUnit, prefix: str, machine: str) -> SensorSource:
    """The control's C, with a run of Python's control; only here an export loads the control."""
    from ramsight.deploy.c_control import control_source, golden_control
    from ramsight.deploy.golden_control import golden_run

    block = options.block(unit)
    run = golden_run(unit, block)
    return golden_control(control_source(block, unit, prefix, machine), run.rows, run.said, unit.max_speed)


def _weighing(machine: Machine, unit: str, prefix: str, scale: Scale | None) -> SensorSource:
    """The weighing's C, with a run of lifts that Python weighs; only here an export loads the mechanism."""
    from ramsight.deploy.c_weighing import golden_weighing_source, weighing_scene, weighing_source

    scene = weighing_scene(machine, unit)
    return golden_weighing_source(weighing_source(scene, prefix, machine.name, scale), scene, scale)


def _about_comparison(prefix: str) -> str:
    """The row of the folder's README that has the comparison."""
    words = "where the machine has a position sensor, too: which of the two is wrong"
    return f"| {prefix}_compare.h, {prefix}_compare.c | {words} |\n"


def _about_control(prefix: str, measured: ControlFootprint | None) -> str:
    """What the folder's README says of the control."""
    taken = f" It takes {shown_control(measured)}." if measured else ""
    return template("README_control.md", p=prefix, P=prefix.upper(), taken=taken)


def _about_weighing(prefix: str, measured: ControlFootprint | None) -> str:
    """What the folder's README says of the weighing."""
    taken = f" It takes {shown_control(measured)}." if measured else ""
    return template("README_weighing.md", p=prefix, taken=taken)


def shown_control(measured: ControlFootprint) -> str:
    """What a control or a weighing takes, in a few words."""
    return f"{measured.code} bytes of code, {measured.state} of state, {1e9 * measured.step:.0f} ns a step"


def shown(footprints: tuple[Footprint, ...]) -> str:
    """A line a build: what it takes."""
    return "\n".join(
        f"{f.precision} {f.optimised}: {f.code} bytes of code, {f.stack} of stack, {f.state} of state, "
        f"{f.saved} saved, {1e9 * f.step:.0f} ns a step"
        for f in footprints
    )


def _table(measured: list[Footprint], compiler: str | None) -> str:
    if not measured:
        return "No C compiler was found where this was exported, so nothing was measured."
    head = "| build | code and constants | stack of a step | state | saved | a step |\n|---|---|---|---|---|---|\n"
    rows = "\n".join(
        f"| {f.precision}, {f.optimised} | {f.code} | {f.stack} | {f.state} | {f.saved} | {1e9 * f.step:.0f} ns |"
        for f in measured
    )
    words = "Bytes, and the time where it was exported"
    return f"{words} ({compiler}); RAM is the state, a stack and the slots' bytes:\n\n{head}{rows}"


def build_files(names: Iterable[str], prefix: str, machine: str, unit: str) -> dict[str, str]:
    """Build files of an exported folder, text by name.

    Example:
        >>> files = build_files(["a.h", "a.c", "a_test.c"], "a", "press", "ram")
        >>> sorted(files)
        ['CMakeLists.txt', 'library.json', 'zephyr/module.yml']
        >>> [line for line in files["CMakeLists.txt"].splitlines() if "add_library" in line or "foreach(" in line]
        ['add_library(a STATIC ${a_sources})', '  foreach(name a_test)', '  endforeach()']
    """
    bodies = sorted(name.removesuffix(".c") for name in names if name.endswith(".c"))
    tests = [name for name in bodies if name.endswith("_test")]
    common = headings(prefix, machine, f"Virtual position sensor of the {unit}")
    sources = indented(f"{name}.c" for name in bodies if name not in tests)
    return {
        "CMakeLists.txt": template("CMakeLists.txt", sources=sources, tests=" ".join(tests), **common),
        "library.json": template("library.json", **common),
        "zephyr/module.yml": template("module.yml", **common),
    }
