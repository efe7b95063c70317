"""A studio that is visited by too many, who vanish: `make fuzz` does the same with 100 frames, 500 and 200 visitors."""

from functools import partial

import numpy as np
import pytest

pytestmark = pytest.mark.slow
pytest.importorskip("nicegui", reason="needs the extra studio")


def test_machines_are_never_more_than_places_others_are_served_and_nothing_is_left(script, monkeypatch, tmp_path):
    served_studio, load = script("served_studio", "fuzz"), script("studio", "fuzz")
    studio = served_studio.ServedStudio(1, tmp_path)
    monkeypatch.setattr(load, "LIMIT", 1)
    monkeypatch.setattr(load, "WAITED", 5.0)  # tests share their computer with others
    monkeypatch.setattr(load, "_AT_ONCE", 5)
    try:
        first = load.Visitor(studio)  # takes the machine that waits for him
        first.sees(60.0)
        first.drop()
        assert studio.settled(40.0) == 0
        prepared, rng = load.Prepared(studio, studio.kept(), None), np.random.default_rng(1)
        found, said = load.judged(prepared, partial(load.frames, prepared, 30))
        assert found == {load.REFUSED: 30}, said
        found, said = load.judged(prepared, partial(load.vanishing, studio, rng, 20))
        assert found != load.WRONG, said
        found, said = load.judged(prepared, partial(load.crowd, studio, 10))
        assert found == {load.READ: 1, load.REFUSED: 9}, said
    finally:
        studio.end()
