"""The bucket's shell and its rock, and the paper's drawings: what is drawn is what is described."""

import numpy as np
import pytest

from film.side_view import rock
from ramsight import machine
from ramsight.drawing.mechanism.bodies import shapes
from ramsight.drawing.mechanism.bucket import DENSITY, WIDTH, bucket
from ramsight.plant.linkage import build_mechanism
from reproduction.choices import direct_driven
from reproduction.machine_drawings import hydraulics, pumps

LOADER = machine.load_machine("mining-loader")


def area(outline):
    x, z = outline.T
    return 0.5 * abs(float(x @ np.roll(z, -1) - z @ np.roll(x, -1)))


@pytest.mark.parametrize("payload", [1.0, 400.0, 3000.0, 7750.0])
def test_rock_has_its_volume_whatever_the_pose(payload):
    mechanism = build_mechanism(LOADER.linkage)
    for place in ([0.1, 0.25], [0.6, 0.05], [0.4, 0.45]):
        shell = shapes(mechanism, place).bucket
        assert area(rock(shell, payload)) == pytest.approx(payload / (DENSITY * WIDTH), rel=1e-9)


def test_a_bucket_holds_its_pins_and_turns_with_them():
    seen = shapes(build_mechanism(LOADER.linkage), [0.35, 0.25])
    shell = seen.bodies["bucket"]
    assert np.abs(shell - seen.tip).sum(axis=1).min() < 1e-9  # the tooth is the tip
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])
    pins = np.array([[0.0, 0.0], [0.1, 0.6], [1.5, -0.2]])
    straight, turned = bucket(*pins), bucket(*(pins @ turn.T))
    assert np.allclose(turned.outline, straight.outline @ turn.T)
    mirrored = bucket(*(pins * [1.0, -1.0]))  # a bucket that opens downwards
    assert np.allclose(mirrored.outline, straight.outline * [1.0, -1.0])
    assert mirrored.struck == pytest.approx(straight.struck)


def test_what_is_no_bucket_stays_the_hull_of_its_pins():
    mast = shapes(build_mechanism(machine.load_machine("forklift-mast").linkage), [0.5])
    assert mast.bucket is None


def test_the_drawn_models_have_the_descriptions_values():
    boom = direct_driven(LOADER, "boom").replace({"relief_valve.setting": "199 bar", "pump_a.belt": "28/39"})
    drawn = "\n".join(hydraulics(boom).boxes)
    for words in (
        "199 bar",
        "2 cylinders",
        "ø 127 / 79.4 mm",
        "safety valve A\nopens to lower",
        "safety valve B\nheld open",
    ):
        assert words in drawn
    drawn = "\n".join(pumps(boom).boxes)
    for words in ("28/39", "28/47", "2 × 2 × 7.9 = 31.6 cm³/rev", "1 × 1 × 22.2 = 22.2 cm³/rev"):
        assert words in drawn
    bucket_unit = direct_driven(LOADER, "bucket")
    assert "safety valve B\nopens to lower" in hydraulics(bucket_unit).boxes


def test_every_arrow_has_both_its_boxes():
    unit = direct_driven(LOADER, "boom")
    for diagram in (hydraulics(unit), pumps(unit)):
        assert {end for arrow in diagram.arrows for end in (arrow.begin, arrow.end)} == set(diagram.boxes)
        assert set(diagram.given) <= set(diagram.boxes)
