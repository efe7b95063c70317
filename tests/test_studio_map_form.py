"""A channel map as a form: what a field changes in the text, and nothing else."""

import tomllib

import pytest

from ramsight.studio.map_form import Entry, entry, is_standard, with_entry

MAP = """# Channel map for g.csv: check signs.
time = { channel = "Zeit [ms]", unit = "ms" }

[speed]
channel = "Drehzahl"
unit = "1/min"
sign = 1

[torque]
channel = "Moment"
unit = "%"
# rated = "35 N m"  # needed
sign = 1
hold = "0.2 s"

[align]
base = "speed"
"""


def test_an_entry_is_what_the_map_says():
    assert entry(MAP, "time") == Entry("Zeit [ms]", "ms")
    assert entry(MAP, "torque") == Entry("Moment", "%")
    assert entry(MAP, "temperature") == Entry()
    assert entry(MAP.replace("sign = 1\nhold", "sign = -1\nhold"), "torque").is_reversed
    assert entry('[temperature]\nconstant = "45 degC"\n', "temperature").constant == "45 degC"


@pytest.mark.parametrize("text", ["[speed", "speed = 3\n", "[measured]\nposition = 1\n", "measured = 2\n"])
def test_of_a_text_that_is_no_map_nothing_is_said(text):
    for role in ("speed", "position"):
        assert entry(text, role) == Entry()


def test_a_field_changes_its_entry_and_nothing_else():
    changed = with_entry(MAP, "torque", Entry("Moment", "%", "80 N m", "", True))
    before, after = tomllib.loads(MAP), tomllib.loads(changed)
    assert after.pop("torque") == {"channel": "Moment", "unit": "%", "rated": "80 N m", "sign": -1, "hold": "0.2 s"}
    before.pop("torque")
    assert after == before
    assert changed.startswith("# Channel map for g.csv: check signs.\n")
    assert '# rated = "35 N m"  # needed' in changed


def test_every_entry_is_read_back():
    for role, said in (
        ("time", Entry("t", "us")),
        ("speed", Entry("n", "rpm", "", "", True)),
        ("torque", Entry("M", "‰", "35 N m")),
        ("temperature", Entry("", "", "", "45 degC")),
        ("temperature", Entry("T", "K")),
        ("position", Entry("Weg [mm]", "mm")),
    ):
        assert entry(with_entry(MAP, role, said), role) == said


def test_an_entry_is_taken_away():
    known = with_entry(MAP, "position", Entry("Weg", "mm"))
    assert tomllib.loads(with_entry(known, "position", Entry())) == tomllib.loads(MAP)
    assert "torque" not in tomllib.loads(with_entry(MAP, "torque", Entry()))
    assert with_entry(MAP, "temperature", Entry()) == MAP


def test_a_channel_takes_the_place_of_a_constant_temperature():
    constant = with_entry(MAP, "temperature", Entry("", "", "", "45 degC"))
    measured = tomllib.loads(with_entry(constant, "temperature", Entry("T", "degC", "", "45 degC")))["temperature"]
    assert measured == {"channel": "T", "unit": "degC"}


def test_other_keys_of_the_time_stay_and_a_time_without_a_channel_is_none():
    dated = MAP.replace('unit = "ms" }', 'unit = "ms", date = "2026-01-05" }')
    changed = tomllib.loads(with_entry(dated, "time", Entry("t", "s")))["time"]
    assert changed == {"channel": "t", "unit": "s", "date": "2026-01-05"}
    assert "time" not in tomllib.loads(with_entry(MAP, "time", Entry("", "s")))


@pytest.mark.parametrize(
    ("text", "role"), [("torque = 5\n", "torque"), ("time = 5\n", "time"), ("measured = 3\n", "position")]
)
def test_what_is_no_table_is_replaced(text, role):
    assert entry(with_entry(text, role, Entry("M", "mm")), role).channel == "M"
    assert with_entry(text, role, Entry()).strip() == ""


def test_a_text_that_is_no_toml_stays_as_it_is():
    assert with_entry("[speed", "speed", Entry("n", "rpm")) == "[speed"


def test_the_usual_columns_need_no_map():
    usual = {"time_s", "motor_speed_rpm", "motor_torque_nm", "oil_temperature_c"}
    assert is_standard(usual | {"reference_m"})
    assert not is_standard(usual - {"time_s"})
