"""Weighings: the force balance, windows, scales, what makes a weighing bad, totals, and the verb."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import ramsight
from ramsight import machine
from ramsight.duty.linked_duty import simulate_linked, unit_run
from ramsight.duty.loading import lifting
from ramsight.duty.profile import Profile
from ramsight.logs import write_log
from ramsight.plant.linkage import angles, holding_forces, joints
from ramsight.plant.linked import build_linked
from ramsight.signals import Signal, Signals
from ramsight.tool.force_balance import balance
from ramsight.tool.force_scale import described_scale
from ramsight.tool.unit_tracks import Others
from ramsight.tool.weigher import lifts
from ramsight.tool.weighing_events import Plain, Quality, Scene
from ramsight.tool.weighing_limits import EMPTY_SHARE, SHORTEST
from ramsight.tool.weighing_tally import Tally, weighed

from .command import at_once

LINKED = build_linked(machine.load_machine("mining-loader"))
LOADER = LINKED.mechanism
STROKE = LINKED.unit("boom").cylinder.stroke
LEVEL = {"bucket": "250 mm"}
MASSES = (0.0, 2000.0, 7000.0)


def log_of(duty):
    run = simulate_linked(LINKED, duty)
    return ramsight.drive_report(unit_run(run, "boom"))


@pytest.fixture(scope="module")
def shift():
    return log_of(lifting(LINKED, MASSES))


@pytest.fixture(scope="module")
def found(shift):
    return ramsight.weigh("mining-loader", shift, start="70 mm", at=LEVEL)


# The force balance


@pytest.mark.parametrize("payload", [0.0, 5000.0])
@pytest.mark.parametrize("place", [(0.1, 0.25), (0.6, 0.1)])
def test_forces_at_rest_are_those_that_hold_the_mechanism(place, payload):
    at = np.array([place])
    still = np.zeros((1, 2))
    for row, unit in enumerate(LOADER.cylinders):
        got = balance(LOADER, unit, at, still, still)
        wanted = holding_forces(LOADER, joints(LOADER, at), payload)[0, row]
        assert got.bodies[0] + payload * got.payload[0] == pytest.approx(wanted, rel=1e-9)
        assert abs(got.bodies_moving[0]) < 1e-9


def test_forces_in_motion_do_the_work_of_the_energies():
    """Power of all rods is the rate of kinetic and potential energy, along a course of both cylinders."""
    from ramsight.plant.linkage import potential

    time = np.linspace(0.0, 2.0, 4001)
    at = np.column_stack([0.3 + 0.1 * np.sin(2.0 * time), 0.25 + 0.05 * np.cos(3.0 * time)])
    speed = np.gradient(at, time, axis=0)
    acceleration = np.gradient(speed, time, axis=0)
    payload, power = 3000.0, np.zeros(len(time))
    for row, unit in enumerate(LOADER.cylinders):
        got = balance(LOADER, unit, at, speed, acceleration)
        force = got.bodies + got.bodies_moving + payload * (got.payload + got.payload_moving)
        power += force * speed[:, row]
    q = joints(LOADER, at)
    turns = angles(LOADER, q)
    kinetic = np.zeros(len(time))
    for body in (*LOADER.bodies, None):
        spot = LOADER.load if body is None else None
        x, z = (spot.x, spot.z) if spot else (body.centre_x, body.centre_z)
        name = spot.body if spot else body.name
        places = np.array([[float(v) for v in LOADER.poses(row)[name].at(x, z)] for row in q[::40]])
        v = np.gradient(places, time[::40], axis=0)
        omega = np.gradient(turns[name][::40], time[::40])
        mass, inertia = (payload, 0.0) if spot else (body.mass, body.inertia)
        fine = 0.5 * mass * (v**2).sum(axis=1) + 0.5 * inertia * omega**2
        kinetic += np.interp(time, time[::40], fine)
    energy = kinetic + potential(LOADER, q, payload)
    inner = slice(200, -200)
    work = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(time))])
    gained, done = energy - energy[200], work - work[200]
    assert np.abs(gained - done)[inner].max() < 2e-3 * np.ptp(energy)


def test_a_slope_turns_gravity():
    """Uphill and downhill, what a body weighs along the lift differs, about cos(tilt) of what it is on the level."""
    at, still = np.array([[0.15, 0.25]]), np.zeros((1, 2))
    flat, up = (balance(LOADER, "boom", at, still, still, tilt) for tilt in (0.0, 0.1))
    down = balance(LOADER, "boom", at, still, still, -0.1)
    assert abs(up.bodies[0] - down.bodies[0]) > 1e-3 * flat.bodies[0]
    assert 0.5 * (up.payload[0] + down.payload[0]) == pytest.approx(flat.payload[0] * math.cos(0.1), rel=1e-9)


def test_where_in_a_level_bucket_the_load_is_the_bucket_s_cylinder_alone_feels():
    """0.2 m farther in: a quarter of the bucket's force per kilogram, and nothing of the boom's."""
    farther_in = replace(LOADER, load=replace(LOADER.load, x=LOADER.load.x - 0.2))
    at, still = np.array([[0.1, 0.25], [0.6, 0.25]]), np.zeros((2, 2))
    boom, bucket = (
        balance(farther_in, unit, at, still, still).payload / balance(LOADER, unit, at, still, still).payload
        for unit in ("boom", "bucket")
    )
    assert boom == pytest.approx(1.0, abs=1e-9)
    assert bucket == pytest.approx(0.75, abs=0.005)


# Windows


def lifts_of(time, speed, *, shown=True, mass=4000.0, moving=True, extra=0.0):
    """Lifts of a rod that goes as it is asked to, and carries a mass; by the force balance of every sample."""
    speed = np.column_stack([speed, np.zeros(len(time))])
    step = np.gradient(time)[:, None]
    at = np.array([0.2, 0.25]) + np.cumsum(speed * step, axis=0)
    found = balance(LOADER, "boom", at, speed, np.gradient(speed[:, 0], time)[:, None] * [1.0, 0.0])
    bodies = found.bodies + moving * found.bodies_moving
    payload = found.payload + moving * found.payload_moving
    known = {
        "time": time, "position": at[:, 0], "velocity": speed[:, 0], "load": bodies + mass * payload + extra,
        "position_std": np.full(len(time), 1e-3), "load_std": np.full(len(time), 1e3),
        "load_age": np.full(len(time), 0.0 if shown else 1.0), "status": np.zeros(len(time)),
    }  # fmt: skip
    scene = Scene(LINKED, "boom", Others(held={"bucket": 0.25}))
    return lifts(scene, Signals({name: Signal(one) for name, one in known.items()}))


def test_windows_need_motion_that_the_torque_shows():
    time = np.arange(0.0, 12.0, 0.02)
    speed = np.select([(time > 1) & (time < 5), (time > 6) & (time < 11)], [0.03, -0.02], 0.0)
    up, down = lifts_of(time, speed)
    assert (up.upwards, down.upwards) == (True, False)
    assert up.time - 0.5 * up.duration == pytest.approx(1.8, abs=0.12)
    assert up.time + 0.5 * up.duration == pytest.approx(4.5, abs=0.1)
    assert (up.quality, down.quality) == (Quality.GOOD, Quality.GOOD)
    assert lifts_of(time, speed, shown=False) == []
    assert lifts_of(time, 0.003 * STROKE + 0 * speed) == []


def test_a_pause_of_some_samples_does_not_end_a_lift():
    time = np.arange(0.0, 6.0, 0.02)
    for pause, count in ((3, 1), (20, 2)):
        speed = np.full(len(time), 0.03)
        speed[150 : 150 + pause] = 0.0
        assert len(lifts_of(time, speed)) == count


def test_a_motion_does_not_go_on_over_a_gap_of_the_log():
    time = np.concatenate([np.arange(0.0, 3.0, 0.02), np.arange(13.0, 16.0, 0.02)])
    found = lifts_of(time, np.full(len(time), 0.03))
    assert [round(one.duration, 1) for one in found] == [1.7, 1.7]


@pytest.mark.parametrize("period", [0.005, 0.02, 0.03, 0.08, 0.1])
def test_a_mass_is_right_at_any_period(period):
    time = np.arange(0.0, 7.0, period)
    (one,) = lifts_of(time, np.where((time > 1.0) & (time < 6.0), 0.03, 0.0))
    assert one.mass == pytest.approx(4000.0, abs=1.0)
    assert one.quality is Quality.GOOD


def test_what_acceleration_adds_is_allowed_for():
    """Of a rod that gets faster all the time; without it the mass is another."""
    time = np.arange(0.0, 5.0, 0.02)
    speed = np.where(time > 1.0, 0.01 + 0.02 * (time - 1.0), 0.0)
    (one,), (other,) = lifts_of(time, speed), lifts_of(time, speed, moving=False)
    assert one.mass == pytest.approx(4000.0, abs=1.0)
    assert other.mass < 3990.0
    assert one.quality is Quality.TOO_FAST


def test_a_rod_that_turns_back_at_once_makes_two_lifts():
    time = np.arange(0.0, 9.0, 0.02)
    up, down = lifts_of(time, np.where(time < 4.5, 0.03, -0.03))
    assert (up.upwards, down.upwards) == (True, False)


def test_a_speed_that_trembles_is_not_steady():
    """The speed varies by less than a tenth, and its acceleration takes more than a hundredth of the force."""
    time = np.arange(0.0, 7.0, 0.02)
    for share, quality in ((0.12, Quality.TOO_FAST), (0.01, Quality.GOOD)):
        (one,) = lifts_of(time, 0.04 * (1.0 + share * np.sin(2.0 * np.pi * 1.5 * time)))
        assert one.quality is quality
        assert one.mass == pytest.approx(4000.0, abs=15.0), "it is allowed for, all the same"


@pytest.mark.parametrize("lasts", np.arange(5.0, 5.12, 0.02))
def test_the_last_0_4_s_are_not_weighed(lasts):
    time = np.arange(0.0, 7.0, 0.02)
    moves = time < lasts
    late = moves & (time > time[moves][-1] - 0.39)
    (one,) = lifts_of(time, np.where(moves, 0.03, 0.0), extra=np.where(late, 50e3, 0.0))
    assert one.mass == pytest.approx(4000.0, abs=1.0)


def test_noise_is_no_change_and_makes_a_mass_less_sure():
    time = np.arange(0.0, 9.0, 0.02)
    noise = np.random.default_rng(3).standard_normal(len(time))
    stds = []
    for size in (0.0, 12e3):
        (one,) = lifts_of(time, np.full(len(time), 0.03), extra=size * noise)
        assert one.quality is Quality.GOOD
        stds.append(one.own_std)
    assert stds[1] > stds[0] + 1.0


def test_what_falls_at_the_end_of_a_window_is_seen_in_the_half_second_that_it_has_begun():
    """So little that a half second with as much of either is no change."""
    found = set()
    for lasts in np.arange(6.0, 6.5, 0.1):
        time = np.arange(0.0, 8.0, 0.02)
        mass = np.where(time < lasts - 0.75, 4000.0, 3740.0)
        (one,) = lifts_of(time, np.where(time < lasts, 0.03, 0.0), mass=mass)
        found.add(one.quality)
    assert found == {Quality.GOOD, Quality.SPILLED}


def test_a_change_within_a_lift_is_one_step_down_or_something_else():
    time = np.arange(0.0, 9.0, 0.02)
    speed = np.where((time > 1.0) & (time < 8.0), 0.03, 0.0)
    for mass, quality in (
        (np.where(time < 4.3, 4000.0, 3500.0), Quality.SPILLED),
        (np.where(time < 4.3, 3500.0, 4000.0), Quality.DIGGING),
        (3000.0 + 100.0 * time, Quality.DIGGING),
        (np.where(time < 4.3, 4000.0, 3900.0), Quality.GOOD),
    ):
        (one,) = lifts_of(time, speed, mass=mass)
        assert one.quality is quality


def test_repeated_times_are_no_samples(shift):
    twice = shift.isel(time=np.sort([*range(shift.sizes["time"]), 700, 900]))
    one = ramsight.weigh("mining-loader", twice, start="70 mm", at=LEVEL).weighings[0]
    assert one.is_good


# Scales


def test_a_known_mass_corrects_a_mass_like_it():
    scale = described_scale(LINKED.unit("boom"), 9e4)
    row = np.array([7000.0, 7000.0, 0.024, 0.024])
    after = scale.learned(4800.0, row, 5000.0, 10.0)
    assert after.mass(4800.0, row)[0] == pytest.approx(5000.0, abs=2.0)
    assert after.mass(4800.0, row)[1] < 12.0
    empty = np.array([2200.0, 2200.0, 0.024, 0.024])
    assert after.mass(0.0, empty)[1] > 3.0 * after.mass(4800.0, row)[1], "one mass leaves the other end open"
    both = after.learned(10.0, empty, 0.0, 10.0)
    assert both.mass(10.0, empty)[1] < 12.0
    assert both.masses == 2


def plain(mass, *, upwards=True, quality=Quality.GOOD, own_std=10.0, others=0.25, time=0.0):
    direction = 1.0 if upwards else -1.0
    row = np.array([7000.0, direction * 7000.0, 0.024, direction * 0.024])
    return Plain(time, 5.0, upwards, mass, row, own_std, np.array([others]), quality)


SCALE = described_scale(LINKED.unit("boom"), 9e4)


def test_up_and_down_of_one_load_are_averaged():
    (one,) = weighed([plain(5050.0), plain(4950.0, upwards=False)], Tally(SCALE, np.array([0.5])))
    (alone,) = weighed([plain(5050.0)], Tally(SCALE, np.array([0.5])))
    assert (one.direction, one.mass) == ("both", 5000.0)
    assert one.std < 0.85 * alone.std, "losses and friction cancel"


@pytest.mark.parametrize(
    "down",
    [
        {"mass": 0.0},
        {"mass": 4950.0, "others": 0.4},
        {"mass": 4950.0, "quality": Quality.DIGGING},
    ],
)
def test_what_was_dumped_between_is_another_load(down):
    (one,) = weighed([plain(5050.0), plain(**down, upwards=False)], Tally(SCALE, np.array([0.5])))
    assert (one.direction, one.mass) == ("up", 5050.0)


def test_a_cycle_begins_with_the_first_lift_after_lowering():
    rows = [plain(5000.0), plain(5010.0), plain(0.0, upwards=False), plain(3000.0)]
    assert [one.cycle for one in weighed(rows, Tally(SCALE, np.array([0.5])))] == [1, 1, 2]


def test_a_total_counts_a_cycle_by_its_surest_weighing_and_an_empty_tool_not_at_all():
    tally = Tally(SCALE, np.array([0.5]), rated=100.0 / EMPTY_SHARE)
    weighed([plain(5000.0, own_std=30.0), plain(5100.0), plain(0.0, upwards=False), plain(2000.0)], tally)
    assert (tally.total.mass, tally.total.cycles, tally.count) == (7100.0, 2, 3)
    weighed([plain(0.0, upwards=False), plain(110.0), plain(80.0, upwards=False)], tally)
    assert (tally.last.direction, tally.last.mass, tally.count) == ("both", 95.0, 4)
    assert (tally.total.mass, tally.total.cycles) == (7100.0, 2), "lowered again it is empty"


# Logs


def test_masses_are_right_and_lowering_is_no_weighing(found):
    assert [one.is_good for one in found.weighings] == [True] * 3
    assert [one.direction for one in found.weighings] == ["both", "up", "up"]
    for one, mass in zip(found.weighings, MASSES, strict=True):
        assert abs(one.mass - mass) < 40.0
        assert one.low < mass < one.high
    gain, by_direction = found.weighings[0].row[:2]
    assert abs(by_direction) < 0.05 * gain, "up and down differ in sign alone"
    assert found.total == pytest.approx(sum(MASSES), abs=60.0)
    assert found.cycles == 2, "the empty bucket is no load"
    shared = math.hypot(*(one.std for one in found.weighings[1:]))
    assert found.total_std > 1.2 * shared, "the scale's error is that of all of them"


def test_a_torque_that_is_wrong_is_learned_from_a_known_mass(shift):
    wrong = shift.copy(deep=True)
    wrong["motor_torque"] *= 1.03
    plainly = ramsight.weigh("mining-loader", wrong, start="70 mm", at=LEVEL)
    assert plainly.weighings[2].mass - 7000.0 > 200.0
    known = log_of(lifting(LINKED, [5000.0]))
    known["motor_torque"] *= 1.03
    empty = log_of(lifting(LINKED, [0.0]))
    empty["motor_torque"] *= 1.03
    taught = ramsight.weigh("mining-loader", wrong, start="70 mm", at=LEVEL, known=[("5 t", known), (0.0, empty)])
    assert abs(taught.weighings[2].mass - 7000.0) < 60.0
    assert taught.weighings[2].std < 0.5 * plainly.weighings[2].std
    assert taught.scale.masses == 3, "a load that was dumped teaches nothing where the empty tool is lowered"
    zero = ramsight.weigh("mining-loader", wrong, start="70 mm", at=LEVEL, lowered_empty=True)
    assert zero.scale.std[2] < 0.8 * plainly.scale.std[2]


def test_a_declared_slope_is_allowed_for(script):
    """The machine of `make study` that stands with its front 5 degrees up."""
    uphill = replace(LINKED, mechanism=script("weighing").tilt(LOADER, math.radians(5.0)))
    log = ramsight.drive_report(unit_run(simulate_linked(uphill, lifting(uphill, [6000.0])), "boom"))
    masses = {
        slope: ramsight.weigh("mining-loader", log, start="70 mm", at=LEVEL, inclination=f"{slope} deg")
        .weighings[0]
        .mass
        for slope in (5, 0, -5)
    }
    assert abs(masses[5] - 6000.0) < 40.0
    assert abs(masses[0] - 6000.0) > 60.0
    assert abs(masses[-5] - 6000.0) > 120.0


def changed(course):
    duty = lifting(LINKED, [6000.0])
    begins = duty.phases[0][1]
    return log_of(course(duty, begins))


def spill(duty, begins):
    loads = duty.payload
    time = np.sort([*loads.time, begins + 4.0, begins + 4.2])
    return replace(
        duty,
        payload=Profile(time, np.where((time >= begins + 4.2) & (time < duty.phases[1][1] - 1.0), 5000.0, loads(time))),
    )


def dig(duty, begins):
    time = np.arange(begins, begins + 10.0, 0.9)
    force = np.where(np.arange(len(time)) % 2, -25e3, -2e3)
    return replace(duty, tip_force_z=Profile([*time, begins + 10.3], [*force, 0.0]))


def jerk(duty, begins):
    speed = duty.motor_speed["boom"]
    time = np.union1d(speed.time, np.arange(begins, begins + 8.0, 0.4))
    shares = np.where((time > begins + 0.5) & (time < begins + 8.0), 0.6 + 0.4 * (np.arange(len(time)) % 2), 1.0)
    return replace(duty, motor_speed=duty.motor_speed | {"boom": Profile(time, shares * speed(time))})


def short(duty, begins):
    speed = duty.motor_speed["boom"]
    corners = [0.0, begins, begins + 0.3, begins + 1.5, begins + 1.8, float(speed.time[-1])]
    top = float(speed.value.max())
    return replace(duty, motor_speed=duty.motor_speed | {"boom": Profile(corners, [0.0, 0.0, top, top, 0.0, 0.0])})


@pytest.mark.parametrize(
    ("course", "quality"),
    [(spill, Quality.SPILLED), (dig, Quality.DIGGING), (jerk, Quality.TOO_FAST), (short, Quality.TOO_SHORT)],
)
def test_a_bad_lift_says_why(course, quality):
    one = ramsight.weigh("mining-loader", changed(course), start="70 mm", at=LEVEL).weighings[0]
    assert one.quality is quality
    assert not one.is_good
    assert quality is not Quality.TOO_SHORT or one.duration < SHORTEST


def test_an_unknown_position_is_no_weighing(shift):
    found = ramsight.weigh("mining-loader", shift, at=LEVEL)
    assert found.weighings
    assert {one.quality for one in found.weighings} == {Quality.UNKNOWN_POSITION}
    assert (found.total, found.cycles) == (0, 0)


def test_a_bucket_anywhere_widens_the_band(shift, found):
    anywhere = ramsight.weigh("mining-loader", shift, start="70 mm")
    assert anywhere.weighings[2].own_std > 1.2 * found.weighings[2].own_std


def test_the_columns_are_those_of_the_dataset(found):
    data = found.dataset()
    assert data.sizes["weighing"] == 3
    assert data["mass"].attrs["units"] == "kg"
    assert list(found.columns) == [
        "log", "cycle", "time_s", "duration_s", "mass_kg", "mass_std_kg", "mass_low_kg", "mass_high_kg", "direction",
        "quality", "reason", "rated_share", "rated_share_std", "exceeded_probability", "rated_status",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"machine": "press"}, "no mechanism"),
        ({"unit": "ram"}, "unit of the mechanism"),
        ({"start": "2 m"}, "start"),
        ({"inclination": "50 deg"}, "inclination"),
        ({"known": [("20 t", None)]}, "known"),
        ({"known": [("2 t", "still")]}, "no lift of it is good"),
        ({"beside": {"bucket": None}, "known": [("2 t", None)]}, "beside"),
    ],
)
def test_arguments_that_cannot_be_are_refused(shift, arguments, message):
    passed = {"machine": "mining-loader", "logs": shift, "start": "70 mm", "at": LEVEL} | arguments
    if "known" in passed:
        still = shift.isel(time=slice(0, 50))
        passed["known"] = [(mass, still) for mass, _ in passed["known"]]
    if "beside" in passed:
        passed["beside"] = {"bucket": shift}
    with pytest.raises(ramsight.RamsightError, match=message):
        ramsight.weigh(**passed)


# The verb


@pytest.fixture(scope="module")
def folder(shift, tmp_path_factory):
    made = tmp_path_factory.mktemp("weigh")
    for name, log in (("shift.csv", shift), ("empty.csv", log_of(lifting(LINKED, [0.0])))):
        write_log(log, made / name)
    return made


WORDS = ("weigh", "mining-loader", "shift.csv", "--start", "70 mm", "--at", "bucket=250 mm")


def test_the_verb_prints_a_table_and_writes_files(folder):
    done = at_once(*WORDS, "--empty", "empty.csv", "--out", "w.csv", "--figure", "w.png", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "3 weighings, 3 good; total" in done.stdout
    assert "from 2 lifts of known mass" in done.stdout
    lines = (folder / "w.csv").read_text().splitlines()
    assert lines[0].startswith("log,cycle,time_s,duration_s,mass_kg")
    assert len(lines) == 4
    assert (folder / "w.png").stat().st_size > 5000


def test_the_json_has_the_figures(folder, found):
    done = at_once(*WORDS, "--json", cwd=folder)
    said = json.loads(done.stdout)
    assert said["weighings"][2]["mass"] == pytest.approx(found.weighings[2].mass, abs=5.0)
    assert said["weighings"][2]["quality"] == "good"
    assert said["scale"]["gain"]["std"] == pytest.approx(found.scale.std[0])


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--known", "2 t"), "2 t=known.csv"),
        (("--known", "2 t=nothing.csv"), "nothing.csv"),
        (("--out", "w.txt"), "unknown suffix"),
        (("--out", "shift.csv"), "shift.csv"),
        (("--at", "bucket=1 m"), "bucket"),
    ],
)
def test_what_the_verb_cannot_do_is_refused_in_a_line(folder, words, message):
    done = at_once(*WORDS, *words, cwd=folder)
    assert done.returncode == 2
    assert message in done.stderr
    assert "Traceback" not in done.stderr
