"""A thousand loads and temperatures
=================================

How far does the rod sink in a cycle, whatever the day brings? A loader's boom lifts and lowers a thousand times,
each time under another load and with other oil. Many runs go side by side through the same machine code.
"""

import time

import matplotlib.pyplot as plt
import numpy as np

import ramsight

# %%
# Loads and oil temperatures are drawn evenly from what the machine sees. The same seed gives the same runs.
boom, random = ramsight.build("mining-loader", unit="boom"), np.random.default_rng(seed=1)
loads = random.uniform(129e3, 441e3, size=1000)  # N
temperatures = random.uniform(283.15, 333.15, size=1000)  # K
duties = [ramsight.lift_lower(boom, *drawn) for drawn in zip(loads, temperatures, strict=True)]

# %%
# Each run is a cycle of 20 s. Of each the end and the extremes are kept, so that a million would fit into memory,
# too.
begun = time.perf_counter()
runs = ramsight.simulate_many(boom, duties)
took = time.perf_counter() - begun
assert (runs["outcome"] == "done").all()
print(f"{runs.sizes['duty']} cycles in {took:.0f} s, {runs['duration'].sum() / 3600:.1f} h simulated")

# %%
# At the end of a cycle the rod is not where it began: in both directions oil leaks the way that the load presses
# it. Warm oil is thin, and a high load presses harder.
sunk = 1e3 * (runs["start_position"] - runs["position_final"])  # mm
low, middle, high = sunk.quantile([0.05, 0.5, 0.95]).values
print(f"sinks by {middle:.0f} mm, nine of ten times by {low:.0f} to {high:.0f} mm")

figure, (over, counted) = plt.subplots(1, 2, figsize=(9, 3.8), layout="constrained", width_ratios=(3, 2))
dots = over.scatter(loads / 1e3, sunk, c=temperatures - 273.15, s=8)
over.set(xlabel="load [kN]", ylabel="sunk in a cycle [mm]")
figure.colorbar(dots, label="oil temperature [°C]")
counted.hist(sunk, bins=30)
counted.set(xlabel="sunk in a cycle [mm]", ylabel="cycles [1]")
plt.show()
