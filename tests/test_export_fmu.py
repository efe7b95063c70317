"""Exported FMUs are valid, say what ramsight says, and behave as FMI asks: instances, reset, states, errors."""

import ctypes
import shutil
import zipfile

import numpy as np
import pytest
from typer.testing import CliRunner

from ramsight import machine
from ramsight.cli import app
from ramsight.deploy.compiler import STRICT, find_compiler, run
from ramsight.deploy.fmu import write_fmu
from ramsight.deploy.golden import faulty_day
from ramsight.deploy.weighing_words import WeighedAs
from ramsight.duty import simulate
from ramsight.duty.profile import Duty, Profile, constant
from ramsight.errors import DescriptionError, OutputError
from ramsight.plant.build import build
from ramsight.plant.ddh import build_ddh
from ramsight.plant.limits import limits_of
from ramsight.sensor.kalman import kalman
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import BOUND
from ramsight.tracking.comparing import Comparison, Verdict

from .fmu_instance import Instance

fmpy = pytest.importorskip("fmpy")
FMICallException = pytest.importorskip("fmpy.fmi1").FMICallException
pytestmark = [pytest.mark.slow, pytest.mark.skipif(find_compiler() is None, reason="there is no C compiler")]
LOADER = machine.load_machine("mining-loader")
FMI = (2, 3)
KINDS = [(what, fmi) for what in ("sensor", "plant") for fmi in FMI]
WRITTEN = [*KINDS, *((what, fmi) for what in ("compare", "weighing") for fmi in FMI)]


@pytest.fixture(scope="module")
def fmus(tmp_path_factory):
    """The boom's FMUs by what and version."""
    folder = tmp_path_factory.mktemp("fmus")
    return {
        kind: write_fmu(LOADER, "boom", folder / f"{kind[0]}{kind[1]}.fmu", what=kind[0], fmi=kind[1])
        for kind in WRITTEN
    }


def refuse(call, *arguments, one=None, says=""):
    """Expect an error, and with FMI 3 what is logged of it."""
    with pytest.raises(FMICallException):
        call(*arguments)
    if says and one.fmi == 3:
        assert says in one.said[-1]


@pytest.fixture
def instances(fmus, tmp_path):
    """Makes instances, and frees them."""
    made = []

    def make(what, fmi, name="one"):
        made.append(Instance(fmus[what, fmi].path, tmp_path / f"{what}{fmi}{name}", name))
        return made[-1]

    yield make
    for one in made:
        one.fmu.freeInstance()


@pytest.mark.parametrize("kind", WRITTEN)
def test_fmpy_finds_no_problem(fmus, kind):
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(fmus[kind].path)) == []
    with zipfile.ZipFile(fmus[kind].path) as archive:
        names = archive.namelist()
    identifier = f"ramsight_boom_{kind[0]}"
    place = "linux64" if kind[1] == 2 else "x86_64-linux"
    assert place not in fmus[kind].binaries or f"binaries/{place}/{identifier}.so" in names
    assert ("sources/buildDescription.xml" in names) == (kind[1] == 3)
    said = fmpy.read_model_description(str(fmus[kind].path)).modelVariables
    between_samples = "continuous" if kind[0] == "plant" else "discrete"
    assert {one.variability for one in said if one.causality == "output"} == {between_samples}


def begun_day():
    """A unit, its faulty day, where it begins, and the sensor that knows that."""
    unit = build_ddh("boom", LOADER.unit("boom"))
    rows, start = faulty_day(unit, duration=60.0, every=30.0, seed=5)
    sensor = kalman(unit)
    sensor.start(start)
    return unit, rows, start, sensor


@pytest.mark.parametrize("fmi", FMI)
def test_the_sensor_tracks_a_faulty_day_as_in_python(fmus, instances, fmi):
    _, rows, start, sensor = begun_day()
    one = instances("sensor", fmi)
    one.begin(start_position=start, start_known=True)
    assert one.get("position") == start
    reached = 0.0
    for time, speed, torque, temperature, reference in rows:
        if time < reached:  # no importer steps back
            continue
        reached = time
        known = bool(np.isfinite(reference))
        one.set(motor_speed=speed, motor_torque=torque, oil_temperature=temperature)
        one.set(reference=reference if known else 0.0, reference_known=known)
        one.step(time, 0.0)  # the next one begins when it comes
        said = sensor.step(time, speed, torque, temperature, reference)
        assert one.get("position") == pytest.approx(said.position, abs=1e-12)
        assert one.get("status") == said.status


@pytest.mark.parametrize("fmi", FMI)
def test_the_comparison_says_what_python_says(instances, fmi):
    """A real sensor that is right, leaps, says nothing, is right again, and stands while the piston goes on."""
    unit, rows, start, sensor = begun_day()
    pair = Comparison(unit.cylinder.stroke, unit.travel_per_radian * limits_of(unit).max_speed, 1e-3, 0.1)
    one = instances("compare", fmi)
    one.begin(start_position=start, start_known=True, other_tolerance=1e-3, time_to_alert=0.1)
    assert one.get("verdict") == Verdict.UNCHECKED
    met, stood = set(), 0.0
    times = np.maximum.accumulate([row[0] for row in rows])  # no importer steps back
    forward = [row for row, time in zip(rows, times, strict=True) if row[0] == time]
    for k, (time, speed, torque, temperature, _) in enumerate(forward):
        said = sensor.step(time, speed, torque, temperature)
        true = said.position + (0.1 if 500 < k < 600 else 0.0)
        stood = stood if k > 1200 else true
        other = np.nan if 700 < k < 720 else stood
        one.set(motor_speed=speed, motor_torque=torque, oil_temperature=temperature)
        one.set(other_position=1e10 if np.isnan(other) else other)
        one.step(time, 0.0)
        verdict = pair.step(time, said.position, sensor.says(BOUND), said.status, other)
        assert one.get("verdict") == verdict
        met.add(verdict)
    assert {Verdict.AGREE, Verdict.UNCHECKED, Verdict.OTHER_WRONG} <= met


@pytest.mark.parametrize("fmi", FMI)
def test_the_sensor_simulates_in_fmpy_to_the_same_trace(fmus, fmi):
    unit = build_ddh("boom", LOADER.unit("boom"))
    rows, start = faulty_day(unit, duration=60.0, every=None, seed=5)
    names = ("time", "motor_speed", "motor_torque", "oil_temperature")
    table = np.array([tuple(row[:4]) for row in rows], dtype=[(name, float) for name in names])
    found = fmpy.simulate_fmu(
        str(fmus["sensor", fmi].path),
        stop_time=rows[-1, 0],
        output_interval=0.02,
        input=table,
        start_values={"start_position": start, "start_known": True, "reference": 0.0, "reference_known": False},
        output=["position", "status"],
    )
    sensor = kalman(unit)
    sensor.start(start)
    expected = [sensor.step(*row[:4]).position for row in rows]
    # A step from t takes the sample at t; what it says is recorded at the step's end.
    assert np.abs(found["position"][1:] - expected[:-1]).max() < 1e-6
    assert set(found["status"].astype(int)) <= {int(status) for status in Status}


def duty():
    """Moves, a load change and rests whose corners lie on steps of 10 ms."""
    speed = Profile([0.0, 1.0, 1.8, 4.8, 5.6, 7.0, 7.8, 11.8, 12.6, 14.0], [0, 0, 157, 157, 0, 0, -157, -157, 0, 0])
    return Duty(speed, Profile([0.0, 6.0, 6.4], [441e3, 441e3, 300e3]), constant(313.15), 0.14)


def sampled(whole, step=0.01):
    """A plant's inputs at each step of a duty, with their slopes from there."""
    time = np.round(np.arange(0.0, whole.duration + step / 2, step), 9)
    acceleration, rate = (np.append(np.diff(p(time)) / step, 0.0) for p in (whole.motor_speed, whole.load))
    names = ("time", "motor_speed", "load", "motor_acceleration", "load_rate", "oil_temperature")
    columns = (time, whole.motor_speed(time), whole.load(time), acceleration, rate, np.full(len(time), 313.15))
    return np.array(list(zip(*columns, strict=True)), dtype=[(name, float) for name in names])


def simulated(path, whole, outputs):
    """A duty of an exported plant, by fmpy."""
    return fmpy.simulate_fmu(str(path), stop_time=whole.duration, output_interval=0.01, input=sampled(whole),
                             start_values={"start_position": whole.start_position}, output=outputs)  # fmt: skip


@pytest.mark.parametrize("fmi", FMI)
def test_the_plant_simulates_in_fmpy_to_the_same_trace(fmus, fmi):
    whole = duty()
    found = simulated(fmus["plant", fmi].path, whole, ["position", "velocity", "pressure_chamber_a", "motor_torque"])
    run = simulate(build_ddh("boom", LOADER.unit("boom")), whole, sample_period=0.01)
    assert np.ptp(run["position"].values) > 0.1
    assert np.abs(found["position"] - run["position"].values).max() < 1e-6
    assert np.abs(found["pressure_chamber_a"] - run["pressure_a"].values).max() < 1e3
    # At a corner the torque jumps with the acceleration, and an FMU tells the one before.
    corner = np.isin(sampled(whole)["time"], whole.corners())
    assert np.abs(found["motor_torque"] - run["motor_torque"].values)[~corner].max() < 0.01


def test_input_derivatives_of_fmi_2_are_slopes(fmus, instances):
    one, other = instances("plant", 2), instances("plant", 2, "two")
    for each in (one, other):
        each.begin(start_position=0.1, load=200e3)
    for k in range(100):
        one.set(motor_speed=0.5 * k, motor_acceleration=50.0)
        other.set(motor_speed=0.5 * k)
        other.fmu.setRealInputDerivatives([other.place["motor_speed"]], [1], [50.0])
        for each in (one, other):
            each.step(0.01 * k, 0.01)
    assert one.get("position") == other.get("position") > 0.1


@pytest.mark.parametrize(("name", "unit"), [("eha-test-bench", "axis"), ("eha-single-rod", "axis"), ("press", "ram")])
def test_any_circuit_is_a_plant(tmp_path, name, unit):
    described = machine.load_machine(name)
    unit = unit if unit in described.units else next(iter(described.units))
    done = write_fmu(described, unit, tmp_path / "plant.fmu", what="plant", fmi=3)
    built = build(described.unit(unit), unit)
    start = 0.4 * built.cylinder.stroke
    whole = Duty(Profile([0.0, 0.2, 1.0, 2.0], [0.0, 0.0, 20.0, 0.0]), constant(1e3), constant(313.15), start)
    found = simulated(done.path, whole, ["position"])
    run = simulate(built, whole, sample_period=0.01)
    assert np.abs(found["position"] - run["position"].values).max() < 1e-6


@pytest.mark.parametrize(("what", "fmi"), KINDS)
def test_instances_are_apart_and_a_reset_begins_anew(instances, what, fmi):
    one, other = instances(what, fmi), instances(what, fmi, "two")
    for each in (one, other):
        each.begin(start_position=0.2, **({"start_known": True} if what == "sensor" else {"load": 100e3}))
    before = other.get("position")
    traces = []
    for _ in range(2):
        for k in range(50):
            one.set(motor_speed=100.0, **({"motor_torque": 20.0} if what == "sensor" else {}))
            one.step(0.02 * k, 0.02)
        traces.append(one.get("position"))
        one.fmu.reset()
        one.begin(start_position=0.2, **({"start_known": True} if what == "sensor" else {"load": 100e3}))
    assert traces[0] == traces[1] != before
    assert other.get("position") == before


@pytest.mark.parametrize(("what", "fmi"), KINDS)
def test_a_state_is_kept_given_back_and_carried_as_bytes(instances, what, fmi):
    one = instances(what, fmi)
    one.begin(start_position=0.2, **({"start_known": True} if what == "sensor" else {"load": 100e3}))

    def on(first):
        for k in range(first, first + 20):
            one.set(motor_speed=80.0)
            one.step(0.02 * k, 0.02)
        return one.get("position")

    on(0)
    written = "State" if hasattr(one.fmu, "getFMUState") else "state"
    get, put, free = (getattr(one.fmu, f"{verb}FMU{written}") for verb in ("get", "set", "free"))
    kept = get()
    first = on(20)
    put(kept)
    assert on(20) == first
    carry = getattr(one.fmu, "serializeFMUState", None) or one.fmu.serializeFMUstate
    uncarry = getattr(one.fmu, "deserializeFMUState", None) or one.fmu.deSerializeFMUstate
    again = uncarry(carry(kept))
    put(again)
    assert on(20) == first
    data, rng = bytes(carry(kept)), np.random.default_rng(68)
    for place in rng.integers(len(data), size=300):
        damaged = bytearray(data)
        damaged[place] ^= int(rng.integers(1, 256))
        refuse(uncarry, bytes(damaged))
    for cut in (0, 1, len(data) - 9, len(data) - 1):
        refuse(uncarry, data[:cut])
    free(kept)
    free(again)


def test_what_is_wrong_is_refused_and_logged(instances):
    one = instances("plant", 3)
    one.begin(start_position=0.2)
    fixed = "is a parameter, and fixed once the simulation runs"
    refuse(lambda: one.set(start_position=0.3), one=one, says=fixed)
    refuse(lambda: one.set(position=0.3), one=one, says="is an output")
    one.set(motor_speed=float("nan"))
    refuse(one.step, 0.0, 0.01, one=one, says="at 0 s: an input is not a finite number")
    one.set(motor_speed=0.0)
    one.step(0.0, 0.01)
    refuse(one.fmu.getFloat64, [9999], one=one, says="no Float64 variable with the value reference 9999")


def outputs(one):
    names = [v.name for v in one.description.modelVariables if v.causality == "output"]
    return {name: one.get(name) for name in names}


@pytest.mark.parametrize(("what", "fmi"), WRITTEN)
def test_outputs_before_initialization_are_not_known_and_say_so(instances, what, fmi):
    one = instances(what, fmi)
    for again in (False, True):
        for name, value in outputs(one).items():
            if name == "status":
                assert value == Status.NOT_REFERENCED
            elif name == "verdict":
                assert value == Verdict.UNCHECKED
            elif name == "quality":
                assert value == WeighedAs.NONE
            else:
                assert np.isnan(value), name
        if not again:
            one.begin()
            one.step(0.0, 0.02)
            one.fmu.reset()


@pytest.mark.parametrize("fmi", FMI)
def test_a_sensor_that_knows_no_start_has_no_position_while_it_is_initialized(instances, fmi):
    one = instances("sensor", fmi)
    if fmi == 2:
        one.fmu.setupExperiment(startTime=0.0)
    one.fmu.enterInitializationMode()
    assert np.isnan(one.get("position"))
    assert one.get("status") == Status.NOT_REFERENCED


@pytest.mark.parametrize(("what", "fmi"), WRITTEN)
def test_a_step_that_is_none_is_an_error_and_changes_nothing(instances, what, fmi):
    one = instances(what, fmi)
    one.begin()
    one.step(0.0, 0.02)
    one.step(0.02 - 1e-17, 0.02)  # the sum of steps of an importer, rounded
    before, nan, inf = outputs(one), float("nan"), float("inf")
    for says, steps in {
        "the step is negative": ((0.04, -0.01), (0.04, -1e-300)),
        "finite numbers": ((0.04, nan), (0.04, inf), (0.04, -inf), (nan, 0.02), (inf, 0.02), (1.7e308, 1.7e308)),
        "before the last one has ended": ((0.02, 0.02), (-5.0, 0.02)),
        "1e9 s at most": ((1e300, 0.02), (0.04, 1e300), (-1e300, 0.02)),
    }.items():
        for step in steps:
            refuse(one.step, *step, one=one, says=says)
    assert outputs(one) == pytest.approx(before, nan_ok=True)
    one.step(0.04, 0.02)


@pytest.mark.parametrize(("what", "fmi"), WRITTEN)
def test_calls_out_of_their_order_are_errors(instances, what, fmi):
    one = instances(what, fmi)
    start = {"startTime": 0.0} if fmi == 3 else {}
    initialize, end = (lambda: one.fmu.enterInitializationMode(**start)), one.fmu.exitInitializationMode
    for call in (end, lambda: one.step(0.0, 0.02), one.fmu.terminate):
        refuse(call)
    one.begin()
    for call in (initialize, end):
        refuse(call, one=one, says="the instance is stepping, and has to be")
    one.step(0.0, 0.02)
    one.fmu.terminate()
    for call in (lambda: one.step(0.02, 0.02), one.fmu.terminate, initialize):
        refuse(call)
    one.fmu.reset()
    one.begin()
    one.step(0.0, 0.02)


@pytest.mark.parametrize(("what", "fmi"), WRITTEN)
def test_a_step_past_the_stop_time_is_an_error(instances, what, fmi):
    one = instances(what, fmi)

    def begin(**times):
        if fmi == 2:
            one.fmu.setupExperiment(startTime=0.0, **times)
            one.fmu.enterInitializationMode()
        else:
            one.fmu.enterInitializationMode(startTime=0.0, **times)
        one.fmu.exitInitializationMode()

    begin(stopTime=1.0)
    for k in range(50):  # 0.02 is no binary fraction, and the sum of steps may pass 1 by rounding
        one.step(k * 0.02, 0.02)
    before = outputs(one)
    for step in ((1.0, 0.5), (1.0, 1e-6), (0.5, 0.6)):
        refuse(one.step, *step, one=one, says="the step ends after the stop time")
    assert outputs(one) == pytest.approx(before, nan_ok=True)
    one.fmu.reset()
    begin()
    one.step(0.0, 0.02)
    one.step(0.02, 2.0)
    one.fmu.reset()
    with pytest.raises(FMICallException):
        begin(stopTime=-1.0)


@pytest.mark.parametrize("fmi", FMI)
def test_a_start_that_cannot_be_is_refused(instances, fmi):
    nan, inf = float("nan"), float("inf")
    for k, (position, std) in enumerate(((nan, 1e-3), (inf, 1e-3), (5.0, 1e-3), (-0.1, 1e-3), (0.2, nan))):
        one = instances("sensor", fmi, f"sensor{k}")
        start = {"start_position": position, "start_std": std, "start_known": True}
        refuse(lambda one=one, start=start: one.begin(**start), one=one, says="from 0 to the stroke (0.7 m)")
        refuse(one.step, 0.0, 0.02)
    refuse(lambda: instances("plant", fmi).begin(start_position=nan))
    for k, wrong in enumerate(({"other_tolerance": 0.0}, {"other_tolerance": nan}, {"time_to_alert": 61.0})):
        refuse(lambda k=k, wrong=wrong: instances("compare", fmi, f"compare{k}").begin(**wrong))
    for k, start in enumerate((nan, inf, 1e300)):
        fmu = instances("sensor", fmi, f"time{k}").fmu
        begin = fmu.setupExperiment if fmi == 2 else fmu.enterInitializationMode
        refuse(lambda begin=begin, start=start: begin(startTime=start))


def test_another_token_makes_no_instance(fmus, tmp_path):
    fmpy.extract(str(fmus["plant", 2].path), unzipdir=str(tmp_path))
    library = ctypes.CDLL(str(next((tmp_path / "binaries").rglob("*.so"))))
    library.fmi2Instantiate.restype = ctypes.c_void_p
    assert library.fmi2Instantiate(b"one", 1, b"{wrong}", b"", None, 0, 0) is None


@pytest.mark.parametrize("kind", KINDS)
def test_the_sources_inside_compile_strictly(fmus, kind, tmp_path):
    with zipfile.ZipFile(fmus[kind].path) as archive:
        archive.extractall(tmp_path)
    more = ["-Wshadow", "-Wstrict-prototypes", "-O0", "-fPIC", "-shared"]
    names = sorted(file.name for file in (tmp_path / "sources").glob("*.c"))
    run([find_compiler(), *STRICT, *more, *names, "-o", "all.so", "-lm"], tmp_path / "sources")
    if shutil.which("g++"):
        as_cpp = ["-x", "c++", "-std=c++11", "-Wall", "-Wextra", "-Wpedantic", "-Wvla", "-Werror", "-fsyntax-only"]
        run(["g++", *as_cpp, *names], tmp_path / "sources")


def test_sanitizers_find_nothing_in_a_plants_run(fmus, tmp_path):
    with zipfile.ZipFile(fmus["plant", 2].path) as archive:
        archive.extractall(tmp_path)
    folder = tmp_path / "sources"
    (folder / "main.c").write_text(
        '#include "fmi_common.h"\n#include <stdio.h>\n'
        'int main(void) { Instance *i = make("one"); i->phase = INITIALIZING; i->model.real[LOAD] = 2e5; fresh(i);'
        " i->phase = STEPPING; for (int k = 0; k < 200; k++) { i->model.real[MOTOR_SPEED] = k;"
        " if (!advance(i, 0.01 * k, 0.01)) { puts(i->message); return 1; } }"
        ' printf("%.3f", i->model.real[FIRST_STATE]); (void)gettable; (void)settable; (void)keep; (void)give_back;'
        " (void)begin_at; (void)end; blank(i); destroy(i); return 0; }\n"
    )
    options = ["-std=c99", "-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    run([find_compiler(), *options, "main.c", "model.c", "-o", "main", "-lm"], folder)
    said = run(["env", "-u", "LD_PRELOAD", "ASAN_OPTIONS=detect_leaks=0", str(folder / "main")], folder)
    assert 0.3 < float(said) < 0.7


def test_without_a_compiler_there_are_sources_alone(tmp_path, monkeypatch):
    monkeypatch.setattr("ramsight.deploy.fmu.find_compiler", lambda: None)
    out = tmp_path / "boom.fmu"
    done = CliRunner().invoke(app, ["export", "fmu", "mining-loader", "--unit", "boom", "--out", str(out)])
    assert done.exit_code == 0, done.output
    assert "sources alone: no C compiler was found" in done.output
    with zipfile.ZipFile(out) as archive:
        assert not [name for name in archive.namelist() if name.startswith("binaries/")]


def test_the_same_machine_gives_the_same_archive(fmus, tmp_path):
    again = write_fmu(LOADER, "boom", tmp_path / "again.fmu", what="sensor", fmi=2)
    assert again.path.read_bytes() == fmus["sensor", 2].path.read_bytes()


def test_what_cannot_be_is_refused(tmp_path):
    for wrong in ({"what": "thing"}, {"fmi": 1}):
        with pytest.raises(DescriptionError, match="there is no such FMU"):
            write_fmu(LOADER, "boom", tmp_path / "x.fmu", **wrong)
    with pytest.raises(OutputError, match="unknown suffix"):
        write_fmu(LOADER, "boom", tmp_path / "x.zip")
    assert list(tmp_path.iterdir()) == []
