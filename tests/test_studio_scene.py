"""Where parts of a machine in space are: outlines hold their pins, a body goes where two points of it go."""

import math

import numpy as np
import pytest

from ramsight.drawing.mechanism.scenery import truck
from ramsight.studio.scene import around, turn


class Body:
    """What a scene's object is asked."""

    def rotate(self, *angles):
        self.angles = angles
        return self

    def move(self, *place):
        self.place = place
        return self


@pytest.mark.parametrize("pins", [[[0.3, 0.2]], [[0.0, 0.0], [1.0, 0.0]], [[0.0, 0.0], [1.0, 0.0], [0.4, 0.7]]])
def test_an_outline_holds_the_eye_of_each_pin(pins):
    outline = around(np.array(pins))
    edges = np.roll(outline, -1, axis=0) - outline
    for pin in pins:
        way = np.array(pin) - outline
        distances = (edges[:, 0] * way[:, 1] - edges[:, 1] * way[:, 0]) / np.linalg.norm(edges, axis=1)
        assert distances.min() > 0.12  # anticlockwise: what is inside lies to the left of every edge


@pytest.mark.parametrize("angle", [0.0, 0.7, -2.0])
def test_a_body_that_is_turned_has_its_points_where_they_are_seen(angle):
    drawn = np.array([[1.0, 0.5], [2.0, 0.7]])
    c, s = math.cos(angle), math.sin(angle)
    seen = drawn @ np.array([[c, s], [-s, c]]) + [0.3, -0.2]
    body = Body()
    turn(body, drawn, seen)
    x, y, z = body.place
    assert (body.angles[0], body.angles[2], y) == (0.0, 0.0, 0.0)
    assert math.remainder(body.angles[1] + angle, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-12)
    turned = np.column_stack([c * drawn[:, 0] - s * drawn[:, 1] + x, s * drawn[:, 0] + c * drawn[:, 1] + z])
    assert turned == pytest.approx(seen)


def test_a_truck_stands_on_its_wheels_behind_the_mast():
    found = truck([np.array([0.4, 0.1])])
    assert (found.wheels[:, 1] == found.radius).all()
    assert found.chassis[:, 0].max() < 0.4
    assert found.chassis[:, 1].min() > 0.0
