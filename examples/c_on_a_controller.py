"""The sensor as C
===============

A microcontroller has no Python. The sensor's step is exported as C99 that needs nothing but libm: some files that
go into a firmware's build. Here a loop as such a firmware has it is compiled with gcc, fed with a drive's log and held
against Python. What the same files take of a Cortex-M stands in the documentation of the export.
"""

import subprocess
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import ramsight

# %%
# The firmware. One struct is the sensor; a sample goes in, an estimate comes out. NaN would be a value that is
# missing.
FIRMWARE = r"""
#include <stdio.h>
#include "ramsight_boom.h"

int main(void) {
  static ramsight_boom sensor;
  ramsight_boom_inputs in;
  ramsight_boom_outputs out;
  double speed, torque, kelvin;
  ramsight_boom_init(&sensor);
  if (!ramsight_boom_start(&sensor, 0.14f, 0.001f)) return 1; /* 140 mm, give or take 1 mm */
  while (scanf("%lf %lf %lf %lf", &in.time, &speed, &torque, &kelvin) == 4) {
    in.motor_speed = (ramsight_boom_real)speed;   /* rad/s */
    in.motor_torque = (ramsight_boom_real)torque; /* N m */
    in.oil_temperature = (ramsight_boom_real)kelvin;
    ramsight_boom_step(&sensor, &in, &out);
    printf("%.9g %d\n", (double)out.position, (int)out.status);
  }
  return 0;
}
"""

# %%
# Export, compile in single precision as a microcontroller's floating-point unit has it, and run. The log's rows go
# in by standard input, where a firmware would read its drive.
boom = ramsight.build("mining-loader", unit="boom")
run = ramsight.simulate(boom, load="300 kN", start="140 mm", cycles=2)
log = ramsight.drive_report(run)
columns = [log[name].values for name in ("time", "motor_speed", "motor_torque", "oil_temperature")]
rows = "\n".join(" ".join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True))
with tempfile.TemporaryDirectory() as name:
    folder = Path(name) / "boom-c"
    ramsight.export_c("mining-loader", "boom", out=folder, single=True, compiler="")
    (folder / "main.c").write_text(FIRMWARE, encoding="utf-8")
    sources = ["main.c", "ramsight_boom.c", *sorted(file.name for file in folder.glob("ramsight_boom_step_*.c"))]
    command = ["gcc", "-std=c99", "-Os", "-Wall", "-Werror", *sources, "-o", "firmware", "-lm"]
    subprocess.run(command, cwd=folder, check=True)
    size = subprocess.run(["size", "firmware"], cwd=folder, check=True, capture_output=True, text=True)
    said = subprocess.run([folder / "firmware"], input=rows, check=True, capture_output=True, text=True)
print(size.stdout)

# %%
# The same log in Python, in double precision.
track = ramsight.track(boom, log, start="140 mm", truth=run)
position, status = np.array([line.split() for line in said.stdout.splitlines()], dtype=float).T
difference = position - track["position"].values
print(f"{len(position)} steps, C and Python differ by {1e6 * np.abs(difference).max():.1f} um at most")
print(f"{int((status != track['status'].values).sum())} statuses differ")

figure, (way, gap) = plt.subplots(2, 1, sharex=True, figsize=(7, 4.5), layout="constrained")
way.plot(run["time"], 1e3 * run["position"], label="true")
way.plot(run["time"], 1e3 * position, "--", label="sensor in C")
way.set_ylabel("position [mm]")
way.legend()
gap.plot(run["time"], 1e6 * difference)
gap.set(xlabel="time [s]", ylabel="C less Python [µm]")
plt.show()
