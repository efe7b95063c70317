"""A circuit whose pump turns one way and whose valve is commanded, with a load that only resists."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from ramsight import machine
from ramsight.deploy.c_folder import write_sensor
from ramsight.deploy.compiler import find_compiler
from ramsight.duty import DriveReport, report, simulate
from ramsight.duty.plan import one_way
from ramsight.duty.profile import Duty, Profile, constant
from ramsight.errors import DescriptionError, LogError, UnknownNameError
from ramsight.plant.build import build
from ramsight.plant.directional import DirectionalValve
from ramsight.sensor.balance import balance
from ramsight.sensor.contacts.mode import HELD
from ramsight.sensor.kalman import kalman

from .golden import golden

RIG = machine.load_machine("eha-valve-rig")
UNIT = build(RIG.unit("axis"), "axis")
FAST = 900.0 * 2.0 * np.pi / 60.0
LOAD = 6e3


def moves(load: float = LOAD) -> Duty:
    """Out 45 mm, a rest, back, a rest."""
    speed = Profile([0, 0.5, 0.8, 4.3, 4.6, 7.5, 7.8, 9.8, 10.1, 12], [0, 0, FAST, FAST, 0, 0, -FAST, -FAST, 0, 0])
    return one_way(Duty(speed, constant(load), constant(308.15), 0.005), "valve")


@pytest.fixture(scope="module")
def run():
    return simulate(UNIT, moves())


def test_energy_and_oil_of_a_cycle_are_accounted_for(run):
    assert abs(run.attrs["energy_residual"]) < 1e-3
    assert abs(run.attrs["volume_residual"]) < 1e-3
    assert run.attrs["energy.load"] > 0.0


def test_the_command_decides_which_way_the_same_rotation_goes(run):
    time, x = run["time"].values, run["position"].values
    out, back = x[np.searchsorted(time, 4.0)] - x[np.searchsorted(time, 2.0)], np.nan
    back = x[np.searchsorted(time, 9.5)] - x[np.searchsorted(time, 8.5)]
    assert (run["motor_speed"].values >= 0.0).all()
    assert out > 0.015
    assert back < -0.008
    per_second = UNIT.travel_per_radian * FAST
    assert out / 2.0 == pytest.approx(per_second, rel=0.08)  # less what leaks
    assert back == pytest.approx(-per_second * UNIT.cylinder.area_a / UNIT.cylinder.area_b, rel=0.08)


def test_a_load_that_only_resists_moves_nothing_and_takes_work_both_ways(run):
    time, x = run["time"].values, run["position"].values
    rest = (time > 5.6) & (time < 7.4)
    assert np.ptp(x[rest]) < 0.5e-3  # its friction is viscous below a hundredth of a millimetre a second
    pressure = run["pressure_a"].values[rest]
    assert pressure[-1] < pressure[0] - 1e5  # it leaks away while the piston stands
    back = (time > 8.5) & (time < 9.5)
    carried = (
        run["pressure_b"].values[back] * UNIT.cylinder.area_b - run["pressure_a"].values[back] * UNIT.cylinder.area_a
    )
    assert carried.mean() == pytest.approx(LOAD + UNIT.cylinder.coulomb_friction, rel=0.1)


@pytest.mark.parametrize(
    ("spool", "way", "overlap", "opening"),
    [(1.0, 1.0, 0.2, 1.0), (0.2, 1.0, 0.2, 0.0), (-1.0, 1.0, 0.2, 0.0), (-0.6, -1.0, 0.2, 0.5), (0.0, 1.0, -0.25, 0.2)],
)
def test_edges_open_beyond_the_overlap(spool, way, overlap, opening):
    valve = DirectionalValve("v", "p", "t", "a", "b", 1e-7, overlap)
    assert float(valve.opening(ca.DM(spool), way)) == pytest.approx(opening)


def test_commands_are_held_repeated_and_checked():
    duty = moves()
    twice = replace(duty, commands={"valve": Profile([0.0, 6.0], [1.0, -1.0])}).repeated(2)
    assert twice.commanded("valve", [5.9, 6.0, 12.0, 18.0]).tolist() == [1.0, -1.0, 1.0, -1.0]
    with pytest.raises(UnknownNameError, match="commanded part 'vavle'; did you mean 'valve'"):
        simulate(UNIT, replace(duty, commands={"vavle": constant(1.0)}))
    with pytest.raises(ValueError, match="changes its sign between two corners"):
        one_way(replace(duty, motor_speed=Profile([0, 1], [-1, 1])), "valve")


@pytest.fixture(scope="module")
def log(run):
    return report(run, DriveReport(torque_noise=0.02, torque_step=0.005, speed_step=0.01))


@pytest.fixture(scope="module")
def sensor():
    return kalman(UNIT)


def test_the_sensor_follows_by_angle_torque_and_command(run, log, sensor):
    sensor.start(0.005, 1e-4)
    track = sensor.track(log)
    error = np.abs(track["position"].values - run["position"].values)
    assert error.max() < 1.5e-3  # while the load is met
    at_rest = np.searchsorted(run["time"].values, [7.0, 11.5])
    assert error[at_rest].max() < 0.4e-3
    assert (error < 2.5 * track["position_std"].values).mean() > 0.97


@pytest.mark.parametrize("load", [7e3, 9e3])
def test_a_load_that_has_yet_to_be_overcome_is_no_contact(sensor, load):
    """Until the oil presses harder than it resists the piston stands and the pump delivers in vain, anywhere."""
    speed = Profile([0, 1, 1.8, 2.6, 3.4, 5, 5.8, 6.6, 7.4, 9], [0, 0, 157, 157, 0, 0, -157, -157, 0, 0])
    run = simulate(UNIT, one_way(Duty(speed, constant(load), constant(308.15), 0.015), "valve"))
    sensor.start(0.015, 1e-4)
    track = sensor.track(report(run, DriveReport(torque_noise=0.0, torque_step=0.0, speed_step=0.0)))
    error = np.abs(track["position"].values - run["position"].values)
    assert not set(track["mode"].values.astype(int).tolist()) & {int(mode) for mode in HELD}
    assert np.sqrt(np.mean(error**2)) < 0.4e-3
    assert track["compliance_factor"].values == pytest.approx(1.0), "nothing was held that could tell it"


def dipped(log, begins, speed=0.0):
    """The log with a motor that takes no torque for 80 ms, and turns back at a speed [rad/s] meanwhile."""
    time = log["time"].values
    dip = (time > begins) & (time < begins + 0.08)
    changed = {name: log[name].values.copy() for name in ("motor_torque", "motor_speed")}
    changed["motor_torque"][dip], changed["motor_speed"][dip] = 0.0, speed
    return log.assign({name: ("time", values) for name, values in changed.items()})


@pytest.mark.parametrize("speed", [0.0, -3.0])
def test_a_motor_that_hardly_turns_may_hold_a_load_by_its_own_friction(run, log, speed):
    """Its torque then says little of the load, as far as the description says so: the oil would push the piston out."""
    moved = {}
    for standing in (0.0, 2.0):
        sensor, ends = kalman(UNIT, UNIT.assumptions.replace({"drive.standing": standing})), []
        for seen in (log, dipped(log, 4.7, speed)):
            sensor.start(0.005, 1e-4)
            track = sensor.track(seen)
            at = np.searchsorted(track["time"].values, 4.79)
            ends.append(float(track["position"][at]))
        moved[standing] = abs(ends[1] - ends[0])
    assert moved[0.0] > 0.3e-3
    assert moved[2.0] < 0.6 * moved[0.0]


def moved_by(run, std, offset, lag=0.0):
    """By how much an error of both pressures [Pa] moves the last position [m], by how well they are known [Pa]."""
    known = {"pressure.std": std, "pressure.lag": lag}
    sensor = kalman(UNIT, UNIT.assumptions.replace(known))
    ends = []
    for off in (0.0, offset):
        how = DriveReport(torque_noise=0.02, torque_step=0.005, speed_step=0.01, pressure_noise=0.0)
        log = report(run, how)
        sensor.start(0.005, 1e-4)
        track = sensor.track(log.assign({name: log[name] + off for name in ("pressure_a", "pressure_b")}))
        ends.append(float(track["position"][-1]))
    return abs(ends[1] - ends[0])


def test_pressures_of_a_piston_that_stands_count_as_far_as_they_are_known_better_than_what_leaks(run):
    """Each bar is 0.2 mm of hoses: a sensor that may be off by ten bar says nothing of what leaked, a fine one does."""
    coarse, fine = moved_by(run, 10e5, 3e5), moved_by(run, 0.2e5, 3e5)
    assert coarse < 0.05e-3
    assert fine > 4.0 * coarse
    assert fine > 0.1e-3


def test_a_command_that_is_lost_is_as_before(log, sensor):
    sensor.start(0.005, 1e-4)
    whole = sensor.track(log)["position"].values
    rare = log["valve_command"].values.copy()
    rare[1:][rare[1:] == rare[:-1]] = np.nan
    sensor.start(0.005, 1e-4)
    assert np.array_equal(sensor.track(log.assign(valve_command=("time", rare)))["position"].values, whole)


def test_sample_by_sample_is_the_log_and_unknown_inputs_are_refused(log, sensor):
    sensor.start(0.005, 1e-4)
    whole = sensor.track(log.isel(time=slice(0, 100)))["position"].values[-1]
    sensor.start(0.005, 1e-4)
    for k in range(100):
        said = sensor.step(
            float(log["time"][k]),
            float(log["motor_speed"][k]),
            float(log["motor_torque"][k]),
            float(log["oil_temperature"][k]),
            valve_command=float(log["valve_command"][k]),
        )
    assert said.position == whole
    with pytest.raises(ValueError, match="unknown input 'spool'"):
        sensor.step(3.0, 0.0, 0.0, 308.0, spool=1.0)
    with pytest.raises(LogError, match="valve_command"):
        sensor.track(log.drop_vars("valve_command"))


def test_pressures_that_show_nothing_change_nothing(log, sensor):
    """Declared sensors without a number are as sensors that are not declared."""
    none = kalman(UNIT, UNIT.assumptions.replace({"pressure.std": 0.0}))
    assert sensor.optional == ("pressure_a", "pressure_b")
    assert none.optional == ()
    none.start(0.005, 1e-4)
    sensor.start(0.005, 1e-4)
    assert np.allclose(sensor.track(log)["position"].values, none.track(log)["position"].values, atol=1e-9)


def test_measured_pressures_find_a_leak_that_is_not_described(run, log):
    leaky = replace(UNIT.extra[0], leak_factor=2.5)
    actual = replace(UNIT, extra=(leaky, *UNIT.extra[1:]))
    real = simulate(actual, moves())
    seen = report(real, DriveReport(torque_noise=0.02, torque_step=0.005, speed_step=0.01))
    pressures = {name: real[name] for name in ("pressure_a", "pressure_b")}
    assumed = UNIT.assumptions.replace({"pressure.lag": 0.0})
    with_them, off = kalman(UNIT, assumed), []
    for given in (seen, seen.assign(pressures)):
        with_them.start(0.005, 1e-4)
        said = with_them.track(given)
        rest = (real["time"].values > 6.0) & (real["time"].values < 7.4)
        off.append(float(np.abs(said["pressure_a"].values - real["pressure_a"].values)[rest].mean()))
    assert off[1] < 0.8 * off[0]


def test_the_balance_takes_the_same_inputs():
    assert balance(UNIT).further == ("valve_command", "pressure_a", "pressure_b")


@pytest.mark.slow
@pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
def test_exported_c_takes_command_and_pressures(tmp_path):
    done = write_sensor(RIG, "axis", tmp_path / "axis", compiler="")
    header = (tmp_path / "axis" / "ramsight_axis.h").read_text(encoding="utf-8")
    assert "ramsight_axis_real valve_command; /* command, -1 ... 1" in header
    assert "ramsight_axis_real pressure_b; /* absolute pressure in chamber B [Pa]" in header
    assert "passed" in golden(done.folder, "ramsight_axis")
    with pytest.raises(DescriptionError, match="is not for floats"):
        write_sensor(RIG, "axis", tmp_path / "floats", single=True)
