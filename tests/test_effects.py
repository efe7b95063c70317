"""What a real machine adds: each option as it is described, how far it moves the boom, and that the sensor has it."""

import math
import re
import tomllib
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import quad

from evaluation.judged_errors import judge
from ramsight import machine
from ramsight.calibration.tuned import _left as efficiency_left
from ramsight.duty import DriveReport, Duty, Magnets, Profile, lift_lower, report, simulate
from ramsight.duty.linked_duty import LinkedDuty, simulate_linked
from ramsight.duty.oil_warming import warmed
from ramsight.duty.profile import constant
from ramsight.duty.work_day import work_day
from ramsight.errors import DescriptionError
from ramsight.plant.as_built import AsBuilt
from ramsight.plant.balance import balance, without_friction
from ramsight.plant.build import build
from ramsight.plant.heat import HeatStores
from ramsight.plant.limits import limits_of
from ramsight.plant.linked import build_linked
from ramsight.plant.machine_tables import cautions
from ramsight.plant.steady import derive
from ramsight.sensor.balance import balance as balance_sensor
from ramsight.sensor.circuit.leakage import unfilled_std
from ramsight.sensor.kalman import kalman
from ramsight.sensor.status import Status

from .plant_bench import UNITS
from .sensor_bench import WARM, Stepped, quiet

ROOT = Path(__file__).parents[1]
BOOM = UNITS["mining-loader boom"]
LOADER = machine.load_machine("mining-loader").unit("boom")
HIGH = 441e3
HOUR = 3600.0
CLOSES = 1e-5  # what the energy and volume audit may leave


def described(changes):
    """The boom with values of its description changed."""
    return build(LOADER.replace(changes), "boom")


def resting(unit, duration, *, load=HIGH, temperature=None, position=0.4, period=1.0):
    """A run with the motor at rest."""
    duty = Duty(Profile([0.0, duration], [0.0, 0.0]), constant(load), temperature or constant(WARM), position)
    return simulate(unit, duty, sample_period=period)


def lifted_to_rest(unit, duration, *, temperature=None, load=HIGH):
    """A short lift, so that the load is seen, and a rest under it."""
    speed = Profile([0.0, 0.5, 1.0, 3.0, 3.5, duration], [0.0, 0.0, 60.0, 60.0, 0.0, 0.0])
    duty = Duty(speed, constant(load), temperature or constant(WARM), 0.3)
    return simulate(unit, duty, sample_period=0.1)


def closes(run):
    """Whether the audit of a run closes: what is missing, of all that was turned over, also where no shaft turned."""
    shaft = max(run.attrs["energy.shaft_given"] + run.attrs["energy.shaft_taken"], 1e-9)
    turned_over = sum(abs(value) for key, value in run.attrs.items() if key.startswith("energy."))
    energy = abs(run.attrs["energy_residual"]) * shaft / turned_over
    return energy < CLOSES and abs(run.attrs["volume_residual"]) < CLOSES


@lru_cache
def stepped(unit):
    """The balance of a unit's description."""
    return Stepped(balance_sensor(unit))


def told(unit, run):
    """What it says of a run, given the position at its beginning."""
    sensor = stepped(unit)
    sensor.start(float(run["position"][0]))
    return sensor.track(report(run, quiet(unit)))


def followed(unit, run):
    """Errors of that [m]."""
    return told(unit, run)["position"] - run["position"].values


# Closed valves that leak -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("leakage", "least", "most"), [("0.3 ml/min", 0.4e-3, 0.9e-3), ("10 ml/min", 15e-3, 30e-3)])
def test_a_load_on_a_valve_that_leaks_sinks_by_millimetres_in_an_hour(leakage, least, most):
    unit = described({"safety_valve.closed_leakage": leakage})
    run = resting(unit, HOUR, period=10.0)
    sunk = float(run["position"][0] - run["position"][-1])
    still = resting(BOOM, HOUR, period=10.0)
    assert abs(float(still["position"][0] - still["position"][-1])) < 0.2e-3
    assert least < sunk < most
    assert closes(run)


@pytest.mark.parametrize(
    ("changes", "duration", "temperature", "missed"),
    [
        ({"safety_valve.closed_leakage": "200 ml/min"}, 60.0, None, 5e-3),
        ({"oil.thermal_expansion": "7e-4 1/K"}, 300.0, (10.0, 120.0), 2e-3),
    ],
    ids=["a valve that leaks", "oil that cools"],
)
def test_the_sensor_sinks_with_a_load(changes, duration, temperature, missed):
    unit = described(changes)
    run = lifted_to_rest(unit, duration, temperature=temperature and cooling(*temperature))
    assert np.abs(followed(unit, run)).max() < 0.5e-3
    assert np.abs(followed(BOOM, run)).max() > missed, "nobody would miss it"


# Oil that is shut in and changes its temperature ---------------------------------------------------------------------


def cooling(celsius, per_hour=10.0, first=40.0):
    """An oil temperature that falls by so much, so fast [degC]."""
    return Profile([0.0, 5.0, 5.0 + HOUR * celsius / per_hour], [first + 273.15] * 2 + [first + 273.15 - celsius])


@pytest.mark.parametrize(("position", "least", "most"), [(0.3, 2.5e-3, 3.2e-3), (0.65, 4.8e-3, 5.6e-3)])
def test_a_load_on_oil_that_cools_sinks_by_millimetres_per_ten_kelvin(position, least, most):
    unit = described({"oil.thermal_expansion": "7e-4 1/K"})
    run = resting(unit, HOUR + 5.0, temperature=cooling(10.0), position=position, period=10.0)
    assert least < run["position"][0] - run["position"][-1] < most
    assert closes(run)
    assert run.attrs["energy.expansion"] > 0.0, "the load presses on oil that gives way"
    back = Profile([0.0, 600.0], [303.15, 313.15])
    assert least < np.ptp(resting(unit, 600.0, temperature=back, position=position)["position"].values) < most


def test_oil_that_cannot_give_way_gains_seven_bar_per_kelvin():
    unit = described({"oil.thermal_expansion": "7e-4 1/K"})
    run = resting(unit, 600.0, temperature=Profile([0.0, 600.0], [313.15, 323.15]), position=unit.cylinder.stroke)
    assert np.ptp(run["position"].values) < 0.2e-3, "it stands on its stop"
    assert 5.5e5 < (run["pressure_a"][-1] - run["pressure_a"][0]) / 10.0 < 8e5


# Relief valves -----------------------------------------------------------------------------------------------------


@lru_cache
def lifting(unit, load):
    """A cycle of lifting and lowering."""
    return simulate(unit, lift_lower(unit, load, WARM), sample_period=0.04)


def apart(run, other):
    """How far two runs are apart at most [m]."""
    return float(np.abs(run["position"].values - other["position"].values).max())


def test_a_relief_valve_that_is_set_low_lets_a_heavy_load_stand():
    plain = lifting(BOOM, 500e3)
    low = lifting(AsBuilt(relief=0.93).apply(BOOM), 500e3)
    assert 0.09 < apart(plain, low) < 0.15
    assert closes(low)
    assert apart(lifting(BOOM, HIGH), lifting(AsBuilt(relief=0.93).apply(BOOM), HIGH)) == 0.0


def test_a_pilot_that_leaks_costs_travel_near_the_setting_and_is_in_the_sensor():
    unit = described({"relief_valve.pilot_leakage": "1 l/min"})
    run = lifting(unit, 490e3)
    assert 3e-3 < apart(run, lifting(BOOM, 490e3)) < 6e-3
    assert apart(lifting(unit, 400e3), lifting(BOOM, 400e3)) < 1e-8
    assert closes(run)
    assert np.abs(followed(unit, run)).max() < 0.5e-3
    assert np.abs(followed(BOOM, run)).max() > 3e-3


def overloaded(unit):
    """A lift in which the load is too heavy for a while, and then as heavy as the valve still carries."""
    speed = Profile([0.0, 0.5, 1.0, 5.0, 5.5, 6.0], [0.0, 0.0, 100.0, 100.0, 0.0, 0.0])
    load = Profile([0.0, 2.0, 2.2, 2.5, 2.7, 6.0], [490e3, 490e3, 545e3, 545e3, 490e3, 490e3])
    return simulate(unit, Duty(speed, load, constant(WARM), 0.2), sample_period=0.02)


def test_a_relief_valve_with_hysteresis_stays_open_until_the_pressure_has_fallen():
    unit = described({"relief_valve.reseats": "90 %"})
    plain, run = overloaded(BOOM), overloaded(unit)
    after, before = (int(np.searchsorted(run["time"], t)) for t in (4.0, 1.9))
    assert plain["relief_a_flow"][after] == 0.0
    assert run["relief_a_flow"][before] == 0.0
    assert run["relief_a_flow"][after] > 1e-4
    assert apart(plain, run) > 20e-3
    assert closes(run)
    assert apart(lifting(unit, HIGH), lifting(BOOM, HIGH)) < 1e-6
    said = told(unit, run)
    open_valve = run["relief_a_flow"].values > 1e-5
    assert (said["status"][open_valve] != Status.OK).mean() > 0.99, "what passes it, nobody can say"


# End cushions ------------------------------------------------------------------------------------------------------

CUSHIONS = {
    "cylinder.cushion_length_a": "25 mm", "cylinder.cushion_length_b": "25 mm",
    "cylinder.cushion_plunger_a": "60 mm", "cylinder.cushion_plunger_b": "95 mm",
    "cylinder.cushion_flow": "3 l/min",
}  # fmt: skip


def to_the_end(unit, way, *, load=258e3, speed=157.0):
    """From 70 mm before the end of lifting (1) or lowering (-1) into its stop."""
    held = 0.1 / (speed * unit.travel_per_radian)
    profile = Profile(np.cumsum([0.0, 0.5, 0.3, held, 0.3, 0.9]), way * speed * np.array([0, 0, 1, 1, 0, 0]))
    start = unit.cylinder.stroke - 0.07 if way > 0 else 0.07
    return simulate(unit, Duty(profile, constant(load), constant(WARM), start), sample_period=0.02)


@pytest.mark.parametrize(("way", "least", "most"), [(1.0, 3e-3, 7e-3), (-1.0, 5e-3, 11e-3)])
def test_a_cushion_makes_a_piston_come_late_to_its_stop_and_is_in_the_sensor(way, least, most):
    unit = described(CUSHIONS)
    run, plain = to_the_end(unit, way), to_the_end(BOOM, way)
    assert least < apart(run, plain) < most
    assert abs(float(run["position"][-1] - plain["position"][-1])) < 0.1e-3, "it comes to the same end"
    assert closes(run)
    assert run.attrs["energy.cylinder.cushion"] > 0.0
    before = np.abs(run["position"].values - (unit.cylinder.stroke if way > 0 else 0.0)) > 1e-3
    before &= np.arange(before.size) < np.argmin(before)
    open_valve = run["relief_a_flow"].values > 1e-5
    before &= ~np.logical_or.accumulate(open_valve)
    assert np.abs(followed(unit, run)[before]).max() < 0.5e-3
    inside = before & (np.abs(run["position"].values - 0.5 * unit.cylinder.stroke) > 0.5 * unit.cylinder.stroke - 0.015)
    assert inside.sum() > 10, "well into the cushion"


def test_what_a_cushion_carries_is_load_that_the_oil_carries():
    unit = described(CUSHIONS)
    found, load = balance(without_friction(unit)), 258e3
    p, z = found.parameters_at(list(found.values), WARM), found.at_rest(0.01, load)
    for _ in range(60):
        z[0] = 0.01
        z = np.array(ca.DM(found.step(z, -157.0, -157.0, 0.0, load, p, 0.02, iterations=4).z))[:, 0]
    carried = unit.cylinder.area_a * (z[found.states.index("pressure_chamber_a")] - 4e5)
    assert carried < 0.8 * load, "the cushion has its share"
    assert float(found.force(z)) == pytest.approx(load, rel=2e-3)


def test_a_cushion_only_slows_down():
    cylinder = described(CUSHIONS).cylinder
    ends = {-1.0: (0.0, 0.01, 0.024), 1.0: (cylinder.stroke, cylinder.stroke - 0.01)}
    for way, places in ends.items():
        for place in places:
            assert way * float(cylinder.cushion(place, way * 0.05)) < 0.0
            assert float(cylinder.cushion(place, -way * 0.05)) == 0.0
    assert float(cylinder.cushion(0.3, 0.1)) == float(cylinder.cushion(0.026, -0.1)) == 0.0
    # A needle valve passes its rated flow at 100 bar: two cylinders, the piston around the plunger.
    speed = 2.0 * 3e-3 / 60.0 / float(cylinder.cushion_area_a)
    assert float(cylinder.cushion(0.0, -speed)) == pytest.approx(100e5 * float(cylinder.cushion_area_a), rel=1e-9)


# Oil that the pumps compress, and air that they draw ---------------------------------------------------------------

IN_IT, BESIDE = ({f"pump_{side}.compression": f"{how} efficiency" for side in "ab"} for how in ("in", "beside"))
AIR = {"oil.free_air": "1 %"}


@pytest.mark.parametrize(
    ("changes", "least", "most"),
    [(IN_IT, 2e-3, 3.5e-3), (BESIDE, -3e-3, -1.5e-3), (BESIDE | AIR, -3.5e-3, -2.3e-3)],
    ids=["compression in the efficiency", "compression beside it", "air"],
)
def test_what_pumps_do_to_their_oil_moves_a_lift_and_is_in_the_sensor(changes, least, most):
    unit = described(changes)
    run, plain = lifting(unit, HIGH), lifting(BOOM, HIGH)
    top = int(np.argmax(plain["position"].values))
    assert least < float((run["position"] - plain["position"])[top]) < most
    assert closes(run)
    assert np.abs(followed(unit, run)).max() < 0.5e-3
    assert np.abs(followed(BOOM, run)).max() > 1.5e-3, "nobody would miss it"


@pytest.mark.parametrize("air", [None, 0.01])
@pytest.mark.parametrize("speed", [-120.0, 150.0])
@pytest.mark.parametrize(("inlet", "outlet"), [(4e5, 200e5), (250e5, 4e5), (2e5, 2e5)])
def test_a_pump_gives_the_mass_that_it_takes_and_loses_no_power_from_nowhere(speed, inlet, outlet, air):
    oil = replace(BOOM.oil, air=air, polytropic=1.4 if air else None)
    pump = replace(BOOM.a.pump, compressed=0.02)
    volumes = float(oil.specific_volume(inlet)), float(oil.specific_volume(outlet))
    leak = float(pump.leakage(speed, outlet - inlet, 32e-6, 872.0))
    drawn, delivered = (float(flow) for flow in pump.flows(speed, leak, volumes))
    assert drawn / volumes[0] == pytest.approx(delivered / volumes[1], rel=1e-12)
    assert abs(delivered - drawn) > 0.0 or inlet == outlet
    # The shaft gives no less than the enthalpy that the oil gains, the integral of its volume over the pressure.
    enthalpy, _ = quad(lambda p: float(oil.specific_volume(p)), inlet, outlet)
    moved = pump.displacement * speed / (volumes[0] if speed > 0 else volumes[1])
    assert pump.displacement * speed * (outlet - inlet) >= moved * enthalpy - 1e-9


def test_a_pump_has_the_efficiency_of_its_data_sheet_whichever_way_it_was_measured():
    oil, spec = LOADER.oil, LOADER.pump_a
    for changes, at_outlet in ((IN_IT, 1.0), (BESIDE, math.exp(-spec.nominal_pressure / oil.bulk_modulus))):
        pump, unit = described(changes).a.pump, described(changes)
        volumes = tuple(unit.oil.specific_volume(p) for p in (0.0, spec.nominal_pressure))
        leak = pump.leakage(spec.nominal_speed, spec.nominal_pressure, spec.nominal_viscosity, spec.nominal_density)
        _, delivered = pump.flows(spec.nominal_speed, leak, volumes)
        ideal = pump.displacement * spec.nominal_speed
        expected = spec.volumetric_efficiency - (1.0 - at_outlet)
        assert float(delivered) / ideal == pytest.approx(expected, rel=1e-9)


def test_a_table_measured_at_the_outlet_has_the_compression_in_it():
    rows = "\n".join(f"{p}, {w}, 46, {0.99 - p / 5000}, 0.9" for p in (50, 250) for w in (500, 3000))
    header = "pressure_bar, speed_rpm, viscosity_mm2s, volumetric_efficiency, hydromechanical_efficiency\n"
    table = {"pump_a.losses": "table", "pump_a.efficiency_table": header + rows}
    with_it, without = (described(table | changes).a.pump for changes in (IN_IT, BESIDE))
    less = float(without.leakage(100.0, 250e5, 46e-6, 872.0) - with_it.leakage(100.0, 250e5, 46e-6, 872.0))
    share = 1.0 - math.exp(-250e5 / BOOM.oil.bulk_modulus)
    assert less == pytest.approx(share * with_it.displacement * 100.0, rel=1e-9)


@pytest.mark.parametrize("changes", [IN_IT, BESIDE, {}], ids=["in it", "beside", "none"])
def test_leakage_that_was_identified_is_written_as_the_efficiency_that_has_it(changes):
    unit, stiffness, lost = LOADER.replace(changes), 0.8, 1.2
    moduli = unit.oil.bulk_modulus, stiffness * unit.oil.bulk_modulus
    pump = unit.pump_a
    left = efficiency_left(pump, pump.volumetric_efficiency, pump.nominal_pressure, lost, moduli)
    new = {"pump_a.volumetric_efficiency": left, "oil.bulk_modulus": moduli[1], "hose.effective_bulk_modulus": 0.5e9}
    pumps = (build(which, "boom").a.pump for which in (unit, unit.replace(new)))
    before, after = (pump.leak_coefficient(32e-6, 872.0) for pump in pumps)
    assert after == pytest.approx(lost * before, rel=1e-9, abs=0.0)


def test_an_efficiency_that_leaves_no_room_for_the_compression_is_refused():
    with pytest.raises(DescriptionError, match=r"pump_a.compression = .*more than a volumetric efficiency of 0.99"):
        described(IN_IT | {"pump_a.volumetric_efficiency": 0.99})


# Torque losses and belts -------------------------------------------------------------------------------------------


def of_both_pumps(**values):
    """Values of both pumps' descriptions."""
    return {f"pump_{side}.{key}": value for side in "ab" for key, value in values.items()}


@pytest.mark.parametrize("celsius", [0.0, 40.0])
def test_drag_is_torque_and_no_travel_and_is_in_the_sensor(celsius):
    # Wilson's law with C_v = 1.5e5: C_v D nu rho for a block of two chambers.
    drag = 1.5e5 * LOADER.pump_a.displacement_per_rad / 2.0 * 46e-6 * 872.0
    unit = described(of_both_pumps(viscous_drag=drag, hydrodynamic_drag=2e-5))
    duty = lift_lower(unit, 258e3, 273.15 + celsius)
    run, plain = (simulate(which, duty, sample_period=0.04) for which in (unit, BOOM))
    assert apart(run, plain) < 1e-6
    assert closes(run)
    lifting_now = int(np.searchsorted(run["time"], 4.0))
    more = float((run["motor_torque"] - plain["motor_torque"])[lifting_now])
    speed = float(run["motor_speed"][lifting_now])
    thickness = float(unit.oil.viscosity(273.15 + celsius)) / 46e-6
    expected = sum(
        p.belt * (p.blocks * (drag * p.belt * speed * thickness + 2e-5 * (p.belt * speed) ** 2))
        for p in (LOADER.pump_a, LOADER.pump_b)
    )
    assert more == pytest.approx(expected, rel=1e-4)
    said, without = told(unit, run), told(BOOM, run)
    assert said["load"][lifting_now] == pytest.approx(258e3, rel=0.01)
    assert without["load"][lifting_now] > (360e3 if celsius == 0.0 else 270e3), "friction read as a load"
    assert np.abs(said["position"] - run["position"].values).max() < 0.5e-3


def test_a_belt_that_creeps_costs_travel_and_one_that_loses_costs_torque():
    creeps, loses = (
        described(of_both_pumps(**change)) for change in ({"belt_creep": 0.01}, {"belt_efficiency": 0.975})
    )
    plain, crept, lost = (lifting(which, 258e3) for which in (BOOM, creeps, loses))
    assert -2e-3 < float((crept["position"] - plain["position"])[-1]) < -0.8e-3
    assert apart(lost, plain) < 1e-6
    up, down = (int(np.searchsorted(plain["time"], t)) for t in (4.0, 13.0))
    ratio = (lost["motor_torque"] / plain["motor_torque"]).values
    assert ratio[up] == pytest.approx(1.025, abs=2e-3)
    assert ratio[down] == pytest.approx(0.975, abs=6e-3), "of a load that drives, less comes to the motor"
    for unit, run in ((creeps, crept), (loses, lost)):
        assert closes(run)
        assert np.abs(followed(unit, run)).max() < 0.5e-3
    assert np.abs(followed(BOOM, crept)).max() > 1e-3


# Pumps that starve -------------------------------------------------------------------------------------------------

STARVING = {"tank.pressure": "0.45 bar", **of_both_pumps(min_inlet_pressure="2 bar")}


def hurried(unit):
    """A lift at 3000 rpm of the motor."""
    return simulate(unit, lift_lower(unit, 300e3, WARM, motor_speed=314.0), sample_period=0.02)


def test_a_pump_that_starves_moves_less_than_it_displaces_and_is_in_the_sensor():
    unit = described(STARVING)
    run, plain = hurried(unit), hurried(described({"tank.pressure": "0.45 bar"}))
    up = int(np.searchsorted(run["time"], 4.0))
    pump = unit.a.pump
    speed = pump.belt * float(run["motor_speed"][up])
    # Data sheet: full at the highest speed from 2 bar on; the way in is an orifice.
    fills = LOADER.pump_a.max_speed * math.sqrt(0.45 / 2.0)
    assert float(run["pump_a_filled"][up]) == pytest.approx(fills / speed, rel=2e-3)
    leak = float(pump.leakage(speed, float(run["pressure_manifold_a"][up]) - 0.45e5, unit.oil.viscosity(WARM), 872.0))
    assert float(run["pump_a_flow"][up]) == pytest.approx(pump.displacement * fills - leak, rel=2e-3)
    assert apart(run, plain) > 10e-3
    assert closes(run)
    assert np.abs(followed(unit, run)).max() < 0.5e-3
    assert np.abs(followed(BOOM, run)).max() > 10e-3, "nobody would miss it"


def test_a_pump_with_enough_pressure_at_its_inlet_is_the_plain_pump():
    unit = described(of_both_pumps(min_inlet_pressure="0.8 bar"))
    assert unit.a.pump.filling is not None
    assert apart(hurried(unit), hurried(BOOM)) < 1e-6


def test_a_pump_that_starves_takes_torque_by_what_it_moves():
    pump = described(STARVING).a.pump
    for inlet, share in ((2e5, 1.0), (0.5e5, 0.5), (0.0, pump.threshold_speed / LOADER.pump_a.max_speed)):
        assert float(pump.filled(LOADER.pump_a.max_speed, inlet, 100e5)) == pytest.approx(share, rel=2e-3)
    assert float(pump.filled(-400.0, 0.0, 100e5)) == 1.0, "turned by its load it draws from the other side"
    assert float(pump.filled(0.0, 0.0, 0.0)) == 1.0


@pytest.mark.parametrize(
    ("inlet", "share", "uncertain"),
    [(0.3e5, 0.387, 0.0387), (1.7e5, 0.922, 0.5 * (1.0 - 0.9 * 0.922)), (4e5, 1.0, 0.0)],
    ids=["starves", "hardly", "fills"],
)
def test_what_a_starving_pump_draws_is_as_uncertain_as_its_way_in(inlet, share, uncertain):
    """A tenth more or less passes where the way in limits, and nothing more than full where it does not."""
    unit = described({"tank.pressure": "0.45 bar", "pump_a.min_inlet_pressure": "2 bar"})
    circuit = balance(unit)
    values = dict(zip(circuit.parameters, circuit.values, strict=True)) | {"tank.pressure": inlet}
    fast = LOADER.pump_a.max_speed / unit.a.pump.belt
    z = circuit.at_rest(0.3, 300e3)
    assert float(unit.a.pump.filled(LOADER.pump_a.max_speed, inlet, 100e5)) == pytest.approx(share, rel=5e-3)
    assumed = unit.assumptions.replace({"machine.filling": 0.1})
    model = SimpleNamespace(balance=circuit, of_circuit=values.__getitem__, assumed=assumed)
    assert float(unfilled_std(z, fast, model)) == pytest.approx(uncertain, abs=2e-3)
    model.balance = balance(BOOM)
    assert float(unfilled_std(z, fast, model)) == 0.0, "always fills, by its description"


@pytest.mark.parametrize("wants", ["1.7 bar", "2.4 bar"])
def test_a_pump_that_starves_by_more_than_its_description_says_is_in_the_band(wants):
    unit = described(STARVING)
    run = hurried(described(STARVING | of_both_pumps(min_inlet_pressure=wants)))
    for known, holds in ((unit.assumptions, True), (unit.assumptions.replace({"machine.filling": 0.0}), False)):
        sensor = kalman(unit, known.replace({"machine.leaks_otherwise": 1e-6}))
        sensor.start(float(run["position"][0]))
        track = sensor.track(report(run))
        error = np.abs(track["position"].values - run["position"].values)
        assert error.max() > 5e-3
        assert bool(np.mean(error < 1.96 * track["position_std"].values) > 0.93) == holds


def test_a_check_says_where_a_pump_would_starve():
    low = LOADER.replace(STARVING)
    said = cautions(low, build(low, "boom"))
    assert any("from the tank's 0.45 bar it fills up to 1897 rpm" in text for text in said), said
    enough = LOADER.replace(of_both_pumps(min_inlet_pressure="0.8 bar"))
    assert not any("fills up" in text for text in cautions(enough, build(enough, "boom")))


# Relief valves of the cylinder's ports -----------------------------------------------------------------------------

PORTS = {"port_relief_valve": {"setting": "230 bar", "rated_flow": "100 l/min", "override_pressure": "5 bar"}}


def shocked(unit, peak=700e3):
    """A load at rest that a shock makes heavier for a third of a second."""
    load = Profile([0.0, 1.0, 1.1, 1.3, 1.4, 4.0], [HIGH, HIGH, peak, peak, HIGH, HIGH])
    return simulate(unit, Duty(Profile([0.0, 4.0], [0.0, 0.0]), load, constant(WARM), 0.4), sample_period=0.01)


def test_a_shock_at_rest_leaves_a_mark_where_a_port_has_a_relief_valve():
    unit = described(PORTS)
    run, plain = shocked(unit), shocked(BOOM)
    assert run["position"][-1] < plain["position"][-1] - 10e-3
    assert plain["position"][-1] > 0.4 - 2e-3, "a locked cylinder comes back, but for friction"
    assert run["pressure_a"].max() < plain["pressure_a"].max() - 10e5
    assert closes(run)
    assert apart(lifting(unit, HIGH), lifting(BOOM, HIGH)) < 1e-8


def test_port_relief_valves_change_nothing_of_what_the_pumps_can_do():
    assert limits_of(described(PORTS)) == limits_of(BOOM)
    assert derive(described(PORTS)) == derive(BOOM)
    low = LOADER.replace(PORTS | {"port_relief_valve.setting": "200 bar"})
    assert any("port_relief_a of the cylinder opens at 200 bar" in text for text in cautions(low, build(low, "boom")))


def test_an_optional_part_may_name_a_model_and_is_checked_like_every_part():
    there = '[units.boom.port_relief_valve]\nmodel = "DB10P-01"\nsetting = "240 bar"\n\n[units.boom.load]'
    text = machine.template().replace("[units.boom.load]", there)
    valve = machine.loads(text).unit("boom").port_relief_valve
    assert (valve.setting, valve.override_pressure) == (240e5, 5e5)
    assert machine.loads(machine.template(machine.loads(text))).unit("boom").port_relief_valve == valve
    with pytest.raises(
        DescriptionError, match=r"units.boom.port_relief_valve.seting: unknown key; did you mean 'setting'"
    ):
        machine.loads(text.replace('model = "DB10P-01"\nsetting', 'model = "DB10P-01"\nseting'))


# Magnets, and oil that warms up by its losses ----------------------------------------------------------------------


def test_warm_magnets_make_a_drive_report_too_much_torque():
    run, quiet_report = lifting(BOOM, HIGH), DriveReport(torque_noise=0.0, torque_step=0.0)
    cold = report(run, quiet_report)["motor_torque"].values
    np.testing.assert_allclose(cold, run["motor_torque"].values)
    magnets = Magnets(torque=60.0, first=60.0)
    warm = report(run, replace(quiet_report, magnets=magnets))["motor_torque"].values
    turning = np.abs(cold) > 10.0
    np.testing.assert_allclose(warm[turning] / cold[turning], 1.0 / (1.0 - 1.1e-3 * 60.0), rtol=2e-3)
    load = followed_load(run, magnets)
    assert load > 1.05 * HIGH, "the torque's gain is read as a load"


def followed_load(run, magnets):
    """The load that the sensor reads of a lift with such magnets [N]."""
    sensor = stepped(BOOM)
    sensor.start(float(run["position"][0]))
    said = sensor.track(report(run, replace(quiet(BOOM), magnets=magnets)))
    return said["load"][int(np.searchsorted(run["time"], 4.0))]


def test_magnets_come_to_their_rise_under_their_torque_and_cool_without():
    time = np.linspace(0.0, 36000.0, 3601)
    magnets = Magnets(torque=40.0, rise=70.0, time_constant=1800.0)
    assert magnets.warmth(time, np.full(time.size, -40.0))[-1] == pytest.approx(70.0, rel=1e-6)
    assert magnets.warmth(time, np.full(time.size, 20.0))[-1] == pytest.approx(17.5, rel=1e-6)
    cools = replace(magnets, first=50.0).warmth(time, np.zeros(time.size))
    np.testing.assert_allclose(cools, 50.0 * np.exp(-time / 1800.0), rtol=1e-9)


SMALL = HeatStores(case=500.0, tank=2000.0, case_to_tank=100.0)
LIFT = Duty(Profile([0.0, 0.2, 0.4, 4.0], [0.0, 0.0, 157.0, 157.0]), constant(HIGH), constant(293.15), 0.2)


def test_losses_warm_up_the_case_first_and_then_the_tank():
    run = warmed(BOOM, LIFT, SMALL, sample_period=0.1)
    case, tank = run["pump_temperature"].values, run["oil_temperature"].values
    assert case[0] == tank[0] == 293.15
    assert case[-1] > tank[-1] + 3.0 > 293.15 + 3.0
    assert np.all(np.diff(case) > -1e-9)
    assert apart(run, simulate(BOOM, LIFT, sample_period=0.1)) > 0.1e-3, "thin oil leaks more"
    assert closes(run)
    log = report(run, replace(quiet(BOOM), temperature_noise=0.0))
    assert np.abs(log["oil_temperature"].values - tank).max() < 0.06, "a thermometer sees the tank"


def test_heat_goes_into_case_tank_and_air_and_nowhere_else():
    time = np.linspace(0.0, 4000.0, 4001)
    how = HeatStores()
    into_case, into_tank = 900.0 * time, 100.0 * time
    found = how.temperatures(time, into_case, into_tank, 293.15, 283.15)
    stored = how.case * (found[:, 0] - 293.15) + how.tank * (found[:, 1] - 293.15)
    air = how.case_to_air * (found[:, 0] - 283.15) + how.tank_to_air * (found[:, 1] - 283.15)
    lost = np.concatenate([[0.0], np.cumsum(0.5 * (air[1:] + air[:-1]))])
    np.testing.assert_allclose(stored + lost, into_case + into_tank, rtol=1e-9, atol=1e-6)
    late = np.linspace(0.0, 4e4, 4001)
    settled = how.temperatures(late, 900.0 * late, 100.0 * late, 293.15, 283.15)
    case, tank = settled[-1]
    assert how.case_to_tank * (case - tank) + how.case_to_air * (case - 283.15) == pytest.approx(900.0, rel=1e-6)


def test_a_unit_that_would_burn_its_oil_is_refused(monkeypatch):
    monkeypatch.setattr("ramsight.duty.oil_warming._ROUNDS", 1)
    with pytest.raises(DescriptionError, match="the data of the oil tellus-t-32 do not reach so far"):
        warmed(BOOM, LIFT, HeatStores(case=2.0, tank=20.0), sample_period=0.1)


# All of it together ------------------------------------------------------------------------------------------------


def given_by_the_page():
    """Everything that docs/reference/real-machines.md gives an example of, by its path in the unit."""
    page = (ROOT / "docs" / "reference" / "real-machines.md").read_text()
    (block,) = re.findall(r"<!-- a real boom -->\n```toml\n(.*?)```", page, flags=re.DOTALL)
    changes = {}
    for part, values in tomllib.loads(block)["units"]["boom"].items():
        given = {key: value["value"] for key, value in values.items()}
        optional = getattr(LOADER, part) is None
        changes |= {part: given} if optional else {f"{part}.{key}": value for key, value in given.items()}
        assert all(value["source"] for value in values.values())
    return changes


@pytest.fixture(scope="module")
def real():
    """The boom with all of it."""
    return described(given_by_the_page())


def test_all_effects_together_close_their_balances_and_the_sensors_follow(real):
    run = simulate(real, lift_lower(real, HIGH, WARM), sample_period=0.02)
    assert closes(run)
    assert abs(float(run["position"][-1] - lifting(BOOM, HIGH)["position"][-1])) > 3e-3
    assert np.abs(followed(real, run)).max() < 0.5e-3
    sensor = Stepped(kalman(real))
    sensor.start(float(run["position"][0]))
    said = sensor.track(report(run, quiet(real)))
    error = said["position"] - run["position"].values
    assert np.abs(error).max() < 0.5e-3
    assert (np.abs(error) <= 1.96 * said["position_std"]).mean() >= 0.95
    assert np.isin(said["status"], [Status.OK, Status.REFERENCE_DUE]).all()


def test_options_that_are_there_with_nothing_in_them_are_the_plain_plant():
    nothing = {"compressed": None, "drag": 0.0, "hydrodynamic_drag": 0.0, "belt_loss": 0.0, "belt_creep": 0.0}
    others = {"closed_leak": 0.0, "pilot_flow": 0.0}

    def empty(part):
        values = {key: value for key, value in (nothing | others).items() if hasattr(part, key)}
        if "pilot_flow" in values:
            values["pilot_opens"] = 0.85
        return replace(part, **values)

    unit = BOOM.mapped(empty)
    assert apart(lifting(unit, HIGH), lifting(BOOM, HIGH)) < 1e-9


def test_all_effects_are_in_a_machine_with_a_mechanism_too():
    loader = machine.load_machine("mining-loader")
    changed = loader.replace({f"units.boom.{key}": value for key, value in given_by_the_page().items()})
    speeds = {
        "boom": Profile([0.0, 0.2, 0.5, 1.5, 1.8, 3.0], [0.0, 0.0, 100.0, 100.0, 0.0, 0.0]),
        "bucket": constant(0.0),
    }
    temperatures = {"boom": Profile([0.0, 3.0], [313.15, 314.15]), "bucket": constant(WARM)}
    duty = LinkedDuty(speeds, temperatures, {"boom": 0.3, "bucket": 0.3}, payload=constant(5000.0))
    run, plain = (simulate_linked(build_linked(which), duty, sample_period=0.1) for which in (changed, loader))
    assert abs(run.attrs["energy_residual"]) < CLOSES
    assert abs(run.attrs["volume_residual"]) < CLOSES
    assert run.attrs["boom.energy.expansion"] != 0.0
    assert "boom.energy.expansion" not in plain.attrs
    assert abs(float(run["boom_position"][-1] - plain["boom_position"][-1])) > 0.1e-3


@pytest.mark.slow
@pytest.mark.parametrize("colder", [5.0, -5.0])
def test_a_sensor_learns_how_much_warmer_the_oil_in_the_pumps_is_while_it_warms_up(colder):
    """By the reported temperature the same leakage is one factor in cold oil and another in warm oil."""
    duty = work_day(BOOM, (100e3, 370e3), WARM, duration=2400.0, visit_every=120.0, seed=1)
    after = np.linspace(0.0, duty.duration, 60)
    duty = replace(duty, oil_temperature=Profile(after, 323.15 - 35.0 * np.exp(-after / 900.0)))
    run = simulate(BOOM, duty)
    log = report(run, DriveReport(seed=0))
    log["oil_temperature"].values[:] -= colder
    sensor = kalman(BOOM, BOOM.assumptions.replace({"thermometer.offset": 5.0}))
    sensor.start(duty.start_position)
    track = sensor.track(log)
    warmer = np.sign(colder) * sensor.state["hypotheses[0].warmer"]
    assert 0.15 * abs(colder) < warmer < 1.2 * abs(colder)
    judged = judge(track, log["motor_speed"].values, run["position"].values, BOOM.cylinder.stroke, after=3)
    assert judged.p95 < 8e-3
    assert judged.coverage > 0.95
    # What leaks is said by the reported temperature, its share that is the oil's own among it.
    oil = float(run["oil_temperature"][-1])
    there = float(BOOM.oil.viscosity(oil - colder) / BOOM.oil.viscosity(oil))
    found, std = float(track["leak_factor"][-1]), float(track["leak_factor_std"][-1])
    assert abs(found - there) < max(3.0 * std, 0.05)
