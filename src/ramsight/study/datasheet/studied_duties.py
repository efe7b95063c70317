"""What the machines of a study do: a duty a machine, by its name or from a table."""

from __future__ import annotations

from dataclasses import dataclass, replace
from os.path import isfile

from ramsight.duty.commissioning_duty import commissioning, usual_loads, usual_speed
from ramsight.duty.lift_lower import above_lowered_end, lift_lower
from ramsight.duty.loader_work import USES, loader_work
from ramsight.duty.profile import Duty, Profile, read_duty
from ramsight.duty.work_day import work_day
from ramsight.errors import DescriptionError
from ramsight.plant.unit import HydraulicUnit

DRAWN = ("work-day", *USES)
"""The duties that are drawn at random, and last as long as is asked for."""
NAMED = (*DRAWN, "lift-lower", "commissioning")
_START = 0.2  # share of the stroke above the lowered end
_VISITS = 4  # of lift-lower, so that errors after three references have something to be seen in
_CYCLES = 2  # of lift-lower, under each load


@dataclass(frozen=True)
class Work:
    """What every machine does."""

    # `work-day` (moves and loads at random, others for each machine), `loader-boom` and `loader-bucket` (a wheel
    # loader's work, other for each machine), `lift-lower` (the paper's cycle, after visits to the end stops),
    # `commissioning`, or the file of a table of speeds and loads
    kind: str = "work-day"
    duration: float = 360.0  # after which a work day begins no further move [s]
    visit_every: float = 45.0  # of a work day, time from one visit to an end stop to the next [s]

    @property
    def has_own_oil(self) -> bool:
        """Whether the oil's temperature comes with the duty."""
        return self.kind not in NAMED

    def check(self) -> None:
        """Reject a duty that is not there.

        Raises:
            DescriptionError: it is neither a name nor a file.
        """
        if self.kind not in NAMED and not isfile(self.kind):
            raise DescriptionError(
                "no such duty, and no such file: a table of time, speed and load",
                key="duty",
                value=self.kind,
                allowed=", ".join((*NAMED, "a file")),
            )

    def duty(self, sheet: HydraulicUnit, made: HydraulicUnit, kelvin: float, warming: float, seed: int) -> Duty:
        """The duty of one machine.

        Args:
            made: the machine as it is, which somebody plans by who watches the rod.
            kelvin: oil temperature at first [K].
            warming: by how much it rises over the duty [K].
        """
        loads = usual_loads(sheet)
        if self.kind == "work-day":
            done = work_day(
                sheet, (min(loads), max(loads)), kelvin, duration=self.duration, visit_every=self.visit_every, seed=seed
            )
        elif self.kind in USES:
            done = loader_work(sheet, self.kind, kelvin, duration=self.duration, seed=seed)
        elif self.kind == "lift-lower":
            speed = usual_speed(sheet)
            done = lift_lower(made, loads, kelvin, motor_speed=speed, cycles=_CYCLES, visits=_VISITS)
        elif self.kind == "commissioning":
            done = commissioning(made, loads, kelvin)
        else:
            return read_duty(self.kind, sheet, kelvin, above_lowered_end(sheet, _START))
        least, most = sheet.oil.temperatures
        ends = [min(max(value, least), most) for value in (kelvin, kelvin + warming)]
        return replace(done, oil_temperature=Profile([0.0, done.duration], ends))
