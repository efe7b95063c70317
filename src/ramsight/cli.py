"""The command line: one verb a function, nothing else. Whatever a verb needs is imported inside it."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

_HELP = {"help_option_names": ["-h", "--help"]}

app = typer.Typer(
    name="ramsight",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings=_HELP,
)
catalog = typer.Typer(invoke_without_command=True, rich_markup_mode=None, context_settings=_HELP)
app.add_typer(catalog, name="catalog")
logs = typer.Typer(no_args_is_help=True, rich_markup_mode=None, context_settings=_HELP, help="Look into drive logs.")
app.add_typer(logs, name="logs")
export = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    context_settings=_HELP,
    help="Into a control unit and into a simulator.",
)
app.add_typer(export, name="export")


def _version(wanted: bool) -> None:
    if wanted:
        from ramsight import __version__

        typer.echo(f"ramsight {__version__}")
        raise typer.Exit


@app.callback()
def ramsight(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Where the piston of a hydraulic cylinder is, without a position sensor.

    A machine is a TOML file or a name in the catalogue. Begin with: ramsight check mining-loader
    """


@app.command()
def check(
    machine: Annotated[str, typer.Argument(help="A description file, or a catalogue name.")],
    unit: Annotated[str | None, typer.Option(help="Show this unit only, for example boom.")] = None,
) -> None:
    """Check a machine description and show what follows from it.

    Says in one line what is wrong: file, key, value and allowed range. If nothing is, shows for each unit the
    areas and ratios, the travel per motor revolution, the load at relief pressure, and for each named load
    the pressure and the motor torque while lifting and lowering.

    Example: ramsight check my-machine.toml --unit boom
    """
    from ramsight.machine import load
    from ramsight.machine.tables import show
    from ramsight.plant.summary import machine_summary

    show(machine_summary(load(machine), unit))


@catalog.callback()
def catalog_list(context: typer.Context) -> None:
    """List the oils, pumps, valves and machines that ramsight knows.

    A description takes a part from the catalogue by its name (model = "PGI100-2-008") and may override its
    values.

    Example: ramsight catalog
    """
    if context.invoked_subcommand is None:
        from ramsight.machine.tables import catalogue_list, show

        show(catalogue_list())


@catalog.command("show")
def catalog_show(
    name: Annotated[str, typer.Argument(help="A name that 'ramsight catalog' lists.")],
) -> None:
    """Show every value of a catalogue entry, what it means and where it comes from.

    The sources are marked: [P] the paper, [S: …] elsewhere, [M] remembered from a data sheet, [D] derived,
    [G] guessed.

    Example: ramsight catalog show PGI100-2-008
    """
    from ramsight.machine.tables import catalogue_entry, show

    show(catalogue_entry(name))


@app.command()
def new(
    file: Annotated[Path, typer.Argument(help="Where to write it, for example loader.toml.")],
    like: Annotated[str, typer.Option(help="The machine whose values stand in it.")] = "mining-loader",
    force: Annotated[bool, typer.Option("--force", help="Replace the file if it exists.")] = False,
) -> None:
    """Write a commented machine description to start from.

    It is complete and valid: every key with its unit, its meaning and its allowed range, and the values of an
    example. Replace them by those of your machine, then check the file.

    Example: ramsight new my-machine.toml
    """
    from ramsight.errors import OutputError
    from ramsight.machine import load, template
    from ramsight.output import atomic_path

    if file.exists() and not force:
        raise OutputError(f"{file}: exists already; --force replaces it")
    text = template(load(like), name=file.stem or "my-machine")
    with atomic_path(file) as draft:
        draft.write_text(text, encoding="utf-8")
    typer.echo(f"{file}: written; put your machine's values in, then: ramsight check {file}")


_MACHINE = Annotated[str, typer.Argument(help="A description file, or a catalogue name.")]


def _say_written(*paths: Path | None) -> None:
    for path in paths:
        if path is not None:
            typer.echo(f"{path}: written")


@app.command()
def simulate(
    machine: _MACHINE,
    unit: Annotated[str, typer.Option(help="The unit that works, for example boom.")],
    load: Annotated[str, typer.Option(help="Constant load against lifting, at the rods.")],
    oil_temperature: Annotated[str, typer.Option(help="Oil temperature.")] = "40 degC",
    speed: Annotated[str, typer.Option(help="Motor speed of lifting and lowering.")] = "1500 rpm",
    ramp: Annotated[str, typer.Option(help="Time of each speed ramp.")] = "0.8 s",
    hold: Annotated[
        str | None,
        typer.Option(help="Time at full speed [default: up to 45 % of the stroke, at most 6.4 s]."),
    ] = None,
    start: Annotated[
        str | None,
        typer.Option(help="Piston position at first, 0 = retracted [default: a fifth of the stroke up]."),
    ] = None,
    cycles: Annotated[int, typer.Option(min=1, max=1000, help="How many lift-lower cycles.")] = 1,
    sample_period: Annotated[str, typer.Option(help="Distance of the samples.")] = "20 ms",
    out: Annotated[Path | None, typer.Option(help="All results: .nc, .csv or .csv.gz.")] = None,
    log: Annotated[Path | None, typer.Option(help="What a drive would log of it: .csv or .csv.gz.")] = None,
    truth: Annotated[Path | None, typer.Option(help="The true position over time: .csv or .csv.gz.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the log's noise.")] = 0,
) -> None:
    """Simulate lift-lower cycles of one unit.

    The motor rests, lifts at constant speed, rests and lowers, with the load on the rods all the time. Shows where
    the energy went, and how well the balances close; writes results, drive log and truth where you say.

    Example: ramsight simulate mining-loader --unit boom --load "441 kN" --oil-temperature "40 degC" --out boom.nc
    """
    from ramsight.duty import DriveReport, lift_lower, report
    from ramsight.duty import simulate as run_unit
    from ramsight.duty.summary import run_summary
    from ramsight.logs import write_drive_log
    from ramsight.machine import load as load_machine
    from ramsight.output import check_apart, check_target, write_dataset, write_table
    from ramsight.plant.build import build
    from ramsight.progress import progress
    from ramsight.units import format_si, parse_option

    for path, suffixes in (
        (out, (".nc", ".csv", ".csv.gz")),
        (log, (".csv", ".csv.gz")),
        (truth, (".csv", ".csv.gz")),
    ):
        check_target(path, suffixes)
    check_apart({"the machine": machine}, {"--out": out, "--log": log, "--truth": truth})
    described = load_machine(machine).unit(unit)
    built = build(unit, described)
    stroke, fastest = (format_si(*of) for of in ((described.cylinder.stroke, "mm"), (described.drive.max_speed, "rpm")))
    lowest, highest = (format_si(t, "degC") for t in (described.oil.min_temperature, described.oil.max_temperature))
    duty = lift_lower(
        built,
        parse_option(load, "N", "--load", least="-10000 kN", most="10000 kN"),
        parse_option(oil_temperature, "K", "--oil-temperature", least=lowest, most=highest),
        motor_speed=parse_option(speed, "rad/s", "--speed", least="1 rpm", most=fastest),
        ramp=parse_option(ramp, "s", "--ramp", least="1 ms", most="100 s"),
        hold=None if hold is None else parse_option(hold, "s", "--hold", least="0 s", most="10000 s"),
        start_position=None if start is None else parse_option(start, "m", "--start", least="0 mm", most=stroke),
        cycles=cycles,
    )
    period = parse_option(sample_period, "s", "--sample-period", least="0.1 ms", most="10 s")
    with progress(duty.duration, "simulating") as bar:
        run = run_unit(built, duty, sample_period=period, advance=bar.advance)
    if out is not None:
        write_dataset(run, out)
    if log is not None:
        write_drive_log(report(run, DriveReport(seed=seed)), log)
    if truth is not None:
        write_table({"time_s": run["time"].values, "position_m": run["position"].values}, truth)
    typer.echo(run_summary(run))
    _say_written(out, log, truth)


@app.command()
def track(
    machine: _MACHINE,
    log: Annotated[Path, typer.Argument(help="Drive log: CSV, Parquet, MF4, BLF, ASC or candump, by its suffix.")],
    unit: Annotated[str, typer.Option(help="The unit that the drive turns, for example boom.")],
    start: Annotated[
        str | None,
        typer.Option(
            help='Piston position at the first sample, 0 = retracted: "100 mm". The kalman sensor does without: it is '
            "not referenced until it meets an end stop or a reference."
        ),
    ] = None,
    start_std: Annotated[str, typer.Option(help="Standard deviation of that position.")] = "1 mm",
    sensor: Annotated[
        str,
        typer.Option(
            help="kalman: calibrates itself; balance: of volumes, by the data sheet; table: the paper's look-up "
            "table; or a file of 'calibrate'."
        ),
    ] = "kalman",
    state: Annotated[
        Path | None,
        typer.Option(
            help="Resume the kalman sensor from this file if it is there, and keep its state in it at the end."
        ),
    ] = None,
    channel_map: Annotated[
        Path | None,
        typer.Option("--map", help="Which of the log's channels are what: a TOML file of 'ramsight logs inspect'."),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="The track: .csv, .csv.gz, .parquet, .mf4 or .nc.")] = None,
    truth: Annotated[Path | None, typer.Option(help="True position, to print the errors: .csv or .csv.gz.")] = None,
    figure: Annotated[Path | None, typer.Option(help="A picture of it: .png, .svg or .pdf.")] = None,
) -> None:
    """Say where the piston was, from the log of a motor drive.

    The log has the columns time_s, motor_speed_rpm, motor_torque_nm and oil_temperature_c, and perhaps reference_m:
    empty, or the position that a switch knows at that instant. For any other log, and for CAN frames, a channel map
    says which channels are what: ramsight logs inspect proposes one. The track has time_s, position_m, position_std_m
    (empty where the sensor does not know it) and status; as .nc also velocity, load, pressures and what it learned.

    Example: ramsight track mining-loader log.csv.gz --unit boom --start "100 mm" --out track.csv
    """
    from ramsight.calibration.sensors import TABLE_RUNS, sensor_for
    from ramsight.duty.plausible import watched
    from ramsight.logs import open_log, read_truth
    from ramsight.machine import load as load_machine
    from ramsight.output import DATASET_FILES, check_apart, check_installed, check_state, check_target
    from ramsight.plant.build import build
    from ramsight.progress import progress
    from ramsight.sensor.persistence import StateFile, said
    from ramsight.study.errors import position_errors
    from ramsight.study.figures import tracked_figure
    from ramsight.study.pieces import track_pieces
    from ramsight.study.tracking import error_summary
    from ramsight.units import format_si, parse_option

    check_target(out, DATASET_FILES)
    if out is not None:
        check_installed(out)
    check_target(figure, (".png", ".svg", ".pdf"))
    read: dict[str, str | Path | None] = {
        "the machine": machine,
        "the log": log,
        "--sensor": sensor,
        "--map": channel_map,
        "--truth": truth,
    }
    check_apart(read, {"--out": out, "--figure": figure, "--state": state})
    check_state(state)
    description = load_machine(machine)
    built = build(unit, description.unit(unit))
    stroke = format_si(built.cylinder.stroke, "mm")
    position = None if start is None else parse_option(start, "m", "--start", least="0 mm", most=stroke)
    std = parse_option(start_std, "m", "--start-std", least="0.01 mm", most=stroke)
    true = None if truth is None else read_truth(truth)
    with progress(TABLE_RUNS, "calibrating the table") as bar:
        virtual = sensor_for(built, sensor, advance=bar.advance)
    kept = None if state is None else StateFile(state, virtual)
    if kept is not None and position is None:
        typer.echo(said(kept.resume(), kept.path))
    else:
        virtual.start(position, std)
    with progress(1.0, "tracking") as bar:
        pieces = watched(open_log(log, channel_map, advance=bar.advance), built, log, channel_map)
        done = track_pieces(
            virtual, pieces, out, keep_track=true is not None or figure is not None, keep_log=figure is not None
        )
    if kept is not None:
        kept.save()
    errors = None
    if true is not None and done.track is not None:
        compared = position_errors(*(part[name].values for part in (done.track, true) for name in ("time", "position")))
        errors = f"{error_summary(done.track, true)}; over {compared.samples} of {done.track.sizes['time']} samples"
    if figure is not None and done.track is not None and done.log is not None:
        title = f"{description.title or description.name}, {unit}: {log.name}"
        tracked_figure(done.log, done.track, true, title, figure)
    typer.echo(done.summary)
    if errors is not None:
        typer.echo(errors)
    _say_written(out, figure, state)


@logs.command("inspect")
def logs_inspect(
    file: Annotated[Path, typer.Argument(help="The log: CSV, Parquet, MF4, BLF, ASC or candump, by its suffix.")],
    dbc: Annotated[list[Path] | None, typer.Option(help="What CAN frames mean: a DBC file; may be repeated.")] = None,
    channel_map: Annotated[
        Path | None, typer.Option("--map", help="What is known already: the layout of a CSV file, PDOs, ...")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Write the proposed channel map here: .toml.")] = None,
) -> None:
    """Show what is in a log, and propose which of its channels are speed, torque and oil temperature.

    Lists every channel with its unit, how many samples it has, how often they come and between what values they lie,
    and prints a channel map in TOML. Check it - names, units, and signs above all: positive speed extends the rod,
    positive torque drives that way - then track with it.

    Example: ramsight logs inspect day.mf4 --out map.toml; ramsight track my-machine.toml day.mf4 --map map.toml ...
    """
    from ramsight.logs.inspect import inspect_log
    from ramsight.logs.proposal import map_text
    from ramsight.logs.shown import show
    from ramsight.output import atomic_path, check_apart, check_target
    from ramsight.progress import progress

    check_target(out, (".toml",))
    check_apart({"the log": file, "--map": channel_map}, {"--out": out})
    with progress(1.0, "looking through") as bar:
        found = inspect_log(file, channel_map, dbc=dbc or (), advance=bar.advance)
    show(found)
    text = map_text(found, None if out is None else out.parent)
    if out is None:
        typer.echo(f"\n{text}", nl=False)
        return
    with atomic_path(out) as draft:
        draft.write_text(text, encoding="utf-8")
    typer.echo(f"{out}: written; check it, signs above all")


@app.command()
def calibrate(
    machine: _MACHINE,
    unit: Annotated[str, typer.Option(help="The unit that the sensor is for, for example boom.")],
    out: Annotated[Path, typer.Option(help="The sensor file, for example boom.sensor.")],
    speed: Annotated[str, typer.Option(help="Constant motor speed of the calibration.")] = "1500 rpm",
    loads: Annotated[int, typer.Option(min=8, max=1000, help="How many loads.")] = 40,
) -> None:
    """Make the paper's look-up table from simulated runs, and keep it as a sensor file.

    The unit lifts and lowers loads from 1 kN to the relief valve's opening at a constant speed, at oil
    temperatures from 20 to 70 °C; the table says how far the rod moves per motor revolution at each motor torque.

    Example: ramsight calibrate mining-loader --unit boom --out boom.sensor
    """
    from ramsight.calibration.cached import calibrated
    from ramsight.calibration.movement import TEMPERATURES
    from ramsight.calibration.sensor_file import SUFFIX, save
    from ramsight.machine import load as load_machine
    from ramsight.output import check_apart, check_target
    from ramsight.plant.build import build
    from ramsight.progress import progress
    from ramsight.units import format_si, parse_option

    check_target(out, (SUFFIX,))
    check_apart({"the machine": machine}, {"--out": out})
    described = load_machine(machine).unit(unit)
    fastest = format_si(described.drive.max_speed, "rpm")
    motor_speed = parse_option(speed, "rad/s", "--speed", least="100 rpm", most=fastest)
    with progress(2 * loads * len(TEMPERATURES), "calibrating the table") as bar:
        movement = calibrated(build(unit, described), motor_speed=motor_speed, loads=loads, advance=bar.advance)
    save(movement, out)
    typer.echo(
        f"{out}: written; {unit}, {loads} loads at {len(TEMPERATURES)} oil temperatures, torque from "
        f"{movement.lift_torque[0]:.1f} to {movement.lift_torque[-1]:.1f} N m while lifting"
    )


@app.command()
def paper(
    out: Annotated[Path, typer.Option(help="Directory for the report; made if it is not there.")],
) -> None:
    """Redo the study of the paper and lay statement, result and verdict side by side.

    Writes report.html (self-contained), report.md with its figures as PNG and SVG, and results.json with every
    number. An earlier report in the same directory is replaced; other files there stay.

    Example: ramsight paper --out paper
    """
    from ramsight.output import check_folder
    from ramsight.progress import progress
    from ramsight.study.paper import STEPS, reproduce, write_report

    check_folder(out)
    with progress(STEPS, "redoing the paper") as bar:
        study = reproduce(advance=bar.advance)
        write_report(study, out, advance=bar.advance)
    typer.echo(study.summary())
    typer.echo(f"{out}: report.html, report.md and results.json written")


@app.command()
def leaktest(
    machine: _MACHINE,
    log: Annotated[Path, typer.Argument(help="Drive log, .csv or .csv.gz.")],
    unit: Annotated[str, typer.Option(help="The unit that the drive turns, for example boom.")],
) -> None:
    """Measure a pump's leakage from a drive log, with no position reference.

    Turn the motor slowly in the lifting direction under load (60 rpm, then 100 rpm, 6 s each): the safety valve stays
    closed, no oil reaches the cylinder, and what the pump moves is what leaks. Says how much it leaks over its data
    sheet, corrected for the oil's viscosity, and how sure that is.

    Example: ramsight leaktest mining-loader log.csv.gz --unit boom
    """
    from ramsight.calibration.leakage import leak_test, leak_test_summary
    from ramsight.logs import read_drive_log
    from ramsight.machine import load as load_machine
    from ramsight.plant.build import build

    built = build(unit, load_machine(machine).unit(unit))
    typer.echo(leak_test_summary(leak_test(built, read_drive_log(log, strict=True))))


@app.command()
def identify(
    machine: _MACHINE,
    log: Annotated[Path, typer.Argument(help="Drive log, .csv or .csv.gz.")],
    unit: Annotated[str, typer.Option(help="The unit that the drive turns, for example boom.")],
    truth: Annotated[Path, typer.Option(help="Its measured position: time_s and position_m, .csv or .csv.gz.")],
    out: Annotated[Path | None, typer.Option(help="The tuned machine's description: .toml.")] = None,
) -> None:
    """Find how a machine differs from its data sheet, with a position sensor put on for a day.

    Work the unit under several loads for some minutes, lifting and lowering each, with the drive's log and the
    position on one clock. Fits leakage (through gaps, and like an orifice's), displacement, stiffness of oil and hoses,
    cylinder friction and the pumps' hydro-mechanical efficiency, each with a 95 % interval; what the log cannot tell
    stays at the data sheet, and is said. The unit may have any circuit, loss tables, seal leakage, free air: it is its
    own equations that run along the log.

    Loads need not be known and may change at rest; three and more, each lifted and lowered, tell the pumps' friction
    from the cylinder's. Moves of three seconds and more at steady speeds tell most; slow and fast ones tell leakage
    from displacement. End stops and relief are left out by themselves. Nothing but time_s and position_m is used of
    the truth. The tuned description goes wherever a machine goes: check, track, ...

    Example: ramsight identify mining-loader log.csv.gz --unit boom --truth position.csv --out tuned.toml
    """
    from ramsight.calibration.identify import EVALUATIONS
    from ramsight.calibration.identify import identify as identify_unit
    from ramsight.calibration.identify_report import summary
    from ramsight.calibration.identify_tuned import tuned
    from ramsight.duty.plausible import watched
    from ramsight.logs import read_drive_log, read_truth
    from ramsight.machine import load as load_machine
    from ramsight.output import atomic_path, check_apart, check_target
    from ramsight.plant.build import build
    from ramsight.progress import progress

    check_target(out, (".toml",))
    check_apart({"the machine": machine, "the log": log, "--truth": truth}, {"--out": out})
    description = load_machine(machine)
    built = build(unit, description.unit(unit))
    recorded, known = read_drive_log(log, strict=True), read_truth(truth)
    recorded = next(watched([recorded], built, log))
    with progress(EVALUATIONS, "identifying") as bar:
        found = identify_unit(built, recorded, known, advance=bar.advance)
    if out is not None:
        text = tuned(description, unit, found, log.name, truth.name).text
        with atomic_path(out) as draft:
            draft.write_text(text, encoding="utf-8")
    typer.echo(summary(found))
    _say_written(out)


@app.command()
def loader(
    out: Annotated[Path, typer.Option(help="Directory for the results; made if it is not there.")],
    machine: Annotated[str, typer.Argument(help="A description file, or a catalogue name.")] = "mining-loader",
    payload: Annotated[str | None, typer.Option(help="In the full bucket [default: the rated one].")] = None,
    oil_temperature: Annotated[str, typer.Option(help="Oil temperature of both units.")] = "40 degC",
    leak: Annotated[float, typer.Option(help="Leakage of the real pumps over their data sheet's: 1.2.")] = 1.0,
    temperature_offset: Annotated[float, typer.Option(help="By how many K the thermometers read too much.")] = 0.0,
    references: Annotated[
        int, typer.Option(min=1, max=9, help="Visits of each unit to an end stop before it works; three teach it.")
    ] = 1,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the drives' noise.")] = 0,
) -> None:
    """Let a loader work without position sensors, and show how well it goes.

    Boom and bucket visit an end stop to find where they are, then dig, lift, dump and return; every move goes to a
    position, and what the virtual sensors make of motor speed, torque and oil temperature is all that the controls
    know. The sensors believe the data sheet: give the real machine another leakage, or a thermometer that reads too
    much, and see what it costs, and what more references mend.

    Writes loader.html (open it and drag through the run; dashed is what the sensors believe), loader.gif, control.png
    and control.svg (targets, errors with the sensors' 95 % bands, motor speeds, torques), and results.json in SI units.

    Example: ramsight loader --out loader --leak 1.2 --temperature-offset 3 --references 3
    """
    from ramsight.machine import load as load_machine
    from ramsight.output import check_folder
    from ramsight.plant.linked import build
    from ramsight.progress import progress
    from ramsight.study.loader.report import summary, write_work
    from ramsight.study.loader.working import Options, work
    from ramsight.units import format_si, parse_option

    check_folder(out)
    description = load_machine(machine)
    built = build(description)
    lowest, highest = (
        format_si(edge(unit.oil.temperatures[k] for unit in built.units), "degC") for k, edge in enumerate((max, min))
    )
    options = Options(
        payload=None if payload is None else parse_option(payload, "kg", "--payload", least="0 kg", most="1000 t"),
        oil_temperature=parse_option(oil_temperature, "K", "--oil-temperature", least=lowest, most=highest),
        leak=parse_option(str(leak), "1", "--leak", least="0.1", most="10"),
        temperature_offset=temperature_offset,
        references=references,
        seed=seed,
    )
    with progress(2.0, "working") as bar:
        done = work(built, options, advance=bar.advance)
        title = f"{description.title or description.name}: sensorless position control"
        write_work(done, options, out, title=title, advance=bar.advance)
    typer.echo(summary(done))
    typer.echo(f"{out}: loader.html, loader.gif, control.png, control.svg and results.json written")


@export.command("c")
def export_c(
    machine: _MACHINE,
    unit: Annotated[str, typer.Option(help="The unit that the sensor is for, for example boom.")],
    out: Annotated[Path, typer.Option(help="Directory for the C; made if it is not there.")],
    single: Annotated[bool, typer.Option("--float", help="Floats in place of doubles.")] = False,
) -> None:
    """Write the kalman sensor as C99 for an electronic control unit.

    One header and one body, libm alone: no memory is taken, nothing is global. With them a test program with samples of
    a simulated log, faults among them, and what Python says of each. Where there is a C compiler it is compiled and
    run, and says what it takes of memory and time; so does the README.md.

    Example: ramsight export c mining-loader --unit boom --out boom-c
    """
    from ramsight.deploy.c_folder import STEPS, shown, write_sensor
    from ramsight.machine import load as load_machine
    from ramsight.progress import progress

    with progress(STEPS, "exporting") as bar:
        done = write_sensor(load_machine(machine), unit, out, single=single, advance=bar.advance)
    typer.echo(
        shown(done.footprints) if done.footprints else "no C compiler was found: nothing was compiled or measured"
    )
    typer.echo(f"{out}: {', '.join(sorted(done.files))} written")


@export.command("fmu")
def export_fmu(
    machine: _MACHINE,
    unit: Annotated[str, typer.Option(help="The unit, for example boom.")],
    out: Annotated[Path, typer.Option(help="The FMU: .fmu.")],
    what: Annotated[str, typer.Option(help="sensor: the kalman sensor; plant: the unit itself, simulated.")] = "sensor",
    fmi: Annotated[int, typer.Option(help="Version of the interface: 2 or 3.")] = 2,
) -> None:
    """Write a co-simulation FMU of a unit's virtual sensor, or of the unit itself with its own solver.

    Its C sources are inside, and a binary for this machine where there is a C compiler. A step of the sensor takes the
    inputs as one sample, so step it as often as the drive reports (1 to 100 ms). The plant holds its inputs through a
    step, or goes straight on by their slopes where you give them.

    Example: ramsight export fmu mining-loader --unit boom --what plant --fmi 3 --out boom.fmu
    """
    from ramsight.deploy.fmu import write_fmu
    from ramsight.machine import load as load_machine

    done = write_fmu(load_machine(machine), unit, out, what=what, fmi=fmi)
    binary = f"sources and a binary for {done.binary}" if done.binary else "sources alone: no C compiler was found"
    typer.echo(f"{out}: written; FMI {fmi}.0 co-simulation, {done.variables} variables, {binary}")


@app.command()
def encoder(
    machine: _MACHINE,
    unit: Annotated[str, typer.Option(help="The unit that the drive turns, for example boom.")],
    channel: Annotated[str, typer.Option(help="The bus: can0, 239.74.163.2, ...")],
    node_id: Annotated[int, typer.Option(help="The encoder's node-ID, 1 to 127.")],
    drive_node: Annotated[int, typer.Option(help="The drive's node-ID.")],
    interface: Annotated[
        str, typer.Option(help="python-can's name of the interface: socketcan, udp_multicast, virtual, ...")
    ] = "socketcan",
    objects: Annotated[
        str, typer.Option(help="What the drive maps into 180h + its node-ID, in order.")
    ] = "606Ch, 6077h",
    rated_torque: Annotated[str | None, typer.Option(help="6076h of the drive, which 6077h is per mille of.")] = None,
    channel_map: Annotated[
        Path | None, typer.Option("--map", help="What the frames mean, instead of --objects: see docs/encoder.md.")
    ] = None,
    state: Annotated[Path | None, typer.Option(help="Keep position and parameters here over a power loss.")] = None,
    hold: Annotated[bool, typer.Option("--hold", help="An invalid position is held; else 6004h is 7FFFFFFFh.")] = False,
    timeout: Annotated[str | None, typer.Option(help="So long without the drive is invalid [default: 100 ms].")] = None,
    serial: Annotated[int, typer.Option(min=0, max=0xFFFFFFFF, help="Its serial number.")] = 0,
    eds: Annotated[Path | None, typer.Option(help="Write its EDS file here first: .eds.")] = None,
) -> None:
    """Be a position sensor on a CANopen bus: a linear encoder of CiA 406.

    Listens to the drive's process data, follows the piston with the kalman sensor, and offers 6004h, 6030h, alarms,
    warnings and emergencies as a wire-draw or magnetostrictive sensor does, so that a controller need not be changed.
    A preset (6003h) is a reference by hand; end stops are references too. Runs until Ctrl-C.

    Example: ramsight encoder mining-loader --unit boom --channel can0 --node-id 6 --drive-node 5 --rated-torque 80Nm
    """
    from ramsight.logs.source import needs
    from ramsight.machine import load as load_machine
    from ramsight.output import atomic_path, check_apart, check_state, check_target
    from ramsight.plant.build import build
    from ramsight.units import parse_option

    needs("canopen", "can", channel)
    needs("can", "can", channel)
    from ramsight.deploy.encoder.assembly import encoder_for, overrides
    from ramsight.deploy.encoder.eds import eds_text
    from ramsight.deploy.encoder.encoder import Settings
    from ramsight.deploy.encoder.flood import limited_log_lines
    from ramsight.deploy.encoder.listening import drive_map
    from ramsight.deploy.encoder.runner import open_bus, serve, until_stopped
    from ramsight.logs.channel_map import load_map

    check_target(eds, (".eds",))
    check_apart({"the machine": machine, "--map": channel_map}, {"--state": state, "--eds": eds})
    check_state(state)
    within = None if timeout is None else parse_option(timeout, "s", "--timeout", least="10 ms", most="10 s")
    rated = (
        None
        if rated_torque is None
        else parse_option(rated_torque, "N m", "--rated-torque", least="0.01 N m", most="1e5 N m")
    )
    settings = Settings(node_id, drive_node, serial, overrides(hold, within))
    built = build(unit, load_machine(machine).unit(unit))
    meanings = drive_map(drive_node, objects.split(","), rated) if channel_map is None else load_map(channel_map)
    ready = encoder_for(built, meanings, settings, state, aside=True)
    if eds is not None:
        with atomic_path(eds) as draft:
            draft.write_text(eds_text(), encoding="ascii")
        _say_written(eds)
    with open_bus(interface, channel) as bus, limited_log_lines(), until_stopped() as stop:
        typer.echo(f"{channel}: node {node_id} is the position of {unit}; {ready.said}")
        serve(ready, bus, stop)
    typer.echo(f"{channel}: node {node_id} is gone; {ready.said}")


def main() -> None:
    """Run the command line: one line on standard error and exit code 2 for whatever a user can mend."""
    from ramsight.errors import RamsightError

    _say_warnings()
    try:
        app()
    except RamsightError as error:
        typer.echo(f"error: {' '.join(str(error).split())}", err=True)
        sys.exit(2)
    except OSError as error:
        typer.echo(f"error: {_cause(error)}{error.strerror or error}", err=True)
        sys.exit(2)


def _say_warnings() -> None:
    """Warnings about logs are a line on standard error each; what other libraries log is not shown."""
    import logging
    import warnings

    from ramsight.engine.private_folder import FolderWarning
    from ramsight.errors import LogWarning

    told = (LogWarning, FolderWarning)
    logging.getLogger().addHandler(logging.NullHandler())
    usual = warnings.showwarning

    def show(message: Warning | str, category: type[Warning], *rest: Any, **more: Any) -> None:
        if issubclass(category, told):
            typer.echo(f"warning: {' '.join(str(message).split())}", err=True)
        else:
            usual(message, category, *rest, **more)

    warnings.showwarning = show
    for kind in told:
        warnings.simplefilter("always", kind)


def _cause(error: OSError) -> str:
    """What could not be read or written: a file, or standard output if that is full or gone."""
    if error.filename is not None:
        return f"{os.fsdecode(error.filename)}: "
    frame = error.__traceback__
    while frame is not None and frame.tb_next is not None:
        frame = frame.tb_next
    module = "" if frame is None else str(frame.tb_frame.f_globals.get("__name__", ""))
    if module.partition(".")[0] not in ("click", "rich", "typer"):
        return ""
    sys.stdout = open(os.devnull, "w")  # noqa: SIM115 - for the interpreter's last flush
    return "standard output: "


if __name__ == "__main__":
    main()
