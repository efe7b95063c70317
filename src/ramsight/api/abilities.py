"""What a unit can have: which sensors, tests, controls and exports, and what keeps it from more."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec

from ramsight.deploy.compiler import find_compiler
from ramsight.duty.commissioning_duty import leak_test_speeds, usual_loads
from ramsight.plant.build import AnyUnit, build
from ramsight.plant.directional import metered
from ramsight.plant.holding import Holding, held_by_valve
from ramsight.plant.load_sensing import MeteringValve
from ramsight.plant.unit import HydraulicUnit
from ramsight.plant.valve import ReliefValve
from ramsight.sensor.redundancy import declared, detectable
from ramsight.sensor.report.detectors import COUNTER, POWER, PRESSURES
from ramsight.units import RPM

_WARM = 313.15  # K
_FAST = 1.0  # rad/s; what turns more slowly is not looked at as a leak test


@dataclass(frozen=True)
class Ability:
    """Something that a unit can have, or not."""

    what: str  # for example `leak test`
    can: bool  # whether it can, at least in part
    how: str  # how, or why not, in words

    @property
    def text(self) -> str:
        """The ability as one line of a list."""
        return f"{self.what:<10} {'yes' if self.can else 'no':<3}  {self.how}"


def abilities(machine: AnyUnit, *, unit: str | None = None) -> tuple[Ability, ...]:
    """What a unit can have, from its parts and from what is installed here.

    Example:
        >>> for one in abilities("press")[:4]:
        ...     print(one.what, one.can, one.how)
        sensors True kalman, balance, table; kalman finds the position by itself at the end stops
        faults False a speed or torque wrong by a share shows at the next reference; with counter and DC power at once
        leak test True on the upper stop, for the pump holds the load: 42, 73 rpm at 40 °C, half a minute each
        identify True all but stiffness: the load sinks at rest, so that nobody sees the oil give way
    """
    built = build(machine, unit)
    if any(isinstance(part, MeteringValve) for part in built.parts()):
        return (_sensors(built), _faults(built), *_METERED, *_exports())
    holding = Holding(built)
    return (
        _sensors(built),
        _faults(built),
        _leak_test(built, holding),
        _identify(built),
        _control(holding),
        *_exports(),
    )


_METERED = tuple(
    Ability(what, False, "the motor turns at one speed, and a valve decides what moves")
    for what in ("leak test", "identify", "control")
)


def _sensors(unit: HydraulicUnit) -> Ability:
    finds = "kalman finds the position by itself at the end stops"
    if unit.cylinder.passive:
        finds = "where a load only resists no end shows: they need a start or a switch"
    how = f"kalman, balance, table; {finds}"
    if not any(isinstance(part, ReliefValve) for part in unit.parts()):
        how += "; without a relief valve no limit of the load is known to it"
    return Ability("sensors", True, how)


_MAY_BE_WRONG = ("speed", "torque", COUNTER, POWER, PRESSURES)


def _faults(unit: HydraulicUnit) -> Ability:
    """Which signals that are wrong show before the next reference, by what the machine declares."""
    found = {one: others for one, others in detectable(declared(unit.assumptions)).items() if one in _MAY_BE_WRONG}
    seen = {one: others for one, others in found.items() if others is not None}
    if not seen:
        how = "a speed or torque wrong by a share shows at the next reference; with counter and DC power at once"
        return Ability("faults", False, how)
    groups = {
        "wrong and named": [one for one, others in seen.items() if not others],
        "seen, not which": [one for one, others in seen.items() if others],
        "unseen before a reference": [one for one in found if one not in seen],
    }
    return Ability("faults", True, "; ".join(f"{how}: {', '.join(these)}" for how, these in groups.items() if these))


def _leak_test(unit: HydraulicUnit, holding: Holding) -> Ability:
    speeds = leak_test_speeds(unit, usual_loads(unit), _WARM)
    if min(speeds) < _FAST:
        rpm = f"{min(speeds) / RPM:.1f} rpm"
        return Ability(
            "leak test", False, f"so little leaks that the motor would have to turn at {rpm}, slower than it can"
        )
    rpm = ", ".join(f"{speed / RPM:.0f}" for speed in speeds)
    if holding.stands:
        return Ability("leak test", True, f"against the closed valve: {rpm} rpm at 40 °C under a high load, 8 s each")
    how = f"on the upper stop, for the pump holds the load: {rpm} rpm at 40 °C, half a minute each"
    return Ability("leak test", True, how)


def _identify(unit: HydraulicUnit) -> Ability:
    if metered(unit.parts()):
        return Ability("identify", True, "values of its parts, from runs with a measured position, for a valve meters")
    if held_by_valve(unit):
        return Ability("identify", True, "leakage, displacement, stiffness, friction, efficiency of the pumps")
    return Ability("identify", True, "all but stiffness: the load sinks at rest, so that nobody sees the oil give way")


def _control(holding: Holding) -> Ability:
    if holding.stands:
        return Ability("control", True, "a valve holds the load at rest, the motor stands")
    return Ability(
        "control", True, "the motor has to turn at rest for what leaks; once a report is lost the load sinks"
    )


def _exports() -> tuple[Ability, ...]:
    """Exports work for every circuit; what is installed here decides the rest."""
    compiled = find_compiler() is not None
    how = "C99 and FMU of the sensor, FMU of the plant"
    export = how if compiled else f"{how}; no C compiler here: nothing is measured, FMUs hold sources alone"
    missing = [name for name in ("canopen", "can") if find_spec(name) is None]
    encoder = "a position sensor on CANopen" if not missing else 'needs pip install "ramsight[can]"'
    return Ability("export", True, export), Ability("encoder", not missing, encoder)
