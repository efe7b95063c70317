"""A circuit of your own
=====================

A circuit is parts that join nodes, and both can stand in a description. Here one pump lifts a mast, a valve holds
it, and an accumulator behind that valve takes up what a bumpy floor does to the load.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

import ramsight
from ramsight.duty import Duty, Profile

MAST = """
format = 1
name = "my-mast"

[units.lift]
circuit = "parts"
load_direction = "extend"
oil = { model = "tellus-t-32" }
tank = { pressure = "1.1 bar" }
drive = { moment_of_inertia = "0.006 kg m2", max_speed = "3000 rpm", max_torque = "60 N m" }
load = { mass = "4000 kg", loads = { full = "45 kN" } }

[units.lift.cylinder]
number = 2
bore = "50 mm"
rod = "45 mm"
stroke = "1.5 m"
dead_volume_a = "0.2 l"
dead_volume_b = "0.2 l"
breakaway_friction = "0.4 kN"
coulomb_friction = "0.3 kN"
viscous_friction = "1.5 kN/(m/s)"
stribeck_velocity = "5 mm/s"

[units.lift.parts]
pump = { kind = "pump", inlet = "tank", outlet = "port", model = "PGI100-2-016", belt = 1 }
manifold = { kind = "volume", node = "port", volume = "0.2 l" }
relief = { kind = "relief valve", inlet = "port", outlet = "tank", model = "DB10P-01", setting = "180 bar" }
suction = { kind = "check valve", inlet = "tank", outlet = "port", model = "RV12A-01" }

[units.lift.parts.breather]
kind = "orifice"
inlet = "chamber_b"
outlet = "tank"
rated_flow = "40 l/min"
rated_pressure_drop = "0.5 bar"

[units.lift.parts.holding]
kind = "safety valve"
inlet = "port"
outlet = "line"
model = "WS16ZR-01"
opening_speed = "2 rad/s"

[units.lift.parts.hose]
kind = "hose"
inlet = "line"
outlet = "chamber_a"
volume = "0.6 l"
length = "3 m"
diameter = "16 mm"
effective_bulk_modulus = "0.6 GPa"
regime = "turbulent"
"""

SUSPENSION = """
[units.lift.parts.suspension]
kind = "accumulator"
node = "line"
gas_volume = "0.5 l"
precharge = "50 bar"
gas_exponent = 1.4
"""

# %%
# The mast with and without the accumulator: one part more. Any circuit can be drawn with the symbols of ISO 1219-1.
# Look whether it is the one that was meant.
with tempfile.TemporaryDirectory() as name:
    rigid, sprung, sheet = (Path(name) / file for file in ("rigid.toml", "sprung.toml", "mast.png"))
    rigid.write_text(MAST, encoding="utf-8")
    sprung.write_text(MAST + SUSPENSION, encoding="utf-8")
    units = {"rigid": ramsight.build(rigid), "sprung": ramsight.build(sprung)}
    ramsight.draw(sprung, sheet, title="mast with a suspension")
    picture = plt.imread(sheet)
figure, axes = plt.subplots(figsize=(8, 8 * picture.shape[0] / picture.shape[1]), layout="constrained")
axes.imshow(picture)
axes.axis("off")

# %%
# A bump: the load grows by a half for 100 ms while the mast stands. The motor does not turn, and the holding valve
# is shut.
load = Profile([0.0, 1.0, 1.02, 1.12, 1.14, 4.0], [30e3, 30e3, 45e3, 45e3, 30e3, 30e3])  # N over s
rest = Duty(Profile([0.0, 4.0], [0.0, 0.0]), load, Profile([0.0], [313.15]), start_position=0.5)
figure, (way, pressure) = plt.subplots(2, 1, sharex=True, figsize=(7, 5), layout="constrained")
for name, unit in units.items():
    run = ramsight.simulate(unit, rest, sample_period="2 ms")
    sunk = 1e3 * (run["position"] - run["position"][0])
    print(f"{name}: sinks by {-float(sunk.min()):.1f} mm, {float(run['pressure_a'].max()) / 1e5:.0f} bar at most")
    way.plot(run["time"], sunk, label=name)
    pressure.plot(run["time"], run["pressure_a"] / 1e5, label=name)
way.set_ylabel("position [mm]")
way.legend()
pressure.set(xlabel="time [s]", ylabel="pressure in the cylinder [bar]")
plt.show()
