"""A linked machine, or a single unit, under control: plant, drives, sensors and controls, a sample at a time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ramsight.closed_loop.driven import DrivenUnits
from ramsight.closed_loop.referencing import LoopSettings
from ramsight.duty.linked_duty import LinkedDuty
from ramsight.duty.live import Instant, LinkedInstant, LiveMachine, LiveUnit
from ramsight.duty.profile import Duty, Profile, constant
from ramsight.plant.linked import LinkedMachine
from ramsight.plant.unit import HydraulicUnit


class ClosedLoop(DrivenUnits):
    """A machine, its sensors and its controls.

    Args:
        actual: the machine as it is.
        sheet: the machine as its data sheets have it, which is all that sensors and controls know.
        start_position: of each unit's piston [m].
        setting: of the loop.
        payload: [kg].

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.linked import build_linked
        >>> loader = build_linked(machine.load_machine("mining-loader"))
        >>> loop = ClosedLoop(loader, loader, {"boom": 0.2, "bucket": 0.25}, LoopSettings(known=True), payload=2000.0)
        >>> loop.go({"boom": 0.25, "bucket": 0.22})
        >>> all(abs(loop.now.position[name] - x) < 2e-3 for name, x in {"boom": 0.25, "bucket": 0.22}.items())
        True
    """

    def __init__(
        self,
        actual: LinkedMachine,
        sheet: LinkedMachine,
        start_position: Mapping[str, float],
        setting: LoopSettings | None = None,
        *,
        payload: float = 0.0,
    ) -> None:
        how = setting or LoopSettings()
        super().__init__(sheet.units, start_position, how)
        temperatures = {unit.name: how.oil_temperature for unit in actual.units}
        self._plant = LiveMachine(actual, start_position, temperatures, payload, how.period)
        self.payloads: list[float] = []
        self.forces: list[tuple[float, float]] = []
        self.tips: list[tuple[float, float]] = []
        self._payload, self._force = payload, (0.0, 0.0)
        self._decide()

    @property
    def now(self) -> LinkedInstant:
        """The truth at the newest sample."""
        return self._plant.now

    @property
    def payload(self) -> float:
        """What is carried at the newest sample [kg]."""
        return self._payload

    def step(self, payload: float | None = None, tip_force: tuple[float, float] | None = None) -> None:
        """Go on to the next sample.

        Args:
            payload: there [kg]; as it is if not passed.
            tip_force: there, forward and up [N]; as it is if not passed.
        """
        self._payload = self._payload if payload is None else payload
        self._force = self._force if tip_force is None else tip_force
        self._plant.advance(self._followed(), self._payload, self._force)
        self._decide()

    def load(
        self, payload: float, time: float, tip_force: tuple[float, float] | None = None
    ) -> None:  # fmt: skip
        """Let payload [kg], and the force on the tip [N], come or go evenly over a time [s]."""
        count = max(round(time / self.period), 1)
        before, pushed = self._payload, self._force
        goal = pushed if tip_force is None else tip_force
        for k in range(1, count + 1):
            share = k / count
            force = (pushed[0] + share * (goal[0] - pushed[0]), pushed[1] + share * (goal[1] - pushed[1]))
            self.step(before + share * (payload - before), force)

    def _decide(self) -> None:
        super()._decide()
        self.payloads.append(self._payload)
        self.forces.append(self._force)
        self.tips.append(self.now.tip)

    def duty(self, phases: Sequence[tuple[str, float]] = ()) -> LinkedDuty:
        """What the machine was made to do, for `simulate_linked`, which has all quantities of it.

        Args:
            phases: names of its parts and when each begins [s].
        """
        time, forces = np.array(self.time), np.array(self.forces)
        return LinkedDuty(
            motor_speed={name: Profile(time, self.records[name].command) for name in self.units},
            oil_temperature={name: constant(self._oil_temperature) for name in self.units},
            start_position=self._start,
            payload=Profile(time, self.payloads),
            tip_force_x=Profile(time, forces[:, 0]),
            tip_force_z=Profile(time, forces[:, 1]),
            end=float(time[-1]),
            phases=tuple(phases),
        )


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
