"""The picture of what a sensor knows: which instants it has, and how probable each place is."""

from pathlib import Path

import numpy as np
import pytest

import ramsight
from ramsight.hindsight.trace import Tracer
from ramsight.logs import read_truth
from ramsight.logs.opening import open_signals
from ramsight.sensor.status import Status
from ramsight.signals import Signals
from ramsight.tracking.belief_figure import Instant, draw_belief, instants

from .command import at_once

LOG = Path(__file__).parent / "traces" / "unknown" / "bucket_hot.csv.gz"
STROKE = 0.5
X = np.linspace(0.0, STROKE, 1201)


@pytest.fixture(scope="module")
def tracer():
    return Tracer.of(ramsight.build("mining-loader", unit="bucket"))


@pytest.fixture(scope="module")
def found(tracer):
    return instants(tracer, open_signals(LOG, None), None, 1e-3)


def test_it_shows_what_was_known_at_first_at_each_end_between_them_and_at_last(found):
    assert [one.why for one in found] == [
        "at first", "after the extended end was met", "on the way from the extended end",
        "after the retracted end was met", "at the end of the log",
    ]  # fmt: skip
    first, met, *_, last = found
    assert first.status == Status.NOT_REFERENCED
    assert np.isnan(first.position)
    assert met.position == pytest.approx(STROKE, abs=1e-3)
    assert last.high - last.low < 0.1 * (met.high - met.low)
    assert all(one.chances.sum() == pytest.approx(1.0) for one in found)


def test_a_known_start_is_known_at_first(tracer):
    first, *_ = instants(tracer, open_signals(LOG, None), 0.4, 1e-3)
    assert first.position == pytest.approx(0.4)


def instant(std):
    return Instant(0.0, "", 0.2, 0.1, 0.3, Status.OK, np.array([0.2, 0.4]), np.array([std, 0.02]), np.array([0.7, 0.3]))


@pytest.mark.parametrize("std", [1e-6, 0.01, 0.1, 0.13, 1.0])
def test_the_density_has_the_probability_of_each_hypothesis(std):
    density = instant(std).density(X, STROKE)
    assert np.trapezoid(density, X) == pytest.approx([0.7, 0.3], rel=1e-6)


def test_a_place_that_may_be_any_is_as_likely_as_another():
    assert np.ptp(instant(0.121).density(X, STROKE)[0]) == pytest.approx(0.0)
    assert np.ptp(instant(0.119).density(X, STROKE)[0]) > 1.0


def test_the_picture_has_a_cylinder_for_each_instant(tracer, found):
    true = Signals.of(read_truth(LOG.with_name("bucket_hot_truth.csv.gz")))
    figure = draw_belief(found, tracer, true, "bucket")
    assert len(figure.axes) == len(found)
    assert figure.axes[-1].get_xlabel() == "place of the piston [mm]"
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles[0] == "0 s, at first: anywhere; not referenced"
    assert titles[-1].endswith("mm; ok")
    assert "the extended end is met elsewhere" in [text.get_text() for text in figure.legends[0].get_texts()]


def test_the_command_draws_it(tmp_path):
    asked = ["track", "mining-loader", LOG, "--unit", "bucket", "--belief", tmp_path / "belief.png"]
    done = at_once(*asked)
    assert done.returncode == 0
    assert "belief.png: written" in done.stdout
    assert (tmp_path / "belief.png").stat().st_size > 10_000
    refused = at_once(*asked, "--sensor", "balance", "--start", "0.4 m")
    assert refused.returncode == 2
    assert "has no hypotheses to draw" in refused.stderr
    assert at_once(*asked[:-1], tmp_path / "belief.txt").returncode == 2
