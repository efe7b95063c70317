"""What a commissioning found is kept, and the next one begins there and says what has changed."""

import json
from dataclasses import replace
from datetime import UTC, datetime

import pytest

import ramsight
from ramsight.calibration.identify import FACTORS, Estimate, Identification
from ramsight.calibration.leakage import LeakTest
from ramsight.study.commissioning.finding import Verdict
from ramsight.study.commissioning.kept_values import (
    Change,
    Measured,
    changed,
    changes,
    kept_of,
    measured,
    over,
    read_kept,
    table_text,
)

from .command import at_once

THEN = {
    "leak test": Measured(1.1, 0.03),
    "learned leak": Measured(1.08, 0.02),
    "learned compliance": Measured(1.0, 0.04),
}


@pytest.fixture(scope="module")
def press():
    return ramsight.load_machine("press")


@pytest.fixture
def kept(press):
    return kept_of(press, "ram", datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC), THEN)


def identified(**values):
    factors = {name: Estimate(values.get(name, 1.0), 0.9, 1.1, name in values, per_kelvin=0.01) for name in FACTORS}
    return Identification(factors, factors["leak"], 1, 1, 1.0, 0.0, (0.0, 1.0), (300.0, 310.0), 1, 1, (0.0, 0.1))


def test_what_is_kept_comes_back(kept, tmp_path):
    kept.write(tmp_path / "first.json")
    again = read_kept(tmp_path / "first.json")
    assert again == kept
    assert again.made == "2026-01-02T03:04:05+00:00"
    described = ramsight.machine.loads(again.description)
    assert described.model_dump() == ramsight.load_machine("press").model_dump()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("[1", "cannot be read"),
        ("[" * 100_000, "cannot be read"),
        ("[]", "holds no commissioning"),
        ("{}", "holds no commissioning"),
        ({"format": 2}, "is of another format"),
        ({"machine": 3}, "is not whole"),
        ({"values": []}, "is not whole"),
        ({"values": {"leak test": {"value": "x", "std": 1.0}}}, r"values\.leak test"),
        ({"values": {"leak test": {"value": 1.0}}}, r"values\.leak test"),
        ({"values": {"leak test": {"value": float("nan"), "std": 1.0}}}, r"values\.leak test"),
        ({"values": {"leak test": {"value": 10**400, "std": 1.0}}}, r"values\.leak test"),
        ({"values": {"leak test": {"value": 1.0, "std": -0.1}}}, r"values\.leak test"),
        ({"made": "\x1b[31myesterday\n"}, "made = .*is no time"),
        ({"description": "format = 1"}, "the description in"),
        ({"unit": "boom"}, "is of another machine or unit"),
        ({"machine": "other"}, "is of another machine or unit"),
    ],
)
def test_a_file_that_holds_no_commissioning_is_refused_in_one_line(kept, tmp_path, content, words):
    file = tmp_path / "first.json"
    kept.write(file)
    file.write_text(content if isinstance(content, str) else json.dumps(json.loads(file.read_text()) | content))
    with pytest.raises(ramsight.DescriptionError, match=words) as refused:
        ramsight.commission("press", tmp_path / "none.csv", unit="ram", since=file)
    assert "\n" not in str(refused.value)
    assert len(str(refused.value)) < 600


def test_a_missing_file_and_a_built_unit_are_refused(press, tmp_path):
    with pytest.raises(ramsight.DescriptionError, match=r"first\.json: cannot be read"):
        ramsight.commission("press", tmp_path / "none.csv", since=tmp_path / "first.json")
    with pytest.raises(ramsight.DescriptionError, match="keep"):
        ramsight.commission(ramsight.build(press), tmp_path / "none.csv", keep=tmp_path / "first.json")


def test_an_earlier_commissioning_of_another_unit_is_refused_of_a_built_unit_too(tmp_path):
    loader, file = ramsight.load_machine("mining-loader"), tmp_path / "boom.json"
    kept_of(loader, "boom", datetime(2026, 1, 2, tzinfo=UTC), THEN).write(file)
    for machine, words in (
        (ramsight.build(loader, "bucket"), "mining-loader, boom.*allowed: mining-loader, bucket"),
        (ramsight.build("press"), "is of another machine or unit"),
        (3, "machine = 3: is neither text nor path nor Machine"),
    ):
        with pytest.raises(ramsight.DescriptionError, match=words):
            ramsight.commission(machine, tmp_path / "none.csv", since=file)
    for machine in ("mining-loader", ramsight.build(loader, "boom"), loader.unit("boom")):
        with pytest.raises(ramsight.LogError):  # of the log, which is looked at next
            ramsight.commission(machine, tmp_path / "none.csv", since=file)


def test_a_change_is_judged_by_both_deviations():
    one = Change("leak test", Measured(1.1, 0.03), Measured(1.3, 0.04))
    assert one.change == pytest.approx(0.2)
    assert one.deviations == pytest.approx(4.0)
    assert one.is_sure
    assert "worn" in one.says
    assert not replace(one, now=Measured(1.24, 0.04)).is_sure, "2.8 deviations"
    assert "replaced" in replace(one, now=Measured(0.9, 0.04)).says
    assert Change("learned leak", Measured(1.0, 0.0), Measured(1.0, 0.0)).deviations == 0.0


def test_the_finding_names_what_changed_and_the_likeliest_cause(kept):
    now = {
        "leak test": Measured(1.12, 0.03),
        "learned compliance": Measured(1.5, 0.05),
        "identified leak": Measured(1.0, 0.1),
    }
    found = changes(kept, now)
    assert [one.name for one in found] == ["leak test", "learned compliance"], "what both measured"
    finding = changed(kept, found)
    assert finding.verdict is Verdict.LOOK_TWICE
    assert "learned compliance +50.0 % (+7.8 deviations)" in finding.found
    assert "air in the oil" in finding.remedy
    assert "leak test +" not in finding.found
    rows = table_text(found).splitlines()
    assert rows[1].split() == ["leak", "test", "1.100", "±", "0.059", "1.120", "±", "0.059", "+0.020", "+0.5"]
    still = changed(kept, changes(kept, {"leak test": Measured(1.12, 0.03)}))
    assert still.verdict is Verdict.PASSED
    assert "none since 2026-01-02" in still.found
    assert changed(kept, ()).verdict is Verdict.OPEN
    assert table_text(()) == ""


def test_every_value_has_a_meaning():
    test = LeakTest(1.2, 0.03, per_kelvin=0.04, per_torque=0.0, stretches=())
    names = measured(None, test, identified(leak=1.2, displacement=1.0, stiffness=0.9, friction=1.5))
    assert names["leak test"] == Measured(1.2, pytest.approx(0.05))
    assert names["identified leak"].std == pytest.approx(((0.1 / 1.96) ** 2 + 0.01**2) ** 0.5, rel=1e-3)
    assert "identified efficiency" not in names
    learned = {f"learned {one}": Measured(1.0, 0.1) for one in ("leak", "displacement", "compliance")}
    for name, value in {**names, **learned}.items():
        for now in (0.5, 2.0):
            assert Change(name, value, Measured(now, 0.1)).says
    assert measured(None, None, identified()) == {}


def test_values_are_over_those_of_the_tuned_description():
    values = {
        "leak test": Measured(1.2, 0.03),
        "learned compliance": Measured(1.25, 0.05),
        "learned leak": Measured(1.1, 0.1),
    }
    found = over(values, identified(leak=1.2, stiffness=0.8))
    assert found["leak test"] == Measured(pytest.approx(1.0), pytest.approx(0.025))
    assert found["learned compliance"].value == pytest.approx(1.0)
    assert found["learned leak"].value == pytest.approx(1.1 / 1.2)
    assert over(values, identified(stiffness=0.8))["leak test"] == values["leak test"]


def day(seed, **as_built):
    built = ramsight.AsBuilt(leak=1.15, **as_built) if "leak" not in as_built else ramsight.AsBuilt(**as_built)
    run = ramsight.simulate("mining-loader", "commissioning", unit="boom", load="300 kN", as_built=built)
    return ramsight.drive_report(run, "mining-loader", unit="boom", seed=seed), run[["position"]]


def test_a_second_commissioning_says_that_the_pumps_have_worn(tmp_path):
    kept, log = tmp_path / "first.json", tmp_path / "second.csv"
    first = ramsight.commission("mining-loader", day(1)[0], unit="boom", keep=kept)
    assert first.changes == ()
    worn, _ = day(2, leak=1.5)
    ramsight.logs.write_log(worn, log)
    done = at_once(
        "commission", "mining-loader", log, "--unit", "boom", "--since", kept, "--out", tmp_path / "second.html"
    )
    assert done.returncode == 0, done.stderr
    assert "look twice  changes: since 20" in done.stdout
    assert "the pumps have worn" in done.stdout
    (line,) = [one for one in done.stdout.splitlines() if one.startswith("learned leak  ")]
    then, now = (float(word) for word in line.replace("±", " ").split()[2:5:2])
    assert (then, now) == (pytest.approx(1.15, abs=0.05), pytest.approx(1.5, abs=0.08))
    (still,) = [one for one in done.stdout.splitlines() if one.startswith("learned compliance")]
    assert abs(float(still.split()[-1])) < 3.0
    page = (tmp_path / "second.html").read_text(encoding="utf-8")
    assert "Changed since" in page
    assert "earlier commissioning, with the machine" in page


@pytest.mark.slow
def test_a_second_commissioning_begins_from_the_tuned_description(tmp_path):
    kept = tmp_path / "first.json"
    log, position = day(1, stiffness=0.9)
    ramsight.commission("mining-loader", log, position, unit="boom", keep=kept)
    values = read_kept(kept).values
    assert values["identified leak"].value == pytest.approx(1.0)
    assert values["learned leak"].value == pytest.approx(1.0, abs=0.03)
    tuned = ramsight.machine.loads(read_kept(kept).description).unit("boom")
    plain = ramsight.load_machine("mining-loader").unit("boom")
    assert tuned.pump_a.volumetric_efficiency < plain.pump_a.volumetric_efficiency
    assert tuned.assumptions.machine.displacement < 0.5 * plain.assumptions.machine.displacement
    # What a thermometer that reads some kelvin wrong hides is about as much as a data sheet leaves open.
    assert tuned.assumptions.machine.leak <= plain.assumptions.machine.leak
    again, where = day(2, stiffness=0.9)
    same = ramsight.commission("mining-loader", again, where, unit="boom", since=kept)
    assert same.findings[-1].check == "changes"
    assert same.findings[-1].verdict is Verdict.PASSED
    assert max(abs(one.deviations) for one in same.changes) < 2.0
    assert {one.name for one in same.changes} >= {"identified leak", "identified displacement", "learned leak"}
