"""What a machine lifts while it works: weighings as soon as a lift has ended."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from ramsight.api.live_sensor import read_input
from ramsight.api.tool_places import held_at, known_unit
from ramsight.api.weighing import scene_of
from ramsight.argument_kinds import by_kind, check_kind
from ramsight.errors import DescriptionError
from ramsight.machine.description import Machine
from ramsight.sensor.virtual_sensor import VirtualSensor
from ramsight.tool.force_scale import Scale, described_scale
from ramsight.tool.unit_tracks import Others
from ramsight.tool.weigher import Weigher
from ramsight.tool.weighing_events import Weighing
from ramsight.tool.weighing_tally import extend

Quantity = float | str
_AGE = "load_age"


def weigher_for(
    machine: str | Path | Machine,
    unit: str | None = None,
    *,
    at: Mapping[str, Quantity] | None = None,
    scale: Scale | None = None,
    inclination: Quantity = 0.0,
) -> Weigher:
    """What weighs a machine's lifts; errors are those of `LiveWeighing`.

    Args:
        machine: its description, name or file.
        unit: the unit that lifts.
        at: where units without a sensor stand still [m].
        scale: the machine's.
        inclination: of the machine, its front up [rad].
    """
    scene = scene_of(machine, unit, inclination)
    scene = replace(scene, others=Others(held=held_at(scene.machine, at or {})))
    described = described_scale(scene.machine.unit(scene.unit), scene.weight)
    return Weigher(scene, described if scale is None else scale)


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
        self._live = weigher_for(machine, unit, at=at, scale=scale, inclination=inclination)
        self._scene, self.scale = self._live.scene, self._live.tally.scale
        self._weighings: list[Weighing] = []
        self._known: tuple[str, ...] = ()

    @by_kind
    def step(self, time: Quantity, sensors: Mapping[str, VirtualSensor]) -> Weighing | None:
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
        return tuple(self._weighings)

    @property
    def total(self) -> float:
        """Mass of the cycles so far, one good weighing of each [kg]."""
        return self._live.tally.total.mass

    @property
    def total_std(self) -> float:
        """Standard deviation of the total [kg], for which what the scale leaves open is the same in all weighings."""
        return self._live.tally.total.std(self.scale)

    @property
    def cycles(self) -> int:
        """How many cycles had a load and a good weighing."""
        return self._live.tally.total.cycles

    def _after(self, one: Weighing | None) -> Weighing | None:
        extend(self._weighings, one)
        return one

    def _check(self, sensors: Mapping[str, VirtualSensor]) -> None:
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
