"""A leak test
===========

Pumps wear, and what they leak is what a virtual position sensor is wrong by. With the load-holding valve closed no
oil reaches the cylinder: the motor turns slowly, and all that the pump delivers leaks back. The torque says under
which pressure. So leakage is measured in half a minute, on the machine, with no position sensor at all.
"""

import matplotlib.pyplot as plt
import numpy as np

import ramsight

# %%
# A boom whose pumps leak a fifth more than the data sheet says goes through the test: a lift, so that there is
# pressure behind the valve, then two slow speeds against it.
boom = ramsight.build("mining-loader", unit="boom")
run = ramsight.simulate(boom, "leak-test", as_built=ramsight.AsBuilt(leak=1.2), load="441 kN")
log = ramsight.drive_report(run)

# %%
# The test is found in the log by itself. Each stretch of slow turning gives a leak factor, leakage over the data
# sheet's.
found = ramsight.leak_test(boom, log)
print(f"leak factor {found.factor:.3f} ± {1.96 * found.std:.3f} (it is 1.2)")
for one in found.stretches:
    print(f"  {one.start:.1f} to {one.end:.1f} s: factor {one.factor:.3f} at {one.pressure / 1e5:.0f} bar")

# %%
# What the drive reported. In the shaded stretches the motor turns and the rod stands.
figure, axes = plt.subplots(3, 1, sharex=True, figsize=(7, 5.5), layout="constrained")
axes[0].plot(log["time"], log["motor_speed"] * 30 / np.pi)
axes[0].set_ylabel("motor speed [rpm]")
axes[1].plot(log["time"], log["motor_torque"])
axes[1].set_ylabel("motor torque [N m]")
axes[2].plot(run["time"], 1e3 * run["position"])
axes[2].set(xlabel="time [s]", ylabel="true position [mm]")
for one in found.stretches:
    for ax in axes:
        ax.axvspan(one.start, one.end, alpha=0.15)
plt.show()

# %%
# How the factor depends on the machine: the same test on five machines.
factors = np.linspace(0.8, 1.6, 5)
measured = []
for factor in factors:
    test = ramsight.simulate(boom, "leak-test", as_built=ramsight.AsBuilt(leak=factor), load="441 kN")
    measured.append(ramsight.leak_test(boom, ramsight.drive_report(test)))
figure, ax = plt.subplots(figsize=(4.5, 4), layout="constrained")
ax.plot(factors, factors, color="grey", lw=1)
ax.errorbar(factors, [one.factor for one in measured], [1.96 * one.std for one in measured], fmt="o", capsize=3)
ax.set(xlabel="leakage over the data sheet's, true [1]", ylabel="measured [1]")
plt.show()
