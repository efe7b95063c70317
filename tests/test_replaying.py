"""A recorded log on a bus: the frames of its drive, as far apart as they were recorded."""

import struct
import threading

import numpy as np
import pytest
import xarray

import can
from ramsight.deploy.encoder import Frame
from ramsight.deploy.encoder.listening import Listener
from ramsight.deploy.encoder.played_drive import PlayedDrive
from ramsight.deploy.encoder.runner import frame_of, replay
from ramsight.logs import write_log
from ramsight.logs.channel_map import load_map

from .command import at_once

RPM = np.pi / 30.0


class Clock:
    """Time that only goes on where somebody waits."""

    def __init__(self):
        self.now = 50.0

    def __call__(self):
        return self.now

    def wait(self, seconds):
        self.now += seconds
        return False

    def is_set(self):
        return False


class Bus:
    def __init__(self, clock, full=()):
        self.clock, self.sent, self._full = clock, [], full

    def send(self, message):
        if message.arbitration_id in self._full:
            raise can.CanError("full")
        self.sent.append((self.clock.now - 50.0, message.arbitration_id))


def frames(*times):
    return [(at, Frame(0x185 + k, b"\x00")) for k, at in enumerate(times)]


@pytest.mark.parametrize("speed", [1.0, 4.0, 0.5])
def test_frames_are_as_far_apart_as_they_were(speed):
    clock = Clock()
    bus, told = Bus(clock), []
    done = replay(frames(7.0, 7.0, 7.5, 9.0), bus, clock, speed=speed, clock=clock, advance=told.append)
    assert [at * speed for at, _ in bus.sent] == pytest.approx([0.0, 0.0, 0.5, 2.0])
    assert (done.frames, done.lost, done.lasted, sum(told)) == (4, 0, 2.0, 2.0)


def test_a_clock_that_is_set_back_holds_nothing_up():
    clock = Clock()
    bus = Bus(clock)
    replay(frames(100.0, 101.0, np.nan, 20.0, 20.5), bus, clock, clock=clock)
    assert [at for at, _ in bus.sent] == pytest.approx([0.0, 1.0, 1.0, 1.0, 1.5])


def test_a_frame_that_the_bus_does_not_take_is_counted_and_the_next_one_sent():
    clock = Clock()
    bus = Bus(clock, full=(0x186,))
    done = replay(frames(0.0, 0.1, 0.2), bus, clock, clock=clock)
    assert (done.frames, done.lost) == (2, 1)
    assert [number for _, number in bus.sent] == [0x185, 0x187]


def test_it_ends_when_it_is_told_to():
    stop = threading.Event()
    stop.set()
    clock = Clock()
    assert replay(frames(0.0, 0.1), Bus(clock), stop, clock=clock).frames == 0


def log_of(speed, torque, warmth):
    data = {"motor_speed": np.array(speed) * RPM, "motor_torque": torque, "oil_temperature": np.array(warmth) + 273.15}
    time = 0.02 * np.arange(len(speed))
    return xarray.Dataset({name: ("time", np.asarray(v, float)) for name, v in data.items()}, coords={"time": time})


def test_what_a_log_lacks_is_not_sent_and_what_a_frame_cannot_hold_is_at_its_end():
    log = log_of([100, np.nan, 300, 400], [1.0, 2.0, np.nan, 1e4], [np.nan, 40, 40, 40])
    sent = [(at, frame) for at, frame in PlayedDrive(log, 5, 80.0, 7).frames() if frame.cob_id != 0x705]
    assert [at for at, _ in sent] == pytest.approx([0.0, 0.06])
    assert struct.unpack("<ih", sent[1][1].data) == (400, 0x7FFF)


def test_the_verb_sends_what_a_listener_with_its_map_reads_again(tmp_path):
    speed, torque = np.arange(60) * 20, np.linspace(-40.0, 70.0, 60)
    write_log(log_of(speed, torque, np.full(60, 41.5)), tmp_path / "log.csv")
    with can.Bus(interface="virtual", channel="replayed") as ear:
        done = at_once(
            "logs", "replay", "log.csv", "--interface", "virtual", "--channel", "replayed", "--rated-torque", "80 N m",
            "--speed", "50", "--map-out", "drive.toml", cwd=tmp_path,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        heard = [frame_of(message) for message in iter(lambda: ear.recv(0.0), None)]
    assert "replayed: node 5 is gone; 74 frames sent of 1.2 s" in done.stdout
    assert len(heard) == 74
    listener, samples = Listener(load_map(tmp_path / "drive.toml")), []
    for frame in heard:
        if frame.cob_id in listener.identifiers:
            listener.take(frame, 0.0, 0.0)
            samples += [one] if (one := listener.sample(0.0)) is not None else []
    np.testing.assert_allclose([one.motor_speed for one in samples], speed * RPM)
    np.testing.assert_allclose([one.motor_torque for one in samples], torque, atol=0.04)
    assert samples[-1].oil_temperature == pytest.approx(314.65)


def test_one_node_cannot_be_two(tmp_path):
    write_log(log_of([0, 0], [0.0, 0.0], [40, 40]), tmp_path / "log.csv")
    done = at_once(
        "logs", "replay", "log.csv", "--interface", "virtual", "--channel", "x", "--rated-torque", "80 N m",
        "--thermometer-node", "5", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stderr == "error: --thermometer-node = 5: is the drive's (allowed: another one)\n"
