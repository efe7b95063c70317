"""The paper's study: its shapes, its headline, its limits, and the report that tells them."""

import json
import math
import re
from pathlib import Path

import pytest

from ramsight.errors import OutputError
from ramsight.output import check_folder
from reproduction import CHAPTERS, STEPS, Chapter, Study, Verdict, docs_pages, reproduce, write_report
from reproduction.coverage import DRAWN
from reproduction.repeating import NAMES, SWITCHES

pytestmark = pytest.mark.slow

UNITS, LOADS = ("boom", "bucket"), ("light", "medium", "high")
ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def study():
    return reproduce()


@pytest.fixture(scope="module")
def numbers(study):
    return study.numbers


@pytest.fixture(scope="module")
def folder(study, tmp_path_factory):
    out = tmp_path_factory.mktemp("paper") / "report"
    steps = []
    write_report(study, out, advance=steps.append)
    assert sum(steps) + len(CHAPTERS) == STEPS
    return out


@pytest.mark.parametrize("unit", UNITS)
def test_movement_per_revolution_has_the_papers_shapes(numbers, unit):
    found = numbers["movement"][unit]
    assert [found[shape] for shape in ("lift_falls", "lower_rises", "hotter_is_stronger")] == [True] * 3
    assert found["steeper_at_relief"] > 10.0, "lift falls steeply where the relief valve opens"
    sign = {"boom": 1.0, "bucket": -1.0}[unit]
    assert min(sign * torque for torque in found["lift_torque_range_nm"]) > 0.0


@pytest.mark.parametrize(("unit", "limit"), [("boom", 5.0), ("bucket", 10.0)])
def test_the_tables_error_is_the_papers_and_the_balance_errs_by_less_than_half_a_millimetre(numbers, unit, limit):
    light, medium, high = (numbers["table_error_mm"][unit][load] for load in LOADS)
    assert 0.5 * limit < high <= limit
    assert light < medium < high
    assert numbers["table_error_with_loads_as_shares_mm"][unit]["high"] < high
    assert max(numbers["balance_error_mm"][unit][load] for load in LOADS) <= 0.5
    gained = numbers["table_error_gained"][unit]
    assert gained["in_ramps_mm"] > 20 * gained["at_constant_speed_mm"]
    assert numbers["ramp_explanation_off_share"][unit] < 0.1, "the leakage in the ramps explains it"


@pytest.mark.parametrize("unit", UNITS)
def test_drift_is_told_for_every_sensor_and_stopped_by_every_reference(numbers, unit):
    drifts = {sensor: numbers["drift_mm_per_cycle"][sensor][unit] for sensor in ("table", "balance", "kalman")}
    assert all(set(drift) == set(NAMES) for drift in drifts.values())
    assert drifts["table"]["none"] > 1.0
    assert abs(drifts["balance"]["none"]) < 0.2
    cycles = numbers["repeated_cycles"][unit]
    for sensor in ("table", "balance"):
        assert abs(drifts[sensor]["stop"]) < 0.2, sensor
        for kind in SWITCHES:
            assert cycles[sensor][kind]["left_by_a_visit_mm"] <= cycles["switch_accuracy_mm"], (sensor, kind)
            assert abs(drifts[sensor][kind]) < 0.05, (sensor, kind)


@pytest.mark.parametrize("unit", UNITS)
def test_one_speed_is_not_enough_six_are_better_and_the_balance_minds_none(numbers, unit):
    errors = numbers["other_speeds_error_mm"][unit]
    for rpm in ("500_rpm", "750_rpm", "3000_rpm"):
        assert errors[rpm]["table"] > errors["1500_rpm"]["table"]
        assert errors[rpm]["balance"] < errors[rpm]["speed_table"] < 0.3 * errors[rpm]["table"]
    worst = {of: max(by[of] for by in errors.values()) for of in ("table", "reciprocal_table", "balance")}
    assert worst["balance"] < 0.6
    limit, at_half_speed = {"boom": (3.5, 1.5), "bucket": (7.0, 3.5)}[unit]
    assert worst["reciprocal_table"] < limit < 0.1 * worst["table"], "the strongest rival"
    assert errors["750_rpm"]["reciprocal_table"] < at_half_speed


@pytest.mark.parametrize(("unit", "silent"), [("boom", 6.0), ("bucket", 12.0)])
def test_loads_near_relief_put_on_at_rest_and_taken_off_show_what_tables_do_not_see(numbers, unit, silent):
    assert numbers["largest_error_called_ok_near_relief_mm"][unit] < silent
    assert numbers["near_relief_error_mm"][unit]["table"]["104_percent"] > 50.0
    assert numbers["load_change_moves_rod_mm"][unit] > 3.0
    assert numbers["load_change_error_mm"][unit]["balance"] < 0.5
    assert numbers["load_change_error_mm"][unit]["table"] > 3.0
    assert numbers["load_taken_off_moves_rod_mm"][unit] > 3.0
    cycles = numbers["emptying_cycles_error_mm"][unit]["after_10"]
    assert cycles["kalman"] < 0.4 * cycles["table"]


@pytest.mark.parametrize("unit", UNITS)
def test_what_the_paper_takes_for_granted_costs_millimetres(numbers, unit):
    for sensor in ("table", "balance"):
        assert 1.0 < abs(numbers["temperature_error_mm_per_K"][unit][sensor]) < 3.0
        assert 3.0 < abs(numbers["wear_error_mm_per_10_percent"][unit][sensor]) < 8.0
    worth = numbers["instruments_are_worth_mm"]
    assert worth["draw_wire"] == pytest.approx(2.0)
    slope = abs(numbers["temperature_error_mm_per_K"][unit]["balance"])
    assert worth[unit]["thermometer_mm"] == pytest.approx(slope, rel=0.15)
    assert 0.3 < worth[unit]["torque_mm"] < 3.0
    found = numbers["cycle_error_by_temperature_mm"][unit]
    cold, hot = (found[key]["table"]["high"] for key in ("20_degC", "60_degC"))
    assert cold < 0.6 * numbers["table_error_mm"][unit]["high"] < 0.4 * hot, "errors go as the leakage goes"
    assert found["60_degC"]["kalman"]["high"] < 0.2 * hot


def test_the_ratio_of_both_units_needs_no_fitted_ramp(numbers):
    ratio = numbers["ratio_of_bucket_to_boom"]
    assert all(1.85 < ratio[f"{ramp:g}_s"] < 2.0 for ramp in (0.8, 1.2, 1.6, 2.4, 3.2))
    fits = numbers["ramp_that_gives_the_papers_error_s"]
    assert fits["bucket"] == pytest.approx(fits["boom"], rel=0.06)


def test_the_papers_errors_are_within_the_efficiencies_tolerances(numbers):
    found = numbers["table_error_within_tolerances_mm"]
    for unit, least, largest in (("boom", 3.8, 5.4), ("bucket", 6.7, 10.9)):
        assert found[unit]["volumetric_least"] == pytest.approx(least, abs=0.1)
        assert found[unit]["volumetric_largest"] == pytest.approx(largest, abs=0.1)


def test_both_readings_of_the_loads_are_told(numbers):
    loads = numbers["loads"]
    assert loads["boom"]["largest_by_a_quarter_kN"] == pytest.approx(516.0)
    assert loads["boom"]["largest_by_three_quarters_kN"] == pytest.approx(588.0)
    assert loads["bucket"]["largest_by_three_quarters_kN"] == pytest.approx(216.0)
    assert [round(loads[unit]["high_percent_of_that"]) for unit in UNITS] == [83, 86]


@pytest.mark.parametrize("unit", UNITS)
def test_who_learns_the_machine_errs_little_on_those_that_are_not_their_data_sheet(numbers, unit):
    for name, errors in numbers["not_the_data_sheet_error_mm"][unit].items():
        assert errors["kalman_after_stops"] < 4.0, name  # ten cycles without a reference
    worn = numbers["wear_error_mm"][unit]
    assert min(abs(worn[sensor]["2_times"]) for sensor in ("table", "balance")) > 40.0
    assert worn["kalman_after_stops"]["2_times"] < 2.0


def test_the_combined_model_runs_and_its_audit_closes(numbers):
    found = numbers["combined_model"]
    assert max(abs(found[f"{of}_residual_share"]) for of in ("energy", "volume")) < 1e-5
    assert found["bucket_turns_while_the_boom_lifts_degrees"]["level"] < 0.01


@pytest.mark.parametrize("unit", UNITS)
def test_statements_in_passing_have_their_numbers(numbers, unit):
    lost = numbers["way_lost_in_a_cycle_mm"][unit]
    assert lost["by_pump_leakage"] > 2 * lost["by_compression_of_the_load"]
    periods = numbers["sample_period_error_mm"][unit]
    assert abs(periods["5_ms"]["table"] - periods["20_ms"]["table"]) < 0.1
    assert abs(periods["500_ms"]["table"] - periods["20_ms"]["table"]) > 0.5
    assert 0.2 < numbers["pump_efficiency"][f"{unit}_a"]["hydromechanical_under_nominal_points"] < 0.7
    assert 1.0 < numbers["aged_oil_changes_error_mm"][unit] < 10.0
    hoses = numbers["hoses"][unit]
    taken = [hoses[dash]["energy_light_percent"] for dash in ("8", "10", "12", "16", "20")]
    assert taken == sorted(taken, reverse=True), "small hoses take more"
    assert hoses["8"]["drop_at_highest_speed_bar"] > 1.5 * hoses["8"]["drop_at_highest_speed_if_laminar_bar"]


@pytest.mark.parametrize("unit", UNITS)
def test_the_energy_of_a_move_is_all_accounted_for(numbers, unit):
    for way, flow in numbers["energy_flow_kJ"][unit].items():
        taken = sum(value for name, value in flow.items() if name not in ("shaft", "load"))
        assert flow["shaft"] + flow["load"] == pytest.approx(taken), way
        assert abs(flow["oil, tank and air"]) < 0.02 * max(abs(flow["shaft"]), abs(flow["load"]))
    battery = numbers["battery_by_load"][unit]
    assert all(by["back_kJ"] < by["shaft_taken_kJ"] < by["shaft_given_kJ"] < by["given_kJ"] for by in battery.values())
    assert 30.0 < battery["high"]["back_percent"] < 60.0
    assert 70.0 < numbers["best_efficiency_percent"][unit]["lifting"] < 100.0


def test_verdicts_are_given_and_not_all_the_same(study):
    verdicts = [statement.verdict for statement in study.statements]
    assert verdicts.count(Verdict.REPRODUCED) >= 20
    assert set(verdicts) == set(Verdict)
    contradicted = {s.paper[:40] for s in study.statements if s.verdict is Verdict.CONTRADICTED}
    assert len(contradicted) == 3
    assert any("too stiff, so it is reduced" in s.paper for s in study.statements if s.verdict is Verdict.CONTRADICTED)


def test_results_hold_every_number_and_nothing_that_is_none(folder, study, numbers):
    results = json.loads((folder / "results.json").read_text())
    assert results["format"] == 1
    assert {key: results[key] for key in numbers} == numbers

    def leaves(value):
        if isinstance(value, dict | list):
            for inner in value.values() if isinstance(value, dict) else value:
                yield from leaves(inner)
        else:
            yield value

    assert len(results["coverage"]) == len(study.statements) + len(DRAWN)
    assert {line["verdict"] for line in results["coverage"]} <= {verdict.value for verdict in Verdict}
    assert all(math.isfinite(value) for value in leaves(numbers) if not isinstance(value, str))


def test_every_figure_is_there_in_both_formats_and_in_both_reports(folder, study):
    markdown, page = (folder / "report.md").read_text(), (folder / "report.html").read_text()
    for picture in study.pictures:
        assert (folder / f"{picture.name}.png").read_bytes().startswith(b"\x89PNG")
        assert "<svg" in (folder / f"{picture.name}.svg").read_text()
        assert f"]({picture.name}.png)" in markdown
        assert f'id="{picture.name}"' in page
    assert page.count("data:image/svg+xml;base64,") == len(study.pictures)


def test_the_page_needs_no_other_file(folder):
    page = (folder / "report.html").read_text()
    assert not re.search(r'(src|href)="(?!data:|#)', page)
    anchors, links = (set(re.findall(rf'{name}="{mark}([^"]+)"', page)) for name, mark in (("id", ""), ("href", "#")))
    assert links <= anchors
    assert len(links) >= len(CHAPTERS) + 2
    assert page.index("Contents") < page.index("our result") < page.index('id="fig03_efficiency"')


def test_the_pdf_has_every_page(folder, study):
    pdf = (folder / "report.pdf").read_bytes()
    assert pdf.startswith(b"%PDF")
    assert pdf.count(b"/Type /Page ") > len(study.pictures) / 2


def test_the_pages_of_the_docs_are_this_run(study):
    number = re.compile(r"\d+(?:\.\d+)?")
    for name, told in docs_pages.texts(study).items():
        written = (docs_pages.PAGES / f"{name}.md").read_text(encoding="utf-8")
        assert number.sub("#", told).split() == number.sub("#", written).split()
        for one, other in zip(number.findall(told), number.findall(written), strict=True):
            assert float(one) == pytest.approx(float(other), rel=0.03, abs=0.06)
    for name in docs_pages.SHOWN:
        assert (docs_pages.FIGURES / f"{name}.png").exists()


def test_figures_have_units_on_their_axes(study):
    from matplotlib.figure import Figure

    for picture in study.pictures:
        figure = Figure()
        picture.draw(figure)
        for axes in figure.axes:
            labels = [label for label in (axes.get_xlabel(), axes.get_ylabel()) if label and label != "cycle"]
            assert all("[" in label for label in labels), (picture.name, labels)


def test_a_second_report_takes_the_place_of_the_first_and_leaves_the_rest(study, folder, tmp_path):
    empty = Study([Chapter("Nothing", (), {"nothing": 0.0})])
    out = tmp_path / "again"
    write_report(empty, out)
    (out / "mine.txt").write_text("kept")
    write_report(Study([Chapter("Something", (), {"something": 1.0})]), out)
    assert json.loads((out / "results.json").read_text())["something"] == 1.0
    assert (out / "mine.txt").read_text() == "kept"
    assert [file.name for file in tmp_path.iterdir()] == ["again"]


def test_a_report_that_fails_leaves_nothing(tmp_path):
    broken = Study([Chapter("Broken", (), {"number": math.nan})])
    with pytest.raises(ValueError, match="JSON"):
        write_report(broken, tmp_path / "report")
    assert not list(tmp_path.iterdir())


def test_a_place_that_cannot_hold_a_report_is_refused(tmp_path):
    file = tmp_path / "file"
    file.write_text("")
    with pytest.raises(OutputError, match="is a file"):
        check_folder(file)
    with pytest.raises(OutputError, match="there is no directory"):
        check_folder(tmp_path / "no" / "report")
