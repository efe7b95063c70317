"""How a machine differs from its data sheet
=========================================

A position sensor is put on for a day of commissioning. From what the drive reported and where the rod was, leakage,
displacement, stiffness and friction of this machine come out, each with an interval.
"""

import matplotlib.pyplot as plt

import ramsight

# %%
# A machine as it was built, which nobody knows. It lifts and lowers three loads, each both ways, fast and slowly.
truth = {"leak": 1.2, "displacement": 0.997, "stiffness": 0.8, "friction": 1.3}
boom = ramsight.build("mining-loader", unit="boom")
run = ramsight.simulate(boom, "commissioning", as_built=ramsight.AsBuilt(**truth), load=["129 kN", "258 kN", "441 kN"])
log = ramsight.drive_report(run)

# %%
# The balance of the unit's own circuit is run along the log; the factors are those with which it follows the rod.
found = ramsight.identify(boom, log, run)
print(f"{found.moves} moves, {found.duration:.0f} s")
for name, factor in found.factors.items():
    said = (
        f"{factor.value:.4f}, 95 % from {factor.low:.4f} to {factor.high:.4f}"
        if factor.identified
        else "not identifiable from this log"
    )
    print(f"{name}: {said}")

# %%
# Every interval holds what the machine was built with. Friction is hardly told: the pumps' own friction costs the
# motor the same torque.
figure, axes = plt.subplots(1, len(truth), figsize=(9, 3.2), layout="constrained")
for ax, (name, value) in zip(axes, truth.items(), strict=True):
    one = found.factors[name]
    ax.errorbar([0], [one.value], [[one.value - one.low], [one.high - one.value]], fmt="o", capsize=6, label="found")
    ax.plot([0], [value], "x", markersize=9, label="as built")
    ax.axhline(1.0, color="grey", lw=1, ls=":")
    ax.set(title=name, xticks=[], ylabel="over the data sheet's [1]")
axes[0].legend()
plt.show()

# %%
# A sensor of the data sheet, and one that knows the factors, on another day. Neither is told of any end stop.
day = {"duty": "lift-lower", "load": "350 kN", "cycles": 3}
work = ramsight.simulate(boom, as_built=ramsight.AsBuilt(**truth), **day)
known = ramsight.AsBuilt(**{name: found.factors[name].value for name in truth}).apply(boom)
figure, ax = plt.subplots(figsize=(7, 3.2), layout="constrained")
for name, unit in (("data sheet", boom), ("identified", known)):
    track = ramsight.track(unit, ramsight.drive_report(work), float(work["position"][0]), work, sensor="balance")
    print(f"{name}: {1e3 * track.attrs['error_final']:.1f} mm off after {float(work['time'][-1]):.0f} s")
    ax.plot(track["time"], 1e3 * track["error"], label=name)
ax.set(xlabel="time [s]", ylabel="error [mm]")
ax.legend()
plt.show()
