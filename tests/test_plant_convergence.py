"""Observed order of the integrator: standard stiff problems, and the plant itself."""

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ramsight import machine
from ramsight.duty import Duty, Profile
from ramsight.duty.profile import constant
from ramsight.engine.equation import OdeModel, State
from ramsight.engine.run import Outcome, Segments, integrate
from ramsight.plant.build import build
from ramsight.plant.unit import circuit, initial_state


def problem(name, rhs, size, tolerance):
    """An autonomous equation as a model; it has no inputs to speak of."""
    x, u, slope, p = (ca.SX.sym(key, n) for key, n in (("x", size), ("u", 1), ("s", 1), ("p", 1)))
    states = tuple(State(f"y{k}", "1", tolerance) for k in range(size))
    return OdeModel(name, states, ("u",), ("p",), x, u, slope, p, ca.vertcat(*rhs(*ca.vertsplit(x))))


def hires(a, b, c, d, e, f, g, h):
    """High irradiance response, E. Hairer and G. Wanner, Solving ODEs II, 2nd ed., (IV.10.4)."""
    return [
        -1.71 * a + 0.43 * b + 8.32 * c + 0.0007,
        1.71 * a - 8.75 * b,
        -10.03 * c + 0.43 * d + 0.035 * e,
        8.32 * b + 1.71 * c - 1.12 * d,
        -1.745 * e + 0.43 * f + 0.43 * g,
        -280.0 * f * h + 0.69 * d + 1.71 * e - 0.43 * f + 0.69 * g,
        280.0 * f * h - 1.81 * g,
        -280.0 * f * h + 1.81 * g,
    ]


def robertson(a, b, c):
    return [-0.04 * a + 1e4 * b * c, 0.04 * a - 1e4 * b * c - 3e7 * b * b, 3e7 * b * b]


def van_der_pol(y, z):
    """Of the same book, (IV.10.2), with stiffness 1e6."""
    return [z, 1e6 * ((1.0 - y * y) * z - y)]


#: name: equation, start, end, absolute tolerance, and the end as the test set of F. Mazzia prints it
STANDARD = {
    "Robertson": (robertson, [1.0, 0.0, 0.0], 40.0, 1e-8, [0.7158270688, 0.9185534765e-5, 0.2841637457]),
    "van der Pol": (van_der_pol, [2.0, 0.0], 2.0, 1e-4, [0.1706167732170483e1, -0.8928097010247975]),
    "HIRES": (
        hires,
        [1.0, 0, 0, 0, 0, 0, 0, 0.0057],
        321.8122,
        1e-6,
        [
            0.7371312573325668e-3, 0.1442485726316185e-3, 0.5888729740967575e-4, 0.1175651343283149e-2,
            0.2386356198831331e-2, 0.6238968252742796e-2, 0.2849998395185769e-2, 0.2850001604814231e-2,
        ],
    ),
}  # fmt: skip


def one_segment(end):
    return Segments(np.array([0.0]), np.array([end]), np.zeros((1, 1)), np.zeros((1, 1)), np.zeros((1, 1)))


@pytest.mark.parametrize("name", list(STANDARD))
def test_the_error_falls_with_the_fourth_power_of_the_number_of_steps(name):
    rhs, start, end, tolerance, book = STANDARD[name]
    model = problem(name, rhs, len(start), tolerance)
    steps, errors = [], []
    for rtol in 10.0 ** -np.arange(3.0, 7.1, 0.5):
        run = integrate(model, np.array(start), one_segment(end), np.array([end]), rtol=rtol, tolerance_scale=rtol)
        assert run.outcome is Outcome.DONE
        steps.append(run.accepted)
        errors.append(np.max(abs(run.state[-1] - book) / abs(np.array(book))))
        assert errors[-1] < 2.0 * rtol
    # Tighter than 1e-7 the order falls towards two, as that of Rosenbrock methods does on very stiff problems.
    order = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert 3.3 < order < 4.5


@pytest.mark.parametrize("name", list(STANDARD))
def test_a_tight_tolerance_gives_ten_digits(name):
    rhs, start, end, tolerance, book = STANDARD[name]
    model = problem(name, rhs, len(start), tolerance)
    run = integrate(model, np.array(start), one_segment(end), np.array([end]), rtol=1e-10, tolerance_scale=1e-10)
    np.testing.assert_allclose(run.state[-1], book, rtol=2e-10)


def test_radau_agrees_on_the_way():
    rhs, start, end, tolerance, _ = STANDARD["HIRES"]
    model = problem("HIRES", rhs, len(start), tolerance)
    times = np.linspace(0.0, end, 60)
    ours = integrate(model, np.array(start), one_segment(end), times, rtol=1e-8, tolerance_scale=1e-8)
    theirs = solve_ivp(
        lambda t, y: np.array(model.function(y, 0, 0, 0)).ravel(), (0, end), start, method="Radau", t_eval=times,
        rtol=1e-10, atol=1e-14,
    )  # fmt: skip
    np.testing.assert_allclose(ours.state, theirs.y.T, rtol=1e-5, atol=1e-9)


BOOM = build(machine.load_machine("mining-loader").unit("boom"), "boom")


def plant_run(duty, **options):
    model = circuit(BOOM)
    ode = model.ode
    segments = duty.segments(model.values, ode.parameters)
    start = initial_state(BOOM, model, duty.start_position, float(duty.load(0.0)))
    run = integrate(ode, start, segments, np.array([duty.duration]), **options)
    return run, run.state[-1, ode.state_index("position")]


def test_the_plants_order_at_constant_steps_is_four_where_its_laws_are_smooth():
    model = circuit(BOOM)
    ode = model.ode
    # Lifting at a speed that swings; valves stay where they are.
    way_in = Duty(Profile([0.0, 0.5, 2.0], [0.0, 100.0, 100.0]), constant(3e5), constant(313.15), 0.2)
    segments = way_in.segments(model.values, ode.parameters)
    lifting = integrate(ode, initial_state(BOOM, model, 0.2, 3e5), segments, np.array([2.0]), rtol=1e-10).state[-1]
    swing = Segments(np.array([0.0]), np.array([0.4]), np.array([[100.0, 3e5]]), np.array([[100.0, 5e4]]),
                     model.values[None])  # fmt: skip
    k = ode.state_index("position")
    exact = integrate(ode, lifting, swing, np.array([0.4]), rtol=1e-13, tolerance_scale=1e-7).state[-1, k]
    steps = 0.4 / np.array([100, 200, 400, 800])
    errors = [
        abs(
            integrate(ode, lifting, swing, np.array([0.4]), rtol=1e3, tolerance_scale=1e15, max_step=h).state[-1, k]
            - exact
        )
        for h in steps
    ]
    order = np.diff(np.log(errors)) / np.diff(np.log(steps))
    np.testing.assert_allclose(order, 4.0, atol=0.2)


def test_a_cycles_error_falls_with_the_tolerance():
    speed = Profile([0.0, 0.5, 1.3, 3.0, 3.8, 4.5, 5.3, 6.5, 7.3, 8.0], [0, 0, 157, 157, 0, 0, -157, -157, 0, 0])
    duty = Duty(speed, constant(441e3), constant(313.15), 0.2)
    _, exact = plant_run(duty, rtol=1e-11, tolerance_scale=1e-5)
    steps, errors = [], []
    for rtol in (1e-4, 1e-5, 1e-6, 1e-7, 1e-8):
        run, position = plant_run(duty, rtol=rtol, tolerance_scale=rtol / 1e-6)
        steps.append(run.accepted)
        errors.append(abs(position - exact))
    assert errors[2] < 1e-6  # at the default tolerance
    assert errors[-1] < 1e-8
    order = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert order > 3.0
