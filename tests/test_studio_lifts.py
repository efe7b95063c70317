"""What the studio weighs while somebody plays, and the truth beside it, which no sensor knows."""

import math
import zipfile

import pytest

pytest.importorskip("nicegui", reason="needs the extra studio")

import ramsight
from ramsight import machine
from ramsight.studio.rig import Rig

LEVER = {"up": 1.0, "down": -1.0, "still": 0.0}


def moved(rig, *moves):
    """Move a lever so for so long [s]."""
    for lever, seconds in moves:
        rig.levers["boom"] = LEVER[lever]
        for _ in range(round(seconds / rig.period)):
            rig.step()


def played(*moves, lie=0.0):
    """A loader of which a lever was moved so for so long [s], and all that it has marked."""
    rig = Rig(machine.load_machine("mining-loader"))
    if lie:
        kept = rig.lifts.truth
        rig.lifts.truth = lambda time, mass: kept(time, mass + lie)
    moved(rig, *moves)
    return rig, [what for _, what, _ in rig.marks.taken()]


@pytest.fixture(scope="module")
def lifted():
    return played(
        ("still", 1.0), ("up", 5.0), ("still", 1.5), ("down", 5.0), ("still", 1.5), ("up", 2.5), ("still", 2.0)
    )


def test_each_lift_is_an_event_with_its_band_its_verdict_the_rated_load_and_the_truth(lifted):
    rig, marks = lifted
    good, short = rig.lifts.shown["weighings"]
    assert good["true"] == short["true"] == [3875, 3875], "half of the rated payload"
    assert abs(good["mass"] - 3875) < good["half"] < 400
    assert (good["good"], good["quality"], good["direction"]) == (True, "good", "both")
    assert (good["status"], good["level"]) == ("within", "ok")
    assert good["share"] == pytest.approx(100.0 * good["mass"] / good["rated"], abs=0.6)
    assert (short["good"], short["quality"]) == (False, "too short: lift steadily for 3 s")
    assert (short["status"], short["level"], short["rated"]) == ("unknown", "unchecked", None)
    words = [what.split()[0] for what in marks]
    assert words == ["weighed", "weighed", "bad"], "up; up and down averaged; one that is too short"


def test_the_total_is_of_good_weighings_alone(lifted):
    shown = lifted[0].lifts.shown
    good = shown["weighings"][0]
    assert (shown["total"], shown["total_half"], shown["cycles"], shown["count"]) == (good["mass"], good["half"], 1, 2)


def test_the_truth_is_shown_and_never_weighed_with():
    moves = ("still", 1.0), ("up", 4.0), ("still", 1.5)
    (one,), (other,) = (played(*moves, lie=lie)[0].lifts.shown["weighings"] for lie in (0.0, 5000.0))
    assert other["true"] == [one["true"][0] + 5000] * 2
    assert {**one, "true": None} == {**other, "true": None}


def test_what_the_studio_weighs_is_what_the_verb_makes_of_the_saved_run(lifted, tmp_path):
    rig, _ = lifted
    found = {}
    for name, recorder in rig.recorders.items():
        recorder.save(tmp_path / f"{name}.zip", name, "")
        with zipfile.ZipFile(tmp_path / f"{name}.zip") as archive:
            archive.extract("log.csv", tmp_path / name)
        found[name] = tmp_path / name / "log.csv"
    whole = ramsight.weigh(
        "mining-loader", found["boom"], start="280 mm", beside={"bucket": found["bucket"]}, at={"bucket": "200 mm"}
    )
    assert len(whole.weighings) == 2
    assert whole.weighings[0].mass == pytest.approx(rig.lifts.shown["weighings"][0]["mass"], abs=20.0)


def test_without_a_kalman_sensor_or_power_nothing_is_weighed():
    rig, _ = played(("still", 0.5))
    rig.sense("kalman", on=False)
    rig.levers["boom"] = 1.0
    for _ in range(150):
        rig.step()
    rig.fault("power", on=True)
    for _ in range(100):
        rig.step()
    rig.fault("power", on=False)
    assert rig.lifts.shown["count"] == 0


def test_a_machine_that_begins_again_has_weighed_nothing(lifted):
    rig, _ = played(("still", 0.1))
    rig.begin(known=False)
    moved(rig, ("up", 5.0), ("still", 2.0))
    (one,) = rig.lifts.shown["weighings"]
    assert not one["good"]
    assert one["quality"] == "position not known: visit an end stop, or give a reference"


def test_a_machine_without_a_payload_weighs_nothing_and_one_without_a_load_chart_has_no_rated_load():
    assert Rig(machine.load_machine("press")).lifts is None
    assert not Rig(machine.load_machine("forklift-mast")).lifts.shown["chart"]


def test_a_lift_that_no_truth_is_kept_of_is_shown_without_one(lifted):
    rig, _ = played(("still", 0.1))
    rig.lifts.truth = lambda time, mass: None
    rig.lifts._truth.clear()
    moved(rig, ("up", 5.0), ("still", 2.0))
    (one,) = rig.lifts.shown["weighings"]
    assert one["true"] == [None, None]
    assert math.isfinite(one["mass"])
