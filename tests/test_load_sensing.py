"""A load-sensing pump and a metering valve, and the boom behind them: what direct drive is compared with."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from ramsight import machine
from ramsight.api.abilities import abilities
from ramsight.duty import simulate
from ramsight.duty.profile import Duty, Profile, constant
from ramsight.plant.build import build
from ramsight.plant.load_sensing import LoadSensingPump, MeteringValve
from reproduction.baseline import saves
from reproduction.bench import benches
from reproduction.chapter import Verdict
from reproduction.valve_controlled import PLACES, account, metered_run, valve_controlled

UNIT = build(machine.load_machine("loader-valve-controlled").unit("boom"), "boom")
PUMP = next(part for part in UNIT.parts() if isinstance(part, LoadSensingPump))
VALVE = next(part for part in UNIT.parts() if isinstance(part, MeteringValve))
SPEED = 1500.0 * np.pi / 30.0
BAR = 1e5


def held(command, load, end=4.0, start=0.3):
    """A second in the middle, then a command."""
    commands = {"valve": Profile([0.0, 1.0], [0.0, command])}
    duty = Duty(Profile([0.0, end], [SPEED, SPEED]), constant(load), constant(313.15), start, commands=commands)
    return simulate(UNIT, duty)


@pytest.mark.parametrize(
    ("outlet", "inlet", "sensed", "share"),
    [(100, 4, 81, 0.25), (100, 4, 90, 1.0), (24.5, 4, 4, 0.0), (203, 4, 195, 0.25), (204, 4, 300, 0.0), (4, 4, 4, 1.0)],
)
def test_the_pump_asks_for_what_is_missing_to_margin_or_cut_off(outlet, inlet, sensed, share):
    found = float(PUMP.asked(ca.DM(outlet * BAR), ca.DM(inlet * BAR), ca.DM(sensed * BAR)))
    assert found == pytest.approx(share, abs=1e-9)


def test_the_sensing_bores_open_before_the_edges_pass_much():
    opening = {name: float(share) for name, _, _, share, _ in VALVE.edges(ca.DM(VALVE.overlap + 0.9 * 0.05))}
    assert opening["sense_a"] == pytest.approx(1.0)
    assert opening["pa"] == opening["bt"] == pytest.approx(0.05)
    assert opening["sense_b"] == opening["pb"] == 0.0


@pytest.mark.parametrize("load", [129e3, 441e3])
def test_flow_goes_with_the_opening_whatever_the_load(load):
    """Q = K x sqrt(dp) with dp the pump's margin, less its droop and the loss of the sensing line."""
    run = held(0.4, load)
    opening = (0.4 - VALVE.overlap) / (1.0 - VALVE.overlap)
    over = float(run["pressure_pump_line"][-1] - run["pressure_port_a"][-1])
    assert PUMP.margin - PUMP.band - 4.0 * BAR < over < PUMP.margin
    expected = VALVE.conductance * opening * np.sqrt(over) - float(run["bleed_flow"][-1])
    assert float(run["velocity"][-1]) * UNIT.cylinder.area_a == pytest.approx(expected, rel=2e-3)
    if load > 400e3:
        light = held(0.4, 129e3)
        assert float(run["velocity"][-1]) == pytest.approx(float(light["velocity"][-1]), rel=0.05)


def test_the_pump_idles_at_its_margin_and_stops_at_its_cut_off():
    run = held(0.0, 129e3, end=2.0)
    over = float(run["pressure_pump_line"][-1] - run["pressure_load_line"][-1])
    assert PUMP.margin - PUMP.band < over < PUMP.margin
    assert 0.0 < float(run["pump_swivel"][-1]) < 0.02  # it makes up for its own leakage
    assert abs(run.attrs["energy_residual"]) < 1e-6
    stalled = held(0.3, 129e3, end=6.0, start=0.69)  # against the stop
    above = float(stalled["pressure_pump_line"][-1]) - UNIT.tank_pressure
    assert PUMP.cut_off - PUMP.band < above < PUMP.cut_off


@pytest.fixture(scope="module")
def boom():
    return benches()["boom"]


def test_the_baseline_goes_the_direct_drives_way_and_its_energy_is_accounted_for(boom):
    direct = simulate(boom.unit, boom.closed_cycle(258e3, 0.2, 0.6))
    run = metered_run(boom, 258e3, 0.2, 0.6)
    assert run["position"].values.max() == pytest.approx(direct["position"].values.max(), abs=2e-4)
    assert float(run["position"][-1]) == pytest.approx(float(run["position"][0]), abs=2e-4)
    for way in (max, min):
        assert way(run["velocity"].values[100:]) == pytest.approx(way(direct["velocity"].values[100:]), rel=0.06)
    found = account(run)
    assert found["gets_back"] == 0.0
    assert sum(found[place] for place in PLACES) == pytest.approx(found["net"], rel=5e-3)  # the rest is in the oil
    assert found["directional valve"] > found["lifted"]  # what lowering frees goes over its edge, and the margin
    assert account(direct)["directional valve"] == 0.0


def test_the_baseline_takes_over_what_was_chosen_for_the_boom(boom):
    bench = replace(boom, unit=replace(boom.unit, tank_pressure=2e5))
    unit = valve_controlled(bench)
    assert unit.tank_pressure == 2e5
    assert unit.cylinder == boom.unit.cylinder
    assert {part.name for part in unit.parts()} == {part.name for part in UNIT.parts()}


def test_the_verdict_follows_the_energies():
    cheap, dear = (
        {
            "net": net, "battery_gives": 100.0, "gets_back": 0.0, "shaft_at_rest": 1.0, "directional valve": 1.0,
            "pumps": 1.0,
        }
        for net in (50.0, 100.0)
    )  # fmt: skip
    assert saves({"high": {"direct drive": cheap, "valve-controlled": dear}}).verdict is Verdict.REPRODUCED
    assert saves({"high": {"direct drive": dear, "valve-controlled": cheap}}).verdict is Verdict.CONTRADICTED
    assert saves({}).verdict is Verdict.NOT_TESTABLE


def test_what_a_metered_unit_cannot_have_is_said():
    found = {one.what: one.can for one in abilities(UNIT)}
    assert found["sensors"]
    assert not any(found[what] for what in ("leak test", "identify", "control"))
