"""A single unit under control, its load on its own rod: plant, drive, sensor and control, a sample at a time."""

from __future__ import annotations

from ramsight.control.driven import DrivenUnits, Feedback, Setting
from ramsight.control.trajectory import Limits
from ramsight.duty.live import Instant, LiveUnit
from ramsight.duty.profile import Duty, Profile, constant
from ramsight.duty.simulate import SAMPLE_PERIOD
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.assumptions import Assumptions


class UnitLoop(DrivenUnits):
    """A unit, its sensor and its control.

    Args:
        actual: the unit as it is.
        sheet: the unit as its data sheet has it, which is all that sensor and control know.
        start_position: of the piston [m].
        load: on it [N], constant or over time.
        known: whether the sensor is told where the piston is; otherwise it has to be homed.
        oil_temperature: [K].
        temperature_offset: by which the thermometer reads too much [K].
        feedback: where the control takes the position from.
        seed: of the drive's and the position sensor's noise.
        assumptions: what the sensor assumes of the machine; by default what the unit declares.
        limits: of the unit; by default `Limits.of`.
        period: of the samples [s].

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build
        >>> ram = build("ram", machine.load("press").unit("ram"))
        >>> loop = UnitLoop(ram, ram, 0.1, 100e3, known=True)
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
        *,
        known: bool = False,
        oil_temperature: float = 313.15,
        temperature_offset: float = 0.0,
        feedback: Feedback = Feedback.SENSOR,
        seed: int = 0,
        assumptions: Assumptions | None = None,
        limits: Limits | None = None,
        period: float = SAMPLE_PERIOD,
    ) -> None:
        own = None if limits is None else {sheet.name: limits}
        shared = known, oil_temperature, temperature_offset, feedback, seed, assumptions, own, period
        super().__init__([sheet], {sheet.name: start_position}, Setting(*shared))
        self._name = sheet.name
        self._load = load if isinstance(load, Profile) else constant(load)
        self._plant = LiveUnit(actual, start_position, float(self._load(0.0)), oil_temperature, period)
        self.loads: list[float] = []
        self._decide()

    @property
    def now(self) -> Instant:
        """The truth at the newest sample."""
        return self._plant.now

    def step(self) -> None:
        """Go on to the next sample."""
        self._plant.advance(self._commands[self._name].motor_speed, float(self._load(self.now.time + self.period)))
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
        """What the unit was made to do, for `simulate`, which tells all about it."""
        return Duty(
            motor_speed=Profile(self.time, self.records[self._name].command),
            load=Profile(self.time, self.loads),
            oil_temperature=constant(self._oil_temperature),
            start_position=self._start[self._name],
        )
