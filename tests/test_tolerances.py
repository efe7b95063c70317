"""Tolerances: read from a description, turned into distributions, spread evenly, correlated."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from ramsight import machine
from ramsight.errors import DescriptionError, UnknownNameError
from ramsight.machine.as_toml import as_toml
from ramsight.machine.declare import quantity
from ramsight.machine.spread import DISTRIBUTIONS, Spread, read_spread
from ramsight.machine.tolerances import KINDS
from ramsight.study.datasheet.quantities import COVERS, default_text, varied
from ramsight.study.datasheet.study_plan import correlation_of, points, value_at, values_at

TEXT = machine.template().partition("\n[units.boom.tolerances]")[0]
ETA = quantity("1", "efficiency", above="0.5", most="1")


def with_tolerances(text):
    return machine.loads(f"{TEXT}\n[units.boom.tolerances]\n{text}\n")


@pytest.mark.parametrize(
    ("text", "declared", "centre", "half", "distribution"),
    [
        ("± 0.02", ETA, 0.9, 0.02, "uniform"),
        ("± 2 % normal", ETA, 0.9, 0.018, "normal"),
        ("0.8 ± 0.1 triangular", ETA, 0.9, 0.1, "triangular"),
        ("±10% log-normal", ETA, 0.9, 0.09, "log-normal"),
        ("± 0.5 %", quantity("%", "air", least="0 %", most="20 %"), 0.01, 0.005, "uniform"),
        ("40 degC ± 15 K", quantity("degC", "oil", least="-60 degC", most="200 degC"), None, 15.0, "uniform"),
        ("± 0.1 mm", quantity("mm", "bore", above="0 mm", most="1 m"), 0.127, 1e-4, "uniform"),
    ],
)
def test_a_tolerance_is_read(text, declared, centre, half, distribution):
    found = read_spread(text, declared, centre)
    assert (found.half, found.distribution) == (pytest.approx(half), distribution)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("20 %", "is no tolerance"), ("±", "is no tolerance"), ("± 0 %", "more than 0"), ("± -1 %", "more than 0"),
        ("± 5 % gaussian", "not a unit"), ("± 3 kg", "kg"), ("3 ± 0.1", "leaves no value"), ("± nan", "expected"),
        (3, "is no tolerance"),
    ],
)  # fmt: skip
def test_what_is_no_tolerance_is_refused_in_one_line(text, words):
    with pytest.raises(DescriptionError, match=words) as refused:
        read_spread(text, ETA, 0.9)
    assert "\n" not in str(refused.value)


def test_a_value_with_a_source_may_have_its_tolerance_in_it():
    text = TEXT.replace('bore = "127 mm"', 'bore = { value = "127 mm ± 0.1 mm", source = "drawing 4711" }')
    read = machine.loads(text)
    assert read.unit("boom").cylinder.bore == 0.127
    assert read.tolerances["units.boom.cylinder.bore"].half == pytest.approx(1e-4)
    assert read.source_of("units.boom.cylinder.bore") == "drawing 4711"


def test_a_description_keeps_tolerances_beside_its_values():
    beside = '{ value = "127 mm", tolerance = "± 0.1 mm normal", source = "drawing 4711" }'
    text = TEXT.replace('bore = "127 mm"', f"bore = {beside}").replace('rod = "79.4 mm"', 'rod = "79.4 mm ± 0.05 mm"')
    read = machine.loads(text)
    assert read.unit("boom").cylinder.bore == 0.127
    bore = read.tolerances["units.boom.cylinder.bore"]
    assert (bore.centre, bore.half, bore.distribution, bore.least) == (0.127, 1e-4, "normal", 1e-3)
    assert read.tolerances["units.boom.cylinder.rod"].half == pytest.approx(5e-5)
    assert read.source_of("units.boom.cylinder.bore") == "drawing 4711"
    again = machine.loads("\n".join(as_toml(read, read.sources)))
    assert again == read
    assert again.tolerances == read.tolerances
    assert list(read.replace({"units.boom.cylinder.bore": "130 mm"}).tolerances) == ["units.boom.cylinder.rod"]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('bore = "127 mm"', 'bore = "127 mm ± 3 kg"', "units.boom.cylinder.bore"),
        ('bore = "127 mm"', 'bore = { value = "127 mm", tolerance = 3 }', "a tolerance is text"),
        ('bore = "127 mm"', 'bore = { tolerance = "± 1 mm" }', "a tolerance but no value"),
        ('name = "my-machine"', 'name = "7 ± 1"', "no value that can have a tolerance"),
    ],
)
def test_a_tolerance_that_has_no_meaning_beside_a_value_is_refused_with_its_place(old, new, words):
    assert old in TEXT
    with pytest.raises(DescriptionError, match=words):
        machine.loads(TEXT.replace(old, new))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('leak = "± 1 %"', "did you mean 'leakage'"),
        ('leakage = "± 1 kg"', "tolerances.leakage"),
        ('oil_temperature = "± 5 K"', "needs a value"),
        ('torque_offset = "± 1 % log-normal"', "log-normal"),
        ("correlations = { leakage-mess = 0.5 }", "no pair"),
        ("correlations = { leakage-displacement = 2 }", "at most 1"),
    ],
)
def test_the_table_of_tolerances_is_checked_when_it_is_read(text, words):
    with pytest.raises(DescriptionError, match=words):
        with_tolerances(text)


def test_what_varies_is_what_is_said_and_else_a_marked_default():
    described = with_tolerances('leakage = { value = "± 20 % normal", source = "pump maker" }')
    found = {one.name: one for one in varied(described, "boom")}
    assert (found["leakage"].source, found["leakage"].is_default) == ("pump maker", False)
    assumed = described.unit("boom").assumptions
    assert found["torque_gain"].is_default
    assert found["torque_gain"].spread.std == pytest.approx(assumed.drive.torque_gain)
    assert found["displacement"].spread.std == pytest.approx(assumed.machine.displacement)
    assert set(found) <= set(KINDS)
    named = {one.name: one for one in varied(described, "boom", {"mass": "", "hose.volume": "± 0.2 l"})}
    assert "mass" not in named
    assert named["hose.volume"].spread.half == pytest.approx(2e-4)
    assert "volumes" not in named  # its default would count the same twice
    assert "volumes" in {one.name for one in varied(described, "boom", {"volumes": "± 5 %", "hose.volume": "± 0.2 l"})}
    with pytest.raises(UnknownNameError, match="leakage"):
        varied(described, "boom", {"leakge": "± 5 %"})


def test_a_kind_with_its_value_and_its_source_is_one_tolerance():
    text = 'oil_temperature = { value = "45 degC ± 10 K", source = "log" }'
    found = {one.name: one for one in varied(with_tolerances(text), "boom")}
    oil = found["oil_temperature"]
    assert (oil.spread.centre, oil.spread.half, oil.source) == (318.15, 10.0, "log")


def test_every_default_can_be_read_and_covers_name_values_that_exist():
    unit = machine.load_machine("mining-loader").unit("boom")
    for name in KINDS:
        text, source = default_text(name, unit.assumptions, unit.cylinder.stroke)
        assert source.startswith("default: ")
        assert len(source) > len("default: ") or not text
    keys = {path.rpartition(".")[2] for path in (value.path for value in machine.walk(unit))}
    assert {keys_of[0] for keys_of in COVERS.values()} <= keys


SPREADS = st.builds(
    Spread,
    centre=st.floats(0.5, 2.0),
    half=st.floats(0.01, 0.4),
    distribution=st.sampled_from(DISTRIBUTIONS),
    least=st.sampled_from([-math.inf, 0.45]),
)


@given(SPREADS, st.lists(st.floats(0.0, 1.0), min_size=2, max_size=20))
def test_values_lie_within_their_ends_and_grow_with_the_share(spread, shares):
    values = value_at(np.sort(np.array(shares)), spread)
    low, high = spread.ends
    assert values.min() >= low
    assert values.max() <= high
    assert (np.diff(values) >= 0.0).all()
    assert low >= spread.least


@pytest.mark.parametrize(
    ("spread", "known"),
    [
        (Spread(1.0, 0.2, "uniform"), stats.uniform(0.8, 0.4)),
        (Spread(1.0, 0.2, "normal"), stats.truncnorm(-3.0, 3.0, 1.0, 0.1)),
        (Spread(1.0, 0.2, "normal", most=1.05), stats.truncnorm(-3.0, 0.5, 1.0, 0.1)),
        (Spread(1.0, 0.2, "triangular"), stats.triang(0.5, 0.8, 0.4)),
    ],
)
def test_distributions_are_those_of_scipy(spread, known):
    share = np.linspace(0.01, 0.99, 50)
    np.testing.assert_allclose(value_at(share, spread), known.ppf(share), rtol=1e-9)


def test_a_log_normal_tolerance_is_two_standard_deviations_of_the_logarithm():
    spread = Spread(2.0, 1.0, "log-normal")
    ratio = math.log(value_at(np.array([stats.norm.cdf(2.0)]), spread)[0] / 2.0)
    assert ratio == pytest.approx(math.log(1.5), rel=0.02)  # cut at three


def test_a_study_with_more_machines_begins_with_the_same_ones():
    many = points("sobol", 100, 5, seed=3)
    np.testing.assert_array_equal(many[:33], points("sobol", 33, 5, seed=3))
    np.testing.assert_array_equal(many[33:70], points("sobol", 37, 5, seed=3, first=33))
    assert not np.array_equal(many, points("sobol", 100, 5, seed=4))
    cube = points("latin-hypercube", 40, 3, seed=1)
    assert (np.sort((cube * 40).astype(int), axis=0) == np.arange(40)[:, None]).all()


def test_correlated_quantities_are_correlated_and_keep_their_distributions():
    quantities = varied(machine.load_machine("mining-loader"), "boom")
    matrix = correlation_of(quantities, {"leakage-displacement": -0.7})
    cube = points("sobol", 4096, len(quantities), seed=0)
    free, bound = (values_at(cube, quantities, one) for one in (None, matrix))
    names = [one.name for one in quantities]
    i, j = names.index("leakage"), names.index("displacement")
    assert stats.spearmanr(bound[:, i], bound[:, j])[0] == pytest.approx(6 / np.pi * np.arcsin(-0.35), abs=0.02)
    assert abs(stats.spearmanr(free[:, i], free[:, j])[0]) < 0.02
    np.testing.assert_allclose(
        np.quantile(bound, [0.1, 0.5, 0.9], axis=0), np.quantile(free, [0.1, 0.5, 0.9], axis=0), rtol=0.05, atol=1e-3
    )
    assert correlation_of(quantities, {}) is None


def test_correlations_that_contradict_each_other_are_refused():
    quantities = varied(machine.load_machine("mining-loader"), "boom")
    pairs = {"leakage-displacement": 0.9, "displacement-friction": 0.9, "friction-leakage": -0.9}
    with pytest.raises(DescriptionError, match="no correlation matrix"):
        correlation_of(quantities, pairs)
