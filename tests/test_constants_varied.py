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
    assert script.moves({"times": found, "over": nothing}, nothing)
    assert script.moves({"times": nothing, "over": narrower}, nothing), "a band that is another moves something"
    assert not script.moves({"times": nothing, "over": nothing}, nothing)
    assert script.moves({"times": nothing, "over": {"fails": "ValueError"}}, nothing)
    still_there = {"times": nothing, "over": nothing}
    rows = script.table({script.BASE: nothing, "A": {"times": found, "over": nothing}, "B": still_there})
    assert rows[2].startswith("| as they are | 0.0 mm | 0.0 mm | 0.0 mm | 0.0 mm | 97.0 % |")
    assert rows[3].startswith("| `A` | 20.0 mm | 0.0 mm | 3.0 mm | 0.0 mm | 90.0 % | 97.0 % |")
    assert rows[-3:] == ["```text", "B", "```"]


def test_what_was_found_is_of_constants_that_there_are(script):
    found = json.loads((ROOT / "results" / "constants.json").read_text(encoding="utf-8"))
    assert set(found) <= {script.BASE, *script.names()}
