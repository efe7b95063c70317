"""The FMEDA table has what was measured and nothing else, and the coverage is the mean that the rates weigh."""

import csv
import io
import json
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import ramsight
from ramsight import machine
from ramsight.deploy.credentials import Export, credentials
from ramsight.deploy.diagnostic_coverage import Coverage, RatedFault, read_table
from ramsight.deploy.fmeda import COLUMNS, NOT_MEASURED, REAL, VIRTUAL, fmeda_table
from ramsight.errors import LogError
from ramsight.plant.build import build
from ramsight.sensor.status import Status

from .command import at_once

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def study():
    return json.loads((ROOT / "results" / "study.json").read_text(encoding="utf-8"))


def rows_of(text):
    return list(csv.DictReader(io.StringIO(text)))


def declaring(unit, **assumed):
    return replace(unit, assumptions=unit.assumptions.replace(assumed))


def test_the_package_has_what_the_study_measured(script, study):
    fmeda = script("fmeda")
    assert fmeda.FILE.read_text(encoding="utf-8") == fmeda.packaged(study)


def test_the_table_has_the_shares_of_the_study_for_the_signals_that_a_unit_declares(boom, study):
    both = declaring(boom, **{"shaft.std": 1e-3, "power.std": 0.005})
    for unit, name in ((boom, "speed, torque, temperature"), (both, "+ counter and DC power")):
        measured = {(row["input"], row["fault"]): row for row in study["faults"][name]["rows"]}
        table = rows_of(fmeda_table(unit))
        found = {(row["signal"], row["fault"]): row for row in table if row["measured_with"] == name}
        assert found.keys() == measured.keys()
        for key, row in measured.items():
            assert float(found[key]["detected_percent"]) == pytest.approx(100.0 * row["noticed"], abs=0.006), key
            assert found[key]["trials"] == str(row["injected"])
            delay = found[key]["time_to_detection_s"]
            assert delay == ("" if row["delay_s"] is None else f"{row['delay_s']:.2f}")
    real = {row["fault"]: row for row in rows_of(fmeda_table(both)) if row["channel"] == REAL}
    assert real.keys() == study["second_channel"]["faults"].keys()
    for name, row in study["second_channel"]["faults"].items():
        assert float(real[name]["detected_at_least_percent"]) == pytest.approx(100.0 * row["found_at_least"], abs=0.006)


def test_what_was_not_measured_has_no_share(boom):
    unit = declaring(boom, **{"shaft.std": 1e-3, "pressure.std": 1e5, "motor_temperature.std": 0.1})
    rows = rows_of(fmeda_table(unit))
    blank = [row for row in rows if row["measured_with"] == NOT_MEASURED]
    signals = {row["signal"] for row in blank}
    assert {
        "pressure_a", "pressure_b", "motor_temperature", "reference", "description", "piston seals", "control unit",
    } <= signals  # fmt: skip
    assert "shaft_angle" not in signals
    assert all(row["channel"] == VIRTUAL for row in rows if row not in blank)  # no DC power: none of the real sensor's
    assert len([row for row in blank if row["channel"] == REAL]) == 8
    for row in blank:
        assert row["detected_by"] == NOT_MEASURED
        assert [row[name] for name in COLUMNS if name.endswith(("_percent", "_s", "_fit"))] == [""] * 7


def test_a_command_is_a_signal_that_was_not_measured():
    rig = machine.load_machine("eha-valve-rig")
    name = next(iter(rig.units))
    built = build(rig.unit(name), name)
    commands = ramsight.sensor_for(built).commands
    assert commands
    assert set(commands) <= {row["signal"] for row in rows_of(fmeda_table(built))}


def test_detectors_are_statuses_that_the_sensor_can_report_with_these_signals(boom):
    for unit, allowed in ((boom, False), (declaring(boom, **{"shaft.std": 1e-3}), True)):
        (row,) = [
            one for one in rows_of(fmeda_table(unit)) if (one["signal"], one["fault"]) == ("motor_speed", "sign, 20 s")
        ]
        names = row["detected_by"].removeprefix("one of ").split(", ")
        assert all(name.upper() in Status.__members__ for name in names)
        assert ("speed_contradicted" in names) == allowed
        assert "near_relief" not in names  # the study does not count it


def test_an_export_of_a_sensor_has_the_table_and_its_digest(boom):
    loaded = machine.load_machine("mining-loader")
    own = credentials(Export(loaded, boom, "sensor", ("c",)), {})
    assert own["fmeda.csv"] == fmeda_table(boom)
    assert "fmeda.csv" in json.loads(own["ramsight.json"])["sha256"]
    assert "fmeda.csv" not in credentials(Export(loaded, boom, "plant", ("fmu",)), {})


def filled(path, rates, mark=",", point="."):
    rows = rows_of(fmeda_table(build("mining-loader", unit="boom")))
    for row in rows:
        row["failure_rate_fit"] = rates.get((row["signal"], row["fault"]), "")
        for name in row:
            if name.endswith(("_percent", "_s", "_fit")):
                row[name] = row[name].replace(".", point)
    with path.open("w", newline="", encoding="utf-8-sig") as file:
        table = csv.DictWriter(file, rows[0], delimiter=mark)
        table.writeheader()
        table.writerows(rows)
    return rows


def test_the_coverage_is_the_mean_that_the_rates_weigh(tmp_path):
    rates = {
        ("motor_torque", "sign, 20 s"): "30.5",
        ("motor_speed", "NaN, 1 s"): "10",
        ("description", "numbers of another machine"): "5",
    }
    rows = filled(tmp_path / "a.csv", rates)
    found = ramsight.diagnostic_coverage(tmp_path / "a.csv")
    share = {(row["signal"], row["fault"]): row for row in rows}
    expected = sum(float(rate) * float(share[key]["detected_percent"] or 0.0) for key, rate in rates.items()) / 45.5
    assert found.overall.rate == pytest.approx(45.5)
    assert 100.0 * found.overall.share == pytest.approx(expected)
    assert found.overall.at_least < found.overall.share
    assert found.by_signal[VIRTUAL, "motor_torque"].rate == 30.5
    assert f"{len(rows) - 3} of {len(rows)} faults have no failure rate" in found.text
    assert "1 with a failure rate were not measured" in found.text


def test_a_spreadsheets_semicolons_and_decimal_commas_say_the_same(tmp_path):
    rates = {("motor_torque", "sign, 20 s"): "30.5", ("motor_speed", "NaN, 1 s"): "10"}
    filled(tmp_path / "a.csv", rates)
    filled(tmp_path / "b.csv", {key: rate.replace(".", ",") for key, rate in rates.items()}, ";", ",")
    one, other = (read_table(tmp_path / name) for name in ("a.csv", "b.csv"))
    assert one.overall == other.overall
    (tmp_path / "c.csv").write_text(other.filled(), encoding="utf-8")
    again = read_table(tmp_path / "c.csv")
    assert again.overall == one.overall
    (row,) = [cells for cells, rated in zip(again.cells, again.rows, strict=True) if rated.rate == 30.5]
    assert float(row["undetected_fit"].replace(",", ".")) == pytest.approx(
        30.5 * (1.0 - float(row["diagnostic_coverage_percent"].replace(",", ".")) / 100.0), rel=1e-3
    )


@pytest.mark.parametrize(
    ("column", "value", "words"),
    [
        ("failure_rate_fit", "-1", "not a number from 0"), ("failure_rate_fit", "nan", "not a number from 0"),
        ("failure_rate_fit", "few", "not a number from 0"),
        ("detected_percent", "101", "not a number from 0 to 100"), ("detected_percent", "", "needs a share"),
        ("detected_at_least_percent", "100", "not above"),
    ],
)  # fmt: skip
def test_an_impossible_share_or_rate_is_refused_with_its_place(tmp_path, column, value, words):
    rows = filled(tmp_path / "a.csv", {})
    rows[1][column] = value
    with (tmp_path / "b.csv").open("w", newline="") as file:
        table = csv.DictWriter(file, rows[0])
        table.writeheader()
        table.writerows(rows)
    with pytest.raises(LogError, match=words) as caught:
        read_table(tmp_path / "b.csv")
    assert caught.value.line == 3


def test_a_file_that_is_no_table_is_refused(tmp_path):
    for text, words in (
        ("", "column is missing"),
        (",".join(COLUMNS) + "\n", "no rows"),
        ("a,b\n1,2\n", "column is missing"),
    ):
        (tmp_path / "a.csv").write_text(text)
        with pytest.raises(LogError, match=words):
            read_table(tmp_path / "a.csv")
    (tmp_path / "a.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(LogError, match="UTF-8"):
        read_table(tmp_path / "a.csv")
    with pytest.raises(LogError, match="cannot be read"):
        read_table(tmp_path / "none.csv")
    (tmp_path / "a.csv").write_text(",".join(COLUMNS) + "\n" + "x" * 200_000 + "\n")
    with pytest.raises(LogError, match="is no CSV: field larger"):
        read_table(tmp_path / "a.csv")


@pytest.mark.parametrize("ends", ["\r", "\r\n"])
def test_line_ends_of_other_systems_and_rows_of_empty_cells_change_nothing(tmp_path, ends):
    filled(tmp_path / "a.csv", {("motor_torque", "sign, 20 s"): "30.5"})
    text = (tmp_path / "a.csv").read_text(encoding="utf-8")
    blank = "," * (len(COLUMNS) - 1) + "\n"
    (tmp_path / "b.csv").write_bytes((text + 2 * blank).replace("\n", ends).encode())
    one, other = (read_table(tmp_path / name) for name in ("a.csv", "b.csv"))
    assert other.rows == one.rows
    assert other.filled() == one.filled()


def test_without_a_failure_rate_there_is_no_coverage_to_class():
    assert Coverage.of([]).grade == "none"


@given(st.lists(st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(0.0, 1e6)), min_size=1, max_size=8))
def test_the_coverage_lies_between_its_faults_and_not_below_its_lower_end(rows):
    faults = [RatedFault("a", "b", str(k), max(x, y), min(x, y), rate, True) for k, (x, y, rate) in enumerate(rows)]
    found = Coverage.of(faults)
    rated = [one for one in faults if one.rate]
    if not rated:
        assert found.rate == 0.0
        return
    assert min(one.share for one in rated) - 1e-9 <= found.share <= max(one.share for one in rated) + 1e-9
    assert found.at_least <= found.share + 1e-12


@pytest.mark.parametrize(("least", "grade"), [(0.599, "none"), (0.6, "low"), (0.9, "medium"), (0.99, "high")])
def test_the_class_is_that_of_the_lower_end(least, grade):
    assert Coverage(1.0, 0.999, least).grade == grade


def test_the_command_line_writes_reads_and_fills_the_table(tmp_path):
    said = at_once("export", "fmeda", "mining-loader", "--unit", "boom", "--out", "a.csv", cwd=tmp_path)
    assert said.returncode == 0
    assert "faults written" in said.stdout
    filled(tmp_path / "b.csv", {("motor_torque", "sign, 20 s"): "30"})
    said = at_once("fmeda", "b.csv", "--out", "c.csv", cwd=tmp_path)
    assert said.returncode == 0
    assert "overall: DC" in said.stdout
    assert "c.csv: written" in said.stdout
    done = [row for row in rows_of((tmp_path / "c.csv").read_text(encoding="utf-8")) if row["undetected_fit"]]
    assert len(done) == 1
    assert at_once("fmeda", "b.csv", "--out", "b.csv", cwd=tmp_path).returncode == 2
