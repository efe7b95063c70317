"""Verbs that bring a sensor or a plant into other runtimes, and what a safety analysis needs of it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ramsight.cli.common import Machine, SensedUnit, named_unit, say, say_lines, say_written

Speed = Annotated[str | None, typer.Option(help="Of the control: largest velocity, for example '20 mm/s'.")]
Force = Annotated[str | None, typer.Option(help="Of the control: largest load that is pushed against, '300 kN'.")]
Delay = Annotated[
    str | None,
    typer.Option(help="Of the control: by which the drive is late, with commands and with reports each, '40 ms'."),
]
Platforms = Annotated[
    str | None,
    typer.Option(
        help="Binaries for linux64, linux-aarch64, win64, darwin64, darwin-arm64; all; none. Default: this machine."
    ),
]
Period = Annotated[str | None, typer.Option(help="Of the control: time between its steps; by default 20 ms.")]


def export_c(
    machine: Machine,
    out: Annotated[Path, typer.Option(help="Directory for the C; made if it is not there.")],
    unit: SensedUnit = None,
    single: Annotated[bool, typer.Option("--single", help="Floats in place of doubles.")] = False,
    parameters: Annotated[
        bool, typer.Option("--parameters", help="Numbers of the machine as a table: one build for a kind of machines.")
    ] = False,
    control: Annotated[bool, typer.Option("--control", help="The unit's position control too.")] = False,
    speed: Speed = None,
    force: Force = None,
    period: Period = None,
    drive_delay: Delay = None,
    weighing: Annotated[
        bool, typer.Option("--weighing", help="A weighing of what the unit lifts too, of a machine with a mechanism.")
    ] = False,
    profile: Annotated[
        str, typer.Option(help="What the sensor weighs: kalman; or kalman-small or balance for fewer operations.")
    ] = "kalman",
    measure: Annotated[
        bool,
        typer.Option("--measure", help="Sizes and times in both precisions, for speed and for size; half a minute."),
    ] = False,
) -> None:
    """Write the kalman sensor as C99 for an electronic control unit, and a position control if it is wanted.

    One header and one body, libm alone: no memory is taken, nothing is global. With them a test program with samples of
    a simulated log, faults among them, and what Python says of each. Where there is a C compiler it is compiled and
    run, and states what it takes of memory and time; so does the README.md.

    Example: ramsight export c mining-loader --unit boom --out boom-c
    """
    unit = named_unit(machine, unit)
    from ramsight.api.exporting import export_c as export_unit
    from ramsight.deploy.c_folder import shown, shown_control

    done = export_unit(
        machine, unit, out=out, single=single, parameters=parameters, control=control, weighing=weighing, speed=speed,
        force=force, period=period, drive_delay=drive_delay, profile=profile, measure=measure, progress=True,
    )  # fmt: skip
    say_lines(
        shown(done.footprints) if done.footprints else "no C compiler was found: nothing was compiled or measured"
    )
    if done.control:
        say(f"control: {shown_control(done.control)}")
    if done.weighing:
        say(f"weighing: {shown_control(done.weighing)}")
    say(f"{out}: {', '.join(sorted(done.files))} written")


def export_wasm(
    machine: Machine,
    out: Annotated[Path, typer.Option(help="Directory for the module; made if it is not there.")],
    unit: SensedUnit = None,
) -> None:
    """Write the kalman sensor as WebAssembly with an ES module, for browsers, Node, Node-RED and edge gateways.

    The C of 'export c' is compiled by zig (pip install "ramsight[platforms]"). The module imports nothing. With it are
    TypeScript types, and golden samples that run once where Node is installed.

    Example: ramsight export wasm mining-loader --unit boom --out boom-wasm
    """
    unit = named_unit(machine, unit)
    from ramsight.api.exporting import export_wasm as export_unit

    done = export_unit(machine, unit, out=out, progress=True)
    say(f"{done.bytes} bytes of WebAssembly")
    say(done.tested or "no Node was found: nothing was run")
    say(f"{out}: {', '.join(sorted(done.files))} written")


def export_page(out: Annotated[Path, typer.Option(help="The page: .html.")]) -> None:
    """Write one HTML file that tries sensors of the catalogue in a browser: an example log, or your own CSV.

    It works from a disk, without a network, and sends nothing. It needs pip install "ramsight[platforms]".

    Example: ramsight export page --out try.html
    """
    from ramsight.api.exporting import export_page as export_file

    size = export_file(out=out, progress=True)
    say(f"{out}: written, {size} bytes; open it in a browser")


def export_fmu(
    machine: Machine,
    out: Annotated[Path, typer.Option(help="The FMU: .fmu.")],
    unit: SensedUnit = None,
    what: Annotated[
        str,
        typer.Option(
            help="sensor: the kalman one; control: that and a position control; compare: that and the comparison with "
            "a real one; weighing: that and a weighing of what the unit lifts; plant: the unit itself."
        ),
    ] = "sensor",
    fmi: Annotated[int, typer.Option(help="Version of the interface: 2 or 3.")] = 2,
    parameters: Annotated[
        bool,
        typer.Option("--parameters", help="Of a sensor: the machine's numbers are parameters, for a kind of machines."),
    ] = False,
    platforms: Platforms = None,
    speed: Speed = None,
    force: Force = None,
    period: Period = None,
    drive_delay: Delay = None,
) -> None:
    """Write a co-simulation FMU of a unit's sensor, of that with a control, or of the unit with its own solver.

    Its C sources are inside, and a binary for this machine where there is a C compiler. A step of the sensor takes the
    inputs as one sample, so step it as often as the drive reports (1 to 100 ms). The plant holds its inputs through a
    step, or goes straight on by their slopes where you give them.

    Example: ramsight export fmu mining-loader --unit boom --what plant --fmi 3 --out boom.fmu
    """
    unit = named_unit(machine, unit)
    from ramsight.api.exporting import export_fmu as export_unit
    from ramsight.progress import progress

    driving = {"speed": speed, "force": force, "period": period, "drive_delay": drive_delay}
    with progress(1.0, "exporting"):  # one step, whose progress is unknown
        done = export_unit(
            machine, unit, out=out, what=what, fmi=fmi, parameters=parameters, platforms=platforms, **driving
        )
    lacking = "sources alone" if platforms else "sources alone: no C compiler was found"
    binary = f"sources and a binary for {', '.join(done.binaries)}" if done.binaries else lacking
    say(f"{out}: written; FMI {fmi}.0 co-simulation, {done.variables} variables, {binary}")


def export_ssp(
    machine: Machine,
    out: Annotated[Path, typer.Option(help="The package: .ssp.")],
    unit: SensedUnit = None,
    control: Annotated[
        bool, typer.Option("--control", help="With the position control, which drives the plant.")
    ] = False,
    fmi: Annotated[int, typer.Option(help="Version of the FMUs: 2 or 3.")] = 2,
    platforms: Platforms = None,
    speed: Speed = None,
    force: Force = None,
    period: Period = None,
    drive_delay: Delay = None,
) -> None:
    """Write a package of a unit's plant and its sensor as FMUs that are wired together, with their parameters.

    The sensor gets what the plant's drive reports. With a control it is the control that turns the motor, by the sensor
    inside it. System structure and parameter set are those of SSP 1.0.

    Example: ramsight export ssp mining-loader --unit boom --out boom.ssp
    """
    unit = named_unit(machine, unit)
    from ramsight.api.exporting import export_ssp as export_package
    from ramsight.progress import progress

    driving = {"speed": speed, "force": force, "period": period, "drive_delay": drive_delay}
    with progress(1.0, "exporting"):  # one step, whose progress is unknown
        done = export_package(machine, unit, out=out, control=control, fmi=fmi, platforms=platforms, **driving)
    binary = f"binaries for {', '.join(done.binaries)}" if done.binaries else "sources alone"
    held = f"{done.connections} connections, {done.parameters} parameters, {binary}"
    say(f"{out}: written; {' and '.join(done.components)}, {held}")


def export_parameters(
    machine: Machine,
    unit: Annotated[str, typer.Option(help="The unit, the same as of the export.")],
    out: Annotated[Path, typer.Option(help=".ssv for an FMU, .h for C.")],
    what: Annotated[str, typer.Option(help="sensor (exported with --parameters) or plant.")] = "sensor",
) -> None:
    """Write the numbers of another machine of the kind, for an FMU or C that is built already.

    A kind is one circuit with its options and assumptions. Of a sensor some numbers belong to the kind as well, bore,
    rod and stroke among them (docs/how-to/c-firmware.md): numbers of a machine of another kind are refused.

    Example: ramsight export parameters left.toml --unit boom --out left.ssv
    """
    from ramsight.api.exporting import export_parameters as export_numbers

    count = export_numbers(machine, unit, out=out, what=what)
    say(f"{out}: {count} numbers of {what} written")


def export_fmeda(
    machine: Machine, out: Annotated[Path, typer.Option(help="The table: .csv.")], unit: SensedUnit = None
) -> None:
    """Write the faults of a unit's sensor with what detects them and how surely, for a safety analysis.

    The shares were measured, with the lower ends of their 95 % intervals; a fault that was not measured has none. Fill
    in failure rates, and 'ramsight fmeda' gives the diagnostic coverage.

    Example: ramsight export fmeda mining-loader --unit boom --out fmeda.csv
    """
    unit = named_unit(machine, unit)
    from ramsight.api.exporting import export_fmeda as export_table

    say(f"{out}: {export_table(machine, unit, out=out)} faults written; failure_rate_fit is yours to fill in")


def fmeda(
    table: Annotated[Path, typer.Argument(help="A table of 'ramsight export fmeda' with failure rates filled in.")],
    out: Annotated[
        Path | None, typer.Option(help="The table with the coverage of each fault and its undetected rate: .csv.")
    ] = None,
) -> None:
    """Give the diagnostic coverage that follows from a table of faults and their failure rates.

    It is the mean of the shares that are detected, weighed by the failure rates: by channel, by signal and overall,
    each with its lower end. The class is that of ISO 13849-1 for the lower end.

    Example: ramsight fmeda fmeda.csv
    """
    from ramsight.api.exporting import diagnostic_coverage
    from ramsight.output import check_apart, check_target, write_text

    check_target(out, (".csv",))
    check_apart({"the table": table}, {"--out": out})
    found = diagnostic_coverage(table)
    say_lines(found.text)
    if out is not None:
        write_text(found.filled(), out)
    say_written(out)
