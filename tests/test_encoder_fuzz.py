"""Whatever comes: the encoder goes on, and its position goes no faster than a piston can."""

import math
import struct
from itertools import pairwise

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ramsight.deploy.encoder import Frame
from ramsight.deploy.encoder.frame import EXTENDED

from .encoder_bus import DRIVE, FAULT, NODE, WARM, Master, boom, encoder, sample

pytestmark = pytest.mark.slow

IDENTIFIERS = (
    0x180 + DRIVE, 0x180 + DRIVE, 0x180 + DRIVE, 0x600 + NODE, 0x600 + NODE, 0x000, 0x080, 0x700 + DRIVE,
    0x180 + WARM, 0x186, 0x586, 0x7FF, EXTENDED | 0x185, EXTENDED | 0x1FFFFFFF,
)  # fmt: skip
FRAMES = 250
FRAME = 12  # bytes of chance for each
STEP = 1e-5  # m
TIMEOUT = 0.1  # s


def frames_of(chance: bytes, begin: float):
    """Frames with times from chance: in bursts, late, out of order, with clocks that jump."""
    now = begin
    for k in range(0, len(chance) - FRAME + 1, FRAME):
        which, length, when, odd, *data = chance[k : k + FRAME]
        now += (0.0, 1e-4, 1e-3, 0.02)[when & 3]
        stamp = now
        if odd > 240:
            stamp = (now + 3600.0, now - 3600.0, math.nan, math.inf, -1e300, 0.0)[odd % 6]
        elif odd > 200:
            stamp = now - 0.001 * (odd - 200)
        yield now, Frame(IDENTIFIERS[which % len(IDENTIFIERS)], bytes(data[: min(length % 10, 8)]), stamp)


def position_of(data: bytes) -> float | None:
    (steps,) = struct.unpack_from("<i", data)
    return None if steps == FAULT else steps * STEP


@settings(max_examples=10, suppress_health_check=list(HealthCheck))
@given(st.binary(min_size=FRAMES * FRAME, max_size=FRAMES * FRAME))
def test_frames_of_chance_neither_stop_it_nor_make_it_jump(chance):
    bus = Master(encoder())
    bus.node.sdo[0x2100].raw = 400
    bus.rest(0.1)
    bus.node.sdo[0x6003].raw = 20000
    bus.node.nmt.state = "OPERATIONAL"
    begin = bus.now
    for at, frame in frames_of(chance, begin):
        bus.put(at, frame)
    sent = [(at, position_of(data)) for at, data in bus.sent(0x186, since=begin) if len(data) == 4]
    fastest = 1.1 * boom().max_velocity
    for (t0, p0), (t1, p1) in pairwise(sent):
        if p0 is not None and p1 is not None:
            # what the piston may have gone since the last sample comes with the next one, so the timeout is the slack
            assert abs(p1 - p0) <= fastest * (t1 - t0 + TIMEOUT) + 2 * STEP
    assert_lives(bus)


@settings(max_examples=8, suppress_health_check=list(HealthCheck))
@given(st.binary(min_size=FRAMES * FRAME, max_size=FRAMES * FRAME))
def test_frames_of_others_do_not_move_it(chance):
    """Only what the drive itself reports does, and a frame of chance with its identifier is such a report."""
    bus = Master(encoder())
    bus.node.sdo[0x2100].raw = 400
    bus.rest(0.1, torque=2.0)
    bus.node.sdo[0x6003].raw = 20000
    bus.node.nmt.state = "OPERATIONAL"
    stood = bus.now
    for at, frame in frames_of(chance, bus.now):
        while stood + 0.02 <= at:
            stood += 0.02
            bus.put(stood, sample(0, 2.0 + 0.1 * (round(50 * stood) % 3)))
        if frame.cob_id != 0x180 + DRIVE and not writes(frame, 0x6003, 0x2003):
            bus.put(max(at, bus.now), frame)
        assert abs(bus.device.position - 0.2) < 0.1e-3
    assert_lives(bus)


def writes(frame: Frame, *objects: int) -> bool:
    """Whether a frame may set the position, or forget it."""
    return frame.cob_id == 0x600 + NODE and any(one.to_bytes(2, "little") in frame.data for one in objects)


@settings(max_examples=8, suppress_health_check=list(HealthCheck))
@given(
    st.lists(st.tuples(st.integers(-32768, 32767), st.floats(-2.0, 2.0), st.integers(0, 30)), min_size=60, max_size=60)
)
def test_a_drive_that_talks_nonsense_moves_it_no_faster_than_the_piston(samples):
    bus = Master(encoder())
    bus.node.nmt.state = "OPERATIONAL"
    bus.node.sdo[0x2100].raw = 400
    bus.rest(0.1)
    bus.node.sdo[0x6003].raw = 35000
    at, place, valid = bus.now, 0.35, True
    fastest = 1.1 * boom().max_velocity
    for rpm, torque, late in samples:
        bus.put(bus.now + 0.001 * (1 + late), sample(rpm, 800.0 * torque))
        if bus.device.valid and valid:
            assert abs(bus.device.position - place) <= fastest * (bus.now - at) + 1e-9
        at, place, valid = bus.now, bus.device.position, bus.device.valid
    assert_lives(bus)


def assert_lives(bus: Master) -> None:
    """It still does what it is there for."""
    bus.send_message(0x600 + NODE, bytes.fromhex("8000000000000000"))  # whatever transfer was begun is over
    bus.send_message(0, bytes([1, NODE]))
    bus.node.sdo.responses.queue.clear()
    assert bus.node.sdo[0x1000].raw == 0x00080196
    if bus.node.sdo[0x1800][1].raw >> 31 == 0 and bus.node.sdo[0x6200].raw:
        since = bus.now
        bus.pass_time(since + 1.0)
        assert bus.sent(bus.node.sdo[0x1800][1].raw & 0x7FF, since=since) or bus.node.sdo[0x1800][2].raw < 254


def test_a_flood_between_two_cycles_delays_no_pdo():
    bus = Master(encoder())
    bus.node.nmt.state = "OPERATIONAL"
    begin = bus.now
    for k in range(10_000):
        bus.put(begin + 1e-4 * k, sample(0, 20.0 + 0.5 * (k % 3)))
    times = [at for at, _ in bus.sent(0x186, since=begin + 1e-6)]
    assert len(times) in (99, 100)
    assert max(abs((at - begin) / 0.01 - round((at - begin) / 0.01)) for at in times) < 1e-6
