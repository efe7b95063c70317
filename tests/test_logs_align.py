"""Channels onto one clock: never the future, whatever the pieces; and maps, errors and proposals."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ramsight.errors import DescriptionError
from ramsight.logs import load_map
from ramsight.logs.align import Aligner, Samples, Switch
from ramsight.logs.guess import guess_roles
from ramsight.logs.source import Offered

times = st.lists(st.integers(0, 60), min_size=0, max_size=25).map(sorted)


def channel(ticks, first=0.0):
    order = np.array(ticks, dtype=float)
    return Samples(order, order * 0.1, first + np.arange(len(ticks), dtype=float))


def split(samples, cuts):
    edges = [-1.0, *sorted(cuts), 1e9]
    return [samples.where((samples.order > a) & (samples.order <= b)) for a, b in itertools.pairwise(edges)]


def pushed(blocks, hold=1.0):
    aligner = Aligner("base", {"base": hold, "other": hold}, {"event": hold})
    out = [aligner.push(block) for block in blocks]
    return {name: np.concatenate([piece[name] for piece in out]) for name in out[0]}


@given(base=times, other=times, event=times, cuts=st.lists(st.integers(0, 60), max_size=4))
def test_pieces_give_what_the_whole_gives(base, other, event, cuts):
    named = {"base": channel(base), "other": channel(other, 100.0), "event": channel(event, 200.0)}
    whole = pushed([named])
    parts = {name: split(samples, cuts) for name, samples in named.items()}
    pieces = pushed([dict(zip(parts, block, strict=True)) for block in zip(*parts.values(), strict=True)])
    for name, column in whole.items():
        np.testing.assert_array_equal(pieces[name], column)


@given(base=times, other=times, event=times, hold=st.sampled_from([0.05, 0.35, 10.0]))
def test_a_value_is_the_last_that_had_come_and_not_too_old(base, other, event, hold):
    found = pushed([{"base": channel(base), "other": channel(other), "event": channel(event)}], hold)
    expected, said = [], dict.fromkeys(range(len(base)))
    for number, tick in enumerate(event):
        after = [place for place, at in enumerate(base) if at >= tick]
        if after and (base[after[0]] - tick) * 0.1 <= hold + 1e-12:
            said[after[0]] = float(number)
    for place, tick in enumerate(base):
        before = [number for number, at in enumerate(other) if at <= tick]
        if before:
            fresh = (tick - other[before[-1]]) * 0.1 <= hold + 1e-12
            expected.append((tick * 0.1, float(before[-1]) if fresh else None, said[place]))
    assert [len(column) for column in found.values()] == [len(expected)] * 4
    for row, (time, value, reference) in enumerate(expected):
        assert found["time"][row] == time
        assert np.isnan(found["other"][row]) if value is None else found["other"][row] == value
        assert np.isnan(found["event"][row]) if reference is None else found["event"][row] == reference


@given(ticks=times.filter(len), when=st.integers(0, 60), change=st.floats(-9, 9))
def test_what_comes_later_changes_nothing_before(ticks, when, change):
    base = channel(range(61))
    other = channel(ticks)
    changed = Samples(other.order, other.time, np.where(other.order > when, change, other.value))
    one, two = (pushed([{"base": base, "other": series}], 100.0) for series in (other, changed))
    early = one["time"] <= when * 0.1 + 1e-12
    np.testing.assert_array_equal(one["other"][early], two["other"][early])


def test_channels_that_come_together_stay_together_when_time_repeats():
    order, time = np.array([0.0, 1.0, 1.0]), np.array([0.0, 0.1, 0.1])
    base, other = (Samples(order, time, np.array(values)) for values in ([1.0, 2.0, 3.0], [10.0, 20.0, 30.0]))
    assert pushed([{"base": base, "other": other}])["other"].tolist() == [10.0, 20.0, 30.0]


def test_a_clock_that_is_set_back_makes_old_values_unknown():
    base = Samples(np.array([0.0, 2.0]), np.array([100.0, 0.0]), np.zeros(2))
    other = Samples(np.array([0.0]), np.array([100.0]), np.array([7.0]))
    assert np.array_equal(pushed([{"base": base, "other": other}])["other"], [7.0, np.nan], equal_nan=True)


@pytest.mark.parametrize(("edge", "at"), [("rising", [2, 5]), ("falling", [4]), ("both", [2, 4, 5])])
def test_a_switch_speaks_at_its_edges_in_pieces_too(edge, at):
    states = [0.0, np.nan, 1.0, 1.0, 0.0, 1.0]
    switch, order = Switch(0.79, edge), np.arange(6.0)
    whole = Samples(order, order, np.array(states))
    found = [switch.events(whole.where(order < 2)), switch.events(whole.where(order >= 2))]
    assert np.concatenate([one.order for one in found]).tolist() == at
    assert set(np.concatenate([one.value for one in found])) == {0.79}


MAP = """
time = { channel = "t", unit = "ms" }
speed = { channel = "n", unit = "1/min" }
torque = { channel = "M", unit = "percent", rated = "35 N m", sign = -1 }
temperature = { channel = "T", unit = "degC" }
"""


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('unit = "1/min"', 'unit = "bar"', ["speed.unit", "'bar'", "angular speed"]),
        ('unit = "1/min"', 'unti = "rpm"', ["speed.unti", "did you mean 'unit'"]),
        (', rated = "35 N m"', "", ["torque.unit", "percent", "rated"]),
        ('rated = "35 N m"', 'rated = "35 bar"', ["torque.rated", "35 bar"]),
        ("sign = -1", "sign = 2", ["torque.sign = 2", "1 or -1"]),
        ("sign = -1", 'sign = "x"', ["torque.sign", "a number"]),
        ("sign = -1", "scale = 0", ["torque.scale", "other than 0"]),
        ("sign = -1", 'hold = "-1 s"', ["torque.hold"]),
        (
            'channel = "T", unit = "degC"',
            'constant = "40 degC", channel = "T"',
            ["temperature.channel", "one of the two"],
        ),
        ('channel = "n"', 'constant = "5 rpm"', ["speed"]),
        ("speed =", "spede =", ["[speed]"]),
        ("time =", "csv = {separator = 'x'}\ntime =", ["csv.separator", "';'"]),
        ("time =", "align = {base = 'oil'}\ntime =", ["align.base", "speed, torque"]),
        ("time =", "can = {pdo = {cob_id = 0x181, objects = []}}\ntime =", ["can.pdo[0].objects", "606Ch"]),
        ("time =", "time ", ["no TOML"]),
    ],
)
def test_a_wrong_map_gets_one_line(tmp_path, old, new, words):
    file = tmp_path / "map.toml"
    assert old in MAP
    file.write_text(MAP.replace(old, new))
    with pytest.raises(DescriptionError) as caught:
        load_map(file)
    text = str(caught.value)
    assert text.startswith(str(file))
    assert text.splitlines() == [text]
    for word in words:
        assert word in text


def test_a_map_that_is_not_there_says_so(tmp_path):
    with pytest.raises(DescriptionError, match=r"map.toml: No such file"):
        load_map(tmp_path / "map.toml")


def test_channels_are_guessed_by_name_and_unit():
    offered = [
        Offered("Sollmoment", "Nm"), Offered("TorqueActual", "Nm"), Offered("VehicleSpeed", "km/h"),
        Offered("MotorSpeed_Target", "1/min"), Offered("MotorSpeed", "1/min"), Offered("MotorTemp", "degC"),
        Offered("HydOilTemp", "degC"), Offered("reference_mm", "mm"),
    ]  # fmt: skip
    assert guess_roles(offered) == {
        "speed": "MotorSpeed", "torque": "TorqueActual", "temperature": "HydOilTemp", "reference": "reference_mm",
    }  # fmt: skip
    assert guess_roles([Offered("position", "mm")]) == {}


def test_an_event_that_comes_with_a_sample_counts_whatever_its_clock_says():
    base = Samples(np.array([1.0, 2.0]), np.array([0.1, 0.2]), np.array([5.0, 6.0]))
    event = Samples(np.array([2.0]), np.array([99.0]), np.array([0.3]))
    found = pushed([{"base": base, "other": base, "event": event}])
    np.testing.assert_array_equal(found["event"], [np.nan, 0.3])
