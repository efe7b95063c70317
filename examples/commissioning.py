"""A commissioning, rehearsed
==========================

Before a virtual position sensor is relied on, the machine goes through a leak test, both end stops and some loads.
All of it can be rehearsed at a desk, on a machine that is known. The log is judged as that of a real commissioning
would be.
"""

import matplotlib.pyplot as plt

import ramsight

# %%
# A boom that leaks more, is softer and rubs more than its data sheet says, and a drive that is off by 3 % of torque
# and 3 K. The judge gets the drive's log, and the position that somebody measured along with it.
boom = ramsight.build("mining-loader", unit="boom")
worn = ramsight.AsBuilt(leak=1.2, displacement=0.997, stiffness=0.8, friction=1.3)
run = ramsight.simulate(boom, "commissioning", as_built=worn)
log = ramsight.drive_report(run, torque_gain=1.03, temperature_offset="3 K")
done = ramsight.commission(boom, log, truth=run)
for finding in done.findings:
    print(finding.text)
print(f"verdict: {done.verdict.value}")

# %%
# The sensor was told nothing. It finds the position at the first end stop, and what it learns there narrows its
# band.
track = done.track
figure, (way, error) = plt.subplots(2, 1, sharex=True, figsize=(7, 5), layout="constrained")
way.plot(run["time"], 1e3 * run["position"], label="true")
way.plot(track["time"], 1e3 * track["position"], "--", label="virtual sensor")
way.set_ylabel("position [mm]")
way.legend()
band = 1.96e3 * track["position_std"]
error.fill_between(track["time"], -band, band, alpha=0.2, label="95 % band")
error.plot(track["time"], 1e3 * track["error"], label="error")
error.set(xlabel="time [s]", ylabel="error [mm]", ylim=(-30, 30))
error.legend()
plt.show()

# %%
# The commonest mistake of a real one: the torque has the wrong sign. That is seen at once, and nothing else is
# judged.
wrong = ramsight.commission(boom, log.assign(motor_torque=-log["motor_torque"]))
for finding in wrong.findings:
    print(finding.text)
print(f"verdict: {wrong.verdict.value}")
