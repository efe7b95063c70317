"""What the tests make once a process is what would be made anew, and nobody's change of it is seen by another."""

from dataclasses import replace

import numpy as np

from ramsight.deploy.c_sensor import sensor_source
from ramsight.sensor.kalman import kalman

from .made_once import anew
from .plant_bench import UNITS

BOOM, RAM = UNITS["mining-loader boom"], UNITS["press ram"]


def test_sensors_of_equal_units_share_their_graph_and_nothing_else():
    one, other = kalman(BOOM), kalman(replace(BOOM))
    assert one is not other
    assert one.recursion is other.recursion
    one.start(0.3)
    one.parameters[:] = one.initial[:] = 0.0
    one.units["position"] = "in"
    third = kalman(BOOM, BOOM.assumptions)
    for sensor in (other, third):
        assert sensor.state["position_known"] == 0.0
        assert sensor.parameters.any()
        assert sensor.initial.any()
        assert sensor.units["position"] == "m"


def test_what_differs_has_a_graph_of_its_own():
    plain = kalman(BOOM)
    told = kalman(BOOM, BOOM.assumptions.replace({"drive.torque": 0.02}))
    longer = kalman(replace(BOOM, cylinder=replace(BOOM.cylinder, stroke=0.8)))
    assert len({id(one.recursion) for one in (plain, told, longer)}) == 3
    assert longer.stroke == 0.8


def test_what_is_made_anew_is_the_same():
    """The graph of a sensor, operation by operation, and its C."""
    shared = kalman(RAM)
    c = sensor_source(shared, RAM, "ram", "m", single=False)
    c.files["ram.c"] = ""
    assert sensor_source(kalman(RAM), RAM, "ram", "m", single=False).files["ram.c"]
    with anew():
        other = kalman(RAM)
    assert other.recursion is not shared.recursion
    assert other.recursion.function().serialize() == shared.recursion.function().serialize()
    np.testing.assert_array_equal(other.parameters, shared.parameters)
