"""A machine as a linear model
===========================

Whoever designs a control wants eigenvalues. `casadi_model` hands out the plant as a `casadi.Function`, whose Jacobian
is one call: here an electro-hydrostatic actuator about a working point, held against the whole model.
"""

import casadi as ca
import matplotlib.pyplot as plt
import numpy as np

from ramsight import casadi_model, machine

SPEED, LOAD, STEP, SPAN = 100.0, 10e3, 2.0, 0.1  # rad/s, N, rad/s, s

plant = casadi_model(machine.load_machine("eha-test-bench").unit("axis"))
x, u = ca.SX.sym("x", len(plant.states)), ca.SX.sym("u", len(plant.inputs))
rate = plant(x=x, u=u, slope=0, p=plant.p0)["dx"]
jacobians = ca.Function("jacobians", [x, u], [ca.jacobian(rate, x), ca.jacobian(rate, u)])


def move(start, derivative, times):
    """A model from `start` by CVODES: its states at times after it, shape (states, times)."""
    problem = {"x": x, "ode": derivative}
    solver = ca.integrator("model", "cvodes", problem, 0.0, times, {"abstol": 1e-8, "reltol": 1e-8})
    return np.array(solver(x0=start)["xf"])


def whole(speed):
    """The whole model at a constant speed of the motor."""
    return plant(x=x, u=[speed, LOAD], slope=0, p=plant.p0)["dx"]


# %%
# A working point: settled at constant speed. The position runs on, all other states stand still. The eigenvalues with
# an imaginary part are the mass that swings on its oil.
point = move(plant.x0(position=0.06, load=LOAD), whole(SPEED), [0.5])[:, -1]
a, b = (np.array(matrix) for matrix in jacobians(point, [SPEED, LOAD]))
poles = np.linalg.eigvals(a)
for pole in sorted(poles[poles.imag > 1.0], key=abs):
    print(f"oscillation: {abs(pole) / 2 / np.pi:.1f} Hz, damping ratio {-pole.real / abs(pole):.3f}")

# %%
# Answer to a small step of the motor's speed, of the linear model and of the whole one.
times = np.linspace(SPAN / 200, SPAN, 200)
steady = np.array(plant(x=point, u=[SPEED, LOAD], slope=0, p=plant.p0)["dx"]).ravel()
linear = move(point, steady + a @ (x - point) + b[:, 0] * STEP, times)
answer = move(point, whole(SPEED + STEP), times)
k = plant.states.index("position")
travel = [1e3 * (rows[k] - point[k]) for rows in (linear, answer)]  # mm
print(f"travel in {SPAN} s after a step of {STEP} rad/s: {travel[0][-1]:.4f} mm linear, {travel[1][-1]:.4f} mm whole")
print(f"they differ by {100 * abs(travel[0][-1] / travel[1][-1] - 1):.2g} %")

v = plant.states.index("velocity")
figure, ax = plt.subplots(figsize=(7, 3.5), layout="constrained")
ax.plot(1e3 * times, 1e3 * answer[v], label="whole model")
ax.plot(1e3 * times, 1e3 * linear[v], "--", label="linear model")
ax.set(xlabel="time after the step [ms]", ylabel="velocity of the rod [mm/s]")
ax.legend()
plt.show()
