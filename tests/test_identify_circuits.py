"""Identification on every circuit of the catalogue, and on every option of a description."""

import re
import sys
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ramsight import machine
from ramsight.calibration.identify_record import IdentifyError
from ramsight.calibration.identify_replay import Circuit, orifice_at_one
from ramsight.calibration.identify_report import summary
from ramsight.calibration.knowledge import of_identification
from ramsight.calibration.tuned import changes, tuned
from ramsight.machine.pump_description import COLUMNS
from ramsight.plant.build import build
from ramsight.plant.holding import Holding
from ramsight.plant.limits import limits_of
from ramsight.plant.pump import Pump
from ramsight.plant.unit import HydraulicUnit, side_nodes

from .plant_bench import UNITS, tabulated

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "evaluation"))
try:
    import identify_coverage as coverage
finally:
    sys.path.remove(str(ROOT / "evaluation"))

BOOM = UNITS["mining-loader boom"]
PLAIN = {"leak": 1.0, "orifice": 0.0, "displacement": 1.0, "stiffness": 1.0, "friction": 1.0}
WORN = {**PLAIN, "leak": 1.2, "orifice": 0.1, "displacement": 1.004, "efficiency": 0.012}


@lru_cache
def worn(name: str) -> Any:
    sheet = coverage.unit_of(name)
    return sheet, coverage.worked(sheet, coverage.deviating(sheet, WORN), 21, leak_factor=1.3)


@pytest.mark.parametrize("name", coverage.UNITS)
def test_a_worn_machine_of_every_circuit_is_found(name):
    _, found = worn(name)
    for key in ("leak", "orifice", "efficiency"):
        estimate = found.factors[key]
        assert estimate.identified, key
        assert estimate.low <= WORN[key] <= estimate.high, key
        assert estimate.high - estimate.low < 0.25, key
    size = found.factors["displacement"]
    assert size.low <= WORN["displacement"] <= size.high
    assert found.factors["efficiency"].value == pytest.approx(WORN["efficiency"], abs=0.004)


@pytest.mark.parametrize("name", coverage.UNITS)
def test_stiffness_is_told_only_where_a_valve_holds_the_load_at_rest(name):
    _, found = worn(name)
    assert found.factors["stiffness"].identified == (name in ("boom", "bucket", "forklift", "forklift 63 mm"))
    if not found.factors["stiffness"].identified:
        assert "a valve that holds them there" in summary(found)


@pytest.mark.parametrize("name", coverage.UNITS)
def test_a_tuned_description_of_every_circuit_is_the_machine_that_was_found(name):
    _, unit = coverage.UNITS[name]
    sheet, found = worn(name)
    described = coverage.machine_of(name)
    new = tuned(described, unit, of_identification(found, described.unit(unit)), "day.csv")
    how = found.deviation
    made = {part.name: part for part in build(machine.loads(new.text).unit(unit), unit).parts()}
    for part in sheet.parts():
        if isinstance(part, Pump):
            pump = made[part.name]
            leak, was = (p.leak_coefficient(32e-6, 872.0) for p in (pump, part))
            assert leak == pytest.approx(how.leak * was, rel=1e-6, abs=0.0)
            assert pump.displacement == pytest.approx(how.displacement * part.displacement, rel=1e-6, abs=0.0)
            assert pump.orifice_leak == pytest.approx(how.orifice * orifice_at_one(part), rel=1e-6, abs=0.0)
            assert pump.hydromechanical_efficiency == pytest.approx(part.hydromechanical_efficiency + how.efficiency)


@dataclass(frozen=True)
class Drain:
    """A part that the library does not have: a bleed from the load's manifold to the tank."""

    name: str
    node: str
    conductance: float

    def connect(self, circuit):
        difference = circuit.pressure(self.node) - circuit.pressure("tank")
        circuit.flow(self.name, self.node, "tank", self.conductance * difference)
        circuit.loss(f"{self.name}.throttling", self.conductance * difference * difference)


def pumps(unit: Any, change: Any) -> Any:
    return unit.mapped(lambda part: change(part) if isinstance(part, Pump) else part)


def leakier(pump: Pump) -> Pump:
    return tabulated(pump, lambda value: 1.0 - 1.3 * (1.0 - value))


def leak_of(unit: HydraulicUnit) -> float:
    limits = limits_of(unit)
    return float(limits.leak_velocity * unit.cylinder.area(unit.held) / limits.pressure)


OPTIONS = {
    "a loss table": lambda unit: pumps(unit, leakier),
    "seal leakage": lambda unit: replace(
        unit, cylinder=replace(unit.cylinder, seal_leak=0.15 * leak_of(unit) * float(unit.oil.viscosity(313.15)))
    ),
    "much free air": lambda unit: replace(unit, oil=replace(unit.oil, air=0.02, polytropic=1.4)),
    "thicker oil under pressure": lambda unit: replace(unit, oil=replace(unit.oil, pressure_viscosity=2e-8)),
    "thermal expansion": lambda unit: replace(unit, oil=replace(unit.oil, expansion=7e-4)),
    "oil that pumps compress": lambda unit: pumps(unit, lambda p: replace(p, compressed=0.02)),
    "leakage like an orifice's": lambda unit: pumps(unit, lambda p: replace(p, orifice_leak=0.3 * orifice_at_one(p))),
    "a part of one's own": lambda unit: replace(
        unit, extra=(Drain("drain", next(iter(side_nodes(unit, "a") - {"chamber_a", "line_a"})), 0.15 * leak_of(unit)),)
    ),
}


@pytest.fixture(scope="module", params=OPTIONS)
def optional(request):
    """What is found of a machine that is exactly its description, and of one that is so without the option."""
    described = OPTIONS[request.param](BOOM)
    return request.param, described, coverage.worked(described, described, 31)


def test_a_machine_with_an_option_is_found_to_be_its_description(optional):
    name, described, found = optional
    truth = {**PLAIN, "orifice": Circuit(described).described().orifice, "efficiency": 0.0}
    for key, estimate in found.factors.items():
        if estimate.identified:
            assert estimate.low <= truth[key] <= estimate.high, (name, key)
    assert found.factors["leak"].identified
    assert found.factors["leak"].value == pytest.approx(1.0, abs=0.02)
    assert found.factors["leak"].high - found.factors["leak"].low < 0.12


def test_air_that_the_equations_cannot_follow_is_refused_by_name():
    circuit = Circuit(replace(BOOM, oil=replace(BOOM.oil, air=0.02, polytropic=1.4)))
    circuit._check(np.array([0.0, 1e-3]))
    for wild in (np.nan, 3.0 * BOOM.cylinder.stroke):
        with pytest.raises(IdentifyError, match=r"2 % of free air \(oil.free_air\)"):
            circuit._check(np.array([0.0, wild]))


def test_the_same_log_without_the_option_described_is_another_machine():
    """The option matters: left out of the description it would be taken for 15 % of leakage."""
    made = OPTIONS["seal leakage"](BOOM)
    leak = coverage.worked(BOOM, made, 31).factors["leak"]
    orifice = coverage.worked(BOOM, made, 31).factors["orifice"]
    assert leak.value + orifice.value > 1.08


def test_a_worn_pump_with_a_table_comes_back_through_its_table():
    described = machine.load_machine("mining-loader")
    pump = described.unit("boom").pump_a
    grid = [(bar, rpm, nu) for bar in (50, 150, 300) for rpm in (400, 1500, 4000) for nu in (20, 46, 200)]
    rows = [f"{bar}, {rpm}, {nu}, {1 - 0.3 * bar * 46 / nu / rpm:.6f}, {0.9 - 5 / bar:.6f}" for bar, rpm, nu in grid]
    table = {"efficiency_table": "\n".join([",".join(COLUMNS), *rows]), "losses": "table"}
    sheet = described.replace(
        {f"units.boom.{name}.{key}": value for name in ("pump_a", "pump_b") for key, value in table.items()}
    )
    unit = build(sheet.unit("boom"), "boom")
    # A tenth more leakage and friction, as wear makes them.
    made = pumps(unit, lambda p: replace(p, leak_factor=1.1, friction_factor=1.1))
    found = coverage.worked(unit, made, 41)
    assert found.factors["leak"].low <= 1.1 <= found.factors["leak"].high
    eta = pump.hydromechanical_efficiency
    rougher = 1.0 / (1.0 + 1.1 * (1.0 / eta - 1.0)) - eta
    assert found.factors["efficiency"].identified
    assert found.factors["efficiency"].value == pytest.approx(rougher, abs=0.0015)
    known = of_identification(found, sheet.unit("boom"))
    assert "units.boom.pump_a.volumetric_efficiency" not in changes(sheet, "boom", known)
    back = build(tuned(sheet, "boom", known, "day.csv").machine.unit("boom"), "boom").a.pump
    state = (150.0, 120e5, 30e-6)
    assert replace(back, orifice_leak=None).leakage(*state, 872.0) == pytest.approx(
        found.factors["leak"].value * float(unit.a.pump.leakage(*state, 872.0)), rel=1e-6, abs=0.0
    )
    assert float(back.friction(*state)) == pytest.approx(1.1 * float(unit.a.pump.friction(*state)), rel=0.02)


VERBS = {
    "direct driven, load-holding valves (loader)": "mining-loader boom",
    "double rod, closed (test bench)": "eha-test-bench axis",
    "pilot-operated checks (single rod)": "eha-single-rod axis",
    "one pump with a holding valve (forklift)": "forklift-mast lift",
    "two pumps, no valves (press)": "press ram",
}


def test_the_readmes_table_of_circuits_is_true():
    """Every circuit of the catalogue is in it; `identify` does there what it says, and a control holds the load so."""
    lines = (ROOT / "README.md").read_text().splitlines()
    head = next(line for line in lines if line.startswith("| circuit | track"))
    names = [cell.strip() for cell in head.strip("|").split("|")]
    rows = lines[lines.index(head) + 2 :]
    rows = rows[: next(k for k, line in enumerate(rows) if not line.startswith("|"))]
    table = {cells[0]: dict(zip(names, cells, strict=True)) for cells in map(_cells, rows)}
    assert set(table) == set(VERBS)
    units = {unit: name for name, unit in ((n, " ".join(u)) for n, u in coverage.UNITS.items())}
    for circuit, unit in VERBS.items():
        _, found = worn(units[unit])
        said = table[circuit]["identify"]
        assert said == ("yes" if found.factors["stiffness"].identified else "without stiffness")
        assert table[circuit]["control"] == ("yes" if Holding(UNITS[unit]).stands else "yes, motor holds")


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in re.split(r"\|", line.strip().strip("|"))]
