"""A drive that reports wrongly
============================

A speed that reads too much by a share looks like a speed. What can a sensor notice that has nothing but what the
drive says? Here the reported speed is 5 % too high for 10 s, and the sensor is asked twice: as any drive lets it,
and where the drive reports the counter of its shaft as well.
"""

import matplotlib.pyplot as plt
import numpy as np

import ramsight
from ramsight import machine
from ramsight.duty.faults import Fault, inject

# %%
# Two descriptions of the same boom. The second one declares the counter (6064h of a drive), and how exact it is.
plain = machine.load_machine("mining-loader").unit("boom")
with_counter = plain.replace({"assumptions.shaft.std": "0.05 deg"})
units = {"plain": ramsight.build(plain, "boom"), "with counter": ramsight.build(with_counter, "boom")}

# %%
# A day's work of two minutes, the same for both, and the fault in it. The counter goes on counting rightly.
run = ramsight.simulate(units["plain"], "work-day", load=["100 kN", "370 kN"], duration="2 min", seed=3)
start, begin, end = float(run["position"][0]), 75.0, 85.0  # m, s, s
fault = Fault("gain", begin, end, "motor_speed", 1.05)
tracks = {}
for name, unit in units.items():
    log = inject(ramsight.drive_report(run, unit), fault)
    tracks[name] = ramsight.track(unit, log, start=start, truth=run)

# %%
# Without the counter nothing contradicts the speed: the position runs away, and the sensor says nothing new of it.
# With it the fault has a name within a second, and the position lives on by the counter.
for name, track in tracks.items():
    during = track.sel(time=slice(begin, end))
    wrong = 1e3 * float(np.abs(during["error"]).max())
    print(f"{name}: {wrong:.1f} mm off at most while it lasts")
    for status in sorted(set(during["status"].values.tolist())):
        first = float(during["time"][np.argmax(during["status"].values == status)])
        print(f"  from {first - begin:.2f} s on: {ramsight.Status(status).text}")

figure, (error, status) = plt.subplots(2, 1, sharex=True, figsize=(7, 5), layout="constrained")
for name, track in tracks.items():
    error.plot(track["time"], 1e3 * track["error"], label=name)
    status.step(track["time"], track["status"], where="post", label=name)
for ax in (error, status):
    ax.axvspan(begin, end, color="grey", alpha=0.2)
error.set_ylabel("error [mm]")
error.legend()
status.set(xlabel="time [s]", ylabel="status [1]\nok below 10,\nuncertain below 30")
plt.show()
