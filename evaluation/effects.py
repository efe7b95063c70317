"""What each option of a description moves on the loader's boom: docs/reference/real-machines.md has the table.

One effect at a time, on the same moves with and without it. What is compared is the true position of the rod, or the
torque that the motor gives, of two simulated machines; no sensor is in it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray

from ramsight import machine
from ramsight.duty import Duty, Magnets, Profile, lift_lower, simulate
from ramsight.duty.oil_warming import warmed
from ramsight.duty.profile import constant
from ramsight.duty.work_day import work_day
from ramsight.plant.as_built import AsBuilt
from ramsight.plant.build import build
from ramsight.plant.ddh import DdhUnit

LOADER = machine.load_machine("mining-loader").unit("boom")
HIGH, HALF, WARM, HOUR = 441e3, 258e3, 313.15, 3600.0  # N, N, K, s
SPEED = 157.0  # rad/s
_DAY = 2400.0  # s

Changes = Mapping[str, Any]


@dataclass(frozen=True)
class Effect:
    """One row of the table."""

    name: str  # what happens
    option: str  # the key of the description, or what stands for it, and its value
    source: str  # where that value comes from
    moves: str  # what was done
    measure: Callable[[], float]  # what it moves, in `unit`
    unit: str = "mm"  # of what was measured


def boom(changes: Changes | None = None) -> DdhUnit:
    """The boom with values of its description changed."""
    built = build(LOADER.replace(changes or {}), "boom")
    assert isinstance(built, DdhUnit)
    return built


def both_pumps(**values: Any) -> dict[str, Any]:
    """Values of both pumps."""
    return {f"pump_{side}.{key}": value for side in "ab" for key, value in values.items()}


def resting(unit: DdhUnit, duration: float, temperature: Profile, position: float, load: Profile) -> xarray.Dataset:
    """The motor at rest."""
    duty = Duty(Profile([0.0, duration], [0.0, 0.0]), load, temperature, position)
    return simulate(unit, duty, sample_period=duration / 400.0)


def sunk(changes: Changes) -> float:
    """By how much the load sinks in an hour at rest."""
    run = resting(boom(changes), HOUR, constant(WARM), 0.4, constant(HIGH))
    return 1e3 * float(run["position"][-1] - run["position"][0])


def cooled(position: float) -> float:
    """The same while the oil cools down by 10 K."""
    unit = boom({"oil.thermal_expansion": "7e-4 1/K"})
    run = resting(unit, HOUR, Profile([0.0, HOUR], [WARM, WARM - 10.0]), position, constant(HIGH))
    return 1e3 * float(run["position"][-1] - run["position"][0])


def blocked() -> float:
    """Pressure of the oil per kelvin while the rod stands on its stop [bar/K]."""
    unit = boom({"oil.thermal_expansion": "7e-4 1/K"})
    run = resting(unit, HOUR, Profile([0.0, HOUR], [WARM, WARM + 10.0]), LOADER.cylinder.stroke, constant(HIGH))
    return 1e-6 * float(run["pressure_a"][-1] - run["pressure_a"][0])


def shocked() -> float:
    """What a shock on the locked boom leaves."""
    load = Profile([0.0, 1.0, 1.1, 1.3, 1.4, 4.0], [HIGH, HIGH, 700e3, 700e3, HIGH, HIGH])
    valves = {"port_relief_valve": {"setting": "230 bar", "rated_flow": "100 l/min", "override_pressure": "5 bar"}}
    ends = [resting(boom(c), 4.0, constant(WARM), 0.4, load)["position"].values[-1] for c in (valves, {})]
    return 1e3 * float(ends[0] - ends[1])


def full_lift(unit: DdhUnit, load: float) -> xarray.Dataset:
    """A lift over 0.5 m."""
    held = 0.5 / (SPEED * boom().travel_per_radian)
    speed = Profile(np.cumsum([0.0, 0.5, 0.5, held, 0.5, 0.5]), SPEED * np.array([0, 0, 1, 1, 0, 0]))
    return simulate(unit, Duty(speed, constant(load), constant(WARM), 0.08))


def lifted(unit: DdhUnit, load: float = HIGH, against: DdhUnit | None = None) -> float:
    """How much farther it is at the end of that lift."""
    ends = [full_lift(u, load)["position"].values[-1] for u in (unit, against or boom())]
    return 1e3 * float(ends[0] - ends[1])


def cycled(unit: DdhUnit, load: float = HIGH) -> float:
    """How much higher it is after lifting and lowering."""
    ends = [simulate(u, lift_lower(u, load, WARM))["position"].values[-1] for u in (unit, boom())]
    return 1e3 * float(ends[0] - ends[1])


def low_relief() -> float:
    """How far a lift under 500 kN stays behind with valves that open 7 % below their setting."""
    units = AsBuilt(relief=0.93).apply(boom()), boom()
    runs = [simulate(u, lift_lower(u, 500e3, WARM))["position"].values for u in units]
    return -1e3 * float(np.abs(runs[0] - runs[1]).max())


def cushioned(way: float) -> float:
    """How far behind a piston with cushions is before its stop, at most."""
    cushions = {"length_a": "25 mm", "length_b": "25 mm", "plunger_a": "60 mm", "plunger_b": "95 mm", "flow": "3 l/min"}
    units = boom({f"cylinder.cushion_{key}": value for key, value in cushions.items()}), boom()
    held = 0.1 / (SPEED * units[0].travel_per_radian)
    speed = Profile(np.cumsum([0.0, 0.5, 0.3, held, 0.3, 0.9]), way * SPEED * np.array([0, 0, 1, 1, 0, 0]))
    start = LOADER.cylinder.stroke - 0.07 if way > 0 else 0.07
    runs = [simulate(u, Duty(speed, constant(HALF), constant(WARM), start))["position"].values for u in units]
    return 1e3 * float(np.abs(runs[0] - runs[1]).max())


def dragged(celsius: float) -> float:
    """Load that the additional torque of a lift amounts to by virtual work [kN]."""
    drag = 1.5e5 * LOADER.pump_a.displacement_per_rad / LOADER.pump_a.blocks * 46e-6 * 872.0
    units = boom(both_pumps(viscous_drag=drag)), boom()
    runs = [simulate(u, lift_lower(u, HALF, 273.15 + celsius)) for u in units]
    at = int(np.searchsorted(runs[0]["time"], 4.0))
    more = float((runs[0]["motor_torque"] - runs[1]["motor_torque"])[at])
    return 1e-3 * more / units[1].travel_per_radian


def starved() -> float:
    """What a lift at 3000 rpm from a tank without its charge lacks where pumps want 2 bar [mm]."""
    low, wants = {"tank.pressure": "0.45 bar"}, both_pumps(min_inlet_pressure="2 bar")
    runs = [simulate(boom(c), lift_lower(boom(c), HALF, WARM, motor_speed=2.0 * SPEED)) for c in (low | wants, low)]
    tops = [float(run["position"].max()) for run in runs]
    return 1e3 * (tops[0] - tops[1])


def rougher(changes: Changes) -> float:
    """The same of anything that takes torque of a lift [kN]."""
    units = boom(changes), boom()
    runs = [simulate(u, lift_lower(u, HALF, WARM)) for u in units]
    at = int(np.searchsorted(runs[0]["time"], 4.0))
    return 1e-3 * float((runs[0]["motor_torque"] - runs[1]["motor_torque"])[at]) / units[1].travel_per_radian


def magnets() -> float:
    """Reported over true torque after two hours at the continuous torque, less 1 [%]."""
    time = np.linspace(0.0, 2.0 * HOUR, 7201)
    return 100.0 * float(Magnets(torque=60.0).gain(time, np.full(time.size, 60.0))[-1] - 1.0)


def working(what: Callable[[xarray.Dataset], float]) -> float:
    """Something of 40 minutes of work that begin at 25 degC."""
    unit = boom()
    day = work_day(unit, (60e3, 300e3), 298.15, duration=_DAY, visit_every=120.0, seed=1)
    return what(warmed(unit, day, sample_period=0.5))


def above_tank(run: xarray.Dataset) -> float:
    """By how much the pumps' oil is warmer than the tank's, at most [K]."""
    return float((run["pump_temperature"] - run["oil_temperature"]).max())


def hotter_gaps() -> float:
    """What 5 K in the gaps that nobody reports are worth in a cycle."""
    unit = boom()
    ends = [simulate(unit, lift_lower(unit, HIGH, kelvin))["position"].values[-1] for kelvin in (WARM + 5.0, WARM)]
    return 1e3 * float(ends[0] - ends[1])


_IN, _BESIDE = both_pumps(compression="in efficiency"), both_pumps(compression="beside efficiency")
_CYCLE = "a cycle under 441 kN, 40 °C"
_LIFT = "a lift over 0.5 m under 441 kN"

EFFECTS = (
    Effect("healthy load-holding valve", '`safety_valve.closed_leakage = "0.3 ml/min"`',
           "data sheets of poppet valves: 5 drops a minute", "an hour at rest under 441 kN",
           lambda: sunk({"safety_valve.closed_leakage": "0.3 ml/min"})),
    Effect("worn load-holding valve", '`safety_valve.closed_leakage = "10 ml/min"`',
           "worn or dirty seats, 2 to 10 ml/min", "an hour at rest under 441 kN",
           lambda: sunk({"safety_valve.closed_leakage": "10 ml/min"})),
    Effect("relief valve set 7 % low", "`AsBuilt(relief=0.93)`",
           "settings are made by hand, to 5 %, and springs settle", "a cycle under 500 kN; most apart", low_relief),
    Effect("pilot of the relief valve", '`relief_valve.pilot_leakage = "1 l/min"`',
           "pilot oil of pilot-operated valves, 0.3 to 1 l/min", "a cycle under 490 kN",
           lambda: cycled(boom({"relief_valve.pilot_leakage": "1 l/min"}), 490e3)),
    Effect("port relief on the locked boom", '`port_relief_valve.setting = "230 bar"`',
           "set 10 % above the pumps' valves, as usual", "0.3 s of 700 kN at rest", shocked),
    Effect("locked oil cools by 10 K", '`oil.thermal_expansion = "7e-4 1/K"`',
           "mineral oils", "at rest at 0.3 m", lambda: cooled(0.3)),
    Effect("locked oil cools by 10 K", '`oil.thermal_expansion = "7e-4 1/K"`',
           "mineral oils", "at rest at 0.65 m", lambda: cooled(0.65)),
    Effect("locked oil warms up on a stop", '`oil.thermal_expansion = "7e-4 1/K"`',
           "mineral oils", "at rest, the rod out", blocked, "bar/K"),
    Effect("cushion at the upper stop", '`cylinder.cushion_length_b = "25 mm"`, `cushion_flow = "3 l/min"`',
           "cushions are 20 to 30 mm long; the needle valve is set on the machine",
           "into the stop at 1500 rpm, 258 kN; most apart",
           lambda: cushioned(1.0)),
    Effect("cushion at the lower stop", '`cylinder.cushion_length_a = "25 mm"`, `cushion_flow = "3 l/min"`',
           "the same", "into the stop at 1500 rpm, 258 kN; most apart", lambda: cushioned(-1.0)),
    Effect("compression, η_v measured at the outlet", '`pump_a.compression = "in efficiency"`, both',
           "ISO 4409", _LIFT, lambda: lifted(boom(_IN))),
    Effect("the same", '`pump_a.compression = "in efficiency"`, both', "ISO 4409", _CYCLE, lambda: cycled(boom(_IN))),
    Effect("compression, η_v measured at low pressure", '`pump_a.compression = "beside efficiency"`, both',
           "a flow meter in the return line", _LIFT, lambda: lifted(boom(_BESIDE))),
    Effect("air at the inlet, beside that", '`oil.free_air = "1 %"`, tank at 4 bar',
           "free air of 0.25 to 1 %", _LIFT,
           lambda: lifted(boom({**_BESIDE, "oil.free_air": "1 %"}), against=boom(_BESIDE))),
    Effect("drag of the pumps, warm", '`pump_a.viscous_drag = "0.0151 N m s/rad"`, both',
           "Wilson, C_v = 1.5·10⁵", "a lift under 258 kN, 40 °C", lambda: dragged(40.0), "kN"),
    Effect("drag of the pumps, cold", '`pump_a.viscous_drag = "0.0151 N m s/rad"`, both',
           "Wilson, C_v = 1.5·10⁵", "a lift under 258 kN, 0 °C", lambda: dragged(0.0), "kN"),
    Effect("belt that loses torque", '`pump_a.belt_efficiency = "97.5 %"`, both',
           "tooth belts 97 to 98 %", "a lift under 258 kN",
           lambda: rougher(both_pumps(belt_efficiency="97.5 %")), "kN"),
    Effect("seals that the oil presses on", '`cylinder.pressure_friction = "3 %"`',
           "cylinders pass on 95 to 98 %", "a lift under 258 kN",
           lambda: rougher({"cylinder.pressure_friction": "3 %"}), "kN"),
    Effect("belt that creeps", '`pump_a.belt_creep = "1 %"`, both', "V-belts 0.5 to 1 %", _CYCLE,
           lambda: cycled(boom(both_pumps(belt_creep="1 %")))),
    Effect("pumps that starve", '`pump_a.min_inlet_pressure = "2 bar"`, both, tank at 0.45 bar',
           "gear pumps want 0.6 to 0.8 bar, those of closed circuits 2 bar and more", "a lift at 3000 rpm under 258 kN",
           starved),
    Effect("magnets that warm up", "`Magnets(torque=60.0)`, 60 K", "neodymium, −0.11 %/K", "two hours at 60 N m",
           magnets, "% torque"),
    Effect("oil in the pumps' gaps", "`warmed(unit, work_day(…))`", "heat stores and surfaces, within a factor of two",
           "40 min of work, over the tank", lambda: working(above_tank), "K"),
    Effect("5 K in the gaps, unreported", "oil temperature", "as above", _CYCLE, hotter_gaps),
)  # fmt: skip


def study(advance: Callable[[int], object]) -> list[dict[str, Any]]:
    """The rows with what was measured."""
    found = []
    for effect in EFFECTS:
        value = effect.measure()
        assert math.isfinite(value)
        row = {key: getattr(effect, key) for key in ("name", "option", "source", "moves", "unit")}
        found.append({**row, "value": value})
        advance(1)
    return found


def table(found: list[dict[str, Any]]) -> list[str]:
    """The table of docs/reference/real-machines.md."""
    head = ["| effect | option | where the value is from | what was done | moves the rod by |", "|---|---|---|---|---|"]
    rows = []
    for row in found:
        digits = 1 if abs(row["value"]) >= 1.0 else 2
        shown = f"{row['value']:+.{digits}f}".replace("-", "−")
        what = f"{shown} mm" if row["unit"] == "mm" else f"– ({shown} {row['unit']})"
        rows.append(f"| {row['name']} | {row['option']} | {row['source']} | {row['moves']} | {what} |")
    return head + rows
