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


@pytest.mark.parametrize(("grown", "again"), [(0.9 * START_STD, False), (1.1 * START_STD, True)])
def test_a_position_that_becomes_less_certain_at_rest_is_saved_again(monkeypatch, grown, again):
    monkeypatch.setattr(saving_module, "impossible", lambda *_: "")
    saving = Saving(SimpleNamespace(state={"position": 0.2}), File())
    saving.watch(0.0, 100.0, said(1e-3))
    saving.watch(REST_TIME, 0.0, said(1e-3))
    assert saving.rests(REST_TIME)
    saving.save(REST_TIME)
    saving.watch(REST_TIME + 1.0, 0.0, said(1e-3))
    assert not saving.rests(REST_TIME + 1.0)
    saving.watch(REST_TIME + 60.0, 0.0, said(1e-3 + grown))
    assert saving.rests(REST_TIME + 60.0) == again


def test_a_position_that_becomes_known_at_rest_is_saved(monkeypatch):
    monkeypatch.setattr(saving_module, "impossible", lambda *_: "")
    saving = Saving(SimpleNamespace(state={"position": 0.2}), File())
    unknown = SimpleNamespace(position=math.nan, position_std=math.nan, velocity=0.0)
    saving.watch(0.0, 100.0, unknown)
    saving.watch(REST_TIME, 0.0, unknown)
    assert saving.rests(REST_TIME)
    saving.save(REST_TIME)
    saving.watch(REST_TIME + 1.0, 0.0, unknown)
    assert not saving.rests(REST_TIME + 1.0)
    saving.watch(REST_TIME + 2.0, 0.0, said(1e-3))
    assert saving.rests(REST_TIME + 2.0)
