"""What is not known of a machine: what references and contacts make likely, and what they do to the position."""

import math
from dataclasses import dataclass, replace
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import norm, truncnorm

from ramsight.engine.typed_state import inlined, leaf, leaves, symbols
from ramsight.expression import any_of
from ramsight.normal import TWO_SIDED_95
from ramsight.plant.symbols import Parameters
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.belief.bank import Bank as State
from ramsight.sensor.belief.bank_state import STEP_QUANTITIES, BankState, StartOfPosition
from ramsight.sensor.belief.hypothesis import BOUNDS as BOUNDS_OF
from ramsight.sensor.belief.measurement import Measurement
from ramsight.sensor.contacts.press import PressState
from ramsight.sensor.covariance import Covariance
from ramsight.sensor.inputs.sample import Raw, SampleState, plain_sample
from ramsight.sensor.kind import KINDS, Kind, covariance_of, state_of
from ramsight.sensor.normal_tail import upper_quantile
from ramsight.sensor.quantity import Quantity
from ramsight.sensor.thresholds import CERTAIN, OTHERWISE, OUTSIDE, RISK
from ramsight.sensor.virtual_sensor import Report, close

from .sensor_bench import Stepped

STROKE = 0.7
QUANTITIES = tuple(Quantity)
POSITION, LEAK, DISPLACEMENT, COMPLIANCE, LAG, EXPONENT, RELEASE, LOW, TOP = range(9)
NAMES = tuple(kind.text for kind in Kind)
BOUNDS = tuple(BOUNDS_OF.values())
STEPS = len(STEP_QUANTITIES)  # factors, lag and exponent
PERIOD = 0.02
INPUTS = (
    "travel", "passes", "passed", "way", "back",
    *(f"travel_by_{k}" for k in range(STEPS)), "noise", "grows", "leak", "floor",
    "told", *(f"row_{k}" for k in range(STEPS)), "surprise", "torque_variance", "inflation",
    "tells_leak", "tells_compliance",
    "place", "low", "top", "variance", "arrived", "doubt", "use", "goes_through", "goes_back", "limit",
    "entered",
)  # fmt: skip
QUIET = dict.fromkeys(INPUTS, 0.0) | {"torque_variance": 1.0, "inflation": 1.0, "variance": 1e-6, "doubt": 0.2}
N = TOP + 1


@dataclass(frozen=True, kw_only=True)
class Fed:
    """The hypotheses, and what the rest of a sensor would hand them as states that are set by hand."""

    position: object = leaf("m", 0.5 * STROKE)
    position_known: object = leaf("1")
    position_variance: object = leaf("m2")
    intake: object
    inputs: object
    bank: object = inlined()


def state_name(name):
    """The state of a hypothesis by its name and what it is of: ``low_weight``, ``low_1``, ``low_covariance_33``."""
    for kind in Kind:
        of = name.removeprefix(f"{kind.text}_")
        if of == name:
            continue
        if of.startswith("covariance_"):
            i, j = (QUANTITIES[int(digit)] for digit in of.removeprefix("covariance_"))
            return covariance_of(kind, i, j)
        return f"hypotheses[{int(kind)}].log_weight" if of == "weight" else state_of(kind, QUANTITIES[int(of)])
    return name


class Model:
    """What the bank asks of a machine model."""

    stroke, assumed, kinds = STROKE, Assumptions(), KINDS


class Bank:
    """The hypotheses alone, fed by hand."""

    def __init__(self):
        raw = Raw.symbols()
        first = Fed(
            intake=SampleState.initial(), inputs=dict.fromkeys(INPUTS, ca.SX(0.0)),
            bank=BankState.initial(Assumptions(), STROKE),
        )  # fmt: skip
        state = symbols(first)
        intake, sample = plain_sample(state.intake, raw)
        x, known = state.inputs, state.position_known
        start = StartOfPosition(ca.logic_not(state.intake.started), known, x["entered"] > 0.0, state.position_variance)
        bank = State.begin(state.bank, Model(), state.position, sample.elapsed, start)
        around = bank.means()
        nominal = state.position + x["travel"]
        by = {one: x[f"travel_by_{k}"] for k, one in enumerate(STEP_QUANTITIES)}
        bank = bank.predicted(x["travel"], by, around, x["noise"], x["grows"], x["leak"])
        bank = bank.with_hypotheses([h.with_covariance(h.covariance.at_least(Quantity.LEAKAGE, x["floor"] ** 2))
                           for h in bank.hypotheses])  # fmt: skip
        bank = bank.confined(nominal, x["passes"], x["passed"]).turned_back(nominal, x["way"])
        room = [bank.room(way, x["passed"]) for way in (ca.SX(-1.0), ca.SX(1.0))]
        nominal = nominal - x["back"]
        row = {one: x["told"] * x[f"row_{k}"] for k, one in enumerate(STEP_QUANTITIES)}
        tells = {Quantity.LEAKAGE: x["tells_leak"] > 0.0, Quantity.COMPLIANCE: x["tells_compliance"] > 0.0}
        torque = Measurement(
            use=any_of(*tells.values()), innovation=x["surprise"], H=row, at=around,
            R=x["torque_variance"] * x["inflation"], gate=CERTAIN, teaches=tells, power=0.0,
        )  # fmt: skip
        bank, _ = bank.update(torque)
        through, back = x["goes_through"] > 0.0, x["goes_back"] > 0.0
        press = PressState(compliance=ca.SX(1.0))
        left = SimpleNamespace(went_on=through, went_back=back, released=through + back, press=press)
        bank = bank.roamed(x["travel"]).left(left, ca.SX(1.0))
        low, top = x["low"] > 0.0, x["top"] > 0.0
        place = Measurement(
            use=x["use"] > 0.0, innovation=x["place"] - nominal,
            H={Quantity.POSITION: 1.0, Quantity.LOW: -x["low"], Quantity.TOP: -x["top"]}, R=x["variance"],
            alternative=ca.log(x["doubt"] / STROKE), arrived=x["arrived"], stands=(nominal, ca.SX(STROKE)),
            teaches={one: True for one in Quantity if one != Quantity.COMPLIANCE},
        )  # fmt: skip
        bank, measured = bank.placed(place, low, top)
        position = nominal + measured.moved
        more = {"taken": measured.accepted, "refused": measured.rejected, "moved": measured.moved}
        below, above = bank.together.band(bank.state.band_width, ca.SX(0.0), bank.reach)
        more |= {
            "band": ca.fmax(below, above) / TWO_SIDED_95, "below": below, "above": above,
            "room_low": room[0], "room_top": room[1], "total": ca.sqrt(bank.variance()),
            "bound": bank.together.bound(bank.state.band_width, ca.SX(0.0)),
            "beyond": bank.together.beyond(x["limit"], bank.state.band_width, ca.SX(0.0), bank.reach),
            "leak": bank.means()[Quantity.LEAKAGE], "exponent": bank.means()[Quantity.EXPONENT],
            "leak_std": bank.factor_std(Quantity.LEAKAGE),
        }  # fmt: skip
        more |= {f"p_{name}": p for name, p in bank.probabilities().items()}
        after = replace(
            state, position=position, position_known=ca.fmax(known, measured.accepted),
            position_variance=bank.variance(), intake=intake, bank=bank.closed(),
        )  # fmt: skip
        outputs = {name: (ca.SX(1.0) * value, "1") for name, value in more.items()}
        said = Report(position, more["band"], 0.0, 0.0, ca.SX(0.0), outputs)
        self._sensor = close("bank", Parameters(), raw, first, state, after, said)
        self._stepped = Stepped(self._sensor)
        self.names = self._sensor.recursion.state
        self._time = 0.0

    def begin(self, position=0.5 * STROKE, std=1e-3, **more):
        """Forget everything; `std` None if the position is not known."""
        self._time = 0.0
        self._stepped.state = self._sensor.initial.copy()
        self.set(position=position, position_known=float(std is not None), position_variance=(std or 0.0) ** 2, **more)
        return self.go()

    def set(self, **states):
        """Other values of states."""
        for name, value in states.items():
            self._stepped.state[self.names.index(state_name(name))] = value

    def go(self, **inputs):
        """One sample; what is said after it."""
        self.set(**{f"inputs.{name}": value for name, value in (QUIET | inputs).items()})
        self._time += PERIOD
        sample = ca.DM([self._time, 0.0, 0.0, 313.0, 0.0, 0.0])
        step = self._sensor.recursion.function()
        new, out = step(self._stepped.state, sample, self._sensor.parameters)
        self._stepped.state = np.array(ca.densify(new))[:, 0]
        return dict(zip(self._sensor.recursion.outputs, np.array(ca.densify(out))[:, 0].tolist(), strict=True))

    def value(self, name):
        """A state."""
        return float(self._stepped.state[self.names.index(state_name(name))])

    def matrix(self, name):
        """The covariance of a hypothesis."""
        full = np.zeros((N, N))
        for i in range(N):
            for j in range(i, N):
                full[i, j] = full[j, i] = self.value(f"{name}_covariance_{i}{j}")
        return full

    def means(self, name):
        """The means of a hypothesis."""
        return np.array([self.value(f"{name}_{k}") for k in range(N)])


@pytest.fixture(scope="module")
def bank():
    return Bank()


CONTACT = {"variance": (3e-4 * STROKE) ** 2, "doubt": Assumptions().stops.obstacle, "use": 1.0}
REFERENCE = {"variance": Assumptions().stops.reference ** 2, "doubt": Assumptions().stops.wrong, "use": 1.0}
ENDS = {"low": (0.0, {"low": 1.0}), "top": (STROKE, {"top": 1.0})}


def at(bank, where, **how):
    """A measurement that says `place` when the piston seems to be at a position; it is brought there first."""
    bank.go(travel=where - bank.value("position"))
    return bank.go(**how)


def entered_at(bank, position):
    """Begin with a position that somebody has entered, with a standard deviation of 1 mm."""
    bank.begin(position)
    bank._stepped.state = bank._sensor.initial.copy()
    bank._time = 0.0
    bank.set(position=position, position_known=1.0, position_variance=1e-6)
    return bank.go(entered=1.0)


@pytest.mark.parametrize("end", ENDS)
def test_a_contact_where_the_description_has_its_end_corrects_the_position(bank, end):
    place, which = ENDS[end]
    bank.begin(std=2e-3)
    before = bank.go()
    said = at(bank, place + 1.5e-3, place=place, **which, **CONTACT)
    assert said["taken"] == 1.0
    assert said["refused"] == 0.0
    assert said["moved"] == pytest.approx(-1.5e-3, rel=0.1)
    assert said["position"] == pytest.approx(place, abs=0.15e-3)
    assert said["band"] < 0.5 * before["band"]
    assert said["p_described"] > 0.5
    expected = np.hypot(Assumptions().stops.std, Assumptions().stops.contact) * STROKE
    assert bank.matrix("described")[POSITION, POSITION] ** 0.5 == pytest.approx(expected, rel=0.2)


@pytest.mark.parametrize("end", ENDS)
def test_beyond_the_cylinders_end_there_is_no_obstacle(bank, end):
    """Six standard deviations inside the end a contact may be with another end; beyond it only with this one."""
    place, which = ENDS[end]
    outwards, moved = (-1.0 if end == "low" else 1.0), []
    for off in (-12e-3, 12e-3):
        bank.begin(std=2e-3)
        bank.go()
        said = at(bank, place + outwards * off, place=place, **which, **CONTACT)
        moved.append(-outwards * float(said["moved"]))
    assert abs(moved[0]) < 1e-3
    assert moved[1] > 11e-3
    assert said["position"] == pytest.approx(place, abs=1e-3)


@pytest.mark.parametrize("end", ENDS)
def test_a_contact_that_nobody_saw_coming_is_at_its_place_and_teaches_little(bank, end):
    """What is not known of the way to it is no error of the place, and no leakage."""
    place, which = ENDS[end]
    learnt, over, std = [], [], []
    for arrived in (0.0, (3e-3) ** 2):
        bank.begin(std=1e-4)
        bank.go(travel_by_0=-0.02)
        said = at(bank, place + 2e-3, place=place, **which, **CONTACT, arrived=arrived)
        assert said["taken"] == 1.0
        learnt.append(bank.means("described")[LEAK] - 1.0)
        over.append(said["position"] - place)
        std.append(bank.matrix("described")[POSITION, POSITION] ** 0.5)
    assert learnt[0] > 0.05
    assert 0.0 < learnt[1] < 0.7 * learnt[0]
    assert abs(over[1]) < 0.1e-3
    assert std[1] == pytest.approx(std[0], rel=0.05)


def test_a_way_that_nobody_measured_ends_nowhere_without_a_contact(bank):
    bank.begin(0.3, std=1e-3)
    before = bank.matrix("described")
    bank.go(arrived=1e-2)
    assert bank.matrix("described")[POSITION, POSITION] < 1.01 * before[POSITION, POSITION]


@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_oil_that_passed_a_valve_takes_the_piston_no_farther_than_a_little_beyond_its_end(bank, way):
    bank.begin(std=1e-3)
    for _ in range(20):
        said = bank.go(travel=0.1 * way, passes=1.0)
    beyond = way * (said["position"] - 0.5 * STROKE) - 0.5 * STROKE
    place = bank.matrix("described")[POSITION, POSITION] + Assumptions().stops.std ** 2 * STROKE**2
    assert beyond == pytest.approx(4.0 * place**0.5 + 5e-3 * STROKE, rel=1e-3)
    assert bank.go(travel=-0.1 * way)["position"] == pytest.approx(said["position"] - 0.1 * way), "and it comes back"


def test_what_may_have_passed_a_valve_takes_it_no_farther_beyond_its_end(bank):
    """Of 11 mm of deviation 10 are by oil that may have passed: they move the end by nothing."""
    far = []
    for passed in (0.0, 10e-3):
        bank.begin(std=11e-3)
        for _ in range(20):
            said = bank.go(travel=0.1, passes=1.0, passed=passed)
        far.append(said["position"] - STROKE)
    assert far == pytest.approx([4.0 * 11e-3 + 5e-3 * STROKE, 4.0 * 1e-3 + 5e-3 * STROKE], rel=1e-2)


@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_a_piston_that_leaves_an_end_is_not_beyond_it(bank, way):
    """It seemed to be 10 mm beyond, with 2 mm of deviation; half of that is left in doubt. What is near stays."""
    end = 0.0 if way > 0.0 else STROKE
    bank.begin(end, std=2e-3)
    bank.go(travel=-way * 10e-3)
    there = bank.go()["position"]
    assert there == pytest.approx(end - way * 10e-3), "while it does not leave"
    said = bank.go(way=way)
    assert said["position"] == pytest.approx(end, abs=1e-9)
    assert bank.matrix("described")[POSITION, POSITION] ** 0.5 == pytest.approx(2e-3 + 5e-3, rel=0.05)
    bank.begin(end, std=2e-3)
    bank.go(travel=-way * 5e-3)
    assert bank.go(way=way)["position"] == pytest.approx(end - way * 5e-3), "within its deviation and half a per cent"
    assert bank.go(way=-way)["position"] == pytest.approx(end - way * 5e-3), "it comes to that end"


@given(position=st.floats(0.0, STROKE), passed=st.floats(0.0, 0.05))
@settings(max_examples=20)
def test_a_piston_has_room_to_a_little_beyond_its_ends(bank, position, passed):
    bank.begin(position, std=1e-2)
    far = 4.0 * max(1e-2 - passed, 0.0) + 5e-3 * STROKE
    said = bank.go(passed=passed)
    assert said["room_low"] == pytest.approx(position + far, abs=1e-4)
    assert said["room_top"] == pytest.approx(STROKE - position + far, abs=1e-4)


@pytest.mark.parametrize("end", ENDS)
def test_a_false_contact_keeps_no_position_from_being_found(bank, end):
    """*Wrong* took something in mid-stroke for an end; then a real end is met 90 mm beyond where it can be."""
    place, how = ENDS[end]
    bank.begin(0.5 * STROKE, std=2e-3)
    at(bank, 0.4 * STROKE, place=place, **CONTACT | how)
    assert bank.matrix("unknown_position")[POSITION, POSITION] ** 0.5 < 1e-3, "it takes it for the end"
    off = place + 0.09 * (1.0 if end == "top" else -1.0)
    said = at(bank, off, place=place, **CONTACT | how)
    assert said["taken"] == 1.0
    assert said["position"] == pytest.approx(place, abs=1e-3)
    assert said["p_described"] > 0.5, "what was wrong is what is described now"


@given(travel=st.floats(-0.2, 0.2))
@settings(max_examples=20)
def test_a_piston_between_its_ends_goes_as_it_goes(bank, travel):
    bank.begin(std=1e-3)
    means = bank.means("top")
    assert bank.go(travel=travel)["position"] == pytest.approx(0.5 * STROKE + travel, abs=1e-12)
    assert bank.means("top")[POSITION] == pytest.approx(means[POSITION], abs=1e-12)


def test_a_contact_that_is_refused_adds_nothing_to_the_doubt(bank):
    """However unsure the way just there is said to be: nothing was measured, and nothing learnt of the way."""
    bank.begin(0.4 * STROKE)
    before = bank.go()["band"]
    said = bank.go(place=0.0, low=1.0, variance=1e-6, arrived=16.0, use=1.0)
    assert said["refused"] > 0.0
    assert said["band"] == pytest.approx(before, rel=1e-3)


@pytest.mark.parametrize("end", ENDS)
def test_contacts_again_and_again_off_an_end_are_an_end_that_is_not_described(bank, end):
    """30 mm inside of where it should be: it becomes likely that the end is there, and no position is moved by it."""
    place, which = ENDS[end]
    inside = place + (0.03 if end == "low" else -0.03)
    bank.begin(std=1e-3)
    likely = []
    for _ in range(5):
        bank.go(travel=0.5 * STROKE - bank.value("position"))
        said = at(bank, inside, place=place, **which, **CONTACT)
        likely.append(said[f"p_{end}"])
        if likely[-1] > 0.5 and len(likely) > 1 and likely[-2] > 0.5:
            assert abs(said["moved"]) < 0.3e-3
        assert said["position"] == pytest.approx(inside, abs=1e-3)
    assert likely[-1] > 0.9
    assert np.all(np.diff(likely) > -0.02)
    other = "top" if end == "low" else "low"
    assert said[f"p_{other}"] < 0.05
    shift = bank.means(end)[LOW if end == "low" else TOP]
    assert shift == pytest.approx(inside - place, abs=1e-3)
    assert abs(bank.means(end)[TOP if end == "low" else LOW]) < 0.3e-3
    elsewhere, how = ENDS[other]
    said = at(bank, elsewhere + 0.2e-3, place=elsewhere, **how, **CONTACT)
    assert said["taken"] == 1.0, "the other end is what it was"


def test_references_that_agree_are_believed_by_the_third(bank):
    bank.begin(std=1e-3)
    taken = []
    for k in range(3):
        where = (0.2, 0.5, 0.35)[k]
        bank.go(travel=where - bank.value("position"))
        wrong = bank.go()["p_unknown_position"]
        said = bank.go(place=where + 0.04 if not any(taken) else where, **REFERENCE)
        taken.append(said["taken"])
        assert said["p_unknown_position"] > wrong or said["taken"]
    assert taken[0] == 0.0, "one reference that contradicts all else is an outlier"
    assert any(taken)
    assert said["band"] < 2e-3


@pytest.mark.parametrize("off", [0.04, -0.1])
def test_a_position_that_is_wrong_is_found_anew(bank, off):
    bank.begin(0.3, std=1e-3)
    bank.go(travel_by_0=5e-3, travel_by_1=0.1)
    assert (bank.matrix("unknown_position")[POSITION, [LEAK, DISPLACEMENT]] != 0.0).all()
    truth, said = 0.3 + off, None
    for _ in range(4):
        said = bank.go(place=truth, **REFERENCE)
        if said["taken"]:
            break
        assert said["position"] == pytest.approx(0.3, abs=1e-6)
    assert said["taken"]
    assert said["position"] == pytest.approx(truth, abs=0.5e-3)
    assert said["p_described"] > 0.5
    assert bank.matrix("unknown_position")[POSITION, POSITION] ** 0.5 > 0.2 * STROKE, "wrong begins anew"
    assert (bank.matrix("unknown_position")[POSITION, LEAK:] == 0.0).all(), (
        "a place that nobody knows depends on nothing"
    )
    assert said["p_unknown_position"] < 0.05


def test_an_outlier_is_refused_and_what_agrees_goes_on(bank):
    bank.begin(0.3, std=1e-3)
    said = bank.go(place=0.5, **REFERENCE)
    assert said["taken"] == 0.0
    assert said["refused"] == 1.0
    assert said["moved"] == 0.0
    assert said["position"] == pytest.approx(0.3, abs=1e-9)
    for _ in range(2):
        said = bank.go(place=0.3005, **REFERENCE)
        assert said["taken"] == 1.0
    assert said["position"] == pytest.approx(0.3003, abs=0.25e-3)
    assert said["p_unknown_position"] < 0.01


def test_nothing_measured_changes_no_weight(bank):
    said = bank.begin(0.3, std=1e-3)
    before = [said[f"p_{name}"] for name in NAMES]
    stops = Assumptions().stops
    both, rare = 1.0 - 2.0 * stops.undeclared, Assumptions().machine.leaks_otherwise
    priors = np.array([both, both * rare / (1.0 - rare), stops.undeclared, stops.undeclared, stops.wrong])
    assert before == pytest.approx(priors / priors.sum())
    for _ in range(10):
        said = bank.go(travel=1e-3)
    assert [said[f"p_{name}"] for name in NAMES] == pytest.approx(before)
    assert said["taken"] == said["refused"] == 0.0


def mixture(bank, low, top):
    """Ends that may be elsewhere, 30 mm below and 20 mm above: what is said, and each probability, place, deviation."""
    bank.begin(0.3, std=1e-3)
    bank.set(top_0=0.02, low_0=-0.03)
    weights = {"described": 1.0 - low - top, "leaks": 1e-9, "low": low, "top": top, "unknown_position": 1e-9}
    bank.set(**{f"{name}_weight": np.log(p) for name, p in weights.items()})
    said = bank.go()
    return said, [(p, bank.value(f"{name}_0"), bank.matrix(name)[0, 0] ** 0.5) for name, p in weights.items()]


@pytest.mark.parametrize(("low", "top"), [(0.3, 0.1), (0.06, 0.005), (0.02, 0.02), (0.012, 1e-6)])
def test_the_truth_is_outside_the_band_by_another_hypothesis_in_one_log_of_a_hundred(bank, low, top):
    said, parts = mixture(bank, low, top)
    half = 1.96 * said["band"]
    outside = [p * (norm.sf((half - x) / std) + norm.sf((half + x) / std)) for p, x, std in parts[1:]]
    assert max(outside) == pytest.approx(OTHERWISE, rel=0.1), "none more, and the band is no wider"


@pytest.mark.parametrize(("low", "top"), [(0.3, 1e-6), (1e-6, 0.3), (0.06, 0.06), (0.004, 0.004)])
def test_a_band_reaches_to_the_side_where_another_hypothesis_is(bank, low, top):
    said, parts = mixture(bank, low, top)
    own = TWO_SIDED_95 * bank.matrix("described")[POSITION, POSITION] ** 0.5
    for end, p, reach in (("below", low, 0.03), ("above", top, 0.02)):
        if p > OTHERWISE:
            assert reach < said[end] < reach + 4.0 * own
        else:
            assert said[end] == pytest.approx(own, rel=0.05)
    assert said["band"] == pytest.approx(max(said["below"], said["above"]) / TWO_SIDED_95)
    for p, x, std in parts[1:]:
        assert p * (norm.cdf((-said["below"] - x) / std) + norm.sf((said["above"] - x) / std)) < 1.6 * OTHERWISE


@pytest.mark.parametrize("probability", [1e-3, 0.01, 0.1, 0.3, 0.5, 0.9, 0.999])
def test_a_quantile_is_that_of_the_normal_distribution(probability):
    assert float(upper_quantile(ca.DM(probability))) == pytest.approx(norm.isf(probability), rel=0.025, abs=1e-9)


def test_the_band_is_that_of_the_likeliest_where_the_others_are_unlikely(bank):
    said, parts = mixture(bank, 0.002, 0.002)
    assert said["band"] == pytest.approx(parts[0][2], rel=0.02)


@pytest.mark.parametrize("end", ENDS)
def test_contacts_at_one_place_are_one_evidence_of_what_is_there(bank, end):
    """An undeclared stop that is met again is as probable as after the first contact: nothing could tell."""
    place, which = ENDS[end]
    bank.begin(std=None)
    said = bank.go(place=place, **which, **CONTACT)
    first = said[f"p_{end}"] / said["p_described"]
    for _ in range(10):
        for _ in range(20):
            bank.go(grows=1e-4)
        said = bank.go(place=place, **which, **CONTACT)
    assert said[f"p_{end}"] / said["p_described"] == pytest.approx(first, rel=0.05)
    assert said["band"] > 0.02 * STROKE, "it may be there as well"


def test_a_persistent_error_grows_beside_what_is_uncertain_for_another_reason():
    x, y = Quantity.POSITION, Quantity.TOP
    covariance = Covariance({(x, x): ca.DM(25.0), (x, y): ca.DM(12.0), (y, y): ca.DM(9.0)})
    assert float(covariance.grown(1.0)[x, x]) == pytest.approx((5.0 + 1.0) ** 2)
    own = 25.0 - 12.0**2 / 9.0
    assert float(covariance.grown(1.0, given=(y,))[x, x]) == pytest.approx(25.0 - own + (own**0.5 + 1.0) ** 2)


def test_a_position_that_went_wrong_may_be_so_by_a_leakage_that_has_grown(bank):
    """After a reference that is sure *unknown position* begins again: no position, and it may leak otherwise."""
    bank.begin(0.3, std=1e-3)
    for _ in range(8):
        bank.go(travel_by_0=-0.1)
        bank.go(place=bank.value("position"), **REFERENCE)
    machine = Assumptions().machine
    assert bank.matrix("described")[1, 1] < (0.1 * machine.leak) ** 2
    assert bank.matrix("unknown_position")[1, 1] == pytest.approx(machine.other_leak**2, rel=0.1)


def test_the_total_is_the_variance_of_the_mixture(bank):
    bank.begin(0.3, std=1e-3)
    bank.set(top_0=0.02, low_0=-0.01)
    said = bank.go()
    p = np.array([said[f"p_{name}"] for name in NAMES])
    p[-1] = 0.0  # one of a thousand counts for nothing
    spread = [bank.matrix(name)[POSITION, POSITION] + bank.means(name)[POSITION] ** 2 for name in NAMES]
    assert said["total"] ** 2 == pytest.approx(float(p @ spread), rel=1e-6)


def test_a_hypothesis_goes_with_its_own_factors(bank):
    """Each goes ahead by what its factors differ from those the step was made with; the likeliest is nominal."""
    bank.begin(0.3, std=1e-3)
    bank.set(**{f"low_{LEAK}": 1.2, f"low_{DISPLACEMENT}": 1.01, f"low_{COMPLIANCE}": 0.8})
    bank.set(**{f"low_{LAG}": Assumptions().thermometer.lag + 20.0})
    bank.set(**{f"low_{EXPONENT}": 0.1})
    rare = Assumptions().machine.leaks_otherwise
    share = 0.1 / (0.8 / (1.0 - rare) + 0.1 + 0.1 + Assumptions().stops.wrong)
    by, off = [-1e-3, 3e-2, 3e-4, 1e-6, 2e-3], np.array([0.2, 0.01, -0.2, 20.0, 0.1])
    bank.go(travel=0.01, **{f"travel_by_{k}": value for k, value in enumerate(by)})
    assert bank.means("described")[POSITION] == 0.0
    assert bank.means("low")[POSITION] == pytest.approx(np.dot(by, off), rel=1e-6)
    assert bank.value("position") == pytest.approx(0.31 - share * np.dot(by, off), abs=1e-9)


def test_a_step_spreads_the_position_by_what_its_derivatives_say(bank):
    bank.begin(0.3, std=1e-3)
    before = bank.matrix("described")
    by = np.array([-1e-3, 2e-2, 3e-4, 1e-6, -2e-3])
    bank.go(travel=0.25, noise=4e-8, grows=0.0, **{f"travel_by_{k}": value for k, value in enumerate(by)})
    after, machine = bank.matrix("described"), Assumptions().machine
    row = np.array([0.0, *by, 0.0, 0.0, 0.0])
    step = np.eye(N)
    step[0] += row
    expected = step @ before @ step.T
    expected[0, 0] += machine.walk**2 * 0.25 + 4e-8
    assert after[0] == pytest.approx(expected[0], rel=1e-9)
    assert after[LEAK, LEAK] - before[LEAK, LEAK] == pytest.approx(machine.leak_walk**2 * PERIOD, rel=1e-6, abs=0.0)
    grown = after[DISPLACEMENT, DISPLACEMENT] - before[DISPLACEMENT, DISPLACEMENT]
    assert grown == pytest.approx(machine.displacement_walk**2 * PERIOD, rel=1e-3, abs=0.0)
    grown = after[COMPLIANCE, COMPLIANCE] - before[COMPLIANCE, COMPLIANCE]
    assert grown == pytest.approx(machine.compliance_walk**2 * PERIOD, rel=1e-3, abs=0.0)
    bank.go(grows=2e-3, leak=0.1)
    wider = bank.matrix("described")
    assert wider[0, 0] ** 0.5 - after[0, 0] ** 0.5 == pytest.approx(2e-3, rel=1e-6)
    assert wider[LEAK, LEAK] - after[LEAK, LEAK] == pytest.approx(0.01, rel=1e-4)


def test_leakage_is_learnt_from_the_way_between_two_references(bank):
    """A machine that leaks 20 % more: the piston is behind where it seems to be, and that is put down to leakage."""
    bank.begin(0.3, std=1e-4)
    for _ in range(6):
        bank.go(travel=0.05, travel_by_0=-0.02)
        believed = bank.go()["leak"]
        off = -0.02 * (1.2 - believed)
        said = bank.go(place=bank.value("position") + off, variance=1e-8, doubt=1e-3, use=1.0)
        assert said["taken"] == 1.0
    assert said["leak"] == pytest.approx(1.2, abs=0.03)
    assert said["leak_std"] < 0.05


def test_each_hypothesis_expects_a_torque_of_its_own(bank):
    bank.begin(0.3, std=1e-3)
    bank.set(**{f"low_{EXPONENT}": 0.1})
    bank.go(told=1.0, row_0=2.0, row_4=5.0, torque_variance=0.01, tells_leak=1.0)
    assert bank.means("low")[LEAK] < 0.9
    assert 1.0 < bank.means("described")[LEAK] < 1.1


def leaks_otherwise(bank, leak, by=-0.02, taught=0):
    """A contact with the top after a way on which leakage has taken `by` [m], for a machine that leaks like that."""
    bank.begin(0.3, std=1e-3)
    for _ in range(taught):
        bank.go(travel_by_0=by)
        bank.go(place=bank.value("position"), **REFERENCE)
    before = bank.matrix("described")
    believed = bank.means("described")[LEAK]
    bank.go(travel_by_0=by)
    said = at(bank, STROKE - by * (leak - believed), place=STROKE, top=1.0, **CONTACT)
    return said, before


def test_beyond_the_cylinders_end_a_machine_surely_leaks_otherwise(bank):
    """No obstacle is there: by the first contact its leakage is known, and the machine is described by it."""
    said, before = leaks_otherwise(bank, 1.8)
    assert said["taken"] == 1.0
    assert said["position"] == pytest.approx(STROKE, abs=0.3e-3)
    assert bank.means("described")[LEAK] == pytest.approx(1.8, abs=0.1)
    assert said["p_described"] > 0.9
    other = Assumptions().machine.other_exponent
    assert bank.matrix("described")[EXPONENT, EXPONENT] ** 0.5 == pytest.approx(other, rel=0.01)
    assert before[LEAK, LEAK] ** 0.5 == pytest.approx(Assumptions().machine.leak, rel=0.01)
    assert bank.matrix("described")[LEAK, LEAK] ** 0.5 < 0.1, "it is learnt now"


@pytest.mark.parametrize("by", [-0.06, -0.2])
@pytest.mark.parametrize("leak", [1.5, 2.0])
def test_a_machine_that_leaks_otherwise_is_found_by_its_second_contact(bank, by, leak):
    """At an end again and again, after ways on which far more leaks: each alone may likelier be an obstacle."""
    bank.begin(0.3, std=1e-3)
    truth, believed = 0.3, 1.0
    for _ in range(2):
        bank.go(travel_by_0=by)
        truth += by * (leak - believed)
        bank.go(travel=-truth)
        said = bank.go(place=0.0, low=1.0, **CONTACT)
        assert abs(said["position"]) < 2.0 * said["band"] + 1e-3
        truth, believed = 0.0, said["leak"]
    assert said["position"] == pytest.approx(0.0, abs=1e-3)
    assert said["p_described"] + said["p_leaks"] > 0.95
    assert said["leak"] == pytest.approx(leak, abs=0.05)


def test_before_a_reference_the_band_holds_a_machine_that_leaks_otherwise(bank):
    machine, way = Assumptions().machine, 0.1
    bank.begin(0.3, std=1e-4)
    said = bank.go(travel_by_0=-way)
    reach = norm.isf(0.5 * OTHERWISE / said["p_leaks"])
    assert 1.96 * said["band"] == pytest.approx(reach * way * machine.other_leak, rel=0.05)
    before = bank.matrix("described")[POSITION, POSITION] ** 0.5
    assert before == pytest.approx(way * machine.leak, rel=1e-2), "what is likeliest is surer"


def test_references_that_are_where_they_should_be_refute_that_it_leaks_otherwise(bank):
    bank.begin(0.3, std=1e-4)
    said = bank.go(travel_by_0=-0.1)
    believed = [said["p_leaks"]]
    for _ in range(3):
        said = bank.go(place=bank.value("position"), **REFERENCE)
        believed.append(said["p_leaks"])
        bank.go(travel_by_0=-0.1)
    assert believed[0] == pytest.approx(0.08, abs=0.02)
    assert believed[1] < 0.4 * believed[0]
    assert believed[-1] < 0.03
    assert bank.go()["band"] < 1.3 * bank.matrix("described")[POSITION, POSITION] ** 0.5


def test_an_obstacle_of_a_usual_machine_is_not_forgotten_for_one_that_leaks_otherwise(bank):
    """In mid-stroke either may be true: both are kept until the next contact, and the band holds both."""
    bank.begin(0.1, std=1e-3)
    bank.go(travel_by_0=-0.05)
    said = at(bank, 0.03, place=0.0, low=1.0, **CONTACT)
    assert said["p_leaks"] > 0.1
    assert bank.means("described")[LEAK] == pytest.approx(1.0, abs=0.01)
    assert abs(said["position"] - 0.03) < 2.0 * said["band"]


def test_an_end_that_is_elsewhere_does_not_refute_that_the_position_is_wrong(bank):
    bank.begin(0.3, std=1e-3, described_weight=-6.0, low_weight=0.0, unknown_position_weight=-4.0)
    bank.go(travel_by_0=-0.1)
    at(bank, 0.03, place=0.0, low=1.0, **CONTACT)
    assert bank.matrix("unknown_position")[POSITION, POSITION] ** 0.5 < 0.01 * STROKE, (
        "it has a place now, and keeps it"
    )


def test_a_machine_that_leaks_almost_as_described_is_one(bank):
    said, before = leaks_otherwise(bank, 1.1)
    assert bank.means("described")[LEAK] == pytest.approx(1.1, abs=0.03)
    assert said["p_leaks"] < 0.1 * said["p_described"]
    after = bank.matrix("described")
    assert after[LEAK, LEAK] < before[LEAK, LEAK]
    assert after[EXPONENT, EXPONENT] <= before[EXPONENT, EXPONENT] * (1.0 + 1e-9)


def test_an_obstacle_is_one_once_the_leakage_is_taught(bank):
    """As far off as the machine that leaks much more, and no leakage is put down to it."""
    said, before = leaks_otherwise(bank, 1.8, by=0.02, taught=6)
    assert before[LEAK, LEAK] ** 0.5 < 0.05
    assert said["p_described"] < 0.5, "an end that is not described"
    assert said["leak"] == pytest.approx(1.0, abs=1e-3)
    assert bank.means("top")[LEAK] == pytest.approx(1.0, abs=1e-3)
    after = bank.matrix("top")
    assert after[LEAK, LEAK] <= before[LEAK, LEAK] * 1.01 + 1e-6
    assert after[EXPONENT, EXPONENT] == pytest.approx(before[EXPONENT, EXPONENT], rel=1e-3)


def test_a_machine_whose_leakage_grows_less_with_pressure_learns_its_exponent(bank):
    """Leakage with the pressure to the power of 0.8, met under small and under large loads."""
    bank.begin(0.3, std=1e-4)
    for k in range(16):
        share = (0.1, 0.9)[k % 2]
        under = np.log(0.3 / share)
        said = bank.go()
        believed = said["leak"] * np.exp(said["exponent"] * under)
        by = -0.02 * believed
        bank.go(travel_by_0=by, travel_by_4=by * under)
        off = -0.02 * (np.exp(0.2 * under) - believed)
        said = bank.go(place=bank.value("position") + off, variance=1e-7, doubt=1e-6, use=1.0)
        assert said["taken"] == 1.0
    assert bank.means("described")[EXPONENT] == pytest.approx(0.2, abs=0.03)
    assert said["leak"] == pytest.approx(1.0, abs=0.04)
    assert bank.matrix("described")[EXPONENT, EXPONENT] ** 0.5 < 0.02


@pytest.mark.parametrize("told", [[LEAK], [COMPLIANCE], [LEAK, COMPLIANCE]])
def test_a_torque_tells_leakage_or_compliance_as_it_is_told_to(bank, told):
    tells = {LEAK: "tells_leak", COMPLIANCE: "tells_compliance"}
    how = {"told": 1.0, "row_0": 2.0, "row_1": 0.5, "row_2": -1.0, "row_4": 0.7}
    how |= {"torque_variance": 0.01, "surprise": 0.2}
    bank.begin(0.3, std=1e-3)
    bank.go(travel_by_0=5e-3, travel_by_1=0.1, travel_by_2=2e-3)
    before, means = bank.matrix("described"), bank.means("described")
    bank.go(**how, **{tells[k]: 1.0 for k in told})
    after, changed = bank.matrix("described"), bank.means("described") - means
    row = np.array([0.0, 2.0, 0.5, -1.0, 0.0, 0.7, 0.0, 0.0, 0.0])
    cross = before @ row
    total, gain = row @ cross + 0.01, np.zeros(N)
    gain[told] = cross[told] / total
    assert changed[LEAK:] == pytest.approx(0.2 * gain[LEAK:], rel=1e-2, abs=1e-12)
    assert changed[LEAK] >= 0.0 >= changed[COMPLIANCE]
    joseph = np.eye(N) - np.outer(gain, row)
    expected = joseph @ before @ joseph.T + np.outer(gain, gain) * 0.01
    scale = np.sqrt(np.outer(np.diag(before), np.diag(before))) + 1e-12
    assert np.abs((after - expected) / scale).max() < 1e-4
    bank.begin(0.3, std=1e-3)
    means = bank.means("described")
    bank.go(**how)
    assert bank.means("described") == pytest.approx(means)


@pytest.mark.parametrize(("told", "learns"), [(0.04, True), (0.3, False)])
def test_a_torque_that_is_impossible_teaches_nothing(bank, told, learns):
    """Leakage is known to 0.05: a torque that says 0.04 more is usual, one that says 0.3 more a fault."""
    bank.begin(0.3, std=1e-3)
    bank.set(**{f"{name}_covariance_11": 0.05**2 for name in NAMES})
    for _ in range(50):
        bank.go(told=1.0, row_0=2.0, torque_variance=1e-4, inflation=10.0, surprise=2.0 * told, tells_leak=1.0)
    for name in NAMES:
        assert (bank.means(name)[LEAK] > 1.0 + 0.3 * told) == learns, name
        assert (bank.matrix(name)[LEAK, LEAK] < 0.02**2) == learns, "nor does it make surer"


def test_samples_that_err_alike_count_as_one(bank):
    """Ten of them with ten times the variance are one of it."""
    learned = []
    for samples, inflation in ((1, 1.0), (10, 10.0)):
        bank.begin(0.3, std=1e-3)
        for _ in range(samples):
            bank.go(told=1.0, row_0=2.0, torque_variance=0.04, inflation=inflation, surprise=0.2, tells_leak=1.0)
        learned.append(bank.matrix("described")[LEAK, LEAK])
    assert learned[1] == pytest.approx(learned[0], rel=0.02)


def test_what_a_contact_corrects_is_not_the_compliance(bank):
    bank.begin(0.3, std=1e-3)
    bank.go(travel=0.1, travel_by_2=5e-3, travel_by_0=-5e-3)
    before = bank.means("described")
    bank.go(place=bank.value("position") + 2e-3, **REFERENCE)
    after = bank.means("described")
    assert after[COMPLIANCE] == before[COMPLIANCE]
    assert after[LEAK] < before[LEAK]


@given(
    weights=st.lists(st.floats(-14.0, 3.0), min_size=len(NAMES), max_size=len(NAMES)),
    places=st.lists(st.floats(-0.05, 0.05), min_size=len(NAMES), max_size=len(NAMES)),
)
@settings(max_examples=25, deadline=None)
def test_the_bound_holds_under_each_hypothesis_as_likely_as_it_is(bank, weights, places):
    """By the separation of solutions, worked out here for itself."""
    states = {f"{name}_weight": weight for name, weight in zip(NAMES, weights, strict=True)}
    states |= {f"{name}_0": place for name, place in zip(NAMES, places, strict=True)}
    said = bank.begin(0.3, std=1e-3, **states)
    reach = []
    for name in NAMES:
        share = said[f"p_{name}"] - (2.0 * Assumptions().stops.wrong if name == "unknown_position" else 0.0)
        if share > RISK:
            std = math.sqrt(bank.matrix(name)[POSITION, POSITION])
            reach.append(abs(bank.means(name)[POSITION]) + std * math.sqrt(2.0 * math.log(share / RISK)))
    assert said["bound"] == pytest.approx(bank.value("band_width") * max(reach), rel=1e-9)


@given(
    st.lists(st.floats(-11.0, 0.0), min_size=5, max_size=5),
    st.lists(st.floats(-0.1, 0.1), min_size=5, max_size=5),
    st.floats(1e-3, 0.1),
)
@settings(max_examples=40, deadline=None)
def test_an_error_beyond_a_limit_is_as_likely_as_all_hypotheses_have_it(bank, weights, places, limit):
    """Against scipy's tails within the cylinder; those of the sensor are an approximation of one per cent.

    The first is the likeliest: where an unknown position is, the ends of its reach are as unsure.
    """
    states = {f"{name}_weight": weight for name, weight in zip(NAMES, (0.0, *weights[1:]), strict=True)}
    states |= {f"{name}_0": place for name, place in zip(NAMES, places, strict=True)}
    bank.begin(0.3, std=1e-3, **states)
    said = bank.go(limit=limit)
    expected = 0.0
    for name in NAMES:
        share = max(said[f"p_{name}"] - (2.0 * Assumptions().stops.wrong if name == "unknown_position" else 0.0), 0.0)
        std = bank.value("band_width") * math.sqrt(bank.matrix(name)[POSITION, POSITION])
        mean = bank.means(name)[POSITION]
        inside = truncnorm((-0.3 - mean) / std, (STROKE - 0.3 - mean) / std, mean, std)
        expected += share * (inside.sf(limit) + inside.cdf(-limit))
    assert said["beyond"] == pytest.approx(expected, rel=0.03, abs=0.015)


def test_a_first_contact_may_be_an_obstacle(bank):
    """Then the position stays unknown, as likely as obstacles are over the density of an end anywhere in the stroke."""
    bank.begin(std=None)
    said = at(bank, 0.4 * STROKE, place=0.0, low=1.0, **CONTACT)
    end = norm.pdf(0.4, 0.0, 0.5)  # over the stroke
    odds = Assumptions().stops.obstacle / end
    assert said["p_unknown_position"] / said["p_described"] == pytest.approx(odds, rel=0.05)
    assert math.sqrt(bank.matrix("unknown_position")[POSITION, POSITION]) == pytest.approx(0.5 * STROKE, rel=1e-6)
    assert math.sqrt(bank.matrix("described")[POSITION, POSITION]) < 2e-3


@pytest.mark.parametrize(
    ("leaves", "factor"), [("goes_through", 1.0 / (2.0 * OUTSIDE)), ("goes_back", OUTSIDE / (1.0 + OUTSIDE))]
)
def test_how_a_piston_leaves_what_held_it_tells_an_end_from_an_obstacle(bank, leaves, factor):
    """By the way alone, for it was not pressed."""
    bank.begin(std=None)
    before = at(bank, 0.4 * STROKE, place=0.0, low=1.0, **CONTACT)
    after = bank.go(**{leaves: 1.0})
    odds = [said["p_unknown_position"] / said["p_described"] for said in (before, after)]
    assert odds[1] == pytest.approx(odds[0] * factor, rel=1e-6)
    again = bank.go(**{leaves: 1.0})
    assert again["p_unknown_position"] == pytest.approx(after["p_unknown_position"]), (
        "a contact is one piece of evidence"
    )


@pytest.mark.parametrize("leaves", ["goes_through", "goes_back"])
def test_an_obstacle_that_was_taken_for_one_tells_nothing(bank, leaves):
    bank.begin(0.4 * STROKE)
    before = bank.go(place=0.0, low=1.0, **CONTACT)
    assert before["taken"] == 0.0
    assert bank.go(**{leaves: 1.0})["p_unknown_position"] == pytest.approx(before["p_unknown_position"])


@pytest.mark.parametrize("way", [0.1, 0.6])
def test_a_way_from_a_first_contact_refutes_places_where_it_does_not_fit(bank, way):
    """Of places that are as likely as each other a way of R leaves the share 1 - R/S."""
    bank.begin(std=None)
    before = at(bank, 0.4 * STROKE, place=0.0, low=1.0, **CONTACT)
    for _ in range(50):
        bank.go(travel=way * STROKE / 50.0)
    after = bank.go(travel=-way * STROKE)
    odds = [said["p_unknown_position"] / said["p_described"] for said in (before, after)]
    assert odds[1] / odds[0] == pytest.approx(1.0 - way, abs=0.02)
    assert bank.go(travel=way * STROKE)["p_unknown_position"] == pytest.approx(after["p_unknown_position"]), (
        "there and back is no new way"
    )


def test_no_way_refutes_a_start_that_was_entered_wrongly(bank):
    """Who mistypes is not as likely wrong by a metre as by a centimetre."""
    before = entered_at(bank, 0.1 * STROKE)["p_unknown_position"]
    assert bank.go(travel=0.8 * STROKE)["p_unknown_position"] == pytest.approx(before)


def test_an_entered_position_may_be_wrong(bank):
    entered = Assumptions().stops.entered
    bank.begin(0.3)
    plain = bank.go()["p_unknown_position"]
    said = entered_at(bank, 0.3)
    described = 1.0 - 2.0 * Assumptions().stops.undeclared
    assert said["p_unknown_position"] / said["p_described"] == pytest.approx(entered / described)
    assert said["p_unknown_position"] > 5.0 * plain
    elsewhere = Assumptions().stops.elsewhere * STROKE
    assert bank.matrix("unknown_position")[0, 0] == pytest.approx(elsewhere**2 + 1e-6), "as a stop that is elsewhere"
    assert bank.matrix("described")[0, 0] == pytest.approx(1e-6)


@pytest.mark.parametrize("off", [0.04, 0.45])
def test_a_start_that_was_entered_wrongly_is_found_by_contacts(bank, off):
    """Near by it is off as a stop that is elsewhere, far off it is another scale's."""
    first = entered_at(bank, 0.5 * STROKE)
    sure = at(bank, off * STROKE, place=0.0, low=1.0, **CONTACT)
    again = at(bank, off * STROKE, place=0.0, low=1.0, **CONTACT)
    assert first["p_unknown_position"] < sure["p_unknown_position"]
    assert again["taken"] or again["p_unknown_position"] > sure["p_unknown_position"]


def test_where_the_start_was_wrong_an_end_may_be_elsewhere_as_well(bank):
    """The start is 40 mm too low, and the machine is stopped 37 mm before the extended end, again and again.

    Then it meets the retracted end. The stop, this end or the start may be elsewhere than described: the bound holds
    both places of the piston.
    """
    entered_at(bank, 0.5 * STROKE)
    for _ in range(3):
        stop = at(bank, STROKE - 0.077, place=STROKE, top=1.0, **CONTACT)
        at(bank, 0.5 * STROKE)
    assert stop["p_top"] > 0.5
    assert stop["p_unknown_position"] > 0.01
    end = at(bank, -0.04, place=0.0, low=1.0, **CONTACT)
    assert end["p_described"] + end["p_unknown_position"] < 0.85
    assert min(end["p_low"], end["p_top"]) > 0.05
    assert end["bound"] > 0.036


@pytest.mark.parametrize("end", ENDS)
def test_a_position_that_was_found_by_one_end_is_as_unsure_as_that_end(bank, end):
    """The start was 40 mm off, and the contact seems to be beyond the end. As without a start, it may be elsewhere."""
    entered_at(bank, 0.5 * STROKE)
    place, which = ENDS[end]
    off = -0.04 if end == "low" else 0.04
    said = [at(bank, where, place=place, **which, **CONTACT) for where in (place + off, place, place)]
    assert abs(bank.value("position") - place) < 0.01
    assert said[-1][f"p_{end}"] == pytest.approx(0.08, abs=0.04)
    assert said[-1]["bound"] > 2.0 * Assumptions().stops.elsewhere * STROKE


@pytest.mark.parametrize(("k", "bound"), list(enumerate(BOUNDS, LEAK)))
def test_factors_stay_within_their_bounds(bank, k, bound):
    for sign, limit in zip((-1.0, 1.0), bound, strict=True):
        bank.begin(0.3, std=1e-4)
        for _ in range(30):
            bank.go(travel_by_0=0.02, travel_by_1=2.0, leak=0.5)
            if k == COMPLIANCE:
                bank.set(**{f"{name}_covariance_33": 0.25**2 for name in NAMES})
                bank.go(told=1.0, row_2=1.0, surprise=1.0 * sign, tells_compliance=1.0, torque_variance=0.01)
            else:
                bank.go(place=bank.value("position") + 0.02 * sign, variance=1e-8, doubt=1e-30, use=1.0)
            for name in NAMES:
                least, most = bound
                assert least - 1e-12 <= bank.means(name)[k] <= most + 1e-12
        if k in (LEAK, COMPLIANCE):  # what this way shows
            assert bank.means("described")[k] == pytest.approx(limit, rel=0.2)


def test_leakage_is_never_better_known_than_its_floor(bank):
    bank.begin(0.3, std=1e-3)
    for _ in range(200):
        said = bank.go(told=1.0, row_0=5.0, tells_leak=1.0, torque_variance=1e-6, floor=0.02)
    assert said["leak_std"] <= 0.0200001
    assert bank.go(floor=0.02)["leak_std"] == pytest.approx(0.02, rel=1e-3)


def test_references_that_contradict_make_the_walk_larger_and_good_ones_smaller_again(bank):
    bank.begin(0.3, std=1e-3)
    grown = []
    for off in (3e-3, 3e-3, 3e-3, *[0.0] * 25):
        before = bank.matrix("described")[LEAK, LEAK]
        bank.go()
        grown.append(bank.matrix("described")[LEAK, LEAK] - before)
        bank.go(place=bank.value("position") + off, **{**REFERENCE, "doubt": 1e-9})
        assert -1.0 <= bank.value("innovations") <= 24.0
    assert max(grown[1:6]) > 1.5 * grown[0]
    assert grown[-1] == pytest.approx(grown[0], rel=0.3)


def test_a_position_that_nobody_knows_is_found_by_the_first_contact(bank):
    said = bank.begin(std=None)
    assert said["band"] > 0.2 * STROKE
    said = at(bank, 0.6, place=STROKE, top=1.0, **CONTACT)
    assert said["taken"] == 1.0
    assert said["position"] == pytest.approx(STROKE, abs=2e-3)


def test_a_weight_that_is_gone_can_come_back(bank):
    bank.begin(0.3, std=1e-3)
    for _ in range(30):
        said = bank.go(place=0.3, **REFERENCE)
    bank.set(low_weight=-50.0)
    bank.go(place=0.3, **REFERENCE)
    assert all(bank.value(f"{name}_weight") >= -12.0 for name in NAMES)
    assert max(bank.value(f"{name}_weight") for name in NAMES) <= 0.1
    moved = 0
    for _ in range(6):
        moved += bank.go(place=0.4, **REFERENCE)["taken"]
    assert moved
    assert said["p_described"] > 0.7


EVENTS = st.lists(
    st.tuples(st.sampled_from(["move", "reference", "low", "top", "torque", "rest"]), st.integers(0, 2**31)),
    min_size=5,
    max_size=30,
)


@settings(max_examples=15)
@given(events=EVENTS, known=st.booleans())
def test_covariances_stay_covariances(bank, events, known):
    """Symmetric by the way they are kept; never negative along any direction, whatever comes."""
    bank.begin(0.3, std=1e-3 if known else None)
    for kind, seed in events:
        rng = np.random.default_rng(seed)
        if kind == "move":
            by = rng.normal(0.0, [2e-3, 5e-2, 1e-3, 1e-5, 2e-3])
            how = {"travel": rng.normal(0.0, 0.05), "noise": 1e-9, "grows": rng.choice([0.0, 1e-3]), "leak": 0.01}
            bank.go(**how, **{f"travel_by_{k}": value for k, value in enumerate(by)})
        elif kind == "reference":
            bank.go(place=bank.value("position") + rng.normal(0.0, 0.01), **REFERENCE)
        elif kind in ENDS:
            place, which = ENDS[kind]
            bank.go(place=place, **which, **CONTACT)
        elif kind == "torque":
            row = {f"row_{k}": value for k, value in enumerate(rng.normal(0.0, 2.0, STEPS))}
            told = {"told": 1.0, "surprise": rng.normal(), "torque_variance": rng.uniform(1e-3, 1.0)}
            bank.go(**row, **told, tells_leak=float(rng.integers(2)), tells_compliance=float(rng.integers(2)))
        said = bank.go(floor=0.01)
        assert all(np.isfinite(value) for value in said.values())
        assert sum(said[f"p_{name}"] for name in NAMES) == pytest.approx(1.0)
        assert said["band"] >= 0.0
        for name in NAMES:
            matrix = bank.matrix(name)
            scale = np.sqrt(np.diag(matrix))
            correlation = matrix / np.outer(scale, scale)
            assert np.linalg.eigvalsh(correlation).min() > -1e-6, name
            assert matrix[POSITION, POSITION] <= STROKE**2 * (1.0 + 1e-9)


def test_a_covariance_is_that_of_a_kalman_filter():
    """Each operation of `Covariance` against the matrices of a textbook."""
    rng = np.random.default_rng(1)
    names = list(Quantity)[:4]
    n = len(names)
    root = rng.normal(size=(n, n))
    start = root @ root.T
    row, noise, h = rng.normal(size=n), rng.uniform(size=n), rng.normal(size=n)
    row[0] = 0.0
    pairs = [(i, j) for k, i in enumerate(names) for j in names[k:]]
    covariance = Covariance({(i, j): ca.SX(start[names.index(i), names.index(j)]) for i, j in pairs})

    def matrix(of):
        return np.array([[float(of[i, j]) for j in names] for i in names])

    def by(values):
        return dict(zip(names, values.tolist(), strict=True))

    moved = covariance.predicted({k: v for k, v in by(row).items() if v}, by(noise))
    step = np.eye(n)
    step[0] += row
    expected = step @ start @ step.T + np.diag(noise)
    assert matrix(moved) == pytest.approx(expected)
    for direction, only in ((h, range(n)), (h[::-1], [0, 2])):
        gain = expected @ direction / (direction @ expected @ direction + 0.3)
        gain[[i for i in range(n) if i not in only]] = 0.0
        moved, changes = moved.updated(by(direction), 0.7, 0.3, True, only=[names[k] for k in only])
        assert [float(changes.get(one, 0.0)) for one in names] == pytest.approx(0.7 * gain)
        joseph = np.eye(n) - np.outer(gain, direction)
        expected = joseph @ expected @ joseph.T + 0.3 * np.outer(gain, gain)
        assert matrix(moved) == pytest.approx(expected)
    assert float(moved.variance(by(h))) == pytest.approx(h @ expected @ h)
    limited = matrix(moved.limited(0.1, names[0]))
    assert limited[0, 0] == pytest.approx(min(expected[0, 0], 0.01))
    assert np.linalg.eigvalsh(limited).min() > 0.0
    unknown = matrix(moved.independent(names[0], 0.5))
    assert unknown[0] == pytest.approx([0.25, 0.0, 0.0, 0.0])
    assert unknown[1:, 1:] == pytest.approx(expected[1:, 1:])
    larger = float(moved.grown(0.2).std(names[0]))
    assert larger == pytest.approx(np.sqrt(expected[0, 0]) + 0.2)


def test_a_quantity_is_absent_by_name_where_it_is_not_declared():
    declared = Assumptions().replace({"thermometer.offset": 5.0, "link_angle.offset": 0.01})
    for with_link, assumptions in ((False, Assumptions()), (False, declared), (True, Assumptions()), (True, declared)):
        state = BankState.initial(assumptions, STROKE, with_link=with_link)
        names = {one.name: one for one in leaves(state)}
        for kind in Kind:
            assert (state_of(kind, Quantity.ANGLE_OFFSET) in names) == with_link
            assert (state_of(kind, Quantity.WARMER) in names) == (assumptions is declared)
            assert names[state_of(kind, Quantity.LEAKAGE)].learned
            assert not names[state_of(kind, Quantity.POSITION)].learned
            assert not names[covariance_of(kind, Quantity.POSITION, Quantity.LEAKAGE)].learned
            assert names[covariance_of(kind, Quantity.LEAKAGE, Quantity.LAG)].learned
            assert names[covariance_of(kind, Quantity.LAG, Quantity.LAG)].variance
            assert not names[covariance_of(kind, Quantity.LEAKAGE, Quantity.LAG)].variance
