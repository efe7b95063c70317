"""What follows from the mining loader's description, against numbers that were worked out independently."""

import math

import pytest

from ramsight import machine
from ramsight.duty import Duty, simulate
from ramsight.duty.profile import constant, trapezoid_moves
from ramsight.errors import DescriptionError
from ramsight.machine.parts import ReliefValve
from ramsight.plant.build import build
from ramsight.plant.ddh import build_ddh
from ramsight.plant.machine_tables import cautions
from ramsight.plant.oil import ATMOSPHERE
from ramsight.plant.pump import friction_coefficient
from ramsight.plant.steady import derive, torque_at_load

# unit, load kN; lift / lower mm per motor rev at 20, 40, 60 °C; at 40 °C chamber bar lifting and motor N m
# lift / lower; 1500 rpm, the side that holds no load at 2 bar, the pumps' tank ports at 0
ORACLE = [
    ("boom", 1, (0.851, 0.852), (0.850, 0.852), (0.848, 0.852), 2.9, 1.7, -1.4),
    ("boom", 129, (0.837, 0.866), (0.815, 0.887), (0.778, 0.922), 53.5, 21.0, 14.1),
    ("boom", 258, (0.822, 0.881), (0.779, 0.922), (0.708, 0.992), 104, 40.4, 29.6),
    ("boom", 441, (0.802, 0.901), (0.729, 0.972), (0.609, 1.091), 177, 68.0, 51.7),
    ("bucket", 48, (2.605, 2.661), (2.563, 2.699), (2.493, 2.763), 58.5, -24.5, -15.9),
    ("bucket", 96, (2.579, 2.687), (2.499, 2.763), (2.366, 2.890), 111, -46.6, -34.1),
    ("bucket", 162, (2.543, 2.723), (2.411, 2.851), (2.192, 3.065), 183, -77.0, -59.0),
]
PER_REV = 2 * math.pi * 1e3


@pytest.mark.parametrize("row", ORACLE, ids=[f"{row[0]}-{row[1]}kN" for row in ORACLE])
def test_steady_lift_and_lower(units, row):
    name, load, *travels, pressure, lift, lower = row
    for celsius, (up, down) in zip((20, 40, 60), travels, strict=True):
        conditions = {"low_side": 2e5, "tank": 0.0, "atmosphere": 0.0}
        point = torque_at_load(units[name], load * 1e3, celsius + 273.15, 50 * math.pi, **conditions)
        assert point.travel_lift * PER_REV == pytest.approx(up, abs=0.00051)
        assert point.travel_lower * PER_REV == pytest.approx(down, abs=0.00051)
        if celsius == 40:
            assert point.pressure_lift / 1e5 == pytest.approx(pressure, abs=0.051 if pressure < 100 else 0.51)
            assert point.torque_lift == pytest.approx(lift, abs=0.051)
            assert point.torque_lower == pytest.approx(lower, abs=0.051)


@pytest.mark.parametrize(("rpm", "travel"), [(500, 0.485), (1500, 0.729), (3000, 0.791)])
def test_travel_per_revolution_depends_on_speed(units, rpm, travel):
    speed = rpm * math.pi / 30
    conditions = {"low_side": 2e5, "tank": 0.0, "atmosphere": 0.0}
    point = torque_at_load(units["boom"], 441e3, 313.15, speed, **conditions)
    assert point.travel_lift * PER_REV == pytest.approx(travel, abs=0.0011)


def test_geometry(units):
    boom, bucket = derive(units["boom"]), derive(units["bucket"])
    assert boom.area_a == pytest.approx(25335e-6, rel=5e-5)
    assert boom.area_b == pytest.approx(15439e-6, rel=5e-4)
    assert (bucket.area_a, bucket.area_b) == pytest.approx((15328e-6, 9121e-6), rel=5e-5)
    assert (boom.area_ratio, bucket.area_ratio) == pytest.approx((0.609, 0.595), abs=5e-4)
    assert (boom.geared_flow_ratio, bucket.geared_flow_ratio) == pytest.approx((0.613, 0.597), abs=6e-4)
    assert (boom.mismatch, bucket.mismatch) == pytest.approx((0.006, 0.004), abs=6e-4)
    geared = [boom.geared_displacement_a, boom.geared_displacement_b]
    geared += [bucket.geared_displacement_a, bucket.geared_displacement_b]
    assert [value * 2e6 * math.pi for value in geared] == pytest.approx([21.58, 13.23, 40.22, 24.03], abs=0.006)
    travels = [boom.travel_a, boom.travel_b, bucket.travel_a, bucket.travel_b]
    assert [value * PER_REV for value in travels] == pytest.approx([0.852, 0.857, 2.624, 2.634], abs=6e-4)


def test_load_at_relief(units):
    # 532 and 191.5 kN are setting times area; tank and atmosphere add what they press on the rod's area.
    for name, by_area, friction in (("boom", 532e3, 4.2e3), ("bucket", 191.5e3, 2.3e3)):
        found = derive(units[name])
        on_rod = (4e5 - ATMOSPHERE) * (found.area_a - found.area_b) * units[name].lift_sign
        assert found.load_at_relief - on_rod == pytest.approx(by_area, rel=1e-3)
        assert found.load_at_relief - found.load_at_relief_after_friction == pytest.approx(friction)


@pytest.mark.parametrize(
    ("unit", "pump", "leak", "friction"),
    [
        ("boom", "pump_a", 4.391e-12, 5.588e-7), ("boom", "pump_b", 1.697e-12, 3.072e-7),
        ("bucket", "pump_a", 5.708e-12, 9.344e-7), ("bucket", "pump_b", 2.772e-12, 4.187e-7),
    ],
)  # fmt: skip
def test_pump_coefficients(units, unit, pump, leak, friction):
    part = getattr(units[unit], pump[-1]).pump
    assert part.leak_coefficient(32e-6, 872.0) == pytest.approx(leak, rel=2e-4, abs=0.0)
    assert part.leak_coefficient(32e-6, 436.0) == pytest.approx(2 * leak, rel=2e-4, abs=0.0)
    found = friction_coefficient(part.displacement, part.hydromechanical_efficiency)
    assert found == pytest.approx(friction, rel=2e-4, abs=0.0)


def test_viscosity_follows_walther(units):
    oil = units["boom"].oil
    assert (oil.walther_a, oil.walther_b) == pytest.approx((8.70022, 3.41377), rel=1e-5)
    table = {-20: 1350, -10: 552, 0: 259, 10: 136, 20: 78.2, 30: 48.5, 40: 32.0, 50: 22.2, 60: 16.1, 80: 9.4, 100: 6.1}
    for celsius, viscosity in table.items():
        assert 1e6 * oil.viscosity(celsius + 273.15) == pytest.approx(viscosity, rel=6e-3)


@pytest.mark.parametrize("name", ["boom", "bucket"])
@pytest.mark.parametrize("lifting", [True, False])
def test_a_simulated_unit_settles_where_the_steady_laws_say(units, name, lifting):
    unit = units[name]
    load = 300e3 if name == "boom" else 110e3
    point = torque_at_load(unit, load, speed=200.0)
    speed = 200.0 * unit.lift_sign * (1 if lifting else -1)
    moves = trapezoid_moves([(speed, 1.0)], ramp=0.3, before=0.5, rest=0.0)
    run = simulate(unit, Duty(moves, constant(load), constant(313.15), 0.5 * unit.cylinder.stroke, end=1.8))
    travel, torque = (point.travel_lift, point.torque_lift) if lifting else (point.travel_lower, point.torque_lower)
    # Valve drops are left out of the steady laws: up to some bar at this speed.
    assert abs(float(run["velocity"][-1])) == pytest.approx(200.0 * travel, rel=2e-3)
    assert float(run["motor_torque"][-1]) == pytest.approx(torque, rel=0.05)


def test_the_loader_has_nothing_to_look_at_twice(loader, units):
    assert [cautions(loader.unit(name), unit) for name, unit in units.items()] == [(), ()]


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("pump_b.belt", "28/41", "off the area ratio"),
        ("relief_valve.setting", "260 bar", "pump A allows 250 bar"),
        ("drive.max_speed", "6000 rpm", "it allows 4000 rpm"),
        ("drive.max_torque", "50 N m", "the motor has 50 N m"),
        ("load.loads.high", "600 kN", "more than the relief valve lets the unit lift"),
        ("pump_a.displacement", "0.01 cm3/rev", "over its stroke: look at the pump's displacement"),
        ("cylinder.bore", "800 mm", "over its stroke: look at the pump's displacement"),
        ("pump_a.displacement", "250 cm3/rev", "more than the 1 m/s of fast cylinders"),
        ("cylinder.stroke", "20 m", "that is 20000 mm out buckles under"),
        ("cylinder.rod", "9 mm", "that is 700 mm out buckles under 2.72 kN"),
        ("cylinder.dead_volume_b", "60 l", "dead volume of side B, 60 l, is more than the 17.7 l"),
        ("load.loads", {"only": "5 kN"}, "of the 210 bar that the relief valve allows"),
    ],
)
def test_what_an_engineer_would_look_at_twice(loader, key, value, words):
    changed = loader.unit("boom").replace({key: value})
    assert any(words in sentence for sentence in cautions(changed, build_ddh("boom", changed)))


def test_a_rod_that_is_pulled_does_not_buckle_but_sags(loader):
    long = loader.unit("bucket").replace({"cylinder.stroke": "6 m"})
    (said,) = cautions(long, build_ddh("bucket", long))
    assert "the stroke is 67 times the rod's diameter" in said


def test_a_load_that_is_too_light_to_lower_is_said_where_nothing_presses_it_down():
    mast = machine.load_machine("forklift-mast").unit("lift")

    def said(load):
        described = mast.replace({"load.loads.empty": load})
        return [text for text in cautions(described, build(described, "lift")) if "too light to lower" in text]

    assert said("2 kN") == []
    (sentence,) = said("0.2 kN")
    assert "load empty (0.2 kN)" in sentence
    assert "chamber A would fall to -0.8 bar absolute" in sentence, (
        "by hand (200 + 322 + 76 - 600 - 301) N over 3927 mm2"
    )
    boom = machine.load_machine("mining-loader").unit("boom").replace({"load.loads.light": "0 kN"})
    assert cautions(boom, build_ddh("boom", boom)) == (), "pump B presses it down"


def test_a_pump_without_a_relief_valve_is_held_to_what_it_allows():
    ram = machine.load_machine("press").unit("ram")
    parts = {name: part for name, part in ram.parts.items() if not isinstance(part, ReliefValve)}
    bare = ram.replace({"parts": parts, "load.loads.full": "900 kN"})
    said = cautions(bare, build(bare, "ram"))
    assert any("load full (900 kN) asks for" in text and "no relief valve" in text for text in said)


@pytest.mark.parametrize(
    "name", ["eha-single-rod", "eha-test-bench", "eha-valve-rig", "loader-valve-controlled", "press"]
)
def test_no_machine_of_the_catalogue_has_anything_to_look_at_twice(name):
    for unit, described in machine.load_machine(name).units.items():
        assert cautions(described, build(described, unit)) == ()


@pytest.mark.parametrize("speed", [0.0, -1.0, math.nan])
def test_a_steady_motion_has_a_speed(units, speed):
    with pytest.raises(DescriptionError, match="above zero"):
        torque_at_load(units["boom"], 1e5, speed=speed)
