"""The encoder on buses of python-can, in real time: a life from boot to power loss, and the command line."""

import math
import os
import signal
import struct
import subprocess
import sys
import threading
import time
from contextlib import contextmanager

import canopen
import pytest
from canopen import SdoAbortedError

import can
from ramsight.cli import app
from ramsight.deploy.encoder.assembly import overrides
from ramsight.deploy.encoder.played_drive import PlayedDrive, played_map
from ramsight.deploy.encoder.runner import frame_of, message_of, serve
from ramsight.errors import RamsightError
from ramsight.logs import read_log, read_truth
from ramsight.logs.channel_map import load_map
from ramsight.sensor.status import Status
from ramsight.tracking.comparing import Verdict

from .encoder_bus import DRIVE, EDS, FAULT, NODE, OTHER_MAP, PE, RATED, WARM, encoder, other_frame
from .waiting import PATIENCE, wait_for

GROUP = "239.74.163.2"


class Buses:
    """Buses of one interface, closed at the end; UDP ports are the test's own."""

    def __init__(self, interface: str) -> None:
        self._interface, self._open = interface, []
        self._port = 43200 + os.getpid() % 1000

    def open(self) -> can.BusABC:
        if self._interface == "virtual":
            bus = can.Bus(interface="virtual", channel=f"encoder-{self._port}")
        else:
            bus = can.Bus(interface="udp_multicast", channel=GROUP, port=self._port)
        self._open.append(bus)
        return bus

    def close(self) -> None:
        for bus in self._open:
            bus.shutdown()


@pytest.fixture(params=["virtual", pytest.param("udp_multicast", marks=pytest.mark.slow)])
def buses(request):
    found = Buses(request.param)
    try:
        found.open()
    except can.CanError as error:
        pytest.skip(f"no such bus here: {error}")
    yield found
    found.close()


@contextmanager
def running(device, bus):
    stop = threading.Event()
    thread = threading.Thread(target=serve, args=(device, bus, stop))
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


class Sender:
    """Somebody who sends on a bus from a thread, until it is told to stop."""

    def __init__(self, bus) -> None:
        self._bus, self._stop = bus, threading.Event()
        self._thread = threading.Thread(target=self._play)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *error):
        self._stop.set()
        self._thread.join()


class Machine(Sender):
    """Drive and thermometer: they play a log in real time, and stand still before and after it."""

    def __init__(self, bus, log) -> None:
        super().__init__(bus)
        self._frames = list(PlayedDrive(log, DRIVE, RATED, warm_node=WARM).frames())
        self.index, self.at, self.warm, self.stands = 0, 0.0, True, True

    def _play(self) -> None:
        begin, cycle, first = time.monotonic(), 0, [frame for at, frame in self._frames if at < 0.4]
        resting = [frame for frame in first if frame.cob_id == 0x180 + DRIVE]
        while not self._stop.wait(max(begin + 0.02 * cycle - time.monotonic(), 0.0)):
            cycle += 1
            if self.warm and cycle % 25 == 1:
                self._bus.send(message_of(first[1]))
            if self.stands:
                self._bus.send(message_of(resting[cycle % 20]))
                continue
            while self.index < len(self._frames) and self._frames[self.index][0] <= self.at + 1e-9:
                if self._frames[self.index][1].cob_id == 0x180 + DRIVE:
                    self._bus.send(message_of(self._frames[self.index][1]))
                self.index += 1
            self.at += 0.02


class RealSensor(Sender):
    """A position sensor that sends 6004h in steps of 10 um every 10 ms, or nothing."""

    steps = 10000

    def _play(self) -> None:
        while not self._stop.wait(0.01):
            if self.steps is not None:
                self._bus.send(message_of(other_frame(self.steps)))


def test_a_life_as_a_controller_sees_it(buses, tmp_path, trace):
    """Boot, reference, work, temperature lost, wrong preset refused, drive lost, power cycle."""
    case = trace("boom_441kN_40C")
    log, truth = read_log(case.log).isel(time=slice(30, 250)), read_truth(case.truth)
    log = log.assign_coords(time=log["time"] - log["time"][0])
    (tmp_path / "map.toml").write_text(played_map(DRIVE, WARM, RATED, hold="1200 ms"))
    channel_map, state = load_map(tmp_path / "map.toml"), tmp_path / "boom.state"
    network = canopen.Network(buses.open())
    network.NOTIFIER_CYCLE = 0.05
    network.connect()
    node = network.add_node(NODE, str(EDS))
    node.sdo.RESPONSE_TIMEOUT = PATIENCE
    positions = []
    network.subscribe(0x180 + NODE, lambda _, data, at: positions.append((at, struct.unpack("<i", data)[0])))
    device, machine_bus, encoder_bus = encoder(state, channel_map), buses.open(), buses.open()
    try:
        with Machine(machine_bus, log) as machine, running(device, encoder_bus):
            wait_for(lambda: node.nmt.state == "PRE-OPERATIONAL")
            assert node.sdo["Device type"].raw & 0xFFFF == 406
            node.nmt.state = "OPERATIONAL"
            wait_for(lambda: positions and positions[-1][1] == FAULT)
            wait_for(lambda: node.sdo["Alarms"].raw == PE)
            node.sdo["Preset value"].raw = 10000
            wait_for(lambda: positions[-1][1] == 10000)

            machine.stands = False
            wait_for(lambda: machine.at >= 2.0)
            machine.stands = True
            moved = float(truth["position"].interp(time=machine.at + 0.6 - 0.02)) * 1e5
            wait_for(lambda: abs(positions[-1][1] - moved) < 300)

            machine.warm = False
            wait_for(lambda: node.sdo["Warnings"].raw & 1 << 14)
            assert any(emcy.code == 0x4200 for emcy in node.emcy.log)
            machine.warm = True
            wait_for(lambda: not node.sdo["Warnings"].raw & 1 << 14)

            with pytest.raises(SdoAbortedError) as refused:
                node.sdo["Preset value"].raw = 99999
            assert refused.value.code == 0x06090030
            wait_for(lambda: device._saving._rested == math.inf)  # at rest: the position is kept
        before = positions[-1][1]
        positions.clear()
        again = encoder(state, channel_map)
        with Machine(machine_bus, log) as machine, running(again, buses.open()):
            wait_for(lambda: node.nmt.state == "PRE-OPERATIONAL")
            node.nmt.state = "OPERATIONAL"
            wait_for(lambda: positions and positions[-1][1] != FAULT)
            assert abs(positions[-1][1] - before) <= 2
            with pytest.raises(SdoAbortedError) as refused:
                node.sdo["Preset value"].raw = 60000
            assert refused.value.code == 0x08000022
            machine.__exit__()
            wait_for(lambda: any(emcy.code == 0x8250 for emcy in node.emcy.log))
            wait_for(lambda: positions[-1][1] == FAULT)
    finally:
        network.disconnect()


def test_a_real_sensor_on_the_bus_is_held_against_it(buses, tmp_path, trace):
    """At rest: both agree; the real one leaps and comes back; it falls silent."""
    log = read_log(trace("boom_441kN_40C").log).isel(time=slice(30, 80))
    log = log.assign_coords(time=log["time"] - log["time"][0])
    (tmp_path / "map.toml").write_text(played_map(DRIVE, WARM, RATED) + OTHER_MAP)
    network = canopen.Network(buses.open())
    network.connect()
    node = network.add_node(NODE, str(EDS))
    node.sdo.RESPONSE_TIMEOUT = PATIENCE
    device = encoder(None, load_map(tmp_path / "map.toml"), overrides=overrides(False, None, 1e-3, 0.1))
    machine_bus, real_bus = buses.open(), buses.open()
    try:
        with Machine(machine_bus, log), RealSensor(real_bus) as real, running(device, buses.open()):
            wait_for(lambda: node.nmt.state == "PRE-OPERATIONAL")
            wait_for(lambda: node.sdo["Sensor status"].raw == Status.NOT_REFERENCED)
            wait_for(lambda: node.sdo["Verdict on both sensors"].raw == Verdict.UNCHECKED)
            node.sdo["Preset value"].raw = 10000
            node.nmt.state = "OPERATIONAL"
            wait_for(lambda: node.sdo["Verdict on both sensors"].raw == Verdict.AGREE)
            assert abs(node.sdo["Position by the real sensor"].raw - 10000) <= 1
            assert node.sdo["Tolerance of the real sensor"].raw == 1000
            assert (node.sdo["Alarms"].raw, node.sdo["Warnings"].raw & 1 << 2) == (0, 0)
            real.steps = 14000
            wait_for(lambda: node.sdo["Verdict on both sensors"].raw == Verdict.OTHER_WRONG)
            assert node.sdo["Warnings"].raw & 1 << 2
            assert node.sdo["Alarms"].raw == 0
            real.steps = 10000
            wait_for(lambda: node.sdo["Verdict on both sensors"].raw == Verdict.AGREE)
            real.steps = None
            wait_for(lambda: node.sdo["Position by the real sensor"].raw == FAULT)
            assert node.sdo["Verdict on both sensors"].raw == Verdict.OTHER_WRONG
            assert 0xFF06 in [emcy.code for emcy in node.emcy.log]
    finally:
        network.disconnect()


def test_frames_go_through_python_can_unchanged():
    for text in ("185#0102", "1FFFFFFF#"):
        wide = len(text.split("#")[0]) > 3
        message = can.Message(arbitration_id=int(text.split("#")[0], 16), is_extended_id=wide,
                              data=bytes.fromhex(text.split("#")[1]), timestamp=1.5)  # fmt: skip
        frame = frame_of(message)
        assert str(frame) == text
        assert frame.time == 1.5
        assert message_of(frame).equals(message, timestamp_delta=None)
    assert frame_of(can.Message(is_remote_frame=True)) is None
    assert frame_of(can.Message(is_error_frame=True)) is None


class Broken:
    """A bus that is off for a while."""

    def __init__(self, stop) -> None:
        self.calls, self._stop = 0, stop

    def recv(self, timeout):
        self.calls += 1
        if self.calls >= 3:
            self._stop.set()
        raise can.CanOperationError("bus off")

    def send(self, message):
        raise can.CanOperationError("bus off")


def test_a_bus_that_is_off_is_tried_again():
    stop = threading.Event()
    bus = Broken(stop)
    serve(encoder(), bus, stop)
    assert bus.calls == 3


@pytest.mark.slow
def test_the_verb_serves_a_bus_until_it_is_told_to_stop(tmp_path):
    eds = tmp_path / "boom.eds"
    verb = ["encoder", "mining-loader", "--unit", "boom", "--interface", "virtual", "--channel", "test",
            "--node-id", "6", "--drive-node", "5", "--rated-torque", "80 N m", "--timeout", "200 ms", "--hold",
            "--state", str(tmp_path / "boom.state"), "--eds", str(eds)]  # fmt: skip
    with subprocess.Popen([sys.executable, "-m", "ramsight", *verb], stdout=subprocess.PIPE, text=True) as process:
        said = [process.stdout.readline(), process.stdout.readline()]
        process.send_signal(signal.SIGTERM)
        said.append(process.stdout.read())
    assert process.returncode == 0
    assert said[0] == f"{eds}: written\n"
    assert said[1].startswith("test: node 6 is the position of boom")
    assert said[2].startswith("test: node 6 is gone; not referenced since power-up")
    assert eds.read_text() == EDS.read_text()


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--node-id", "200", "--drive-node", "5"], "200"),
        (["--node-id", "5", "--drive-node", "5"], "drive's"),
        (["--node-id", "6", "--drive-node", "5"], "rated torque"),
        (["--node-id", "6", "--drive-node", "5", "--rated-torque", "80 N m"], "cannot be opened"),
        (["--node-id", "6", "--drive-node", "5", "--rated-torque", "80 N m", "--timeout", "1 ms"], "10 ms"),
    ],
)
def test_the_verb_refuses_what_cannot_be(options, says):
    from typer.testing import CliRunner

    verb = ["encoder", "mining-loader", "--unit", "boom", "--interface", "nobus", "--channel", "x", *options]
    result = CliRunner().invoke(app, verb)
    assert isinstance(result.exception, RamsightError)
    assert says in str(result.exception)
