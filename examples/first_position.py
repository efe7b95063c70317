"""A first position
================

From a drive log to where the piston was: a machine of the catalogue, what its drive would log, and the virtual sensor
that follows it. With a log of your own, `ramsight.read_log` takes the place of the simulation.
"""

import matplotlib.pyplot as plt

import ramsight

# %%
# The loader's boom works for two minutes: moves and loads at random, and an end stop now and then. The pumps leak 10 %
# more than the data sheet says, which nobody knows.
boom = ramsight.build("mining-loader", unit="boom")
run = ramsight.simulate(boom, "work-day", duration="2 min", seed=4, as_built=ramsight.AsBuilt(leak=1.1))
log = ramsight.drive_report(run)  # motor speed, motor torque, oil temperature

# %%
# Where the piston stands at first is not known: the sensor is not referenced until it meets an end stop.
track = ramsight.track(boom, log, truth=run)
first = track["time"].where(track["position"].notnull()).min()
print(f"first position after {float(first):.1f} s")
p95, final = 1e3 * track.attrs["error_p95"], 1e3 * track.attrs["error_final"]
print(f"95 % of the errors within {p95:.1f} mm, in the end {final:.1f} mm")

figure = ramsight.plot(track)
figure.set_size_inches(7, 7)
plt.figure(figure)
plt.show()
