"""Whether a drive log can be this machine's: a wrong unit or sign looks healthy sample by sample, but not against it.

Nothing here refuses a log. What does not fit is said in a warning, with the unit that would.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from ramsight.arrays import Array
from ramsight.logs.mapped import ChannelMap, standard_map
from ramsight.plant.limits import limits_of
from ramsight.plant.unit import HydraulicUnit
from ramsight.signals import Dataset, Samples
from ramsight.tracking.mistakes import AGAINST, MOST_SPEED, MOST_TORQUE, MOST_TRAVEL, SPEED_UNITS
from ramsight.tracking.pressed import LONGEST_STEP, PEAK, TURNING
from ramsight.units import FREEZING, RPM, to_si

_PERIOD = 0.5e-3, 0.5  # s; samples of a drive come further apart than the one and closer than the other
_HINTED_PERIOD = 0.9e-3, 0.2  # s; what another unit of the clock has to make of it: 1 to 100 ms, and jitter
_CLOCKS = {"ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_SLOW, _LIVELY = 0.11, 0.2  # shares of the highest speed
_FARTHEST = 3.0  # of the stroke: of a move that ends against a stop
# N m up to which a figure is taken to be in a unit: no motor gives more than four times its rated torque
_TORQUES = {"percent of the rated torque": 4e2, "permille of the rated torque": 4e3, "mN m": np.inf}
_WEAK = 0.02  # of the torque at relief pressure [G]; what turns at all takes more, by friction
_HOT = 353.15  # K; oil of a healthy machine is colder on the average
_MOVED = 2.0  # s of turning either way before signs are judged
_STANDS = 1.0  # rad/s
_NOISY, _RESTED = 2.0, 100  # times the assumed noise of the torque, and samples at rest that it takes to say so
_GAP = 5.0  # usual distances of samples; what is longer, and longer than a second, is a gap
_STEPS = 0.99  # share of the changes at rest that are noise; the others are loads


@dataclass(frozen=True)
class Limits:
    """What a machine's drive can report."""

    max_speed: float  # highest motor speed [rad/s]
    torque: float  # of the motor at relief pressure on the side that asks for more [N m]
    oil: tuple[float, float]  # lowest and highest temperature for which the oil is described [K]
    load_sign: float  # 1 if the load asks for positive torque, -1 if for negative, 0 if it only resists
    stroke: float  # of the cylinder [m]
    travel: float  # of the rod per motor angle, without leakage [m/rad]
    longest: float  # move over the stroke that may be: of a free one, or of one that ends against a stop [1]
    noise: float = np.inf  # of the torque, that the description assumes [N m]
    relief_torque: float = np.inf  # of the motor at relief pressure [N m], of which `noise` is stated as a share
    leaking: float = 0.0  # motor speed that at relief pressure only makes up for what leaks [rad/s]


def reportable(unit: HydraulicUnit, *, against_stops: bool = False) -> Limits:
    """What the drive of a unit can report.

    Args:
        against_stops: whether the rod is known to have been driven against its ends, so that moves are long.
    """
    torques = limits_of(unit)
    return Limits(
        unit.max_speed,
        torques.side_torque,
        unit.oil.temperatures,
        0.0 if unit.cylinder.passive else unit.lift_sign,
        unit.cylinder.stroke,
        abs(unit.travel_per_radian),
        _FARTHEST if against_stops else MOST_TRAVEL,
        unit.assumptions.drive.torque * torques.torque,
        torques.torque,
        torques.leak_velocity / abs(unit.travel_per_radian),
    )


def implausible(
    log: Dataset, unit: HydraulicUnit, channel_map: ChannelMap | None = None
) -> tuple[tuple[str, str], ...]:
    """What of a log that goes from end to end cannot be this machine's: the role of a channel, and what to say of it.

    Where all can be, ``noise`` in place of a role says that the torque scatters more than the description assumes.

    Args:
        log: motor_speed [rad/s], motor_torque [N m] and oil_temperature [K] over time, whole.
    """
    known = channel_map or standard_map([])
    seen, limits = Seen(), reportable(unit, against_stops=True)
    seen.take(log, TURNING * unit.max_speed, limits.leaking)
    found = tuple(findings(seen, limits, {role: one.unit or "" for role, one in known.roles.items()}))
    scatters = "" if found else noise(seen, limits)
    return (("noise", scatters),) if scatters else found


@dataclass
class Seen:
    """What was seen of a log."""

    periods: list[float] = field(default_factory=list)  # usual distance of samples in each piece [s]
    # speeds, torques: 99.5 % of the magnitudes in each piece are below these [rad/s], [N m]
    speeds: list[float] = field(default_factory=list)
    moves: list[float] = field(default_factory=list)  # motor angle of the longest move in each piece [rad]
    # sure_moves: the same, less what leaks at relief pressure: a stop may be pressed for a minute
    sure_moves: list[float] = field(default_factory=list)
    torques: list[float] = field(default_factory=list)
    temperatures: list[float] = field(default_factory=list)  # median of each piece [K]
    # scatters: of the torque while the motor stands, in each piece with enough of that [N m]
    scatters: list[float] = field(default_factory=list)
    # seconds, torque_seconds: time of turning forward and backward [s], and the torque's integral over it [N m s]
    seconds: dict[int, float] = field(default_factory=lambda: {1: 0.0, -1: 0.0})
    torque_seconds: dict[int, float] = field(default_factory=lambda: {1: 0.0, -1: 0.0})

    def take(self, piece: Samples, moving: float, leaking: float = 0.0) -> None:
        """Take a piece in; from a speed of `moving` [rad/s] on the motor turns, up to `leaking` the rod may stand."""
        time = piece["time"].values
        speed, torque = piece["motor_speed"].values, piece["motor_torque"].values
        steps = np.diff(time)
        steps = steps[np.isfinite(steps) & (steps > 0.0)]
        period = float(np.median(steps)) if steps.size else 0.0
        self.periods += [period] if steps.size else []
        self.speeds += _peak(speed)
        fastest = self.speeds[-1] if self.speeds else np.inf  # single wild samples make no move
        tame = np.clip(speed, -fastest, fastest)
        self.moves += _longest_move(time, tame, 0.0)
        self.sure_moves += _longest_move(time, tame, leaking)
        turning = np.abs(speed) > moving
        self.torques += _peak(torque[turning])
        self.scatters += _scatter(speed, torque)
        self.temperatures += _middle(piece["oil_temperature"].values)
        for sign in (1, -1):
            chosen = (sign * speed > moving) & np.isfinite(torque)
            self.seconds[sign] += period * float(np.count_nonzero(chosen))
            self.torque_seconds[sign] += period * float(torque[chosen].sum())


def _longest_move(time: Array, speed: Array, leaking: float) -> list[float]:
    """The largest motor angle between two changes of direction, less what leaks at a speed of `leaking` [rad].

    Over a gap in the log nothing is counted: what the motor did meanwhile is not known.
    """
    known = np.isfinite(time) & np.isfinite(speed)
    time, speed = time[known], speed[known]
    if len(time) < 2:
        return []
    moving = np.sign(speed) * np.clip(np.abs(speed) - leaking, 0.0, None)
    steps = np.clip(np.diff(time), 0.0, None)
    usual = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
    angle = moving[1:] * np.where(steps > max(LONGEST_STEP, _GAP * usual), 0.0, steps)
    begins = np.flatnonzero(np.diff(np.sign(speed[1:]), prepend=2.0))
    return [float(np.abs(np.add.reduceat(angle, begins)).max())]


def _scatter(speed: Array, torque: Array) -> list[float]:
    """Standard deviation of the torque's noise while the motor stands [N m], by its changes; [] if it hardly does."""
    stands = np.abs(speed) < _STANDS
    changes = np.abs(np.diff(torque))[stands[1:] & stands[:-1]]
    changes = changes[np.isfinite(changes)]
    if changes.size < _RESTED:
        return []
    noise = changes[changes <= np.quantile(changes, _STEPS)]
    return [float(0.5 * np.sqrt(np.pi) * noise.mean())]  # E|a - b| = 2 sigma/sqrt(pi)


def _peak(values: Array) -> list[float]:
    known = np.abs(values[np.isfinite(values)])
    return [float(np.quantile(known, PEAK))] if known.size else []


def _middle(values: Array) -> list[float]:
    known = values[np.isfinite(values)]
    return [float(np.median(known))] if known.size else []


def findings(seen: Seen, limits: Limits, units: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """What does not fit: the role of a channel, and what to say of it; by the units in which the log was read."""
    checks = {"time": _clock, "speed": _speed, "torque": _torque, "temperature": _temperature}
    found = [(role, text) for role, check in checks.items() if (text := check(seen, limits, units.get(role, "")))]
    if not found and (text := _signs(seen, limits)):  # signs are judged where the units are right
        found = [("torque", text)]
    yield from found


def _clock(seen: Seen, _: Limits, unit: str) -> str:
    if not seen.periods:
        return ""
    period = float(np.median(seen.periods))
    if period > _PERIOD[1]:
        fitting = [unit for unit, second in _CLOCKS.items() if _PERIOD[0] <= period * second <= _HINTED_PERIOD[1]]
        return f"samples come every {period:.3g} s, a drive's every 1 to 100 ms{_asked(fitting)}"
    if period < _PERIOD[0]:
        factor = next((f for f in (1e3, 1e6, 1e9) if _HINTED_PERIOD[0] <= period * f <= _HINTED_PERIOD[1]), 0.0)
        hint = f": is the clock in a unit {factor:.0f} times larger, s in place of ms?" if factor else ""
        return f"samples come every {1e3 * period:.3g} ms, a drive's every 1 to 100 ms{hint}"
    return ""


def _speed(seen: Seen, limits: Limits, unit: str) -> str:
    peak, move = max(seen.speeds, default=0.0), max(seen.moves, default=0.0) * limits.travel
    sure = max(seen.sure_moves, default=0.0) * limits.travel
    fitting = _asked(_other_speeds(peak, move, limits, unit))
    limit = f"{limits.max_speed / RPM:.0f} rpm"
    if peak > MOST_SPEED * limits.max_speed:
        return f"the motor turns up to {peak / RPM:.5g} rpm, the drive's limit is {limit}{fitting}"
    if sure > _FARTHEST * limits.stroke and not _clock(seen, limits, ""):
        return (
            f"the rod would travel {1e3 * sure:.4g} mm in one move, the stroke is {1e3 * limits.stroke:.0f} mm{fitting}"
        )
    if 0.0 < peak < _SLOW * limits.max_speed and fitting:
        return f"the motor never turns faster than {peak / RPM:.0f} rpm, the drive's limit is {limit}{fitting}"
    return ""


def _other_speeds(peak: float, move: float, limits: Limits, unit: str) -> list[str]:
    """Units in which the same numbers would be speeds of this machine, and its moves no longer than the stroke."""
    now = SPEED_UNITS.get(unit, RPM)
    return [
        other
        for other, factor in SPEED_UNITS.items()
        if factor != now
        and _LIVELY <= peak * factor / now / limits.max_speed <= MOST_SPEED
        and move * factor / now <= limits.longest * limits.stroke
    ]


def _torque(seen: Seen, limits: Limits, unit: str) -> str:
    peak = max(seen.torques, default=0.0)
    if peak > MOST_TORQUE * limits.torque:
        unit = next(unit for unit, most in _TORQUES.items() if peak <= most)
        return (
            f"the torque reaches {peak:.4g} N m, relief pressure asks for no more than {limits.torque:.3g} N m"
            f"{_asked([unit])}"
        )
    if sum(seen.seconds.values()) > _MOVED and peak < _WEAK * limits.torque:
        return (
            f"the torque stays below {peak:.3g} N m while the motor turns, relief pressure asks for"
            f" {limits.torque:.3g} N m{_asked(['kN m', 'a share of the rated torque'])}"
        )
    return ""


def noise(seen: Seen, limits: Limits) -> str:
    """What is to be said of a torque that scatters by more than the description assumes; empty if it does not."""
    scatter = float(np.median(seen.scatters)) if seen.scatters else 0.0
    if scatter <= _NOISY * limits.noise:
        return ""
    share = np.ceil(1e3 * scatter / limits.relief_torque) / 10.0
    return (
        f"the torque scatters by {scatter:.2g} N m while the motor stands, {scatter / limits.noise:.1f} times what the"
        f' description assumes: write torque = "{share:g} %" under assumptions.drive of the unit'
    )


def _temperature(seen: Seen, limits: Limits, unit: str) -> str:
    if not seen.temperatures:
        return ""
    warmth = float(np.median(seen.temperatures))
    lowest, highest = limits.oil
    most_time = f"the oil has {warmth - FREEZING:.4g} °C most of the time"
    as_fahrenheit = to_si(warmth - FREEZING, "degF")
    if warmth > min(_HOT, highest):
        fitting = ["degF"] if lowest < as_fahrenheit < _HOT else []
        return f"{most_time}, more than a healthy machine's{_asked(fitting)}"
    if warmth < lowest:
        return f"{most_time}; it is described from {lowest - FREEZING:.0f} °C on"
    return ""


def _signs(seen: Seen, limits: Limits) -> str:
    total = sum(seen.seconds.values())
    if total < _MOVED:
        return ""
    mean = {sign: seen.torque_seconds[sign] / seen.seconds[sign] for sign in (1, -1) if seen.seconds[sign] > 0.0}
    least = AGAINST * limits.torque
    if min(seen.seconds.values()) > _MOVED and mean[1] - mean[-1] < -least:
        return (
            f"the torque is {mean[1]:.1f} N m while the rod extends and {mean[-1]:.1f} N m while it retracts: friction"
            " makes the first the larger one. Is the sign of speed or torque reversed (sign = -1 in the channel map)?"
        )
    average = sum(seen.torque_seconds.values()) / total
    if average * limits.load_sign < -least:
        wanted = "positive" if limits.load_sign > 0.0 else "negative"
        return (
            f"the torque is {average:.1f} N m on the average while the motor turns, where the load asks for a {wanted}"
            " one: are the signs of speed and torque reversed (sign = -1 in the channel map)?"
        )
    return ""


def _asked(units: list[str]) -> str:
    return f": is it in {' or '.join(units)}?" if units else ""
