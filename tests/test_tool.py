"""Where the tool is: points by their names, deviations by the Jacobian and by sampling, tracks with a tool."""

import numpy as np
import pytest
import xarray

import ramsight
from ramsight import machine
from ramsight.duty import report
from ramsight.duty.linked_duty import simulate_linked, unit_run
from ramsight.duty.loading import loading_cycle
from ramsight.plant.linkage import angles, build_mechanism, joints, tip
from ramsight.plant.linked import build_linked
from ramsight.tool.tool_place import place_of, tool_point

from .command import at_once

DESCRIBED = machine.load_machine("mining-loader")
LOADER = build_mechanism(DESCRIBED.linkage)
STROKES = np.array([0.7, 0.5])
MIDDLE = np.array([[0.4, 0.25]])
LOG = "tests/traces/boom_258kN_40C.csv.gz"


def drawn(std, correlation=0.0, count=40_000):
    """Root mean square by which the tip moves where the positions are drawn, reach and height."""
    random = np.random.default_rng(3)
    one, other = random.standard_normal((2, count))
    errors = std * np.column_stack([one, correlation * one + np.sqrt(1.0 - correlation**2) * other])
    there = np.clip(MIDDLE + errors, 0.0, STROKES)
    return np.sqrt(np.nanmean((tip(LOADER, joints(LOADER, there)) - tip(LOADER, joints(LOADER, MIDDLE))) ** 2, axis=0))


def test_the_tip_is_where_the_mechanism_has_it():
    places = np.array([[0.1, 0.1], [0.4, 0.25], [0.65, 0.45]])
    found = place_of(LOADER, LOADER.tip, places, np.zeros_like(places), STROKES)
    q = joints(LOADER, places)
    assert np.allclose(np.column_stack([found.value["reach"], found.value["height"]]), tip(LOADER, q), atol=1e-12)
    assert np.allclose(found.value["angle"], angles(LOADER, q)["bucket"], atol=1e-12)
    assert all((std == 0.0).all() for std in found.std.values())


@pytest.mark.parametrize("correlation", [0.0, 0.9, -0.9])
@pytest.mark.parametrize("std", [2e-3, 0.1])
def test_a_deviation_is_that_of_drawn_positions(std, correlation):
    found = place_of(LOADER, LOADER.tip, MIDDLE, np.full((1, 2), std), STROKES, correlation)
    wanted = drawn(std, correlation)
    assert [found.std["reach"][0], found.std["height"][0]] == pytest.approx(wanted, rel=0.03 if std < 0.01 else 0.1)


def test_a_straight_line_alone_would_say_too_little():
    """The case that is sampled for: the level boom's reach hardly changes with a first derivative."""
    small = place_of(LOADER, LOADER.tip, MIDDLE, np.full((1, 2), 1e-4), STROKES).std["reach"][0]
    assert drawn(0.1)[0] > 1.5 * 1e3 * small


def test_an_unknown_position_is_an_unknown_place():
    found = place_of(LOADER, LOADER.tip, np.array([[np.nan, 0.2]]), np.array([[np.nan, 1e-3]]), STROKES)
    assert np.isnan(found.value["height"][0])
    assert np.isnan(found.std["height"][0])


def test_described_points_have_a_name_and_others_are_refused():
    points = {"edge": {"body": "bucket", "x": "4 m", "z": "1.5 m"}}
    linkage = type(DESCRIBED.linkage).model_validate(
        {**DESCRIBED.linkage.model_dump(exclude={"points"})} | {"points": points}
    )
    edge = tool_point(linkage, "bucket.edge")
    assert (edge.body, edge.x, edge.z) == ("bucket", 4.0, 1.5)
    with pytest.raises(ramsight.UnknownNameError, match=r"bucket\.edge"):
        tool_point(linkage, "bucket.egde")
    with pytest.raises(ValueError, match="no such body"):
        type(linkage).model_validate(linkage.model_dump() | {"points": {"edge": {"body": "fork", "x": 0.0, "z": 0.0}}})


@pytest.fixture(scope="module")
def work():
    loader = build_linked(DESCRIBED)
    run = simulate_linked(loader, loading_cycle(loader))
    tracks = {}
    for unit in loader.units:
        part = unit_run(run, unit.name)
        tracks[unit.name] = ramsight.track(unit, report(part), start=float(part["position"][0]))
    return run, tracks


def test_the_edge_of_a_loader_at_work_is_within_its_band(work):
    run, tracks = work
    place = ramsight.tool_place("mining-loader", tracks)
    error = place["tool_height"].values - run["tip_z"].values
    inside = np.abs(error) <= 1.96 * place["tool_height_std"].values
    assert np.quantile(np.abs(error), 0.95) < 0.03  # the tip moves five times as far as the boom's rod
    assert inside.mean() > 0.93
    assert np.array_equal(place["status"].values, tracks["boom"]["status"].values)


def test_a_unit_that_may_be_anywhere_widens_the_place(work):
    _, tracks = work
    known = ramsight.tool_place("mining-loader", tracks)
    alone = ramsight.tool_place("mining-loader", {"boom": tracks["boom"]})
    held = ramsight.tool_place("mining-loader", {"boom": tracks["boom"]}, at={"bucket": "250 mm"})
    wide, narrow = (float(one["tool_height_std"][0]) for one in (alone, known))
    assert wide > 20.0 * narrow
    assert float(held["tool_height_std"][0]) < 3.0 * narrow


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"tracks": {}}, "has no track"),
        ({"at": {"bucket": "600 mm"}}, "at bucket"),
        ({"at": {"fork": "600 mm"}}, "fork"),
        ({"correlation": 1.5}, "correlation"),
        ({"tool": "edge"}, "point of the tool"),
    ],
)
def test_arguments_that_cannot_be_are_refused(work, arguments, message):
    passed = {"tracks": {"boom": work[1]["boom"]}} | arguments
    with pytest.raises(ramsight.RamsightError, match=message):
        ramsight.tool_place("mining-loader", **passed)


def test_a_machine_without_a_mechanism_has_no_tool(work):
    with pytest.raises(ramsight.DescriptionError, match="no mechanism"):
        ramsight.tool_place("press", {"ram": work[1]["boom"]})


def test_the_verb_writes_the_place_beside_the_position(tmp_path):
    words = ("track", "mining-loader", LOG, "--unit", "boom", "--start", "100 mm", "--tool", "bucket.pivot")
    done = at_once(*words, "--out", tmp_path / "t.nc", "--tool-figure", tmp_path / "t.png")
    assert done.returncode == 0, done.stderr
    with xarray.open_dataset(tmp_path / "t.nc") as track:
        q = joints(LOADER, np.column_stack([track["position"].values, np.full(track.sizes["time"], 0.25)]))
        assert np.allclose(track["tool_height"].values, 1.65 + 2.5 * np.sin(q[:, 0]), atol=1e-6)
        assert track["tool_height"].attrs["units"] == "m"
        assert (track["tool_height_std"].values < 0.05).all()  # the bucket's pin, which the boom alone moves
    assert (tmp_path / "t.png").stat().st_size > 10_000


@pytest.mark.slow
def test_the_place_is_said_in_hindsight_too(tmp_path):
    words = ("track", "mining-loader", LOG, "--unit", "boom", "--start", "100 mm", "--tool", "boom.centre_of_mass")
    for more in (("--hindsight",), ("--hindsight", "--both"), ("--sensor", "balance")):
        done = at_once(*words, *more, "--out", tmp_path / "t.csv", "--tool-figure", tmp_path / "t.svg")
        assert done.returncode == 0, done.stderr
        head, first = (tmp_path / "t.csv").read_text().splitlines()[:2]
        row = dict(zip(head.split(","), first.split(","), strict=True))
        assert 0.0 < float(row["tool_height_m"]) < 3.0
        assert (row["tool_height_std_m"] == "") == (more[0] == "--sensor"), "the balance states no deviation"


def test_what_is_of_a_tool_needs_one():
    done = at_once("track", "mining-loader", LOG, "--unit", "boom", "--at", "bucket=250 mm")
    assert done.returncode == 2
    assert "needs --tool" in done.stderr
    done = at_once("track", "mining-loader", LOG, "--unit", "boom", "--tool", "tip", "--at", "250 mm")
    assert "bucket=250 mm" in done.stderr
