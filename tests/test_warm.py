"""A second start: what is kept of the first gives the same to the bit, and loads no more than it needs."""

import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import ramsight
from ramsight.calibration.sensors import sensor_for
from ramsight.duty.simulate import audited_circuit
from ramsight.engine import kept
from ramsight.engine.private_folder import cache_directory
from ramsight.machine import catalogue
from ramsight.plant.kept_circuit import kept_circuit

NOT_FOR_A_SECOND_TRACK = (
    "xarray", "pandas", "scipy", "matplotlib", "pyarrow", "dask", "pint", "ramsight.engine.llvm",
    "ramsight.sensor.kalman", "ramsight.sensor.belief.bank", "ramsight.calibration.movement", "ramsight.control",
    "ramsight.sensor.persistence", "ramsight.plant.composed", "ramsight.logs.source_can", "ramsight.logs.counter",
    "ramsight.tracking.figures", "ramsight.tracking.track_errors", "ramsight.cli.machine_verbs",
)  # fmt: skip
MODULES, LINES = 123, 19_000
"""Of ramsight, that a second track loads at most."""

TWICE = """
import sys
sys.argv = ["ramsight", *{words}]
from ramsight.cli import main
try:
    main()
finally:
    files = [one.__file__ for name, one in sys.modules.items() if name.partition(".")[0] == "ramsight"]
    print("modules:", len(files), sum(open(file, "rb").read().count(b"\\n") for file in files))
    print("loaded:", *(name for name in {names} if sys.modules.get(name)))
"""


@pytest.fixture
def emptied(monkeypatch, tmp_path):
    """A cache with nothing in it."""
    monkeypatch.setenv("RAMSIGHT_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def files(folder: Path, kind: str) -> list[Path]:
    return sorted(folder.glob(f"{kind}_*.json"))


def test_a_second_track_loads_no_more_than_it_needs(trace, tmp_path):
    words = ["track", "mining-loader", str(trace("boom_441kN_40C").log), "--unit", "boom", "--start", "100 mm"]
    tracks = []
    for out in (tmp_path / "first.csv", tmp_path / "second.csv"):
        code = TWICE.format(words=[*words, "--out", str(out)], names=NOT_FOR_A_SECOND_TRACK)
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        tracks.append(out.read_bytes())
    *_, counted, loaded = done.stdout.splitlines()
    assert loaded == "loaded:"
    files, lines = map(int, counted.removeprefix("modules: ").split())
    assert files <= MODULES, "what is not needed is loaded where it is used"
    assert lines <= LINES
    assert tracks[0] == tracks[1]


@pytest.mark.parametrize("kind", ["kalman", "balance"])
def test_a_kept_sensor_is_the_one_that_was_made(kind, boom):
    made = getattr(__import__(f"ramsight.sensor.{kind}", fromlist=[kind]), kind)(boom)
    sensor_for(boom, kind)
    again = sensor_for(boom, kind)
    assert again.recursion.known is not None
    assert again.recursion.replayed == made.recursion.replayed
    for name in ("state", "inputs", "parameters", "outputs"):
        assert getattr(again.recursion, name) == getattr(made.recursion, name)
    assert (again.kind, dict(again.units)) == (made.kind, dict(made.units))
    np.testing.assert_array_equal(again.parameters, made.parameters)
    np.testing.assert_array_equal(again.initial, made.initial)
    for one, other in zip(again.states, made.states, strict=True):
        assert replace(one, value=0.0) == replace(other, value=0.0)
    rows = np.random.default_rng(0).random((20, 4)) * [1.0, 100.0, 50.0, 20.0] + [0.0, 0.0, 0.0, 300.0]
    rows[:, 0] = np.arange(20) * 0.02
    for sensor in (made, again):
        sensor.start(0.1)
    steps = [[sensor.step(*row) for row in rows] for sensor in (made, again)]
    assert repr(steps[0]) == repr(steps[1])
    assert made.state == again.state


def test_the_graph_of_a_kept_sensor_is_made_where_it_is_asked_for(boom):
    sensor_for(boom, "balance")
    again = sensor_for(boom, "balance")
    assert again.recursion.graph.x.numel() == len(again.recursion.state)
    assert again.recursion.function().n_out() == 2
    assert again.sections() == ()


def test_a_kept_equation_is_the_one_that_was_made(boom):
    made = audited_circuit(boom)
    kept_circuit(boom)
    kept_circuit.cache_clear()
    again = kept_circuit(boom)
    assert "x" not in vars(again.ode)
    np.testing.assert_array_equal(again.values, made.values)
    for name in ("nodes", "losses", "works", "tank_flows", "commands"):
        assert getattr(again, name) == getattr(made, name)
    assert again.ode.states == made.ode.states
    assert [(one.name, one.unit) for one in again.ode.outputs] == [(one.name, one.unit) for one in made.ode.outputs]
    assert again.ode.function.serialize() == made.ode.function.serialize()
    assert again.ode.output_function.n_instructions() == made.ode.output_function.n_instructions()
    with pytest.raises(AttributeError):
        _ = again.ode.nothing


def test_what_is_kept_depends_on_all_that_it_follows_from(boom, monkeypatch):
    key = kept.key_of("sensor", boom)
    assert key == kept.key_of("sensor", ramsight.build("mining-loader", unit="boom"))
    others = [
        kept.key_of("other", boom),
        kept.key_of("sensor", replace(boom, tank_pressure=boom.tank_pressure + 1e-9 * boom.tank_pressure)),
        kept.key_of("sensor", replace(boom, assumptions=boom.assumptions.replace({"drive.delay": "30 ms"}))),
    ]
    monkeypatch.setattr(kept, "_sources", lambda: "another version")
    others.append(kept.key_of("sensor", boom))
    assert len({key, *others}) == 5


def test_what_is_not_known_through_and_through_is_not_kept(emptied):
    class Part:
        pass

    assert kept.key_of("sensor", Part()) is None
    kept.keep(None, {})
    assert kept.read_kept(None) is None
    assert not files(emptied, "sensor")


@pytest.mark.parametrize(
    "damage",
    [
        lambda path: path.write_bytes(b""),
        lambda path: path.write_bytes(path.read_bytes()[:-1]),
        lambda path: path.write_bytes(path.read_bytes().replace(b'"a": 1', b'"a": 2')),
        lambda path: path.write_bytes(path.read_bytes().replace(b"kept 1", b"kept 0")),
        lambda path: path.unlink(),
    ],
)
def test_a_file_that_is_damaged_or_anothers_is_as_none(emptied, damage):
    kept.keep("sum_1", {"a": 1})
    assert kept.read_kept("sum_1") == {"a": 1}
    assert kept.read_kept("sum_2") is None
    damage(cache_directory() / "sum_1.json")
    assert kept.read_kept("sum_1") is None


def test_a_file_under_the_name_of_another_is_as_none(emptied):
    kept.keep("sum_1", {"a": 1})
    (file,) = files(emptied, "sum")
    file.with_name("sum_2.json").write_bytes(file.read_bytes())
    assert kept.read_kept("sum_2") is None


def test_many_may_keep_the_same_at_once_and_few_are_left(emptied):
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda k: kept.keep(f"sum_{k % 100}", {"k": k % 100, "x": 0.1}), range(400)))
    found = files(emptied, "sum")
    assert 0 < len(found) <= kept.MOST
    assert all(kept.read_kept(one.stem) == {"k": int(one.stem[4:]), "x": 0.1} for one in found)


def test_what_was_used_lately_stays(emptied):
    """One that is read before others are kept does not go as the oldest."""
    for k in range(kept.MOST):
        kept.keep(f"sum_{k}", {"k": k})
    for k, file in enumerate(sorted(files(emptied, "sum"), key=lambda file: int(file.stem[4:]))):
        os.utime(file, (1e9 + k, 1e9 + k))
    assert kept.read_kept("sum_0") == {"k": 0}
    kept.keep("sum_new", {"k": -1})
    assert kept.read_kept("sum_1") is None, "the oldest that nobody used"
    assert kept.read_kept("sum_0") == {"k": 0}


def test_a_sensor_is_made_where_nothing_can_be_kept(boom, monkeypatch):
    monkeypatch.setattr(kept, "write_whole", lambda *_: (_ for _ in ()).throw(OSError("full")))
    monkeypatch.setattr(kept, "read_kept", lambda key: None)
    assert sensor_for(boom, "balance").recursion.known is None


def test_numbers_are_kept_to_the_bit(emptied):
    numbers = [0.1, 1e-300, float("inf"), -0.0, np.nextafter(1.0, 2.0).item()]
    kept.keep("numbers_1", {"of": numbers})
    found = kept.read_kept("numbers_1")
    assert found is not None
    assert json.dumps(found["of"]) == json.dumps(numbers)


def test_an_entry_of_the_catalogue_is_found_by_the_name_of_its_file():
    known = catalogue.entries()
    assert all(one.path.stem.casefold() == one.name.casefold() for one in known)
    assert catalogue.circuits() == tuple(one.name for one in known if one.kind == "circuit")
    assert all(catalogue.find(one.kind, one.name.upper()) == one for one in known)
