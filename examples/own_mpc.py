"""A predictive control from the plant's graph
===========================================

`casadi_model` hands out the plant's equation. Its linear gain is the model of a small predictive control here: a QP
every 100 ms, with a solver that CasADi ships. The virtual sensor is the only feedback, and the rod keeps a largest
speed.
"""

import casadi as ca
import matplotlib.pyplot as plt
import numpy as np

import ramsight

STEP, AHEAD = 0.1, 15  # s, steps
FASTEST, HARDEST, RISE = 180.0, 0.03, 30.0  # rad/s; m/s of the rod; rad/s from step to step

# %%
# The gain from motor speed to the rod's velocity: the linear model about rest, all but the position settled.
unit, load = ramsight.build("press"), 100e3  # N
graph = ramsight.casadi_model(unit)
x, u = ca.SX.sym("x", len(graph.states)), ca.SX.sym("u", len(graph.inputs))
rate = graph(x=x, u=u, slope=0, p=graph.p0)["dx"]
point = [graph.x0(position=0.1, load=load), [0.0, load]]
keep = [k for k, name in enumerate(graph.states) if name != "position"]
a, b = (np.array(ca.Function("at", [x, u], [ca.jacobian(rate, one)])(*point)) for one in (x, u))
gain = -np.linalg.solve(a[np.ix_(keep, keep)], b[keep, 0])[keep.index(graph.states.index("velocity"))]
print(
    f"{1e3 * gain:.3f} mm/s of the rod for a rad/s of the motor; displacement alone: {1e3 * unit.travel_per_radian:.3f}"
)

# %%
# The problem: positions ahead follow speeds; what the model does not explain (leakage, load) is a velocity `drift`.
speeds, known = ca.SX.sym("speeds", AHEAD), ca.SX.sym("known", 4)  # position, last speed, drift, target
velocities = gain * speeds + known[2]
positions = known[0] + STEP * ca.cumsum(velocities)
changes = speeds - ca.vertcat(known[1], speeds[:-1])
cost = ca.sumsqr(1e3 * (positions - known[3])) + 2e-4 * ca.sumsqr(changes)
problem = {"x": speeds, "p": known, "f": cost, "g": ca.vertcat(changes, velocities / gain)}
solver = ca.qpsol("mpc", "daqp", problem)
bounds = np.r_[np.full(AHEAD, RISE), np.full(AHEAD, HARDEST / gain)]

# %%
# The loop: a command holds for 100 ms, and the sensor takes the five samples that the drive reports meanwhile.
plant = ramsight.LivePlant(unit, start="50 mm", load=load, as_built=ramsight.AsBuilt(leak=1.15))
sensor = ramsight.sensor_for(unit)
sensor.start("50 mm")
speed, drift, before, targets = 0.0, 0.0, None, []
while plant.now.time < 12.0:
    for report in plant.reports:
        estimate = sensor.step(**report)
    target = 0.20 if 1.0 <= plant.now.time < 8.0 else 0.12  # m
    if before is not None:
        drift += 0.3 * ((estimate.position - before) / STEP - gain * speed - drift)
    before = estimate.position
    state = [before, speed, drift, target]
    found = solver(x0=np.full(AHEAD, speed), p=state, lbx=-FASTEST, ubx=FASTEST, lbg=-bounds, ubg=bounds)
    speed = float(found["x"][0])
    plant.advance(speed, dt=STEP)
    targets.append(target)

# %%
# Rod and target; below the rod's velocity: it swings on its oil when it starts, about a mean within the limit.
run = plant.run()
time, rod = run["time"], 1e3 * run["position"]
for at in (7.9, 11.9):
    there = float(rod.sel(time=at, method="nearest"))
    print(f"{at:.1f} s: target {1e3 * targets[round(at / STEP)]:.0f} mm, rod at {there:.1f} mm")
fastest = float(rod[::5].diff("time").max()) / STEP
print(f"overshoot {float(rod.max()) - 200.0:.1f} mm, fastest {fastest:.1f} mm/s over a step")

figure, (way, fast) = plt.subplots(2, 1, sharex=True, figsize=(7, 5), layout="constrained")
way.step(STEP * np.arange(len(targets)), 1e3 * np.array(targets), "k:", where="post", label="target")
way.plot(time, rod, label="rod")
way.set_ylabel("position [mm]")
way.legend()
fast.plot(time, 1e3 * run["velocity"])
fast.axhline(1e3 * HARDEST, color="grey", lw=0.8)
fast.set(xlabel="time [s]", ylabel="velocity [mm/s]")
plt.show()
