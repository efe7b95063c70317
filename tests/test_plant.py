"""The simulated unit: its accuracy against an independent integrator, its books, its laws and the reference circuit."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from ramsight import machine
from ramsight.duty import Duty, Profile, lift_lower, simulate
from ramsight.duty.profile import constant
from ramsight.engine.run import integrate
from ramsight.logs import read_truth
from ramsight.plant.cylinder import friction_force
from ramsight.plant.ddh import build, circuit, initial_state
from ramsight.plant.valve import orifice_flow
from ramsight.study.errors import first_stop_contact

UNITS = {name: build(name, unit) for name, unit in machine.load("mining-loader").units.items()}


def radau(model, initial, segments, times):
    """The same equations by scipy's Radau, restarted at every corner."""
    import casadi as ca

    ode = model.ode
    jacobian = ca.Function("j", [ode.x, ode.u, ode.slope, ode.p], [ca.densify(ca.jacobian(ode.rhs, ode.x))])
    state, rows = np.array(initial), []
    # What the tolerance of a state is, relative to which 1e-10 is meant.
    atol = np.where(np.abs(initial) > 1e3, 1e-2, 1e-13)
    for k, (start, end) in enumerate(zip(segments.start, segments.end, strict=True)):
        value, slope = segments.value[k], segments.slope[k]
        p = segments.parameters[min(k, len(segments.parameters) - 1)]

        def rhs(t, y, value=value, slope=slope, start=start, p=p):
            return np.array(ode.function(y, value + slope * (t - start), slope, p)).ravel()

        def jac(t, y, value=value, slope=slope, start=start, p=p):
            return np.array(jacobian(y, value + slope * (t - start), slope, p))

        wanted = times[(times >= start) & (times < end)]
        solved = solve_ivp(
            rhs,
            (start, end),
            state,
            method="Radau",
            rtol=1e-10,
            atol=atol,
            jac=jac,
            t_eval=np.append(wanted, end),
        )
        assert solved.success
        rows.append(solved.y[:, :-1].T)
        state = solved.y[:, -1]
    return np.vstack([*rows, state])


@pytest.mark.parametrize(("name", "load", "celsius"), [("boom", 441e3, 40.0), ("bucket", 162e3, 60.0)])
def test_a_cycle_agrees_with_radau_within_a_micrometre(name, load, celsius):
    unit = UNITS[name]
    duty = lift_lower(unit, load, celsius + 273.15)
    model = circuit(unit)
    segments = duty.segments(model.values, model.ode.parameters.index("oil_temperature"))
    times = np.append(np.arange(0.0, duty.duration - 1e-9, 0.05), duty.duration)
    initial = initial_state(unit, model, duty.start_position, load)
    ours = integrate(model.ode, initial, segments, times).state
    reference = radau(model, initial, segments, times)
    k = model.ode.state_index("position")
    assert np.abs(ours[:, k] - reference[:, k]).max() < 1e-6


def test_the_books_of_an_audited_run_are_those_of_a_plain_one():
    unit = UNITS["boom"]
    duty = lift_lower(unit, 200e3, 313.15)
    plain, audited = circuit(unit), circuit(unit, audited=True)
    runs = []
    for model in (plain, audited):
        segments = duty.segments(model.values, model.ode.parameters.index("oil_temperature"))
        initial = initial_state(unit, model, duty.start_position, 200e3)
        runs.append(integrate(model.ode, initial, segments, np.array([duty.duration])).state[0, :8])
    np.testing.assert_allclose(*runs, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", list(UNITS))
@settings(max_examples=25)
@given(
    share=st.floats(0.0, 1.0),
    celsius=st.floats(0.0, 70.0),
    rpm=st.floats(100.0, 3000.0),
    ramp=st.floats(0.05, 2.0),
    start=st.floats(0.02, 0.98),
)
def test_energy_and_volume_books_close_whatever_the_duty(name, share, celsius, rpm, ramp, start):
    unit = UNITS[name]
    load = share * (540e3 if name == "boom" else 195e3)  # up to and beyond what the relief valve allows
    duty = lift_lower(
        unit, load, celsius + 273.15, motor_speed=rpm * np.pi / 30, ramp=ramp, hold=2.0,
        start_position=start * unit.cylinder.stroke,
    )  # fmt: skip
    run = simulate(unit, duty)
    assert abs(run.attrs["energy_residual"]) < 1e-3
    assert abs(run.attrs["volume_residual"]) < 1e-3
    losses = [key for key in run.attrs if key.endswith((".leakage", ".friction", ".throttling", ".stop"))]
    assert len(losses) > 10
    largest = run.attrs["energy.shaft_given"] + run.attrs["energy.shaft_taken"]
    assert all(run.attrs[key] > -1e-6 * largest for key in losses)
    # The stops hold: nothing passes them by more than what the stiffness gives.
    assert float(run["position"].min()) > -3e-3
    assert float(run["position"].max()) < unit.cylinder.stroke + 3e-3


CYCLES = [
    "boom_129kN_40C", "boom_258kN_40C", "boom_441kN_40C", "boom_441kN_20C", "boom_441kN_60C",
    "bucket_48kN_40C", "bucket_96kN_40C", "bucket_162kN_40C",
]  # fmt: skip


@pytest.mark.parametrize("name", CYCLES)
def test_the_plant_moves_like_the_independent_simulators(trace, name):
    case = trace(name)
    duty_of, unit = case.case, UNITS[case.case["unit"]]
    corners, rpm = np.array(duty_of["speed"]).T
    load = duty_of["load"][0][1]
    duty = Duty(
        Profile(corners, rpm * np.pi / 30),
        constant(load),
        constant(duty_of["temp_c"] + 273.15),
        duty_of["x0"],
    )
    run = simulate(unit, duty)
    truth = read_truth(case.truth)
    time = run["time"].values
    until = first_stop_contact(truth["time"].values, truth["position"].values, unit.cylinder.stroke) or time[-1]
    before = time < until
    error = np.interp(time, truth["time"], truth["position"]) - run["position"].values
    assert np.abs(error[before]).max() < 1e-3
    settled = before & np.all([(time < t) | (time > t + 0.3) for t in corners], axis=0)
    for side in "ab":
        there = np.interp(time, truth["time"], truth[f"pressure_{side}"])
        assert np.abs(there - run[f"pressure_{side}"].values)[settled].max() < 3e5


def test_no_flow_at_no_pressure_difference_and_odd_symmetry():
    assert float(orifice_flow(1e-6, 0.0)) == 0.0
    for difference in (1.0, 1e3, 1e5, 2e7):
        assert float(orifice_flow(1e-6, -difference)) == -float(orifice_flow(1e-6, difference)) < 0.0
    assert float(orifice_flow(1e-6, 1e6)) == pytest.approx(1e-6 * 1e3, rel=1e-5)


@given(velocity=st.floats(-2.0, 2.0))
def test_cylinder_friction_opposes_the_motion(velocity):
    force = float(friction_force(velocity, 3000.0, 4200.0, 17000.0, 5e-3))
    assert force * velocity >= 0.0
    assert abs(force) <= 4200.0 * 1.3 + 17000.0 * abs(velocity)


@given(
    speed=st.floats(-400.0, 400.0),
    rise=st.floats(-250e5, 250e5),
    viscosity=st.floats(5e-6, 1e-3),
)
def test_a_pump_never_creates_power(speed, rise, viscosity):
    pump = UNITS["boom"].a.pump
    shaft = float(pump.torque(speed, rise)) * speed
    hydraulic = float(pump.flow(speed, rise, viscosity, 872.0)) * rise
    assert shaft - hydraulic >= -1e-6 * (abs(shaft) + abs(hydraulic))


def test_a_temperature_that_changes_is_held_in_small_pieces():
    duty = Duty(constant(0.0), constant(1e5), Profile([0.0, 10.0], [300.0, 310.0]), 0.1, end=10.0)
    segments = duty.segments(np.zeros(3), 1)
    assert np.diff(segments.parameters[:, 1]).max() <= 0.0501
    assert segments.parameters[0, 1] == pytest.approx(300.0, abs=0.03)


def test_a_duty_repeats_itself():
    unit = UNITS["boom"]
    once = lift_lower(unit, 1e5, 313.15)
    thrice = once.repeated(3)
    assert thrice.duration == pytest.approx(3 * once.duration)
    time = np.linspace(0.0, once.duration, 50, endpoint=False)
    np.testing.assert_allclose(thrice.motor_speed(time + 2 * once.duration), once.motor_speed(time), atol=1e-9)
