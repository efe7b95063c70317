"""Positions as targets
====================

Where should the rod be? A target in, a motor speed out, and a virtual sensor as the only feedback: a press without
a position sensor finds its end stops and goes to targets.
"""

import matplotlib.pyplot as plt
import numpy as np

from ramsight import machine
from ramsight.closed_loop.loop import UnitLoop
from ramsight.closed_loop.referencing import LoopSettings
from ramsight.duty.drive_response import DriveResponse
from ramsight.plant.as_built import AsBuilt
from ramsight.plant.build import build

# %%
# The press as its data sheet has it is all that sensor and control know. The one that runs leaks 15 % more, and its
# drive is late: 40 ms until it follows, 20 ms until it reports.
sheet = build(machine.load_machine("press").unit("ram"), "ram")
real = AsBuilt(leak=1.15, friction=1.2).apply(sheet)
drive = DriveResponse(command_delay=0.04, report_delay=0.02)
loop = UnitLoop(real, sheet, start_position=0.03, load=100e3, setting=LoopSettings(drive=drive))

# %%
# Nobody knows where the rod is. It visits both ends, and the lower one again; that teaches the sensor how the
# machine leaks. Then it goes to targets, with a load that grows in between.
for lifted in (False, True, False):
    loop.home("ram", lifted=lifted)
learned = loop.now.time
for target in (0.05, 0.15, 0.30, 0.10):
    loop.go({"ram": target})
    print(f"target {1e3 * target:.0f} mm: rod at {1e3 * loop.now.position['ram']:.2f} mm")
loop.load(160e3, 0.5)
loop.rest(3.0)
print(f"3 s after the load grew to 160 kN: rod at {1e3 * loop.now.position['ram']:.2f} mm")

# %%
# Rod, target and what the sensor believed; below the commands to the motor.
record, time = loop.records["ram"], np.array(loop.time)
believed = np.array([one.position for one in record.estimate])
figure, (way, gap, speed) = plt.subplots(3, 1, sharex=True, figsize=(7, 6), layout="constrained")
way.plot(time, 1e3 * np.array(record.target), "k:", label="target")
way.plot(time, 1e3 * np.array(record.position), label="rod")
way.set_ylabel("position [mm]")
way.legend()
gap.plot(time, 1e3 * (believed - np.array(record.position)))
gap.set(ylabel="error of the\nsensor [mm]", ylim=(-5, 5))
speed.plot(time, np.array(record.command) * 30 / np.pi)
speed.set(xlabel="time [s]", ylabel="motor speed [rpm]")
for ax in (way, gap, speed):
    ax.axvspan(0.0, learned, color="grey", alpha=0.15)
plt.show()
