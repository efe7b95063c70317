"""A loop of your own
==================

A control that you write yourself, with the virtual sensor as its only feedback. `LivePlant` is the machine: it waits
for the next motor speed, and hands out what the drive reports. Here a PI control holds and moves a press that leaks.
"""

import matplotlib.pyplot as plt
import numpy as np

import ramsight

# %%
# The press leaks 15 % more than its data sheet says, its oil warms up, and its drive is late. The sensor knows the data
# sheet alone, and where the rod stands at first.
drive = ramsight.DriveResponse(command_delay=0.04, report_delay=0.02)
worn = ramsight.AsBuilt(leak=1.15, friction=1.2)
plant = ramsight.LivePlant("press", start="50 mm", load="100 kN", ambient="20 degC", as_built=worn, drive=drive)
sensor = ramsight.sensor_for("press")
sensor.start("50 mm")

# %%
# The loop: samples to the sensor, its position to the control, a motor speed to the plant. The integral finds the
# speed that holds the load against the leakage.
per_metre = 1.0 / ramsight.build("press").travel_per_radian  # rad/m
gain, reset, limit, integral = 2.0, 2.0, 180.0, 0.0  # 1/s, s, rad/s, m s
targets, estimates = [], []
while plant.now.time < 16.0:
    for report in plant.reports:
        estimate = sensor.step(**report)
    target = 0.20 if 1.0 <= plant.now.time < 10.0 else 0.08  # m
    load = 160e3 if plant.now.time >= 6.0 else 100e3  # N
    error = target - estimate.position
    wanted = gain * per_metre * (error + integral / reset)
    speed = min(max(wanted, -limit), limit)
    integral += plant.period * error * (speed == wanted)  # it waits while the speed is limited
    plant.advance(speed, load)
    targets.append(target)
    estimates.append(estimate.position)

# %%
# Rod, target and what the sensor said; below the commands to the motor.
run = plant.run()
rod, time = 1e3 * run["position"], run["time"]
for at in (5.9, 9.9, 15.9):
    k = round(at / plant.period)
    print(f"{at:.1f} s: target {1e3 * targets[k]:.0f} mm, rod at {float(rod[k]):.1f} mm")
off = np.abs(1e3 * np.array(estimates) - rod[:-1])
print(f"the sensor is within {float(off.max()):.1f} mm; the oil is {float(run['oil_temperature'][-1]) - 273.15:.1f} °C")

figure, (way, motor) = plt.subplots(2, 1, sharex=True, figsize=(7, 5), layout="constrained")
way.plot(time[1:], 1e3 * np.array(targets), "k:", label="target")
way.plot(time, rod, label="rod")
way.plot(time[1:], 1e3 * np.array(estimates), "--", label="virtual sensor")
way.set_ylabel("position [mm]")
way.legend()
motor.plot(time, run["motor_speed"] * 30 / np.pi)
motor.set(xlabel="time [s]", ylabel="motor speed [rpm]")
plt.show()
