"""Parts of one's own: a folder beside the catalogue, maps of pumps in CSV files, oils by their grade."""

import math

import pytest

import ramsight
from ramsight import machine
from ramsight.errors import DescriptionError, RamsightError
from ramsight.machine import catalogue
from ramsight.machine.own_entries import check_own
from ramsight.machine.pump_description import read_efficiencies
from ramsight.machine.pump_map import KEY, read_map, with_map
from ramsight.machine.reading import from_catalogue
from ramsight.machine.viscosity import viscosity_of

from .command import at_once

OIL = """
kind = "oil"
name = "farm-46"
description = "what the farm has"
source = "[M] its data sheet"

[values]
viscosity_40c = "46 mm2/s"
viscosity_100c = "7 mm2/s"
density = "880 kg/m3"
bulk_modulus = "1.3 GPa"
min_temperature = "-10 degC"
max_temperature = "90 degC"
"""
PUMP = """
kind = "pump"
name = "gear-16"
description = "external gear pump, 16 cm3/rev"
source = "[M] its data sheet"

[values]
displacement = "16 cm3/rev"
volumetric_efficiency = "0.93"
hydromechanical_efficiency = "0.88"
nominal_speed = "1500 rpm"
nominal_pressure = "200 bar"
nominal_viscosity = "46 mm2/s"
nominal_density = "870 kg/m3"
no_load_torque = "0.6 N m"
max_speed = "3500 rpm"
max_pressure = "220 bar"
"""


@pytest.fixture
def own(tmp_path, monkeypatch):
    """A folder of one's own, with an oil and a pump."""
    folder = tmp_path / "parts"
    (folder / "pumps").mkdir(parents=True)
    (folder / "oil.toml").write_text(OIL)
    (folder / "pumps" / "gear.toml").write_text(PUMP)
    monkeypatch.setenv(catalogue.VARIABLE, str(folder))
    return folder


def test_own_parts_are_used_by_name_as_those_of_the_catalogue(own, tmp_path):
    text = machine.template(machine.load_machine("forklift-mast")).replace('"tellus-t-32"', '"farm-46"', 1)
    used = machine.loads(text)
    assert used.unit("lift").oil.model == "farm-46"
    entry = catalogue.find("pump", "GEAR-16")
    assert entry.is_own
    assert not catalogue.find("pump", "PGI100-2-008").is_own
    assert from_catalogue("pump", "gear-16").belt == 1.0, "a pump on the motor's shaft needs no belt"
    listed = at_once("catalog").stdout
    assert "gear-16" in listed
    assert "(own: gear.toml)" in listed
    (own / "oil.toml").write_text(OIL.replace("farm-46", "farm-47"))
    assert [one.name for one in ramsight.catalogue("oil") if one.is_own] == ["farm-47"], "a changed file is read again"


def test_the_folder_of_an_option_and_the_usual_one(tmp_path, monkeypatch, own):
    monkeypatch.delenv(catalogue.VARIABLE)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    assert not any(one.is_own for one in catalogue.entries())
    usual = tmp_path / "config" / "ramsight" / "catalog"
    usual.parent.mkdir(parents=True)
    own.rename(usual)
    assert any(one.name == "farm-46" for one in catalogue.entries())
    monkeypatch.setenv(catalogue.VARIABLE, "")  # so that what the option sets is taken back
    shown = at_once("--catalog", usual, "catalog", "show", "gear-16")
    assert (shown.returncode, "16 cm3/rev" in shown.stdout) == (0, True), shown.stderr
    gone = at_once("--catalog", tmp_path / "nowhere", "catalog")
    assert gone.returncode == 2
    assert "is no folder" in gone.stderr


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (('name = "farm-46"', 'name = "tellus-t-32"'), "is the name of an entry of ramsight's catalogue"),
        (('viscosity_40c = "46 mm2/s"', 'viscosity_40c = "46 bar"'), "viscosity_40c"),
        (('viscosity_40c = "46 mm2/s"', 'viscosity_4oc = "46 mm2/s"'), "unknown key"),
        (('kind = "oil"', 'kind = "oill"'), "unknown (allowed: machine, oil"),
        (('name = "farm-46"\n', ""), "name"),
        (("[values]", "[value]"), "a table [values]"),
        (("[values]", "[values"), "is not TOML"),
    ],
)
def test_a_check_says_in_a_line_what_cannot_be_used(own, change, says):
    file = own / "oil.toml"
    file.write_text(OIL.replace(*change))
    done = at_once("catalog", "check")
    assert done.returncode in (1, 2)
    assert says in done.stderr
    assert str(file) in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_check_passes_what_can_be_used_and_names_what_is_left_out(own):
    done = at_once("catalog", "check")
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("can be used") == 2
    (own / "oil.toml").write_text(
        OIL.replace('density = "880 kg/m3"\n', "").replace('source = "[M] its data sheet"\n', "")
    )
    found = next(one for one in check_own() if "oil" in one.what)
    assert not found.errors
    assert any("density" in text for text in found.cautions)
    assert any("without a source" in text for text in found.cautions)


MAP = "pressure_bar,speed_rpm,temperature_c,flow_l_min,torque_nm\n" + "\n".join(
    f"{p},{n},{t},{16e-3 * n * (1 - p / 4000):.6g},{16e-6 * p * 1e5 / (2 * math.pi) / (0.8 + p / 2000):.6g}"
    for p in (50, 200) for n in (500, 1500) for t in (20, 60)
)  # fmt: skip
SIZE = 16e-6 / (2 * math.pi)  # m3/rad


def test_a_map_of_flow_and_torque_becomes_efficiencies(tmp_path):
    (tmp_path / "map.csv").write_text("# measured\n" + MAP)
    table = read_efficiencies(read_map(tmp_path / "map.csv", SIZE, lambda kelvin: viscosity_of(46e-6, 7e-6, kelvin)))
    assert table.pressure == pytest.approx((50e5, 200e5))
    assert table.viscosity[1] == pytest.approx(viscosity_of(46e-6, 7e-6, 293.15), rel=1e-5), "warm oil is thin"
    for page in table.volumetric:
        for row in page:
            assert row == pytest.approx((1 - 50 / 4000, 1 - 200 / 4000), rel=1e-5)
    assert table.hydromechanical[0][0] == pytest.approx((0.825, 0.9), rel=1e-5)


def test_a_description_names_the_file_beside_it_and_needs_it_no_more_once_read(own, tmp_path):
    (tmp_path / "gear.csv").write_text(MAP)
    pump = '[units.lift.parts.pump]\nmodel = "gear-16"\nefficiency_file = "gear.csv"\n'
    mast = machine.template(machine.load_machine("forklift-mast"))
    begin = mast.index("[units.lift.parts.pump]")
    end = mast.index("\n\n", begin)
    kept = [line for line in mast[begin:end].splitlines() if line.startswith(("kind", "inlet", "outlet"))]
    file = tmp_path / "mast.toml"
    file.write_text(mast[:begin] + pump + "\n".join(kept) + mast[end:])
    read = machine.load_machine(file)
    found = read.unit("lift").parts["pump"]
    assert (found.losses, found.efficiency_file) == ("table", "")
    assert read.source_of("units.lift.parts.pump.efficiency_table") == "[S: gear.csv]"
    assert machine.loads(machine.template(read)).unit("lift").parts["pump"] == found, "it holds the table itself"
    drawn = at_once("check", file, "--figure", tmp_path / "pump.svg")
    assert drawn.returncode == 0, drawn.stderr
    assert (tmp_path / "pump.svg").read_text().count("<svg") == 1
    assert "no pump with measured" in at_once("check", "press", "--figure", tmp_path / "none.svg").stderr
    run = ramsight.simulate(read, load="28 kN", hold="0.2 s")
    assert float(run["position"].max()) > 0.3
    (tmp_path / "gear.csv").unlink()
    with pytest.raises(DescriptionError, match=r"efficiency_file.*gear\.csv.*no such file|no such file.*gear\.csv"):
        machine.load_machine(file)


@pytest.mark.parametrize("name", ["{up}/secret.csv", "../secret.csv", "maps/../../secret.csv"])
def test_a_description_reads_no_file_outside_its_folder(own, tmp_path, name):
    (tmp_path / "secret.csv").write_text("secret,words\n1,2\n")
    folder = tmp_path / "given"
    (folder / "maps").mkdir(parents=True)
    (folder / "maps" / "gear.csv").write_text(MAP)
    pump = {"displacement": "16 cm3/rev", KEY: name.format(up=tmp_path)}
    oil = {"viscosity_40c": "46 mm2/s", "viscosity_100c": "7 mm2/s"}
    with pytest.raises(DescriptionError, match="leads out of the description's folder") as refused:
        with_map(pump, oil, folder)
    assert "words" not in str(refused.value)
    assert with_map({**pump, KEY: "maps/gear.csv"}, oil, folder)["losses"] == "table"


def test_an_entry_of_ones_own_has_its_map_beside_itself(own):
    (own / "pumps" / "gear.csv").write_text(MAP)
    (own / "pumps" / "gear.toml").write_text(PUMP + 'efficiency_file = "gear.csv"\n')
    mast = machine.template(machine.load_machine("forklift-mast")).replace('"PGI100-2-016"', '"gear-16"')
    lines = [line for line in mast.splitlines() if not line.startswith(("displacement", "efficiency_file"))]
    found = machine.loads("\n".join(lines)).unit("lift").parts["pump"]
    assert (found.model, found.losses) == ("gear-16", "table")


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("50,500,20,", "50,500,twenty,"), "line 2: temperature_c"),
        (("50,500,20,", "-50,500,20,"), "line 2: pressure_bar"),
        (("temperature_c", "temp"), "needs one column viscosity_mm2s or temperature_c"),
        (("50,500,20,", "50,500,20,9"), "is the displacement right"),
    ],
)
def test_a_map_that_cannot_be_is_refused_with_its_line(tmp_path, change, says):
    (tmp_path / "map.csv").write_text(MAP.replace(*change))
    with pytest.raises(RamsightError) as refused:
        read_map(tmp_path / "map.csv", SIZE, lambda kelvin: 46e-6)
    assert says in str(refused.value)
    assert "\n" not in str(refused.value)


GRADES = (15, 22, 32, 46, 68, 100)


def test_oils_are_the_middle_of_their_grade_and_thin_by_it():
    oils = [from_catalogue("oil", f"hlp-{grade}") for grade in GRADES]
    for grade, oil in zip(GRADES, oils, strict=True):
        assert oil.viscosity_40c == pytest.approx(grade * 1e-6), "ISO 3448"
    for kelvin in (273.15, 293.15, 333.15, 373.15):
        thickness = [viscosity_of(oil.viscosity_40c, oil.viscosity_100c, kelvin) for oil in oils]
        assert thickness == sorted(thickness)
    flat = [from_catalogue("oil", name) for name in ("hees-46", "hvlp-46", "hlp-46")]
    cold = [viscosity_of(oil.viscosity_40c, oil.viscosity_100c, 263.15) for oil in flat]
    assert cold == sorted(cold), "the higher the viscosity index, the thinner when it is cold"
