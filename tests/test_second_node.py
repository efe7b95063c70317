"""Another node with the drive's identifier: told within 0.2 s, and a drive alone never is one."""

import math

import numpy as np
import pytest

from ramsight.deploy.encoder import Frame
from ramsight.deploy.encoder.alarms import Fault
from ramsight.deploy.encoder.second_node import EXTRA, LEARNED, Arrivals, Reports, SecondNode

from .encoder_bus import DRIVE, NODE, Master, encoder, sample
from .test_encoder import write

FASTEST = 300.0  # rad/s
RPM = math.pi / 30.0


def alarms(frames, period=0.0):
    """When a second node begins to be there, in frames of time and speed [s, rad/s]."""
    second, found = SecondNode([1], FASTEST), []
    for at, speed in frames:
        second.check(at)
        if second.take(1, at, speed, period=period):
            found.append(at)
    return found


def drive(seconds, period=0.02, speed=lambda at: 0.0, jitter=0.0, seed=1, noise=0.2):
    rng = np.random.default_rng(seed)
    count = round(seconds / period)
    times = np.arange(count) * period + rng.uniform(0.0, jitter, count)
    return [(float(at), speed(float(at)) + float(rng.normal(0.0, noise))) for at in np.sort(times)]


def moves(at):
    """Up, rest, down, rest: two seconds each, ramps of 0.3 s."""
    phase = at % 8.0
    ramp = min(phase / 0.3, 1.0, max((2.0 - phase) / 0.3, 0.0))
    back = min(max((phase - 4.0) / 0.3, 0.0), 1.0, max((6.0 - phase) / 0.3, 0.0))
    return 250.0 * (ramp - back)


def both(one, other):
    return sorted([*one, *other])


@pytest.mark.parametrize("period", [0.0, 0.02])
@pytest.mark.parametrize("jitter", [0.0, 0.004, 0.012])
def test_a_drive_alone_is_no_second_node(period, jitter):
    for seed in range(5):
        assert alarms(drive(60.0, speed=moves, jitter=jitter, seed=seed), period) == []


@pytest.mark.parametrize("faster", [0.995, 0.9999, 1.0001, 1.005])
def test_the_clock_of_a_drive_may_be_off(faster):
    assert alarms(drive(600.0, period=0.02 * faster, speed=moves), 0.02) == []


@pytest.mark.parametrize("gap", [0.05, 0.3, 0.8])
@pytest.mark.parametrize("period", [0.0, 0.02])
def test_frames_that_waited_may_come_at_once(gap, period):
    frames = drive(40.0, speed=moves, jitter=0.002)
    late = [(max(at, begin + gap) if begin <= at < begin + gap else at, speed)
            for at, speed in frames for begin in [3.0 * math.floor(at / 3.0) + 1.0]]  # fmt: skip
    assert alarms(sorted(late), period) == []


def test_a_drive_that_sends_less_at_rest_is_no_second_node():
    """Transmission type 255: every 100 ms at rest, every 10 ms while the speed changes or turns."""
    frames = [(at, speed) for at, speed in drive(60.0, period=0.01, speed=moves)
              if abs(moves(at)) > 1.0 or round(at / 0.01) % 10 == 0]  # fmt: skip
    assert alarms(frames) == []


@pytest.mark.parametrize("begins", [4.7, 8.9, 14.3])
@pytest.mark.parametrize("period", [0.0, 0.02])
@pytest.mark.parametrize("own", [0.001, 0.005, 0.02, 0.021, 0.025])
@pytest.mark.parametrize("lie", [300.0 * RPM, -300.0 * RPM, 100.0 * RPM, 900.0 * RPM])
def test_two_nodes_are_told_within_a_fifth_of_a_second(begins, period, own, lie):
    honest = drive(begins + 2.0, speed=moves, jitter=0.002)
    other = [(begins + at, moves(begins + at) + lie) for at, _ in drive(2.0, period=own, jitter=0.0005, seed=2)]
    found = alarms(both(honest, other), period)
    assert len(found) == 1
    assert begins <= found[0] <= begins + 0.2


def test_one_that_sends_from_the_beginning_is_told_by_its_values_or_by_a_declared_period():
    honest = drive(4.0, speed=moves)
    other = [(0.0007 + at, moves(at) + 31.4) for at, _ in drive(4.0, period=0.001)]
    assert alarms(both(honest, other))[0] < 0.2
    late = [(0.01 + at, moves(at) + 3.0) for at, _ in drive(4.0)]
    assert alarms(both(honest, late), 0.02)[0] < 0.2


def test_frames_are_extra_from_a_count_on():
    arrivals = Arrivals(1.0)
    for k in range(10):
        arrivals.take(float(k), True)
    assert not arrivals.are_many
    arrivals.take(9.0, True)
    assert not arrivals.are_many, f"one is below {EXTRA}"
    arrivals.take(9.0, True)
    assert arrivals.are_many


def test_a_period_is_learned_of_even_intervals_alone():
    even, uneven = Arrivals(), Arrivals()
    for k in range(LEARNED):
        even.take(0.02 * k, False)
        uneven.take(0.02 * k + 0.013 * (k % 2), False)
    assert math.isnan(even.period), f"{LEARNED - 1} intervals"
    for k in range(LEARNED, 3 * LEARNED):
        even.take(0.02 * k, False)
        uneven.take(0.02 * k + 0.013 * (k % 2), False)
    assert even.period == pytest.approx(0.02)
    assert not even.is_sure, "the motor did not turn"
    assert math.isnan(uneven.period)


def test_a_jump_that_no_motor_makes_counts_and_three_are_too_many():
    reports = Reports(FASTEST)
    for k in range(100):
        assert not reports.take(0.001 * k, 0.0)
    highest = FASTEST * (0.001 / 0.02 + 0.02)
    assert not any(reports.take(0.1 + 0.001 * k, 0.99 * highest * (k % 2)) for k in range(20))
    jumps = [reports.take(0.12 + 0.001 * k, 1.01 * highest * ((k + 1) % 2)) for k in range(5)]
    assert jumps == [False, False, False, True, False], "the third"


# ---- the encoder


def ready(tmp_path):
    bus = Master(encoder(tmp_path / "boom.state"))
    bus.node.nmt.state = "OPERATIONAL"
    bus.node.sdo[0x2100].raw = 400
    bus.rest(0.2)
    write(bus, 0x6003, 10000)
    bus.rest(1.2)
    assert bus.alarms == 0
    return bus


def test_the_encoder_is_not_valid_and_forgets_where_it_is(tmp_path):
    bus = ready(tmp_path)
    begin = bus.now
    events = [(begin + 0.02 * k, sample(0, 20.0)) for k in range(1, 21)]
    events += [(begin + 0.001 * k + 0.0003, sample(300, 20.0)) for k in range(1, 400)]
    told = math.inf
    for at, frame in sorted(events, key=lambda one: one[0]):
        bus.put(at, frame)
        if Fault.SECOND_NODE in bus.device.faults:
            told = min(told, at - begin)
    assert told < 0.2
    assert not bus.device.valid
    assert 0xFF08 in bus.emergencies()
    assert "another node with the drive's identifier" in bus.device.said
    assert Fault.DRIVE_SILENT not in bus.device.faults
    with pytest.raises(Exception, match="0x08000022"):
        write(bus, 0x6003, 10000)
    bus.rest(3.0)
    assert Fault.SECOND_NODE not in bus.device.faults
    assert Fault.NOT_REFERENCED in bus.device.faults, "what it said may have moved the position"
    again = Master(encoder(tmp_path / "boom.state"))
    assert not again.device.valid, "the file has forgotten, too"
    again.node.nmt.state = "OPERATIONAL"
    again.node.sdo[0x2100].raw = 400
    again.rest(0.5)
    write(again, 0x6003, 20000)
    again.rest(0.2)
    assert (again.alarms, again.position) == (0, 20000)


def test_frames_too_short_or_of_others_count_and_do_not_count(tmp_path):
    bus = ready(tmp_path)
    begin = bus.now
    for k in range(1, 100):
        bus.put(begin + 0.02 * k, sample(0, 20.0 + 0.1 * (k % 7)))
        bus.put(begin + 0.02 * k + 0.007, Frame(0x180 + NODE + 3, bytes(8)))
    assert Fault.SECOND_NODE not in bus.device.faults
    bus.device._node.set(0x2004, 0, 200)
    begin = bus.now
    for k in range(1, 10):
        bus.put(begin + 0.02 * k, sample(0, 20.0 + 0.1 * (k % 7)))
        bus.put(begin + 0.02 * k + 0.007, Frame(0x180 + DRIVE, bytes(2)))
    assert Fault.SECOND_NODE in bus.device.faults


@pytest.mark.parametrize("gap", [5.0, 60.0, 600.0])
def test_a_second_node_is_told_soon_after_a_long_gap_too(gap):
    """What a gap forgives is a burst, not minutes of a second node's frames."""
    alone, after = (
        drive(40.0, jitter=0.002),
        [(at + 40.0 + gap, speed) for at, speed in drive(40.0, jitter=0.002, seed=2)],
    )
    lies = [(at + 0.007, 300.0 * RPM) for at, _ in after]
    (first, *_) = alarms(sorted(alone + after + lies), 0.02)
    assert first - (40.0 + gap) < 0.5
