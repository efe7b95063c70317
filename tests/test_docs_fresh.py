"""Rows of pages worked out anew: what stored figures say is what today's code gives."""

from dataclasses import asdict
from pathlib import Path

import pytest

DOCS = Path(__file__).parent.parent / "docs"


def rows_of(page):
    return (DOCS / f"{page}.md").read_text(encoding="utf-8").splitlines()


def test_what_effects_move_is_as_the_page_of_the_plant_says(script, monkeypatch):
    effects = script("effects")
    names = ("relief valve set 7 % low", "locked oil cools by 10 K", "cushion at the upper stop", "belt that creeps")
    monkeypatch.setattr(effects, "EFFECTS", tuple(one for one in effects.EFFECTS if one.name in names))
    fresh = effects.table(effects.study(lambda _: None))
    assert len(fresh) == 2 + len(names) + 1  # oil cools at two places
    assert [row for row in fresh if row not in rows_of("reference/real-machines")] == []


@pytest.mark.parametrize("log", ["boom_441kN_40C", "boom_asbuilt1_leaktest"])
def test_a_recorded_log_is_followed_as_the_page_of_the_sensor_says(script, log):
    found = script("recorded").judged(only=(log,))
    head, line, *fresh = script("pages").recorded({name: asdict(one) for name, one in found.items()})
    assert fresh
    assert [row for row in (head, line, *fresh) if row not in rows_of("reference/accuracy")] == []


@pytest.mark.parametrize("name", ["direct driven", "forklift"])
def test_a_lost_torque_stops_a_unit_as_the_page_of_the_control_says(script, name):
    study = script("unit_control")
    fresh = study.fault_table({name: study.lost(study.catalogued(*study.UNITS[name]))})
    assert [row for row in fresh if row not in rows_of("reference/control-accuracy")] == []


def test_the_margins_of_a_loop_are_as_the_page_of_the_control_says(script, monkeypatch):
    study = script("loop_response")
    drive = next(iter(study.DRIVES))
    monkeypatch.setattr(study, "UNITS", {name: of for name, of in study.UNITS.items() if name == "forklift"})
    monkeypatch.setattr(study, "DRIVES", {drive: study.DRIVES[drive]})
    fresh = study.table(study.study())
    assert len(fresh) == 3
    assert [row for row in fresh if row not in rows_of("explanation/control-concept")] == []
