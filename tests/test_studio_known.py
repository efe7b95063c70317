"""What a sensor knows, as the studio draws it: numbers of its state, what moved them, what would make it surer."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from ramsight import machine
from ramsight.logs import read_log
from ramsight.plant.build import build
from ramsight.sensor.kalman import kalman
from ramsight.sensor.kind import Kind
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import Estimate
from ramsight.signals import Signal, Signals
from ramsight.studio.known import Known, known_along
from ramsight.studio.rig import Rig
from ramsight.studio.worker import _Clock

from .conftest import TRACES

CHANCES = {Kind.DESCRIBED: 0.9, Kind.UNKNOWN_POSITION: 0.1}


def sensor(chances=CHANCES, met=(0.0, 0.0), **says):
    """One of some hypotheses at 0.1 m, the second and third one 20 and 30 mm further and known to 30 mm."""
    state = {"position": 0.1, "met_low": met[0], "met_top": met[1]}
    for k, (place, variance) in enumerate([(0.0, 1e-6), (0.02, 9e-4), (0.03, 9e-4)]):
        state |= {f"hypotheses[{k}].position": place, f"hypotheses[{k}].covariance[position,position]": variance}
    outputs = {f"{kind.text}_probability": p for kind, p in chances.items()}
    outputs |= {"position_low": 0.09, "position_high": 0.13, "position_bound": 0.05, "status": 0.0}
    outputs |= {"leak_factor": 1.1, "leak_factor_std": 0.02, **says}
    return SimpleNamespace(
        state=state, says=lambda name: outputs.get(name, math.nan), recursion=SimpleNamespace(outputs=tuple(outputs))
    )


def estimate(position=0.1, status=Status.OK):
    return Estimate(position, 1e-3, 0.0, 0.0, status)


def test_lengths_are_in_millimetres_and_each_hypothesis_has_its_place():
    found = Known(sensor(), 0.7).look(3.0, estimate())
    assert (found["stroke"], found["position"], found["low"], found["high"], found["bound"]) == (700, 100, 90, 130, 50)
    described, unknown = found["hypotheses"]
    assert (described["place"], described["std"], described["chance"]) == (100.0, 1.0, 0.9)
    assert (unknown["place"], unknown["std"], unknown["chance"]) == (120.0, 30.0, 0.1)
    assert unknown["words"] == Kind.UNKNOWN_POSITION.words
    assert found["learned"][0] == {"name": "leakage", "value": 1.1, "std": 0.02}
    assert found["since"] is None


def test_what_is_not_referenced_has_no_position_and_may_be_anywhere():
    found = Known(sensor(), 0.7).look(3.0, estimate(status=Status.NOT_REFERENCED))
    assert (found["position"], found["bound"], found["low"], found["high"]) == (None, None, 0.0, 700.0)
    assert found["next"].startswith("Press it on an end")


@pytest.mark.parametrize(("met", "words"), [((1.0, 0.0), "retracted end met"), ((0.0, 1.0), "extended end met")])
def test_an_end_that_was_met_is_said_with_what_it_made_likelier(met, words):
    known = Known(sensor(), 0.7)
    known.look(3.0, estimate())
    known.sensor = sensor({Kind.DESCRIBED: 0.97, Kind.UNKNOWN_POSITION: 0.03}, met)
    found = known.look(5.0, estimate())
    assert found["since"] == 0.0
    assert found["moved"] == [f"5 s, {words}: {Kind.DESCRIBED.words}, 0.90 → 0.97"]
    assert known.look(7.5, estimate())["since"] == 2.5


def test_a_reference_counts_once_and_a_small_change_is_not_said():
    known = Known(sensor(), 0.7)
    known.look(3.0, estimate())
    known.sensor = sensor({Kind.DESCRIBED: 0.919, Kind.UNKNOWN_POSITION: 0.081})
    assert known.look(4.0, estimate(), referred=3.9)["since"] == 0.1
    assert known.look(6.0, estimate(), referred=3.9)["since"] == 2.1
    known.sensor = sensor({Kind.DESCRIBED: 0.8, Kind.UNKNOWN_POSITION: 0.2})
    assert known.look(7.0, estimate(), referred=3.9)["moved"] == [
        f"7 s, by its way since: {Kind.UNKNOWN_POSITION.words}, 0.08 → 0.20"
    ]


def test_the_newest_four_changes_are_kept():
    known = Known(sensor(), 0.7)
    for k in range(7):
        known.sensor = sensor({Kind.DESCRIBED: 0.5 + 0.05 * k, Kind.UNKNOWN_POSITION: 0.5 - 0.05 * k})
        found = known.look(float(k), estimate())
    assert [one.split(" s,")[0] for one in found["moved"]] == ["6", "5", "4", "3"]


@pytest.mark.parametrize(
    ("known", "chances", "words"),
    [
        (False, {Kind.LOW: 0.9}, "Press it on an end of the stroke"),
        (True, {Kind.DESCRIBED: 0.8, Kind.LOW: 0.09, Kind.TOP: 0.1}, "Press it on the extended end"),
        (True, {Kind.DESCRIBED: 0.8, Kind.LOW: 0.1, Kind.TOP: 0.09}, "Press it on the retracted end"),
        (True, {Kind.DESCRIBED: 0.985, Kind.LOW: 0.01}, "Nothing but a new reference"),
        (True, {Kind.DESCRIBED: 0.5, Kind.LEAKS: 0.5}, "Nothing but a new reference"),
    ],
)
def test_what_would_make_it_surer_is_an_end_that_may_be_elsewhere(known, chances, words):
    assert Known.surer(known=known, chances=chances).startswith(words)


@pytest.mark.parametrize(
    ("chances", "chance", "kind", "where"),
    [
        ({Kind.DESCRIBED: 0.9, Kind.TOP: 0.1}, "10.0 %", Kind.TOP, "61 and 179"),
        ({Kind.DESCRIBED: 0.1, Kind.TOP: 0.9}, "10.0 %", Kind.DESCRIBED, "98 and 102"),
        ({Kind.DESCRIBED: 0.8, Kind.LOW: 0.11, Kind.TOP: 0.09}, "9.0 %", Kind.TOP, "71 and 189"),
        ({Kind.DESCRIBED: 0.8, Kind.LOW: 0.13, Kind.TOP: 0.07}, "13.0 %", Kind.LOW, "61 and 179"),
        ({Kind.DESCRIBED: 0.9995, Kind.TOP: 0.0005}, "less than 0.1 %", Kind.TOP, "61 and 179"),
    ],
)
def test_if_it_is_wrong_the_piston_is_where_the_hypothesis_that_costs_most_has_it(chances, chance, kind, where):
    found = Known(sensor(chances), 0.7).look(3.0, estimate())["wrong"]
    assert found == f"With a probability of {chance}, {kind.words}: the piston is then between {where} mm."


def test_if_it_is_wrong_the_piston_is_within_its_stroke_and_nothing_is_wrong_that_is_not_said():
    assert Known(sensor(), 0.15).look(3.0, estimate())["wrong"].endswith("between 61 and 150 mm.")
    unknown = Known(sensor(), 0.7).look(3.0, estimate(status=Status.NOT_REFERENCED))
    assert unknown["wrong"].startswith("It gives no position")


def test_a_rig_knows_by_its_kalman_sensor_and_begins_again_with_another_one():
    rig = Rig(machine.load_machine("press"))
    assert rig.known("ram", 0.0) is None, "nothing was reported yet"
    row = rig.step()["ram"]
    first = rig.known("ram", row.time)
    assert sum(one["chance"] for one in first["hypotheses"]) == pytest.approx(1.0, abs=1e-4)
    assert first["low"] <= first["position"] <= first["high"]
    rig.refer("ram")
    row = rig.step()["ram"]
    assert rig.known("ram", row.time)["since"] == pytest.approx(0.0, abs=0.05)
    rig.sense("kalman", on=False)
    assert rig.known("ram", row.time) is None
    rig.sense("kalman", on=True)
    row = rig.step()["ram"]
    assert rig.known("ram", row.time)["since"] is None, "it is another sensor"
    rig.fault("power", on=True)
    assert rig.known("ram", row.time) is None
    rig.fault("power", on=False)


def test_along_a_log_it_knows_what_the_sensor_said_at_these_samples():
    unit, log = build("mining-loader", "boom"), Signals.of(read_log(TRACES / "boom_441kN_40C.csv.gz"))
    track = kalman(unit)
    track.start(0.1)
    said = track.followed(log)
    along = kalman(unit)
    along.start(0.1)
    found = list(known_along(along, log, unit.cylinder.stroke, looks=40))
    assert len(found) == 40
    assert (found[0][0], found[-1][0]) == (log["time"].values[0], log["time"].values[-1])
    for time, known in found:
        k = int(log["time"].values.searchsorted(time))
        assert known["position"] == pytest.approx(1e3 * said["position"].values[k], abs=1e-3)
    assert along.estimate.position == said["position"].values[-1]


def test_along_a_log_a_reference_of_the_log_is_what_was_measured_last():
    unit = build("mining-loader", "boom")
    log = Signals.of(read_log(TRACES / "boom_441kN_40C.csv.gz")).rows(slice(0, 500))
    time, reference = log["time"].values, [math.nan] * 500
    reference[300] = 0.12
    given = Signals(dict(log.columns) | {"reference": Signal(np.array(reference), {"units": "m"})}, {})
    sensor = kalman(unit)
    sensor.start(0.1)
    (*_, (last, known)) = known_along(sensor, given, unit.cylinder.stroke, looks=50)
    assert known["since"] == pytest.approx(last - time[300], abs=0.1)


def test_along_an_empty_log_nothing_is_known():
    unit = build("mining-loader", "boom")
    log = Signals.of(read_log(TRACES / "boom_441kN_40C.csv.gz")).rows(slice(0, 0))
    assert list(known_along(kalman(unit), log, unit.cylinder.stroke)) == []


def test_a_page_gets_where_the_piston_was_when_the_sensor_was_looked_at():
    described = machine.load_machine("press")
    rig = Rig(described)
    rig.levers["ram"] = 1.0
    clock = _Clock(rig, None, described)
    for _ in range(50):
        rig.step()
    clock.rows = [rig.step() for _ in range(4)]
    frame = clock._frame(1.0)
    known = frame.known["ram"]
    assert known["true"] == frame.columns["ram"]["position"][-1]
    assert abs(known["position"] - known["true"]) < 1.0
    clock.rows = [rig.step()]
    assert not clock._frame(1.05).known, "not every frame looks: the page keeps the place that belongs to the last look"
