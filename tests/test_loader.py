"""The loader as a whole: two units on one mechanism, over a loading cycle, at the stops, and against a unit alone."""

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from ramsight import machine
from ramsight.duty import lift_lower, report, simulate
from ramsight.duty.linked_duty import LinkedDuty, simulate_linked, unit_run
from ramsight.duty.loading import PHASES, loading_cycle
from ramsight.duty.profile import Profile, constant
from ramsight.errors import DescriptionError
from ramsight.plant.linkage import holding_forces, positions
from ramsight.plant.linked import build_linked

LOADER = build_linked(machine.load_machine("mining-loader"))
UNITS = ("boom", "bucket")
WARM = dict.fromkeys(UNITS, constant(313.15))


@pytest.fixture(scope="module")
def cycle():
    duty = loading_cycle(LOADER)
    return duty, simulate_linked(LOADER, duty)


def balances_close(run):
    residuals = {key: value for key, value in run.attrs.items() if key.endswith("_residual")}
    assert {"energy_residual", "volume_residual", "linkage.energy_residual"} < set(residuals)
    assert max(abs(value) for value in residuals.values()) < 1e-3, residuals


def test_the_balances_of_a_loading_cycle_close(cycle):
    _, run = cycle
    balances_close(run)
    energy = {name: run.attrs[f"linkage.energy.{name}"] for name in ("rods", "tip", "payload", "stored_potential")}
    rods = sum(run.attrs[f"{unit}.energy.rods"] for unit in UNITS)
    assert energy["rods"] == pytest.approx(rods, rel=1e-6)
    # What the rods did went into payload that was dumped higher than it was dug, and into the heap.
    assert energy["payload"] < -1e5
    assert energy["tip"] < 0.0


def test_the_cycle_goes_through_its_phases(cycle):
    duty, run = cycle
    begins = dict(duty.phases)
    assert list(begins) == [phase.name for phase in PHASES]
    at = {name: run.sel(time=begins[name], method="nearest") for name in begins}
    angle = {name: np.degrees(float(there["angle_bucket"])) for name, there in at.items()}
    assert abs(angle["approach"]) < 0.1
    assert angle["travel"] > 12.0
    assert angle["level"] < -20.0
    assert abs(angle["lower"]) < 4.0
    assert float(at["travel"]["payload"]) == LOADER.mechanism.rated_payload
    assert float(run["payload"][-1]) == 0.0
    assert float(at["tip"]["tip_z"]) > 2.0 + float(at["travel"]["tip_z"])
    for unit in LOADER.units:
        end, start = float(run[f"{unit.name}_position"][-1]), duty.start_position[unit.name]
        assert abs(end - start) < 0.05
        assert float(run[f"{unit.name}_relief_{unit.held}_flow"].max()) == 0.0


def test_positions_are_those_of_the_joints_and_loads_those_of_the_mechanism(cycle):
    duty, run = cycle
    q = np.column_stack([run["joint_boom"], run["joint_bucket"]])
    found = positions(LOADER.mechanism, q)
    for k, unit in enumerate(UNITS):
        assert np.abs(found[:, k] - run[f"{unit}_position"].values).max() < 1e-12
    rest = run.sel(time=dict(duty.phases)["lift"] - 0.5, method="nearest")
    held = holding_forces(LOADER.mechanism, [rest["joint_boom"], rest["joint_bucket"]], float(rest["payload"]))
    for unit, force in zip(LOADER.units, held, strict=True):
        friction = unit.cylinder.breakaway_friction
        assert abs(unit.lift_sign * force - float(rest[f"{unit.name}_load"])) < 0.05 * friction


def test_everything_has_a_unit(cycle):
    _, run = cycle
    assert all("units" in run[name].attrs for name in [*run, "time"])
    wanted = {"tip_x", "tip_z", "angle_boom", "angle_bucket", "payload", "kinetic", "potential"}
    wanted |= {f"{u}_{what}" for u in UNITS for what in ("position", "velocity", "pressure_a", "motor_torque", "load")}
    assert wanted <= set(run)


def test_the_default_tolerance_keeps_positions_within_five_micrometres(cycle):
    duty, run = cycle
    fine = simulate_linked(LOADER, duty, rtol=1e-10)
    for unit in UNITS:
        assert np.abs(run[f"{unit}_position"] - fine[f"{unit}_position"]).max() < 5e-6


def test_a_units_part_is_a_run_like_any_other_and_a_drive_reports_it(cycle):
    _, run = cycle
    part = unit_run(run, "bucket")
    alone = simulate(LOADER.unit("bucket"), lift_lower(LOADER.unit("bucket"), 5e4, 313.15, hold=0.5))
    assert set(part) == set(alone)
    assert {name: part[name].attrs["units"] for name in part} == {name: alone[name].attrs["units"] for name in alone}
    assert set(part.attrs) - {"energy.rods"} == set(alone.attrs) - {"energy.load", "energy.stored_kinetic"}
    log = report(part)
    assert set(log) == {"motor_speed", "motor_torque", "oil_temperature"}
    assert np.abs(log["motor_torque"] - part["motor_torque"]).max() < 3.0
    with pytest.raises(KeyError, match="no unit 'stick'"):
        unit_run(run, "stick")


@pytest.mark.parametrize(
    ("unit", "speed", "start", "stop"),
    [
        ("boom", 250.0, 0.66, 0.7), ("boom", -250.0, 0.04, 0.0), ("bucket", 150.0, 0.45, 0.5),
        ("bucket", -150.0, 0.05, 0.0),
    ],
)  # fmt: skip
def test_end_stops_hold_until_the_relief_valve_opens(unit, speed, start, stop):
    """A pump that presses on against the stop opens a relief valve; the rod goes no deeper than 2 mm."""
    places = {"boom": 0.3, "bucket": 0.25} | {unit: start}
    speeds = dict.fromkeys(UNITS, constant(0.0)) | {
        unit: Profile([0.0, 0.5, 1.0, 4.0, 4.5, 5.0], [0, 0, speed, speed, 0, 0])
    }
    run = simulate_linked(LOADER, LinkedDuty(speeds, WARM, places, payload=constant(3000.0)))
    balances_close(run)
    beyond = (run[f"{unit}_position"].values - stop) * np.sign(speed)
    assert 0.0 < beyond.max() < 2e-3
    side = "a" if speed > 0.0 else "b"
    assert float(run[f"{unit}_relief_{side}_flow"].max()) > 1e-5
    assert run.attrs[f"{unit}.energy.cylinder.stop"] > 0.0


def test_a_mast_on_its_chain_is_the_mass_that_it_is_taken_for():
    """The forklift as a mechanism and as a mass at the rods: inner mast, and four times what the chain lifts."""
    described = machine.load_machine("forklift-mast")
    bodies, payload = described.linkage.bodies, 1000.0
    mass = bodies["inner_mast"].mass + 4.0 * (bodies["carriage"].mass + payload)
    linked = build_linked(described.replace({"units.lift.load.mass": mass}))
    (load,) = holding_forces(linked.mechanism, [0.0], payload)
    duty = lift_lower(linked.units[0], float(load), 313.15, start_position=0.2, hold=3.0)
    alone = simulate(linked.units[0], duty)
    own = LinkedDuty(
        {"lift": duty.motor_speed}, {"lift": duty.oil_temperature}, {"lift": 0.2}, payload=constant(payload)
    )
    together = unit_run(simulate_linked(linked, own), "lift")
    assert np.abs(alone["position"] - together["position"]).max() < 1e-9
    assert np.abs(alone["pressure_a"] - together["pressure_a"]).max() < 10.0
    assert np.abs(alone["motor_torque"] - together["motor_torque"]).max() < 1e-4


def test_a_start_out_of_reach_and_a_machine_without_a_mechanism_are_refused():
    with pytest.raises(DescriptionError, match="cannot be assembled"):
        simulate_linked(
            LOADER, LinkedDuty(dict.fromkeys(UNITS, constant(0.0)), WARM, {"boom": 0.3, "bucket": 2.0}, end=1.0)
        )
    with pytest.raises(DescriptionError, match=r"linkage: .*has no mechanism"):
        build_linked(machine.load_machine("press"))
    cold = {"boom": constant(200.0), "bucket": constant(313.15)}
    with pytest.raises(DescriptionError, match="oil temperature"):
        simulate_linked(
            LOADER, LinkedDuty(dict.fromkeys(UNITS, constant(0.0)), cold, {"boom": 0.3, "bucket": 0.3}, end=1.0)
        )


def test_changing_oil_temperature_reaches_its_own_unit_only():
    duty = loading_cycle(LOADER)
    warming = duty.oil_temperature | {"boom": Profile([0.0, duty.duration], [303.15, 323.15])}
    changed = LinkedDuty(duty.motor_speed, warming, duty.start_position, end=duty.duration)
    from ramsight.duty.linked_duty import audited_model

    model = audited_model(LOADER)
    segments = changed.segments(UNITS, model)
    boom, bucket = (segments.parameters[:, model.ode.parameters.index(f"{u}.oil_temperature")] for u in UNITS)
    assert boom[-1] - boom[0] == pytest.approx(20.0, abs=0.1)
    assert np.all(np.diff(boom) <= 0.05 + 1e-9)
    assert np.ptp(bucket) == 0.0


HOW_TO = Path(__file__).parent.parent / "docs" / "how-to"
PAGE = (HOW_TO / "mechanism.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_pages_mechanism_is_the_catalogues_and_its_python_runs():
    blocks = [tomllib.loads(block)["linkage"] for block in re.findall(r"```toml\n(.*?)```", PAGE, re.S)]
    (shown,) = (one for one in blocks if "bodies" in one)
    whole = tomllib.loads(machine.catalogue.find("machine", "forklift-mast").path.read_text())["linkage"]
    for kind in ("bodies", "cylinders"):
        for name, part in shown[kind].items():
            assert part.items() <= whole[kind][name].items()
    names = {}
    for code in re.findall(r"```python\n(.*?)```", PAGE, re.S):
        exec(code, names)
    assert names["log"].sizes["time"] > 3000
    assert names["loop"].now.position["boom"] == pytest.approx(0.4, abs=3e-3)


def test_a_mechanism_is_drawn_to_scale(tmp_path, monkeypatch):
    from matplotlib.figure import Figure

    from film.side_view import mechanism_figure
    from ramsight.plant.linkage import joints, tip

    drawn, written = [], Figure.savefig

    def seen(figure, *where, **how):
        drawn.append(figure)
        written(figure, *where, **how)

    monkeypatch.setattr(Figure, "savefig", seen)
    middle = [0.5 * unit.cylinder.stroke for unit in LOADER.units]
    mechanism_figure(LOADER, tmp_path / "loader.png", ghosts=[])
    (axes,) = drawn[0].axes
    assert axes.get_aspect() == 1.0
    way = next(line for line in axes.lines if line.get_linestyle() == ":").get_xydata()
    ends = [[x, *middle[1:]] for x in (0.0, LOADER.units[0].cylinder.stroke)]
    for point, at in zip(way[[0, -1]], ends, strict=True):  # the tip's way, from end to end of the boom's stroke
        np.testing.assert_allclose(point, tip(LOADER.mechanism, joints(LOADER.mechanism, at)), atol=1e-6)


@pytest.mark.slow
def test_an_animation_shows_truth_and_estimate_and_needs_no_other_file(cycle, tmp_path):
    import json

    import xarray

    from film.animation import write_animation

    _, run = cycle
    short = run.isel(time=slice(0, 200))  # 4 s
    off = 5e-3  # m
    track = xarray.Dataset(
        {
            "position": ("time", np.where(np.arange(200) < 50, np.nan, short["boom_position"].values + off)),
            "position_std": ("time", np.where(short["time"].values < 2.0, np.nan, 3e-3)),
            "status": ("time", np.where(np.arange(200) < 50, 30, 10), {"meaning": "10: due; 30: not referenced"}),
        },
        coords={"time": short["time"]},
    )
    page, picture = write_animation(LOADER, short, {"boom": track}, tmp_path / "out", phases=(("dig <1>", 0.0),))
    assert picture.read_bytes().startswith(b"GIF89a")
    text = page.read_text(encoding="utf-8")
    assert "http" not in text
    assert "src=" not in text
    data = json.loads(re.search(r"const data = (.*);\n", text)[1].replace("<\\/", "</"))
    boom, bucket = data["units"]
    assert len(data["truth"]) == len(data["estimate"]) == len(data["time"]) == 40
    assert set(boom["error"][10:]) == {5.0}
    assert set(boom["error"][:10]) == {None}  # no position before it is referenced, and no ghost
    assert data["estimate"][0] is None
    assert len(data["scenery"]["wheels"]) == 2
    assert data["bounds"][0] < data["scenery"]["wheels"][1][0] - data["scenery"]["radius"]
    assert data["heap"][0] == 0.0
    assert boom["std"][0] is None
    assert boom["std"][-1] == 3.0
    assert set(bucket["estimate"]) == {None}
    assert data["statuses"][str(boom["status"][0])] == "not referenced"
    assert data["truth"][-1]["bodies"] != data["estimate"][-1]["bodies"]
