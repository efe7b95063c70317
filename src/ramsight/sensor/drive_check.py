"""What a drive reports held against itself: speed against the shaft's counter, torque and speed against its power.

A sensor counts how far the shaft has turned, and nothing of torque and temperature can tell that it turned otherwise.
The drive's counter of the shaft can; and power says that torque times speed is what the DC link gives less the losses:

    sum (speed - d angle/dt) h ~ 0,      sum (power - torque speed - losses) h ~ 0

each within what noise, delays and declared uncertainties allow (`disagreement`). Where both are there, the power also
says whether speed or counter is wrong: the one with which torque and power agree is right.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from ramsight.plant.limits import Limits
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.diagnosis import Pair, diagnose
from ramsight.sensor.disagreement import MEMORY, Apart, apart, lately, sure
from ramsight.sensor.uncertainty import Covariance
from ramsight.sensor.virtual_sensor import DC_POWER, LAST_SHAFT_ANGLE, MEASURABLE, SHAFT_ANGLE, SHAFT_BEGUN, SensorGraph

_FASTEST = 1.5  # share of the highest speed; a counter that leaps farther was set anew
_LEAPS = 2.5  # within a second or so, that no overflow explains
TURNS = 3.0
"""Motor speed below which friction and rounding make up torque and power [rad/s]."""
_USUAL = 0.5  # share of what may be missing up to which it teaches gain and losses
_LEARNED = ("gain", "copper", "iron")
_TELLS = 0.05  # share of the torque at relief pressure, below which torques that agree say little
_MOST = 1.5  # greatest torque over that at relief pressure: the pumps' friction and ramps come on top
_LEAST = 1.0  # rad turned lately, below which power says nothing of a torque


@dataclass(frozen=True)
class DriveChecks:
    """What the drive's report says of itself.

    Attributes:
        speed_wrong: the speed contradicts counter and power; the counter has been used.
        counter_wrong: the counter contradicts speed and power; the speed has been used.
        undecided: speed and counter contradict each other, and nothing tells which is right.
        torque_wrong: torque and power contradict each other.
        grows: by how much the position's standard deviation grows as a whole for it [m].
        torque_off: how much the torque may be off while it is contradicted [N m], else 0.
        more: outputs with their units.
        declared: whether anything is held against anything.
        sign_wrong: the sign of torque or speed contradicts the shaft's inertia.
    """

    speed_wrong: Any
    counter_wrong: Any
    undecided: Any
    torque_wrong: Any
    grows: Any
    torque_off: Any
    more: dict[str, tuple[Any, str]]

    declared: bool = True
    sign_wrong: Any = 0.0

    @property
    def contradicted(self) -> Any:
        """Whether an input may be wrong that the sensor cannot do without."""
        return ca.logic_or(ca.logic_or(self.undecided, self.torque_wrong), self.sign_wrong)

    def unless_contradicted(self, condition: Any) -> Any:
        """A condition, and no input contradicts another; the condition alone where nothing is held against anything."""
        return ca.logic_and(condition, ca.logic_not(self.contradicted)) if self.declared else condition


UNCHECKED = DriveChecks(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, {}, declared=False)
"""Where a machine declares neither counter nor power."""


def declared_checks(assumptions: Assumptions) -> tuple[str, ...]:
    """The inputs that a sensor is given for them."""
    shaft = (SHAFT_ANGLE,) if assumptions.shaft.std > 0.0 else ()
    return (*shaft, *((DC_POWER,) if assumptions.power.std > 0.0 else ()))


def check_drive(graph: SensorGraph, assumptions: Assumptions, limits: Limits, thinner: Any) -> DriveChecks:
    """Put what the counter says in the place of the speed, unless it is the counter that is wrong.

    Args:
        graph: the sensor's graph after its intake; gains states.
        assumptions: of drive, counter and power.
        limits: of the unit.
        thinner: viscosity at 40 degC over that of the oil [1].
    """
    given = declared_checks(assumptions)
    if not given:
        return UNCHECKED
    speed = graph.mean_speed
    shaft = _Shaft(graph, assumptions, limits) if SHAFT_ANGLE in given else None
    power = _Power(graph, assumptions, limits) if DC_POWER in given else None
    said = None if power is None else power.against("power", speed, graph.motor_speed)
    turned = said
    if shaft is not None and power is not None:
        turned = power.against("turned_power", shaft.speed, shaft.speed)
    apart_by, speed_wrong, counter_wrong = shaft.judge(said, turned) if shaft is not None else (None, 0.0, 0.0)
    disputed = 0.0 if apart_by is None else apart_by.alarm
    undecided = ca.logic_and(disputed, ca.logic_not(ca.logic_or(speed_wrong, counter_wrong)))
    grows: Any = 0.0
    more: dict[str, tuple[Any, str]] = {}
    if shaft is not None and apart_by is not None:
        shaft.use(counter_wrong, ca.logic_or(speed_wrong, undecided))
        grows = grows + shaft.doubt(apart_by, counter_wrong, undecided)
        more["speed_over_counter"] = (shaft.ratio, "1")
        more |= diagnose(graph, shaft.pair(speed, limits), disputed, speed_wrong, counter_wrong)
    torque_wrong, torque_off = 0.0, 0.0
    turning = speed if shaft is None else shaft.speed
    if power is not None and turned is not None:
        power.learn(turning, turned)
    if power is not None and said is not None and turned is not None:
        # With a speed that is disputed the power tells of that.
        chosen = ca.if_else(counter_wrong, said.alarm, turned.alarm)
        torque_wrong = ca.logic_and(chosen, ca.logic_not(undecided))
        by = ca.if_else(counter_wrong, said.by, turned.by)
        off = power.torque(by)
        leaks = wrong_leakage(limits, off, thinner)
        grows = grows + from_onset(graph, "torque", torque_wrong, leaks)
        torque_off = ca.if_else(torque_wrong, off, 0.0)
        more["torque_missing"] = (power.signed(by), "N m")
        more |= diagnose(graph, power.pair(turning), torque_wrong)
    return DriveChecks(speed_wrong, counter_wrong, undecided, torque_wrong, grows, torque_off, more)


def from_onset(graph: SensorGraph, name: str, alarm: Any, rate: Any) -> Any:
    """A growth of certainty's loss while an alarm lasts [m], with what had come together before it began.

    Args:
        graph: gains states.
        name: of the alarm; its states begin with it.
        alarm: whether there is one.
        rate: of the growth [m/s].
    """
    before = graph.state(f"{name}_alarm")
    graph.becomes(f"{name}_alarm", alarm)
    waiting = lately(graph, f"{name}_doubt", rate)
    return ca.if_else(alarm, ca.if_else(before, rate * graph.elapsed, waiting), 0.0)


def wrong_leakage(limits: Limits, off: Any, thinner: Any) -> Any:
    """Velocity by which leakage is wrong with a torque that is so far off [m/s].

    Args:
        limits: of the unit.
        off: by how much the torque is off [N m].
        thinner: viscosity at 40 degC over that of the oil [1].
    """
    return limits.leak_velocity * thinner * off / limits.torque


class _Shaft:
    """The counter's states."""

    def __init__(self, graph: SensorGraph, assumptions: Assumptions, limits: Limits) -> None:
        self._graph, self._assumed, self._delay = graph, assumptions.shaft, assumptions.drive.delay
        angle, last, begun = graph.measured[SHAFT_ANGLE], graph.held(LAST_SHAFT_ANGLE), graph.held(SHAFT_BEGUN)
        there = ca.fabs(angle) < MEASURABLE
        h, most = graph.elapsed, _FASTEST * limits.max_speed
        turned = (angle - last) / ca.fmax(h, 1e-3)
        goes_on = ca.logic_and(ca.logic_and(there, begun), h > 0.0)
        # A counter that overflows or is set anew leaps once; one that leaps again and again counts nothing.
        leaps = ca.logic_and(goes_on, ca.fabs(turned) > most)
        leaped = graph.state("counter_leaps")
        leaped_1 = ca.exp(-h / MEMORY) * leaped + leaps
        graph.becomes("counter_leaps", leaped_1)
        self.wild = leaped_1 > _LEAPS
        self.speed = ca.if_else(ca.logic_and(goes_on, ca.logic_not(leaps)), turned, graph.mean_speed)
        self._difference = graph.mean_speed - self.speed
        counted, said = lately(graph, "counted", ca.fabs(self.speed)), lately(graph, "said", ca.fabs(graph.mean_speed))
        self.ratio = ca.if_else(counted > _LEAST, said / ca.fmax(counted, _LEAST), 1.0)

    def pair(self, said: Any, limits: Limits) -> Pair:
        """The reported speed and the counter's [rad/s]; `said` is the reported one before the counter's is used."""
        graph, h = self._graph, ca.fmax(self._graph.elapsed, 1e-3)
        std = ca.sqrt((self._assumed.std / h) ** 2 + self._assumed.speed**2)
        return Pair(
            name="speed",
            unit="rad/s",
            reported=said,
            other=self.speed,
            std=std,
            delay=self._delay,
            there=graph.elapsed > 0.0,
            most=limits.max_speed,
            least=TURNS,
        )

    def judge(self, said: Apart | None, turned: Apart | None) -> tuple[Apart, Any, Any]:
        """Whether speed and counter are apart, and which of them is wrong by the power."""
        graph = self._graph
        found = apart(
            graph,
            "shaft",
            self._difference,
            level=graph.mean_speed,
            delay=self._delay,
            lasting=self._assumed.speed / sure(MEMORY),  # what is declared is the most
            noise=self._assumed.std / ca.fmax(graph.elapsed, 1e-3),
        )
        if said is None or turned is None:
            return found, 0.0, self.wild
        speed = ca.logic_and(found.alarm, ca.logic_and(said.alarm, ca.logic_not(turned.alarm)))
        counter = ca.logic_and(found.alarm, ca.logic_and(turned.alarm, ca.logic_not(said.alarm)))
        return found, speed, ca.logic_or(counter, self.wild)

    def use(self, counter_wrong: Any, speed_wrong: Any) -> None:
        """The mean speed is the counter's; where the reported one is wrong, so is that at the sample."""
        graph = self._graph
        graph.mean_speed = ca.if_else(counter_wrong, graph.mean_speed, self.speed)
        graph.angle = graph.mean_speed * graph.elapsed
        graph.motor_speed = ca.if_else(speed_wrong, self.speed, graph.motor_speed)
        wrong_before, used_before = graph.state("speed_was_wrong"), graph.state("used_speed")
        graph.last_speed = ca.if_else(wrong_before, used_before, graph.last_speed)
        graph.becomes("speed_was_wrong", speed_wrong)
        graph.becomes("used_speed", graph.motor_speed)

    def doubt(self, found: Apart, counter_wrong: Any, undecided: Any) -> Any:
        """By how much the position is less certain where the counter that was used may have been wrong [m]."""
        graph = self._graph
        doubted = ca.logic_or(counter_wrong, undecided)
        before = graph.state("counter_doubted")
        graph.becomes("counter_doubted", doubted)
        now = ca.if_else(undecided, ca.fabs(self._difference) * graph.elapsed, 0.0)
        turned = ca.if_else(doubted, ca.if_else(before, now, ca.fabs(found.by)), 0.0)
        return turned * graph.parameters.symbol("travel_per_radian")


class _Power:
    """The power's states.

    What lasts is learned: by how much gain and losses are other than declared,

        power - torque speed - P0 = g torque speed + (1 + c) copper loss + (1 + i) iron loss,

    a Kalman filter of three states that learns nothing while anything seems wrong. A torque that is off in its gain has
    that twice in the copper's loss and not at all in the iron's, so these two have factors of their own.
    """

    def __init__(self, graph: SensorGraph, assumptions: Assumptions, limits: Limits) -> None:
        self._graph, self._assumed, self._drive = graph, assumptions.power, assumptions.drive
        given = graph.measured[DC_POWER]
        there, last, begun = ca.fabs(given) < MEASURABLE, graph.state("last_power"), graph.state("power_begun")
        self._there = ca.logic_and(ca.logic_and(there, begun), graph.elapsed > 0.0)
        # Means over the sample, as the speed is: while a shaft speeds up half a sample is a watt in a hundred.
        self._power = ca.if_else(self._there, 0.5 * (given + last), 0.0)
        self._torque = 0.5 * (graph.motor_torque + graph.held("motor_torque"))
        graph.becomes("last_power", ca.if_else(there, given, last))
        graph.becomes("power_begun", there)
        self._fastest, self._relief = limits.max_speed, limits.torque
        self._rated = self._relief * self._fastest
        self._turned = lately(graph, "turned_lately", ca.fabs(graph.mean_speed))
        a = self._assumed
        self._off = [graph.state(f"power_{what}_off") for what in _LEARNED]
        self._known = Covariance(graph, (a.gain, a.losses, a.losses), prefix="power_")

    def _row(self, speed: Any) -> list[Any]:
        """What goes through the shaft, and losses with torque and with speed, as declared [W]."""
        return [self._torque * speed, self._copper_loss(self._torque), self._iron_loss(speed)]

    def _copper_loss(self, torque: Any) -> Any:
        return self._assumed.copper * (torque / self._relief) ** 2 * self._rated

    def _iron_loss(self, speed: Any) -> Any:
        return self._assumed.iron * ca.fabs(speed) / self._fastest * self._rated

    def _unknown(self, speed: Any) -> Any:
        """Variance of that by what is not known of gain and losses [W2]."""
        return ca.fmax(self._known.variance(self._row(speed)), 0.0)

    def _missing(self, speed: Any) -> Any:
        """Power that torque, speed, and what is known of gain and losses leave unexplained [W]."""
        row = self._row(speed)
        known = sum((1.0 + off) * by for off, by in zip(self._off, row, strict=True)) + self._assumed.standby
        return ca.if_else(self._there, self._power - known, 0.0)

    def _noise(self, speed: Any) -> Any:
        """Standard deviation of that by what is new with each sample [W]."""
        power = self._assumed.std * self._rated
        return ca.sqrt(power**2 + (self._drive.torque * self._relief * speed) ** 2)

    def against(self, name: str, speed: Any, level: Any) -> Apart:
        """The power against torque and a speed [rad/s]; `level` is that speed at the sample."""
        standby = self._assumed.losses * self._assumed.standby
        return apart(
            self._graph,
            name,
            self._missing(speed),
            level=self._graph.motor_torque * level,
            delay=self._drive.delay,
            lasting=ca.sqrt(self._unknown(speed) + standby**2),
            noise=self._noise(speed),
        )

    def pair(self, speed: Any) -> Pair:
        """The reported torque and the one that the power asks for at a speed [N m]."""
        turning = ca.fmax(ca.fabs(speed), TURNS)
        there = ca.logic_and(self._there, ca.fabs(speed) > TURNS)
        return Pair(
            name="torque",
            unit="N m",
            reported=self._torque,
            other=self._asked(speed, turning),
            std=ca.sqrt(self._noise(speed) ** 2 + self._unknown(speed)) / turning,
            delay=self._drive.delay,
            there=there,
            most=_MOST * self._relief,
            least=_TELLS * self._relief,
            gain=max(self._drive.torque_gain, self._assumed.gain),
        )

    def _asked(self, speed: Any, turning: Any) -> Any:
        """The torque T of which the power is (1 + g) T w + (1 + c) k T^2 + (1 + i) iron loss + P0 [N m]."""
        gain, copper, iron = self._off
        through = self._power - (1.0 + iron) * self._iron_loss(turning) - self._assumed.standby
        by_speed, by_square = (1.0 + gain) * turning, (1.0 + copper) * self._copper_loss(1.0)
        root = ca.sqrt(ca.fmax(by_speed**2 + 4.0 * by_square * through, 0.0))
        return ca.if_else(speed < 0.0, -2.0, 2.0) * through / (by_speed + root)

    def learn(self, speed: Any, found: Apart) -> None:
        """Gain and losses, from what is missing while it is no more than it may be.

        Args:
            speed: that the shaft turns with [rad/s].
            found: the power against torque and that speed.
        """
        h, dt = ca.fmax(self._graph.elapsed, 1e-3), self._graph.elapsed
        usual = ca.fabs(found.by) < _USUAL * found.allowed
        use = ca.logic_and(ca.logic_and(self._there, usual), ca.fabs(speed) > TURNS)
        # What delays make of a changing level lasts as long as the change, noise as long as filters do.
        filtered = self._noise(speed) ** 2 * ca.fmax(1.0, 2.0 * self._drive.delay / h)
        variance = filtered + (found.late / MEMORY) ** 2 * ca.fmax(1.0, MEMORY / h)
        known = self._known
        changes = known.update(self._row(speed), self._missing(speed), variance, use)
        a = self._assumed
        for k, std in enumerate((a.gain, a.losses, a.losses)):
            known.add(k, (a.walk * std / a.gain) ** 2 * dt)
            known.limit(std, k)  # after a night it is as little known as that of a new machine, and no less
        for name, off, change in zip(_LEARNED, self._off, changes, strict=True):
            self._graph.becomes(f"power_{name}_off", off + change)
        known.close()

    def signed(self, by: Any) -> Any:
        """Torque that the power has more than is reported, over the last second [N m]."""
        return ca.if_else(self._turned > _LEAST, by / ca.fmax(self._turned, _LEAST), 0.0)

    def torque(self, by: Any) -> Any:
        """Its size, no more than the torque at relief pressure [N m]."""
        return ca.fmin(ca.fabs(by) / ca.fmax(self._turned, _LEAST), self._relief)
