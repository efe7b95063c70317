"""Oil does not pull: it tears, and what opens is filled by vapour and air. A node without any oil ends a run."""

import re

import casadi as ca
import numpy as np
import pytest

import ramsight
from ramsight.deploy.fmu_model import plant_model
from ramsight.duty.audit import refuse_dry
from ramsight.engine.equation import OdeModel, State
from ramsight.plant.build import build
from ramsight.plant.machine_tables import check_reservoir, machine_summary
from ramsight.plant.oil import DRY, held_share, torn_capacity, torn_volume
from ramsight.plant.unit import circuit
from tests.command import as_command, at_once

RESERVOIR = "units.axis.parts.reservoir"
CLOSED = ("eha-single-rod", "eha-test-bench", "eha-valve-rig")


def changed(machine, **values):
    return ramsight.load_machine(machine).replace({f"{RESERVOIR}.{key}": value for key, value in values.items()})


def pressures(run):
    return {name: run[name].values for name in run if str(name).startswith("pressure_")}


@pytest.mark.parametrize(
    ("state", "opened"), [(1e5, 0.0), (0.0, 0.0), (0.25 * DRY, 0.25), (0.5 * DRY, 0.5), (DRY, 1.0)]
)
def test_vapour_fills_what_oil_does_not(state, opened):
    assert float(torn_volume(state, 2e-3)) == pytest.approx(opened * 2e-3)
    assert float(held_share(state)) == pytest.approx(1.0 - opened)


def test_what_a_torn_node_gives_is_the_slope_of_its_vapour():
    for state in (0.8 * DRY, 0.1 * DRY, 1e4):
        slope = (torn_volume(state + 1.0, 1e-3) - torn_volume(state - 1.0, 1e-3)) / 2.0
        assert float(torn_capacity(state, 1e-3)) == pytest.approx(-float(slope))


def test_a_reservoir_that_is_too_small_leaves_vapour_and_no_tension():
    """Before its oil tears it runs as with enough of it; afterwards nothing falls below 0, and no volume is lost."""
    small = ramsight.simulate(changed("eha-single-rod", gas_volume="0.2 l"), load="15 kN")
    least = {name: values.min() for name, values in pressures(small).items()}
    assert min(least.values()) == 0.0
    assert abs(small.attrs["energy_residual"]) < 1e-5
    assert abs(small.attrs["volume_residual"]) < 1e-3
    torn = int(np.argmax(np.min(list(pressures(small).values()), axis=0) <= 0.0))
    assert small["time"].values[torn] > 2.0
    full = ramsight.simulate("eha-single-rod", load="15 kN")
    np.testing.assert_allclose(small["position"][:torn], full["position"][:torn], atol=2e-4)


def test_a_catalogue_machine_that_lowers_too_fast_tears_and_closes_again():
    run = ramsight.simulate("mining-loader", unit="bucket", load="48 kN", speed="3900 rpm")
    chamber = run["pressure_a"].values
    assert chamber.min() == 0.0
    assert chamber[-1] > 1e5
    assert abs(run.attrs["volume_residual"]) < 1e-3


@pytest.mark.parametrize(("least", "dry"), [(DRY, False), (DRY - 1.0, True)])
def test_a_node_without_oil_is_refused_at_its_first_sample(least, dry):
    names = ("position", "pressure_chamber_a", "pressure_port_b", "boom.pressure_port_b")
    ode = OdeModel.__new__(OdeModel)
    object.__setattr__(ode, "name", "boom")
    object.__setattr__(ode, "states", tuple(State(name, "", 1.0) for name in names))
    state = np.full((5, 4), 1e5)
    state[:, 0] = 2.0 * DRY  # no pressure
    state[3, 3] = state[4, 1] = least
    if not dry:
        refuse_dry(ode, np.arange(5.0), state)
        return
    with pytest.raises(ramsight.SimulationError, match=r"boom: node boom\.port_b runs dry at 3\.00 s"):
        refuse_dry(ode, np.arange(5.0), state)


@pytest.mark.parametrize("machine", CLOSED)
def test_catalogue_reservoirs_have_what_the_rod_takes(machine):
    check_reservoir(build(ramsight.load_machine(machine), "axis"))


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"gas_volume": "0.5 l"}, r"reservoir\.gas_volume = '0\.5 l': at 3 bar it has 0\.219 l of oil"),
        ({"precharge": "3 bar"}, r"reservoir\.precharge = '3 bar': .*\(allowed: less than 3 bar\)"),
        ({"precharge": "40 bar"}, r"reservoir\.precharge = '40 bar': .*\(allowed: less than 3 bar\)"),
        ({"precharge": "0.2 bar"}, r"reservoir\.gas_volume = '2 l': .* 0\.209 l of gas; .*at least 2\.9\d l"),
    ],
)
def test_a_reservoir_that_does_not_fit_the_rod_is_refused_with_key_value_and_range(values, says):
    with pytest.raises(ramsight.DescriptionError, match=says):
        machine_summary(changed("eha-single-rod", **values))


def test_the_range_that_is_named_is_allowed_and_just_below_it_is_not():
    """0.3054 l of oil that the rod takes, of a gas that is 0.4388 of it oil at rest."""
    machine_summary(changed("eha-single-rod", gas_volume="0.697 l"))
    with pytest.raises(ramsight.DescriptionError, match=r"allowed: at least 0\.699 l at a precharge of 1\.5 bar"):
        machine_summary(changed("eha-single-rod", gas_volume="0.69 l"))


def test_an_accumulator_of_a_circuit_with_a_tank_may_be_stronger_than_it():
    from ramsight.plant.accumulator import Accumulator
    from ramsight.plant.machine_tables import _draws_from_tank

    unit = build(ramsight.load_machine("loader-valve-controlled"), "boom")
    assert not any(isinstance(part, Accumulator) for part in unit.parts())
    assert _draws_from_tank(unit)
    assert not any(_draws_from_tank(build(ramsight.load_machine(machine), "axis")) for machine in CLOSED)


def test_check_refuses_such_a_file_in_one_line_with_exit_code_2(tmp_path):
    source = tmp_path / "axis.toml"
    made = at_once("new", source, "--like", "eha-single-rod", cwd=tmp_path)
    assert made.returncode == 0, made.stderr
    source.write_text(source.read_text().replace('gas_volume = "2 l"', 'gas_volume = "0.2 l"'))
    done = as_command("check", "axis.toml", cwd=tmp_path)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith("error: axis.toml: units.axis.parts.reservoir.gas_volume = '0.2 l': at 3 bar it has")
    assert "allowed: at least 0.699 l" in line


def test_a_plant_that_runs_live_shows_no_pressure_below_nothing():
    plant = ramsight.LivePlant("mining-loader", "bucket", start="240 mm", load="48 kN")
    least = []
    for k in range(150):
        sample = plant.advance(f"{min(100 * k, 3900)} rpm")
        least.append(min(sample.pressure_a, sample.pressure_b))
    assert min(least) == 0.0, "its oil tears, and does not pull"


def test_a_plant_in_c_shows_no_pressure_below_nothing():
    unit = build(ramsight.load_machine("press"), "ram")
    text = plant_model(unit, "press").files["model.c"]
    (found,) = re.findall(r"is_pressure\[N\] = \{([01, ]+)\}", text)
    states = circuit(unit).ode.states
    assert [bool(int(one)) for one in found.split(", ")] == [one.name.startswith("pressure_") for one in states]


def test_a_torn_chamber_pulls_at_nothing():
    """How the rod is accelerated, what flows and which torque the motor has are those of a pressure of 0."""
    model = circuit(build(ramsight.load_machine("press"), "ram"))
    ode, names = model.ode, [state.name for state in model.ode.states]
    said = ca.vertcat(*(one.expression for one in ode.outputs if not one.name.startswith("capacity_")))
    rates = ca.Function("rates", [ode.x, ode.u, ode.slope, ode.p], [ode.rhs[names.index("velocity")], said])
    state = np.array([0.1 if name == "position" else 2e5 if name.startswith("pressure_") else 0.0 for name in names])

    def found(pressure):
        state[names.index("pressure_chamber_b")] = pressure
        return [np.array(one).ravel() for one in rates(state, [50.0, 1e5], [0.0, 0.0], model.values)]

    for torn, dry in zip(found(0.2 * DRY), found(0.0), strict=True):
        np.testing.assert_array_equal(torn, dry)
    assert found(1e5)[0] != found(0.0)[0]


def test_a_pump_draws_of_a_torn_node_what_is_oil():
    model = circuit(build(ramsight.load_machine("eha-single-rod"), "axis"))
    ode, names = model.ode, [state.name for state in model.ode.states]
    (flow,) = (one.expression for one in ode.outputs if one.name == "pump.flow")
    said = ca.Function("flow", [ode.x, ode.u, ode.slope, ode.p], [flow])

    def found(node, pressure, speed):
        state = [2e5 if name.startswith("pressure_") else 0.0 for name in names]
        state[names.index(f"pressure_{node}")] = pressure
        return float(said(state, [speed, 0.0], [0.0, 0.0], model.values))

    for node, speed in (("port_b", 100.0), ("port_a", -100.0)):  # what it draws from
        full, half, none = (found(node, share * DRY, speed) for share in (0.0, 0.5, 1.0))
        assert half == pytest.approx(0.5 * (full + none))
        assert abs(none) < 0.05 * abs(full), "its leakage alone"
        assert found(node, 0.5 * DRY, -speed) == found(node, 0.0, -speed), "and not what it presses into"
