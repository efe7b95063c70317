"""When the encoder saves what its sensor knows."""

import math
from types import SimpleNamespace

import pytest

from ramsight.deploy.encoder import saving as saving_module
from ramsight.deploy.encoder.saving import Saving
from ramsight.sensor.thresholds import REST_TIME, START_STD


class File:
    """Keeps nothing; counts."""

    failure = ""

    def __init__(self):
        self.saves = 0

    def resume(self):
        return True

    def save(self, *_, **__):
        self.saves += 1
        return True

    def __getattr__(self, name):
        return lambda *_, **__: True


def said(std):
    return SimpleNamespace(position=0.2, position_std=std, velocity=0.0)


UNKNOWN = SimpleNamespace(position=math.nan, position_std=math.nan, velocity=0.0)


@pytest.mark.parametrize(
    ("first", "later", "again"),
    [
        (said(1e-3), said(1e-3 + 0.9 * START_STD), False), (said(1e-3), said(1e-3 + 1.1 * START_STD), True),
        (UNKNOWN, said(1e-3), True),
    ],
    ids=["hardly less certain", "less certain", "known at last"],
)  # fmt: skip
def test_a_position_that_changes_what_is_known_of_it_at_rest_is_saved_again(monkeypatch, first, later, again):
    monkeypatch.setattr(saving_module, "impossible", lambda *_: "")
    saving = Saving(SimpleNamespace(state={"position": 0.2}), File())
    saving.watch(0.0, 100.0, first)
    saving.watch(REST_TIME, 0.0, first)
    assert saving.rests(REST_TIME)
    saving.save(REST_TIME)
    saving.watch(REST_TIME + 1.0, 0.0, first)
    assert not saving.rests(REST_TIME + 1.0)
    saving.watch(REST_TIME + 60.0, 0.0, later)
    assert saving.rests(REST_TIME + 60.0) == again
