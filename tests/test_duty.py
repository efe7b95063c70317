"""What a unit is asked to do, and options of what it is: temperatures out of range, servo, battery, oil, hose, wear."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import ramsight
from ramsight import casadi_model, machine
from ramsight.duty import Duty, Profile, lift_lower, simulate
from ramsight.duty.lagging import lagging
from ramsight.duty.profile import constant
from ramsight.errors import DescriptionError
from ramsight.plant.build import build

BOOM = machine.load_machine("mining-loader").unit("boom")
UNIT = build(BOOM, "boom")
LOAD = 300e3


def boom(changes):
    return build(BOOM.replace(changes), "boom")


def run_of(changes, load=LOAD, kelvin=313.15, **options):
    unit = boom(changes)
    run = simulate(unit, lift_lower(unit, load, kelvin, hold=2.0, **options))
    assert abs(run.attrs["energy_residual"]) < 1e-3
    assert abs(run.attrs["volume_residual"]) < 1e-3
    return run


PLAIN = run_of({})


@pytest.mark.parametrize("celsius", [-20.0, 100.0])
def test_the_oils_range_may_be_used_to_its_ends(celsius):
    assert simulate(UNIT, Duty(constant(0.0), constant(1e5), constant(celsius + 273.15), 0.3, end=0.1)).sizes["time"]


@pytest.mark.parametrize(("celsius", "value"), [(-20.1, "-20.1 degC"), (100.1, "100.1 degC"), (-273.15, "-273.15")])
def test_an_oil_temperature_outside_the_range_names_oil_value_and_range(celsius, value):
    profile = Profile([0.0, 1.0], [313.15, celsius + 273.15])
    with pytest.raises(DescriptionError, match=rf"'{value}.*oil tellus-t-32.*allowed: -20 to 100 degC"):
        simulate(UNIT, Duty(constant(0.0), constant(1e5), profile, 0.3, end=1.0))


def test_electrical_energy_follows_from_the_shafts():
    shaft = PLAIN.attrs["energy.shaft_given"], PLAIN.attrs["energy.shaft_taken"]
    assert PLAIN.attrs["electrical_energy_given"] == pytest.approx(shaft[0] / (0.9 * 0.95))
    assert PLAIN.attrs["electrical_energy_recovered"] == pytest.approx(shaft[1] * 0.9 * 0.95)
    better = run_of({"drive.drive_efficiency": 1.0, "drive.battery_efficiency": 1.0})
    assert better.attrs["electrical_energy_given"] == pytest.approx(shaft[0], rel=1e-6)


def test_a_servo_follows_its_reference_and_reports_its_own_speed():
    run = run_of(
        {"drive.control": "servo", "drive.proportional_gain": "4 N m s/rad", "drive.integral_gain": "80 N m/rad"}
    )
    speed, asked = run["motor_speed"].values, run["motor_speed_command"].values
    assert 0.0 < abs(speed - asked).max() < 15.0
    steady = (run["time"].values > 3.0) & (run["time"].values < 3.7)
    np.testing.assert_allclose(speed[steady], asked[steady], atol=0.5)
    assert float(abs(run["position"] - PLAIN["position"]).max()) < 2e-3
    assert abs(run["motor_torque"].values).max() <= 90.0


def test_a_servo_too_weak_for_the_load_gives_its_torque_and_falls_behind():
    run = run_of({"drive.control": "servo", "drive.max_torque": "30 N m"}, load=441e3)
    assert abs(run["motor_torque"].values).max() == pytest.approx(30.0)
    lifting = (run["time"].values > 2.0) & (run["time"].values < 3.7)
    assert run["motor_speed"].values[lifting].max() < 100.0


@pytest.mark.slow
def test_the_options_of_the_oil_change_what_they_should():
    last = float(PLAIN["position"][-1])
    # Warm oil is lighter: the mass in the gaps is less, the volume that leaks at 40 degC is 1.8 % more.
    lighter = run_of({"oil.thermal_expansion": "7e-4 1/K"})
    assert float(lighter["position"][-1]) < last
    # Oil under pressure is thicker and leaks less.
    thicker = run_of({"oil.pressure_viscosity": "1.7e-8 1/Pa"})
    assert float(thicker["position"][-1]) > last
    # Air at the tank's 4 bar makes the empty side soft; the balances close with a modulus that changes a hundredfold.
    airy = run_of({"oil.free_air": "2 %"})
    assert 1e-5 < abs(float(airy["position"][-1]) - last) < 5e-3
    assert max(abs(airy.attrs["energy_residual"]), abs(airy.attrs["volume_residual"])) < 1e-3


def test_oil_under_pressure_leaks_as_at_its_mean_pressure_in_the_pump():
    unit = boom({"oil.pressure_viscosity": "1.7e-8 1/Pa"})
    run = simulate(unit, lift_lower(unit, LOAD, 313.15, hold=2.0)).sel(time=3.0, method="nearest")
    pump, oil = unit.a.pump, unit.oil
    outlet, speed = float(run["pressure_manifold_a"]), pump.belt * float(run["motor_speed"])
    rise = outlet - unit.tank_pressure
    thicker = np.exp(1.7e-8 * (0.5 * (outlet + unit.tank_pressure) - 101325.0))
    leak = pump.leak_coefficient(float(oil.viscosity(313.15)) * thicker, oil.density) * rise
    assert thicker > 1.05
    assert pump.geared_displacement / pump.belt * speed - float(run["pump_a_flow"]) == pytest.approx(
        leak, rel=1e-6, abs=0.0
    )


def test_a_heavier_mass_swings_more_slowly():
    def period(mass):
        unit = boom({"load.mass": f"{mass} kg"})
        load = Profile([0.0, 0.05, 0.051], [LOAD, LOAD, LOAD + 60e3])
        run = simulate(unit, Duty(constant(0.0), load, constant(313.15), 0.3, end=1.0), sample_period=1e-3)
        velocity = run["velocity"].values[100:]
        down = np.flatnonzero((velocity[1:] < 0.0) & (velocity[:-1] >= 0.0))
        return float(np.diff(down).mean())

    assert period(16000.0) / period(4000.0) == pytest.approx(2.0, rel=0.05)


def test_wear_and_seals_lose_travel():
    last = float(PLAIN["position"][-1])
    worn = run_of({"pump_a.orifice_leakage": "0.3 l/min"})
    leaky = run_of({"cylinder.seal_leakage": "0.1 l/min"})
    assert float(worn["position"][-1]) < last - 1e-3
    assert float(leaky["position"][-1]) < last - 1e-3
    assert leaky.attrs["energy.cylinder.seal"] > 0.0


@pytest.mark.slow
def test_a_hose_with_inertia_and_turbulence_moves_the_rod_alike():
    for changes in ({"hose.segments": 2}, {"hose.regime": "turbulent"}):
        run = run_of(changes)
        assert float(abs(run["position"] - PLAIN["position"]).max()) < 0.5e-3


@pytest.mark.slow
def test_a_safety_valve_that_takes_its_time_delays_the_lowering():
    slow = run_of({"safety_valve.opening_time": "200 ms"})
    delay = PLAIN["position"].values - slow["position"].values
    assert 1e-4 < abs(delay).max() < 20e-3
    opening = slow["safety_a_opening"].values
    assert opening.max() == pytest.approx(1.0, abs=1e-3)


def table_text():
    """Efficiencies of one chamber of the boom's pump A as a data sheet would give them, by the analytic law.

    There are two chambers in a block, so that half a block's no-load torque belongs to each.
    """
    rows = ["pressure_bar, speed_rpm, viscosity_mm2s, volumetric_efficiency, hydromechanical_efficiency"]
    per_rad = 7.9e-6 / (2 * np.pi)
    for bar, rpm, viscosity in product((50, 250), (500, 3000), (16, 46, 200)):
        volumetric = 1.0 - 0.1 * (bar / 250) * (1450 / rpm) * (46 / viscosity)
        hydromechanical = 1.0 / (1.0 / 0.9 + 0.25 / (bar * 1e5 * per_rad))
        rows.append(f"{bar}, {rpm}, {viscosity}, {volumetric:.12f}, {hydromechanical:.12f}")
    return "\n".join(rows)


TABLE = table_text()


@pytest.mark.slow
def test_a_described_table_of_the_data_sheet_moves_the_rod_like_the_analytic_law():
    run = run_of({"pump_a.losses": "table", "pump_a.efficiency_table": TABLE})
    assert float(abs(run["position"] - PLAIN["position"]).max()) < 1e-5
    # In the fall after a stop the torque is as steep as 200 N m/s.
    assert float(abs(run["motor_torque"] - PLAIN["motor_torque"]).max()) < 0.2


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("", "needs a first line with its columns"),
        ("a, b\n1, 2", "needs a first line with its columns"),
        (TABLE + "\n300, 500, 16, 0.9, 0.9", "is no full grid of 3 x 2 x 3"),
        (TABLE + "\n50, 500, 16, 0.9, 0.9", "stand in an earlier line"),
        (TABLE + "\n50, 500, 16, 0.9", "line 14': is not five numbers"),
        (TABLE + "\n50, 500, 16, 1.9, 0.9", "line 14': is out of range"),
    ],
)
def test_a_table_that_cannot_be_used_is_refused_with_its_line(table, words):
    with pytest.raises(DescriptionError, match=words):
        BOOM.replace({"pump_a.losses": "table", "pump_a.efficiency_table": table})


def test_what_is_left_out_leaves_no_trace_in_the_equations():
    names = set(casadi_model(BOOM).parameters)
    assert not {
        n
        for n in names
        if n.split(".")[-1] in {"expansion", "air", "orifice_leak", "seal_leak", "opening_time", "pressure_friction"}
    }
    more = set(casadi_model(BOOM.replace({"oil.free_air": "1 %"})).parameters)
    assert more - names == {"oil.air", "oil.polytropic"}


def test_the_casadi_model_is_the_plant_that_is_simulated():
    model = casadi_model(BOOM)
    assert (model.states[0], model.inputs) == ("position", ("motor_speed", "load"))
    assert len(model.states) == len(model.state_units) == len(model.x0())
    assert dict(zip(model.outputs, model.output_units, strict=True))["motor_torque"] == "N m"
    assert model.p(oil_temperature=320.0)[model.parameters.index("oil_temperature")] == 320.0
    with pytest.raises(ValueError, match="no parameter 'oil_temprature'"):
        model.p(oil_temprature=320.0)
    found = model(x=model.x0(0.3, LOAD), u=[0.0, LOAD], slope=0, p=model.p0)
    assert abs(float(found["dx"][1])) < 1e-6  # at rest with the load carried, nothing is pushed
    servo = casadi_model(replace(UNIT, drive=boom({"drive.control": "servo"}).drive))
    assert "motor_speed" in servo.states


@pytest.mark.parametrize("lag", [1e-4, 0.02, 0.5, 30.0, 1e4])
@pytest.mark.parametrize("count", [2, 3, 8, 1000])
def test_a_lag_is_that_of_its_recursion(lag, count):
    """y[k] = (1 - a) x[k] + a y[k - 1], sample by sample, settled at first."""
    time, value = 0.02 * np.arange(count), np.random.default_rng(count).normal(300.0, 10.0, count)
    kept, at, expected = np.exp(-0.02 / lag), value[0], []
    for one in value:
        at = (1.0 - kept) * one + kept * at
        expected.append(at)
    np.testing.assert_allclose(lagging(time, value, lag), expected, rtol=1e-12)


def test_a_load_goes_by_its_name_in_the_description():
    high = ramsight.lift_lower("mining-loader", "high", unit="boom")
    assert float(high.load(1.0)) == 441e3
    both = ramsight.duty_for("mining-loader", "work-day", unit="boom", load=["light", "258 kN"], duration="1 min")
    loads = [float(both.load(t)) for t in range(60)]
    assert 129e3 - 1e-6 <= min(loads) <= max(loads) <= 258e3 + 1e-6
    with pytest.raises(DescriptionError, match=r"load = 'oak': is no force.*'441 kN', light, medium, high"):
        ramsight.lift_lower("mining-loader", "oak", unit="boom")
    with pytest.raises(DescriptionError, match=r"is no force"):
        ramsight.lift_lower(ramsight.build("mining-loader", "boom"), "high")  # what is built has no names
