"""What `import ramsight` offers: names, quantities with units, tracks with their errors, many runs."""

import inspect
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray

import ramsight
from ramsight.calibration.leakage import LeakTestError
from ramsight.duty.faults import Fault, inject
from ramsight.duty.profile import constant

from .command import at_once

TRACES = Path(__file__).parent / "traces"
HEAVY = ["numpy", "casadi", "llvmlite", "xarray", "pint", "matplotlib", "scipy", "pydantic", "rich", "typer"]


@pytest.fixture(scope="module")
def run(boom):
    return ramsight.simulate(boom, load="441 kN", oil_temperature="40 degC", start="120 mm")


def fresh(code):
    return subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout


def test_nothing_heavy_loads_before_it_is_used():
    code = f"import sys, ramsight; dir(ramsight); print(*(n for n in {HEAVY} if n in sys.modules))"
    assert fresh(code).split() == []
    code = "import sys, ramsight; ramsight.RamsightError, ramsight.LogWarning; print('numpy' in sys.modules)"
    assert fresh(code).split() == ["False"]


def test_dir_shows_the_public_names_and_each_is_there():
    shown = fresh("import ramsight; print(*dir(ramsight))").split()
    assert shown == sorted(ramsight.__all__)
    assert not {"Any", "TYPE_CHECKING", "annotations"} & set(shown)
    for name in shown:
        found = getattr(ramsight, name)
        assert name == "__version__" or found.__doc__
    with pytest.raises(AttributeError, match="no attribute 'sensr'"):
        _ = ramsight.sensr


def test_the_reference_groups_every_name_once():
    page = (TRACES.parent.parent / "docs" / "api" / "ramsight.md").read_text(encoding="utf-8")
    listed = re.findall(r"^- `(\w+)`$", page, flags=re.MULTILINE)
    assert sorted(listed) == sorted({*ramsight.__all__} - {"__version__"})
    sections = re.findall(r"^## (\w+)", page, flags=re.MULTILINE)
    assert sections == ["Describe", "Simulate", "Sense", "Calibrate", "Control", "Deploy", "Study", "What"]


def test_no_public_function_takes_what_only_the_command_line_needs():
    public = [getattr(ramsight, name) for name in ramsight.__all__ if name != "__version__"]
    public = [one for one in public if not (inspect.isclass(one) and issubclass(one, Exception))]
    taken = {one.__qualname__: set(inspect.signature(one).parameters) & {"named", "say"} for one in public}
    assert not any(taken.values())


def test_one_thing_has_one_name():
    from ramsight import logs, machine, plant
    from ramsight.plant import build as home

    assert ramsight.build is home.build
    assert ramsight.load_machine is machine.load_machine
    assert ramsight.read_log is logs.read_log
    assert ramsight.open_log is logs.open_log
    assert not hasattr(home, "build_unit")
    assert not hasattr(machine, "load")
    assert not hasattr(plant, "build_unit")


def test_a_type_checker_sees_the_same_names():
    text = Path(ramsight.__file__).read_text(encoding="utf-8")
    imported = text.partition("if TYPE_CHECKING:")[2].partition("__version__")[0]
    missing = [name for name in ramsight.__all__ if name != "__version__" and name not in imported]
    assert missing == []


def test_a_number_is_si_and_text_has_its_unit(boom, run):
    same = ramsight.simulate(boom, load=441e3, oil_temperature=313.15, start=0.12)
    np.testing.assert_array_equal(run["position"], same["position"])
    log = ramsight.drive_report(run)
    tracks = [ramsight.track(boom, log, start) for start in ("120 mm", 0.12, np.float64(0.12))]
    for one in tracks[1:]:
        np.testing.assert_array_equal(one["position"], tracks[0]["position"])


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"load": "60"}, ("load", "'60'", "a unit is missing", "kN")),
        ({"load": "60 kg"}, ("load", "'60 kg'", "force")),
        ({"load": {1e3}}, ("load", "force")),
        ({"load": float("nan")}, ("load", "nan N", "out of range", "10000 kN")),
        ({"oil_temperature": 40}, ("oil_temperature", "40 K", "degC")),
        ({"start": 120}, ("start", "120 m", "0 mm to 700 mm")),
        ({"speed": "99999 rpm"}, ("speed", "99999 rpm", "rpm to")),
        ({"cycles": 0}, ("cycles", "0", "1 to 1000")),
        ({"sample_period": "1 h"}, ("sample_period", "1 h", "10 s")),
        ({"load": None}, ("load", "duty")),
        ({"duty": "fast"}, ("load", "duty")),
        ({"load": None, "duty": "fast"}, ("duty", "fast")),
    ],
)
def test_a_quantity_that_cannot_be_names_argument_value_and_range(boom, given, words):
    with pytest.raises(ramsight.DescriptionError) as error:
        ramsight.simulate(boom, **({"load": "441 kN"} | given))
    assert [word for word in words if word not in str(error.value)] == []


def test_a_load_may_be_text_and_in_range(boom):
    assert float(ramsight.lift_lower(boom, "60 kN").load(0.0)) == 60e3


def test_a_machine_is_a_name_a_file_a_machine_or_a_unit(boom):
    machine = ramsight.load_machine("mining-loader")
    assert ramsight.build(machine, "boom") == boom
    assert ramsight.build(machine.unit("boom"), "boom") == replace(boom, lever=None), "a unit alone moves no body"
    assert ramsight.build(boom) is boom
    assert ramsight.build("eha-test-bench").name == "axis"
    with pytest.raises(ramsight.DescriptionError, match=r"unit: .*boom, bucket"):
        ramsight.build(machine)
    with pytest.raises(ramsight.UnknownNameError, match="bucket"):
        ramsight.build(boom, "bucket")
    with pytest.raises(ramsight.DescriptionError, match="machine = 3"):
        ramsight.build(3)
    with pytest.raises(ramsight.UnknownNameError, match="kind"):
        ramsight.catalogue("gearbox")


def test_a_track_is_judged_by_the_truth(boom, run):
    track = ramsight.track(boom, ramsight.drive_report(run), "120 mm", run)
    assert track.attrs["error_largest"] == pytest.approx(float(abs(track["error"]).max()))
    assert track.attrs["error_largest"] < 1e-3
    assert track.attrs["error_samples"] == track.sizes["time"]
    np.testing.assert_array_equal(track["true_position"], run["position"])
    assert {"motor_speed", "motor_torque", "oil_temperature", "mode", "load"} <= set(track)
    assert set(track["mode"].values) <= set(ramsight.Mode)


def test_there_is_no_position_while_the_sensor_is_not_referenced(boom, run):
    lost = ramsight.track(boom, ramsight.drive_report(run), truth=run)
    assert (lost["status"] == ramsight.Status.NOT_REFERENCED).all()
    for name in ("position", "position_std", "error"):
        assert np.isnan(lost[name]).all()
    assert lost.attrs["error_samples"] == 0
    visits = ramsight.simulate(boom, load="200 kN", visits=1)
    found = ramsight.track(boom, ramsight.drive_report(visits), truth=visits)
    nowhere = found["status"] == ramsight.Status.NOT_REFERENCED
    assert 0 < int(nowhere.sum()) < found.sizes["time"]
    np.testing.assert_array_equal(np.isnan(found["position"]), nowhere)
    # Until a second contact the first one may have been with an obstacle, and the position is too uncertain to count.
    uncertain = found["status"] == ramsight.Status.TOO_UNCERTAIN
    assert found.attrs["error_samples"] == int((~nowhere & ~uncertain).sum())
    assert found.attrs["error_largest"] < 5e-3
    grey = [patch.get_label() for patch in ramsight.plot(found).axes[0].patches]
    assert "not referenced" in grey


def test_a_file_and_its_pieces_give_one_track(boom):
    file = TRACES / "boom_441kN_40C.csv.gz"
    whole = ramsight.track(boom, file, "100 mm")
    for log in (ramsight.read_log(file), ramsight.open_log(file, samples=100)):
        np.testing.assert_array_equal(ramsight.track(boom, log, "100 mm")["position"], whole["position"])


def test_a_track_says_what_the_verb_says(boom, tmp_path):
    file, truth = TRACES / "boom_441kN_40C.csv.gz", TRACES / "boom_441kN_40C_truth.csv.gz"
    command = ["track", "mining-loader", file, "--unit", "boom", "--start", "100 mm", "--truth", truth]
    out = tmp_path / "track.nc"
    done = at_once(*command, "--out", out)
    assert done.returncode == 0, done.stderr
    track = ramsight.track(boom, file, "100 mm", truth)
    assert f"error against the truth: largest {1e3 * track.attrs['error_largest']:.3f} mm" in done.stdout
    with xarray.open_dataset(out) as written:
        np.testing.assert_array_equal(written["position"], track["position"])


def test_a_state_is_resumed(boom, run, tmp_path):
    log, state = ramsight.drive_report(run), tmp_path / "boom.state"
    last = ramsight.track(boom, log, "120 mm", state=state)["position"][-1]
    resumed = ramsight.track(boom, log.isel(time=slice(0, 5)), state=state)
    assert float(resumed["position"][0]) == pytest.approx(float(last), abs=1e-3)


@pytest.mark.parametrize(
    ("log", "more", "error", "words"),
    [
        (3, {}, "DescriptionError", "log = 3: is no Dataset"),
        (xarray.Dataset({"position": ("time", [0.0])}, {"time": [0.0]}), {}, "MissingColumnError", "motor_torque"),
        ("nowhere.csv", {}, "LogError", "no such file"),
        (None, {"start": 120}, "DescriptionError", "start = '120 m': is out of range .*0 mm to 700 mm"),
        (None, {"start_std": "1 s"}, "DescriptionError", "start_std"),
        (None, {"sensor": "balance"}, "StartError", "needs to know where the piston is"),
        (None, {"sensor": "kalmann"}, "UnknownNameError", "did you mean 'kalman'"),
        (None, {"truth": 3}, "DescriptionError", "truth = 3"),
        (None, {"start": 0.12, "truth": "far"}, "ComparisonError", "no time in common"),
    ],
)
def test_a_track_that_cannot_be_says_why(boom, run, log, more, error, words):
    if more.get("truth") == "far":
        more = more | {"truth": run.assign_coords(time=run["time"] + 1e6)}
    with pytest.raises(getattr(ramsight, error), match=words):
        ramsight.track(boom, run if log is None else log, **more)


def test_what_a_log_has_beside_time_is_no_matter(boom, run):
    log = ramsight.drive_report(run)
    beside = log.assign_coords(machine=3, duty=("duties", [1.0, 2.0]))
    assert ramsight.track(boom, beside, "120 mm").identical(ramsight.track(boom, log, "120 mm"))
    with pytest.raises(LeakTestError):  # as of the log itself: there is none in it
        ramsight.leak_test(boom, beside)
    with pytest.raises(ramsight.DescriptionError, match=r"log: motor_torque = .*: does not run over time alone"):
        ramsight.track(boom, log.assign(motor_torque=1.0))


def test_a_drive_report_and_a_fault_leave_what_they_are_made_of(run):
    run = run.assign(valve_command=("time", np.zeros(run.sizes["time"])))
    log = ramsight.drive_report(run)
    log["valve_command"].values[:] = 1.0
    assert not run["valve_command"].values.any()
    before = log.copy(deep=True)
    faulty = inject(log, Fault("stuck", 1.0, 2.0, "motor_speed"))
    for name in faulty:
        faulty[name].values[:] = -1.0
    assert log.identical(before)


def test_many_runs_are_the_runs_one_by_one(boom):
    loads = ("129 kN", "300 kN", "441 kN")
    worn = [boom, ramsight.AsBuilt(leak=1.3).apply(boom)]
    runs = ramsight.simulate_many(worn, (ramsight.lift_lower(boom, load) for load in loads), threads=2)
    assert dict(runs.sizes) == {"machine": 2, "duty": 3}
    np.testing.assert_allclose(runs["load"], [129e3, 300e3, 441e3])
    for machine, unit in enumerate(worn):
        for duty, load in enumerate(loads):
            alone = ramsight.simulate(unit, load=load)["position"].values
            one = runs.isel(machine=machine, duty=duty)
            assert float(one["position_final"]) == pytest.approx(alone[-1], abs=1e-5)
            assert float(one["position_most"]) == pytest.approx(alone.max(), abs=1e-5)
    assert runs["position_final"].attrs["units"] == "m"


@pytest.fixture(scope="module")
def sweep(boom):
    """Three machines through two duties, one of which goes over the relief valve."""
    duties = [ramsight.lift_lower(boom, load, start=start) for load, start in (("300 kN", 0.1), ("700 kN", 0.2))]
    vary = {"leak": [1.0, 1.5, 1.0], "relief": [1.0, 1.0, 0.9], "cylinder.bore": ["127 mm", "127 mm", 0.13]}
    kept = ["energy", "power", "torque", "pressure", "relief"]
    runs = ramsight.simulate_many("mining-loader", duties, unit="boom", vary=vary, keep=kept, threads=2)
    return duties, runs


def test_figures_of_many_runs_are_those_of_the_runs_one_by_one(sweep):
    duties, runs = sweep
    assert dict(runs.sizes) == {"machine": 3, "duty": 2}
    described = ramsight.load_machine("mining-loader").unit("boom")
    for row, factors, bore in ((1, {"leak": 1.5}, 0.127), (2, {"relief": 0.9}, 0.13)):
        built = ramsight.build(described.replace({"cylinder.bore": bore}), "boom")
        for column, duty in enumerate(duties):
            alone = ramsight.simulate(built, duty, as_built=ramsight.AsBuilt(**factors))
            one = runs.isel(machine=row, duty=column)
            power = alone["motor_torque"] * alone["motor_speed"]
            relief = sum(alone.attrs[f"energy.relief_{side}.throttling"] for side in "ab")
            for name, expected in {
                "motor_torque_most": alone["motor_torque"].max(), "motor_torque_least": alone["motor_torque"].min(),
                "motor_power_most": power.max(), "motor_power_least": power.min(),
                "energy.shaft_given": alone.attrs["energy.shaft_given"],
                "energy.shaft_taken": alone.attrs["energy.shaft_taken"],
                "relief_share": relief / alone.attrs["energy.shaft_given"],
            }.items():  # fmt: skip
                assert float(one[name]) == pytest.approx(float(expected), rel=1e-3, abs=1e-4), name
            # Largest of the steps; between two of them, where vapour collapses, a sample may lie above both.
            assert float(one["pressure_most"]) >= float(alone["pressure_a"].max()) * (1.0 - 1e-3)
    assert (runs["relief_share"].isel(duty=1) > 0.1).all()
    assert (runs["relief_share"].isel(duty=0) < 1e-3).all()


def test_what_was_varied_are_coordinates(sweep):
    _, runs = sweep
    assert runs["leak"].values.tolist() == [1.0, 1.5, 1.0]
    assert runs["cylinder.bore"].values.tolist() == [0.127, 0.127, 0.13]
    assert runs["cylinder.bore"].attrs["units"] == "m"
    assert runs["leak"].dims == runs["relief"].dims == ("machine",)
    assert runs["load"].values.tolist() == [300e3, 700e3]
    audited = [name for name in runs if str(name).startswith(("energy.", "volume."))]
    assert audited == ["energy.shaft_given", "energy.shaft_taken"], "integrals of the audit stay inside"
    figure = ramsight.plot(runs)
    assert len(figure.axes) == 5 * 5, "five figures over leak, relief, bore, load and start"
    assert [axes.get_ylabel().split("\n")[0] for axes in figure.axes[::5]] == [
        "motor torque", "motor power", "energy shaft given", "relief share", "pressure",
    ]  # fmt: skip
    (dots,) = figure.axes[7].lines  # power over the bore
    np.testing.assert_allclose(np.sort(dots.get_ydata()), np.sort(runs["motor_power_most"].values.ravel()) / 1e3)
    assert set(np.round(dots.get_xdata(), 6)) == {127.0, 130.0}
    with pytest.raises(ramsight.DescriptionError, match="nothing that differs"):
        ramsight.plot(runs.isel(machine=[0], duty=[0]))


def test_a_coordinate_of_ones_own_is_drawn_as_it_is(sweep):
    _, runs = sweep
    figure = ramsight.plot(runs.assign_coords(mine=("machine", [1.0, 2.0, 4.0])))
    assert "mine\n[1]" in [axes.get_xlabel() for axes in figure.axes]


def test_a_data_frame_that_is_no_log_is_called_so_and_not_by_a_file_that_is_gone():
    pandas = pytest.importorskip("pandas")
    whole = {"time_s": [0.0], "motor_speed_rpm": [0.0], "motor_torque_nm": [1.0], "oil_temperature_c": [40.0]}
    frame = pandas.DataFrame(whole)
    for less, words in (
        (frame.drop(columns="time_s"), "DataFrame: missing column time_s; found .*; channel_map says which is which$"),
        (frame.iloc[:0], "^DataFrame: has no samples"),
    ):
        with pytest.raises(ramsight.LogError, match=words) as refused:
            ramsight.read_log(less)
        assert "parquet" not in str(refused.value)
        assert refused.value.file == "DataFrame"


def test_a_value_of_several_lines_is_one_line_of_an_error(run):
    with pytest.raises(ramsight.DescriptionError, match="is no log") as refused:
        ramsight.read_log(run)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"keep": ["heat"]}, "unknown figure to keep 'heat'.*energy"),
        ({"vary": {}}, "vary: needs a list of each value"),
        ({"vary": {"leak": [1.0], "friction": [1.0, 1.1]}}, "equally long"),
        ({"vary": {"leak": "1.0"}}, "vary: needs a list"),
        ({"vary": {"leek": [1.0]}}, "unknown value to vary 'leek'; did you mean 'leak'"),
        ({"vary": {"leak": [-1.0]}}, "leak = '-1': is out of range"),
        ({"vary": {"cylinder.bore": ["5 kg"]}}, "vary.cylinder.bore = '5 kg'"),
        ({"vary": {"circuit": ["ddh"]}}, "unknown value to vary 'circuit'"),
        ({"vary": {"leak": [1.0]}, "machines": ["mining-loader", "mining-loader"]}, "varies one machine"),
        ({"sample_period": "1 h"}, "sample_period"),
        ({"vary": {"leak": 1.2}}, "vary: needs a list"),
        ({"vary": ["leak"]}, "vary = .*: is neither mapping nor None"),
        ({"vary": {3: [1.2]}}, "vary: needs a list"),
        ({"keep": None}, "keep: is no list"),
        ({"keep": [["power"]]}, "unknown figure to keep"),
        ({"threads": 0}, "threads = 0: is out of range"),
        ({"rtol": float("nan")}, "rtol = 'nan': is out of range"),
    ],
)
def test_a_sweep_that_cannot_be_says_why(boom, given, words):
    machines = given.pop("machines", "mining-loader")
    with pytest.raises(ramsight.RamsightError, match=words):
        ramsight.simulate_many(machines, ramsight.lift_lower(boom, "129 kN"), unit="boom", **given)


def test_a_built_unit_has_no_description_to_vary(boom):
    with pytest.raises(ramsight.UnknownNameError, match=r"cylinder\.bore"):
        ramsight.simulate_many(boom, ramsight.lift_lower(boom, "129 kN"), vary={"cylinder.bore": [0.12]})


def test_many_runs_refuse_what_cannot_be_run(boom):
    duty = ramsight.lift_lower(boom, "129 kN")
    with pytest.raises(ramsight.DescriptionError, match="duties: there is none"):
        ramsight.simulate_many(boom, [])
    with pytest.raises(ramsight.DescriptionError, match="duties: is neither Duty nor list"):
        ramsight.simulate_many(boom, None)
    with pytest.raises(ramsight.DescriptionError, match="machines: there is none"):
        ramsight.simulate_many([], [duty])
    with pytest.raises(ramsight.DescriptionError, match="duties = '129 kN'"):
        ramsight.simulate_many(boom, ["129 kN"])
    with pytest.raises(ramsight.DescriptionError, match=r"machines\[1\]: has another circuit"):
        ramsight.simulate_many([boom, ramsight.build("eha-test-bench")], [duty])


def test_a_plot_is_drawn_of_runs_and_tracks_alone(boom, run, tmp_path):
    track = ramsight.track(boom, ramsight.drive_report(run), "120 mm", run)
    assert len(ramsight.plot(run, tmp_path / "run.svg").axes) == 5
    panels = [axes.get_ylabel().split("\n")[0] for axes in ramsight.plot(track, tmp_path / "track.png").axes]
    assert panels == ["position", "error", "band ±", "speed", "torque", "oil"]
    panels = [axes.get_ylabel().split("\n")[0] for axes in ramsight.plot(ramsight.track(boom, run, "120 mm")).axes]
    assert panels == ["position", "band ±", "speed", "torque", "oil"]
    plain = ramsight.plot(ramsight.track(boom, run, "120 mm", sensor="balance"))
    assert [axes.get_ylabel().split("\n")[0] for axes in plain.axes] == ["position", "speed", "torque", "oil"]
    assert (tmp_path / "run.svg").exists()
    assert (tmp_path / "track.png").exists()
    with pytest.raises(ramsight.DescriptionError, match="neither a run nor a track"):
        ramsight.plot(ramsight.drive_report(run))
    with pytest.raises(ramsight.OutputError):
        ramsight.plot(run, tmp_path / "run.txt")


def test_data_without_what_is_needed_names_it(boom, run):
    bare = run[["position"]]
    with pytest.raises(ramsight.MissingColumnError, match="run: missing columns motor_speed"):
        ramsight.drive_report(bare)
    with pytest.raises(ramsight.MissingColumnError, match="log: missing columns motor_speed"):
        ramsight.leak_test(boom, bare)
    with pytest.raises(ramsight.MissingColumnError, match="truth: missing column position"):
        ramsight.identify(boom, run, run[["load"]])
    with pytest.raises(ramsight.LeakTestError, match="no leak test"):
        ramsight.leak_test(boom, run)


def test_an_fmu_of_another_kind_names_the_argument(tmp_path):
    with pytest.raises(ramsight.DescriptionError, match=r"^what = 'valve'"):
        ramsight.export_fmu("mining-loader", "boom", out=tmp_path / "boom.fmu", what="valve")


def test_what_a_simulation_misses_or_has_twice_is_named():
    with pytest.raises(ramsight.DescriptionError, match=r"load: is missing, and so is a duty"):
        ramsight.simulate("mining-loader", unit="boom")
    duty = ramsight.Duty(constant(10.0), constant(1e5), constant(313.15), 0.1, end=1.0)
    with pytest.raises(ramsight.DescriptionError, match=r"speed = '900 rpm': is said by the duty already"):
        ramsight.simulate("mining-loader", unit="boom", duty=duty, speed="900 rpm")


@pytest.mark.parametrize("machine", ["mining-loader", "eha-valve-rig"])
def test_a_unit_prints_as_a_line_of_its_sizes(machine):
    described = ramsight.load_machine(machine)
    name = next(iter(described.units))
    line = str(ramsight.build(described, name))
    assert line.startswith(f"unit {name}: ")
    assert "stroke" in line
    assert len(line) < 200


def test_a_status_prints_as_its_words_and_formats_as_its_number_where_that_is_asked_for():
    status = ramsight.Status.INPUT_GAP
    assert (str(status), f"{status}", f"{status:d}") == (status.text, status.text, "17")
