"""What a machine lifts: logs weighed, scales learned from known masses, and weighing while it works."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ramsight.api.live_sensor import Sensor, read_input
from ramsight.api.tool_places import followed, held_at, known_unit, others_of
from ramsight.argument_kinds import by_kind, check_kind
from ramsight.errors import DescriptionError
from ramsight.logs.channel_map import AnyMap, known_map
from ramsight.machine import load_machine
from ramsight.machine.description import Machine
from ramsight.normal import TWO_SIDED_95
from ramsight.optional import needing
from ramsight.plant.linked import build_linked
from ramsight.sensor.virtual_sensor import VirtualSensor
from ramsight.signals import Dataset
from ramsight.tool.force_scale import TERMS, UNITS, Scale, described_scale
from ramsight.tool.live_lifts import LiveLifts
from ramsight.tool.load_chart import LoadChart, LoadStatus
from ramsight.tool.unit_tracks import Others
from ramsight.tool.weighing_events import Plain, Quality, Scene, Weighing, is_same_load, lifts, weighed
from ramsight.tool.weighing_limits import EMPTY_SHARE, KNOWN_STD
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
        return {
            "weighings": rows, "scale": {**learned, "masses": self.scale.masses},
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
    done = [weighed(found, scale, scene.other_strokes) for found in weighable]
    numbers = tuple(k for k, one in enumerate(done) for _ in one)
    return _whole(tuple(one for each in done for one in each), numbers, scale, scene)


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
    strokes = scene.other_strokes
    for mass, found in taught:
        before = [None, *found]
        good = [
            one
            for last, one in zip(before, found, strict=False)
            if one.quality is Quality.GOOD
            and (one.upwards or mass == 0.0 or (last is not None and is_same_load(last, one, prior, strokes)))
        ]
        if not good:
            reasons = ", ".join(dict.fromkeys(one.quality.value for one in found)) or "nothing moves"
            raise DescriptionError(f"no lift of it is good ({reasons})", key="known", value=format_si(mass, "kg"))
        for one in good:
            scale = scale.learned(one.mass, one.row, mass, math.hypot(one.own_std, KNOWN_STD * mass))
    return scale


def _whole(found: tuple[Weighing, ...], logs: tuple[int, ...], scale: Scale, scene: Scene) -> Weighed:
    """Weighings with their total: of each cycle the surest good one, unless the tool is empty."""
    best: dict[tuple[int, int], Weighing] = {}
    for one, log in zip(found, logs, strict=True):
        if one.is_good and one.mass > EMPTY_SHARE * scene.rated:
            other = best.get((log, one.cycle))
            if other is None or one.std < other.std:
                best[log, one.cycle] = one
    total = sum(one.mass for one in best.values())
    shared = sum((one.row for one in best.values()), start=np.zeros(len(TERMS)))
    std = math.hypot(scale.mass(0.0, shared)[1], *(one.own_std for one in best.values()))
    return Weighed(found, logs, scale, total, std, len(best), scene.chart is not None)


__all__ = ["Weighed", "learned_scale", "scene_of", "weigh"]


_AGE = "load_age"


class LiveWeighing:
    """Weighs what a machine lifts while it works: from the same samples the weighings of `weigh`, bit for bit.

    Args:
        machine: with a mechanism that has a payload: its description, name or file.
        unit: the unit that lifts; by default the mechanism's first.
        at: where units without a sensor stand still [m], ``{"bucket": "250 mm"}``; one with neither may be anywhere.
        scale: the machine's, as `weigh` learned it from known masses; by default the description's.
        inclination: of the machine, its front up [rad], or ``"3 deg"``.

    Raises:
        DescriptionError: the machine has no mechanism or no payload, or a quantity is out of range.
        UnknownNameError: no such machine or unit.

    Example:
        >>> import ramsight
        >>> plant = ramsight.build("mining-loader", unit="boom")
        >>> log = ramsight.drive_report(ramsight.simulate(plant, load="250 kN", start="100 mm", hold="4 s"))
        >>> boom, live = ramsight.sensor_for(plant), ramsight.LiveWeighing("mining-loader", at={"bucket": "250 mm"})
        >>> boom.start("100 mm")
        >>> names = ("time", "motor_speed", "motor_torque", "oil_temperature")
        >>> for sample in zip(*(log[name].values for name in names)):
        ...     _ = boom.step(*map(float, sample))
        ...     _ = live.step(float(sample[0]), {"boom": boom})
        >>> live.finish()
        >>> whole = ramsight.weigh("mining-loader", log, start="100 mm", at={"bucket": "250 mm"})
        >>> [one.mass for one in live.weighings] == [one.mass for one in whole.weighings]
        True
    """

    @by_kind
    def __init__(
        self,
        machine: str | Path | Machine,
        unit: str | None = None,
        *,
        at: Mapping[str, Quantity] | None = None,
        scale: Scale | None = None,
        inclination: Quantity = 0.0,
    ) -> None:
        scene = scene_of(machine, unit, inclination)
        self._scene = replace(scene, others=Others(held=held_at(scene.machine, at or {})))
        lifting = self._scene.machine.unit(self._scene.unit)
        self.scale = described_scale(lifting, self._scene.weight) if scale is None else scale
        self._live = LiveLifts(self._scene)
        self._found: list[Plain] = []
        self._weighings: tuple[Weighing, ...] = ()
        self._known: tuple[str, ...] = ()

    @by_kind
    def step(self, time: Quantity, sensors: Mapping[str, Sensor]) -> Weighing | None:
        """Take what sensors said last.

        Args:
            time: of their sample [s]; one that is not after the one before is passed over.
            sensors: of the units, by their names, after their `step`: of the one that lifts, and of others that have
                one; the same at each step.

        Returns:
            The last weighing, where this sample has completed it or made it better: lowering the same load is averaged
            with lifting it.

        Raises:
            DescriptionError: the unit that lifts has no sensor, or a sensor does not say how well it knows the load.
            UnknownNameError: the mechanism has no such unit.
        """
        now = read_input(time, "s", "time")
        if not self._known or tuple(sensors) != self._known:
            self._check(sensors)
        return self._after(self._live.step(now, sensors))

    def finish(self) -> Weighing | None:
        """Weigh the motion that has not ended yet, where no more samples come; returns as `step`."""
        return self._after(self._live.finish())

    @property
    def weighings(self) -> tuple[Weighing, ...]:
        """All of them, in order."""
        return self._weighings

    def _after(self, found: list[Plain]) -> Weighing | None:
        """The last weighing, where motions that have ended changed it."""
        if not found:
            return None
        self._found += found
        before, after = self._weighings, tuple(weighed(self._found, self.scale, self._scene.other_strokes))
        self._weighings = after
        is_new = bool(after) and (len(after) > len(before) or after[-1].direction != before[-1].direction)
        return after[-1] if is_new else None

    def _check(self, sensors: Mapping[str, Sensor]) -> None:
        """Refuse sensors that this machine cannot be weighed with."""
        if self._known:
            allowed = ", ".join(self._known)
            raise DescriptionError("are others than before", key="sensors", value=", ".join(sensors), allowed=allowed)
        for name, one in sensors.items():
            known_unit(self._scene.machine, name)
            check_kind(one, f"sensors {name}", (VirtualSensor,))
            if _AGE not in one.outputs:
                raise DescriptionError("does not say how old its load is", key=f"sensors {name}", allowed="kalman")
        if self._scene.unit not in sensors:
            raise DescriptionError("lack the unit that lifts", key="sensors", allowed=self._scene.unit)
        self._known = tuple(sensors)
