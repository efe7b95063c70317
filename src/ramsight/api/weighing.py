"""What a machine lifts: logs weighed, scales learned from known masses, and weighing while it works."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ramsight.api.tool_places import followed, known_unit, others_of
from ramsight.argument_kinds import by_kind
from ramsight.errors import DescriptionError
from ramsight.logs.channel_map import AnyMap, known_map
from ramsight.machine import load_machine
from ramsight.machine.description import Machine
from ramsight.normal import TWO_SIDED_95
from ramsight.optional import needing
from ramsight.plant.linked import build_linked
from ramsight.signals import Dataset
from ramsight.tool.force_scale import TERMS, UNITS, Scale, described_scale
from ramsight.tool.load_chart import LoadChart, LoadStatus
from ramsight.tool.unit_tracks import Others
from ramsight.tool.weigher import lifts
from ramsight.tool.weighing_events import Plain, Quality, Scene, Weighing
from ramsight.tool.weighing_limits import KNOWN_STD
from ramsight.tool.weighing_tally import Tally, Total, weighed
from ramsight.units import argument, format_si

Quantity = float | str


@dataclass(frozen=True, eq=False)
class Weighed:
    """Weighings of logs."""

    weighings: tuple[Weighing, ...]  # of all logs, in order
    logs: tuple[int, ...]  # for each, which log it is of, from 0
    scale: Scale  # with which they were weighed
    # total, total_std: of the cycles, one good weighing of each [kg]
    total: float
    total_std: float
    cycles: int  # how many of them had a load and a good weighing
    has_chart: bool  # whether the description says what may be lifted

    @property
    def figures(self) -> dict[str, Any]:
        """What `--json` has of it; SI."""
        rows = [
            {**vars(one), "log": log, "quality": one.quality.name.lower(), "reason": one.quality.value,
             "rated_status": one.rated_status.name.lower()}
            for one, log in zip(self.weighings, self.logs, strict=True)
        ]  # fmt: skip
        terms = zip(TERMS, self.scale.value, self.scale.std, strict=True)
        learned = {name: {"value": value, "std": std} for name, value, std in terms}
        covariance = self.scale.covariance[np.triu_indices(len(TERMS))].tolist()  # as C and FMUs take it
        return {
            "weighings": rows, "scale": {**learned, "covariance": covariance, "masses": self.scale.masses},
            "total": self.total, "total_std": self.total_std, "cycles": self.cycles,
        }  # fmt: skip

    @property
    def columns(self) -> dict[str, Any]:
        """Columns of a table with a row a weighing, by names that end in their units."""
        rows = self.weighings
        numbers = {
            "time_s": "time", "duration_s": "duration", "mass_kg": "mass", "mass_std_kg": "std",
            "mass_low_kg": "low", "mass_high_kg": "high",
        }  # fmt: skip
        shares = ("rated_share", "rated_share_std", "exceeded_probability")
        words = {
            "direction": [one.direction for one in rows],
            "quality": ["good" if one.is_good else "bad" for one in rows],
            "reason": ["" if one.is_good else one.quality.value for one in rows],
        }
        return {
            "log": np.array(self.logs, dtype=np.int64),
            "cycle": np.array([one.cycle for one in rows], dtype=np.int64),
            **{name: np.array([getattr(one, key) for one in rows], dtype=float) for name, key in numbers.items()},
            **{name: np.array(texts, dtype=object) for name, texts in words.items()},
            **{name: np.array([getattr(one, name) for one in rows], dtype=float) for name in shares},
            "rated_status": np.array([one.rated_status.name.lower() for one in rows], dtype=object),
        }

    def dataset(self) -> Dataset:
        """The weighings over `weighing`, each variable with its `units`."""
        with needing("datasets"):
            import xarray

        found = {}
        for column, values in self.columns.items():
            unit = next((one for one in ("s", "kg") if column.endswith(f"_{one}")), "")
            name = column.removesuffix(f"_{unit}") if unit else column
            found[name] = ("weighing", values, {"units": unit} if unit else {})
        figures = {"total": self.total, "total_std": self.total_std, "cycles": self.cycles}
        return xarray.Dataset(found, attrs={"kind": "weighings", **figures})

    @property
    def text(self) -> str:
        """The total in a line, and what the scale was learned from in another."""
        band = TWO_SIDED_95 * self.total_std
        good = sum(one.is_good for one in self.weighings)
        learned = [
            f"{name.replace('_', ' ')} {_term(value, unit)} ± {_term(std, unit)}"
            for name, unit, value, std in zip(TERMS, UNITS, self.scale.value, self.scale.std, strict=True)
        ]
        count = self.scale.masses
        source = (
            f"from {count} {'lift' if count == 1 else 'lifts'} of known mass" if count else "from the description alone"
        )
        total = f"total {self.total:.0f} ± {band:.0f} kg (95 %)"
        counts = Counter(one.rated_status for one in self.weighings)
        rated = ", ".join(f"{counts[status]} {status.name.lower()}" for status in LoadStatus)
        limit = f"\nrated load: {rated}; no safety function" if self.has_chart else ""
        return (
            f"{len(self.weighings)} weighings, {good} good; {total} in {self.cycles} cycles\n"
            f"scale {source}: {', '.join(learned)}{limit}"
        )


def _term(value: float, unit: str) -> str:
    scale, name = (100.0, "%") if unit == "1" else (1e-3, "kN")
    return f"{round(scale * value, 2) + 0.0:.2f} {name}"


@by_kind
def weigh(
    machine: str | Path | Machine,
    logs: Any,
    *,
    unit: str | None = None,
    start: Quantity | None = None,
    beside: Mapping[str, Any] | None = None,
    at: Mapping[str, Quantity] | None = None,
    known: Sequence[tuple[Quantity, Any]] = (),
    lowered_empty: bool = False,
    inclination: Quantity = 0.0,
    channel_map: AnyMap | None = None,
) -> Weighed:
    """Weigh what a machine lifts, from the log of the drive that lifts.

    Args:
        machine: with a mechanism that has a payload: its description, name or file.
        logs: of the unit that lifts, as `track` takes them: one, or several in order.
        unit: the unit that lifts; by default the mechanism's first.
        start: position of its piston at the beginning of each log [m], or ``"50 mm"``; None if unknown.
        beside: logs of other units over the same clock, by their names, where there is one log.
        at: where other units stand still [m], ``{"bucket": "250 mm"}``; one with neither may be anywhere.
        known: masses [kg], or ``"2 t"``, each with a log of lifts of it; 0 is an empty tool.
        lowered_empty: whatever is lowered in `logs` is an empty tool, which teaches the zero.
        inclination: of the machine, its front up [rad], or ``"3 deg"``.
        channel_map: of files.

    Returns:
        The weighings, each with time [s], mass and standard deviation [kg] and its quality, the total, and the scale.
        With a load chart each has the largest load moment over the rated one [1] with its standard deviation, the
        probability that the rated load was exceeded, and a status. That is no safety function.

    Raises:
        DescriptionError: the machine has no mechanism or no payload, or a quantity is out of range; or no lift of a
            known mass is good.
        UnknownNameError: no such machine or unit.
        LogError: a log cannot be read.

    Example:
        >>> import ramsight
        >>> boom = ramsight.build("mining-loader", unit="boom")
        >>> run = ramsight.simulate(boom, load="250 kN", start="100 mm", hold="4 s")
        >>> log = ramsight.drive_report(run)
        >>> found = ramsight.weigh("mining-loader", log, start="100 mm", at={"bucket": "250 mm"})
        >>> found.weighings[0].is_good, bool(abs(found.weighings[0].mass - 4150) < 2 * found.weighings[0].std)
        (True, True)
    """
    plain = scene_of(machine, unit, inclination)
    linked, named = plain.machine, plain.unit
    known_map(channel_map)
    stroke = format_si(linked.unit(named).cylinder.stroke, "mm")
    position = None if start is None else argument(start, "m", "start", least="0 mm", most=stroke)
    passed = list(logs) if isinstance(logs, list | tuple) else [logs]
    if beside and (len(passed) > 1 or known):
        raise DescriptionError("is of one log, and there are several", key="beside", allowed="--at, or one log")

    def found_in(log: Any, scene: Scene) -> list[Plain]:
        return lifts(scene, followed(linked, named, log, position, channel_map))

    scene = replace(plain, others=others_of(linked, beside or {}, at or {}, channel_map))
    taught = []
    for mass, log in known:
        most = format_si(2.0 * scene.rated, "kg")
        kilograms = argument(mass, "kg", "known", least="0 kg", most=most)
        taught.append((kilograms, found_in(log, scene)))
    weighable = [found_in(log, scene) for log in passed]
    if lowered_empty:
        taught += [(0.0, [one for one in found if not one.upwards]) for found in weighable]
    scale = learned_scale(scene, taught)
    tallies = [Tally(scale, scene.other_strokes, scene.rated) for _ in weighable]
    done = [weighed(found, tally) for found, tally in zip(weighable, tallies, strict=True)]
    numbers = tuple(k for k, one in enumerate(done) for _ in one)
    total = sum((tally.total for tally in tallies), start=Total())
    whole = tuple(one for each in done for one in each)
    return Weighed(whole, numbers, scale, total.mass, total.std(scale), total.cycles, scene.chart is not None)


def scene_of(machine: str | Path | Machine, unit: str | None, inclination: Quantity) -> Scene:
    """What lifts of a machine are weighed with, without what is known of its other units.

    Raises:
        DescriptionError: the machine has no mechanism or no payload, or the inclination is out of range.
        UnknownNameError: no such machine or unit.
    """
    linked = build_linked(described := load_machine(machine))
    if linked.mechanism.load is None or linked.mechanism.rated_payload <= 0.0:
        raise DescriptionError("is missing: nothing says where a payload acts", key="linkage.payload")
    assert described.linkage is not None, "the machine is linked"
    named = linked.mechanism.cylinders[0] if unit is None else known_unit(linked, unit)
    tilt = argument(inclination, "rad", "inclination", least="-30 deg", most="30 deg")
    return Scene(linked, named, Others(), tilt, LoadChart.of(described.linkage))


def learned_scale(scene: Scene, taught: Sequence[tuple[float, Sequence[Plain]]]) -> Scale:
    """The scale that lifts of known masses teach; bad ones teach nothing.

    What is lowered teaches where it is the same mass: an empty tool, or a load that was not dumped.

    Args:
        taught: masses [kg], each with lifts of it.

    Raises:
        DescriptionError: none of a mass is good.
    """
    scale = prior = described_scale(scene.machine.unit(scene.unit), scene.weight)
    for mass, found in taught:
        tally = Tally(prior, scene.other_strokes)
        said = [tally.add(one) for one in found]  # a motion down with a weighing is of the load that was lifted
        good = [
            one
            for one, weighing in zip(found, said, strict=True)
            if one.quality is Quality.GOOD and (weighing is not None or mass == 0.0)
        ]
        if not good:
            reasons = ", ".join(dict.fromkeys(one.quality.value for one in found)) or "nothing moves"
            raise DescriptionError(f"no lift of it is good ({reasons})", key="known", value=format_si(mass, "kg"))
        for one in good:
            scale = scale.learned(one.mass, one.row, mass, math.hypot(one.own_std, KNOWN_STD * mass))
    return scale


__all__ = ["Weighed", "learned_scale", "scene_of", "weigh"]
