"""The loader's film, and the study of the loader under control that the page quotes."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from evaluation import loader_control as study
from ramsight import machine
from ramsight.output import check_folder
from ramsight.plant.linked import build_linked

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parent.parent
LOADER = build_linked(machine.load_machine("mining-loader"))


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """The film, with an animation of few pictures."""
    from film import animation
    from film.__main__ import app

    out = tmp_path_factory.mktemp("loader") / "out"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(animation, "PAGE_STEP", 2.0)
        patch.setattr(animation, "GIF_STEP", 20.0)
        result = CliRunner().invoke(app, ["--out", str(out), "--payload", "5 t", "--seed", "2"])
    assert result.exit_code == 0, result.output
    return out, result.output


def test_the_loader_works_and_leaves_all_its_files(done):
    out, said = done
    assert sorted(file.name for file in out.iterdir()) == [
        "control.png", "control.svg", "loader.gif", "loader.html", "results.json",
    ]  # fmt: skip
    found = json.loads((out / "results.json").read_text())
    assert found["stopped"] == ""
    assert found["options"]["payload"] == 5000.0
    assert found["options"]["delay"] == 0.04, "the drives are late, as real ones are, and picture and page say so"
    for name in ("loader.html", "control.svg"):
        assert "drives 40 ms late either way" in (out / name).read_text(), name
    assert [phase["name"] for phase in found["phases"]][:3] == ["reference boom", "reference bucket", "approach"]
    for name in ("boom", "bucket"):
        assert found[name]["target_error_largest"] < 3e-3
        assert found[name]["within_band"] > 0.9
        assert found[name]["shaft_energy_given"] > found[name]["shaft_energy_taken"] > 0.0
        assert f"{name}: sensor off by" in said
    assert abs(found["energy_residual"]) < 1e-3
    assert "http" not in (out / "loader.html").read_text()


def test_a_loader_works_with_drives_that_are_late():
    from film.loading_cycle import Options, work

    done = work(LOADER, Options(payload=5000.0, delay=0.06))
    assert done.stopped == ""
    missed = [abs(value) for _, off in done.arrivals for value in off.values()]
    assert len(missed) >= 10
    assert max(missed) < 3e-3
    # A rod goes on for as long as a command, and the drive after it, are on their way.
    speed, said = done.run["boom_motor_speed"].values, done.tracks["boom"]["motor_speed"].values
    assert abs(said[3:] - speed[:-3]).max() < 0.2
    assert abs(said - speed).max() > 5.0


def test_nothing_is_left_where_nothing_can_be_written(tmp_path, monkeypatch):
    from film import loading_cycle, report
    from ramsight.errors import OutputError

    file = tmp_path / "file"
    file.write_text("mine")
    with pytest.raises(OutputError, match="not a directory"):
        check_folder(file)

    class Nothing:
        machine = run = tracks = phases = None

    def fails(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(report, "write_animation", fails)
    with pytest.raises(OutputError, match="No space left"):
        report.write_work(Nothing(), loading_cycle.Options(), tmp_path / "out")
    assert [entry.name for entry in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--leak", "99"], "--leak"), (["--oil-temperature", "300 degC"], "--oil-temperature"),
        (["--payload", "3 bar"], "--payload"), (["--drive-delay", "2 s"], "--drive-delay"),
        (["press"], "has no mechanism"), (["forklift-mast"], "boom and bucket"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_at_once(tmp_path, arguments, text):
    from film.__main__ import app
    from ramsight.errors import RamsightError

    result = CliRunner().invoke(app, [*arguments, "--out", str(tmp_path / "out")])
    assert isinstance(result.exception, RamsightError)
    assert text in str(result.exception)
    assert not (tmp_path / "out").exists()


def test_targets_are_met_and_faults_stop_the_machine():
    found = study.summed(study.arrivals(LOADER, LOADER, references=1, targets=3, assumptions=study.KNOWN))
    assert found["targets"] == 3
    assert found["p95"] < 2e-3
    stuck = study.broken(LOADER, "speed stuck")
    assert stuck["standstill"] < 0.3
    assert "stuck" in stuck["reason"]
    absurd = study.broken(LOADER, "temperature absurd")
    assert absurd["goes_on"] == 1.0


def test_the_study_went_every_way_and_stayed_within_its_bounds():
    found = json.loads((ROOT / "results" / "study.json").read_text())["loader_control"]
    assert study.ROWS.keys() | {"faults"} == found.keys()
    assert found["sheet_sensor"]["p95"] < 2e-3
    assert found["sheet_sensor"]["p95"] < found["sheet_truth"]["p95"] + 1e-3
    for fault in found["faults"].values():
        assert fault["goes_on"] or fault["standstill"] < 0.3
