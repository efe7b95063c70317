"""Plant and sensor in a simulator
===============================

Simulators of whole machines take models as FMUs. Here the boom's hydraulics are one, the virtual sensor another,
and FMPy is the simulator, in the place of whatever is used elsewhere.
"""

import tempfile
from pathlib import Path

import fmpy
import matplotlib.pyplot as plt
import numpy as np

import ramsight

# %%
# The plant is driven by a motor speed with ramps. Given the speed's slope too, it takes ramps as ramps, not as
# stairs.
PERIOD, LOAD, WARM, START = 0.01, 441e3, 313.15, 0.14  # s, N, K, m
time = np.arange(0.0, 15.0, PERIOD)
corners = [1.0, 1.8, 4.8, 5.6, 7.5, 8.3, 11.3, 12.1]
speed = np.interp(time, corners, [0.0, 157.0, 157.0, 0.0, 0.0, -157.0, -157.0, 0.0])  # rad/s
slope = np.append(np.diff(speed), 0.0) / PERIOD
held = [np.full(len(time), value) for value in (LOAD, 0.0, WARM)]
driven = np.rec.fromarrays(
    [time, speed, slope, *held], names="time,motor_speed,motor_acceleration,load,load_rate,oil_temperature"
)

# %%
# Both are written, C sources and a binary for this computer inside. FMPy runs the plant first; what a drive would
# report of it goes into the sensor.
with tempfile.TemporaryDirectory() as name:
    plant, sensor = Path(name) / "boom-plant.fmu", Path(name) / "boom-sensor.fmu"
    ramsight.export_fmu("mining-loader", "boom", out=plant, what="plant")
    ramsight.export_fmu("mining-loader", "boom", out=sensor, what="sensor")
    for file in (plant, sensor):
        model = fmpy.read_model_description(str(file))
        print(f"{file.name}: FMI {model.fmiVersion}, {len(model.modelVariables)} variables")
    trace = fmpy.simulate_fmu(
        str(plant), stop_time=time[-1], output_interval=PERIOD, start_values={"start_position": START}, input=driven,
        output=["position", "motor_speed", "motor_torque", "pressure_chamber_a"],
    )  # fmt: skip
    moments, nothing = trace["time"], np.zeros(len(trace))
    reported = np.rec.fromarrays(
        [moments, trace["motor_speed"], trace["motor_torque"], nothing + WARM, nothing, nothing > 0.0],
        names="time,motor_speed,motor_torque,oil_temperature,reference,reference_known",
    )
    known = {"start_known": True, "start_position": START, "start_std": 1e-3}
    said = fmpy.simulate_fmu(
        str(sensor), stop_time=time[-1], step_size=PERIOD, output_interval=PERIOD, start_values=known, input=reported,
        output=["position", "status"],
    )  # fmt: skip

# %%
# A step of the sensor takes the sample at its beginning, and its outputs are seen at its end: it is one step late. The
# spike is the holding valve: the rod drops by the give of oil that had been shut in, within a few samples.
late = said["time"] - PERIOD
error = 1e3 * (said["position"] - np.interp(late, trace["time"], trace["position"]))[2:]
print(f"lifted by {1e3 * (trace['position'].max() - START):.1f} mm; the sensor is within {np.abs(error).max():.2f} mm")

figure, axes = plt.subplots(3, 1, sharex=True, figsize=(7, 6), layout="constrained")
axes[0].plot(trace["time"], 1e3 * trace["position"], label="plant")
axes[0].plot(said["time"], 1e3 * said["position"], "--", label="sensor")
axes[0].set_ylabel("position [mm]")
axes[0].legend()
axes[1].plot(trace["time"], trace["pressure_chamber_a"] / 1e5)
axes[1].set_ylabel("pressure A [bar]")
axes[2].plot(late[2:], error)
axes[2].set(xlabel="time [s]", ylabel="error [mm]")
plt.show()
