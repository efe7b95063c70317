"""A machine that was drawn: its parts as they are built, and what its drive and its thermometer are off by."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ramsight.arrays import Array
from ramsight.duty.drive_report import DriveReport, usual_report
from ramsight.duty.lagging import lagging
from ramsight.machine.description import Unit
from ramsight.machine.tolerances import KINDS
from ramsight.plant.as_built import AsBuilt
from ramsight.plant.build import build
from ramsight.plant.hose import Hose, Volume
from ramsight.plant.limits import limits_of
from ramsight.plant.oil import T40, T100, Oil, walther_constants
from ramsight.plant.pump import Pump
from ramsight.plant.unit import HydraulicUnit
from ramsight.plant.valve import ReliefValve

_MAGNETS = 600.0  # s; time constant of a servomotor's magnets, some ten minutes [G]


@dataclass(frozen=True)
class Drawn:
    """One machine."""

    unit: HydraulicUnit  # its parts, as they are
    values: Mapping[str, float]  # what was drawn, by name [SI]
    relief_torque: float  # of the motor at relief pressure, as described [N m]
    usual: DriveReport  # how its drive would report if nothing of it were drawn

    def reported(
        self, time: Array, speed: Array, torque: Array, temperature: Array, seed: int
    ) -> tuple[Array, Array, Array]:
        """What its drive reports.

        Args:
            time: of the samples [s], at equal distances.
            speed: of the motor [rad/s].
            torque: of the motor [N m].
            temperature: of the oil in the pumps [K].

        Returns:
            Motor speed, motor torque and oil temperature, with steps and noise.
        """
        drawn = self.values.get
        warm = 1.0 - np.exp(-time / _MAGNETS)
        gain = drawn("torque_gain", 1.0) * (1.0 + drawn("torque_drift", 0.0) * warm)
        delay = drawn("torque_delay", 0.0)
        late = np.interp(time - delay, time, torque) if delay else torque
        how = replace(
            self.usual,
            seed=seed,
            temperature_offset=drawn("thermometer_offset", 0.0),
            torque_noise=drawn("torque_noise", self.usual.torque_noise),
        )
        behind = lagging(time, temperature, drawn("thermometer_lag", 0.0))
        return how.of(speed, gain * late + drawn("torque_offset", 0.0) * self.relief_torque, behind)


def ready(unit: HydraulicUnit) -> HydraulicUnit:
    """The unit with the options that drawing needs in its equation: pumps whose friction has a factor."""

    def change(part: Any) -> Any:
        return replace(part, friction_factor=part.friction_factor or 1.0) if isinstance(part, Pump) else part

    return unit.mapped(change)


def draw(described: Unit, name: str, nominal: HydraulicUnit, values: Mapping[str, float]) -> Drawn:
    """Make one machine.

    Args:
        nominal: built of it, and `ready`.
        values: of what varies, by name [SI].

    Example:
        >>> from ramsight import machine
        >>> boom = machine.load_machine("mining-loader").unit("boom")
        >>> sheet = ready(build(boom, "boom"))
        >>> made = draw(boom, "boom", sheet, {"leakage": 1.2, "area": 1.001, "cylinder.bore": 0.128})
        >>> round(made.unit.cylinder.area_a / sheet.cylinder.area_a, 6)
        1.016826
    """
    own = {path: value for path, value in values.items() if path not in KINDS}
    unit = ready(build(described.replace(own), name)) if own else nominal
    factor = {kind: values.get(kind, 1.0) for kind in ("leakage", "displacement", "stiffness", "friction")}
    unit = AsBuilt(factor["leakage"], factor["displacement"], factor["stiffness"], factor["friction"]).apply(unit)
    changed: Any = unit.mapped(lambda part: _part(part, values))
    cylinder = unit.cylinder
    area, volumes = values.get("area", 1.0), values.get("volumes", 1.0)
    cylinder = replace(
        cylinder,
        area_a=cylinder.area_a * area,
        area_b=cylinder.area_b * area,
        dead_volume_a=cylinder.dead_volume_a * volumes,
        dead_volume_b=cylinder.dead_volume_b * volumes,
        mass=cylinder.mass * values.get("mass", 1.0),
        stroke=cylinder.stroke + values.get("stop", 0.0),
    )
    made = replace(changed, cylinder=cylinder, oil=_oil(unit.oil, values.get("viscosity", 1.0)))
    return Drawn(made, values, limits_of(nominal).torque, usual_report(nominal))


def _part(part: Any, values: Mapping[str, float]) -> Any:
    changes = {}
    if isinstance(part, Hose | Volume):
        changes["volume"] = part.volume * values.get("volumes", 1.0)
    if isinstance(part, Pump) and part.friction_factor is not None:
        changes["friction_factor"] = part.friction_factor * values.get("pump_friction", 1.0)
    if isinstance(part, ReliefValve):
        changes["setting"] = part.setting * values.get("relief", 1.0)
    if isinstance(conductance := getattr(part, "conductance", None), float):
        changes["conductance"] = conductance * values.get("valves", 1.0)
    return replace(part, **changes) if changes else part


def _oil(oil: Oil, factor: float) -> Oil:
    """The oil, thicker by a factor at 40 and at 100 °C."""
    if factor == 1.0:
        return oil
    thick, thin = (factor * float(oil.viscosity(kelvin)) for kelvin in (T40, T100))
    a, b = walther_constants(T40, thick, T100, thin)
    return replace(oil, walther_a=a, walther_b=b)
