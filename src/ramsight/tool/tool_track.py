"""The tool's place beside a unit's track, piece by piece."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ramsight.arrays import Array
from ramsight.plant.linkage.members import Spot
from ramsight.plant.linked import LinkedMachine
from ramsight.signals import Signal, Signals
from ramsight.tool.tool_place import PLACE, place_of
from ramsight.tool.unit_tracks import Others
from ramsight.tracking.pieces import Follower

_WORDS = {
    "reach": ("m", "the tool's point, forward in the machine's frame"),
    "height": ("m", "the tool's point, up in the machine's frame"),
    "angle": ("rad", "angle of the tool's body against the drawing, up positive"),
}
TOOL = tuple(f"tool_{name}{end}" for name in PLACE for end in ("", "_std"))
"""Columns of a track with a tool."""


@dataclass(frozen=True)
class ToolPoint:
    """A point of a machine's mechanism, and what is known of its other units."""

    machine: LinkedMachine  # with its mechanism
    point: Spot  # of one of its bodies
    others: Others  # the units beside the one that is followed
    correlation: float = 0.0  # of the position errors of any two units [1]

    @property
    def columns(self) -> tuple[str, ...]:
        """Those of `TOOL`."""
        return TOOL

    def following(self, follower: Follower, unit: str) -> WithTool:
        """A follower of a unit whose track says where the tool is, too."""
        return WithTool(follower, unit, self)

    def beside(self, unit: str, track: Signals) -> Signals:
        """A unit's track with the tool's place in further columns."""
        rods = self.others.rods(self.machine, unit, track)
        strokes = np.array([one.cylinder.stroke for one in self.machine.units])
        found = place_of(self.machine.mechanism, self.point, rods.position, rods.std, strokes, self.correlation)
        columns: dict[str, Signal] = dict(track.columns)
        for name in PLACE:
            unit_of, words = _WORDS[name]
            values: tuple[tuple[str, Array, str], ...] = (
                ("", found.value[name], words),
                ("_std", found.std[name], f"standard deviation of {words}"),
            )
            for end, values_of, text in values:
                columns[f"tool_{name}{end}"] = Signal(values_of, {"units": unit_of, "long_name": text})
        return Signals(columns, track.attrs)


@dataclass(frozen=True)
class WithTool:
    """A follower whose track says where the tool is, too."""

    follower: Follower  # of the unit
    unit: str
    tool: ToolPoint  # the point

    @property
    def outputs(self) -> Sequence[str]:
        """Names of what it says."""
        return (*self.follower.outputs, *TOOL)

    def followed(self, piece: Signals) -> Signals:
        """What it says of the next piece."""
        return self.tool.beside(self.unit, self.follower.followed(piece))
