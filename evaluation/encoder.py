"""The CANopen encoder on a bus, as a controller sees it: a life from boot to power loss, and how evenly it sends.

`ramsight encoder` runs as a program of its own on a multicast bus, beside a drive that plays a recorded log; a client
that knows the EDS file and CiA 406, and nothing else, listens. Prints what goes over the bus; the figures go into a
JSON file that docs/reference/encoder.md quotes.

    python evaluation/encoder.py --out results/encoder.json
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import canopen
import numpy as np

import can
from ramsight import machine
from ramsight.deploy.encoder import Frame, Settings, drive_map, encoder_for
from ramsight.deploy.encoder.played_drive import PlayedDrive, played_map
from ramsight.deploy.encoder.runner import frame_of, message_of, serve
from ramsight.logs import read_log, read_truth
from ramsight.plant.ddh import build_ddh

ROOT = Path(__file__).parent.parent
TRACE = ROOT / "tests" / "traces" / "boom_441kN_40C"
NODE, DRIVE, WARM, RATED = 6, 5, 7, 80.0
GROUP, FAULT = "239.74.163.2", 0x7FFFFFFF
PERIOD, HEARTBEAT, CYCLE = 0.01, 0.1, 0.02


class PlayedMachine:
    """The drive and the thermometer, in real time: they stand, and work when told to."""

    def __init__(self, bus: Any) -> None:
        drive = PlayedDrive(read_log(f"{TRACE}.csv.gz"), DRIVE, RATED, warm_node=WARM)
        self._bus, self._frames = bus, [(at, frame) for at, frame in drive.frames() if frame.cob_id == 0x180 + DRIVE]
        self.at, self.works, self.warm, self.alive = 0, False, True, True
        self.last = 0.0
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._play)
        self._thread.start()

    def stop(self) -> None:
        """End its thread."""
        self._stop.set()
        self._thread.join()

    def _play(self) -> None:
        begin, cycle = time.monotonic(), 0
        while not self._stop.wait(max(begin + CYCLE * cycle - time.monotonic(), 0.0)):
            cycle += 1
            if self.warm and cycle % 50 == 1:
                self._bus.send(message_of(Frame(0x180 + WARM, struct.pack("<h", 400))))
            if not self.alive:
                continue
            if self.works:
                self.at = min(self.at + 1, len(self._frames) - 1)
            frame = self._frames[self.at if self.at else cycle % 20][1]
            self._bus.send(message_of(frame))
            self.last = time.time()


class Listing:
    """What goes over the bus, as candump shows it; PDOs only when they change in kind."""

    def __init__(self, bus: Any) -> None:
        self._bus, self._begin = bus, None
        self.pdos: list[tuple[float, int]] = []
        self.beats: list[float] = []
        self._shown: dict[int, int] = {}
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._listen)
        self._thread.start()

    def say(self, text: str) -> None:
        """A remark between the frames; what follows is shown anew."""
        print(f"; {text}", flush=True)
        self._shown.clear()

    def stop(self) -> None:
        """End its thread."""
        self._stop.set()
        self._thread.join()

    def _listen(self) -> None:
        while not self._stop.is_set():
            message = self._bus.recv(0.1)
            frame = None if message is None else frame_of(message)
            if frame is None:
                continue
            self._begin = frame.time if self._begin is None else self._begin
            if frame.cob_id == 0x180 + NODE:
                self.pdos.append((frame.time, struct.unpack("<i", frame.data)[0]))
            elif frame.cob_id == 0x700 + NODE:
                self.beats.append(frame.time)
            often = self._shown.get(frame.cob_id, 0)
            if often < (1 if frame.cob_id in (0x185, 0x186, 0x187, 0x706) else 2 if frame.cob_id == 0x086 else 4):
                print(f"({frame.time - self._begin:010.6f}) can0 {frame}", flush=True)
            self._shown[frame.cob_id] = often + 1


@contextmanager
def verb(folder: Path) -> Iterator[subprocess.Popen[str]]:
    """The encoder as a program of its own."""
    command = [sys.executable, "-m", "ramsight", "encoder", "mining-loader", "--unit", "boom", "--interface",
               "udp_multicast", "--channel", GROUP, "--node-id", str(NODE), "--drive-node", str(DRIVE),
               "--map", str(folder / "map.toml"), "--state", str(folder / "boom.state")]  # fmt: skip
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.send_signal(signal.SIGINT)
            for line in process.stdout or ():
                print(f"; {line}", end="")


def wait_for(condition: Callable[[], object], seconds: float = 20.0, pause: float = 0.005) -> None:
    """Wait until something holds [s]."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError
        time.sleep(pause)


def life(folder: Path, seconds: float) -> dict[str, Any]:
    """From boot to a power loss and on; then measure for a while [s]."""
    (folder / "map.toml").write_text(played_map(DRIVE, WARM, RATED, hold="3 s"))
    buses = [can.Bus(interface="udp_multicast", channel=GROUP) for _ in range(3)]
    network = canopen.Network(buses[0])
    network.connect()
    node = network.add_node(NODE, str(ROOT / "src/ramsight/deploy/encoder/ramsight-encoder.eds"))
    node.sdo.RESPONSE_TIMEOUT = 1.0
    played, listing = PlayedMachine(buses[1]), Listing(buses[2])
    found: dict[str, Any] = {}
    try:
        with verb(folder):
            listing.say("boot: never referenced, so the position is the fault value, alarm bit 0 and warning bit 5")
            wait_for(lambda: node.nmt.state == "PRE-OPERATIONAL")
            node.sdo["Producer heartbeat time"].raw = round(1e3 * HEARTBEAT)
            node.nmt.state = "OPERATIONAL"
            wait_for(lambda: listing.pdos)
            words = [node.sdo[name].raw for name in ("Alarms", "Warnings")]
            listing.say(f"6503h = {words[0]:04X}h, 6505h = {words[1]:04X}h")
            listing.say("reference by hand: 6003h = 10000 steps of 10 um")
            node.sdo["Preset value"].raw = 10000
            time.sleep(0.3)
            listing.say("work: one cycle under 441 kN")
            played.works = True
            time.sleep(14.0)
            truth = read_truth(f"{TRACE}_truth.csv.gz")
            known = float(truth["position"][played.at]) * 1e3
            shown = listing.pdos[-1][1] * 1e-2
            listing.say(f"after 14 s: position {shown:.2f} mm, the truth {known:.2f} mm")
            wait_for(lambda: played.at >= len(truth["time"]) - 1)
            end = float(truth["position"][-1]) * 1e3
            found["life_error_mm"] = abs(listing.pdos[-1][1] * 1e-2 - end)
            listing.say(f"at the end: position {listing.pdos[-1][1] * 1e-2:.2f} mm, the truth {end:.2f} mm")
            listing.say("temperature lost for 4 s: uncertain, warning bit 14, EMCY 4200h")
            played.warm = False
            wait_for(lambda: node.sdo["Warnings"].raw & 1 << 14, pause=0.5)
            played.warm = True
            wait_for(lambda: not node.sdo["Warnings"].raw & 1 << 14, pause=0.5)
            listing.say("a preset outside the stroke is refused: 0609 0030h")
            try:
                node.sdo["Preset value"].raw = 99999
            except canopen.SdoAbortedError as error:
                listing.say(str(error))
            time.sleep(2.0)
            listing.say("power off")
        with verb(folder):
            listing.say("power on: the position is there again")
            begin = len(listing.pdos)
            wait_for(lambda: node.nmt.state == "PRE-OPERATIONAL")
            node.sdo["Producer heartbeat time"].raw = round(1e3 * HEARTBEAT)
            node.nmt.state = "OPERATIONAL"
            wait_for(lambda: len(listing.pdos) > begin + 50)
            listing.say(f"position {listing.pdos[-1][1] * 1e-2:.2f} mm")
            listing.say("the drive falls silent: EMCY 8250h; and comes back")
            found["lost_ms"] = lost(listing, played)
            time.sleep(1.0)
            listing.say(f"measuring {seconds:g} s")
            first = len(listing.pdos), len(listing.beats)
            time.sleep(seconds)
            found["udp_multicast"] = {
                "pdo": jitter([at for at, _ in listing.pdos[first[0] :]], PERIOD),
                "heartbeat": jitter(listing.beats[first[1] :], HEARTBEAT),
            }
            listing.say("a preset that contradicts is refused: 0800 0022h, and told: EMCY FF02h")
            try:
                node.sdo["Preset value"].raw = 60000
            except canopen.SdoAbortedError as error:
                listing.say(str(error))
            time.sleep(0.3)
    finally:
        played.stop()
        listing.stop()
        network.disconnect()
        for bus in buses[1:]:
            bus.shutdown()
    return found


def lost(listing: Listing, played: PlayedMachine, times: int = 10) -> list[float]:
    """From the drive's last frame to the first fault value [ms]."""
    found = []
    for _ in range(times):
        wait_for(lambda: listing.pdos[-1][1] != FAULT)
        time.sleep(0.1)
        played.alive = False
        time.sleep(0.05)
        last, before = played.last, len(listing.pdos)
        wait_for(lambda: listing.pdos[-1][1] == FAULT)
        at = next(at for at, steps in listing.pdos[before - 10 :] if steps == FAULT)
        found.append(1e3 * (at - last))
        played.alive = True
    return [round(one, 2) for one in sorted(found)]


def jitter(times: list[float], period: float) -> dict[str, float]:
    """Distances from the grid that fits best [ms], and how far intervals are from the period."""
    at = np.array(times)
    count = np.round((at - at[0]) / period)
    off = at - at[0] - count * period
    off = 1e3 * np.abs(off - np.median(off))
    apart = 1e3 * np.abs(np.diff(at) - period)
    return {
        "frames": len(at), "missed": int(count[-1] + 1 - len(at)),
        "p50_ms": float(np.percentile(off, 50)), "p99_ms": float(np.percentile(off, 99)), "max_ms": float(off.max()),
        "interval_p99_ms": float(np.percentile(apart, 99)), "interval_max_ms": float(apart.max()),
    }  # fmt: skip


def on_virtual(seconds: float) -> dict[str, Any]:
    """The same on a bus inside one process, where drive, encoder and client share an interpreter."""
    unit = build_ddh("boom", machine.load_machine("mining-loader").unit("boom"))
    device = encoder_for(unit, drive_map(DRIVE, rated_torque=RATED), Settings(NODE, DRIVE))
    buses = [can.Bus(interface="virtual", channel="study") for _ in range(3)]
    stop = threading.Event()
    thread = threading.Thread(target=serve, args=(device, buses[0], stop))
    played = PlayedMachine(buses[1])
    thread.start()
    pdos, beats = [], []
    try:
        buses[2].send(can.Message(arbitration_id=0x600 + NODE, is_extended_id=False,
                                  data=struct.pack("<BHBHxx", 0x2B, 0x1017, 0, round(1e3 * HEARTBEAT))))  # fmt: skip
        buses[2].send(can.Message(arbitration_id=0, is_extended_id=False, data=[1, NODE]))
        end = time.monotonic() + seconds + 1.0
        while time.monotonic() < end:
            message = buses[2].recv(0.1)
            if message is not None and message.arbitration_id == 0x180 + NODE:
                pdos.append(message.timestamp)
            elif message is not None and message.arbitration_id == 0x700 + NODE:
                beats.append(message.timestamp)
    finally:
        played.stop()
        stop.set()
        thread.join()
        for bus in buses:
            bus.shutdown()
    return {"pdo": jitter(pdos[50:], PERIOD), "heartbeat": jitter(beats[5:], HEARTBEAT)}


def main() -> None:
    """Show and measure."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--out", type=Path, required=True, help="the figures: .json")
    options.add_argument("--seconds", type=float, default=60.0, help="how long to measure on each bus")
    chosen = options.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        found = life(Path(folder), chosen.seconds)
    found["virtual"] = on_virtual(chosen.seconds)
    found |= {"seconds": chosen.seconds, "cores": os.cpu_count(), "python": platform.python_version()}
    found["load"] = round(os.getloadavg()[0], 1)
    chosen.out.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
