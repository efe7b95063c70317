"""The user's path: simulate, track, and one clear line for whatever is wrong. Run as commands."""

import csv
import gzip
import re

import numpy as np
import pytest
import xarray

from ramsight.logs import read_truth

from .command import as_command, at_once, refused

HEADER = "time_s,motor_speed_rpm,motor_torque_nm,oil_temperature_c\n"


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    folder = tmp_path_factory.mktemp("simulated")
    done = as_command(
        "simulate", "mining-loader", "--unit", "boom", "--load", "441 kN", "--oil-temperature", "40 degC",
        "--out", "run.nc", "--log", "log.csv.gz", "--truth", "truth.csv", cwd=folder,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return folder, done


def test_simulate_writes_results_log_and_truth_and_closes_its_balances(simulated):
    folder, done = simulated
    energy, volume = map(float, re.search(r"energy closes to (\S+) %, volume to (\S+) %", done.stdout).groups())
    assert max(energy, volume) < 0.1
    with xarray.open_dataset(folder / "run.nc") as run:
        assert run["position"].attrs["units"] == "m"
        assert run["motor_torque"].attrs["units"] == "N m"
        assert all("units" in variable.attrs for variable in run.variables.values())
        assert float(run["position"].max()) > 0.25
    with gzip.open(folder / "log.csv.gz", "rt") as stream:
        assert stream.readline() == HEADER
    said = [line for line in done.stderr.splitlines() if not line.startswith("ramsight simulate: ")]
    assert not said  # no progress bar where there is no terminal, and a line every ten seconds on a busy machine


@pytest.mark.slow
def test_a_recording_of_a_bench_has_the_truth_in_it(simulated, tmp_path):
    """Drive, thermometer and an encoder of CiA 406 in one candump file: the encoder judges, unseen by the sensor."""
    import ramsight
    from ramsight.deploy.encoder.played_drive import PlayedDrive, played_map

    folder, _ = simulated
    log, truth = ramsight.read_log(folder / "log.csv.gz"), read_truth(folder / "truth.csv")
    frames = list(PlayedDrive(log, 5, 80.0, warm_node=7).frames())
    moments = np.arange(0.0, float(log["time"][-1]), 0.01)
    steps = np.round(1e5 * np.interp(moments, truth["time"], truth["position"] - 0.02)).astype(int)
    frames += [
        (at, f"186#{int(step).to_bytes(4, 'little').hex().upper()}") for at, step in zip(moments, steps, strict=True)
    ]
    lines = [f"({at:.6f}) can0 {frame}\n" for at, frame in sorted(frames, key=lambda one: one[0])]
    (tmp_path / "bench.log").write_text("".join(lines))
    encoder = '[measured]\nposition = {channel = "6004h", unit = "mm", scale = 0.01, offset = 20.0}\n'
    encoder += '[[can.pdo]]\ncob_id = 0x186\nobjects = ["6004h"]\n'
    (tmp_path / "map.toml").write_text(played_map(5, 7, 80.0) + encoder)
    (tmp_path / "plain.toml").write_text(played_map(5, 7, 80.0))
    command = ["track", "mining-loader", tmp_path / "bench.log", "--unit", "boom", "--start", "140 mm"]
    done = at_once(*command, "--map", tmp_path / "map.toml", "--out", tmp_path / "track.csv")
    plain = at_once(*command, "--map", tmp_path / "plain.toml", "--out", tmp_path / "plain.csv")
    assert done.returncode == plain.returncode == 0, done.stderr + plain.stderr
    assert float(re.search(r"error against the truth: largest (\S+) mm", done.stdout)[1]) < 1.0
    assert "truth" not in plain.stdout
    assert (tmp_path / "track.csv").read_bytes() == (tmp_path / "plain.csv").read_bytes()
    boom, file = ramsight.build("mining-loader", "boom"), tmp_path / "bench.log"
    track = ramsight.track(boom, file, "140 mm", channel_map=tmp_path / "map.toml")
    assert track.attrs["error_largest"] < 1e-3
    assert abs(float(track["true_position"][5]) - 0.14) < 1e-4
    nothing = (tmp_path / "map.toml").read_text().replace("cob_id = 0x186", "cob_id = 0x187")
    (tmp_path / "nothing.toml").write_text(nothing)
    assert at_once(*command, "--map", tmp_path / "nothing.toml").returncode == 2


def test_track_finds_the_simulated_rod(simulated, tmp_path):
    folder, _ = simulated
    done = as_command(
        "track", "mining-loader", folder / "log.csv.gz", "--unit", "boom", "--start", "140 mm",
        "--out", tmp_path / "track.csv", "--truth", folder / "truth.csv", "--figure", tmp_path / "track.png",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    largest, p95, final = map(
        float, re.search(r"largest (\S+) mm.*within (\S+) mm.*final (\S+) mm", done.stdout).groups()
    )
    assert final <= largest < 0.5
    assert p95 <= largest
    with open(tmp_path / "track.csv", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert list(rows[0]) == [
        "time_s", "position_m", "position_std_m", "status", "position_low_m", "position_high_m", "position_bound_m",
        "referenced_since_power_up",
    ]  # fmt: skip
    assert len(rows) == 1001
    for row in rows[::100]:
        low, position, high = (float(row[f"position{end}_m"]) for end in ("_low", "", "_high"))
        assert low < position < high
        assert max(position - low, high - position) == pytest.approx(1.96 * float(row["position_std_m"]), rel=1e-3)
    assert {row["status"] for row in rows} <= {"ok", "uncertain: reference due"}
    assert (tmp_path / "track.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("sensor", ["balance", "table"])
def test_track_on_a_log_of_the_independent_simulator(trace, sensor, tmp_path):
    case = trace("boom_258kN_40C")
    done = at_once(
        "track", "mining-loader", case.log, "--unit", "boom", "--start", "100 mm", "--sensor", sensor,
        "--truth", case.truth, "--out", tmp_path / "track.csv.gz",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    largest = float(re.search(r"largest (\S+) mm", done.stdout)[1])
    assert largest < (0.5 if sensor == "balance" else 5.0)
    with gzip.open(tmp_path / "track.csv.gz", "rt") as stream:
        assert stream.readline().strip() == "time_s,position_m,position_std_m,status", "these have no bound"


def test_a_machine_file_does_as_well_as_a_catalogue_name(simulated, tmp_path):
    folder, _ = simulated
    assert at_once("new", "mine.toml", cwd=tmp_path).returncode == 0
    done = at_once("track", "mine.toml", folder / "log.csv.gz", "--unit", "boom", "--start", "140 mm", cwd=tmp_path)
    assert done.returncode == 0, done.stderr


GOOD = ["track", "mining-loader", "log.csv", "--unit", "boom", "--start", "100 mm"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({4: "boon"}, ["unknown unit 'boon'", "boom", "bucket"]), ({6: "900 mm"}, ["--start", "900 mm", "700 mm"]),
        ({6: "100"}, ["--start", "a unit is missing"]), ({6: "100 bar"}, ["--start", "length"]),
        ({1: "no-such-machine"}, ["no-such-machine"]), ({2: "no-such-log.csv"}, ["no-such-log.csv"]),
    ],
)  # fmt: skip
def test_a_wrong_word_on_the_command_line_gets_one_line(tmp_path, change, words):
    (tmp_path / "log.csv").write_text(HEADER + "0,0,0,40\n0.02,0,0,40\n")
    arguments = [change.get(k, word) for k, word in enumerate(GOOD)]
    refused(at_once(*arguments, cwd=tmp_path), *words)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ["empty"]),
        (HEADER, ["log.csv"]),
        ("time_s,motor_speed_rpm,oil_temperature_c\n0,0,40\n", ["motor_torque_nm", "motor_speed_rpm"]),
        (HEADER + "0,0,0,40\n0.02,0,twelve,40\n", ["line 3", "motor_torque_nm", "twelve"]),
        (HEADER + ",0,0,40\n,0,0,40\n", ["has no time"]),
        (HEADER + "0,0,0,40\n0.02,0,0\n", ["line 3"]),
    ],
)
def test_a_bad_log_gets_one_line_and_leaves_nothing(tmp_path, text, words):
    (tmp_path / "log.csv").write_text(text)
    refused(at_once(*GOOD, "--out", "track.csv", cwd=tmp_path), *words)
    assert [file.name for file in tmp_path.iterdir()] == ["log.csv"]


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [
        ("--load", "441", ["--load", "unit is missing"]),
        ("--load", "441 bar", ["--load", "force"]),
        ("--oil-temperature", "300 degC", ["--oil-temperature", "300 degC", "100 degC"]),
        ("--speed", "0 rpm", ["--speed"]),
        ("--out", "run.xlsx", ["run.xlsx", ".nc"]),
        ("--out", "nowhere/run.nc", ["nowhere"]),
        ("--unit", "bomb", ["unknown unit 'bomb'"]),
    ],
)
def test_a_bad_simulation_gets_one_line(tmp_path, option, value, words):
    arguments = {"--unit": "boom", "--load": "100 kN"} | {option: value}
    refused(at_once("simulate", "mining-loader", *sum(arguments.items(), ()), cwd=tmp_path), *words)


def test_a_track_that_fails_leaves_the_old_one(simulated, tmp_path):
    (tmp_path / "track.csv").write_text("precious")
    (tmp_path / "log.csv").write_text(HEADER + "0,0,0,40\n0.02,0,x,40\n")
    refused(as_command(*GOOD, "--out", "track.csv", cwd=tmp_path), "line 3")
    assert (tmp_path / "track.csv").read_text() == "precious"


def test_simulations_repeat_to_the_last_bit(tmp_path):
    for name, run in (("one", at_once), ("two", as_command)):
        done = run(
            "simulate", "mining-loader", "--unit", "bucket", "--load", "96 kN", "--log", f"{name}.csv", cwd=tmp_path
        )
        assert done.returncode == 0, done.stderr
    assert (tmp_path / "one.csv").read_bytes() == (tmp_path / "two.csv").read_bytes()
    speed = np.loadtxt(tmp_path / "one.csv", delimiter=",", skiprows=1)[:, 1]
    assert speed.min() < -1400  # the bucket lifts by retracting


def test_a_rod_that_nobody_has_seen_has_no_position(simulated, tmp_path):
    folder, _ = simulated
    done = at_once(
        "track", "mining-loader", folder / "log.csv.gz", "--unit", "boom", "--truth", folder / "truth.csv",
        "--out", "track.csv", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    said = done.stdout.splitlines()
    assert "position unknown at first, unknown at last" in said[0]
    assert said[-2].startswith("error against the truth: none to be had, 0 of 1001 samples")
    rows = (tmp_path / "track.csv").read_text().splitlines()
    assert {row.partition(",")[2] for row in rows[1:]} == {",,not referenced,,,,0"}


def test_a_clock_that_was_set_back_is_left_out_of_the_errors(simulated, tmp_path):
    folder, _ = simulated
    with gzip.open(folder / "log.csv.gz", "rt") as file:
        header, *rows = file.read().splitlines()
    moved = [f"{float(row.partition(',')[0]) - 2.0:.3f},{row.partition(',')[2]}" for row in rows[600:]]
    (tmp_path / "back.csv").write_text("\n".join([header, *rows[:600], *moved]) + "\n")
    done = at_once(
        "track", "mining-loader", "back.csv", "--unit", "boom", "--start", "120 mm",
        "--truth", folder / "truth.csv", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "samples whose clock was set back" in done.stdout.splitlines()[-1]


def test_a_load_and_a_torque_beyond_the_limits_are_said(tmp_path):
    of = ("simulate", "mining-loader", "--unit", "boom")
    done = at_once(*of, "--load", "600 kN", "--hold", "1 s", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "look twice: the load, up to 600 kN, is more than the 535 kN" in done.stdout
    fits = at_once(*of, "--load", "441 kN", "--hold", "1 s", cwd=tmp_path)
    assert "look twice" not in fits.stdout
    assert at_once("new", "weak.toml", "--circuit", "ddh", "--minimal", cwd=tmp_path).returncode == 0
    weak = tmp_path / "weak.toml"
    weak.write_text(weak.read_text().replace('"90 N m"', '"60 N m"'))
    done = at_once("simulate", "weak.toml", "--unit", "boom", "--load", "441 kN", "--hold", "1 s", cwd=tmp_path)
    assert "it has 60 N m" in done.stdout


def test_track_says_how_much_of_the_time_the_position_is_available(trace):
    """Before its first reference the bucket's position is not; a limit of half the stroke is nearly always kept."""
    case = trace("bucket_asbuilt1_workday")
    given = ("track", "mining-loader", case.log, "--unit", "bucket", "--alarm-limit")
    shares = {}
    for limit in ("20 mm", "250 mm"):
        done = at_once(*given, limit, "--time-to-alert", "1 s")
        assert done.returncode == 0, done.stderr
        said = re.search(
            r"available (\S+) % of the time, its bound within (\d+) mm; (\d+) alerts? of more than 1 s", done.stdout
        )
        assert f"{said[2]} mm" == limit
        assert int(said[3]) >= 1
        shares[limit] = float(said[1])
    assert shares["20 mm"] < shares["250 mm"] < 100.0
    refused = at_once(*given, "10 s")
    assert refused.returncode == 2
    assert "--alarm-limit" in refused.stderr
    assert "0.1 mm to 500 mm" in refused.stderr
