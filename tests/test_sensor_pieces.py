"""Small pieces of the sensor alone: oil over a relief valve, a load that nobody sees, and the status."""

from dataclasses import dataclass, fields, replace
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
import xarray
from scipy.stats import chi2

from ramsight.machine import load_machine
from ramsight.normal import TWO_SIDED_95
from ramsight.plant.balance import balance
from ramsight.plant.build import build
from ramsight.plant.limits import limits_of
from ramsight.plant.valve import ReliefValve
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.belief.update import Prediction as Stepped_
from ramsight.sensor.belief.update import Updated, relief_flow
from ramsight.sensor.checks.drive_check import DriveChecks
from ramsight.sensor.circuit.leakage import LeakageState, leakage_law
from ramsight.sensor.circuit.relief import Blown, Relief, blown, relief_probability, relief_tolerance
from ramsight.sensor.circuit.unseen_load import UnseenLoadState, unseen_load
from ramsight.sensor.contacts.contact import look_for_contact
from ramsight.sensor.contacts.contact_release import Holding, ReleaseState, look_for_release
from ramsight.sensor.contacts.contact_state import ContactState, moved
from ramsight.sensor.contacts.mode import Mode
from ramsight.sensor.inputs.intake import Intake
from ramsight.sensor.machine_model import MachineModel, delivers, one_sided
from ramsight.sensor.quantity import Quantity
from ramsight.sensor.report.detectors import DETECTORS
from ramsight.sensor.report.stated import Stated
from ramsight.sensor.report.status_rules import (
    PlausibilityState,
    PositionEstimate,
    conditions_of,
    first_of,
    implausible_torque,
)
from ramsight.sensor.status import Status, validity_levels
from ramsight.sensor.thresholds import CERTAIN, LATEST_SURE, VALVE_SETTLED

from .plant_bench import UNITS
from .sensor_bench import Machine, estimated, fed, made, step_of

BOOM = UNITS["mining-loader boom"]
PERIOD = 0.02


def samples(piece, rows, after=0.0, of="value"):
    """What the piece gives for rows of (speed [rad/s], inputs) of some samples each; all that it gives, if of None."""
    names, found = piece.sensor.recursion.state, []
    for count, speed, inputs in rows:
        for name, value in inputs.items():
            if f"inputs.{name}" not in names:
                continue  # what the drive reports
            piece.state[names.index(f"inputs.{name}")] = value
        time = after + PERIOD * np.arange(1, count + 1)
        data = {"motor_speed": np.full(count, speed), "motor_torque": np.full(count, inputs.get("motor_torque", 0.0))}
        data["oil_temperature"] = np.full(count, inputs.get("warmth", 313.0))
        log = xarray.Dataset({k: ("time", v) for k, v in data.items()}, coords={"time": time})
        said = piece.track(log)
        found.append(said if of is None else said[of])
        after = time[-1]
    return found


def start(piece, **states):
    """Begin again, with these states of the piece."""
    piece.state = piece.sensor.initial.copy()
    for name, value in states.items():
        piece.state[piece.sensor.recursion.state.index(f"piece.{name.replace('__', '.')}")] = value


@dataclass
class Passing:
    """A circuit whose parameters are numbers, as a stage asks for it."""

    balance: object
    values: object

    def __post_init__(self):
        self.assumed = Assumptions()

    def of_circuit(self, name):
        return self.values[name]


def pressed(name, valve, share):
    """A unit's circuit, with a pressure before a relief valve that is this share of its setting above its outlet."""
    found = balance(UNITS[name])
    values = dict(zip(found.parameters, found.values, strict=True))
    z = found.at_rest(0.5 * UNITS[name].cylinder.stroke, 0.0)
    outlet = values["tank.pressure"] if valve.outlet == "tank" else z[found.states.index(f"pressure_{valve.outlet}")]
    z[found.states.index(f"pressure_{valve.inlet}")] = outlet + share * valve.setting
    return ca.DM(z), Passing(found, values)


def valves_of(name):
    return [part for part in UNITS[name].parts() if isinstance(part, ReliefValve)]


@pytest.mark.parametrize("name", UNITS)
def test_oil_may_pass_a_relief_valve_from_a_tenth_below_its_setting(name):
    for share, likely in ((0.5, 0.0), (0.88, 0.0), (0.95, 0.5), (1.0, 1.0), (1.2, 1.0)):
        z, circuit = pressed(name, valves_of(name)[0], share)
        assert float(relief_probability(z, 0.0, circuit)) == pytest.approx(likely, abs=1e-9)


@pytest.mark.parametrize("name", UNITS)
def test_no_oil_passes_a_relief_valve_whose_side_the_pump_draws_from_and_what_it_presses_is_not_the_loads(name):
    for valve in valves_of(name):
        z, circuit = pressed(name, valve, 1.05)
        for way in (1.0, -1.0):
            presses = delivers(circuit.balance, valve.inlet, way)
            assert float(relief_probability(z, 10.0 * way, circuit)) == float(presses)
            if presses:
                assert float(blown(z, ca.DM(10.0 * way), circuit).std) < 1e-9


@pytest.mark.parametrize(
    ("machine", "unit", "place"),
    [("mining-loader", "boom", "manifold"), ("eha-valve-rig", "axis", "chamber")],
    ids=["by the direction of its load", "where its valve leads: its motor would fill its hoses within a sample"],
)
def test_each_way_of_the_pump_presses_on_one_side(machine, unit, place):
    found = balance(build(load_machine(machine).unit(unit), unit))
    for node, way in ((f"{place}_a", 1.0), (f"{place}_b", -1.0)):
        assert (delivers(found, node, way), delivers(found, node, -way)) == (True, False)


@pytest.mark.parametrize("name", UNITS)
def test_only_a_mast_has_its_pump_on_one_side(name):
    assert one_sided(balance(UNITS[name])) == name.startswith("forklift")


@pytest.mark.parametrize("share", [0.93, 0.97, 1.0, 1.02])
@pytest.mark.parametrize("name", UNITS)
def test_a_load_presses_oil_over_a_valve_that_the_pump_draws_from(name, share):
    """Its mean and deviation against a million settings that scatter by their tolerance."""
    unit, valve = UNITS[name], valves_of(name)[0]
    z, circuit = pressed(name, valve, share)
    ways = [way for way in (1.0, -1.0) if delivers(circuit.balance, valve.inlet, way)]
    assert len(ways) == 1
    by_load = blown(z, ca.DM(-10.0 * ways[0]), circuit)
    tolerance = Assumptions().machine.relief
    error = np.random.default_rng(1).normal(size=1_000_000) * tolerance * valve.setting
    flow = valve.conductance * np.maximum((share - 1.0) * valve.setting + error, 0.0)
    area = unit.cylinder.area("a" if ways[0] > 0.0 else "b")
    own = valve.conductance * max(share - 1.0, 0.0) * valve.setting  # the circuit's valve passes that already
    largest = valve.conductance * tolerance * valve.setting / area
    assert -ways[0] * float(by_load.mean) == pytest.approx((flow.mean() - own) / area, abs=0.03 * largest)
    assert float(by_load.std) == pytest.approx(flow.std() / area, abs=0.05 * largest)


def over_a_valve(monkeypatch, by_load, *, speed, travel=0.0, free=0.0, stands=0.0, probability=0.0, room=1.0):
    """The oil over a relief valve in one sample of 20 ms, with these values around it."""
    d, none = ca.DM, ca.DM(0.0)
    monkeypatch.setattr("ramsight.sensor.belief.update.blown", lambda z, speed, model: Blown(*map(d, by_load)))
    state = SimpleNamespace(free_travel=d(free), waiting_std=none, waiting_shift=none)
    sample = SimpleNamespace(
        extending_angle=d(0.02 * speed), extending_speed=d(speed), last_extending_speed=d(speed), elapsed=d(0.02)
    )
    step = SimpleNamespace(z=None, motion=SimpleNamespace(travel=d(travel)))
    contact = SimpleNamespace(hold=SimpleNamespace(held=none, stands=d(stands)), place=SimpleNamespace(found=none))
    met = SimpleNamespace(contact=contact, relief=SimpleNamespace(probability=d(probability), passed_std=none))
    bank, model = SimpleNamespace(room=lambda way, std: d(room)), SimpleNamespace(travel_per_radian=1e-4, stroke=0.5)
    return relief_flow(state, bank, SimpleNamespace(sample=sample, step=step), met, model)


@pytest.mark.parametrize("stands", [0.0, 1.0])
@pytest.mark.parametrize("mean", [-0.05, 0.05])
def test_a_piston_goes_with_the_oil_that_its_load_presses_over_a_valve_unless_it_may_stand(monkeypatch, mean, stands):
    found = over_a_valve(monkeypatch, (mean, 0.03), speed=-10.0, stands=stands)
    elapsed = 0.0 if stands else 0.02
    assert float(found.back) == pytest.approx(-mean * elapsed), "back is against the way that it goes"
    assert float(found.passed) == pytest.approx(0.03 * elapsed)


@pytest.mark.parametrize("room", [0.0, 1e-3, 1.0])
def test_of_oil_over_a_valve_no_more_counts_than_the_piston_has_room_to_move(monkeypatch, room):
    found = over_a_valve(monkeypatch, (0.0, 0.0), speed=100.0, travel=2e-3, free=0.2, probability=1.0, room=room)
    counts = min(2e-3, room)
    assert float(found.back) == pytest.approx(counts), "all of it is expected to have passed"
    assert float(found.passed) == pytest.approx(0.5 * counts)


EXPECTED = 1e4  # N, change of a load at rest


def test_a_valve_may_open_as_far_below_its_setting_as_it_may_pass_oil():
    """At its setting a tenth of the pressure, with 3 % of deviation; where it begins to open nothing."""
    assert relief_tolerance(1.0, 0.03) == pytest.approx(0.1)
    assert relief_tolerance(0.5, 0.03) == pytest.approx(0.05)
    assert relief_tolerance(0.0, 0.03) == 0.0


@pytest.fixture(scope="module")
def resting():
    """What is said of a load that nobody sees: `std` and `most`."""

    def write(state, sample, x):
        step = step_of(shows=x["seen"], value=x["load"], give_alone=x["give"])
        after, found = unseen_load(state, sample, step, x["held"], ca.SX(EXPECTED), x["furthest"])
        return after, {"std": found.std, "most": found.most}

    return fed(("seen", "load", "give", "held", "furthest"), UnseenLoadState(), write)


TURNS = {"seen": 1.0, "give": 1e-7, "held": 0.0}


def test_a_load_that_nobody_sees_may_be_another_one(resting):
    start(resting)
    loaded = TURNS | {"load": 2e4}
    rows = [(30, 50.0, loaded), (10, 0.0, loaded), (5, 0.0, TURNS | {"held": 1.0})]
    turning, rest, on_a_stop = samples(resting, rows, of="std")
    assert turning[0] == pytest.approx(LATEST_SURE * 1e-7 * 1e4), "until the load has been found"
    assert turning[16:] == pytest.approx(np.zeros(14))
    assert rest == pytest.approx(np.full(10, LATEST_SURE * 1e-7 * 1e4))
    assert on_a_stop == pytest.approx(np.zeros(5))


def swinging(usual):
    """A load that is 100 N another one after each rest."""
    return [row for k in range(40) for row in ((30, 50.0, usual | {"load": 2e4 + 100.0 * (k % 2)}), (5, 0.0, TURNS))]


def test_changes_that_were_seen_teach_how_large_the_next_may_be(resting):
    start(resting)
    said = samples(resting, swinging(TURNS), of="std")
    assert said[1][-1] == pytest.approx(LATEST_SURE * 1e-3)
    assert said[3][-1] == pytest.approx(LATEST_SURE * 1e-3 * (5.0 / 6.0 + 1.0 / 72.0) ** 0.5, rel=1e-3), (
        "a sixth is learnt from one change"
    )
    assert said[-1][-1] == pytest.approx(LATEST_SURE * 1e-3 / 12.0**0.5, rel=0.02), "one of twelve may be as large"
    short = samples(resting, [(10, 50.0, TURNS | {"load": 9e4}), (5, 0.0, TURNS)], after=28.0, of="std")
    assert short[-1][-1] == pytest.approx(said[-1][-1], rel=0.02), "too short to be seen"


def test_a_dozen_changes_say_no_more_of_the_next_than_a_dozen_can():
    assert pytest.approx((11.0 / chi2.ppf(0.05, 11)) ** 0.5, abs=5e-3) == LATEST_SURE


def test_the_bound_goes_on_with_the_change_that_was_expected_at_first(resting):
    start(resting)
    usual = TURNS | {"furthest": 1e6}
    said = samples(resting, swinging(usual), of="most")
    assert said[0][16:] == pytest.approx(np.zeros(14)), "while the load is seen"
    assert said[1][-1] == said[-1][-1] == pytest.approx(CERTAIN * TURNS["give"] * EXPECTED)
    (wilder,) = samples(resting, [(30, 50.0, usual | {"load": 9e4})], after=28.0, of="most")
    assert wilder[-1] == 0.0
    (after,) = samples(resting, [(5, 0.0, TURNS)], after=29.0, of="most")
    assert after[-1] > 1.5 * said[-1][-1], "a large change that was seen counts at once"


WRONG = ("speed_wrong", "counter_wrong", "undecided", "torque_wrong", "sign_wrong")
ASKED = (
    *(one.name for one in fields(Intake)), "innovation", "noise", "asked", "hidden", "held", "relief", "passed_std",
    "std", "overall", "settled", "beyond", "position", "disputed", "known", "fault_passed", *WRONG,
)  # fmt: skip
FINE = dict.fromkeys(ASKED, 0.0) | {
    "known": 1.0, "noise": 0.5, "position": 0.3, "std": 1e-3, "overall": 1e-3, "settled": 1e-3, "usable": 1.0,
    "warmth": 313.0,
}  # fmt: skip


@pytest.fixture(scope="module")
def judged():
    model = MachineModel.of(BOOM)
    limits = limits_of(BOOM)
    model = replace(model, relief_load=limits.load, relief_torque=limits.torque, max_speed=limits.max_speed, stroke=0.7)

    def write(state, sample, x):
        step = step_of({name: x[name] for name in ("innovation", "noise", "asked", "hidden")})
        after, implausible = implausible_torque(state, sample, step, ca.logic_not(x["held"]), model)
        checks = DriveChecks(**{name: x[name] for name in WRONG}, declared=True)
        intake = Intake(**{one.name: x[one.name] for one in fields(Intake)})
        at = made(Stepped_, sample=sample, intake=intake, checks=checks, step=step)
        relief = Relief(x["relief"], x["passed_std"])
        updated = made(Updated, relief=relief, fault_passed=x["fault_passed"])
        nothing = {"below": ca.SX(0.0), "bound": ca.SX(0.0)}
        known = {one: x[one] for one in ("overall", "settled", "beyond")}
        said = Stated(**nothing, above=TWO_SIDED_95 * x["std"], **known)
        position = PositionEstimate(x["position"], said, x["known"])
        return after, first_of(conditions_of(at, updated, x["disputed"], position, implausible, model))

    return fed(ASKED, PlausibilityState(), write)


TURN, STAND = 50.0, 0.0
STATUSES = {
    Status.OK: (TURN, {}), Status.REFERENCE_DUE: (TURN, {"settled": 0.008}),
    Status.TOO_UNCERTAIN: (TURN, {"overall": 0.08}), Status.OUTSIDE_TEMPERATURE: (TURN, {"warmth": 400.0}),
    Status.OUTSIDE_SPEED: (1.1 * BOOM.max_speed, {}), Status.TEMPERATURE_LOST: (TURN, {"temperature_bad": 1.0}),
    Status.NEAR_RELIEF: (TURN, {"relief": 0.1}), Status.INPUT_GAP: (TURN, {"gap": 1.0}),
    Status.REFERENCE_REFUSED: (TURN, {"disputed": 1.0}), Status.POSITION_LOST: (TURN, {"passed_std": 0.01}),
    Status.NOT_REFERENCED: (TURN, {"known": 0.0}), Status.OUTSIDE_STROKE: (TURN, {"position": 0.72}),
    Status.IMPLAUSIBLE_TORQUE: (TURN, {"overtorque": 1.0}), Status.IMPLAUSIBLE_SPEED: (TURN, {"overspeed": 1.0}),
    Status.INPUT_STUCK: (TURN, {"stuck": 1.0}), Status.TIME_FROZEN: (TURN, {"frozen": 1.0}),
    Status.INPUT_LOST: (TURN, {"missing": 1.0}), Status.SPEED_WRONG: (TURN, {"speed_wrong": 1.0}),
    Status.COUNTER_WRONG: (TURN, {"counter_wrong": 1.0}), Status.SPEED_CONTRADICTED: (TURN, {"undecided": 1.0}),
    Status.TORQUE_CONTRADICTED: (TURN, {"torque_wrong": 1.0}),
    Status.SIGN_CONTRADICTED: (TURN, {"sign_wrong": 1.0}), Status.FAULT_PASSED: (TURN, {"fault_passed": 1.0}),
}  # fmt: skip


def test_every_detector_is_tried_and_every_status_has_one():
    rows = [one.status for one in DETECTORS]
    assert len(set(rows)) == len(rows)
    assert set(rows) == set(STATUSES) - {Status.OK}
    others = {Status.OK, Status.OUTSIDE_TORQUE, Status.CAVITATION, Status.STATE_INVALID}
    assert set(rows) == set(Status) - others, "of a table, of a balance, and of a graph that ends"


def test_the_worse_comes_later():
    levels = validity_levels([one.status for one in DETECTORS])
    assert (np.diff(levels) >= 0).all()


@pytest.mark.parametrize("status", STATUSES)
def test_every_status_has_its_condition(judged, status):
    start(judged)
    speed, condition = STATUSES[status]
    before, said = samples(judged, [(5, TURN, FINE), (5, speed, FINE | condition)])
    assert (before == Status.OK).all()
    assert (said == status).all()


LOAD = limits_of(BOOM).load
LASTING = {
    "a torque that nothing explains": (TURN, {"innovation": 5.0}, VALVE_SETTLED),
    "a load that cannot be": (TURN, {"asked": -1.4 * LOAD}, 0.15),
}


@pytest.mark.parametrize("what", LASTING)
def test_a_torque_is_implausible_once_it_has_lasted(judged, what):
    speed, condition, lasts = LASTING[what]
    start(judged)
    said = samples(judged, [(2, speed, FINE), (60, speed, FINE | condition), (5, speed, FINE)])
    first = np.argmax(said[1] == Status.IMPLAUSIBLE_TORQUE) * PERIOD
    assert first == pytest.approx(lasts, abs=2.0 * PERIOD)
    assert (said[1][-5:] == Status.IMPLAUSIBLE_TORQUE).all()
    assert (said[2] == Status.OK).all()
    burst = max(1, round(0.7 * lasts / PERIOD))
    start(judged)
    said = samples(judged, [(burst, speed, FINE | (condition if k % 2 else {})) for k in range(12)])
    assert (np.concatenate(said) == Status.OK).all(), "bursts do not add up"
    start(judged)
    said = samples(judged, [(60, speed, FINE | condition | {"held": 1.0})])
    assert (said[0] == Status.OK).all(), "held on a stop"


def test_a_torque_at_rest_that_should_not_be_is_implausible(judged):
    torque = limits_of(BOOM).torque
    start(judged)
    said = samples(judged, [(50, STAND, FINE), (400, STAND, FINE | {"innovation": 0.1 * torque})])
    assert said[1][-1] == Status.IMPLAUSIBLE_TORQUE
    assert (said[1][:20] == Status.OK).all()
    start(judged)
    rubs = {"innovation": 0.1 * torque, "hidden": 0.05 * torque}
    said = samples(judged, [(450, STAND, FINE | rubs)])
    assert (said[0] == Status.OK).all()


def test_the_worst_of_several_is_said(judged):
    start(judged)
    both = {"std": 0.008, "relief": 0.1, "missing": 1.0}
    said = samples(judged, [(5, TURN, FINE | both), (5, TURN, FINE | both | {"missing": 0.0})])
    assert (said[0] == Status.INPUT_LOST).all()
    assert (said[1] == Status.NEAR_RELIEF).all()


USUAL = {"leak": 1.2, "lag": 30.0, "exponent": 0.1, "torque": 0.8, "warmer": 2.0}


@pytest.fixture(scope="module")
def leaks():
    """The factor of leakage, and its derivatives with respect to what is learned."""
    return fed((*LEARNED.values(), "torque"), LeakageState(), leaking)


def leaking(state, sample, x):
    after, law = leakage_law(state, sample, x["torque"], Oily())
    learned = {one: x[name] for one, name in LEARNED.items()}
    learned |= {Quantity.DISPLACEMENT: ca.SX(1.0), Quantity.COMPLIANCE: ca.SX(1.0)}
    by = law.derivatives({"leak": 2.0, "displacement": 3.0, "compliance": 4.0}, learned)
    return after, {"value": law.factors(learned)[0]} | {one.value: value for one, value in by.items()}


class Oily:
    """A machine whose torques are over that at relief pressure, and its oil."""

    relief_torque, viscosity = 1.0, staticmethod(BOOM.oil.viscosity)


LEARNED = dict(zip((Quantity.LEAKAGE, Quantity.LAG, Quantity.EXPONENT, Quantity.WARMER),
                   ("leak", "lag", "exponent", "warmer"), strict=True))  # fmt: skip


def warmed(leaks, of="value", **other):
    """What is said last while the oil becomes 0.05 K a second warmer, for two minutes."""
    start(leaks)
    rows = [(50, 50.0, USUAL | other | {"warmth": 313.0 + 0.05 * k}) for k in range(120)]
    return samples(leaks, rows, of=of)[-1][-1]


def test_noise_of_the_first_temperatures_is_no_change_of_the_oil(leaks):
    start(leaks)
    said = samples(leaks, [(1, 50.0, USUAL | {"warmth": 313.0}), (5, 50.0, USUAL | {"warmth": 313.5})])
    assert said[1] == pytest.approx(np.full(5, said[0][0]), rel=1e-3)


@pytest.mark.parametrize(("k", "name"), LEARNED.items(), ids=LEARNED.values())
def test_derivatives_of_leakage_are_those_of_its_factor(leaks, k, name):
    by = {"leak": 1e-3, "lag": 1e-2, "exponent": 1e-4, "warmer": 1e-3}[name]
    up, down = (warmed(leaks, **{name: USUAL[name] + sign * by}) for sign in (1.0, -1.0))
    assert abs(up - down) > 1e-6
    assert warmed(leaks, of=k.value) == pytest.approx(2.0 * (up - down) / (2.0 * by), rel=1e-5)


def test_what_leakage_has_no_part_in_is_as_it_was(leaks):
    assert warmed(leaks, of=Quantity.DISPLACEMENT.value) == 3.0
    assert warmed(leaks, of=Quantity.COMPLIANCE.value) == 4.0


def watched(x, state, sample, *, lifts=1.0, position=0.3, move=None, **how):
    """A watch over contacts of a piston that goes a tenth of a millimetre per radian, with 500 N of friction."""
    model = Machine(lift=lifts)
    after, contact = look_for_contact(state, sample, step_of(x), estimated(position, **how), model)
    return moved(after, contact, position, ca.SX(0.0 if move is None else move)), contact


HELD = ("shows", "innovation", "noise", "carried", "expected", "empty")


@pytest.fixture(scope="module", params=[1.0, -1.0], ids=["extension lifts", "retraction lifts"])
def holding(request):
    """A watch over a piston that is held at its upper stop, and which way it lifts."""

    def write(state, sample, x):
        after, contact = watched(x, state, sample, lifts=request.param)
        return after, contact.hold.released

    return fed(HELD, ContactState(), write), request.param


PRESSED = {"shows": 1.0, "noise": 0.5, "carried": 2e4, "innovation": 0.0, "empty": 0.0}


def rested(holding, rows, speed=0.0):
    """When a piston that was held under 20 kN is let go, in samples of these rows; None if it is not."""
    watch, lifts = holding
    held = Mode.HELD_EXTENDING if lifts > 0.0 else Mode.HELD_RETRACTING
    start(watch, mode=float(held), release__load_least=2e4, release__load_largest=2e4)
    said = np.concatenate(samples(watch, [(count, lifts * speed, PRESSED | how) for count, how in rows]))
    return int(np.argmax(said)) if said.any() else None


def test_a_held_piston_leaves_when_its_oil_carries_less_than_its_load(holding):
    assert rested(holding, [(20, {"carried": 3e4})]) is None, "pressed"
    assert rested(holding, [(20, {"carried": 2e4 - 400.0})]) is None, "friction holds it"
    assert rested(holding, [(20, {}), (5, {"carried": 2e4 - 600.0})]) == 20
    assert rested(holding, [(20, {"carried": 2e4 - 600.0})], speed=50.0) is None, "it is pushed"


def test_a_piston_that_is_pushed_is_let_go_by_a_torque_that_stays_behind_and_by_no_other(holding):
    """A relief valve may open above its setting: the torque is larger then, and nothing yields."""
    _, lifts = holding
    begins = (10, {"expected": lifts * 8.0})
    assert rested(holding, [begins, (40, {"expected": lifts * 8.1, "innovation": lifts * 5.0})], speed=50.0) is None
    assert rested(holding, [begins, (40, {"expected": lifts * 7.9, "innovation": lifts * 5.0})], speed=50.0) is None
    assert rested(holding, [begins, (5, {"expected": lifts * 8.1, "innovation": -lifts * 5.0})], speed=50.0) == 10


LOOKED = ("travel", "free_travel", "carried", "value", "empty", "relief", "place", "noise")
PLACE = ("position", "evidence", "found", "std")
SEEN = {"noise": 1e-5, "give": 1e-8, "bounce": 0.01, "shows": 1.0}


def seen(x):
    """What the observer finds of these inputs; its noise is that of the position."""
    step = step_of({**SEEN, **{n: x[n] for n in x if n in ("travel", "free_travel", "carried", "value", "empty")}})
    return replace(step, torque=replace(step.torque, noise=ca.SX(0.5)))


@pytest.fixture(scope="module")
def looking():
    """A watch whose step is set by hand, and what it finds of the contact."""

    def write(state, sample, x):
        now = estimated(x["place"], relief=x["relief"])
        after, contact = look_for_contact(state, sample, seen(x), now, Machine())
        place = {f"place_{name}": getattr(contact.place, name) for name in PLACE}
        return moved(after, contact, x["place"], ca.SX(0.0)), place

    return fed(LOOKED, ContactState(), write)


def looked(looking, speed, rows, **states):
    """What a watch in these states finds of the last of samples; the piston is at 2 mm, and does not move."""
    start(looking, **states)
    still = dict.fromkeys(LOOKED, 0.0) | {"place": 2e-3, "carried": 2e4, "value": 2e4}
    last = samples(looking, [(count, speed, still | how) for count, how in rows], of=None)[-1]
    return {name: float(last[f"place_{name}"][-1]) for name in PLACE}


def place(position, std=0.0):
    """A place that was found, with no evidence that it is an end."""
    return pytest.approx({"position": position, "evidence": 0.0, "found": 1.0, "std": std})


LEFT = {"mode": float(Mode.LEAVING), "held_at": 5e-3, "left_from": 2e-3, "came": -0.014, "turned": 1.0}


def test_a_contact_before_the_piston_was_away_is_where_it_was_held_before(looking):
    assert looked(looking, -50.0, [(2, {"relief": 1.0})], gone=0.0, **LEFT) == place(5e-3)
    away = LEFT | {"mode": float(Mode.MOVING)}
    assert looked(looking, -50.0, [(2, {"relief": 1.0})], gone=1.0, **away) == place(2e-3)


def test_a_piston_held_again_soon_after_it_went_on_may_not_have_moved(looking):
    """It was held at 5 mm and seems to stand at 2 mm: 3 mm are its deviation there; far away it is another contact."""
    for held_at, std in ((5e-3, 3e-3), (2e-3 + 0.051 * Machine().stroke, 0.0)):
        state = LEFT | {"mode": float(Mode.MOVING), "went_on": 1.0, "held_at": held_at}
        said = looked(looking, -50.0, [(2, {"relief": 1.0})], gone=1.0, **state)
        assert {name: abs(value) for name, value in said.items()} == place(2e-3, std)


def test_where_no_oil_gives_a_force_a_piston_stands_where_it_last_did(looking):
    """The oil carried the load at 3 mm; now the pump goes on in vain, and the piston seems to stand at 2 mm."""
    goes, in_vain = (20, {"travel": -1e-3, "free_travel": -1e-3}), (1, {"free_travel": -1e-2, "carried": 0.0})
    drained = (1, {"empty": 1.0, "carried": 0.0, "travel": -1e-3})
    assert looked(looking, -50.0, [goes, drained, in_vain], gone=1.0) == place(3e-3, -0.1 * 1e-3)
    assert looked(looking, -50.0, [goes, in_vain], gone=1.0) == place(2e-3)


def test_a_held_piston_has_left_when_its_torque_stays(holding):
    """A closed volume would let it sink from 8 N m; this one stays where it was, but for 0.5 N m of noise."""
    begins = {"expected": 8.0}
    assert rested(holding, [(10, begins), (10, {"expected": 3.0, "innovation": 5.0})]) == 10
    assert rested(holding, [(10, begins), (40, {"expected": 5.0, "innovation": 3.0})]) is None, (
        "noise, and a softer oil"
    )
    assert rested(holding, [(10, begins), (40, {"expected": 3.0, "innovation": 1.0})]) is None, (
        "it is where it should be"
    )
    assert rested(holding, [(10, begins), (40, {"expected": 3.0, "innovation": -5.0})]) is None, "it lost more"
    sank = {"motor_torque": -5.0}
    assert rested(holding, [(10, begins), (40, {"expected": 3.0, "innovation": 5.0} | sank)]) is None, "it sank as well"


FOUND = ("released", "went", "pressed", "shown", "travel_std")
GRIP = (
    "shows", "innovation", "noise", "carried", "expected", "free_travel", "value", "give",
    "turns", "keeps", "back", "compliance",
)  # fmt: skip


@pytest.fixture(scope="module")
def gripping():
    """What holds a piston that was stopped while it extends, fed by hand; 0.1 mm per radian."""

    def write(state, sample, x):
        piston = Holding(ca.SX(1.0), ca.SX(1.0), x["turns"], x["keeps"], x["back"], x["compliance"])
        after, grip = look_for_release(state, sample, step_of({n: x[n] for n in GRIP[:8]}), piston, Machine())
        return after, {name: getattr(grip, name) for name in FOUND}

    return fed(GRIP, ReleaseState(), write)


def gripped(gripping, speed, rows, **states):
    """What is found in each sample."""
    start(gripping, **states)
    usual = dict.fromkeys(GRIP, 0.0) | {"noise": 0.1, "turns": float(speed != 0.0), "keeps": 1.0, "shows": 1.0}
    usual |= {"compliance": 0.25, "give": 1e-6}
    said = samples(gripping, [(count, speed, usual | how) for count, how in rows], of=None)
    return SimpleNamespace(**{name: np.concatenate([one[name] for one in said]) for name in FOUND})


def test_a_piston_that_was_held_by_mistake_went_what_the_pump_delivered(gripping):
    """The torque stays at 5 N m while 10 are expected; the pump goes 50 rad/s, and 1 mm/s leaked before."""
    follows = (10, {"expected": 5.0})
    behind = (10, {"expected": 10.0, "innovation": -5.0})
    said = gripped(gripping, 50.0, [follows, behind], leakage=1e-3, pushing_began=5.0)
    assert not said.released[:10].any()
    assert said.released[10] == 1.0, "the sample at which it is behind"
    assert not said.went[:10].any()
    # Nothing releases the piece itself here, so that it goes on.
    assert said.went[10:] == pytest.approx((50.0 * 1e-4 - 1e-3) * PERIOD * np.arange(1, 11), rel=1e-6)


def test_what_it_went_counts_from_where_the_torque_stays_behind(gripping):
    """What gave way at last was an obstacle until then: the torque followed."""
    builds = (10, {"expected": 10.0, "innovation": -1.0})
    said = gripped(gripping, 50.0, [(1, {"expected": 0.0}), builds, (1, {"expected": 10.0, "innovation": -9.0})])
    last = {"released": 1.0, "went": 50.0 * 1e-4 * PERIOD, "pressed": 0.0, "shown": 0.1, "travel_std": 0.0}
    for name, values in vars(said).items():
        assert values[-1] == pytest.approx(last[name]), name
        assert (values[:-1] == (1.0 if name == "shown" else 0.0)).all(), name


def test_a_piston_went_no_farther_than_what_the_torque_and_an_unknown_compliance_hide(gripping):
    """Of 10 N m that pushing asks for 9 are missing, and 2.5 more may be: with 0.1 of noise, at 0.1 mm a N m."""
    pushed = (20, {"expected": 15.0, "innovation": -9.0, "give": 1e-8})
    said = gripped(gripping, 50.0, [(1, {"expected": 5.0}), pushed], pushing_began=5.0)
    assert said.went[-1] == pytest.approx(11.6e-4), "of 2 mm that the pump delivered"


def test_a_piston_that_pushes_is_let_go_by_what_is_known_of_the_compliance(gripping):
    """Of 10 N m that a closed volume asks for 7 are there: a soft machine may give so much, a known one does not."""
    behind = {"expected": 10.0, "innovation": -3.0}
    said = [gripped(gripping, 50.0, [(1, {}), (1, behind | {"compliance": c})]) for c in (0.25, 0.05)]
    assert [one.released[-1] for one in said] == [0.0, 1.0]
    assert [one.shown[-1] for one in said] == pytest.approx([1.0, 0.7])


def test_however_soft_it_is_a_closed_volume_has_its_pressure_in_the_end(gripping):
    """6 N m of 10 are there: an unknown compliance explains that while the volume fills, and not for long after."""
    behind = {"expected": 10.0, "innovation": -4.0}
    shut, may_open = (10, behind), (20, behind | {"back": 0.01})
    said = gripped(gripping, 50.0, [(1, {}), shut, may_open])
    # 0.1 mm a sample: 1 mm filled it; it may be softer by four deviations of 25 %, and 2 mm fill it surely.
    assert np.flatnonzero(said.released)[0] == 21
    assert said.released[21:].all()
    still_shut = gripped(gripping, 50.0, [(1, {}), (30, behind)])
    assert not still_shut.released.any(), "it may still fill"


def test_a_piston_that_was_pressed_on_its_end_keeps_the_pressure_that_the_torque_shows(gripping):
    """Pressed with 400 kN, of which 40 N m show at 0.1 mm/rad, the motor creeps on: 4 N m less are a tenth, not all."""
    pressed = {"carried": 400e3, "unknown": 1.0, "expected": 40.0}
    rows = [(1, pressed), (1, pressed | {"expected": 40.5, "innovation": -4.0, "compliance": 0.05})]
    said = gripped(gripping, 50.0, rows, pushing_began=40.0)
    assert said.released[-1] == 1.0
    assert said.shown[-1] == pytest.approx(0.9)


def test_at_rest_the_share_of_what_leaked_that_the_torque_shows_is_told(gripping):
    """40 N m of 50 would have leaked away, and 4 did."""
    first = (2, {"turns": 0.0, "expected": 50.0})
    later = {"turns": 0.0, "expected": 10.0, "innovation": 36.0}
    said = gripped(gripping, 0.0, [first, (1, later)], rest__held=0.0)
    assert said.shown[-1] == pytest.approx(0.0, abs=1e-9), "the shown torque is the report's, which stays at nothing"


def test_a_piston_that_is_drawn_from_its_end_may_have_gone_as_much_as_the_compliance_is_unknown(gripping):
    said = gripped(gripping, -10.0, [RESTS, (5, TIGHT)], **LOADS)
    assert said.travel_std == pytest.approx(0.25 * 10.0 * 1e-4 * PERIOD * np.arange(6), rel=1e-6)


def test_a_valve_that_opens_early_lets_no_piston_go(gripping):
    began, behind = {"pushing_began": 40.0}, {"expected": 50.0, "innovation": -8.0}
    said = [gripped(gripping, 50.0, [(5, behind | {"back": back})], **began) for back in (0.0, 0.1)]
    assert [one.released[-1] for one in said] == [1.0, 0.0], "5 N m by compliance, 5 by the valve"


LOADS = {"load_least": 2e4, "load_largest": 2e4}
TIGHT = {"carried": 1e5, "expected": 50.0}
RESTS = (1, TIGHT | {"turns": 0.0})


def test_a_motor_that_turns_back_frees_no_piston_that_the_oil_still_presses_on_its_stop(gripping):
    """It carried 20 kN, and the oil presses with 100; it goes once that is down to 20 and friction, not before."""
    falls = [(1, {"carried": force, "expected": 5e-4 * force}) for force in np.linspace(1e5, 1e4, 19)]
    said = gripped(gripping, -10.0, [RESTS, (5, TIGHT), *falls], **LOADS)
    forces = np.r_[np.full(6, 1e5), np.linspace(1e5, 1e4, 19)]
    assert said.released.tolist() == (forces - 2e4 < -500.0).astype(float).tolist()


def test_a_torque_that_does_not_fall_frees_a_piston_whose_motor_turns_back(gripping):
    """40 N m are expected after 50; 43 is compliance, 48 is a piston that goes with a load that has grown at rest."""
    for shown, free in ((43.0, 0.0), (48.0, 1.0)):
        how = {"carried": 8e4, "expected": 40.0, "innovation": shown - 40.0}
        said = gripped(gripping, -10.0, [RESTS, (5, TIGHT), (1, how)], **LOADS)
        assert said.released[-1] == free
        assert not said.released[:-1].any()
        known = gripped(gripping, -10.0, [RESTS, (5, TIGHT), (1, how | {"compliance": 0.05})], **LOADS)
        assert known.released[-1] == 1.0, "the better the compliance is known the sooner"


def test_a_torque_that_does_not_rise_frees_a_piston_that_is_pulled_off_by_the_other_side(gripping):
    how = {"carried": 1e5, "expected": -40.0, "innovation": 25.0}
    shut = TIGHT | {"expected": 0.0}
    said = gripped(gripping, -10.0, [(1, shut | {"turns": 0.0}), (5, shut), (1, how)], **LOADS)
    assert said.released.tolist() == [0.0] * 6 + [1.0]


def test_while_a_valve_opens_a_torque_that_comes_sooner_frees_nothing(gripping):
    said = gripped(gripping, -10.0, [RESTS, (1, TIGHT | {"expected": 0.3, "innovation": 6.0}), (3, TIGHT)], **LOADS)
    assert not said.released.any()


def test_no_piston_is_held_for_longer_than_its_oil_can_give_back(gripping):
    """80 kN at 1 um/N are 80 mm of travel: after five times as much the model is wrong, whatever its pressures say."""
    said = gripped(gripping, -100.0, [RESTS, (4000, TIGHT)], **LOADS)
    first = int(np.argmax(said.released))
    assert said.released[first:].all()
    assert first * 100.0 * 1e-4 * PERIOD == pytest.approx(5.0 * 8e4 * 1e-6, rel=0.02)


def test_leakage_is_remembered_from_when_the_piston_went(gripping):
    """2 mm/s less than the pump delivers, for long enough; a piston that stands teaches nothing of it."""
    goes = {"keeps": 0.0, "free_travel": (50.0 * 1e-4 - 2e-3) * PERIOD}
    rows = [(500, goes), (100, {"free_travel": 0.0}), (1, {"expected": 10.0, "innovation": -9.0})]
    said = gripped(gripping, 50.0, rows)
    assert said.went[-1] == pytest.approx((50.0 * 1e-4 - 2e-3) * PERIOD, rel=1e-3)


SOFT = ("travel", "free_travel", "relief", "place", "compliance", "unseen")


@pytest.fixture(scope="module")
def giving():
    """A watch over a piston that presses on something which gives, 0.7 m of stroke, 1 mm of deviation."""

    def write(state, sample, x):
        now = estimated(x["place"], relief=x["relief"], compliance=x["compliance"], unseen=x["unseen"])
        after, contact = look_for_contact(state, sample, seen(x), now, Machine())
        return moved(after, contact, x["place"], ca.SX(0.0)), contact.place.found

    return fed(SOFT, ContactState(), write)


def gives(giving, **how):
    """What is said in a second of a piston of which a third of what is delivered seems to be travel."""
    start(giving)
    usual = {"travel": 1e-4, "free_travel": 3e-4, "relief": 0.0, "place": 0.699, "compliance": 0.25, "unseen": 1e9}
    return samples(giving, [(50, 50.0, usual | how)])[0]


def found(said):
    return bool((said >= 1.0).any())


def test_a_machine_that_gives_more_than_described_finds_its_end(giving):
    """Near an end, once the load has changed by more than is usual or is near the relief valve's; nowhere else."""
    assert not found(gives(giving)), "a load that grows takes a part of the oil as well"
    assert found(gives(giving, relief=0.1)), "hardly a load is as large as that"
    assert found(gives(giving, unseen=1e4)), "20 kN by 0.2 mm/kN take 4 mm"
    assert not found(gives(giving, unseen=1e4, place=0.5)), "there is no end"
    assert not found(gives(giving, unseen=1e4, compliance=0.1)), "it is known that it does not give so much"
    assert found(gives(giving, travel=4e-5)), "a seventh may slip anywhere"


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_places_that_are_kept_go_with_the_position(way):
    """A reference moves it by 3 mm: what it left, and where it was held, were as wrong as that."""

    def write(state, sample, x):
        return watched({}, state, sample, move=way * 3e-3)[0], 0.0

    piece = fed((), ContactState(), write)
    names = piece.sensor.recursion.state
    start(piece, left_from=0.2, held_at=0.2)
    samples(piece, [(2, 0.0, {})])
    for name in ("piece.left_from", "piece.held_at"):
        assert piece.state[names.index(name)] == pytest.approx(0.2 + 2 * way * 3e-3), name
