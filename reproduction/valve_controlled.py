"""The boom as loaders usually drive it, through the same cycle: a load-sensing pump and a metering valve, simulated."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ramsight import Duty, Profile, load_machine, simulate
from ramsight.duty.lift_lower import SPEED
from ramsight.duty.profile import constant, trapezoid_moves
from ramsight.duty.simulate import SAMPLE_PERIOD
from ramsight.plant.composed import ComposedUnit, build_composed
from ramsight.plant.limits import pump_reliefs
from ramsight.plant.load_sensing import LoadSensingPump, MeteringValve
from ramsight.plant.steady import torque_at_load
from ramsight.plant.valve import ReliefValve
from reproduction.bench import TEMPERATURE, Bench

if TYPE_CHECKING:
    import xarray

    from ramsight.machine.description import Composed

MACHINE, UNIT = "loader-valve-controlled", "boom"
_BEFORE, _REST = 1.0, 1.5  # s, as the direct drive's cycle
_ROUNDS = 12
_CLOSED, _SAME = 1e-4, 2e-3  # m of the position, 1 of the velocity; a cycle that ends and goes so near is the same
_OPENINGS = (0.3, 0.1)  # of the spool's edges, lifting and lowering, to begin the search with

_LOSSES = (".leakage", ".friction", ".throttling", ".belt", ".stop")
_STILL = 1e-4  # m/s; a rod that is slower rests
PLACES = (
    "motor, inverter and battery",
    "pumps",
    "directional valve",
    "other valves and hoses",
    "friction of the cylinders",
)
"""Where the net energy of a closed cycle goes; the rest is in oil, tank and air."""

Account = dict[str, float]
"""Energies of one cycle [kJ], by name."""


@dataclass(frozen=True)
class Metered:
    """A lift-lower cycle by the spool's opening: how far it opens and for how long, up and down.

    Attributes:
        openings: of the edges at constant speed, up and down [1].
        holds: time for which they are open so far [s].
        ramp: time to open and to shut [s].
    """

    openings: tuple[float, float]
    holds: tuple[float, float]
    ramp: float

    def spool(self, overlap: float) -> Profile:
        """Command to a valve with this overlap [1], in steps of a sample."""
        moves = ((self.openings[0], self.holds[0]), (-self.openings[1], self.holds[1]))
        opening = trapezoid_moves(moves, ramp=self.ramp, before=_BEFORE, rest=_REST)
        time = np.arange(0.0, opening.time[-1], SAMPLE_PERIOD)
        value = opening(time)
        command = np.where(value == 0.0, 0.0, np.sign(value) * (overlap + (1.0 - overlap) * np.abs(value)))
        changed = np.concatenate([[True], np.diff(command) != 0.0])
        return Profile(time[changed], command[changed])

    def middles(self) -> tuple[float, float]:
        """Times in the middle of both moves [s]."""
        first = _BEFORE + self.ramp + 0.5 * self.holds[0]
        return first, first + 0.5 * sum(self.holds) + 2.0 * self.ramp + _REST

    @property
    def duration(self) -> float:
        """Duration of the cycle [s]."""
        return _BEFORE + 2.0 * _REST + 4.0 * self.ramp + sum(self.holds)


def valve_controlled(bench: Bench) -> ComposedUnit:
    """The bench's cylinder, oil and hoses behind the catalogue's load-sensing circuit.

    Relief valve and cut-off go with the bench's relief valve.

    Args:
        bench: a unit that lifts by extending.
    """
    unit = build_composed(UNIT, cast("Composed", load_machine(MACHINE).unit(UNIT)))
    own = {"hose_a": bench.unit.a.hose, "hose_b": bench.unit.b.hose}
    higher = bench.unit.held_side.relief.setting - pump_reliefs(unit)[0].setting

    def fitted(part: Any) -> Any:
        if part.name in own:
            return replace(own[part.name], name=part.name, inlet=part.inlet, outlet=part.outlet)
        if isinstance(part, ReliefValve):
            return replace(part, setting=part.setting + higher)
        return replace(part, cut_off=part.cut_off + higher) if isinstance(part, LoadSensingPump) else part

    held = bench.unit
    return replace(
        unit,
        oil=held.oil,
        tank_pressure=held.tank_pressure,
        cylinder=held.cylinder,
        drive=replace(unit.drive, supply=held.drive.supply),
    ).mapped(fitted)


def metered_run(bench: Bench, load: float, low: float, high: float) -> xarray.Dataset:
    """The direct drive's closed cycle, metered: same way, same velocities, same ramps and rests.

    The openings and their times are searched for; the motor turns at one speed all the time.

    Args:
        bench: of the direct drive.
        load: [N].
        low: share of the stroke from the lowered end at which the cycle begins and ends.
        high: share at which it turns.
    """
    unit, point = valve_controlled(bench), torque_at_load(bench.unit, load, TEMPERATURE, SPEED)
    wanted = np.array([SPEED * point.travel_lift, SPEED * point.travel_lower])
    way = (high - low) * unit.cylinder.stroke
    overlap = next(part.overlap for part in unit.parts() if isinstance(part, MeteringValve))
    openings, holds = np.array(_OPENINGS), way / wanted - bench.ramp
    for _ in range(_ROUNDS):
        cycle = Metered((openings[0], openings[1]), (holds[0], holds[1]), bench.ramp)
        speed = Profile([0.0, cycle.duration], [SPEED, SPEED])
        commands = {"valve": cycle.spool(overlap)}
        duty = Duty(speed, constant(load), constant(TEMPERATURE), bench.at(low), commands=commands)
        run = simulate(unit, duty)
        found = np.abs(np.interp(cycle.middles(), run["time"].values, run["velocity"].values))
        gone = run["position"].values - bench.at(low)
        short = np.array([way - gone.max(), gone[-1] + (way - gone.max())])
        if np.abs(short).max() < _CLOSED and np.abs(found / wanted - 1.0).max() < _SAME:
            break
        openings = np.clip(openings * np.clip(wanted / np.maximum(found, 0.1 * wanted), 0.5, 2.0), 0.01, 1.0)
        holds = np.maximum(holds + short / wanted, 0.1)
    return run


def account(run: xarray.Dataset) -> Account:
    """Where the energy of a closed cycle goes [kJ].

    Args:
        run: simulated, of a unit with a battery.
    """
    attrs = run.attrs
    given, back = attrs["electrical_energy_given"], attrs["electrical_energy_recovered"]
    losses = {key.removeprefix("energy."): value for key, value in attrs.items() if key.endswith(_LOSSES)}
    valve = sum(value for key, value in losses.items() if key.startswith("valve."))
    cylinder = sum(value for key, value in losses.items() if key.startswith("cylinder."))
    pumps = sum(value for key, value in losses.items() if key.startswith("pump"))
    shaft = attrs["energy.shaft_given"] - attrs["energy.shaft_taken"]
    power = run["motor_torque"].values * run["motor_speed"].values
    still = np.abs(run["velocity"].values) < _STILL
    found = {
        "battery_gives": given,
        "gets_back": back,
        "net": given - back,
        "shaft_net": shaft,
        "shaft_at_rest": float(np.sum(power[still]) * SAMPLE_PERIOD),
        "lifted": float(run["load"].values[0] * np.ptp(run["position"].values)),
        "motor, inverter and battery": given - back - shaft,
        "pumps": pumps,
        "directional valve": valve,
        "other valves and hoses": sum(losses.values()) - valve - cylinder - pumps,
        "friction of the cylinders": cylinder,
    }
    return {name: value / 1e3 for name, value in found.items()}


def compared(bench: Bench, low: float, high: float) -> dict[str, dict[str, Account]]:
    """Energies of one cycle [kJ] at each of the bench's loads, direct-driven and valve-controlled.

    Args:
        bench: of the direct drive.
        low: share of the stroke at which the cycle begins and ends.
        high: share at which it turns.
    """
    return {
        name: {
            "direct drive": account(simulate(bench.unit, bench.closed_cycle(load, low, high))),
            "valve-controlled": account(metered_run(bench, load, low, high)),
        }
        for name, load in bench.loads.items()
    }
