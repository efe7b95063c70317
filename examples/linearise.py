"""Linearise a machine about a working point: eigenvalues, and a small step of the linear and the whole model.

`casadi_model` hands out the plant as a `casadi.Function`; its Jacobian is one call. Run it with:
python examples/linearise.py
"""

import casadi as ca
import numpy as np

from ramsight import casadi_model, machine

SPEED, LOAD, STEP, SPAN = 100.0, 10e3, 2.0, 0.1  # rad/s, N, rad/s, s

plant = casadi_model(machine.load("eha-test-bench").unit("axis"))
f = plant
x, u = ca.SX.sym("x", len(plant.states)), ca.SX.sym("u", len(plant.inputs))
rate = f(x=x, u=u, slope=0, p=plant.p0)["dx"]
jacobians = ca.Function("jacobians", [x, u], [ca.jacobian(rate, x), ca.jacobian(rate, u)])


def move(start, derivative, span):
    """A model from `start` over a time, by CVODES."""
    problem = {"x": x, "ode": derivative}
    solver = ca.integrator("model", "cvodes", problem, 0.0, span, {"abstol": 1e-8, "reltol": 1e-8})
    return np.array(solver(x0=start)["xf"]).ravel()


def whole(speed):
    """The whole model at a constant speed of the motor."""
    return f(x=x, u=[speed, LOAD], slope=0, p=plant.p0)["dx"]


# A working point: settled at constant speed. The position runs on, all other states stand still.
point = move(plant.x0(position=0.06, load=LOAD), whole(SPEED), 0.5)
a, b = (np.array(matrix) for matrix in jacobians(point, [SPEED, LOAD]))
poles = np.linalg.eigvals(a)
for pole in sorted(poles[poles.imag > 1.0], key=abs):
    print(f"oscillation: {abs(pole) / 2 / np.pi:.1f} Hz, damping ratio {-pole.real / abs(pole):.3f}")

# Answer to a small step of the motor's speed, of the linear model and of the whole one.
steady = np.array(f(x=point, u=[SPEED, LOAD], slope=0, p=plant.p0)["dx"]).ravel()
linear = move(point, steady + a @ (x - point) + b[:, 0] * STEP, SPAN) - point
change = move(point, whole(SPEED + STEP), SPAN) - point

k = plant.states.index("position")
error = abs(linear[k] - change[k]) / abs(change[k])
print(
    f"travel in {SPAN} s after a step of {STEP} rad/s: {1e3 * linear[k]:.4f} mm linear, {1e3 * change[k]:.4f} mm whole"
)
print(f"they differ by {100 * error:.2g} %")
