"""A drive whose frames freeze, are zero or late: told within 0.2 s by what the map names; a healthy one never is."""

import math
from pathlib import Path

import numpy as np
import pytest

from ramsight.deploy.encoder import Frame, Settings, encoder_for
from ramsight.deploy.encoder.alarms import Fault
from ramsight.deploy.encoder.listening import witnesses
from ramsight.deploy.encoder.liveness import LATE, RESTARTS, Counted, Liveness, Report
from ramsight.errors import DescriptionError
from ramsight.logs.mapped import Sequence

from .command import at_once
from .encoder_bus import DRIVE, NODE, Master, boom, bus_map

ENABLED, SWITCHED_ON, PERIOD = 0x0637, 0x0633, 0.02
NOISY = ', noise = "0.5 N m"'
NUMBERED = '[sequence]\nchannel = "2001h"\n'
STATED = '[state]\nchannel = "6041h"\n'


def lateness(numbers, modulus=256, period=PERIOD, gap=(), jitter=0.0, of_sync=False):
    """By how many frames each is late, in times of whole periods; a gap is (index, seconds)."""
    rng, counted, at, late = np.random.default_rng(1), Counted(Sequence("n", modulus, of_sync)), 0.0, []
    for k, number in enumerate(numbers):
        at += PERIOD + sum(after for index, after in gap if index == k)
        counted.take(at + rng.uniform(0.0, jitter), float(number % modulus), period)
        late.append(counted.late)
    return counted, late


COUNTING = [(5000, {"modulus": m, "jitter": j}) for m in (2, 16, 256) for j in (0.0, 0.015)]


@pytest.mark.parametrize(("count", "how"), [*COUNTING, *((20000, {"period": f * PERIOD}) for f in (0.995, 1.005))])
def test_a_drive_that_counts_is_in_time_and_its_period_may_be_off(count, how):
    _, late = lateness(range(count), **how)
    assert max(late) < LATE


def test_frames_that_were_lost_are_not_late():
    _, late = lateness([*range(100), *range(150, 300)], gap=[(100, 50 * PERIOD)])
    assert max(late) < LATE


@pytest.mark.parametrize("slept", [0.06, 0.5, 2.0, 60.0])
@pytest.mark.parametrize("modulus", [16, 256])
def test_a_number_that_leaps_says_that_time_has_passed_while_the_clock_stood(slept, modulus):
    """As in a virtual machine that was restored: neither its clock nor the bus's time stamps know of it."""
    counted, _ = lateness(range(200), modulus)
    assert not counted.leapt
    number = 200 + round(slept / PERIOD)
    counted.take(200 * PERIOD, float(number % modulus), PERIOD)
    leap = round(slept / PERIOD) % modulus
    assert counted.leapt == (2 <= leap < modulus / 2), leap
    assert counted.leapt or counted.late >= LATE or leap < 2
    counted.take(201 * PERIOD, float((number + 1) % modulus), PERIOD)
    assert not counted.leapt


@pytest.mark.parametrize("modulus", [2, 8])
def test_a_number_that_soon_begins_anew_does_not_leap(modulus):
    counted, _ = lateness(range(200), modulus)
    counted.take(200 * PERIOD, float(203 % modulus), PERIOD)
    assert not counted.leapt


def test_a_leap_makes_the_encoder_forget_its_position(tmp_path):
    bus = ready(tmp_path, further=NUMBERED)
    follow(bus, range(30, 60))
    assert bus.device.valid
    follow(bus, range(160, 161))
    assert not bus.device.valid
    assert Fault.NOT_REFERENCED in bus.device.faults


def test_frames_that_waited_are_late_until_they_are_in_time_again():
    counted, late = lateness(range(200), gap=[(100, 10 * PERIOD), *((k, -0.9 * PERIOD) for k in range(101, 113))])
    assert late[100] == pytest.approx(10.0, abs=0.2)
    assert late[120] < LATE
    assert not counted.are_late


def test_a_drive_that_is_late_stays_so_until_it_was_silent():
    counted, late = lateness(range(10000), gap=[(100, 0.5)])
    assert late[100] == pytest.approx(25.0, abs=0.3)
    assert late[-1] > 20.0
    counted.take(1e4, 7.0, PERIOD)
    assert counted.late == 0.0, f"after more than {RESTARTS} s"


def test_one_number_twice_is_a_repeated_frame_and_three_times_a_frozen_one():
    counted, _ = lateness([0, 1, 2, 2], period=math.nan)
    assert not counted.are_late
    counted.take(1.0, 2.0, math.nan)
    assert counted.are_late
    counted.take(1.02, 3.0, math.nan)
    assert not counted.are_late


def test_a_number_of_sync_is_compared_with_the_bus():
    counted = Counted(Sequence("n", 240, of_sync=True))
    counted.take(0.0, 5.0, PERIOD)
    assert counted.late == 0.0, "no SYNC with a counter has come"
    for newest, number, late in ((7, 7, 0), (8, 7, 1), (1, 239, 2), (2, 239, 3)):
        counted.synced(newest)
        counted.take(0.0, float(number), PERIOD)
        assert (counted.late, counted.are_late) == (late, late >= LATE)


def test_the_age_grows_with_repeats_and_ends_with_a_new_torque():
    alive = Liveness(300.0, None, noise=0.5, step=0.08)
    ages = []
    for k, torque in enumerate((20.0, 20.0, 20.0, 20.0, 20.08)):
        alive.take(Report(PERIOD * k, 0.0, torque), PERIOD)
        ages.append(round(alive.age, 6))
    assert ages == [0.0, 0.0, 0.04, 0.06, 0.0]


def test_noise_that_is_rounded_away_tells_nothing():
    alive = Liveness(300.0, None, noise=0.01, step=0.08)
    assert not any(alive.take(Report(PERIOD * k, 0.0, 20.0), PERIOD) for k in range(10000))


def test_a_torque_with_its_noise_is_alive_for_hours():
    rng = np.random.default_rng(3)
    alive = Liveness(300.0, None, noise=0.5, step=0.08)
    torques = 0.08 * np.round((20.0 + rng.normal(0.0, 0.5, 200_000)) / 0.08)
    assert not any(alive.take(Report(PERIOD * k, 0.0, float(one)), PERIOD) for k, one in enumerate(torques))


def stale_at(alive, reports):
    """The first of some reports (speed, torque) at which it is stale; None if at none."""
    for k, (speed, torque) in enumerate(reports):
        alive.take(Report(PERIOD * k, speed, torque), PERIOD)
        if alive.is_stale:
            return k
    return None


@pytest.mark.parametrize("speed", [100.0, 0.0])
def test_a_report_that_had_changed_and_stands_is_found_where_no_noise_is_declared(speed):
    rng = np.random.default_rng(4)
    torques = (0.08 * np.round(rng.normal(20.0, 0.5, 400) / 0.08)).tolist()
    alive = Liveness(300.0, None, noise=0.0, step=0.08)
    frozen = stale_at(alive, [(speed, one) for one in [*torques, *[torques[-1]] * 30]])
    assert 400 + 6 <= frozen <= 400 + 18
    assert not alive.is_new()
    alive.take(Report(10.0, speed, 1.0), PERIOD)
    assert not alive.is_stale


@pytest.mark.parametrize("every", [2, 5, 20])
def test_a_drive_whose_reports_repeat_by_habit_is_alive(every):
    rng = np.random.default_rng(5)
    torques = np.repeat(rng.normal(20.0, 0.5, 5000), every)[:5000]
    assert stale_at(Liveness(300.0, None, 0.0, 0.08), [(100.0, float(one)) for one in torques]) is None


def test_few_reports_teach_nothing_about_repeats():
    assert stale_at(Liveness(300.0, None, 0.0, 0.08), [(100.0, 20.0), (101.0, 21.0), *[(101.0, 21.0)] * 500]) is None


def test_a_speed_that_steps_without_a_torque_makes_the_position_unknown():
    alive = Liveness(300.0, None, noise=0.0, step=0.08, inertia=0.01)
    seen = [(100.0, 20.0), (100.0, 20.1), (-100.0, 20.2), (-100.0, 20.3), (-100.0, 20.4)]
    found = [alive.take(Report(PERIOD * k, *one), PERIOD) for k, one in enumerate(seen)]
    assert found == [False, False, False, True, False]


@pytest.mark.parametrize(
    ("speed", "torque", "zeros", "stale"),
    [(100.0, 20.0, 2, True), (100.0, 20.0, 1, False), (20.0, 20.0, 5, False), (0.0, 20.0, 5, False)],
)
def test_zeros_right_after_fast_motion_are_no_reports(speed, torque, zeros, stale):
    alive = Liveness(300.0, None, 0.0, 0.08)
    assert (stale_at(alive, [(speed, torque)] * 3 + [(0.0, 0.0)] * zeros) is not None) == stale
    assert stale_at(alive, [(speed, torque)]) is None


# ---- the encoder


def map_of(folder, noise="", further="", objects=("606Ch", "6077h"), more=()):
    return bus_map(
        folder, (0x180 + DRIVE, *objects), *more, torque=f'channel = "6077h", rated = "80 N m"{noise}', more=further
    )


def ready(folder, noise="", further="", objects=("606Ch", "6077h", "2001h UINT8")):
    """An encoder that knows its position, and the number of the next frame."""
    settings = Settings(NODE, DRIVE, overrides={(0x2004, 0): 200})
    bus = Master(encoder_for(boom(), map_of(folder, noise, further, objects), settings))
    bus.node.nmt.state = "OPERATIONAL"
    follow(bus, range(10))
    bus.node.sdo[0x6003].raw = 10000
    follow(bus, range(10, 30))
    assert bus.alarms == 0
    return bus


def put(bus, last, rpm=0, torque=20.0, after=PERIOD):
    share = round(1e3 * torque / 80.0)
    data = rpm.to_bytes(4, "little", signed=True) + share.to_bytes(2, "little", signed=True)
    bus.put(bus.now + after, Frame(0x180 + DRIVE, data + last.to_bytes(2, "little")))


def follow(bus, numbers, rpm=0, state=None):
    """Reports with noise, numbered or with a state word."""
    rng = np.random.default_rng(4)
    for k in numbers:
        put(bus, k % 256 if state is None else state, rpm, 20.0 + rng.normal(0.0, 0.5))


def told(bus, fault, *args, **options):
    """After how many seconds of such frames a fault is there."""
    begin = bus.now
    while fault not in bus.device.faults and bus.now - begin < 1.0:
        put(bus, *args, **options)
    return bus.now - begin


def test_a_torque_that_repeats_is_told_and_the_position_forgotten(tmp_path):
    bus = ready(tmp_path, NOISY)
    std = bus.device.std
    put(bus, 0, 300, 21.0)
    for _ in range(3):
        put(bus, 0, 300, 21.0)
    assert bus.device.std > std + 2e-4, "the reports may be old"
    assert told(bus, Fault.STALE, 0, 300, 21.0) <= 0.2
    assert not bus.device.valid
    assert 0xFF09 in bus.emergencies()
    follow(bus, range(20))
    assert Fault.STALE not in bus.device.faults
    assert Fault.NOT_REFERENCED in bus.device.faults


def test_a_frozen_number_is_told_and_the_position_kept(tmp_path):
    bus = ready(tmp_path, further=NUMBERED)
    assert told(bus, Fault.STALE, 29, 300) <= 0.06
    assert not bus.device.valid
    with pytest.raises(Exception, match="0x08000022"):
        bus.node.sdo[0x6003].raw = 10000
    follow(bus, range(33, 50))
    assert bus.device.valid, "nothing old has been used"


def test_half_a_second_late_is_told_at_once(tmp_path):
    bus = ready(tmp_path, further=NUMBERED)
    put(bus, 30, 300, after=0.5)
    assert Fault.STALE in bus.device.faults
    follow(bus, range(31, 80), rpm=300)
    assert not bus.device.valid, "as long as it is late"


def test_a_drive_that_is_not_enabled_has_no_torque(tmp_path):
    stated = map_of(tmp_path, further=STATED, objects=("606Ch", "6077h", "6041h"))
    bus = Master(encoder_for(boom(), stated, Settings(NODE, DRIVE)))
    bus.node.nmt.state = "OPERATIONAL"
    follow(bus, range(10), state=ENABLED)
    bus.node.sdo[0x6003].raw = 10000
    follow(bus, range(20), state=ENABLED)
    assert bus.alarms == 0
    follow(bus, range(10), state=SWITCHED_ON)
    assert Fault.DISABLED in bus.device.faults
    assert not bus.device.valid
    follow(bus, range(5), state=ENABLED)
    assert bus.device.valid, "it rested"
    follow(bus, range(10), rpm=300, state=ENABLED)
    here = bus.device.position
    follow(bus, range(20), rpm=300, state=SWITCHED_ON)
    assert bus.device.position == here, "what it says is not used"
    follow(bus, range(2), rpm=300, state=ENABLED)
    assert Fault.NOT_REFERENCED in bus.device.faults, "the motor turned meanwhile"


@pytest.mark.parametrize(("state", "gone"), [(5, False), (0x85, False), (127, True), (4, True), (0, True)])
def test_a_heartbeat_tells_the_drives_state_where_it_is_watched(tmp_path, state, gone):
    bus = ready(tmp_path, NOISY)
    bus.put(bus.now, Frame(0x700 + DRIVE, bytes([state])))
    assert Fault.DRIVE_GONE not in bus.device.faults, "nobody watches it"
    with bus.configuring():
        bus.node.sdo[0x1016][1].raw = DRIVE << 16 | 500
    bus.put(bus.now, Frame(0x700 + DRIVE, bytes([state])))
    assert (Fault.DRIVE_GONE in bus.device.faults) is gone
    assert bus.device.valid is not gone
    bus.put(bus.now, Frame(0x700 + DRIVE, b"\x05"))
    assert Fault.DRIVE_GONE not in bus.device.faults


# ---- the map


@pytest.mark.parametrize(
    ("further", "said"),
    [
        ('[sequence]\nmodulus = 4\n', "sequence.channel"),
        ('[sequence]\nchannel = "2001h"\nmodulus = 1\n', "2 is a toggle bit"),
        ('[sequence]\nchannel = "2001h"\ncounts = "frame"\n', "frames, sync"),
        ("[state]\n", "state.channel"),
        ('[state]\nchannel = "6041h"\nbits = 3\n', "not a key"),
    ],
)  # fmt: skip
def test_a_map_that_cannot_be_is_refused(tmp_path, further, said):
    with pytest.raises(DescriptionError, match=said):
        map_of(tmp_path, further=further)


def test_a_number_of_another_frame_is_refused(tmp_path):
    with pytest.raises(DescriptionError, match="in another frame than the torque"):
        witnesses(map_of(tmp_path, further=NUMBERED, more=[(0x280 + DRIVE, "2001h UINT8")]))


def test_check_says_what_a_bus_lacks(tmp_path):
    map_of(tmp_path, NOISY, NUMBERED + STATED, ("606Ch", "6077h", "2001h UINT8", "6041h UINT8"))
    done = at_once("check", "mining-loader", "--unit", "boom", "--map", tmp_path / "map.toml")
    shown = done.stdout.partition("what tells that the drive's data are alive\n")[2]
    assert [line.split()[:2] for line in shown.splitlines() if not line.startswith(" ")] == [
        ["sequence", "yes"], ["noise", "yes"], ["state", "yes"], ["heartbeat", "no"]
    ]  # fmt: skip
    assert "7 equal torques in a row" in shown
    little = witnesses(map_of(tmp_path, ', noise = "0.01 N m"'))
    assert [there for _, there, _ in little] == [False] * 4
    assert "too little to be seen" in little[1][2]


def test_a_drive_that_turned_while_disabled_is_not_believed_before_it_is_enabled():
    alive, enabled, off = Liveness(300.0, None, 0.0, 0.1), 0x27, 0x21
    seen = [(0.0, enabled), (0.0, off), (50.0, off), (0.0, off), (0.0, enabled)]
    new = []
    for k, (speed, state) in enumerate(seen):
        alive.take(Report(PERIOD * k, speed, 20.0, state=float(state)), PERIOD)
        new.append(alive.is_new())
    assert new == [True, True, False, False, True]


def test_every_kind_of_a_drive_that_misbehaves_changes_what_is_sent(monkeypatch, script):
    """`make fuzz` sends them to a whole encoder; kinds that change nothing would be counted as true."""
    kinds = script("drive_kinds", "fuzz")
    rng, begin = np.random.default_rng(68), 8.01
    frames = [(PERIOD * k, 1100 + k % 7, 240 + k % 11) for k in range(900)]
    drive = kinds.Prepared(judge=None, frames=frames, channel_map=Path("drive.toml"), tells=True)
    names = list(kinds.KINDS)
    monkeypatch.setitem(kinds.KINDS, "healthy", lambda sent, *_: sent)

    def packed(name):
        return [(one.at, one.packed, one.cob_id) for one in kinds.sent(drive, name, begin, rng)]

    healthy = packed("healthy")
    assert len(names) == 39
    for name in names:
        found = packed(name)
        assert found != healthy, name
        assert found[:400] == healthy[:400], f"{name}: nothing is wrong before"
    assert set(names) > kinds.LIMITS
