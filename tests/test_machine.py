"""Descriptions: what is read, what is refused and in which words."""

import math
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ramsight import machine, units
from ramsight.errors import DescriptionError, RamsightError, UnknownNameError
from ramsight.machine import catalogue
from ramsight.machine.as_toml import as_toml
from ramsight.machine.base import Part
from ramsight.machine.declare import declaration, explain, quantity
from ramsight.machine.parts import PARTS
from ramsight.machine.placed import PLACED
from ramsight.machine.reading import _machine


@pytest.fixture(scope="module")
def text():
    return machine.template()


def broken(text, old, new):
    """The text with one thing changed, which must be there."""
    assert text.count(old) >= 1
    return text.replace(old, new, 1)


def refusal(text):
    with pytest.raises(RamsightError) as caught:
        machine.loads(text, "a.toml")
    assert "\n" not in str(caught.value)
    return str(caught.value)


def all_parts(cls=None):
    """Every class of parts; those of the direct-driven unit first."""
    if cls is None:
        yield machine.Machine
        for unit in (machine.DirectDriven, machine.Composed):
            yield from all_parts(unit)
        yield from PLACED
        return
    yield cls
    for field in cls.model_fields.values():
        inner = field.annotation
        if isinstance(inner, type) and issubclass(inner, Part):
            yield from all_parts(inner)


def test_values_are_si(loader):
    boom = loader.unit("boom")
    assert boom.cylinder.bore == 0.127
    assert boom.oil.max_temperature == 373.15
    assert boom.pump_a.displacement_per_rad == pytest.approx(5.029e-6, rel=1e-4)
    assert boom.pump_b.displacement_per_rad == pytest.approx(3.533e-6, rel=1e-4)
    assert boom.pump_a.total_no_load_torque == 1.0
    assert boom.pump_b.total_no_load_torque == 0.5
    assert boom.anticavitation_valve.flow_coefficient == pytest.approx(1.7e-3 / math.sqrt(2e5))
    assert boom.safety_valve.flow_coefficient == pytest.approx(1.7e-3 / math.sqrt(4e5))
    assert (boom.load_side, boom.lift_sign) == ("a", 1)
    bucket = loader.unit("bucket")
    assert (bucket.load_side, bucket.lift_sign) == ("b", -1)
    assert bucket.load.loads == {"light": 48e3, "medium": 96e3, "high": 162e3}


CHANGES = [
    (
        'bore = "127 mm" ', 'bore = "2 m" ', "units.boom.cylinder.bore = '2 m': out of range",
        "at least 1 mm, at most 1 m",
    ),
    ('bore = "127 mm" ', 'bore = "0 mm" ', "units.boom.cylinder.bore = '0 mm': out of range", "at least 1 mm"),
    ('bore = "127 mm" ', "bore = 127 ", "units.boom.cylinder.bore = 127: a unit is missing", "a length such as"),
    ('bore = "127 mm" ', 'bore = "127 bar" ', "cylinder.bore = '127 bar': 'bar' does not fit", "a length such as"),
    ('bore = "127 mm" ', "bore = [1] ", "units.boom.cylinder.bore: expected a length", "such as '127 mm'"),
    (
        'bore = "127 mm" ', 'boer = "127 mm" ', "units.boom.cylinder.boer: unknown key",
        "did you mean 'bore'? (and 1 more)",
    ),
    ('bore = "127 mm" ', "", "units.boom.cylinder.bore: is missing: inner diameter of the barrel", "at least 1 mm"),
    ('rod = "79.4 mm"', 'rod = "130 mm"', "cylinder.rod = '130 mm': the rod does not fit", "below 127 mm"),
    ("number = 2 ", "number = 2.5 ", "units.boom.cylinder.number = 2.5: expected a whole number", "at least 1"),
    ("number = 2 ", "number = true ", "units.boom.cylinder.number", "expected a plain number"),
    ("number = 2 ", "number = 0 ", "units.boom.cylinder.number = 0: out of range", "at least 1, at most 16"),
    ('coulomb_friction = "1.5', 'coulomb_friction = "2.5', "breakaway_friction = '2.1 kN'", "at least 2.5 kN"),
    ('circuit = "ddh"', 'circuit = "dhd"', "units.boom.circuit = 'dhd': unknown choice", "allowed: ddh"),
    ('load_direction = "extend"', 'load_direction = "up"', "load_direction = 'up'", "extend or retract"),
    ('= "PGI100-2-008"', '= "PGI100-2-009"', "a.toml: units.boom.pump_a: unknown pump 'PGI100-2-009'", "did you mean"),
    ('= "tellus-t-32"', '= "tellus"', "a.toml: units.boom.oil: unknown oil 'tellus'", "did you mean 'tellus-t-32'"),
    ('model = "PGI100-2-008"', "", "units.boom.pump_a", "or name a model of the catalogue"),
    (
        'effective_bulk_modulus = "0.6', 'effective_bulk_modulus = "1.6', "hose.effective_bulk_modulus",
        "at most 1.2 GPa",
    ),
    ("format = 1", "format = 2", "a.toml: format = 2: was written for a newer ramsight", "up to format 1"),
    ("format = 1", "format = 0", "a.toml: format = 0: is no format", "allowed: 1"),
    ("format = 1", 'format = "one"', "a.toml: format = 'one': is no format", "allowed: 1"),
    ("format = 1", "", "a.toml: format: is missing", "write format = 1"),
    ("[units.boom.cylinder]", "[units.boom.cylinder", "a.toml, line ", "is not TOML"),
    ("[units.boom]", '[units."bo om"]\n[units.boom]', "units.bo om: a unit's name", "starts with a letter"),
    ('high = "441 kN"', 'high = "-4 kN"', "units.boom.load.loads.high = '-4 kN': out of range", "at least 0 kN"),
    ("loads = {", "loads = 3 # {", "units.boom.load.loads = 3: expected a table", "table"),
    ("[units.boom.tank]", "[units.boom.tonk]", "units.boom.tonk: unknown key", "did you mean 'tank'?"),
    ('bore = "127 mm" ', 'bore = { source = "x" } ', "units.boom.cylinder.bore: has a source but no value", ""),
    ('bore = "127 mm" ', 'bore = { value = "127 mm", source = 3 } ', "cylinder.bore.source: a source is text", ""),
    ("belt = ", 'belt = "28/0" # ', "units.boom.pump_a.belt = '28/0': a ratio cannot be over zero", ""),
    ('name = "my-machine"', 'name = ""', "name", "at least 1 character"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "start", "words"), CHANGES, ids=range(len(CHANGES)))
def test_a_mistake_is_one_line_with_file_key_value_and_range(text, old, new, start, words):
    line = refusal(broken(text, old, new))
    assert "a.toml" in line
    assert start in line
    assert words in line


def test_the_line_of_a_slip_in_the_syntax_is_named():
    assert refusal('format = 1\nname = "x"\nbore = = 3\n').startswith("a.toml, line 3: is not TOML")
    assert refusal('format = 1\nname = "x').startswith("a.toml, line 2: is not TOML")
    assert "the machine comes first" not in refusal("bore = = 3\n")
    with pytest.raises(
        DescriptionError, match=r"log\.csv, line 1: is not TOML: .*; the machine comes first, then a log"
    ):
        catalogue.parse_toml("time_s,motor_speed_rpm\n0.0,1\n", "log.csv")


def test_a_machine_needs_a_unit():
    assert "at least one unit" in refusal('format = 1\nname = "x"\n[units]\n')
    assert "units: is missing" in refusal('format = 1\nname = "x"\n')
    assert "expected a table" in refusal('format = 1\nname = "x"\nunits = 3\n')
    assert "units.boom = 3: expected a table" in refusal('format = 1\nname = "x"\nunits = { boom = 3 }\n')


def test_files_that_cannot_be_read(tmp_path):
    cases = {"none.toml": "no such file", "": "is a directory", "binary.toml": "is not UTF-8 text"}
    (tmp_path / "binary.toml").write_bytes(b"name = '\xff\xfe'")
    for name, words in cases.items():
        with pytest.raises(DescriptionError, match=words):
            machine.load_machine(tmp_path / name)
    with pytest.raises(DescriptionError, match="no such file"):
        machine.load_machine("nowhere/at-all.toml")
    with pytest.raises(UnknownNameError, match="did you mean 'mining-loader'"):
        machine.load_machine("mining-lauder")


def test_a_file_of_other_systems_is_read(tmp_path, text):
    file = tmp_path / "loader"
    file.write_bytes(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())
    assert machine.load_machine(str(file)).unit("boom").cylinder.bore == 0.127


def test_an_unknown_unit_lists_those_there_are(loader):
    with pytest.raises(UnknownNameError, match=r"did you mean 'boom'.*known: boom, bucket"):
        loader.unit("bomb")


def test_sources_stay_with_their_values(text):
    sourced = broken(text, 'bore = "127 mm" ', 'bore = { value = "127 mm", source = "drawing 4711" } ')
    sourced = broken(sourced, "[units.boom.tank]", '[units.boom.tank]\nsource = "gauge"')
    read = machine.loads(sourced)
    assert read.unit("boom") == machine.loads(text).unit("boom")
    assert read.source_of("units.boom.cylinder.bore") == "drawing 4711"
    assert read.source_of("units.boom.tank.pressure") == "gauge"
    assert read.source_of("units.boom.cylinder.rod") is None
    assert read.source_of("units.boom.pump_a.displacement").startswith("PGI100-2-008: [P]")


def test_a_catalogue_part_can_be_overridden_or_given_in_full(text):
    pump = 'model = "PGI100-2-008"'
    assert (
        machine.loads(broken(text, pump, f'{pump}\nmax_pressure = "280 bar"')).unit("boom").pump_a.max_pressure == 28e6
    )
    lines = text.splitlines()
    head, tail = lines.index("[units.boom.pump_a]"), lines.index("[units.boom.pump_b]")
    lines[head:tail] = [re.sub(r"^# (\w+ = )", r"\1", line) for line in lines[head:tail] if "model" not in line]
    full = machine.loads("\n".join(lines)).unit("boom").pump_a
    assert full.model is None
    assert full.replace({"model": "PGI100-2-008"}) == machine.loads(text).unit("boom").pump_a


def test_an_oil_can_be_named_in_a_word(text):
    lines = text.splitlines()
    head, tail = lines.index("[units.boom.oil]"), lines.index("[units.boom.cylinder]")
    del lines[head : tail - 1]
    short = "\n".join(lines).replace("[units.boom]", '[units.boom]\noil = "TELLUS-T-32"', 1)
    assert machine.loads(short).unit("boom").oil.model == "tellus-t-32"


@pytest.mark.parametrize("name", ["boom", "bucket"])
def test_a_template_reads_back_as_the_machine_it_was_made_from(loader, name):
    assert machine.loads(machine.template(loader)).unit(name) == loader.unit(name)


def test_a_template_names_every_key_with_its_range(text):
    for part in (machine.Machine, *all_parts(machine.DirectDriven)):
        for key, field in part.model_fields.items():
            written = re.search(rf"^(# )?{key} = |^(# )?\[([\w.]+\.)?{key}[.\]]", text, re.MULTILINE)
            assert written or key == "linkage", key  # which a boom alone has not
            declared = declaration(field)
            if declared:
                assert f"{declared.text}; {declared.range}" in text


def test_every_parameter_is_explained_and_bounded():
    for part in all_parts():
        assert part.__doc__, part
        for key, field in part.model_fields.items():
            inner = field.annotation
            if isinstance(inner, type) and issubclass(inner, Part):
                continue
            assert explain(field), f"{part.__name__}.{key}"
            declared = declaration(field)
            if declared:
                assert declared.above or declared.least, f"{part.__name__}.{key} has no lower bound"
                assert declared.most or declared.below, f"{part.__name__}.{key} has no upper bound"
                lowest, highest = declared.above or declared.least, declared.below or declared.most
                assert units.parse(lowest, declared.unit) < units.parse(highest, declared.unit)
                assert not isinstance(field.default, float) or declared.read(field.default) == field.default


def test_a_bound_is_a_number_in_the_unit_or_has_a_unit_of_its_own():
    assert quantity("mm", "", least=0.5, below="1 m").range == "at least 0.5 mm, below 1 m"
    assert quantity("1", "", above=0, most=2).range == "above 0, at most 2"


def test_replace_checks_and_keeps_the_rest(loader):
    worn = loader.replace({"units.boom.pump_a.volumetric_efficiency": 0.85, "units.boom.cylinder.bore": "6 in"})
    assert worn.unit("boom").pump_a.volumetric_efficiency == 0.85
    assert worn.unit("boom").cylinder.bore == 0.1524
    assert worn.unit("bucket") == loader.unit("bucket")
    assert loader.unit("boom").cylinder.bore == 0.127
    assert worn.source_of("units.boom.cylinder.bore") is None
    assert worn.source_of("units.boom.cylinder.rod") == loader.source_of("units.boom.cylinder.rod")
    assert loader.replace({"units.boom.load.loads.high": "400 kN"}).unit("boom").load.loads["high"] == 400e3
    with pytest.raises(DescriptionError, match="out of range"):
        loader.replace({"units.boom.cylinder.bore": 2.0})
    for path in ("units.boom.cylinder.boer", "units.bomb.cylinder", "units.boom.cylinder.bore.x", "unit"):
        with pytest.raises(UnknownNameError):
            loader.replace({path: 1, "units.bomb.x": 1})


def test_replace_takes_a_model_with_all_its_values(loader, text):
    head, tail = text.split("[units.boom.pump_b]")
    other = machine.loads(f"{head}[units.boom.pump_b]{re.sub('PGI100-2-[0-9]+', 'PGI100-2-005', tail, count=1)}")
    for path in ("units.boom.pump_b.model", "units.boom.pump_b"):
        changed = loader.replace({path: "pgi100-2-005"})
        assert changed.unit("boom").pump_b == other.unit("boom").pump_b
        assert changed.unit("boom").pump_b.displacement == pytest.approx(5.3e-6 / (2 * math.pi), rel=1e-9, abs=0.0)
        assert changed.source_of("units.boom.pump_b.displacement").startswith("PGI100-2-005: [M]")
        assert changed.source_of("units.boom.pump_b.belt") == loader.source_of("units.boom.pump_b.belt")
        assert machine.loads("\n".join(as_toml(changed, changed.sources))).unit("boom") == changed.unit("boom")
    pump = loader.unit("boom").pump_b
    assert pump.replace({"model": "PGI100-2-005"}) == other.unit("boom").pump_b
    assert pump.replace({"model": "PGI100-2-005", "displacement": "5.4 cm3/rev", "belt": 2}).belt == 2.0
    assert pump.replace({"displacement": "5.4 cm3/rev", "model": "PGI100-2-005"}).displacement > 5.3e-6 / (2 * math.pi)
    assert pump.replace({"model": None}) == pump.model_copy(update={"model": None})
    whole = loader.replace({"units.boom.pump_b": {"model": "PGI100-2-005", "belt": 2}}).unit("boom").pump_b
    assert whole == pump.replace({"model": "PGI100-2-005", "belt": 2})


def test_replace_takes_models_of_placed_parts_and_of_parts_that_were_not_there(loader):
    rig = machine.load_machine("eha-test-bench")
    (name,) = rig.unit("axis").pumps
    changed = rig.replace({f"units.axis.parts.{name}.model": "PGI100-2-005"}).unit("axis")
    assert changed.pumps[name].displacement == pytest.approx(5.3e-6 / (2 * math.pi), rel=1e-9, abs=0.0)
    assert changed.pumps[name].inlet == rig.unit("axis").pumps[name].inlet
    with_port = loader.replace({"units.boom.port_relief_valve": {"model": "DB10P-01", "setting": "300 bar"}})
    assert with_port.unit("boom").port_relief_valve.setting == 300e5


def test_replace_refuses_a_model_that_is_none(loader):
    for path in ("units.boom.pump_b.model", "units.boom.pump_b"):
        with pytest.raises(UnknownNameError, match=r"unknown pump 'nonsense' .*known: PGI100-2-005, PGI100-2-006"):
            loader.replace({path: "nonsense"})


def test_python_builds_parts_from_si_numbers():
    tank = machine.Tank(pressure=3e5)
    assert tank.pressure == 3e5
    assert machine.Tank.model_validate(tank.model_dump()) == tank
    with pytest.raises(ValueError, match="out of range"):
        machine.Tank(pressure=1e9)


def test_the_json_schema_knows_unit_range_and_sources():
    schema = machine.json_schema()
    bore = schema["$defs"]["Cylinder"]["properties"]["bore"]
    assert bore["x-unit"] == "mm"
    assert "at least 1 mm" in bore["description"]
    assert {"value", "source"} == set(bore["anyOf"][1]["properties"])
    assert "PGI100-2-008" in schema["$defs"]["DirectDriven"]["properties"]["pump_a"]["anyOf"][1]["enum"]
    assert "relief valve" in schema["$defs"]["PlacedRelief"]["properties"]["kind"]["const"]


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=5,
)
COMPOSED = [("eha-single-rod", "axis"), ("press", "ram")]
KEYS = sorted(
    f"{name}.{value.path}" for name, unit in [("mining-loader", "boom"), *COMPOSED]
    for value in machine.walk(machine.load_machine(name).unit(unit), f"units.{unit}.")
    if value.given or name == "mining-loader"
)  # fmt: skip


@settings(max_examples=200)
@given(path=st.sampled_from(KEYS), junk=JSON)
def test_junk_in_any_place_is_read_or_refused_in_one_line(path, junk):
    name, *places, key = path.split(".")
    data = catalogue.read_toml(catalogue.find("machine", name).path)
    place = data
    for step in places:
        place = place.setdefault(step, {})  # a table of defaults alone may be missing
    place[key] = junk
    try:
        _machine(data, "a.toml")
    except RamsightError as error:
        said = str(error)
    else:
        return
    assert said.startswith("a.toml")
    assert "\n" not in said


def test_every_value_of_the_catalogue_has_a_source_and_every_source_a_mark():
    marked = re.compile(r"\[(P|M|D|G|I|S:[^]]+)\]")
    for entry in catalogue.entries():
        assert entry.description
        if entry.kind == "machine":
            read = machine.load_machine(entry.name)
            for name, unit in read.units.items():
                for value in machine.walk(unit, f"units.{name}."):
                    source = read.source_of(value.path)
                    assert source or not value.given, f"{entry.name}: {value.path} has no source"
                    if not value.given:
                        continue  # a default, explained where it is declared
                    assert marked.search(source), f"{entry.name}: {value.path}: {source!r} has no mark"
        elif entry.kind == "circuit":
            assert marked.search(entry.source)
            assert catalogue.drawing(entry)
        else:
            values, sources = catalogue.read(entry)
            for key, value in values.items():
                declaration(PARTS[entry.kind].model_fields[key]).read(value, from_file=True)
                assert marked.search(sources[key]), f"{entry.name}: {key}"


def test_the_catalogue_has_all_sizes_of_the_pump_and_its_files_their_names():
    names = {entry.name for entry in catalogue.entries()}
    assert {f"PGI100-2-{size:03}" for size in (5, 6, 8, 11, 13, 16, 19, 22, 25)} <= names
    for entry in catalogue.entries():
        assert entry.path.stem == entry.name.lower()
    assert len(names) == len(catalogue.entries())


def test_values_that_fit_together_alone_are_changed_together():
    small = {"units.boom.cylinder.bore": "60 mm", "units.boom.cylinder.rod": "40 mm"}
    for changes in (small, dict(reversed(small.items()))):
        cylinder = machine.load_machine("mining-loader").replace(changes).unit("boom").cylinder
        assert (cylinder.bore, cylinder.rod) == (0.06, 0.04)
