"""A machine of your own
=====================

A machine is a text: what stands in data sheets, each value with its unit. Here is a lift with one cylinder and two
pumps. What is left out has a default or stands in the catalogue; `ramsight new my-lift.toml --circuit ddh --unit
lift --minimal` writes such a file to be filled in.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

import ramsight

DESCRIPTION = """
format = 1
name = "my-lift"

[units.lift]
circuit = "ddh"                        # a motor, a pump for each side, load-holding valves
load_direction = "extend"
oil = { model = "tellus-t-32" }        # from the catalogue
tank = { pressure = "4 bar" }
manifold = { volume = "0.2 l" }
hose = { volume = "0.4 l", length = "2 m", diameter = "16 mm", effective_bulk_modulus = "0.6 GPa" }
pump_a = { model = "PGI100-2-016", chambers = 1, blocks = 1, belt = 1 }
pump_b = { model = "PGI100-2-008", chambers = 1, blocks = 1, belt = 1.2 }
drive = { moment_of_inertia = "0.006 kg m2", max_speed = "3000 rpm", max_torque = "60 N m" }
relief_valve = { model = "DB10P-01", setting = "200 bar" }
anticavitation_valve = { model = "RV12A-01" }
safety_valve = { model = "WS16ZR-01", opening_speed = "1 rad/s" }
load = { mass = "2000 kg", loads = { empty = "10 kN", full = "60 kN" } }

[units.lift.cylinder]
number = 1
bore = "80 mm"
rod = "50 mm"
stroke = "600 mm"
dead_volume_a = "0.1 l"
dead_volume_b = "0.1 l"
breakaway_friction = "0.8 kN"
coulomb_friction = "0.6 kN"
viscous_friction = "3 kN/(m/s)"
stribeck_velocity = "0.3 mm/s"
end_stop_stiffness = "400 kN/mm"
end_stop_damping = "150 kN/(m/s)"
"""

# %%
# A description is read from a file; a mistake in it names file, key, value and what is allowed. What follows from
# it should be compared with what you know of the machine: does a revolution move the rod as far?
with tempfile.TemporaryDirectory() as folder:
    file = Path(folder) / "my-lift.toml"
    file.write_text(DESCRIPTION, encoding="utf-8")
    lift = ramsight.build(file)
print(f"{2 * 3.14159 * 1e3 * lift.travel_per_radian:.2f} mm a revolution without leakage")

# %%
# Two cycles under the full load, and what the drive would report of them, in its steps and with its noise. The
# sensor is told where the rod is at first; from then on it has speed, torque and oil temperature alone.
run = ramsight.simulate(lift, load="60 kN", cycles=2, oil_temperature="45 degC")
log = ramsight.drive_report(run)
track = ramsight.track(lift, log, start=float(run["position"][0]), truth=run)
print(f"within {1e3 * track.attrs['error_largest']:.2f} mm over {float(run['time'][-1]):.0f} s")

# %%
# Above the rod by truth and sensor, below how wrong the sensor is, and what it says of that itself.
figure, (way, error) = plt.subplots(2, 1, sharex=True, figsize=(7, 5), layout="constrained")
way.plot(run["time"], 1e3 * run["position"], label="true")
way.plot(track["time"], 1e3 * track["position"], "--", label="virtual sensor")
way.set_ylabel("position [mm]")
way.legend()
band = 1.96e3 * track["position_std"]
error.fill_between(track["time"], -band, band, alpha=0.2, label="95 % band")
error.plot(track["time"], 1e3 * track["error"], label="error")
error.set(xlabel="time [s]", ylabel="error [mm]")
error.legend()
plt.show()
