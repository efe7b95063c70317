"""The laws of a reference visit, for numbers and for graphs: which way a stop is pressed, and what is carried on it."""

from types import SimpleNamespace

import casadi as ca
import pytest

from ramsight.control.actuation import Actuation
from ramsight.control.trajectory import Limits
from ramsight.control.tuning import Tuning
from ramsight.control.visiting import Visiting, end_stop, kept_on
from ramsight.plant.limits import limits_of

from .plant_bench import UNITS

RAM, BOOM, BUCKET = (UNITS[name] for name in ("press ram", "mining-loader boom", "mining-loader bucket"))
FELT = 5e4  # N


def actuation(unit=RAM):
    return Actuation(unit, Limits.of(unit), Tuning())


@pytest.fixture(params=[1.0, -1.0])
def lifting(request):
    """A ram that lifts by extending, or by retracting."""
    by = actuation()
    made = Visiting(by)
    made.by = SimpleNamespace(unit=SimpleNamespace(lift_sign=request.param), turning=lambda velocity, load: load)
    return made, request.param


def test_end_stops_of_lifting_and_lowering():
    assert end_stop(BOOM, True) == BOOM.cylinder.stroke
    assert end_stop(BUCKET, False) == BUCKET.cylinder.stroke
    assert end_stop(BOOM, False) == end_stop(BUCKET, True) == 0.0


def test_a_stop_is_pressed_away_from_the_way_there_with_the_load_that_helps_not(lifting):
    laws, sign = lifting
    full = limits_of(RAM)
    share = Tuning().pressing_share
    assert laws.pressing(sign, FELT) == pytest.approx(FELT + share * full.load)
    assert laws.pressing(sign, -FELT) == pytest.approx(share * full.load)
    assert laws.pressing(-sign, FELT) == pytest.approx(-share * full.pull)
    assert laws.pressing(-sign, -FELT) == pytest.approx(-FELT - share * full.pull)


def test_what_presses_a_rod_to_the_stop_the_stop_carries(lifting):
    laws, sign = lifting
    assert kept_on(laws.by, sign, FELT) == FELT
    assert kept_on(laws.by, sign, -FELT) == 0.0
    assert kept_on(laws.by, -sign, -FELT) == -FELT
    assert kept_on(laws.by, -sign, FELT) == 0.0


def test_a_rod_goes_fast_only_while_the_stop_is_surely_far():
    by = actuation()
    laws, limits = Visiting(by), by.limits
    near = limits.landing_zone + 0.5 * limits.speed**2 / limits.acceleration
    step = limits.acceleration * by.period
    assert laws.nearing(0.0, 1.01 * near, 0.0, limits.speed, True) == pytest.approx(step)
    settled = laws.slowly
    for away, std, trusted in ((0.99 * near, 0.0, True), (1.01 * near, near, True), (2.0 * near, 0.0, False)):
        assert laws.nearing(settled, away, std, limits.speed, trusted) == settled
    assert laws.nearing(settled, 1.01 * near, 0.0, limits.speed, True) == pytest.approx(settled + step)
    assert laws.nearing(limits.speed, 0.0, 0.0, limits.speed, True) == pytest.approx(limits.speed - step)


def test_a_stop_is_pressed_once_the_rod_stands_on_it_where_a_pump_holds_the_load():
    laws, surely = Visiting(actuation()), Tuning().surely
    goes, by = laws.by.moving(1e-3, -1.0, FELT), laws.by
    assert laws.speed(1e-3, 0.9 * surely, -1.0, FELT, FELT) == goes
    assert laws.speed(1e-3, 1.1 * surely, -1.0, FELT, FELT) == by.turning(0.0, laws.pressing(-1.0, FELT)) != goes
    behind = Visiting(actuation(BOOM))
    assert behind.speed(1e-3, 1.1 * surely, -1.0, FELT, FELT) == behind.by.moving(1e-3, -1.0, FELT)


def test_a_rod_is_held_when_it_is_slow_after_it_has_set_out():
    laws = Visiting(actuation())
    assert laws.stands(1.2, 0.2 * laws.slowly)
    assert laws.stands(1.2, -0.2 * laws.slowly)
    assert not laws.stands(0.9, 0.0)
    assert not laws.stands(1.2, -0.4 * laws.slowly)


def test_a_stop_may_be_where_the_landing_zone_says():
    laws = Visiting(actuation())
    zone = laws.by.limits.landing_zone
    assert laws.on_the_stop(0.9 * zone)
    assert not laws.on_the_stop(1.1 * zone)


@pytest.mark.parametrize("unit", [RAM, BOOM, BUCKET])
def test_graphs_have_the_numbers(unit):
    by = actuation(unit)
    laws, a, b, c = Visiting(by), *ca.vertsplit(ca.SX.sym("x", 3))
    graphs = {
        "speed": lambda a, b, c: laws.speed(abs(a) * 1e-3, b, c, 1e5 * a, 1e5 * b),
        "pressing": lambda a, b, c: laws.pressing(c, 1e5 * a),
        "kept": lambda a, b, c: kept_on(by, c, 1e5 * a),
        "nearing": lambda a, b, c: laws.nearing(abs(a) * 1e-2, abs(b) * 0.1, abs(a) * 1e-3, by.limits.speed, c > 0.0),
        "stands": lambda a, b, c: laws.stands(b, a * laws.slowly),
        "end": lambda a, b, c: end_stop(unit, c > 0.0),
    }
    for name, law in graphs.items():
        graph = ca.Function(name, [a, b, c], [law(a, b, c)])
        for numbers in ((0.2, 0.3, 1.0), (-0.7, 0.9, -1.0), (1.3, 2.0, -1.0), (-0.1, 0.1, 1.0)):
            assert float(graph(*numbers)) == pytest.approx(float(law(*numbers)), rel=1e-12), name
