"""A position sensor on CANopen, and a client
==========================================

On the bus the virtual sensor is a linear encoder of CiA 406, where a wire-draw sensor would be. A client that knows
its EDS file and nothing of hydraulics starts it, gives it a reference and reads positions. All of it runs in this
program, on a bus that exists only here; with `interface="socketcan", channel="can0"` it is a real one.
"""

import contextlib
import tempfile
import threading
import time
from pathlib import Path

import canopen
import matplotlib.pyplot as plt
import numpy as np

import can
import ramsight
from ramsight.deploy.encoder import Settings, drive_map, encoder_for
from ramsight.deploy.encoder.objects import eds_text
from ramsight.deploy.encoder.played_drive import PlayedDrive
from ramsight.deploy.encoder.runner import message_of, serve

ENCODER, DRIVE, RATED = 6, 5, 80.0  # node-IDs; rated torque of the drive [N m]
NO_VALUE = 0x7FFFFFFF


def bus():
    """One more place on the bus."""
    return can.Bus(interface="virtual", channel="example")


# %%
# The sensor: it listens to the drive's process data (606Ch and 6077h) and needs a channel map and a node-ID.
boom = ramsight.build("mining-loader", unit="boom")
encoder = encoder_for(boom, drive_map(DRIVE, rated_torque=RATED), Settings(ENCODER, DRIVE))
stop, sensors_bus = threading.Event(), bus()
threading.Thread(target=serve, args=(encoder, sensors_bus, stop), daemon=True).start()

# %%
# The client: node 6 with its EDS file, which also stands in the package. It keeps every position that comes.
network = canopen.Network(bus())
network.connect()
with tempfile.TemporaryDirectory() as folder:
    (Path(folder) / "encoder.eds").write_text(eds_text(), encoding="utf-8")
    node = network.add_node(ENCODER, str(Path(folder) / "encoder.eds"))
read = []
network.subscribe(
    0x180 + ENCODER, lambda _, data, at: read.append((at, int.from_bytes(data[:4], "little", signed=True)))
)
node.nmt.state = "OPERATIONAL"
print(
    f"device type {node.sdo[0x1000].raw & 0xFFFF}; without a drive the position is {node.sdo[0x6004].raw:X}h: no value"
)

# %%
# The drive works for six seconds, in real time: a simulated lift, played as frames. It stands at first; meanwhile
# the client writes the oil's temperature, for no thermometer is on this bus, and a preset: the rod is at 140 mm, in
# steps of 10 µm.
run = ramsight.simulate(boom, load="300 kN", oil_temperature="40 degC", start="140 mm")
drives_bus, begun, preset = bus(), time.time(), False
for at, frame in PlayedDrive(ramsight.drive_report(run).sel(time=slice(0.0, 6.0)), DRIVE, RATED).frames():
    time.sleep(max(begun + at - time.time(), 0.0))
    drives_bus.send(message_of(frame))
    if at == 0.5:
        node.sdo["Oil temperature"].raw = 400  # 0.1 °C
    if 0.5 <= at < 1.0 and not preset:
        # An encoder that has just lost a report refuses a preset; a client asks again.
        with contextlib.suppress(canopen.SdoAbortedError):
            node.sdo["Preset value"].raw = 14000
            preset = True
print(f"alarms {node.sdo['Alarms'].raw:04X}h, warnings {node.sdo['Warnings'].raw:04X}h")
stamps, steps = np.array([one for one in read if one[1] < NO_VALUE]).T
moments, positions = stamps - begun, steps / 100.0  # s, mm
true = 1e3 * np.interp(moments, run["time"], run["position"])
print(f"{len(positions)} positions; at last {positions[-1]:.2f} mm, the truth is {true[-1]:.2f} mm")

# %%
# All of it is closed again; on a real bus `ramsight encoder` does this until Ctrl-C.
stop.set()
network.disconnect()
for one in (sensors_bus, drives_bus):
    one.shutdown()
figure, ax = plt.subplots(figsize=(7, 3.5), layout="constrained")
ax.plot(run["time"], 1e3 * run["position"], color="grey", label="true")
ax.plot(moments, positions, ".", markersize=3, label="6004h, as the client read it")
ax.set(xlabel="time [s]", ylabel="position [mm]", xlim=(0.0, 6.0))
ax.legend()
plt.show()
