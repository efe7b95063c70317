"""Machines whose circuit is described: named circuits, circuits given in full, and what is refused."""

import math
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ramsight import machine
from ramsight.duty import Duty, Profile, lift_lower, simulate
from ramsight.duty.profile import constant
from ramsight.errors import DescriptionError
from ramsight.machine import catalogue
from ramsight.machine.placed import KINDS
from ramsight.plant.build import build
from ramsight.plant.ddh import build_ddh
from ramsight.plant.machine_tables import cautions
from ramsight.plant.steady import derive, torque_at_load
from ramsight.plant.unit import side_nodes

from .command import at_once
from .test_machine import refusal

MACHINES = [("eha-test-bench", "axis"), ("eha-single-rod", "axis"), ("press", "ram"), ("forklift-mast", "lift")]
BUILT = {name: build(machine.load_machine(name).unit(unit), unit) for name, unit in MACHINES}


def text_of(name):
    return catalogue.find("machine", name).path.read_text(encoding="utf-8")


@pytest.mark.parametrize(("name", "unit"), MACHINES)
def test_a_template_reads_back_as_the_machine_it_was_made_from(name, unit):
    read = machine.load_machine(name)
    text = machine.template(read)
    assert machine.loads(text).units == read.units
    assert text.index('kind = "pump"') < text.index('model = "PGI')
    assert all(len(line) <= 120 or line.startswith("efficiency") for line in text.splitlines())


@pytest.mark.parametrize(("name", "unit"), MACHINES)
def test_a_machine_lifts_and_lowers_and_its_balances_close(name, unit):
    described, built = machine.load_machine(name).unit(unit), BUILT[name]
    load = max(described.load.loads.values())
    run = simulate(built, lift_lower(built, load, 313.15))
    assert abs(run.attrs["energy_residual"]) < 1e-3
    assert abs(run.attrs["volume_residual"]) < 1e-3
    speed, velocity = run["motor_speed"].values, run["velocity"].values
    turning = abs(speed) > 0.99 * abs(speed).max()
    assert (speed * velocity)[turning].min() > 0.0
    # Steady travel and torque are those of the laws without the simulation; line and valve drops are left out of them.
    point = torque_at_load(built, load)
    for sign, travel, torque in (
        (1, point.travel_lift, point.torque_lift),
        (-1, point.travel_lower, point.torque_lower),
    ):
        last = max(i for i in range(len(speed)) if turning[i] and speed[i] * built.lift_sign * sign > 0)
        assert abs(velocity[last] / speed[last]) == pytest.approx(travel, rel=1e-2)
        assert run["motor_torque"].values[last] == pytest.approx(torque, rel=0.08)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "unit"), MACHINES)
def test_check_and_simulate_as_commands(name, unit, tmp_path):
    for arguments in (
        ["check", name],
        ["simulate", name, "--unit", unit, "--load", "5 kN", "--hold", "0.5 s", "--out", tmp_path / "a.nc"],
        ["catalog", "show", name],
        ["new", tmp_path / "mine.toml", "--like", name],
        ["check", tmp_path / "mine.toml"],
    ):
        done = at_once(*arguments)
        assert done.returncode == 0, done.stderr
        assert "look twice" not in done.stdout


def test_what_needs_a_direct_driven_unit_says_so():
    with pytest.raises(DescriptionError, match=r"units.axis.circuit = 'eha-double-rod'.*allowed: ddh"):
        build_ddh("axis", machine.load_machine("eha-test-bench").unit("axis"))


def test_what_follows_from_a_circuit():
    bench, single, mast = (derive(BUILT[name]) for name in ("eha-test-bench", "eha-single-rod", "forklift-mast"))
    assert bench.area_ratio == bench.geared_flow_ratio == 1.0
    assert single.geared_flow_ratio == 1.0
    assert mast.geared_displacement_b == 0.0
    assert side_nodes(BUILT["forklift-mast"], "a") == {"chamber_a", "line", "port"}
    assert side_nodes(BUILT["forklift-mast"], "b") == {"chamber_b"}
    for name, unit in MACHINES:
        assert cautions(machine.load_machine(name).unit(unit), BUILT[name]) == ()


def test_the_rods_volume_goes_through_the_pilot_operated_check():
    unit = BUILT["eha-single-rod"]
    run = simulate(unit, lift_lower(unit, 40e3, 313.15))
    rod = (unit.cylinder.area_a - unit.cylinder.area_b) * run["velocity"].values
    lowering = run["motor_speed"].values < -150.0
    # While it lowers, the reservoir takes what the rod displaces, through the valve that the load's pressure opens.
    assert run["pilot_b_opening"].values[lowering].min() == 1.0
    assert run["pilot_b_flow"].values[lowering][-1] == pytest.approx(rod[lowering][-1], rel=0.03)
    oil = run["reservoir_oil"].values
    displaced = (unit.cylinder.area_a - unit.cylinder.area_b) * (run["position"][-1] - run["position"][0])
    assert oil[-1] - oil[0] == pytest.approx(-float(displaced), abs=2e-6)


def test_the_masts_valve_takes_its_time():
    unit = BUILT["forklift-mast"]
    speed = Profile([0.0, 0.5, 0.501, 1.0], [0.0, 0.0, -50.0, -50.0])
    run = simulate(unit, Duty(speed, constant(28e3), constant(313.15), 0.7), sample_period=1e-3)
    opening = run["holding_opening"].values
    reached = run["time"].values[opening > 0.95][0]
    assert reached - 0.501 == pytest.approx(0.030, abs=0.002)


BROKEN = [
    ("press", 'inlet = "tank"\noutlet = "port_a"\nmodel', 'inlet = "port_a"\noutlet = "tank"\nmodel', "has to fill"),
    ("press", 'kind = "pump"\n', 'kind = "pmup"\n', "units.ram.parts.pump_a.kind = 'pmup': unknown choice"),
    ("press", 'kind = "pump"\n', 'kind = "pmup"\n', "(allowed: accumulator, check valve, directional valve, hose, "),
    ("press", 'kind = "pump"\n', "", "units.ram.parts.pump_a.kind: needs the kind of part"),
    ("press", 'kind = "pump"\ninlet = "tank"', 'kind = "pump"\ninlet = "Tank 1"', "units.ram.parts.pump_a.inlet"),
    ("press", 'inlet = "tank"', 'inlet = "sump"', "units.ram.parts.pump_a = 'sump': no oil at this node"),
    ("press", "[units.ram.parts.pump_a]", "[units.ram.parts.drive]", "drive, oil_temperature are taken"),
    ("press", 'volume = "0.3 l"', 'volume = "0.3 bar"', "units.ram.parts.manifold_a.volume = '0.3 bar'"),
    ("press", 'volume = "0.3 l"', 'volumen = "0.3 l"', "unknown key; did you mean 'volume'?"),
    ("press", '"1.1 GPa"', '"4 GPa"', "units.ram.parts.pipe_a.effective_bulk_modulus = '4 GPa'"),
    ("press", 'regime = "turbulent"', 'regime = "rough"', "units.ram.parts.pipe_a.regime = 'rough': unknown choice"),
    ("press", "PGI100-2-025", "PGI100-2-026", "a.toml: units.ram.parts.pump_a: unknown pump"),
    ("eha-test-bench", '{ value = "eha-double-rod"', '{ value = "eha"', "units.axis.circuit = 'eha': unknown choice"),
    ("eha-test-bench", "[units.axis.parts.hose_a]", "[units.axis.parts.hoes_a]", "parts.hoes_a.kind: needs the kind"),
    ("eha-test-bench", 'rod_a = { value = "30 mm"', 'rod_a = { value = "60 mm"', "cylinder.rod_a = '60 mm'"),
]


@pytest.mark.parametrize(("name", "old", "new", "words"), BROKEN, ids=range(len(BROKEN)))
def test_a_mistake_in_a_circuit_is_one_line(name, old, new, words):
    text = text_of(name)
    text = re.sub(r'\{ value = ("[^"]*"), source = [^}]*\}', r"\1", text) if "{" not in old else text
    assert old in text
    changed = text.replace(old, new, 1)
    if words == "has to fill":
        with pytest.raises(DescriptionError, match=words):
            build(machine.loads(changed).unit("ram"), "ram")
        return
    line = refusal(changed)
    assert "a.toml" in line
    assert words in line


def test_a_circuit_needs_a_pump_and_parts_are_tables():
    text = text_of("eha-test-bench")
    head = text[: text.index("[units.axis.parts.pump]")]
    assert "parts: is missing" in refusal(head.replace("eha-double-rod", "parts"))
    assert "the circuit has no pump" in refusal(head.replace("eha-double-rod", "parts") + "[units.axis.parts]\n")
    assert "parts.pump" in refusal(head + "[units.axis.parts]\npump = 3\n")
    assert "expected a table" in refusal(head.replace("load_direction", "parts = 3\nload_direction", 1))


def test_values_of_a_part_change_by_their_path():
    worn = machine.load_machine("press").replace({"units.ram.parts.pump_a.volumetric_efficiency": 0.8})
    assert worn.unit("ram").parts["pump_a"].volumetric_efficiency == 0.8
    with pytest.raises(DescriptionError, match="out of range"):
        worn.replace({"units.ram.parts.pump_a.belt": 0.0})


def test_every_kind_of_part_is_used_or_shown_in_the_catalogue():
    known = [*MACHINES, ("eha-valve-rig", "axis"), ("loader-valve-controlled", "boom")]
    used = {part.kind for name, unit in known for part in machine.load_machine(name).unit(unit).parts.values()}
    assert used == set(KINDS)


@pytest.mark.parametrize("name", [*BUILT, "boom", "bucket"])
@settings(max_examples=15)
@given(
    share=st.floats(-0.2, 1.2),
    celsius=st.floats(-10.0, 80.0),
    rpm=st.floats(100.0, 3000.0),
    ramp=st.floats(0.05, 2.0),
    start=st.floats(0.02, 0.98),
)
def test_balances_close_whatever_the_duty(name, units, share, celsius, rpm, ramp, start):
    built = BUILT.get(name) or units[name]
    load = share * derive(built).load_at_relief  # up to and beyond what the relief valve allows, and pulling
    duty = lift_lower(
        built, load, celsius + 273.15, motor_speed=rpm * math.pi / 30, ramp=ramp, hold=1.5,
        start_position=start * built.cylinder.stroke,
    )  # fmt: skip
    run = simulate(built, duty)
    assert abs(run.attrs["energy_residual"]) < 1e-3
    assert abs(run.attrs["volume_residual"]) < 1e-3
    losses = [key for key in run.attrs if key.endswith((".leakage", ".friction", ".throttling", ".stop"))]
    assert len(losses) > 6
    largest = run.attrs["energy.shaft_given"] + run.attrs["energy.shaft_taken"]
    assert all(run.attrs[key] > -1e-6 * largest for key in losses)
    # The stops hold: nothing passes them by more than what the stiffness gives.
    gives = 3e-3 if name in units else 5e-3
    assert float(run["position"].min()) > -gives
    assert float(run["position"].max()) < built.cylinder.stroke + gives
