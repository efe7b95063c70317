"""What the studio shows, without a browser: the machine under a lever, its process, the guard, and a log's answers."""

import asyncio
import gzip
import itertools
import math
import os
import re
import shutil
import signal
import socket
import threading
import time
from contextlib import closing
from dataclasses import fields, replace
from pathlib import Path
from urllib.parse import parse_qsl

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import ramsight
from ramsight import machine
from ramsight.cli import app
from ramsight.drawing import drawn
from ramsight.drawing.flowing import chains
from ramsight.duty.drive_report import declared_report, further_report
from ramsight.duty.live import LiveUnit
from ramsight.duty.live_further import LiveFurther
from ramsight.duty.live_warming import LiveWarming
from ramsight.duty.oil_warming import warmed
from ramsight.duty.reading_report import LiveLink
from ramsight.errors import DescriptionError, RamsightError
from ramsight.normal import TWO_SIDED_95
from ramsight.sensor.status import Status
from ramsight.studio import draft
from ramsight.studio.knobs import FAULTS, KNOBS, LIE, UNSURE, WRONG_START, Knobs
from ramsight.studio.machine_page import circuit_menu
from ramsight.studio.playing import DUTIES, ENDS
from ramsight.studio.rig import Rig
from ramsight.studio.session import STANDS, Session, Visitors
from ramsight.studio.setting import catalogue_name, query_of, read_setting, with_unit
from ramsight.studio.strips import PRESETS, SIGNALS, STRIPS
from ramsight.studio.thinning import keep, kept, thinned
from ramsight.studio.uploaded_log import NOWHERE, Asked, find_factors, find_leak, judge, propose, references, track
from ramsight.studio.web_server import Guard
from ramsight.studio.worker import _ALIVE, flows
from ramsight.studio.worker import _columns as columns_of  # of a frame

from .waiting import wait_for

TRACES = Path(__file__).parent / "traces"
STARTED = (Status.OK, Status.REFERENCE_DUE)  # an entered position is due a reference until a contact agrees


def run(rig, seconds, **levers):
    """Let a rig run, with its levers where they are or there; its rows."""
    rig.levers.update(levers)
    return [rig.step() for _ in range(round(seconds / rig.period))]


@pytest.fixture
def press():
    return Rig(machine.load_machine("press"))


def test_a_lever_moves_the_piston_and_the_estimate_follows_within_its_band(press):
    rows = run(press, 4.0, ram=0.6)
    first, last = rows[0]["ram"], rows[-1]["ram"]
    assert last.position - first.position > 0.02
    for row in rows:
        said = row["ram"].estimates["kalman"]
        assert abs(said.position - row["ram"].position) <= TWO_SIDED_95 * said.position_std
    run(press, 1.5, ram=0.0)
    assert press.step()["ram"].motor_speed == 0.0


def test_a_worn_pump_moves_the_plain_balance_away(press):
    press.turn(replace(press.knobs, leak=2.5, load=1.0))
    last = run(press, 6.0, ram=0.3)[-1]["ram"]
    assert abs(last.estimates["balance"].position - last.position) > 0.01
    healthy = Rig(machine.load_machine("press"))
    healthy.turn(replace(healthy.knobs, load=1.0))
    other = run(healthy, 6.0, ram=0.3)[-1]["ram"]
    assert abs(other.estimates["balance"].position - other.position) < 1e-3


TURNED = {
    "load": 0.8, "oil_temperature": 323.15, "ambient": 253.15, "leak": 2.0, "displacement": 0.98, "stiffness": 0.6,
    "friction": 2.0, "torque_gain": 1.1, "magnets": 40.0, "torque_step": 2.0, "report_delay": 0.1,
    "temperature_offset": 5.0,
}  # fmt: skip
OF_THE_REPORT = {"torque_gain", "magnets", "torque_step", "report_delay", "temperature_offset"}


def lifted(**turned):
    rig = Rig(machine.load_machine("press"))
    rig.turn(replace(rig.knobs, **turned))
    return run(rig, 2.0, ram=0.5)[-1]["ram"]


@pytest.mark.slow
def test_every_knob_changes_the_machine_or_what_is_reported_of_it_and_the_page_has_it():
    plain = lifted()
    assert set(TURNED) == {field.name for field in fields(Knobs)}
    for name, value in TURNED.items():
        other = lifted(**{name: value})
        truth = [(row.position, row.motor_torque) for row in (plain, other)]
        assert (truth[0] == truth[1]) == (name in OF_THE_REPORT), name
        assert other.estimates["kalman"] != plain.estimates["kalman"], name
    assert [knob.name for knob in KNOBS] == list(TURNED)
    for knob in KNOBS:
        assert knob.least <= knob.first <= knob.most
        assert knob.step > 0.0
        assert knob.si(knob.first) == pytest.approx(getattr(Knobs(), knob.name))


LINKS = (
    {}, {"machine": "press", "play": "none"}, {"play": "worn"},
    {"play": "none", "speed": "5", "leak": "1.6", "ambient": "-20", "report_delay": "30", "faults": "torque,power",
     "sensors": "none"},
    {"play": "none", "sensors": "kalman,balance,unreferenced,table", "duty": "lift and lower", "hold": "oil"},
)  # fmt: skip


@pytest.mark.parametrize("query", LINKS)
def test_a_setting_of_a_link_is_that_of_the_link_it_makes(query):
    found = read_setting(query)
    again = read_setting(dict(parse_qsl(query_of(found.settings, found.scenario, found.machine))))
    assert again == found
    assert again.settings == found.settings
    rig = Rig(machine.load_machine("press"))
    for command, *values in found.commands():
        if command == "knobs":
            rig.turn(replace(rig.knobs, **values[0]))
        elif command == "sense" and values[0] != "table":
            rig.sense(values[0], on=values[1])
        elif command == "fault":
            rig.fault(values[0], on=values[1])
    assert vars(rig.knobs) == pytest.approx(found.settings["knobs"])
    assert rig.faults == set(found.faults)
    assert set(rig.sensors["ram"]) | {"table"} == {*found.sensors, "table"}
    rig.begin()  # what power that is cut has saved is thrown away


def test_a_link_names_the_tab_that_is_open():
    assert [read_setting(query).tab for query in ({}, {"tab": "Logs"})] == ["Live", "Logs"]
    assert [read_setting(query).span for query in ({}, {"span": "all"})] == ["2min", "all"]


def test_a_link_says_the_strips_in_their_order_and_each_once():
    for text, found in (
        (None, STRIPS), ("none", ()), ("oil,position,oil", ("oil", "position")),
        ("boom.true bucket.true", ("boom.true bucket.true",)),
        ("speed torque", ("speed torque",)), ("kalman_level balance_level", ("kalman_level balance_level",)),
    ):  # fmt: skip
        assert read_setting({} if text is None else {"strips": text}).strips == found


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("speed torque true", r"'rpm, N m, mm': cannot be shown together.*up to 2 units of measure"),
        ("true kalman_level", r"'mm, status': cannot be shown together"),
        (",".join(f"u{k}.true" for k in range(13)), r"'13': are too many.*up to 12 strips"),
        ("boom.speet", r"'speet': is no strip and no signal.*position.*such as speed,"),
    ],
)
def test_strips_that_no_page_shows_are_refused_with_what_it_does_show(text, words):
    with pytest.raises(RamsightError, match=words):
        read_setting({"strips": text})
    assert len(read_setting({"strips": ",".join(f"u{k}.true" for k in range(12))}).strips) == 12


@pytest.mark.parametrize(
    ("query", "found"),
    [
        ({}, "boom"), ({"unit": "bucket"}, "bucket"), ({"unit": "mast"}, None),
        ({"strips": "position,true mast.true"}, None),
    ],
)  # fmt: skip
def test_a_link_to_a_unit_or_a_strip_of_one_that_does_not_run_is_refused(query, found):
    asked = read_setting(query)
    if found is None:
        with pytest.raises(RamsightError, match=r"link: unknown unit 'mast' \(known: boom, bucket\)"):
            with_unit(asked, ["boom", "bucket"])
        assert with_unit(asked, ["boom", "mast"]) == query.get("unit", "boom")
    else:
        assert with_unit(asked, ["boom", "bucket"]) == found


def test_every_signal_of_a_strip_is_in_a_frame_or_held_by_the_page():
    rig = Rig(machine.load_machine("press"))
    for kind in ("unreferenced", "table"):
        rig.sense(kind, on=True)
    rig.add_second("ram")
    row = next(row for _ in range(50) if (row := rig.step()["ram"]).second is not None)
    known = rig.known("ram", row.time)
    held = {one["name"] for one in (*known["learned"], *known["hypotheses"])} | {"oil_pumps", "oil_tank"}
    columns = set(columns_of([row], 0.5)) | held
    assert {one.column or name for name, one in SIGNALS.items()} <= columns
    assert all(one.measure for one in SIGNALS.values())
    for title, names in PRESETS.values():
        assert title
        assert read_setting({"strips": " ".join(names)}).strips == (" ".join(names),)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("machine", "/etc/passwd"), ("machine", "../../mine.toml"), ("machine", ""), ("machine", "press\x00"),
        ("leak", "3.01"), ("leak", "0.49"), ("leak", "nan"), ("leak", "inf"), ("leak", ""), ("leak", "\u0661"),
        ("leak", "1_0"), ("leak", "1e999"), ("leak", "9" * 900), ("load", "-1"), ("speed", "51"), ("speed", "-1"),
        ("faults", "fire"), ("faults", "torque,"), ("sensors", "kalman;balance"), ("duty", "none"), ("hold", "1"),
        ("play", "<script>"), ("play", ""), ("strips", "position,\n"), ("strips", ""), ("strips", "a.b"),
        ("tab", "Live,Logs"), ("span", "1h"),
        ("x", "1"), ("", ""), ("unit", "x" * 2000), ("\r\nset-cookie", "a"),
    ],
)  # fmt: skip
def test_what_a_link_cannot_hold_is_refused_in_one_line(name, value):
    with pytest.raises(RamsightError) as caught:
        read_setting({name: value})
    text = str(caught.value)
    assert text.startswith("link")
    assert text.isprintable()
    assert len(text) < 400


def test_a_link_that_plays_what_there_is_not_lists_all_that_there_is():
    with pytest.raises(RamsightError, match=r"unknown play 'worm'.*\bnone\b.*\bworn\b"):
        read_setting({"play": "worm"})


def test_a_machine_that_is_not_the_catalogue_s_has_no_name_there():
    text = machine.template(machine.load_machine("press"), name="press")
    assert catalogue_name(machine.load_machine("press")) == "press"
    other = draft.edited(text, machine.loads(text), "units.ram.cylinder.bore", "200 mm")
    assert catalogue_name(machine.loads(other)) is None
    assert catalogue_name(machine.loads(other.replace('"press"', '"mine"'))) is None


def test_a_part_of_every_circuit_leads_to_a_table_of_the_description():
    for entry in (one for one in machine.catalogue.entries() if one.kind == "machine"):
        described = machine.load_machine(entry.name)
        groups = {row.path.rpartition(".")[0] for row in draft.rows(draft.text_of(described), described)}
        text = circuit_menu(described, groups)
        led = set(re.findall('data-section="([^"]+)"', text))
        assert led <= groups
        assert text.count('<g class="part') == text.count('role="button"'), entry.name
        for name in described.units:
            assert {f"units.{name}.{one}" for one in ("cylinder", "drive")} <= led


def test_the_oil_warms_up_no_faster_than_oil_does_and_the_machine_with_it(press):
    press.turn(replace(press.knobs, oil_temperature=323.15))
    rows = run(press, 4.0)
    assert rows[-1]["ram"].estimates["kalman"].status in STARTED
    assert press.oil["ram"].pumps == pytest.approx(313.15 + 0.5 * 4.0)


def test_losses_warm_the_pumps_before_the_tank_and_the_air_cools_them_again(press):
    press.knobs = replace(press.knobs, load=1.0, ambient=313.15)
    for _ in range(3):
        run(press, 3.0, ram=0.4)
        run(press, 3.0, ram=-0.4)
    oil = press.oil["ram"]
    lost = press.accounts["ram"].losses
    into_case = sum(energy for name, energy in lost.items() if name.startswith("pump") and not name.endswith("belt"))
    into_tank = sum(energy for name, energy in lost.items() if name.endswith(".throttling"))
    gained = 4.2e3 * (oil.pumps - 313.15) + 37e3 * (oil.tank - 313.15)
    assert oil.pumps > oil.tank + 0.2
    assert gained == pytest.approx(into_case + into_tank, rel=0.02)  # what is lost to the air meanwhile is little
    press.begin_account()  # an account that begins anew is not a loss that goes back
    before = oil.pumps
    run(press, 1.0)
    assert abs(oil.pumps - before) < 0.5
    press.levers["ram"] = 0.0
    press.turn(replace(press.knobs, ambient=253.15))
    warm = oil.tank
    run(press, 60.0)
    assert oil.tank < warm - 0.3


def test_the_machine_runs_by_the_oil_in_its_pumps_and_the_thermometer_is_in_its_tank(press, monkeypatch):
    told, changed = [], []
    report, change = press._drives["ram"].report, press._plant.change
    monkeypatch.setattr(press._drives["ram"], "report", lambda *said: told.append(said[3]) or report(*said))
    monkeypatch.setattr(press._plant, "change", lambda values: changed.append(values) or change(values))
    press.oil["ram"]._stores = np.array([330.0, 320.0])
    run(press, 0.1)
    assert told == [320.0] * 5
    assert changed[-1]["oil_temperature"] == press.oil["ram"].pumps != 330.0


def test_oil_that_is_held_stays_where_its_knob_is_and_is_let_go_again(press):
    press.hold_oil(on=True)
    press.turn(replace(press.knobs, oil_temperature=315.15, ambient=253.15, load=1.0))
    run(press, 6.0, ram=0.4)
    assert (press.oil["ram"].pumps, press.oil["ram"].tank) == (315.15, 315.15)
    press.hold_oil(on=False)
    run(press, 1.0)
    assert press.oil["ram"].pumps != 315.15


def test_a_machine_that_lives_gets_as_warm_as_its_run():
    unit = ramsight.build("press")
    duty = ramsight.lift_lower(unit, "300 kN")
    ran = warmed(unit, duty, ambient=263.15)
    live = LiveUnit(unit, duty.start_position, float(duty.load(0.0)), float(duty.oil_temperature(0.0)))
    live.begin_account()
    oil = LiveWarming(unit, float(duty.oil_temperature(0.0)))
    for k in range(1, round(duty.duration / 0.02) + 1):
        live.advance(float(duty.motor_speed(0.02 * k)), float(duty.load(0.02 * k)))
        if k % 5 == 0:
            oil.go_on(0.1, live.accounts["ram"].losses, 263.15)
            live.change({"oil_temperature": oil.pumps})
    assert oil.pumps == pytest.approx(float(ran["pump_temperature"][-1]), abs=0.05)
    assert oil.tank == pytest.approx(float(ran["oil_temperature"][-1]), abs=0.05)


def test_the_oil_has_a_range_and_the_rig_stays_as_it_was(press):
    before = press.knobs
    with pytest.raises(DescriptionError, match="outside the oil's data"):
        press.turn(replace(press.knobs, oil_temperature=500.0))
    assert press.knobs == before


def test_a_lost_temperature_is_said_and_goes_again(press):
    press.fault("temperature", on=True)
    said = run(press, 2.0)[-1]["ram"].estimates["kalman"].status
    assert "oil temperature missing" in said.text
    press.fault("temperature", on=False)
    assert "temperature" not in run(press, 8.0)[-1]["ram"].estimates["kalman"].status.text


def test_sensors_that_are_started_anew_know_where_the_piston_is(press):
    run(press, 2.0, ram=0.5)
    press.fault("temperature", on=True)
    assert math.isnan(run(press, 0.2)[-1]["ram"].estimates["balance"].position)
    press.fault("temperature", on=False)
    assert run(press, 0.2)[-1]["ram"].estimates["balance"].status.validity == "invalid"
    press.start_sensors()
    row = run(press, 0.2)[-1]["ram"]
    assert all(abs(said.position - row.position) < 1e-3 for said in row.estimates.values())


@pytest.mark.parametrize("at", [0.0, 1.0])
def test_a_wrong_start_is_off_by_so_much_within_the_stroke_and_says_that_it_is_unsure(press, at):
    stroke = press.sheet["ram"].cylinder.stroke
    press._at["ram"] = at * stroke
    press.start_sensors("kalman", off=WRONG_START)
    state = press.sensors["ram"]["kalman"].state
    assert state["position"] == pytest.approx(WRONG_START if at == 0.0 else stroke - WRONG_START)
    assert state["position_variance"] == pytest.approx(UNSURE**2)


def test_a_speed_that_reads_too_much_moves_the_estimate_away(press):
    press.fault("speed", on=True)
    last = run(press, 3.0, ram=0.6)[-1]["ram"]
    gone = last.position - 0.4 * press.sheet["ram"].cylinder.stroke
    error = last.estimates["balance"].position - last.position
    assert error == pytest.approx(0.03 * gone, rel=0.2)


def test_a_frozen_torque_stays_what_it_was_when_it_froze(press):
    run(press, 0.2)
    press.fault("torque", on=True)
    last = run(press, 3.0, ram=0.6)[-1]["ram"]
    assert abs(last.motor_torque - press._frozen["ram"]) > 2.0


def test_power_that_comes_back_finds_the_position_where_it_was(press):
    run(press, 2.0, ram=0.5)
    before = run(press, 2.0, ram=0.0)[-1]["ram"]
    press.fault("power", on=True)
    dead = run(press, 1.0)[-1]["ram"]
    assert dead.estimates == {}  # a drive without power reports nothing
    press.fault("power", on=False)
    after = run(press, 1.0)[-1]["ram"].estimates["kalman"]
    assert abs(after.position - before.estimates["kalman"].position) < 1e-3
    assert after.status.validity in ("ok", "uncertain")


def test_a_reference_puts_the_balance_right_and_one_that_lies_puts_it_wrong(press):
    press.refer("ram")
    row = press.step()["ram"]
    assert row.estimates["balance"].position == pytest.approx(row.position, abs=1e-9)
    press.refer("ram", LIE)
    row = press.step()["ram"]
    assert row.estimates["balance"].position == pytest.approx(row.position + LIE, abs=1e-9)
    assert abs(row.estimates["kalman"].position - row.position) < 0.5 * LIE  # it does not believe everything


def declaring(name, unit, **stds):
    """A rig of a machine that declares what else its drive reports."""
    described = machine.load_machine(name)
    text = draft.text_of(described)
    for what, std in stds.items():
        text = draft.edited(text, described, f"units.{unit}.assumptions.{what}.std", std)
    found = draft.read(text)
    assert not isinstance(found, draft.Problem), found
    return Rig(found)


def test_warm_magnets_move_what_the_sensor_takes_for_the_load_unless_the_motor_says_how_warm_it_is():
    off = []
    for stds in ({}, {"motor_temperature": "1 %"}):
        rig = declaring("press", "ram", **stds)
        cold = run(rig, 2.0, ram=0.2)[-1]["ram"].estimates["kalman"].load
        rig.turn(replace(rig.knobs, magnets=0.0))
        rig._magnets = 60.0  # at once, for the test
        rig.knobs = replace(rig.knobs, magnets=60.0)
        warm = run(rig, 1.5)[-1]["ram"].estimates["kalman"].load
        off.append(abs(warm / cold - 1.0))
    assert off[0] == pytest.approx(0.07, abs=0.02)  # 60 K take 6.6 % of the torque constant
    assert off[1] < 0.3 * off[0]


def test_magnets_warm_up_no_faster_than_a_motor_is_heated(press):
    press.turn(replace(press.knobs, magnets=60.0))
    run(press, 2.0)
    assert press._magnets == pytest.approx(1.0)


def test_a_declared_counter_of_the_shaft_contradicts_a_speed_that_reads_too_much():
    for stds, contradicted in (({}, False), ({"shaft": "1 deg"}, True)):
        rig = declaring("press", "ram", **stds)
        run(rig, 1.0, ram=0.6)
        rig.fault("speed", on=True)
        said = {row["ram"].estimates["kalman"].status.name for row in run(rig, 3.0)}
        assert any("SPEED" in name for name in said) == contradicted, said


def test_a_declared_angle_of_the_link_brings_back_an_estimate_that_was_told_a_lie():
    off = []
    for stds in ({}, {"link_angle": "0.5 deg"}):
        rig = declaring("mining-loader", "boom", **stds)
        run(rig, 1.0)
        for sensor in rig.sensors["boom"].values():
            sensor.start(rig._at["boom"] + 0.05)
        last = run(rig, 6.0, boom=0.3)[-1]["boom"]
        off.append(abs(last.estimates["kalman"].position - last.position))
    assert off[0] > 0.04
    assert off[1] < 0.5 * off[0]


def test_declared_power_and_pressures_reach_the_sensor():
    rig = declaring("press", "ram", power="1 %", pressure="1 bar")
    row = run(rig, 2.0, ram=0.4)[-1]["ram"]
    assert row.estimates["kalman"].status in STARTED
    assert abs(row.estimates["kalman"].position - row.position) < 1e-3
    seen = rig._further["ram"].sample(row.position, row.motor_speed, row.motor_torque, (row.pressure_a, row.pressure_b))
    assert seen.keys() == {"dc_power", "pressure_a", "pressure_b"}
    assert seen["pressure_a"] == pytest.approx(row.pressure_a, abs=5e5)
    assert set(rig.sensors["ram"]["kalman"].optional) == seen.keys()


def test_what_is_reported_live_is_what_is_reported_of_a_run():
    """The same signals, but for their noise."""
    rig = declaring("mining-loader", "boom", link_angle="0.5 deg", shaft="1 deg", power="1 %", pressure="1 bar")
    unit = rig.sheet["boom"]
    how = declared_report(unit, 3)
    link = replace(how.link, noise=0.0, lag=0.1)
    how = replace(how, link=link, power=replace(how.power, noise=0.0), pressure_noise=0.0)
    live = LiveFurther(unit, 0.02, 3)
    live._how, live._link = how, LiveLink(how.link, np.random.default_rng(0))
    time = 0.02 * np.arange(200)
    true = {
        "time": time, "position": 0.3 + 0.05 * np.sin(time), "motor_speed": 100.0 * np.sin(3.0 * time),
        "motor_torque": 20.0 * np.cos(time), "pressure_a": 1e7 + 1e6 * np.sin(time), "pressure_b": 2e6 + 0.0 * time,
    }  # fmt: skip
    whole = {channel.name: values for channel, values in further_report(how, true.__getitem__).items()}
    columns = (true[name] for name in ("position", "motor_speed", "motor_torque", "pressure_a", "pressure_b"))
    for k, (position, speed, torque, a, b) in enumerate(zip(*columns, strict=True)):
        said = live.sample(position, speed, torque, (a, b))
        assert said.keys() == whole.keys()
        for name, value in said.items():
            assert value == pytest.approx(whole[name][k], rel=1e-9, abs=0.021), (name, k)


def test_unknown_faults_are_refused(press):
    with pytest.raises(ValueError, match="no fault 'fire'"):
        press.fault("fire", on=True)


@pytest.mark.parametrize("name", ["mining-loader", "eha-single-rod", "eha-valve-rig"])
def test_every_kind_of_machine_follows_its_levers(name):
    rig = Rig(machine.load_machine(name))
    first = rig.step()
    last = run(rig, 2.0, **dict.fromkeys(rig.levers, 0.4))[-1]
    for unit, row in last.items():
        assert row.position > first[unit].position + 1e-3
        assert abs(row.estimates["kalman"].position - row.position) < 3e-3
        assert math.isfinite(row.pressure_a)
    assert all(math.isfinite(rig.of(unit, "pump_a.flow")) or name != "mining-loader" for unit in rig.sheet)
    back = run(rig, 3.0, **dict.fromkeys(rig.levers, -0.4))[-1]
    assert all(back[unit].position < row.position for unit, row in last.items())


def test_an_obstacle_stops_the_piston_and_lets_it_go_again(press):
    begun = press.step()["ram"].position
    press.fault("obstacle", on=True)
    held = run(press, 4.0, ram=0.5)[-1]["ram"]
    assert held.position == pytest.approx(begun + 0.02, abs=3e-3)
    assert held.pressure_a > 200e5  # it presses until a relief valve opens
    press.turn(replace(press.knobs, leak=1.1))  # another knob leaves it there
    assert run(press, 0.5)[-1]["ram"].position == pytest.approx(begun + 0.02, abs=3e-3)
    press.fault("obstacle", on=False)
    assert run(press, 4.0)[-1]["ram"].position > begun + 0.05


def test_an_obstacle_that_the_piston_has_passed_lets_it_come_back_and_then_stands(press):
    begun = press.step()["ram"].position
    press.obstruct({"ram": begun - 0.02})
    assert run(press, 1.0)[-1]["ram"].position == pytest.approx(begun, abs=2e-3), "nothing throws it back"
    assert run(press, 4.0, ram=-0.5)[-1]["ram"].position < begun - 0.03
    assert run(press, 6.0, ram=0.5)[-1]["ram"].position == pytest.approx(begun - 0.02, abs=3e-3)


def test_sensors_are_switched_on_where_the_piston_is_and_off(press):
    run(press, 1.0, ram=0.5)
    press.sense("balance", on=False)
    press.sense("unreferenced", on=True)
    row = press.step()["ram"]
    assert set(row.estimates) == {"kalman", "unreferenced"}
    assert row.estimates["unreferenced"].position == pytest.approx(row.position, abs=1e-3)
    press.refer("ram", 0.003)
    row = press.step()["ram"]
    heard, deaf = (row.estimates[kind].position - row.position for kind in ("kalman", "unreferenced"))
    assert abs(heard - deaf) > 1e-5
    with pytest.raises(ValueError, match="no sensor 'radar'"):
        press.sense("radar", on=True)


@pytest.mark.parametrize("name", list(DUTIES))
def test_a_duty_that_plays_goes_up_and_down_between_its_turning_points(press, name):
    press.turn(replace(press.knobs, load=0.25))
    press.play(name)
    seen = [row["ram"].position / 0.4 for row in run(press, 40.0)]
    assert min(seen) == pytest.approx(0.0 if name == ENDS else 0.15, abs=0.05)
    assert max(seen) == pytest.approx(1.0 if name == ENDS else 0.85, abs=0.05)
    speeds = {round(press.levers["ram"], 3)}
    press.play(None)
    assert press.levers == {"ram": 0.0}
    assert len(speeds) == 1
    if name == "paper":
        assert press.knobs.load != 0.25


@pytest.mark.parametrize("name", ["mining-loader", "eha-single-rod", "eha-valve-rig", "loader-valve-controlled"])
def test_what_flows_in_the_lines_of_a_drawing_is_what_the_parts_pass_and_is_lost_nowhere(name):
    rig = Rig(machine.load_machine(name))
    unit = next(iter(rig.levers))
    run(rig, 3.0, **{unit: 0.5 * rig.sheet[unit].lift_sign})
    sheet = drawn(rig.sheet[unit])

    def flow(part):
        return rig.of(unit, f"{part}.flow")

    shown = chains(sheet, rig.sheet[unit])
    lines = [(one, sum(factor * flow(part) for part, factor in one.flows.items())) for one in shown]
    full = max(abs(passing) for _, passing in lines)
    assert full > 1e-5
    ends = {}  # what comes to the end of lines
    for one, passing in lines:
        for at, sign in ((one.points[0], -1.0), (one.points[-1], 1.0)):
            ends.setdefault((one.node, at), []).append(sign * passing)
    placed_ports = [(placed, port, node) for placed in sheet.placed for port, node in placed.ends.items()]
    ports = {(node, placed.symbol.ports[port]): (placed, port) for placed, port, node in placed_ports}
    for place, comes in ends.items():
        if place not in ports:
            assert len(comes) == 1 or abs(sum(comes)) < 0.02 * full, place  # a line that ends at its node's name
        elif ports[place][1] in ("inlet", "outlet"):
            placed, port = ports[place]
            assert sum(comes) == pytest.approx(flow(placed.name) * (1.0 if port == "inlet" else -1.0), abs=0.02 * full)
        elif ports[place][1] in ("node_a", "node_b"):  # the piston extends, so oil goes in at A and comes out at B
            cylinder = rig.sheet[unit].cylinder
            area = cylinder.area_a if ports[place][1] == "node_a" else -cylinder.area_b
            assert sum(comes) == pytest.approx(area * rig.of(unit, "velocity"), abs=0.02 * full)


# -- where the energy goes


def test_the_books_of_a_run_that_is_lived_are_those_of_its_audit():
    unit = ramsight.build("press")
    duty = ramsight.lift_lower(unit, "300 kN")
    audited = ramsight.simulate(unit, duty=duty).attrs
    live = LiveUnit(unit, duty.start_position, float(duty.load(0.0)), float(duty.oil_temperature(0.0)))
    live.begin_account()
    for k in range(1, round(duty.duration / 0.02) + 1):
        live.advance(float(duty.motor_speed(0.02 * k)), float(duty.load(0.02 * k)))
    account = live.accounts["ram"]
    known = {"shaft_given": account.given, "shaft_taken": account.taken, "load": account.lifted - account.lowered}
    known |= account.losses | account.works | {f"stored_{name}": value for name, value in account.stored.items()}
    for name, energy in known.items():
        assert energy == pytest.approx(audited[f"energy.{name}"], rel=1e-3, abs=1.0), name
    assert abs(account.missing) < 1e-5 * account.given


@pytest.mark.parametrize("name", ["mining-loader", "forklift-mast", "eha-valve-rig"])
def test_every_joule_that_came_in_is_somewhere(name):
    rig = Rig(machine.load_machine(name))
    unit = next(iter(rig.levers))
    lift = rig.sheet[unit].lift_sign
    for lever in (0.5 * lift, -0.5 * lift):
        run(rig, 3.0, **{unit: lever})
    found = flows(rig.sheet[unit], rig.accounts[unit])
    came, went = sum(found["in"].values()), sum(found["out"].values())
    assert came == pytest.approx(went, abs=1e-3 * came + 0.01)
    assert found["in"]["drive"] > 0.0
    assert found["out"]["pumps: friction"] > 0.0
    if found["in"]["load comes down"] > 0.1:
        given_back = found["out"]["back to the drive"] / found["in"]["load comes down"]
        assert found["regenerated"] == pytest.approx(given_back, abs=0.01)
    rig.begin_account()
    assert flows(rig.sheet[unit], rig.accounts[unit])["in"]["drive"] == 0.0


# -- half requests


@pytest.fixture
def served_with_patience(monkeypatch):
    """A server behind the guard that waits for half a second; gives its port."""
    uvicorn = pytest.importorskip("uvicorn")
    from ramsight.studio import web_server

    monkeypatch.setattr(web_server, "PATIENCE", 0.5)
    monkeypatch.setattr(web_server, "BODY_WITHIN", 0.5)

    async def app(scope, receive, send):
        while scope["type"] == "http" and (await receive()).get("more_body"):
            pass
        await asyncio.sleep(0.8)  # an answer may take longer than a request
        await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"2")]})
        await send({"type": "http.response.body", "body": b"ok"})

    closing_one = {"http": web_server.ClosingProtocol, "log_level": "critical", "lifespan": "off"}
    server = uvicorn.Server(uvicorn.Config(Guard(app, None, 100), port=0, **closing_one))
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    while not server.started:
        time.sleep(0.01)
    yield server.servers[0].sockets[0].getsockname()[1]
    server.should_exit = True
    thread.join()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sent", "answer"),
    [
        (b"", b""),
        (b"GET / HTTP/1.1\r\nHost: localhost\r\n", b""),
        (b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9\r\n\r\nhalf", b" 408 "),
        (b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 4\r\n\r\nfull", b" 200 "),
        (b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n", b" 200 "),
    ],
)
def test_a_half_request_ends_and_a_whole_one_is_answered(served_with_patience, sent, answer):
    with socket.create_connection(("127.0.0.1", served_with_patience), timeout=5.0) as client:
        client.sendall(sent)
        begin = time.monotonic()
        said = client.recv(1000)
        assert answer in said
        assert bool(said) == bool(answer)
        assert time.monotonic() - begin < 4.0


# -- the guard


def asked(guard, headers, *, kind="http", query="", path="/", body=b""):
    """Ask a guard; what it answers, and whether the app was reached."""
    sent = []

    async def receive():
        return {"type": "http.request" if kind == "http" else "websocket.connect", "body": body}

    async def send(message):
        sent.append(message)

    coded = [(name.encode(), value.encode()) for name, value in headers.items()]
    scope = {"type": kind, "path": path, "query_string": query.encode(), "headers": coded}
    asyncio.run(guard(scope, receive, send))
    return sent


def test_as_many_visitors_come_as_there_is_room_for():
    room = Visitors(2)
    assert [room.come() for _ in range(4)] == [True, True, False, False]
    assert "(2)" in room.full
    room.go()
    assert [room.come(), room.come()] == [True, False]


async def served(scope, receive, send):
    await receive()
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": b"inside"})


HERE = {"host": "127.0.0.1:8080"}


def status_of(sent):
    return sent[0].get("status", sent[0].get("code"))


def test_this_machine_is_served_and_no_page_may_frame_it():
    sent = asked(Guard(served, None, 100), HERE)
    assert status_of(sent) == 200
    assert (b"x-frame-options", b"DENY") in sent[0]["headers"]
    policy = dict(sent[0]["headers"])[b"content-security-policy"].decode()
    assert "default-src 'self'" in policy
    assert "object-src 'none'" in policy
    assert "http" not in policy, "nothing comes from elsewhere"
    assert status_of(asked(Guard(served, None, 100), {"host": "[::1]:8080"})) == 200


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"host": "evil.example:8080"}, 421),  # another site's name that leads here
        ({}, 421),
        ({**HERE, "origin": "http://evil.example"}, 403),
        ({**HERE, "origin": "null"}, 403),
        ({**HERE, "sec-fetch-site": "cross-site", "sec-fetch-mode": "no-cors"}, 403),
        ({**HERE, "sec-fetch-site": "same-site", "sec-fetch-mode": "no-cors"}, 403),  # another port of this machine
        *(
            ({**HERE, "sec-fetch-site": site, "sec-fetch-mode": "navigate", "sec-fetch-dest": dest}, 403)
            for site in ("cross-site", "same-site")
            for dest in ("iframe", "frame", "embed", "object", "empty", "")
        ),
        ({**HERE, "sec-fetch-site": "cross-site", "sec-fetch-mode": "navigate"}, 403),
        ({**HERE, "sec-fetch-site": "cross-site", "sec-fetch-mode": "navigate", "sec-fetch-dest": "document"}, 200),
        ({**HERE, "sec-fetch-site": "same-origin", "sec-fetch-mode": "cors", "sec-fetch-dest": "empty"}, 200),
        ({**HERE, "sec-fetch-site": "none", "sec-fetch-mode": "navigate", "sec-fetch-dest": "document"}, 200),
        ({"host": "[::1"}, 421),
        ({"host": "evil@127.0.0.1:8080"}, 421),
        ({"host": "[nonsense]"}, 421),
        ({**HERE, "origin": "http://["}, 403),
        ({**HERE, "origin": "http://[::1"}, 403),
        ({**HERE, "content-length": "101"}, 413),
        ({**HERE, "content-length": "\u00b2"}, 413),
        ({**HERE, "content-length": "9" * 5000}, 413),
        ({**HERE, "content-length": "much"}, 413),
    ],
)
def test_strange_requests_are_refused(headers, status):
    assert status_of(asked(Guard(served, None, 100), headers)) == status


def test_sockets_of_other_sites_are_refused():
    sent = asked(Guard(served, None, 100), {**HERE, "origin": "http://evil.example"}, kind="websocket")
    assert status_of(sent) == 1008


def test_a_body_that_says_nothing_of_its_length_is_counted():
    assert status_of(asked(Guard(served, None, 100), HERE, body=b"x" * 101)) == 413
    assert status_of(asked(Guard(served, None, 100), HERE, body=b"x" * 100)) == 200


def test_elsewhere_the_token_is_needed_once_and_kept_in_a_cookie_that_scripts_do_not_see():
    guard, there = Guard(served, "secret", 100), {"host": "10.0.0.5:8080"}
    assert status_of(asked(guard, there)) == 401
    assert status_of(asked(guard, there, query="token=wrong")) == 401
    assert status_of(asked(guard, there, kind="websocket")) == 1008
    sent = asked(guard, there, query="token=secret")
    assert status_of(sent) == 303
    cookie = dict(sent[0]["headers"])[b"set-cookie"].decode()
    assert "HttpOnly" in cookie
    assert "SameSite=Strict" in cookie
    assert status_of(asked(guard, {**there, "cookie": cookie.split(";")[0]})) == 200
    assert status_of(asked(guard, {**there, "cookie": "ramsight-token=wrong"})) == 401
    for odd in ("a[]=1; ramsight-token=wrong", "=;;=", "ramsight-token", '"', "\x00=1"):
        assert status_of(asked(guard, {**there, "cookie": odd})) == 401


# -- descriptions


@pytest.mark.parametrize("name", [one.name for one in machine.catalogue.entries() if one.kind == "machine"])
def test_an_edit_changes_one_value_and_its_source_and_nothing_else(name):
    text = draft.text_of(machine.load_machine(name))
    before = machine.loads(text)
    path = f"units.{next(iter(before.units))}.cylinder.stroke"
    after = draft.read(draft.edited(text, before, path, "1.25 m"))
    pairs = list(zip(machine.walk(before), machine.walk(after), strict=True))
    assert [new.path for old, new in pairs if old.value != new.value] == [path]
    assert path not in after.sources
    assert {**after.sources} == {key: words for key, words in before.sources.items() if key != path}
    assert before.tolerances == after.tolerances


def shown(text):
    return {row.path: row for row in draft.rows(text, machine.load_machine("mining-loader"))}


def test_a_value_that_is_taken_away_is_the_catalogue_s_again():
    boom = machine.load_machine("mining-loader")
    path = "units.boom.pump_a.nominal_speed"
    mine = draft.edited(draft.text_of(boom), boom, path, "1400 rpm", "measured")
    assert (shown(mine)[path].text, shown(mine)[path].source) == ("1400 rpm", "measured")
    back = draft.edited(mine, boom, path, "")
    assert shown(back)[path].text == ""
    assert shown(back)[path].usual == "1450 rpm"
    assert draft.read(back).units == boom.units


def test_a_source_alone_writes_the_value_that_holds():
    boom = machine.load_machine("mining-loader")
    path = "units.boom.oil.density"
    text = draft.edited(draft.text_of(boom), boom, path, source='a "label"')
    assert draft.read(text).source_of(path) == 'a "label"'
    assert draft.read(text).units == boom.units


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("cylinder.bore", "3 kg", "expected a length"), ("cylinder.number", "1.5", "whole number"),
        ("pump_a.model", "PGI", "unknown pump"), ("load_direction", "up", "unknown choice"),
        ("cylinder.stroke", "", "is missing"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_where_it_is_and_stays_as_it_was_written(key, value, words):
    boom = machine.load_machine("mining-loader")
    path = f"units.boom.{key}"
    text = draft.edited(draft.text_of(boom), boom, path, value)
    said = draft.read(text)
    assert isinstance(said, draft.Problem)
    assert said.path == path
    assert words in said.words
    assert shown(text)[path].text == value


def test_what_a_sensor_can_be_told_of_further_signals_is_in_the_form():
    there = shown(draft.text_of(machine.load_machine("mining-loader")))
    told = {
        "inertia": ("std",), "motor_temperature": ("std", "loss", "reference"), "link_angle": ("std", "offset", "lag"),
        "shaft": ("std", "speed"), "power": ("std", "gain"), "pressure": ("std", "lag"),
    }  # fmt: skip
    for path in (f"{table}.{key}" for table, keys in told.items() for key in keys):
        row = there[f"units.boom.assumptions.{path}"]
        assert row.usual
        assert row.meaning
        assert row.range


def test_what_follows_is_what_the_verb_says(tmp_path):
    said = CliRunner().invoke(app, ["check", "press"]).stdout
    words = [" ".join(line.split()) for line in draft.follows(machine.load_machine("press")).splitlines()]
    assert words == [" ".join(line.split()) for line in said.splitlines()]


# -- logs


@pytest.mark.slow
def test_a_log_is_proposed_a_map_and_tracked_with_the_figures_of_the_verb(tmp_path):
    log, truth = TRACES / "boom_441kN_40C.csv.gz", TRACES / "boom_441kN_40C_truth.csv.gz"
    found = told(propose, str(log))["proposed"]
    assert {one["role"] for one in found["channels"]} >= {"speed", "torque", "temperature"}
    copied = tmp_path / log.name
    copied.write_bytes(log.read_bytes())
    loader = machine.load_machine("mining-loader")
    done = told(track, Asked(loader, "boom", str(copied), str(truth), "100 mm"))
    words = ["track", "mining-loader", str(log), "--unit", "boom", "--start", "100 mm", "--truth", str(truth)]
    said = CliRunner().invoke(app, [*words, "--out", str(tmp_path / "verb.csv")])
    assert said.exit_code == 0
    assert done["tracked"]["summary"].splitlines() == [line for line in said.stdout.splitlines()[:-1] if line]
    assert (tmp_path / "track.csv").read_bytes() == (tmp_path / "verb.csv").read_bytes()
    assert done["drawn"] == ["track.png", "track.svg"]
    assert (tmp_path / "track.png").read_bytes()[1:4] == b"PNG"
    view = kept(tmp_path / "view")
    assert len(view["time"]) == len(view["true"]) == done["tracked"]["samples"] > 1000
    mapped = told(track, Asked(loader, "boom", str(copied), str(truth), "100 mm", "kalman", found["map"]))
    assert "error against the truth" in mapped["tracked"]["summary"]
    assert done["progress"] == pytest.approx(1.0, abs=0.05)


@pytest.mark.slow
def test_a_log_is_looked_back_at(tmp_path):
    copied = tmp_path / "bucket_hot.csv.gz"
    copied.write_bytes((TRACES / "unknown" / copied.name).read_bytes())
    asked = Asked(machine.load_machine("mining-loader"), "bucket", str(copied))
    live = told(track, asked)["tracked"]["summary"]
    done = told(track, replace(asked, hindsight=True))
    assert "position unknown at first" in live
    assert "position 399" in done["tracked"]["summary"]
    assert "live_position_m" in (tmp_path / "track.csv").read_text().splitlines()[0]
    refused = told(track, replace(asked, hindsight=True, sensor="balance", start="0.4 m"))
    assert "has no hypotheses to look back at" in refused["error"]


def told(work, asked):
    """What some work said last of each thing."""
    found = {}
    work(found.__setitem__, asked)
    return found


@pytest.fixture(scope="module")
def commissioned(tmp_path_factory):
    """A rehearsed commissioning: its log and true position."""
    folder = tmp_path_factory.mktemp("commissioned")
    words = ["simulate", "mining-loader", "--unit", "boom", "--duty", "commissioning", "--log", str(folder / "log.csv")]
    assert CliRunner().invoke(app, [*words, "--truth", str(folder / "truth.csv")]).exit_code == 0
    return folder / "log.csv", folder / "truth.csv"


@pytest.mark.slow
def test_references_leak_test_and_report_are_those_of_the_verbs(commissioned):
    log, truth = (str(one) for one in commissioned)
    asked = Asked(machine.load_machine("mining-loader"), "boom", log, truth)
    rows = told(track, asked)["tracked"]["references"]
    assert {row["what"] for row in rows} == {"end stop, retracted", "end stop, extended"}
    assert len(rows) == 4
    assert all(abs(row["error [mm]"]) < 5.0 for row in rows)
    blind, of = replace(asked, truth=None), ["mining-loader", log, "--unit", "boom"]
    for work, what, verb in ((find_leak, "leak test", "leak-test"), (judge, "report", "commission")):
        assert told(work, blind)[what].strip() == CliRunner().invoke(app, [verb, *of]).stdout.strip()
    assert "Mining loader" in (blind.folder / "report.html").read_text()
    assert "need the true position" in told(find_factors, replace(asked, truth=None))["error"]


def test_factors_of_a_log_are_found_and_its_report_with_a_truth_is_that_of_the_verb(tmp_path):
    log, truth = (str(shutil.copy(TRACES / f"boom_441kN_40C{end}.csv.gz", tmp_path)) for end in ("", "_truth"))
    asked = Asked(machine.load_machine("mining-loader"), "boom", log, truth)
    assert "leak factor" in told(find_factors, asked)["factors"]
    verb = ["commission", "mining-loader", log, "--unit", "boom", "--truth", truth]
    said = told(judge, asked)["report"].strip()
    assert said == CliRunner().invoke(app, verb).stdout.strip()
    assert said != told(judge, replace(asked, truth=None))["report"].strip()


def test_a_log_without_a_leak_test_says_so():
    log = TRACES / "boom_441kN_40C.csv.gz"
    assert "no leak test" in told(find_leak, Asked(machine.load_machine("mining-loader"), "boom", str(log)))["error"]


def test_references_of_the_log_are_found():
    time = np.arange(100) * 0.02
    reference = np.full(100, np.nan)
    reference[[20, 21, 22, 60]] = 0.25
    log = xr.Dataset({"reference": ("time", reference)}, coords={"time": time})
    found = xr.Dataset({"position": ("time", np.full(100, 0.2))}, coords={"time": time})
    rows = references(log, found, None, 0.7)
    found = [(row["time [s]"], row["what"], row["position [mm]"]) for row in rows]
    assert found == [(0.4, "of the log", 250.0), (1.2, "of the log", 250.0)]


# -- long tracks


def test_thinning_keeps_every_extreme_and_looking_closer_shows_the_samples():
    time = np.arange(360_000) * 0.01
    wave = np.sin(time)
    wave[123_456], wave[200_000:200_100] = 7.0, np.nan
    columns = {"time": time, "position": wave, "low": wave - 1.0, "high": wave + 1.0}
    seen = thinned(columns, 500)
    assert len(seen["time"]) == 1000
    assert all(after > before for before, after in itertools.pairwise(seen["time"]))
    assert max(value for value in seen["position"] if value is not None) == 7.0
    assert max(value for value in seen["high"] if value is not None) == 8.0
    assert min(value for value in seen["low"] if value is not None) == pytest.approx(-2.0, abs=1e-3)
    close = thinned(columns, 500, 1234.5, 1235.0)
    assert len(close["time"]) < 60
    assert 7.0 in close["position"]
    assert thinned(columns, 500, 2000.2, 2000.5)["position"][10] is None


def test_ten_hours_at_100_hz_are_thinned_in_a_moment(tmp_path):
    at = np.arange(3_600_000) * 0.01
    keep(tmp_path / "view", {"time": at, "position": np.sin(at).astype(np.float32)})
    columns = kept(tmp_path / "view")
    begun = time.process_time()
    thinned(columns, 1500)
    assert time.process_time() - begun < 1.0


def test_a_wrong_file_says_why_and_names_no_folder(tmp_path):
    file = tmp_path / "day.csv"
    file.write_text("time_s,motor_speed_rpm\n0.0,12\n0.1,x\n")
    said = told(track, Asked(machine.load_machine("press"), "ram", str(file)))["error"]
    assert said.startswith("day.csv: ")
    assert "motor_torque_nm" in said
    picture = tmp_path / "a.png"
    picture.write_bytes(b"\x89PNG\r\n")
    assert "unknown" in told(propose, str(picture))["error"]
    damaged = tmp_path / "b.csv.gz"
    damaged.write_bytes(gzip.compress(b"time_s\n" * 1000)[:40])
    (said,) = told(propose, str(damaged))["warnings"]
    assert said.startswith("b.csv.gz: only what stands before this is listed")


def test_a_truth_that_cannot_be_read_is_named_without_the_visitor_s_folder(tmp_path):
    for role in ("log", "truth"):
        (tmp_path / role).mkdir()
    log, truth = tmp_path / "log" / "day.csv", tmp_path / "truth" / "true.csv"
    log.write_text(RESTING)
    truth.write_text("time_s\n0.0\n")
    said = told(track, Asked(machine.load_machine("press"), "ram", str(log), str(truth)))["error"]
    assert "true.csv" in said
    assert str(tmp_path) not in said


RESTING = "time_s,motor_speed_rpm,motor_torque_nm,oil_temperature_c\n" + "".join(
    f"{0.02 * k:.2f},0,{5.0 + 0.1 * (k % 3)},40\n" for k in range(60)
)


def test_a_log_without_a_position_says_what_to_do_and_one_with_a_start_does_not(tmp_path):
    log = tmp_path / "day.csv"
    log.write_text(RESTING)
    lost, known = (
        told(track, Asked(machine.load_machine("press"), "ram", str(log), None, start)) for start in ("", "120 mm")
    )
    assert lost["tracked"]["advice"] == NOWHERE
    assert known["tracked"]["advice"] == ""


def test_a_start_outside_the_stroke_is_refused():
    log = str(TRACES / "boom_441kN_40C.csv.gz")
    found = told(track, Asked(machine.load_machine("mining-loader"), "boom", log, None, "9 m"))
    assert "allowed" in found["error"]


# -- the process


@pytest.mark.slow
def test_a_session_runs_in_a_process_of_its_own_and_ends_with_it():
    with closing(Session("press")) as session:
        wait_for(lambda: session.about is not None or session.ended)
        assert session.about is not None, session.ended
        assert session.about["units"] == ["ram"]
        session.say("lever", "ram", 2.0)
        kept = []
        wait_for(lambda: kept.extend(session.frames()) or len(kept) > 30)
        assert kept[-1].columns["ram"]["position"][-1] > kept[0].columns["ram"]["position"][0] + 5.0
        assert set(kept[-1].status["ram"]) == {"kalman", "balance"}
        assert kept[-1].circuit["ram"]["pressure_port_a"] > 10.0
        session.say("factor", 20)
        wait_for(lambda: any(frame.factor > 5.0 for frame in session.frames()))
    assert not session.alive
    session.say("lever", "ram", 0.0)  # too late, and no error


@pytest.mark.slow
def test_marks_of_frames_that_a_slow_page_drops_come_with_the_next_ones():
    with closing(Session("press")) as session:
        wait_for(lambda: session.about is not None or session.ended)
        for _ in range(3):
            for on in (True, False):
                dropped = session.dropped
                session.say("fault", "torque", on)
                wait_for(lambda then=dropped: session.dropped > then + 3)  # nobody takes a frame meanwhile
        frames = session.frames()
        assert len(frames) <= 4
        # Each mark comes once. What waited longest comes last; the page sorts them by time.
        words = [words for _, words, _ in sorted(mark for frame in frames for mark in frame.marks)]
        assert words == [FAULTS["torque"], "torque frozen: over"] * 3


@pytest.mark.posix
@pytest.mark.slow
@pytest.mark.parametrize("factor", [1, 0])
def test_a_process_that_stands_is_told_within_three_seconds_and_blocks_nobody(factor):
    assert 2.0 * _ALIVE <= STANDS < 3.0
    with closing(Session("press")) as session:
        wait_for(lambda: session.about is not None)
        session.say("factor", factor)
        begun = time.monotonic()
        wait_for(lambda: session._heard > begun + 1.2 * STANDS)  # it speaks on, though nothing moves
        os.kill(session.process, signal.SIGSTOP)
        wait_for(lambda: session.stands)
        for _ in range(2000):
            session.say("lever", "ram", 0.5)  # more than a pipe holds
        os.kill(session.process, signal.SIGCONT)
        wait_for(lambda: not session.stands)
        os.kill(session.process, signal.SIGSTOP)
    assert not session.alive, "one that stands is ended, too"


@pytest.mark.slow
def test_a_machine_that_is_not_there_is_said_and_leaves_no_process():
    session = Session("nothing")
    wait_for(lambda: session.ended)
    assert "nothing" in session.ended
    wait_for(lambda: not session.alive)
    session.close()


def test_the_verb_says_what_it_needs(monkeypatch):
    said = CliRunner().invoke(app, ["studio", "nothing"])
    assert "nothing" in str(said.exception)
    monkeypatch.setitem(__import__("sys").modules, "nicegui", None)
    said = CliRunner().invoke(app, ["studio", "press"])
    assert "ramsight[studio]" in str(said.exception)


def test_every_fault_has_words():
    assert all(words for words in FAULTS.values())


def test_a_picture_begins_with_the_sample_before_its_first_time():
    columns = {"time": np.arange(10.0), "position": np.arange(10.0) / 10.0}
    assert thinned(columns, 100, 4.5, 6.5)["time"] == [4.0, 5.0, 6.0, 7.0]
    assert thinned(columns, 100)["time"] == columns["time"].tolist()
