"""Variables of FMUs are shown in the units of the field, with their ranges, and in words that are right."""

import math
import zipfile

import pytest

from ramsight import machine
from ramsight.deploy.fmu import write_fmu
from ramsight.deploy.fmu_units import BASE, DISPLAY, parameter_unit
from ramsight.deploy.sensor_words import meaning

fmpy = pytest.importorskip("fmpy")
WRITTEN = [
    ("mining-loader", "boom", "compare", 2), ("mining-loader", "boom", "weighing", 3),
    ("eha-valve-rig", None, "plant", 2), ("press", None, "plant", 3), ("eha-valve-rig", None, "sensor", 2),
]  # fmt: skip


@pytest.fixture(scope="module", params=WRITTEN, ids=lambda one: f"{one[0]}-{one[2]}")
def described(request, tmp_path_factory):
    """A description as an importer reads it; fmpy holds it against the standard's schema."""
    name, unit, what, fmi = request.param
    loaded = machine.load_machine(name)
    out = tmp_path_factory.mktemp("fmu") / "unit.fmu"
    write_fmu(loaded, unit or next(iter(loaded.units)), out, what=what, fmi=fmi, compiler="")
    with zipfile.ZipFile(out) as archive:
        assert not [name for name in archive.namelist() if name.startswith("binaries/")]
    return fmpy.read_model_description(str(out), validate=True)


def test_every_variable_with_a_usual_unit_is_shown_in_it(described):
    shown = {v.name: v.displayUnit for v in described.modelVariables if v.unit}
    units = {v.name: v.unit for v in described.modelVariables if v.unit}
    assert len(shown) > 15
    for name, unit in units.items():
        assert shown[name] == (DISPLAY[unit].name if unit in DISPLAY else None), name


@pytest.mark.parametrize(
    ("unit", "value", "shown", "by"),
    [
        ("K", 313.15, "degC", 40.0), ("Pa", 25e6, "bar", 250.0), ("rad/s", 50.0 * math.pi, "rpm", 1500.0),
        ("m", 0.7, "mm", 700.0), ("N", 441e3, "kN", 441.0), ("m/s", 0.02, "mm/s", 20.0),
    ],
)  # fmt: skip
def test_a_value_is_shown_as_the_standard_says(described, unit, value, shown, by):
    found = {u.name: u.displayUnits for u in described.unitDefinitions}
    if unit not in found:
        pytest.skip("this FMU has no such quantity")
    (display,) = found[unit]
    assert display.name == shown
    assert value * float(display.factor) + float(display.offset or 0.0) == pytest.approx(by)


def test_ranges_hold_the_starts(described):
    ranged = [v for v in described.modelVariables if v.min is not None]
    assert {v.name for v in ranged} >= {"start_position"}
    for v in ranged:
        if v.start is not None:
            assert float(v.min) <= float(v.start) <= float(v.max or "inf"), v.name
    assert all(float(v.nominal) > 0.0 for v in described.modelVariables if v.nominal is not None)


def test_every_displayed_unit_has_base_units():
    assert set(DISPLAY) <= set(BASE)
    assert {parameter_unit(f"part.{key}") for key in ("stroke", "area_a", "conductance")} == {"m", "m2", ""}


def test_a_probability_is_called_one():
    for name in ("described", "leaks", "low", "top", "unknown_position", "speed_gain", "torque_other"):
        said = meaning(f"{name}_probability")
        assert said.startswith("probability that "), said
    assert meaning("torque_missing_std") == "standard deviation of torque missing"
    assert meaning("speed_gain") != meaning("speed_gain_probability")
