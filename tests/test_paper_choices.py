"""What the paper leaves open, as options of the study; and the small pieces of its report."""

import numpy as np
import pytest
from typer.testing import CliRunner

from ramsight.errors import DescriptionError, UnknownNameError
from ramsight.plant.steady import derive
from ramsight.sensor.table import MovementTable, speed_table
from reproduction import Chapter, Choices, Statement, Study, Verdict
from reproduction.__main__ import app
from reproduction.bench import benches
from reproduction.choices import read_values
from reproduction.coverage import DRAWN, drawn
from reproduction.diagrams import CONTROL, PROCESS, RELATIONS
from reproduction.hoses import DASHES, sized, usual_size
from reproduction.unit_energy import efficiency_maps
from reproduction.words import both, figure, slashed

RPM = np.pi / 30.0


def test_by_default_the_stated_loads_and_the_fitted_ramp_are_taken():
    found = benches()
    assert found["boom"].loads == {"light": 129e3, "medium": 258e3, "high": 441e3}
    assert found["bucket"].ramp == 0.8
    assert Choices().said == ()


def test_loads_as_shares_are_those_of_what_the_relief_valves_lift():
    found = benches(Choices(loads="shares"))
    for bench in found.values():
        largest = derive(bench.unit).load_at_relief_after_friction
        assert list(bench.loads.values()) == pytest.approx([0.25 * largest, 0.5 * largest, 0.75 * largest])


def test_a_value_takes_the_place_of_the_described_one_and_is_told():
    choices = Choices(ramp=0.5, values=(("boom.pump_a.volumetric_efficiency", "0.92"), ("boom.hose.diameter", "19 mm")))
    found = benches(choices)
    assert found["boom"].unit.a.pump.volumetric_efficiency == 0.92
    assert found["boom"].unit.b.hose.diameter == pytest.approx(0.019)
    assert found["bucket"].unit.a.pump.volumetric_efficiency == 0.935
    assert found["boom"].cycle(100e3).motor_speed.time[2] - found["boom"].cycle(100e3).motor_speed.time[1] == 0.5
    assert any("0.5 s" in said for said in choices.said)
    assert any("volumetric_efficiency = 0.92" in said for said in choices.said)


@pytest.mark.parametrize("text", ["boom.hose.diameter", "=19 mm", "boom.hose.diameter=", ""])
def test_what_is_no_pair_is_refused_with_an_example(text):
    with pytest.raises(DescriptionError, match="UNIT"):
        read_values([text], "--set")


@pytest.mark.parametrize(
    ("choices", "error", "named"),
    [
        ({"machine": "forklift-mast"}, DescriptionError, "boom and bucket"),
        ({"values": (("boom.hoze.diameter", "19 mm"),)}, UnknownNameError, "hoze"),
        ({"values": (("boom.hose.diameter", "19 kN"),)}, DescriptionError, "diameter"),
    ],
)
def test_another_machine_a_key_that_is_none_and_a_value_that_cannot_be_are_refused(choices, error, named):
    with pytest.raises(error, match=named):
        benches(Choices(**choices))


def test_a_machine_without_the_papers_loads_is_refused(tmp_path):
    from ramsight import machine
    from ramsight.machine.catalogue import find

    file, text = tmp_path / "loader.toml", find("machine", "mining-loader").path.read_text()
    file.write_text(text.replace('medium = { value = "258 kN"', 'half = { value = "258 kN"'))
    assert "half" in machine.load_machine(file).unit("boom").load.loads
    with pytest.raises(DescriptionError, match="medium"):
        benches(Choices(machine=file))


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (["--loads", "heavy"], "stated, shares"), (["--ramp", "1 h"], "0.05 s to 5 s"),
        (["--set", "nothing"], "UNIT.PART.KEY=VALUE"), (["--set", "boom.hoze.diameter=19 mm"], "hoze"),
    ],
)  # fmt: skip
def test_the_command_refuses_what_cannot_be_before_it_works(tmp_path, options, text):
    done = CliRunner().invoke(app, ["--out", str(tmp_path / "out"), *options])
    assert done.exit_code != 0
    assert text in done.output + str(done.exception)
    assert not (tmp_path / "out").exists()


def leaking(speed, leak=2e-3):
    """A table of a unit that leaks so much per second [m/s], at one motor speed [rad/s]."""
    lift = np.full((2, 3), 1e-4 - leak / speed)
    torque = np.array([0.0, 50.0, 100.0])
    return MovementTable("unit", speed, np.array([293.15, 333.15]), torque, lift, torque, lift, 1.0)


@pytest.mark.parametrize("rpm", [300.0, 700.0, 1700.0, 2900.0])
def test_tables_over_the_reciprocal_speed_are_exact_for_a_leakage_per_second(rpm):
    tables = [leaking(speed * RPM) for speed in (250.0, 1000.0, 3000.0)]
    speed = rpm * RPM
    velocities = {}
    for over in ("speed", "reciprocal"):
        sensor = speed_table(tables, over=over)
        sensor.start(0.0)
        sensor.step(0.0, speed, 40.0, 313.15)
        velocities[over] = sensor.step(0.02, speed, 40.0, 313.15).velocity
    truth = 1e-4 * speed - 2e-3
    assert velocities["reciprocal"] == pytest.approx(truth, rel=1e-9)
    assert abs(velocities["speed"] - truth) > 1e-6


def test_below_the_slowest_table_that_one_is_used():
    tables = [leaking(speed * RPM) for speed in (250.0, 1000.0)]
    sensor = speed_table(tables, over="reciprocal")
    sensor.start(0.0)
    sensor.step(0.0, 100.0 * RPM, 40.0, 313.15)
    assert sensor.step(0.02, 100.0 * RPM, 40.0, 313.15).velocity == pytest.approx(100.0 * RPM * tables[0].lift[0, 0])


def test_a_hose_is_sized_by_its_dash_and_keeps_the_rest():
    boom = benches()["boom"].unit
    for dash in DASHES:
        hose = sized(boom, dash, turbulent=True).a.hose
        assert hose.diameter == pytest.approx(dash * 25.4e-3 / 16)
        assert hose.volume == pytest.approx(np.pi / 4 * hose.diameter**2 * hose.length)
        assert hose.turbulent
        assert hose.bulk_modulus == boom.a.hose.bulk_modulus


def test_the_usual_hose_keeps_its_oil_below_five_metres_a_second():
    for bench in benches().values():
        speeds = (100.0 * RPM, 1500.0 * RPM, bench.unit.max_speed)
        chosen = [usual_size(bench.unit, speed) for speed in speeds]
        assert chosen == sorted(chosen)
        flow = speeds[1] * max(bench.unit.a.pump.geared_displacement, bench.unit.b.pump.geared_displacement)
        assert flow / (np.pi / 4 * (chosen[1] * 25.4e-3 / 16) ** 2) <= 5.0


def test_every_figure_table_and_equation_of_the_paper_has_its_line():
    places = [item.place for item in DRAWN]
    wanted = [f"Fig. {k}" for k in range(1, 17)] + ["Table 1", "Table 2"] + [f"Eq. {k}" for k in range(1, 11)]
    assert [place for place in places if place in wanted] == wanted


def test_lifting_takes_more_than_the_load_gets_and_lowering_gives_back_less():
    bench = benches()["bucket"]
    maps = efficiency_maps(bench)
    for way in ("lifting", "lowering"):
        known = maps[way][np.isfinite(maps[way])]
        assert known.size > 100
        assert ((known > 0.0) & (known < 1.0)).all()
    assert maps["lifting"][-1, 0] < maps["lifting"][-1, -1]  # slow lifting of a heavy load leaks away


def test_the_diagrams_arrows_have_boxes_at_both_ends():
    for diagram in (RELATIONS, PROCESS, CONTROL):
        ends = {end for arrow in diagram.arrows for end in (arrow.begin, arrow.end)}
        assert ends == set(diagram.boxes)
        assert set(diagram.given) <= set(diagram.boxes)


def test_a_verdict_with_a_fitted_value_says_so_and_figures_in_sentences_have_their_digits():
    verdicts = [Verdict.of(True), Verdict.of(True, fitted=True), Verdict.of(False, fitted=True)]
    assert verdicts == [Verdict.REPRODUCED, Verdict.FITTED, Verdict.CONTRADICTED]
    assert both({"boom": 1.25, "bucket": -0.001}, 2) == "1.25 mm (boom) and 0.00 mm (bucket)"
    assert (figure(-0.0004, 3), slashed([1.0, 2.26], 1)) == ("0.000", "1.0 / 2.3")


def test_the_pdfs_columns_fit_on_its_line():
    from reproduction.chapter import Grid
    from reproduction.pdf import _CELL_LETTERS, _widths

    text = "a cell with a sentence that is much longer than its column can be on any page"
    for rows in ([("a", "1.0", "2.0")], [("boom", text, text), ("bucket, of another kind", "1", text)]):
        assert sum(_widths(Grid("", ("unit", "one", "another"), tuple(rows)))) <= _CELL_LETTERS


def test_a_figure_is_contradicted_where_a_statement_on_it_is():
    title = next(item.where for item in DRAWN if item.place == "Fig. 9")
    for verdict in Verdict:
        chapter = Chapter(title, (), {}, (Statement("Figs 9, 10", "It falls.", "It does.", verdict),))
        found = {item.place: item.verdict for item in drawn(Study([chapter]))}
        assert (found["Fig. 9"] is Verdict.CONTRADICTED) == (verdict is Verdict.CONTRADICTED)
        assert found["Fig. 3"] is Verdict.REPRODUCED


def test_two_chapters_never_give_one_name_to_two_numbers():
    first, second = (Chapter(title, (), {"boom": {name: 1.0}}) for title, name in (("one", "error"), ("two", "load")))
    assert Study([first, second]).numbers == {"boom": {"error": 1.0, "load": 1.0}}
    with pytest.raises(ValueError, match="two chapters"):
        _ = Study([first, first]).numbers
