"""The mining loader as machines in service are: the bench's but for seven values; a plant and a sensor of it work."""

from dataclasses import replace

import numpy as np
import pytest

import ramsight
from ramsight import machine
from ramsight.plant.balance import balance

from .command import at_once

BENCH, SERVICE = machine.load_machine("mining-loader"), machine.load_machine("mining-loader-in-service")
HONEST = {
    "cylinder.stribeck_velocity": (5e-3, 30e-3), "cylinder.pressure_friction": (0.02, 0.05),
    "anticavitation_valve.cracking_pressure": (0.2e5, 0.5e5), "safety_valve.opening_time": (20e-3, 80e-3),
    "tank.pressure": (3e5, 5e5), "oil.viscosity_40c": (28.8e-6, 35.2e-6),
}  # fmt: skip
"""What is spread, and from where to where [SI]."""


def test_all_but_the_honest_values_is_the_benchs():
    """Whoever changes the bench's machine changes this one too; what differs is what is listed here."""
    for name in ("boom", "bucket"):
        ours = {value.path: value.value for value in machine.walk(SERVICE.unit(name))}
        theirs = {value.path: value.value for value in machine.walk(BENCH.unit(name))}
        other = {path for path in ours if ours[path] != theirs.get(path)}
        assert other == {*HONEST, "oil.min_temperature"} - {"oil.viscosity_40c", "tank.pressure"}, "those only spread"
        assert theirs.keys() == ours.keys()
    assert SERVICE.linkage == BENCH.linkage


def test_the_bench_has_the_guesses_that_logs_were_recorded_with():
    for unit in BENCH.units.values():
        assert (unit.cylinder.stribeck_velocity, unit.cylinder.pressure_friction) == (0.3e-3, 0.0)
        assert (unit.safety_valve.opening_time, unit.anticavitation_valve.cracking_pressure) == (0.0, 0.0)


def test_each_of_them_has_a_spread_and_a_source():
    spreads = SERVICE.tolerances
    assert len(spreads) == 2 * len(HONEST)
    for path, ends in HONEST.items():
        for name in ("boom", "bucket"):
            assert spreads[f"units.{name}.{path}"].ends == pytest.approx(ends)
            assert SERVICE.source_of(f"units.{name}.{path}")


def test_oil_that_no_pump_draws_is_refused():
    with pytest.raises(ramsight.DescriptionError, match="allowed: -10 degC"):
        ramsight.simulate(SERVICE, "lift-lower", unit="boom", load="258 kN", oil_temperature="-20 degC")


@pytest.fixture(scope="module")
def worked():
    boom = ramsight.build(SERVICE, "boom")
    return boom, ramsight.simulate(boom, "lift-lower", load="258 kN", visits=3, cycles=2)


def test_its_energy_and_its_oil_close(worked):
    _, run = worked
    assert abs(run.attrs["energy_residual"]) < 1e-5
    assert abs(run.attrs["volume_residual"]) < 1e-6
    assert run.attrs["energy.cylinder.friction"] > 0.0


def test_its_own_sensor_follows_it(worked):
    boom, run = worked
    sensor = ramsight.sensor_for(boom)
    sensor.start(float(run["position"][0]))
    error = np.abs(sensor.track(ramsight.drive_report(run))["position"].values - run["position"].values)
    assert np.percentile(error, 95.0) < 4e-3


def test_a_share_of_the_force_is_friction_either_way():
    """Lifting takes more than lowering the same load by twice the seals' share of it, as described."""
    boom = ramsight.build(SERVICE, "boom")
    plain = replace(boom, cylinder=replace(boom.cylinder, pressure_friction=None))
    apart = []
    for unit in (boom, plain):
        solved, load = balance(unit), 300e3
        p, z0 = solved.parameters_at(list(solved.values), 313.15), solved.at_rest(0.3, load)
        forces = []
        for way in (1.0, -1.0):
            z = np.array(z0)
            for _ in range(80):
                z = np.array(solved.step(z, way * 100.0, way * 100.0, 0.0, load, p, 0.02).z)[:, 0]
            forces.append(float(solved.force(z)))
        apart.append(forces[0] - forces[1])
    assert apart[0] - apart[1] == pytest.approx(2.0 * 0.035 * 300e3, rel=0.02)


@pytest.mark.slow
def test_identify_finds_it_to_be_its_description():
    """Seals that the oil presses on are in what lifting takes more than lowering, and are not the pumps'.

    Of the bucket the verb finds it, below.
    """
    made = ramsight.build(SERVICE, "boom")
    run = ramsight.simulate(made, "commissioning")
    found = ramsight.identify(made, ramsight.drive_report(run), run)
    for name, estimate in found.factors.items():
        true = 0.0 if name in ("orifice", "efficiency") else 1.0
        assert not estimate.identified or estimate.low <= true <= estimate.high, name
    assert found.factors["stiffness"].identified
    assert found.factors["efficiency"].value == pytest.approx(0.0, abs=0.003)


@pytest.mark.slow
def test_every_verb_of_a_machine_works_on_it(tmp_path):
    name, unit = "mining-loader-in-service", "bucket"
    files = ("--log", "log.csv.gz", "--truth", "truth.csv.gz")
    verbs = (
        ("check", name),
        ("simulate", name, "--unit", unit, "--duty", "commissioning", *files),
        ("leak-test", name, "log.csv.gz", "--unit", unit),
        ("identify", name, "log.csv.gz", "--unit", unit, "--truth", "truth.csv.gz", "--out", "tuned.toml"),
        ("track", name, "log.csv.gz", "--unit", unit, "--truth", "truth.csv.gz"),
        ("calibrate", name, "--unit", unit, "--loads", 8, "--out", "table.sensor"),
        ("export", "c", name, "--unit", unit, "--out", "c"),
        ("datasheet", name, "--unit", unit, "--machines", 8, "--budget", 0, "--out", "sheet"),
    )
    for verb in verbs:
        done = at_once(*verb, cwd=tmp_path)
        assert done.returncode == 0, (verb, done.stdout, done.stderr)
    assert "pressure_friction" in (tmp_path / "tuned.toml").read_text()
    found = machine.load_machine(tmp_path / "tuned.toml").unit(unit).pump_a
    described = SERVICE.unit(unit).pump_a
    assert found.hydromechanical_efficiency == pytest.approx(described.hydromechanical_efficiency, abs=0.003)
    assert 1.0 - found.volumetric_efficiency == pytest.approx(1.0 - described.volumetric_efficiency, rel=0.03)
    assert found.displacement == pytest.approx(described.displacement, rel=2e-3)
