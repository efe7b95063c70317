"""A bench for single parts: each part alone between rigid volumes, at many states at once."""

import inspect
import math
from dataclasses import dataclass, replace
from functools import lru_cache
from importlib import import_module
from pkgutil import iter_modules

import casadi as ca
import numpy as np
import pytest

import ramsight.plant
from ramsight import machine
from ramsight.plant.accumulator import Accumulator
from ramsight.plant.build import build
from ramsight.plant.circuit import TANK, join
from ramsight.plant.cylinder import Cylinder
from ramsight.plant.directional import DirectionalValve
from ramsight.plant.drive import IdealDrive, ServoDrive
from ramsight.plant.hose import Hose, Volume
from ramsight.plant.load_sensing import LoadSensingPump, MeteringValve
from ramsight.plant.loss_table import LossTable
from ramsight.plant.oil import Oil, walther_constants
from ramsight.plant.pilot_check import PilotCheckValve
from ramsight.plant.pump import Pump
from ramsight.plant.valve import CheckValve, Orifice, ReliefValve, SafetyValve

OIL = Oil(*walther_constants(313.15, 32e-6, 373.15, 6.1e-6), density=872.0, bulk_modulus=1.2e9)
FULL_OIL = replace(OIL, expansion=7e-4, air=0.005, polytropic=1.4, pressure_viscosity=1.8e-8)
TANK_PRESSURE = 4e5
STATES = 24

PUMP = Pump(
    "pump", "in", "out", 31.6e-6 / (2 * np.pi), 28 / 41, 0.9, 0.9, 151.84, 250e5, 46e-6, 872.0, 1.0, 1.5
)  # fmt: skip


def table_of(pump, pressures=(50e5, 150e5, 300e5), speeds=(20.0, 150.0, 420.0), viscosities=(8e-6, 46e-6, 400e-6)):
    """Efficiencies that the analytic law has on a grid."""

    def grid(efficiency):
        return tuple(tuple(tuple(efficiency(p, w, nu) for p in pressures) for w in speeds) for nu in viscosities)

    return LossTable(
        pressures,
        speeds,
        viscosities,
        grid(lambda p, w, nu: 1.0 - pump.leak_coefficient(nu, 872.0) * p / (pump.displacement * w)),
        grid(lambda p, w, nu: pump.displacement * p / float(pump.torque(w, p))),
    )


TABULATED = replace(PUMP, table=table_of(PUMP))


def tabulated(pump, change):
    """A pump by a table, each of whose volumetric efficiencies is changed."""
    laws = table_of(pump)
    other = tuple(tuple(tuple(change(value) for value in row) for row in rows) for rows in laws.volumetric)
    return replace(pump, table=replace(laws, volumetric=other))


HOSE = Hose("hose", "in", "out", 2e-3, 3.0, 32e-3, 0.6e9)
CYLINDER = Cylinder(
    "cylinder", "in", "out", 25335e-6, 15439e-6, 0.7, 5e-4, 5e-4, 4000.0, 3000.0, 4200.0, 17000.0, 3e-4, 5e8, 2.0, 1.0
)
SAFETY = SafetyValve("valve", "in", "out", 2.7e-6, -1.0)

#: what stands on the bench: every class of parts, and every option that changes its equations
PARTS = {
    "pump": PUMP,
    "pump worn like an orifice": replace(PUMP, orifice_leak=2e-9),
    "pump by table": TABULATED,
    "pump from the tank": replace(PUMP, inlet=TANK),
    "pump with viscous drag": replace(PUMP, drag=0.02),
    "pump that compresses its oil": replace(PUMP, compressed=0.02),
    "pump with hydrodynamic drag": replace(PUMP, drag=0.02, hydrodynamic_drag=3e-5),
    "pump on a belt that loses and creeps": replace(PUMP, belt_loss=0.03, belt_creep=0.01),
    "pump that starves": replace(PUMP, filling=PUMP.displacement * 150.0 / math.sqrt(0.8e5)),
    "pump that starves and compresses its oil": replace(
        PUMP, inlet=TANK, compressed=0.02, filling=PUMP.displacement * 150.0 / math.sqrt(0.8e5)
    ),
    "hose": HOSE,
    "hose turning turbulent": replace(HOSE, turbulent=True, diameter=8e-3),
    "hose with inertia": replace(HOSE, segments=3),
    "hose with inertia, turbulent": replace(HOSE, segments=2, turbulent=True, diameter=8e-3),
    "hose that stiffens": replace(HOSE, bulk_modulus=2e8, stiffening=9.0),
    "volume": Volume("volume", "in", 3e-4),
    "accumulator": Accumulator("accumulator", "in", 1e-3, 2e5, 1.3),
    "relief valve": ReliefValve("valve", "in", "out", 210e5, 3.3e-9),
    "relief valve that leaks": ReliefValve("valve", "in", "out", 210e5, 3.3e-9, closed_leak=1e-17),
    "relief valve whose pilot leaks": ReliefValve(
        "valve", "in", "out", 210e5, 3.3e-9, pilot_flow=1e-5, pilot_opens=0.85
    ),
    "relief valve that reseats lower": ReliefValve("valve", "in", "out", 210e5, 3.3e-9, reseats=0.95),
    "check valve that leaks": CheckValve("valve", "in", "out", 0.5e5, 3.8e-6, closed_leak=1e-17),
    "pilot check valve that leaks": PilotCheckValve(
        "valve", "in", "out", "pilot", 0.3e5, 1.2e-6, 3.5, closed_leak=1e-17
    ),
    "safety valve that leaks": replace(SAFETY, closed_leak=1e-17),
    "directional valve that leaks": DirectionalValve("valve", "in", TANK, "out", "pilot", 1e-6, 0.1, closed_leak=1e-17),
    "check valve": CheckValve("valve", "in", "out", 0.5e5, 3.8e-6),
    "check valve without spring": CheckValve("valve", "in", "out", 0.0, 3.8e-6),
    "pilot check valve": PilotCheckValve("valve", "in", "out", "pilot", 0.3e5, 1.2e-6, 3.5),
    "safety valve": SAFETY,
    "safety valve held open": replace(SAFETY, commanded=False),
    "safety valve that takes time": replace(SAFETY, opening_time=0.03),
    "orifice": Orifice("orifice", "in", "out", 1e-6),
    "directional valve": DirectionalValve("valve", "in", TANK, "out", "pilot", 1e-6, 0.1),
    "directional valve that takes time": DirectionalValve("valve", "in", TANK, "out", "pilot", 1e-6, -0.1, 0.05),
    "metering valve": MeteringValve("valve", "in", TANK, "out", "pilot", 1e-6, 0.1, load_line="line", sensing=3e-8),
    "load-sensing pump": LoadSensingPump(
        **vars(PUMP), load_line="out", margin=20e5, cut_off=200e5, band=4e5, swivel_time=0.1
    ),
    "load-sensing pump that compresses its oil": LoadSensingPump(
        **{**vars(PUMP), "compressed": 0.02, "inlet": TANK},
        load_line="out",
        margin=20e5,
        cut_off=200e5,
        band=4e5,
        swivel_time=0.1,
    ),
    "cylinder": CYLINDER,
    "cylinder under a load that resists": replace(CYLINDER, passive=True),
    "cylinder that leaks": replace(CYLINDER, seal_leak=1e-18),
    "cylinder whose seals press": replace(CYLINDER, pressure_friction=0.03),
    "cylinder with cushions": replace(
        CYLINDER,
        cushion_length_a=25e-3,
        cushion_length_b=20e-3,
        cushion_area_a=0.02,
        cushion_area_b=0.01,
        cushion_conductance=1e-7,
    ),
    "double-rod cylinder": replace(CYLINDER, area_b=CYLINDER.area_a),
    "ideal drive": IdealDrive("drive", 0.008),
    "servo drive": ServoDrive("drive", 0.008, 0.8, 16.0, 90.0),
}
UNITS = {
    f"{name} {unit}": build(described, unit)
    for name in ("mining-loader", "eha-test-bench", "eha-single-rod", "press", "forklift-mast")
    for unit, described in machine.load_machine(name).units.items()
}
#: to parametrize tests with that take a second each: of every circuit the slow tests run all
FEW = ("mining-loader boom", "eha-single-rod axis", "forklift-mast lift")
CIRCUITS = [pytest.param(name, marks=() if name in FEW else pytest.mark.slow) for name in UNITS]
#: whole circuits, with all options of the oil, obey the same balances
WHOLE = {
    **UNITS,
    # A motor that turns one way and a load that only resists: what other tests ask of units does not hold for it.
    # And a pump that goes to its margin by itself as long as it turns.
    "loader-valve-controlled boom": build(machine.load_machine("loader-valve-controlled").unit("boom"), "boom"),
    "eha-valve-rig axis": build(machine.load_machine("eha-valve-rig").unit("axis"), "axis"),
    "loader with every option of the oil": replace(UNITS["mining-loader boom"], oil=FULL_OIL),
    "loader with every option of the oil, compressed in its pumps": replace(
        UNITS["mining-loader boom"].mapped(
            lambda part: replace(part, compressed=0.02) if isinstance(part, Pump) else part
        ),
        oil=FULL_OIL,
    ),
    "loader with a servo": replace(UNITS["mining-loader boom"], drive=PARTS["servo drive"]),
}
#: parts of a circuit whose equations stand elsewhere, and why they are not on the bench
EXCUSED = {"Part": "the protocol of all parts"}


def part_classes():
    """Every class under plant/ that can be connected to a circuit."""
    for module in iter_modules(ramsight.plant.__path__):
        loaded = import_module(f"ramsight.plant.{module.name}")
        for name, kind in inspect.getmembers(loaded, inspect.isclass):
            if kind.__module__ == loaded.__name__ and hasattr(kind, "connect"):
                yield name, kind


@dataclass(frozen=True)
class Bench:
    """A circuit, and all of it at one state at a time."""

    model: object
    function: ca.Function

    def at(self, x, u, slope, **changes):
        """Rates, outputs, capacities and changes of what is stored, by name, at states in columns."""
        p = np.repeat(self.model.parameters(**changes)[:, None], x.shape[1], axis=1)
        dx, y, stored = (np.array(part) for part in self.function(x, u, slope, p))
        ode = self.model.ode
        names = [state.name for state in ode.states]
        result = {f"d {name}": row for name, row in zip(names, dx, strict=True)}
        result |= dict(zip(names, x, strict=True))
        result |= {output.name: row for output, row in zip(ode.outputs, y, strict=True)}
        return result | {"d stored": stored[0]}

    def states(self, seed=0, count=STATES):
        """Random states, inputs and slopes, all over what can happen."""
        rng = np.random.default_rng(seed)
        ode = self.model.ode
        x = np.array([_random(state.name, rng, count) for state in ode.states])
        u = np.array([rng.uniform(-400.0, 400.0, count), rng.uniform(-5e4, 5e5, count)])
        u[0, ::6] = 0.0
        return x, u, np.array([rng.uniform(-500.0, 500.0, count), rng.uniform(-1e5, 1e5, count)])

    def rest(self):
        """At rest, at the tank's pressure everywhere, with nothing asked for."""
        ode = self.model.ode
        pressure = self.model.values[ode.parameters.index("tank.pressure")]
        x = np.array([[pressure if s.name.startswith("pressure") else 0.3 if s.name == "position" else 0.0]
                      for s in ode.states])  # fmt: skip
        return x, np.zeros((2, 1)), np.zeros((2, 1))

    def losses(self, found):
        """Power of each loss [W]."""
        return {name: found[f"d energy.{name}"] for name in self.model.losses}


def _random(name, rng, count):
    if name.startswith("pressure"):
        low = 10 ** rng.uniform(4.5, 7.4, count)
        low[::5] = TANK_PRESSURE
        return low
    ranges = {"position": (-1e-3, 0.701), "velocity": (-0.5, 0.5), "motor_speed": (-400.0, 400.0)}
    if name.startswith("flow"):
        return rng.uniform(-2e-3, 2e-3, count)
    if name.startswith("felt"):
        return rng.uniform(0.0, 4e7, count)
    if name.startswith(("opening", "swivel")):
        return rng.uniform(0.0, 1.0, count)
    if name.startswith("spool"):
        return rng.uniform(-1.0, 1.0, count)
    if name.startswith(("energy", "volume")):
        return np.zeros(count)
    return rng.uniform(*ranges.get(name, (-100.0, 100.0)), count)


@lru_cache
def bench(name):
    """The bench of a part or of a whole circuit."""
    if name in WHOLE:
        unit = WHOLE[name]
        model = join("bench", unit.oil, unit.tank_pressure, unit.parts(), audited=True)
    else:
        part = PARTS[name]
        ports = ("inlet", "outlet", "node", "node_a", "node_b", "pump_side", "cylinder_side", "pilot",
                 "pump_port", "tank_port", "port_a", "port_b", "load_line")  # fmt: skip
        nodes = {getattr(part, key) for key in ports if hasattr(part, key)} - {TANK}
        ends = [Volume(f"volume_{node}", node, 1e-3) for node in sorted(nodes)]
        model = join("bench", OIL, TANK_PRESSURE, [part, *ends], audited=True)
    ode = model.ode
    y = ca.vertcat(*(output.expression for output in ode.outputs))
    energy = sum((o.expression for o in ode.outputs if o.name.startswith("stored.")), ca.SX(0))
    stored = ca.jtimes(energy, ode.x, ode.rhs) + ca.jtimes(energy, ode.u, ode.slope)
    return Bench(model, ca.Function("bench", [ode.x, ode.u, ode.slope, ode.p], [ode.rhs, y, stored]))
