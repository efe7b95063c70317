"""Verbs on a bus: an encoder, and a drive that is not there."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ramsight.cli import common

if TYPE_CHECKING:
    from ramsight.machine.description import Machine as Described
    from ramsight.tool.weigher import Weigher


def encoder(
    machine: common.Machine,
    channel: Annotated[str, typer.Option(help="The bus: can0, 239.74.163.2, ...")],
    node_id: Annotated[int, typer.Option(help="The encoder's node-ID, 1 to 127.")],
    drive_node: Annotated[int, typer.Option(help="The drive's node-ID.")],
    unit: common.DrivenUnit = None,
    interface: Annotated[
        str, typer.Option(help="python-can's name of the interface: socketcan, udp_multicast, virtual, ...")
    ] = "socketcan",
    objects: Annotated[
        str, typer.Option(help="What the drive maps into 180h + its node-ID, in order.")
    ] = "606Ch, 6077h",
    rated_torque: Annotated[str | None, typer.Option(help="6076h of the drive, which 6077h is per mille of.")] = None,
    channel_map: Annotated[
        Path | None,
        typer.Option("--map", help="What the frames mean, instead of --objects: see docs/how-to/encoder.md."),
    ] = None,
    state: Annotated[Path | None, typer.Option(help="Keep position and parameters here over a power loss.")] = None,
    hold: Annotated[bool, typer.Option("--hold", help="An invalid position is held; else 6004h is 7FFFFFFFh.")] = False,
    timeout: Annotated[str | None, typer.Option(help="So long without the drive is invalid [default: 100 ms].")] = None,
    drive_period: Annotated[
        str | None,
        typer.Option(help="Between two frames of the drive; what comes more often is another node [default: learned]."),
    ] = None,
    tolerance: Annotated[
        str | None, typer.Option(help="Of a real position sensor that the map names [default: 2 mm].")
    ] = None,
    time_to_alert: Annotated[str | None, typer.Option(help="For which both have to be apart [default: 0.2 s].")] = None,
    serial: Annotated[int, typer.Option(min=0, max=0xFFFFFFFF, help="Its serial number.")] = 0,
    j1939: Annotated[
        str | None,
        typer.Option(help="Send the position as a J1939 message, too: its PGN and source address, 'FF40h 80h'."),
    ] = None,
    j1939_period: Annotated[str, typer.Option(help="Between two of them.")] = "20 ms",
    opcua: Annotated[
        str | None, typer.Option(help="Offer it as an OPC UA server, too: '127.0.0.1:4840', or the port alone.")
    ] = None,
    history: Annotated[
        str | None, typer.Option(help="Keep a record of each hour, and one at the end: a store of ramsight history.")
    ] = None,
    j1939_weighing: Annotated[
        str | None,
        typer.Option(
            help="Send what is lifted as J1939 messages: PGN and source address, 'FF41h 80h', total in the next."
        ),
    ] = None,
    at: common.StandingUnits = None,
    empty: common.EmptyLogs = None,
    known: common.KnownLogs = None,
    known_start: Annotated[
        str | None, typer.Option(help='Position of the piston at the beginning of each of these logs: "50 mm".')
    ] = None,
    eds: Annotated[Path | None, typer.Option(help="Write its EDS file here first: .eds.")] = None,
) -> None:
    """Be a position sensor on a CANopen bus: a linear encoder of CiA 406.

    Listens to the drive's process data, follows the piston with the kalman sensor, and offers 6004h, 6030h, alarms,
    warnings and emergencies as a wire-draw or magnetostrictive sensor does, so that a controller need not be changed.
    A preset (6003h) is a reference by hand; end stops are references too. A real position sensor on the bus, which a
    map names as [measured] position, is held against it (2031h). Of a mechanism with a payload, the unit that lifts
    weighs each lift (2040h to 2048h); --at says where the others stand, and lifts of known masses (--known, --empty)
    teach its scale as they do for ramsight weigh. Runs until Ctrl-C.

    Example: ramsight encoder mining-loader --unit boom --channel can0 --node-id 6 --drive-node 5 --rated-torque 80Nm
    """
    unit = common.named_unit(machine, unit)
    from ramsight.logs.source import needs
    from ramsight.machine import load_machine
    from ramsight.output import atomic_path, check_apart, check_state, check_target
    from ramsight.plant.build import build

    needs("canopen", "can", channel)
    needs("can", "can", channel)
    from ramsight.deploy.encoder.assembly import encoder_for, overrides
    from ramsight.deploy.encoder.encoder import Settings
    from ramsight.deploy.encoder.j1939 import Broadcast, Broadcasting, message_of, weighing_messages_of
    from ramsight.deploy.encoder.listening import drive_map
    from ramsight.deploy.encoder.objects import eds_text
    from ramsight.deploy.encoder.opcua import OpcuaServer, address_of
    from ramsight.deploy.encoder.runner import limited_log_lines, open_bus, serve, until_stopped
    from ramsight.histories.adding import recorded, session_for, taking
    from ramsight.logs.channel_map import load_map
    from ramsight.tracking.availability import LONGEST_ALERT

    check_target(eds, (".eds",))
    check_apart({"the machine": machine, "--map": channel_map}, {"--state": state, "--eds": eds})
    check_state(state)
    within = common.optional(timeout, "s", "--timeout", least="10 ms", most="10 s")
    rated = common.optional(rated_torque, "N m", "--rated-torque", least="0.01 N m", most="1e5 N m")
    wrong = common.optional(tolerance, "m", "--tolerance", least="0.001 mm", most="1 m")
    alert = common.optional(time_to_alert, "s", "--time-to-alert", least="0 s", most=f"{LONGEST_ALERT:g} s")
    period = common.optional(drive_period, "s", "--drive-period", least="0.1 ms", most="1 s")
    settings = Settings(node_id, drive_node, serial, overrides(hold, within, wrong, alert, period))
    described = load_machine(machine)
    built = build(described, unit)
    meanings = drive_map(drive_node, objects.split(","), rated) if channel_map is None else load_map(channel_map)
    session = None
    if history is not None:
        session = session_for(history, described, unit, built, str(serial) if serial else "")
    weigher = _weigher(
        described, unit, common.by_unit(at, "at", "bucket=250 mm"), common.known_masses(empty, known), known_start
    )
    encoder = encoder_for(built, meanings, settings, state, aside=True, record=taking(session), weigher=weigher)
    messages: list[Broadcast] = [] if j1939 is None else [message_of(j1939, j1939_period)]
    messages += [] if j1939_weighing is None else [weighing_messages_of(j1939_weighing)]
    ready = Broadcasting(encoder, *messages) if messages else encoder
    if eds is not None:
        with atomic_path(eds) as draft:
            draft.write_text(eds_text(), encoding="ascii")
        common.say_written(eds)
    shown = None if opcua is None else OpcuaServer(encoder, unit, *address_of(opcua))
    with (
        open_bus(interface, channel) as bus, limited_log_lines(), until_stopped() as stop, shown or nullcontext(),
        recorded(session),
    ):  # fmt: skip
        common.say(f"{channel}: node {node_id} is the position of {unit}; {ready.said}")
        if shown is not None:
            common.say(f"{shown.endpoint}: read only")
        serve(ready, bus, stop, each=(lambda: None) if shown is None else shown.take)
    common.say(f"{channel}: node {node_id} is gone; {ready.said}")
    if session is not None and session.failure:
        common.say_error(session.failure, "warning")


def _weigher(
    described: Described, unit: str, at: dict[str, str], known: list[tuple[float | str, Path]], start: str | None
) -> Weigher | None:
    """What weighs the unit's lifts; None where it lifts nothing that is weighed."""
    from ramsight.api.live_weighing import weigher_for
    from ramsight.api.weighing import weigh
    from ramsight.errors import DescriptionError

    linkage = described.linkage
    if linkage is None or linkage.payload is None or unit != next(iter(linkage.cylinders)):
        if at or known:
            allowed = "the unit that lifts, or no --at, --known and --empty"
            raise DescriptionError("lifts nothing that is weighed", key="--unit", value=unit, allowed=allowed)
        return None
    scale = weigh(described, [], unit=unit, start=start, at=at, known=known).scale if known else None
    return weigher_for(described, unit, at=at, scale=scale)


def logs_replay(
    log: common.DriveLog,
    channel: Annotated[str, typer.Option(help="The bus: can0, 239.74.163.2, ...")],
    rated_torque: Annotated[str, typer.Option(help="6076h of the drive, which 6077h is per mille of: '80 N m'.")],
    channel_map: common.ChannelMapFile = None,
    interface: Annotated[
        str, typer.Option(help="python-can's name of the interface: socketcan, udp_multicast, virtual, ...")
    ] = "socketcan",
    drive_node: Annotated[int, typer.Option(min=1, max=127, help="The drive's node-ID.")] = 5,
    thermometer_node: Annotated[int, typer.Option(min=1, max=127, help="Of the node with the oil temperature.")] = 7,
    speed: Annotated[float, typer.Option(min=0.01, max=1e4, help="Times faster; an encoder needs 1.")] = 1,
    map_out: Annotated[
        Path | None, typer.Option(help="Write the map with which an encoder listens to it here first: .toml.")
    ] = None,
) -> None:
    """Send a recorded log on a CAN bus as its drive would have, so that an encoder can be tried without a machine.

    180h + the drive's node has velocity (606Ch, 1/min) and torque (6077h, per mille), 700h + node its heartbeat, and
    180h + the thermometer's node the oil temperature (2010h:01h, INT16, 0.1 °C) every 50 samples, as far apart as they
    were recorded. Samples that the log lacks are not sent. Ends with the log, or with Ctrl-C.

    Example: ramsight logs replay log.csv --interface udp_multicast --channel 239.74.163.2 --rated-torque 80Nm
    """
    from ramsight.errors import DescriptionError
    from ramsight.logs.drive_log import read_signals
    from ramsight.logs.source import needs
    from ramsight.output import check_apart, check_target, write_text
    from ramsight.progress import progress
    from ramsight.units import parse_option

    needs("can", "can", channel)
    from ramsight.deploy.encoder.played_drive import PlayedDrive, played_map
    from ramsight.deploy.encoder.runner import open_bus, replay, until_stopped

    check_target(map_out, (".toml",))
    check_apart({"the log": log, "--map": channel_map}, {"--map-out": map_out})
    rated = parse_option(rated_torque, "N m", "--rated-torque", least="0.01 N m", most="1e5 N m")
    if drive_node == thermometer_node:
        raise DescriptionError("is the drive's", key="--thermometer-node", value=drive_node, allowed="another one")
    with progress(1.0, "reading") as bar:
        recorded = read_signals(log, channel_map, advance=bar.advance)
    if map_out is not None:
        write_text(played_map(drive_node, thermometer_node, rated), map_out)
        common.say_written(map_out)
    frames = PlayedDrive(recorded, drive_node, rated, thermometer_node).frames()
    time = recorded["time"].values
    with open_bus(interface, channel) as bus, until_stopped() as stop, progress(_lasts(time), "replaying") as bar:
        done = replay(frames, bus, stop, speed=speed, advance=bar.advance)
    lost = f", {done.lost} not taken by the bus" if done.lost else ""
    common.say(f"{channel}: node {drive_node} is gone; {done.frames} frames sent of {done.lasted:.1f} s{lost}")


def _lasts(time: Any) -> float:
    """How long a log lasts whose clock may be set back [s]."""
    import numpy as np

    steps = np.diff(time[np.isfinite(time)])
    return float(steps[steps > 0.0].sum())
