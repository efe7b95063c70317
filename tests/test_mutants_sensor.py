"""Boundaries of the sensor that small changes of the code would move, seen from outside."""

import pytest

from ramsight.sensor.status import LEAST, Status, is_invalid, validity_levels

BOUNDARIES = [
    (0, "ok"), (9, "ok"), (10, "uncertain"), (29, "uncertain"), (30, "not referenced"), (39, "not referenced"),
    (40, "invalid"), (99, "invalid"),
]  # fmt: skip


@pytest.mark.parametrize(("number", "validity"), BOUNDARIES)
def test_the_number_of_a_status_says_its_validity_to_the_last_one(number, validity):
    levels = ("ok", "uncertain", "not referenced", "invalid")
    assert levels[int(validity_levels([number])[0])] == validity
    assert bool(is_invalid([number])[0]) == (validity == "invalid")
    if number in set(map(int, Status)):
        assert Status(number).validity == validity


@pytest.mark.parametrize(
    ("status", "validity"),
    [
        (Status.OK, "ok"), (Status.REFERENCE_DUE, "uncertain"), (Status.NOT_REFERENCED, "not referenced"),
        (Status.TOO_UNCERTAIN, "invalid"), (Status.INPUT_LOST, "invalid"), (Status.SIGN_CONTRADICTED, "invalid"),
    ],
)  # fmt: skip
def test_known_statuses_have_the_validity_that_the_pages_state(status, validity):
    assert status.validity == validity
    assert status.text.startswith(validity)


def test_every_boundary_is_the_number_of_a_status():
    """The first status of a validity has its least number: a boundary that moves by one changes its validity."""
    assert set(LEAST) <= set(map(int, Status))
    for least in LEAST:
        below = max(status for status in Status if status < least)
        assert Status(least).validity != below.validity
