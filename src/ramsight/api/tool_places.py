"""Where a machine's tool is: of tracks of its units, and what is known of units beside the one that is followed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ramsight.api.arguments import checked, pieces_argument
from ramsight.api.following import follow
from ramsight.argument_kinds import by_kind
from ramsight.errors import DescriptionError, UnknownNameError
from ramsight.logs.channel_map import AnyMap
from ramsight.machine import load_machine
from ramsight.machine.description import Machine
from ramsight.plant.linked import LinkedMachine, build_linked
from ramsight.sensor.thresholds import START_STD
from ramsight.signals import Dataset, Signals
from ramsight.tool.tool_place import tool_point
from ramsight.tool.tool_track import TOOL, ToolPoint
from ramsight.tool.unit_tracks import Others
from ramsight.units import argument, format_si

Quantity = float | str


@by_kind
def tool_place(
    machine: str | Path | Machine,
    tracks: Mapping[str, Dataset],
    tool: str = "tip",
    *,
    at: Mapping[str, Quantity] | None = None,
    correlation: float = 0.0,
) -> Dataset:
    """Where a point of the tool was, from the tracks of the units that move it.

    Args:
        machine: with a mechanism: its description, name or file.
        tracks: of its units, by their names, as `track` returns them, over one clock.
        tool: ``tip``, ``payload``, a body's ``BODY.pivot`` or ``BODY.centre_of_mass``, or ``BODY.NAME`` of a described
            point.
        at: positions of units that stand still [m], or ``{"bucket": "250 mm"}``. A unit that has neither a track nor a
            place may be anywhere in its stroke.
        correlation: of the position errors of any two units [1]; 0: each has a drive and an error of its own.

    Returns:
        Over the `time` [s] of the first track, shape (samples,): `tool_reach` and `tool_height` [m] in the machine's
        frame, forward and up, `tool_angle` [rad] of the point's body against the drawing, and their standard deviations
        `tool_reach_std` and so on; NaN while a unit is not referenced. Also the first track's `status`.

    Raises:
        DescriptionError: the machine has no mechanism, there is no track, or a place is outside the stroke.
        UnknownNameError: the machine has no such unit or point.

    Example:
        >>> import ramsight
        >>> boom = ramsight.build("mining-loader", unit="boom")
        >>> run = ramsight.simulate(boom, load="200 kN", start="120 mm")
        >>> track = ramsight.track(boom, ramsight.drive_report(run), start="120 mm")
        >>> place = ramsight.tool_place("mining-loader", {"boom": track}, at={"bucket": "250 mm"})
        >>> round(float(place["tool_height"][0]), 2), place["tool_angle"].attrs["units"]
        (0.5, 'rad')
    """
    linked = build_linked(described := load_machine(machine))
    if not tracks:
        raise DescriptionError("has no track", key="tracks", allowed=", ".join(linked.mechanism.cylinders))
    found = {known_unit(linked, name): checked(one, "track", ("position", "status")) for name, one in tracks.items()}
    first = next(iter(found))
    others = Others({name: Signals.of(one) for name, one in found.items() if name != first}, held_at(linked, at or {}))
    if not -1.0 / max(len(linked.units) - 1, 1) <= correlation <= 1.0:
        raise DescriptionError("is out of range", key="correlation", value=correlation, allowed="0 to 1")
    point = tool_of(described, linked, tool, others, correlation)
    placed = point.beside(first, Signals.of(found[first])).dataset()
    return placed[[*TOOL, "status"]].assign_attrs(kind="tool", tool=tool)


def tool_of(
    described: Machine, linked: LinkedMachine, tool: str, others: Others, correlation: float = 0.0
) -> ToolPoint:
    """A named point of a machine's tool.

    Raises:
        UnknownNameError: there is no such point.
    """
    assert described.linkage is not None, "the machine is linked"
    return ToolPoint(linked, tool_point(described.linkage, tool), others, correlation)


def known_unit(linked: LinkedMachine, name: str) -> str:
    """The name of a unit that moves the mechanism.

    Raises:
        UnknownNameError: it is of none.
    """
    if name not in linked.mechanism.cylinders:
        raise UnknownNameError("unit of the mechanism", name, linked.mechanism.cylinders)
    return name


def held_at(linked: LinkedMachine, at: Mapping[str, Quantity]) -> dict[str, float]:
    """Where units stand still [m].

    Raises:
        DescriptionError: a place is outside the stroke.
    """
    found = {}
    for name, place in at.items():
        stroke = format_si(linked.unit(known_unit(linked, name)).cylinder.stroke, "mm")
        found[name] = argument(place, "m", f"at {name}", least="0 mm", most=stroke)
    return found


def others_of(
    linked: LinkedMachine, logs: Mapping[str, Any], at: Mapping[str, Quantity], channel_map: AnyMap | None = None
) -> Others:
    """What is known of the units beside the one that is followed.

    Args:
        logs: of units that have one, by their names; `at` has where such a unit starts.
        at: where other units stand still [m].
    """
    held = held_at(linked, at)
    tracks = {}
    for name, log in logs.items():
        tracks[name] = followed(linked, known_unit(linked, name), log, held.pop(name, None), channel_map)
    return Others(tracks, held)


def followed(linked: LinkedMachine, name: str, log: Any, start: float | None, channel_map: AnyMap | None) -> Signals:
    """The track of a unit's log, with velocity and load.

    Args:
        log: as `track` takes it.
        start: where its piston is at first [m]; None if unknown.

    Raises:
        DescriptionError: the log has no samples.
    """
    done = follow(
        linked.unit(name), pieces_argument(log, channel_map), channel_map, sensor="kalman", start=start,
        start_std=START_STD, keep_track=True, more=("velocity", "load", "load_std", "load_age"),
    )  # fmt: skip
    if done.track is None:
        raise DescriptionError("has no samples", key=f"log of {name}")
    return done.track
