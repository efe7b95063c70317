"""A weighing that is exported weighs what Python weighs: as C beside a sensor, and as an FMU."""

import json
import math
import re

import numpy as np
import pytest

import ramsight
from ramsight import machine
from ramsight.cli import app
from ramsight.deploy.c_function import literal
from ramsight.deploy.c_weighing import golden_weighing_source, weighing_scene, weighing_source
from ramsight.deploy.compiler import STRICT, CompilerError, find_compiler, run
from ramsight.deploy.encoder.objects import NO_WEIGHING
from ramsight.deploy.encoder.objects import QUALITIES as ON_THE_BUS
from ramsight.deploy.fmu import write_fmu
from ramsight.deploy.golden_weighing import golden_weighing
from ramsight.deploy.weighing_words import WeighedAs
from ramsight.normal import TWO_SIDED_95
from ramsight.tool.force_scale import TERMS, Scale, described_scale
from ramsight.tool.weighing_events import Quality
from ramsight.tool.weighing_tally import Tally

from .fmu_instance import Instance

COMPILER = find_compiler()
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="there is no C compiler")
LOADER = machine.load_machine("mining-loader")
SCENE = weighing_scene(LOADER, "boom")
LEARNED = Scale(np.array([0.012, -3e-3, -800.0, 350.0]), np.diag([1e-5, 1e-6, 1e5, 1e4]) + 1e-7, masses=3)
LEVEL, SLOPE = 0.25, math.radians(1.0)


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """The boom's folder with a weighing that begins with a learned scale."""
    out = tmp_path_factory.mktemp("exported") / "boom"
    return ramsight.export_c("mining-loader", "boom", out=out, weighing=True, scale=LEARNED)


def golden_said(folder, options=STRICT):
    """What the weighing's test program says."""
    name = "ramsight_boom_weighing"
    return run([COMPILER, *options, "-DROUNDS=1", f"{name}.c", f"{name}_test.c", "-lm", "-o", "golden"], folder) + run(
        [str(folder / "golden")], folder
    )


# Golden samples


def test_a_golden_run_has_every_kind_of_weighing():
    scale = described_scale(SCENE.machine.unit("boom"), SCENE.weight)
    weighed = golden_weighing(SCENE, Tally(scale, SCENE.other_strokes, SCENE.rated)).weighed
    qualities = [list(Quality)[int(k)] for k in weighed[:, 2]]
    assert qualities == [Quality.GOOD, Quality.GOOD, Quality.SPILLED, Quality.TOO_SHORT]
    assert weighed[:, 1].tolist() == [1.0, 2.0, 1.0, 1.0], "the first load is lowered again"
    assert weighed[1, 6] == pytest.approx(0.5 * SCENE.rated, abs=0.01 * SCENE.rated)
    assert np.isfinite(weighed[1, 10]), "of the rated load"


@needs_compiler
def test_the_c_weighs_what_python_weighs(exported):
    strict = [*STRICT, "-Wconversion", "-Wdouble-promotion"]
    said = golden_said(exported.folder, strict)
    assert "passed" in said
    assert float(re.search(r"largest difference (\S+) kg", said)[1]) < 1e-7
    assert 0 < exported.weighing.code < 65_000
    assert exported.weighing.state < 2000


@needs_compiler
@pytest.mark.parametrize(
    ("before", "after"),
    [
        (f"#define HALF_BAND {literal(TWO_SIDED_95)}", "#define HALF_BAND 1.97"),
        ("w->total = said[", "w->total = 1.0 + said["),
        ("if (!(ended[0] > 0.0)) return 0;", "if (!(ended[0] > 0.0) || w->count == 2) return 0;"),
    ],
)
def test_a_weighing_that_is_another_fails(exported, tmp_path, before, after):
    for file in exported.folder.glob("ramsight_boom*.[ch]"):
        text = file.read_text(encoding="utf-8")
        if file.name == "ramsight_boom_weighing.c":
            assert text.count(before) == 1
            text = text.replace(before, after)
        (tmp_path / file.name).write_text(text, encoding="utf-8")
    with pytest.raises(CompilerError, match="FAILED"):
        golden_said(tmp_path)


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize("name", ["forklift-mast", "mining-loader-4t"])
def test_other_machines_with_a_payload_do_so_too(tmp_path, name):
    """A mast of one unit without a load chart; another loader."""
    described = machine.load_machine(name)
    unit = next(iter(described.linkage.cylinders))
    scene = weighing_scene(described, unit)
    source = golden_weighing_source(weighing_source(scene, "ramsight_boom", name), scene)
    for file, text in source.files.items():
        (tmp_path / file).write_text(text, encoding="utf-8")
    (tmp_path / "ramsight_boom.h").write_text(
        "#include <math.h>\ntypedef struct { double time; } ramsight_boom_inputs;\ntypedef struct { int status; double "
        "position, position_low, position_high, velocity, load, load_std, load_age; } ramsight_boom_outputs;\n"
    )
    assert "passed" in golden_said(tmp_path)


def test_a_sensor_is_the_same_with_and_without_a_weighing(exported, tmp_path):
    plain = ramsight.export_c("mining-loader", "boom", out=tmp_path / "boom", compiler="")
    own = {"README.md", "ramsight.json", "card.srmd", "CMakeLists.txt"}
    for name in set(plain.files) - own:
        assert (plain.folder / name).read_bytes() == (exported.folder / name).read_bytes()
    more = {f"ramsight_boom_weighing{end}" for end in (".c", ".h", "_golden.h", "_test.c")}
    assert set(exported.files) - set(plain.files) == more
    record = json.loads((exported.folder / "ramsight.json").read_text())
    assert "--weighing" in record["command"]


def test_numbers_of_qualities_are_those_of_the_bus():
    assert [one.name for one in WeighedAs] == [*(one.name for one in ON_THE_BUS), "NONE"]
    assert [WeighedAs[one.name] for one in ON_THE_BUS] == list(range(len(ON_THE_BUS)))
    assert WeighedAs.NONE == NO_WEIGHING
    assert all("--" not in one.text for one in WeighedAs)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"machine": "press", "weighing": True}, "lifts nothing that is weighed"),
        ({"weighing": True, "profile": "balance"}, "profile"),
        ({"scale": LEARNED}, "is of a weighing"),
    ],
)
def test_a_weighing_that_cannot_be_is_refused(tmp_path, arguments, message):
    passed = {"machine": "mining-loader", "out": tmp_path / "c", "compiler": ""} | arguments
    passed["unit"] = None if "machine" in arguments else "boom"
    with pytest.raises(ramsight.DescriptionError, match=message):
        ramsight.export_c(**passed)


@pytest.mark.slow
def test_the_verb_writes_a_weighing(tmp_path, runner):
    done = runner.invoke(app, ["export", "c", "mining-loader", "--unit", "boom", "--weighing", "--out", str(tmp_path)])
    assert done.exit_code == 0, done.output
    assert "ramsight_boom_weighing.c" in done.output
    assert "ramsight_boom_weighing_step" in (tmp_path / "README.md").read_text(encoding="utf-8")


@pytest.fixture
def runner():
    from typer.testing import CliRunner

    return CliRunner()


# The FMU


@needs_compiler
@pytest.mark.parametrize("fmi", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_an_fmu_weighs_what_the_live_weighing_of_both_sensors_weighs(tmp_path, logs, fmi):
    """On a slope and with a learned scale, by the boom's drive and what the bucket's sensor says."""
    pytest.importorskip("fmpy")
    done = write_fmu(LOADER, "boom", tmp_path / "boom.fmu", what="weighing", fmi=fmi)
    one = Instance(done.path, tmp_path / "one")
    assert one.get("quality") == WeighedAs.NONE
    pairs = [(k, n) for k in range(len(TERMS)) for n in range(k, len(TERMS))]
    scale = {f"scale_{name}": float(value) for name, value in zip(TERMS, LEARNED.value, strict=True)}
    scale |= {f"scale_covariance_{k + 1}{n + 1}": float(LEARNED.covariance[k, n]) for k, n in pairs}
    one.begin(start_position=0.07, start_std=1e-3, start_known=True, inclination=SLOPE, **scale)
    sensors = {name: ramsight.sensor_for("mining-loader", unit=name) for name in logs}
    sensors["boom"].start(0.07, 1e-3)
    sensors["bucket"].start(LEVEL, 1e-3)
    live = ramsight.LiveWeighing("mining-loader", scale=LEARNED, inclination=SLOPE)
    columns = [np.column_stack([logs[name][key].values for key in REPORTED]).tolist() for name in sensors]
    for boom, bucket in zip(*columns, strict=True):
        sensors["boom"].step(*boom)
        sensors["bucket"].step(*bucket)
        beside = sensors["bucket"]
        half = 0.5 * (beside.says("position_high") - beside.says("position_low"))
        one.set(motor_speed=boom[1], motor_torque=boom[2], oil_temperature=boom[3],
                bucket_position=beside.says("position"), bucket_std=half / TWO_SIDED_95,
                bucket_velocity=beside.says("velocity"))  # fmt: skip
        one.step(boom[0], 0.0)
        if live.step(boom[0], sensors) is None:
            continue
        last = live.weighings[-1]
        assert one.get("weighings") == len(live.weighings)
        assert WeighedAs(one.get("quality")).name == last.quality.name
        for name, value in (
            ("mass", last.mass), ("mass_half_band", 0.5 * (last.high - last.low)), ("total", live.total),
            ("total_half_band", TWO_SIDED_95 * live.total_std), ("rated_share", last.rated_share),
        ):  # fmt: skip
            assert one.get(name) == pytest.approx(value, rel=1e-9)
    assert [round(weighed.mass, -2) for weighed in live.weighings] == [3000.0, 6000.0]
    one.fmu.freeInstance()


REPORTED = ("time", "motor_speed", "motor_torque", "oil_temperature")


@needs_compiler
def test_an_fmu_whose_bucket_is_not_known_is_less_sure(tmp_path, logs):
    pytest.importorskip("fmpy")
    done = write_fmu(LOADER, "boom", tmp_path / "boom.fmu", what="weighing")
    bands = []
    for known in (True, False):
        one = Instance(done.path, tmp_path / str(known), str(known))
        one.begin(start_position=0.07, start_std=1e-3, start_known=True)
        for row in np.column_stack([logs["boom"][key].values for key in REPORTED])[:1500].tolist():
            one.set(**dict(zip(REPORTED[1:], row[1:], strict=True)), bucket_position=LEVEL if known else 1e10)
            one.step(row[0], 0.0)
        bands.append(one.get("mass_half_band"))
        one.fmu.freeInstance()
    assert bands[1] > bands[0] > 0.0


def test_an_fmu_of_a_unit_that_lifts_nothing_is_refused(tmp_path):
    with pytest.raises(ramsight.DescriptionError, match="lifts nothing that is weighed"):
        write_fmu(machine.load_machine("press"), "ram", tmp_path / "ram.fmu", what="weighing")
