"""Machine code that is optimized, as users have it, does what the code does that tests run otherwise."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

SENSED = """
import numpy as np, ramsight
unit = ramsight.build("eha-test-bench", unit="axis")
run = ramsight.simulate(unit, load="9 kN", hold="0.4 s")
found = {name: run[name].values for name in ("position", "motor_torque")}
log = ramsight.drive_report(run, unit)
first = float(run["position"][0])
sensor = ramsight.sensor_for(unit, "KIND")
sensor.start(first)
found["track"] = sensor.track(log)["position"].values
sensor.start(first)
columns = [log[name].values for name in ("time", "motor_speed", "motor_torque", "oil_temperature")]
found["live"] = [sensor.step(*map(float, sample)).position for sample in zip(*columns)]
"""
SIDE_BY_SIDE = """
duties = [ramsight.lift_lower(unit, load) for load in (8e3, 9e3, 11e3)]
many = ramsight.simulate_many(unit, duties)
found |= {name: many[name].values for name in ("position_final", "pressure_chamber_a_most")}
"""


def here(code):
    scope = {}
    exec(code, scope)
    return scope["found"]


def optimized(code, folder):
    """The same of a process of its own, which compiles all anew."""
    told = "import json; print(json.dumps({name: np.asarray(one).tolist() for name, one in found.items()}))"
    environment = os.environ | {"RAMSIGHT_CACHE": str(folder)}
    del environment["RAMSIGHT_OPTIMIZE"]
    done = subprocess.run(
        [sys.executable, "-c", code + told], env=environment, capture_output=True, text=True, check=False, timeout=300
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize(
    "code",
    [
        pytest.param(SENSED.replace("KIND", "balance") + SIDE_BY_SIDE, id="plants and balance"),
        pytest.param(SENSED.replace("KIND", "kalman"), id="kalman", marks=pytest.mark.slow),
    ],
)
def test_optimized_code_gives_the_same_but_for_rounding(code, tmp_path):
    expected, found = here(code), optimized(code, tmp_path)
    assert list(found) == list(expected)
    for name, values in expected.items():
        np.testing.assert_allclose(found[name], values, rtol=1e-6, atol=1e-7, err_msg=name)
