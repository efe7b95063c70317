"""A single unit under control, its load on its own rod: plant, drive, sensor and control, a sample at a time."""

from __future__ import annotations

from ramsight.closed_loop.driven import DrivenUnits
from ramsight.closed_loop.loop_settings import LoopSettings
from ramsight.duty.live import Instant, LiveUnit
from ramsight.duty.profile import Duty, Profile, constant
from ramsight.plant.unit import HydraulicUnit


class UnitLoop(DrivenUnits):
    """A unit, its sensor and its control.

    Args:
        actual: the unit as it is.
        sheet: the unit as its data sheet has it, which is all that sensor and control know.
        start_position: of the piston [m].
        load: on it [N], constant or over time.
        setting: of the loop.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build
        >>> ram = build(machine.load_machine("press").unit("ram"), "ram")
        >>> loop = UnitLoop(ram, ram, 0.1, 100e3, LoopSettings(known=True))
        >>> loop.go({"ram": 0.15})
        >>> abs(loop.now.position["ram"] - 0.15) < 1e-3
        True
        >>> loop.load(150e3, 0.5)
        >>> loop.rest(5.0)
        >>> abs(loop.now.position["ram"] - 0.15) < 2e-3
        True
    """

    def __init__(
        self,
        actual: HydraulicUnit,
        sheet: HydraulicUnit,
        start_position: float,
        load: float | Profile = 0.0,
        setting: LoopSettings | None = None,
    ) -> None:
        how = setting or LoopSettings()
        super().__init__([sheet], {sheet.name: start_position}, how)
        self._name = sheet.name
        self._load = load if isinstance(load, Profile) else constant(load)
        self._plant = LiveUnit(actual, start_position, float(self._load(0.0)), how.oil_temperature, how.period)
        self.loads: list[float] = []
        self._decide()

    @property
    def now(self) -> Instant:
        """The truth at the newest sample."""
        return self._plant.now

    def step(self) -> None:
        """Go on to the next sample."""
        self._plant.advance(self._followed()[self._name], float(self._load(self.now.time + self.period)))
        self._decide()

    def load(self, load: float, time: float) -> None:
        """Let the load [N] come or go evenly over a time [s]; after that it stays."""
        begins = self.now.time
        self._load = Profile([begins, begins + time], [self.loads[-1], load])
        self.rest(time)

    def _decide(self) -> None:
        super()._decide()
        self.loads.append(float(self._load(self.now.time)))

    def duty(self) -> Duty:
        """What the unit was made to do, for `simulate`, which has all quantities of it."""
        return Duty(
            motor_speed=Profile(self.time, self.records[self._name].command),
            load=Profile(self.time, self.loads),
            oil_temperature=constant(self._oil_temperature),
            start_position=self._start[self._name],
        )
