"""A unit as an environment of gymnasium: a motor speed as action, what the virtual sensor says as observation."""

from __future__ import annotations

from typing import Any

import numpy as np

from ramsight.api.live_plant import LivePlant, Quantity
from ramsight.api.tracking import sensor_for
from ramsight.duty.drive_response import IDEAL, DriveResponse
from ramsight.duty.simulate import SAMPLE_PERIOD
from ramsight.errors import RamsightError, UnknownNameError
from ramsight.optional import imported
from ramsight.plant.as_built import AsBuilt
from ramsight.plant.build import AnyUnit, build
from ramsight.plant.steady import derive
from ramsight.plant.unit import HydraulicUnit
from ramsight.units import argument

_PLACES = (0.1, 0.9)  # of the stroke, between which starts and targets are drawn: clear of the end stops
_LOADS = (0.2, 0.6)  # of the load at relief pressure, as the duties of `simulate`


def position_env(
    machine: AnyUnit,
    unit: str | None = None,
    *,
    duration: Quantity = 10.0,
    as_built: AsBuilt | None = None,
    drive: DriveResponse = IDEAL,
    period: Quantity = SAMPLE_PERIOD,
) -> Any:
    """An environment of gymnasium that is rewarded for bringing the rod to a target (``pip install "ramsight[gym]"``).

    Args:
        machine: the unit, or what `build` makes one of.
        unit: name of the unit, if the machine has several.
        duration: of an episode [s], after which it is truncated; nothing else ends it.
        as_built: how the machine differs from its data sheet, which is all that the sensor knows.
        drive: how late and how well the drive follows and reports.
        period: of the samples [s].

    Returns:
        A `gymnasium.Env`. Action, shape (1,): motor speed over the highest one, -1 to 1. Observation, shape (5,): the
        sensor's position and its standard deviation over the stroke, its velocity over the fastest, its load over that
        at relief pressure, and the target over the stroke; 0 for what the sensor does not know. Reward: less the true
        distance to the target over the stroke. `info` has the truth, `sample`, and the sensor's `estimate`. A reset
        draws start, target and load, or takes `options` of these names, in SI or text; a step before it is an error.

    Raises:
        RamsightError: gymnasium is not installed.
        DescriptionError: a quantity cannot be read or is out of range.
        UnknownNameError: no such machine or unit.

    Example:
        >>> import importlib.util, ramsight
        >>> if importlib.util.find_spec("gymnasium"):
        ...     env = ramsight.position_env("press", duration="1 s")
        ...     seen, beside = env.reset(seed=1)
        ...     seen, reward, ended, cut, beside = env.step([0.5])
    """
    gym = imported("gymnasium", "gym", RamsightError)
    built = build(machine, unit)
    seconds = argument(duration, "s", "duration", least="0.1 s", most="24 h")

    class PositionEnv(_Episode, gym.Env):  # type: ignore[misc, name-defined]
        """A rod that is to be brought to a target."""

        metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - as gymnasium has it
        action_space = gym.spaces.Box(-1.0, 1.0, (1,), np.float64)
        observation_space = gym.spaces.Box(-np.inf, np.inf, (5,), np.float64)

        def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
            super().reset(seed=seed)
            return self.begin(self.np_random, options or {})

        def step(self, action: Any) -> Any:
            return self.go_on(float(np.asarray(action, dtype=np.float64).reshape(1)[0]))

    return PositionEnv(built, seconds, as_built, drive, period)


class _Episode:
    """What happens between a reset and the end, without gymnasium."""

    def __init__(
        self, unit: HydraulicUnit, duration: float, as_built: AsBuilt | None, drive: DriveResponse, period: Quantity
    ) -> None:
        self._unit, self._duration = unit, duration
        self._made: dict[str, Any] = {"as_built": as_built, "drive": drive, "period": period}
        self._heaviest = derive(unit).load_at_relief
        self._sensor = sensor_for(unit)
        self._plant: LivePlant | None = None
        stroke = unit.cylinder.stroke
        fastest = unit.max_speed * unit.travel_per_radian
        self._scale = np.array([stroke, stroke, fastest, self._heaviest, stroke])

    def begin(self, random: np.random.Generator, options: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
        """Begin an episode: the first observation, and what is beside it."""
        stroke = self._unit.cylinder.stroke
        start, target = random.uniform(*_PLACES, size=2) * stroke
        load = random.uniform(*_LOADS) * self._heaviest
        drawn = {"start": float(start), "target": float(target), "load": float(load)}
        for name in options:
            if name not in drawn:
                raise UnknownNameError("option", str(name), drawn)
        drawn |= options
        self._target = argument(drawn["target"], "m", "target", least="0 mm", most=f"{stroke} m")
        seed = int(random.integers(2**31))
        self._plant = LivePlant(self._unit, start=drawn["start"], load=drawn["load"], seed=seed, **self._made)
        self._sensor.start(self._plant.now.position)
        return self._sense(self._plant)

    def go_on(self, action: float) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Go on by a sample: observation, reward, whether it ends, whether it is cut short, what is beside it."""
        if self._plant is None:
            raise RamsightError("an episode begins with reset(), and there was none")
        self._plant.advance(min(max(action, -1.0), 1.0) * self._unit.max_speed)
        seen, beside = self._sense(self._plant)
        now = self._plant.now
        reward = -abs(now.position - self._target) / self._unit.cylinder.stroke
        return seen, reward, False, now.time >= self._duration - 0.5 * self._plant.period, beside

    def _sense(self, plant: LivePlant) -> tuple[Any, dict[str, Any]]:
        for report in plant.reports:
            self._estimate = self._sensor.step(**report)
        e = self._estimate
        seen = np.array([e.position, e.position_std, e.velocity, e.load, self._target]) / self._scale
        return np.nan_to_num(seen, posinf=0.0, neginf=0.0), {"sample": plant.now, "estimate": e}
