"""The study that varies each constant of the sensor: what it changes, what it sums up, and what the page has of it."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from ramsight.constant import constants_of
from ramsight.sensor import thresholds

ROOT = Path(__file__).parents[1]
HELD = {"p95": 1e-3, "coverage": 0.97, "wrong_and_ok": 0.0, "ok": 0.5, "beyond_bound": 0.0}


@pytest.fixture
def script(script):
    return script("constants_varied")


def test_it_knows_every_constant(script):
    assert script.names() == list(constants_of(thresholds))


def test_a_change_is_there_before_a_sensor_is_made_and_what_follows_from_it_changes_too():
    code = (
        "import constants_varied as study; study.change('RISK', 1.5);"
        "from ramsight.sensor.thresholds import CERTAIN, RISK, SURE_STDS;"
        "print(round(1e5 * RISK, 6), round(CERTAIN, 4), float(SURE_STDS))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT / "evaluation", capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["1.5", "4.7133", "4.0"]


def test_the_worst_log_is_what_a_variant_comes_to(script):
    base = {"a": HELD, "b": HELD}
    moved = {"moves": 0.02, "otherwise": 0.1}
    still = {"moves": 0.0, "otherwise": 0.0}
    found = script.summary({"a": HELD | still, "b": HELD | moved | {"p95": 4e-3, "coverage": 0.9}}, base)
    assert (found["moves"], found["in"], found["coverage"]) == (0.02, "b", 0.9)
    assert found["p95_more"] == pytest.approx(3e-3)
    unknown = float("nan")
    assert script.summary({"a": HELD | still | {"p95": unknown}, "b": HELD | still}, base)["in"] == "b"
    nothing = script.summary({"a": HELD | still, "b": HELD | still}, base)
    narrower = script.summary({"a": HELD | still | {"coverage": 0.96}, "b": HELD | still}, base)
    assert script.moves({"times": found, "over": nothing})
    assert script.moves({"times": nothing, "over": narrower}), "a band that is another moves something"
    assert not script.moves({"times": narrower, "over": narrower}), "both as wide: of a sensor of another date"
    assert script.moves({"times": nothing, "over": {"fails": "ValueError"}})
    rounding = nothing | {"moves": 1e-9}
    assert not script.moves({"times": nothing, "over": rounding})
    rows = {script.BASE: nothing, "A": {"times": found, "over": nothing}, "B": {"times": nothing, "over": nothing}}
    said = script.table(rows, {"B": {"test": "test_b.py::test_b_is_seen", "times": True, "over": False}})
    assert said[2].startswith("| as they are | 0.0 mm | 0.0 mm | 0.0 mm | 0.0 mm | 97.0 % |")
    assert said[3].startswith("| `A` | 20.0 mm | 0.0 mm | 3.0 mm | 0.0 mm | 90.0 % | 97.0 % |")
    assert said[-1] == "| `B` | `test_b.py`: b is seen | fails | passes |"


def test_no_constant_is_without_effect(script):
    """Each moves a track of the study, or a test of its own fails when it is another."""
    found = json.loads((ROOT / "results" / "constants.json").read_text(encoding="utf-8"))
    tested = json.loads((ROOT / "results" / "constants_tested.json").read_text(encoding="utf-8"))
    assert set(found) <= {script.BASE, *script.names()}
    assert {name: row["test"] for name, row in tested.items()} == script.tests()
    for name in script.names():
        fails = name in tested and (tested[name]["times"] or tested[name]["over"])
        assert fails or (name in found and script.moves(found[name])), name


@pytest.mark.slow
def test_a_constant_s_own_test_fails_with_another_one(script):
    row = {"test": script.tests()["RATE_MEMORY"], "times": True, "over": True}
    assert list(script.tested(["RATE_MEMORY"], 1)) == [("RATE_MEMORY", row)]


@pytest.mark.slow
def test_a_test_that_is_not_there_is_named(script):
    name = "test_constants.py::test_nothing"
    with pytest.raises(SystemExit, match=name):
        script.passes("RISK", 1.5, name)
