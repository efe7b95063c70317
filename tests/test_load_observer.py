"""The load from the motor's torque: found, followed, and never paid for with oil that is not there."""

from contextlib import contextmanager
from dataclasses import dataclass, replace
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
import xarray

from ramsight.duty import report
from ramsight.engine.typed_state import leaf, symbols
from ramsight.plant.balance import FACTORS, balance, without_friction
from ramsight.plant.limits import limits_of
from ramsight.plant.oil import ATMOSPHERE
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.circuit.load import LoadState, Piston, _sinking, observe_load, shifted
from ramsight.sensor.circuit.load_release import Release, UnheldState, release_load
from ramsight.sensor.inputs.sample import Raw, SampleState, plain_sample
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.virtual_sensor import Report, close

from .plant_bench import CIRCUITS, UNITS
from .sensor_bench import WARM, Stepped, begin, changing, cycle, load_observer, lowered, moves, observers, quiet

LOCKED = ["mining-loader boom", "mining-loader bucket", "forklift-mast lift"]
FREE = ["eha-test-bench axis", "eha-single-rod axis"]


def followed(name, run, log):
    """What the observer says of a run that begins where it is told, and by how much it is wrong [m]."""
    said = begun(observers(name), run).track(log)
    return said, said["position"] - run["position"].values


def begun(observer, run):
    """An observer that begins where a run does."""
    begin(observer, float(run["position"][0]))
    return observer


def through(name, share=0.4):
    """A unit, its observer at the end of a cycle, the cycle's log, and what was said of it."""
    run, log = cycle(UNITS[name], share)
    observer = begun(observers(name), run)
    return UNITS[name], observer, log, observer.track(log)


@contextmanager
def kept(observer):
    """The observer's state is what it was, in the end."""
    before = observer.state.copy()
    yield before
    observer.state = before


def full_speed(run, unit, lifts=1.0, after=0.3):
    """Samples at the highest speed of a run that lifts (or lowers), from a while after it is reached."""
    speed = run["motor_speed"].values * unit.lift_sign * lifts
    at = speed > 0.95 * speed.max()
    since = np.zeros(at.size)
    for i in range(1, at.size):
        since[i] = since[i - 1] + run["time"].values[i] - run["time"].values[i - 1] if at[i] else 0.0
    return since > after


def lifting_speed(unit):
    """Velocity at the highest motor speed [m/s]."""
    return unit.max_speed * unit.travel_per_radian


def pushed(run, unit):
    """Load that the pressures carry, with friction and inertia [N]."""
    c = unit.cylinder
    force = c.area_a * run["pressure_a"].values - c.area_b * run["pressure_b"].values
    return unit.lift_sign * (force - ATMOSPHERE * (c.area_a - c.area_b))


def rubbed(run, unit):
    """Friction of the cylinder, positive where it adds to a load that is lifted [N]."""
    return unit.lift_sign * unit.cylinder.friction(run["velocity"].values).full()[:, 0]


def lifted(run, unit):
    """Load that is left of the pressures' beside friction, with inertia [N]."""
    return pushed(run, unit) - rubbed(run, unit)


@pytest.mark.parametrize("name", CIRCUITS)
def test_the_load_of_a_lift_is_found_within_two_percent(name):
    unit = UNITS[name]
    run, log = cycle(unit)
    said, error = followed(name, run, log)
    lifts = full_speed(run, unit, after=0.2)
    assert lifts.sum() > 5
    wrong = (said["load"] / lifted(run, unit) - 1.0)[lifts]
    assert abs(wrong.mean()) < 0.01
    # A mast on its hoses swings at 2 Hz; what a piston without mass makes of that is late.
    assert np.abs(wrong).max() < (0.06 if name == "forklift-mast lift" else 0.02)
    carried = (said["carried"] / pushed(run, unit) - 1.0)[lifts]
    assert abs(carried.mean()) < 0.01
    friction = (said["carried"] - said["load"])[lifts]
    assert friction.mean() == pytest.approx(rubbed(run, unit)[lifts].mean(), rel=0.05)
    assert np.abs(error).max() < 0.008 * unit.cylinder.stroke
    assert (said["shows"][lifts] > 0.75).all()
    assert (said["shows"] <= 1.0).all()


@pytest.mark.parametrize("name", CIRCUITS)
@pytest.mark.parametrize("share", [0.1, 0.75])
def test_a_first_load_that_is_found_moves_no_position(name, share):
    """The observer begins with half of the largest load; what the oil gives between the two is no travel."""
    unit = UNITS[name]
    limits = limits_of(unit)
    start = lowered(unit, 0.4 * unit.cylinder.stroke)
    run, log = moves(unit, [(0.0, 0.0), (0.5, 0.0), (0.8, 0.2), (1.5, 0.2)], share * limits.load, start)
    said, error = followed(name, run, log)
    seen = full_speed(run, unit)
    assert np.abs(said["load"] - lifted(run, unit))[seen].max() < 0.03 * limits.load
    gives = said["give"][seen].max() * abs(0.5 - share) * limits.load
    assert gives > 1e-4
    assert np.abs(error)[seen].max() < max(0.15 * gives, 0.002 * unit.cylinder.stroke)


@pytest.mark.parametrize("name", LOCKED)
def test_a_load_that_grows_at_rest_behind_a_locked_valve_moves_the_rod_when_it_is_seen(name):
    unit = UNITS[name]
    load = limits_of(unit).load
    speeds = [(0.0, 0.0), (0.5, 0.0), (0.8, 0.3), (1.8, 0.3), (2.1, 0.0), (5.0, 0.0), (5.3, 0.3), (6.3, 0.3)]
    loads = changing([(0.0, 0.2 * load), (3.0, 0.2 * load), (3.4, 0.55 * load), (6.3, 0.55 * load)])
    run, log = moves(unit, speeds, loads, lowered(unit, 0.3 * unit.cylinder.stroke))
    said, error = followed(name, run, log)
    time, position = run["time"].values, run["position"].values
    before, grown, after = (np.searchsorted(time, t) for t in (2.9, 4.9, 6.2))
    sank = (position[grown] - position[before]) * unit.lift_sign
    assert sank < -3e-4, "nothing to be seen"
    assert abs(error[grown] - error[before]) > 0.8 * abs(sank), "how could it know"
    assert abs(error[after] - error[before]) < 0.25 * abs(sank)
    assert said["load"][after] == pytest.approx(lifted(run, unit)[after], rel=0.03)


@pytest.mark.parametrize("name", ["mining-loader boom", "eha-test-bench axis", "press ram"])
def test_a_load_that_jumps_is_followed(name):
    unit = UNITS[name]
    load = limits_of(unit).load
    loads = changing([(0.0, 0.2 * load), (1.5, 0.2 * load), (1.55, 0.5 * load), (2.5, 0.5 * load)])
    share = min(0.3, 0.4 * unit.cylinder.stroke / (1.85 * lifting_speed(unit)))
    speeds = [(0.0, 0.0), (0.5, 0.0), (0.8, share), (2.5, share)]
    run, log = moves(unit, speeds, loads, lowered(unit, 0.3 * unit.cylinder.stroke))
    said, error = followed(name, run, log)
    late = run["time"].values > 1.95
    assert np.abs(said["load"] / lifted(run, unit) - 1.0)[late].max() < 0.05
    assert np.abs(error)[late].max() < 0.004 * unit.cylinder.stroke


def at_rest(after, seconds, period, torque, noise, seed):
    """A log of nothing after another one: the motor stands, its torque is a number and noise."""
    count = round(seconds / period)
    rng = np.random.default_rng(seed)
    data = {
        "motor_speed": ("time", np.zeros(count)),
        "motor_torque": ("time", torque + noise * rng.standard_normal(count)),
        "oil_temperature": ("time", np.full(count, WARM)),
    }
    return xarray.Dataset(data, coords={"time": float(after[-1]) + np.arange(1, count + 1) * period})


@pytest.mark.parametrize("name", LOCKED)
def test_noise_of_the_torque_alone_does_not_move_a_rod_at_rest(name):
    unit, observer, log, _ = through(name)
    settled = observer.track(at_rest(log["time"], 200.0, 0.1, 0.0, 0.0, 0))  # the pumps' sides leak empty meanwhile
    noisy = observer.track(at_rest(log["time"] + 200.0, 1000.0, 0.1, 0.0, 0.005 * limits_of(unit).torque, 1))
    assert np.ptp(noisy["position"]) < 0.2e-3
    assert abs(noisy["position"][-1] - settled["position"][-1]) < 0.2e-3


@pytest.mark.parametrize("name", FREE)
def test_a_rod_that_the_pump_holds_sinks_by_leakage_whatever_the_noise(name):
    ends = []
    for noise, seed in ((0.0, 0), (0.007, 1), (0.007, 2)):
        unit, observer, log, said = through(name)
        torque = float(said["expected"][-1])
        after = observer.track(at_rest(log["time"], 3.0, 0.02, torque, noise * limits_of(unit).torque, seed))
        ends.append(after["position"][-1])
        assert (after["position"][-1] - said["position"][-1]) * unit.lift_sign < -1e-5
    sunk = abs(ends[0] - said["position"][-1])
    assert np.ptp(ends) < 0.15 * sunk


@pytest.mark.parametrize("name", CIRCUITS)
def test_no_torque_moves_the_load_by_more_than_virtual_work_allows(name):
    unit, observer = UNITS[name], observers(name)
    run, log = cycle(unit)
    wild = log.copy(deep=True)
    signs = np.where(np.arange(log.sizes["time"])[::17] % 2, 1, -1)
    wild["motor_torque"].values[::17] += limits_of(unit).torque * signs
    said = begun(observer, run).track(wild)
    changes = np.abs(np.diff(said["load"]))
    most = np.abs(said["innovation"][1:]) / unit.travel_per_radian
    assert (changes <= most * (1.0 + 1e-9) + 1e-6).all()
    assert (changes > 0.2 * most).any()
    assert (said["state_load.variance"] >= 0.0).all()
    assert (said["state_load.first_variance"] >= 0.0).all()


def with_factors(unit, k, by, run, log):
    """A log followed with a factor that is larger, smaller, and as it is."""
    for sign in (1.0, -1.0, 0.0):
        factors = [1.0 + (sign * by if i == k else 0.0) for i in range(len(FACTORS))]
        yield begun(load_observer(unit, factors), run).track(log)


@pytest.mark.parametrize("name", ["mining-loader boom", "eha-single-rod axis", "press ram"])
@pytest.mark.parametrize("k", range(len(FACTORS)), ids=FACTORS)
def test_it_knows_where_it_would_be_with_another_factor(name, k):
    """The derivatives that it carries along, against the same log followed with the other factor.

    They are of a piston that slides, so this one does: of a piston that stands none is a derivative for long.
    """
    unit, by = without_friction(UNITS[name]), [0.01, 1e-4, 0.01][k]
    run, log = cycle(unit)
    plus, minus, plain = with_factors(unit, k, by, run, log)
    known = np.flatnonzero(full_speed(run, unit))[0]  # the first load that is found moves the position by nothing
    expected = (plus["position"] - minus["position"])[known:] / (2.0 * by)
    found = np.cumsum(plain[f"travel_by_{FACTORS[k]}"])[known:]
    largest = np.ptp(expected)
    assert largest > 1e-5
    # A load that jumps where the valve opens is corrected by a gain that depends on the factor too.
    wrong = np.abs(found - found[0] - expected + expected[0]).max()
    assert wrong < max(0.01 * largest, 0.05e-3)
    steady = full_speed(run, unit)
    shown = -(plus["innovation"] - minus["innovation"])[steady] / (2.0 * by)
    size = max(np.abs(shown).max(), 0.02 * limits_of(unit).torque)
    assert np.abs(plain[f"torque_by_{FACTORS[k]}"][steady] - shown).max() < 0.15 * size


@pytest.mark.parametrize("name", ["mining-loader boom", "forklift-mast lift", "eha-test-bench axis", "press ram"])
def test_oil_that_is_softer_than_believed_gives_way_under_a_load_that_grows(name):
    """The derivative by compliance while the load changes on the way, against logs followed with other factors."""
    unit, by, k = UNITS[name], 0.01, FACTORS.index("compliance")
    load, share = limits_of(unit).load, min(0.3, 0.4 * UNITS[name].cylinder.stroke / (2.5 * lifting_speed(unit)))
    loads = changing([(0.0, 0.2 * load), (1.2, 0.2 * load), (2.0, 0.6 * load), (2.5, 0.6 * load)])
    run, log = moves(unit, [(0.0, 0.0), (0.3, share), (2.5, share)], loads, lowered(unit, 0.3 * unit.cylinder.stroke))
    plus, minus, plain = with_factors(unit, k, by, run, log)
    grows = (run["time"].values > 1.1) & (run["time"].values < 2.3)
    expected = (plus["position"] - minus["position"])[grows] / (2.0 * by)
    found = np.cumsum(plain["travel_by_compliance"])[grows]
    gives = np.ptp(expected)
    assert gives > 0.5 * 0.4 * load * plain["give"][grows].min()
    assert np.abs((found - found[0]) - (expected - expected[0])).max() < 0.05 * gives


@pytest.mark.parametrize("name", CIRCUITS)
def test_how_much_the_torque_shows_of_a_load_is_what_it_would_be_under_another_one(name):
    unit, observer = UNITS[name], observers(name)
    run, log = cycle(unit)
    begin(observer, float(run["position"][0]))
    observer.track(log.isel(time=slice(0, 20)))
    place, more = observer.sensor.recursion.state.index("load.load"), 1e-4 * limits_of(unit).load
    at = 20
    for until in (60, 75, 100):  # at rest friction hides what would be seen
        observer.track(log.isel(time=slice(at, until)))
        before, sample, at = observer.state.copy(), log.isel(time=slice(until, until + 1)), until
        surprises = []
        for sign in (1.0, -1.0):
            observer.state = before.copy()
            observer.state[place] += sign * more
            surprises.append(observer.track(sample)["innovation"][0])
        observer.state = before
        seen = observer.track(sample)["shows"][0]
        shown = abs(surprises[0] - surprises[1]) / (2.0 * more) / unit.travel_per_radian
        observer.state = before
        assert seen == pytest.approx(min(shown, 1.0), abs=0.1)


def test_a_sample_at_the_same_time_changes_nothing():
    name = "mining-loader boom"
    run, log = cycle(UNITS[name])
    twice = log.isel(time=np.repeat(np.arange(200, 300), 2))
    said = begun(observers(name), run).track(twice)
    states = ("circuit.pressure_chamber_a", "variance", "sensitivities.leak.load")
    for key in ("position", "load", *(f"state_load.{one}" for one in states)):
        assert said[key][2::2] == pytest.approx(said[key][3::2], rel=1e-12), key
    assert said["travel"][3::2] == pytest.approx(np.zeros(99))


def test_friction_at_a_standstill_is_that_of_the_pumps():
    unit, _, _, said = through("eha-test-bench axis")
    run, found = cycle(unit)[0], balance(unit)
    z = np.array([said["position"][-1], *(said[f"state_load.circuit.{name}"][-1] for name in found.states[1:])])
    p = found.parameters_at(list(found.values), WARM)
    up, down = (float(found.torque(z, speed, 0.0, p)) for speed in (3.0, -3.0))
    assert said["hidden"][-1] == pytest.approx(1.25 * 0.5 * (up - down), rel=0.02)
    assert said["hidden"][-1] > 0.0
    turns = full_speed(run, unit, after=0.1)
    own = Assumptions().drive.torque * limits_of(unit).torque
    assert said["noise"][turns].min() == pytest.approx(own, rel=0.2)


def test_a_torque_is_unsure_where_a_valve_may_be_closed_already():
    """A motor that comes to stand: at the speed that it ends with the mast would rest on its valve, not on the pump."""
    unit, _, log, said = through("forklift-mast lift")
    own = Assumptions().drive.torque * limits_of(unit).torque
    speed, steady = log["motor_speed"].values, full_speed(cycle(unit)[0], unit, after=0.5)
    assert np.median(said["noise"][steady]) == pytest.approx(own, rel=0.1)
    stops = np.flatnonzero(
        (speed[:-1] > 0.0) & (speed[:-1] < 5.0) & (speed[1:] < 1e-6) & (log["time"].values[:-1] > 2.0)
    )
    assert stops.size == 1
    assert said["noise"][stops[0]] > 3.0 * own


def test_a_held_piston_shows_the_compliance_in_its_torque():
    unit, by = UNITS["mining-loader boom"], 0.01
    run, log = cycle(unit)
    said = []
    for compliance in (1.0 + by, 1.0 - by, 1.0):
        held = begun(observed(unit, held=1.0, factors=[1.0, 1.0, compliance]), run)
        said.append(held.track(log.isel(time=slice(0, 90))))
    plus, minus, plain = said
    shown = (plus["expected"] - minus["expected"]) / (2.0 * by)
    assert shown.min() < -0.1 * limits_of(unit).torque
    assert plain["torque_by_compliance"] == pytest.approx(shown, abs=0.03 * np.abs(shown).max())
    assert plain["torque_by_leak"].min() < 0.0


@dataclass(frozen=True, kw_only=True)
class Piece:
    """The state of an observer with something done to it in every sample."""

    position: object = leaf("m", None)
    intake: object
    load: object
    unheld: object
    since: object = leaf("s")
    pumped: object = leaf("m")


def piece(unit):
    """An observer's state, sample and model, and what makes a sensor of the state after the sample."""
    model, raw = MachineModel.of(unit, Assumptions()), Raw.symbols()
    load, position = LoadState.initial(model), ca.SX(0.5 * unit.cylinder.stroke)
    first = Piece(position=position, intake=SampleState.initial(), load=load, unheld=UnheldState.initial(load))
    state = symbols(first)
    intake, sample = plain_sample(state.intake, raw)

    def done(after, step, more):
        said = Report(after.position, 0.0, step.motion.velocity, step.load.value, ca.SX(0.0), more)
        return Stepped(close("piece", model.table, raw, first, state, replace(after, intake=intake), said))

    return state, sample, model, done


def observed(unit, *, held=0.0, shift=None, release=False, factors=None):
    """An observer whose piston is held or released, or whose factors change, in every sample."""
    state, sample, model, done = piece(unit)
    piston = Piston(state.position, ca.SX(held), ca.SX(0.0))
    load, step = observe_load(state.load, sample, piston, factors or [1.0] * len(FACTORS), 0.0, model)
    unheld = state.unheld
    if release:
        how = Release(ca.SX(1.0), ca.SX(held), ca.SX(1.0))
        unheld, load, _ = release_load(unheld, load, state.position, how, step.motion.give, model)
    if shift is not None:
        load = shifted(load, dict(zip(FACTORS, shift, strict=True)))
    more = {"carried": (step.load.carried, "N"), "expected": (step.torque.expected, "N m")}
    more |= {f"torque_by_{name}": (by, "N m") for name, by in zip(FACTORS, step.torque_by, strict=True)}
    position = state.position + step.motion.travel
    return done(replace(state, position=position, load=load, unheld=unheld), step, more)


def test_pressures_follow_factors_that_change_by_their_derivatives():
    unit = UNITS["mining-loader boom"]
    run, log = cycle(unit)
    plain = begun(observers("mining-loader boom"), run)
    plain.track(log.isel(time=slice(0, 200)))
    before, sample = plain.state.copy(), log.isel(time=slice(200, 201))
    said = plain.track(sample)
    changes = (0.1, -0.002, 0.2)
    moved = observed(unit, shift=changes)
    names = plain.sensor.recursion.state
    moved.state = np.array(
        [before[names.index(name)] if name in names else 0.0 for name in moved.sensor.recursion.state]
    )
    other = moved.track(sample)
    for name in ("velocity", "pressure_chamber_a", "pressure_manifold_b", "load"):
        by = [said[f"state_load.sensitivities.{factor}.{name}"][0] for factor in FACTORS]
        assert all(value != 0.0 for value in by)
        state = "state_load.load" if name == "load" else f"state_load.circuit.{name}"
        expected = said[state][0] + sum(c * d for c, d in zip(changes, by, strict=True))
        assert other[state][0] == pytest.approx(expected, rel=1e-12), name


def test_a_held_piston_takes_no_load_from_the_torque_and_its_load_is_what_it_carries_when_it_is_let_go():
    unit = UNITS["mining-loader boom"]
    run, log = cycle(unit)
    said = begun(observed(unit, held=1.0), run).track(log.isel(time=slice(0, 200)))
    assert np.abs(said["position"] - said["position"][0]).max() < 1e-6
    assert np.ptp(said["load"]) == 0.0
    assert np.ptp(said["carried"]) > 0.1 * limits_of(unit).load
    said = begun(observed(unit, held=1.0, release=True), run).track(log.isel(time=slice(0, 200)))
    assert said["state_load.load"] == pytest.approx(said["carried"], rel=1e-12)


def test_the_lighter_a_load_is_while_it_is_lowered_the_likelier_the_pump_draws_from_the_tank():
    name = "forklift-mast lift"
    unit = UNITS[name]
    heavy = limits_of(unit).load
    corners = [(0.0, 0.0), (0.5, 0.0), (0.9, -0.25), (4.9, -0.25), (5.3, 0.0), (5.8, 0.0), (6.2, 0.25), (8.0, 0.25)]
    loads = changing([(0.0, 0.3 * heavy), (2.5, 0.3 * heavy), (3.0, 0.004 * heavy)])
    run, log = moves(unit, corners, loads, 0.6 * unit.cylinder.stroke)
    said, _ = followed(name, run, log)
    time, likely, load = run["time"].values, said["empty_share"], said["step_load"]
    assert ((likely >= 0.0) & (likely <= 1.0)).all()
    assert not likely[(time < 2.0) | (time > 6.3)].any(), "it is heavy, or lifted"
    lowers = (time > 3.5) & (time < 4.5) & (likely > 0.0)
    assert lowers.any()
    assert np.corrcoef(load[lowers], likely[lowers])[0, 1] < -0.6, "how well the load is known counts as well"


@pytest.mark.parametrize("shown", [0.0, 0.4, 1.0])
def test_oil_of_a_piston_that_was_not_held_after_all_is_travel_as_far_as_the_torque_does_not_show_it(shown):
    """Held for 0.2 s while the pump delivers, then let go: no oil is lost, and pressures are what the torque shows."""
    unit = UNITS["eha-single-rod axis"]
    run, log = cycle(unit)
    state, sample, model, done = piece(unit)
    since, pumped = state.since, state.pumped
    began = (sample.extending_speed > 20.0) + (since > 0.0)
    now = ca.if_else(began > 0.0, since + sample.elapsed, 0.0)
    held = ca.logic_and(now > 0.0, now < 0.2)
    released = ca.logic_and(since > 0.0, ca.logic_and(since < 0.2, now >= 0.2))
    delivers = ca.if_else(held, pumped + sample.extending_angle * model.travel_per_radian, pumped)
    piston = Piston(state.position, ca.logic_or(held, released), ca.SX(0.0))
    load, step = observe_load(state.load, sample, piston, [1.0] * len(FACTORS), 0.0, model)
    how = Release(released, held, ca.SX(shown))
    unheld, load, came = release_load(state.unheld, load, state.position, how, step.motion.give, model)
    more = {"came": (came, "m"), "released": (released, "1"), "carried": (step.load.carried, "N")}
    position = state.position + step.motion.travel + came
    stepped = done(replace(state, position=position, load=load, unheld=unheld, since=now, pumped=delivers), step, more)
    said = begun(stepped, run).track(log)
    at = int(np.argmax(said["released"]))
    before = int(np.argmax(said["state_since"] > 0.0)) - 1
    compressed = said["carried"][at] - said["carried"][before]
    assert abs(compressed) > 0.1 * limits_of(unit).load
    for name in ("load.circuit.pressure_chamber_a", "load.circuit.pressure_port_a"):
        then, last = said[f"state_{name}"][before], said[f"state_{name}"][at - 1]
        assert said[f"state_{name}"][at] == pytest.approx(then + shown * (last - then), rel=0.15, abs=2e5), name
    assert said["state_load.load"][at] == pytest.approx(said["carried"][before] + shown * compressed, rel=0.02)
    delivered = said["state_pumped"][at]
    assert said["came"][at] == pytest.approx((1.0 - shown) * delivered, rel=0.3), "but for leakage and friction"


def test_a_drive_with_more_noise_is_followed_more_slowly():
    name = "mining-loader boom"
    unit = UNITS[name]
    run, _ = cycle(unit)
    log = report(run, quiet(unit, seed=4, share=0.02))
    spreads = []
    for torque in (0.005, 0.02):
        assumptions = Assumptions(drive=type(Assumptions().drive)(torque=torque))
        said = begun(load_observer(unit, assumptions=assumptions), run).track(log)
        spreads.append(np.std(np.diff(said["load"][full_speed(run, unit)])))
    assert spreads[1] < 0.7 * spreads[0]


@pytest.mark.parametrize("name", FREE)
def test_a_piston_that_turns_has_the_same_load_before_and_after(name):
    """What the oil carries falls by twice the friction."""
    unit = UNITS[name]
    load = 0.4 * limits_of(unit).load
    corners = [(0.0, 0.0), (0.3, 0.0), (0.6, 0.2), (1.6, 0.2), (2.0, -0.2), (3.0, -0.2)]
    run, log = moves(unit, corners, load, lowered(unit, 0.4 * unit.cylinder.stroke))
    said, _ = followed(name, run, log)
    time = run["time"].values
    up, down = (time > 1.2) & (time < 1.6), (time > 2.4) & (time < 3.0)
    friction = rubbed(run, unit)
    assert friction[up].mean() - friction[down].mean() > 0.02 * load
    changed = said["load"][down].mean() - said["load"][up].mean()
    assert abs(changed) < 0.1 * (friction[up].mean() - friction[down].mean())
    fallen = said["carried"][up].mean() - said["carried"][down].mean()
    assert fallen == pytest.approx(friction[up].mean() - friction[down].mean(), rel=0.1)


@pytest.fixture(scope="module")
def tight():
    """A pump that holds its load and leaks nothing, at rest: the observer, its torque and its time."""
    unit = UNITS["eha-test-bench axis"]
    run, log = cycle(unit)
    observer = begun(load_observer(unit, [1e-6, 1.0, 1.0]), run)
    said = observer.track(log)
    after = observer.track(at_rest(log["time"], 5.0, 0.02, float(said["expected"][-1]), 0.0, 0))
    return observer, float(after["expected"][-1]), log["time"] + 5.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_load_that_friction_holds_at_rest_moves_nothing(tight, sign):
    observer, torque, time = tight
    place, still = observer.sensor.recursion.state.index("load.load"), at_rest(time, 0.02, 0.02, torque, 0.0, 0)
    most, travel = UNITS["eha-test-bench axis"].cylinder.coulomb_friction, {}
    with kept(observer) as before:
        carried = observer.track(still)["carried"][0]
        for share in (0.8, 5.0):
            observer.state = before.copy()
            observer.state[place] = carried + sign * share * most
            travel[share] = observer.track(still)["travel"][0]
    assert abs(travel[0.8]) < 1e-9
    assert travel[5.0] * sign < -1e-5


@pytest.mark.parametrize(("period", "share"), [(0.02, 0.1), (0.1, 0.5), (0.5, 1.0)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_torque_within_friction_at_standstill_is_taken_slowly(tight, period, share, sign):
    observer, torque, time = tight
    before = observer.state.copy()
    plain = observer.track(at_rest(time, period, period, torque, 0.0, 0))
    for within, beyond in ((0.5, 0.0), (1.0, 2.0)):
        observer.state = before.copy()
        missed = sign * (within + beyond) * plain["hidden"][0]
        said = observer.track(at_rest(time, period, period, plain["expected"][0] + missed, 0.0, 0))
        expected = sign * (share * within + beyond) * plain["hidden"][0]
        assert said["innovation"][0] == pytest.approx(expected, rel=0.02)
        assert (said["load"][0] - plain["load"][0]) * sign > 0.0
    observer.state = before


def test_a_first_load_is_taken_at_once_though_friction_may_hide_a_part_of_it():
    name = "eha-test-bench axis"
    unit, observer = UNITS[name], observers(name)
    run, log = cycle(unit, 0.7)
    said = begun(observer, run).track(log.isel(time=slice(0, 5)))
    assert (said["hidden"] > 0.0).all()
    assert np.abs(said["innovation"][-1]) < 0.3 * said["hidden"][-1]
    assert said["load"][-1] == pytest.approx(0.7 * limits_of(unit).load, rel=0.15)


@pytest.mark.parametrize("period", [0.02, 0.05])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_whatever_the_drive_says_pressures_and_travel_are_possible(period, sign):
    """A piston that hits its stop at full speed, the watch for contacts asleep: the torque leaps to its limit."""
    name = "eha-test-bench axis"
    unit, observer = UNITS[name], observers(name)
    begin(observer, 0.5 * unit.cylinder.stroke)
    count, relief = round(1.5 / period), limits_of(unit).torque
    time = period * np.arange(count)
    speed = sign * unit.max_speed * np.clip(time / 0.3, 0.0, 1.0)
    torque = np.where(time < 0.6, 0.3, sign * 1.1) * relief
    columns = {"motor_speed": speed, "motor_torque": torque, "oil_temperature": np.full(count, WARM)}
    data = {key: ("time", value) for key, value in columns.items()}
    said = observer.track(xarray.Dataset(data, coords={"time": time}))
    pressures = [said[key] for key in said if key.startswith("state_load.circuit.pressure")]
    assert min(values.min() for values in pressures) >= 0.0
    most = 0.02 * unit.cylinder.stroke + 4.0 * unit.max_speed * unit.travel_per_radian * period
    assert np.abs(said["travel"]).max() < most


def test_a_torque_within_friction_is_the_load_in_the_end(tight):
    observer, torque, time = tight
    before = observer.state.copy()
    plain = observer.track(at_rest(time, 0.02, 0.02, torque, 0.0, 0))
    more = 0.6 * plain["hidden"][0]
    observer.state = before.copy()
    said = observer.track(at_rest(time, 4.0, 0.02, torque + more, 0.0, 0))
    observer.state = before
    grown = more / UNITS["eha-test-bench axis"].travel_per_radian
    assert said["carried"][-1] - plain["carried"][0] == pytest.approx(grown, rel=0.02)
    assert abs(said["carried"][5] - plain["carried"][0]) < 0.7 * grown


@pytest.mark.parametrize("name", FREE)
@pytest.mark.parametrize(("first", "then"), [(0.4, 0.15), (0.2, 0.5)])
def test_a_load_that_changes_at_rest_leaks_as_the_torque_says(name, first, then):
    """Friction hides a part of it for a moment, in which the piston sinks by millimetres."""
    unit = UNITS[name]
    load, stroke = limits_of(unit).load, unit.cylinder.stroke
    up = 0.1 * stroke / (0.25 * unit.max_speed * unit.travel_per_radian)
    corners = [(0.0, 0.0), (0.5, 0.0), (0.9, 0.25), (0.9 + up, 0.25), (1.3 + up, 0.0), (5.3 + up, 0.0)]
    changes = 2.3 + up
    loads = changing([(0.0, first * load), (changes, first * load), (changes + 0.4, then * load)])
    run, log = moves(unit, corners, loads, lowered(unit, 0.4 * stroke))
    _, error = followed(name, run, log)
    before = int(np.searchsorted(run["time"].values, changes))
    assert run["position"].values[before] - run["position"].values[-1] > 2e-3, "it sinks"
    assert abs(error[before]) < 0.05e-3
    assert abs(error[-1]) < 0.2e-3


def test_behind_a_closed_valve_nothing_within_friction_is_taken():
    _, observer, log, _ = through("mining-loader bucket")
    said = observer.track(at_rest(log["time"], 1.0, 0.02, 0.8, 0.0, 0))
    assert (said["hidden"] > 0.8).all()
    assert (said["shows"][-1:] > 0.5).all(), "the other side would show it"
    assert np.abs(said["innovation"]).max() < 1e-3


@pytest.mark.parametrize("at", [200, 350])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_torque_beyond_relief_lets_no_piston_run_away(at, sign):
    """60 kN in one sample, at rest and while it lowers; relief valves carry 23 kN."""
    name = "eha-test-bench axis"
    unit, limits = UNITS[name], limits_of(UNITS[name])
    run, log = cycle(unit)
    plain, _ = followed(name, run, log)
    wild = log.copy(deep=True)
    wild["motor_torque"].values[at] += sign * 60e3 * unit.travel_per_radian
    said, _ = followed(name, run, wild)
    assert said["load"].max() <= limits.load
    assert said["load"].min() >= -limits.pull
    assert sign * (said["asked"] - plain["load"])[at] == pytest.approx(60e3, rel=0.05)
    assert said["load"][at] == (limits.load if sign > 0.0 else -limits.pull)
    assert np.abs(said["travel"]).max() < 0.15 * unit.cylinder.stroke
    assert abs(said["position"][-1] - plain["position"][-1]) < 0.15 * unit.cylinder.stroke
    assert said["load"][-1] == pytest.approx(plain["load"][-1], rel=0.01)


def test_a_load_at_its_limit_does_not_depend_on_the_factors():
    name = "eha-test-bench axis"
    unit, observer = UNITS[name], observers(name)
    run, log = cycle(unit)
    wild = log.copy(deep=True)
    wild["motor_torque"].values[350] += 60e3 * unit.travel_per_radian
    said = begun(observer, run).track(wild)
    for factor in FACTORS:
        assert said[f"state_load.sensitivities.{factor}.load"][350] == 0.0
        assert said[f"state_load.sensitivities.{factor}.load"][349] != 0.0


@pytest.mark.parametrize("name", LOCKED)
def test_factors_change_no_load_while_friction_at_standstill_hides_it(name):
    said = through(name)[-1]
    rest = slice(-10, None)
    assert (said["hidden"][rest] > 0.0).all()
    assert np.abs(said["innovation"][rest]).max() < 1e-3
    for factor in FACTORS:
        assert np.ptp(said[f"state_load.sensitivities.{factor}.load"][rest]) == pytest.approx(0.0, abs=1e-6), factor


@pytest.mark.parametrize("name", LOCKED)
def test_a_piston_that_friction_holds_still_stands_on_oil_that_gives(name):
    """By as much as when it slides: a large load would not be held."""
    unit = UNITS[name]
    run, log = cycle(unit)
    said, _ = followed(name, run, log)
    assert abs(said["state_load.circuit.velocity"][-1]) < 1e-9
    share = said["give"][-5:] / said["give"][full_speed(run, unit)].mean()
    assert (share > 0.3).all()
    assert (share < 1.0).all(), "the valve is closed"


def test_a_torque_corrects_a_load_that_friction_holds(tight):
    """A large change would not be held, so the torque shows it."""
    observer, torque, time = tight
    unit, before = UNITS["eha-test-bench axis"], observer.state.copy()
    place = observer.sensor.recursion.state.index("load.load")
    plain = observer.track(at_rest(time, 0.02, 0.02, torque, 0.0, 0))
    held = before.copy()
    held[place] = plain["carried"][0]
    observer.state = held
    missed = 5e3 * unit.travel_per_radian
    said = observer.track(at_rest(time, 0.02, 0.02, torque + plain["hidden"][0] + missed, 0.0, 0))
    observer.state = before
    assert abs(said["free_travel"][0]) < 1e-9
    assert said["shows"][0] > 0.9
    assert said["load"][0] - plain["carried"][0] > 3e3


@pytest.mark.parametrize("name", CIRCUITS)
def test_an_iteration_begins_with_no_pressure_below_vacuum(name):
    found = balance(UNITS[name])
    z = found.at_rest(0.1, 1e4)
    sunk = z - np.array([1.0 if state in ("position", "velocity") else 1e9 for state in found.states])
    began = np.array(ca.DM(found.possible(sunk)))[:, 0]
    pressures = np.array([state.startswith("pressure_") for state in found.states])
    assert (began[pressures] == 0.0).all()
    assert began[:2] == pytest.approx(sunk[:2])
    assert np.array(ca.DM(found.possible(z)))[:, 0] == pytest.approx(z)


@pytest.mark.parametrize("passive", [False, True])
def test_a_load_that_only_resists_is_none_before_it_is_met(passive):
    unit = UNITS["mining-loader boom"]
    first = LoadState.initial(
        MachineModel.of(replace(unit, cylinder=replace(unit.cylinder, passive=passive)), Assumptions())
    )
    variances = {name: float(ca.evalf(getattr(first, name))) for name in ("variance", "first_variance")}
    assert (variances["variance"] > 0.0, variances["first_variance"] > 0.0) == (passive, not passive)


@pytest.mark.parametrize(
    ("held", "leaves", "goes", "sinks"), [(0, 0, 1, 2e-5), (1, 0, 1, 0.0), (0, 1, 1, 0.0), (0, 0, 0, 0.0)]
)
def test_a_piston_sinks_on_its_pump_alone(held, leaves, goes, sinks):
    """4e-9 m/N by 2e-4 N m/N, where nothing else holds it."""
    free = SimpleNamespace(
        shown=ca.SX(1.0), solution=SimpleNamespace(by_settled_load=lambda: (ca.SX(4e-9),)), torque_by_load=ca.SX(2e-4)
    )
    piston = SimpleNamespace(held=ca.SX(held), leaves=ca.SX(leaves))
    found = _sinking(free, piston, ca.SX(goes), SimpleNamespace(passive=False))
    assert float(ca.evalf(ca.SX(found))) == pytest.approx(sinks)
    assert _sinking(free, piston, ca.SX(goes), SimpleNamespace(passive=True)) == 0.0
