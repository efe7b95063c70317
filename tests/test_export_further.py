"""Exported C takes every further signal: a sensor of a machine that declares all of them at once."""

import math

import pytest

from ramsight import machine
from ramsight.deploy.c_folder import write_sensor
from ramsight.deploy.compiler import find_compiler
from ramsight.logs.channels import FURTHER, PRESSURES, SHAFT_ANGLE

from .golden import golden

ALL = {
    "shaft.std": math.radians(0.05), "power.std": 0.005, "inertia.std": 0.3, "motor_temperature.std": 0.01,
    "link_angle.std": math.radians(0.2), "absolute_position.std": 2e-3, "absolute_position.offset": 1e-3,
    "absolute_position.delay": 0.1,
}  # fmt: skip
"""All but pressures, which floats are too short for (tests/test_directional.py)."""


@pytest.mark.slow
@pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
def test_exported_c_takes_every_further_signal_and_says_the_same(tmp_path):
    loader = machine.load_machine("mining-loader")
    described = loader.replace({f"units.boom.assumptions.{key}": value for key, value in ALL.items()})
    done = write_sensor(described, "boom", tmp_path / "boom", compiler="")
    header = (done.folder / "ramsight_boom.h").read_text(encoding="utf-8")
    for one in FURTHER:
        if one not in PRESSURES:
            kind = "double" if one is SHAFT_ANGLE else "ramsight_boom_real"
            assert f"{kind} {one.name}; /* {one.long_name} [{one.units}]" in header
    assert "double intake_counter_angle;" in header, "a counter that grows for hours is none of a float"
    assert "RAMSIGHT_BOOM_SIGN_CONTRADICTED = 50" in header
    for single in (False, True):
        assert "passed" in golden(done.folder, "ramsight_boom", single=single)
