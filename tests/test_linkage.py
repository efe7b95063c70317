"""Planar mechanisms: closed forms both ways, virtual work, energy, and descriptions that do not hold together."""

import casadi as ca
import numpy as np
import pytest

from ramsight import machine
from ramsight.engine.run import Segments, integrate, outputs
from ramsight.errors import DescriptionError
from ramsight.plant.linkage import angles, holding_forces, joints, motion, points, positions, potential, tip

from .linkages import CRANE, DESCRIPTIONS, EXCAVATOR, MECHANISMS, described, grid

PAYLOAD = 900.0
LOADER = MECHANISMS["loader"]


def run_alone(name, start, end, payload, rtol=1e-11):
    """A mechanism that nothing but its weight and constant inputs moves, from rest."""
    ode, values = motion(MECHANISMS[name])
    inputs = np.zeros((1, len(ode.inputs)))
    inputs[0, ode.inputs.index("payload")] = payload
    segments = Segments(np.array([0.0]), np.array([end]), inputs, np.zeros_like(inputs), values[None])
    state = np.concatenate([start, np.zeros(len(start))])
    time = np.linspace(0.0, end, 401)
    run = integrate(ode, state, segments, time, rtol=rtol, tolerance_scale=0.01)
    return time, run.state, outputs(ode, segments, time, run.state)


@pytest.mark.parametrize("name", MECHANISMS)
def test_positions_and_joints_are_inverse_to_each_other(name):
    wanted = grid(name, 7)
    found = joints(MECHANISMS[name], wanted)
    assert np.all(np.isfinite(found))
    assert np.abs(positions(MECHANISMS[name], found) - wanted).max() < 1e-13


@pytest.mark.parametrize("name", MECHANISMS)
def test_in_the_drawing_nothing_is_turned_and_points_stand_where_they_are_drawn(name):
    mechanism, spec = MECHANISMS[name], DESCRIPTIONS[name]
    drawn = np.zeros(len(mechanism.joints))
    assert all(abs(angle) < 1e-14 for angle in angles(mechanism, drawn).values())
    assert tip(mechanism, drawn) == pytest.approx([spec.tip.x, spec.tip.z])
    back = joints(mechanism, positions(mechanism, drawn))
    assert back == pytest.approx(drawn, abs=1e-7)  # a forklift's cylinder is drawn fully retracted, at 0


@pytest.mark.parametrize("name", MECHANISMS)
def test_links_keep_their_length(name):
    mechanism = MECHANISMS[name]
    drawn = points(mechanism, np.zeros(len(mechanism.joints)))
    for pose in joints(mechanism, grid(name, 3)):
        now = points(mechanism, pose)
        for body in now:
            places = {what: place for what, place in now[body] if what.startswith("link of")}
            for what, place in places.items():
                (other,) = (b for b in now if b != body and what in dict(now[b]))
                length = np.linalg.norm(dict(drawn[other])[what] - dict(drawn[body])[what])
                assert np.linalg.norm(dict(now[other])[what] - place) == pytest.approx(length, abs=1e-13)


@pytest.mark.parametrize("name", MECHANISMS)
def test_holding_forces_are_the_gradient_of_the_potential_over_the_positions(name):
    """The forces come from the Jacobian of lengths by angles; here it is V(q(x)), with the inverse in closed form."""
    mechanism = MECHANISMS[name]
    payload = PAYLOAD if mechanism.load is not None else 0.0
    x = ca.SX.sym("x", len(mechanism.struts))
    poses = mechanism.poses(mechanism.solved(ca.vertsplit(x)))
    energy = sum(body.mass * poses[body.name].at(body.centre_x, body.centre_z)[1] for body in mechanism.bodies)
    if payload:
        energy += payload * poses[mechanism.load.body].at(mechanism.load.x, mechanism.load.z)[1]
    gradient = ca.Function("gradient", [x], [ca.gradient(mechanism.gravity * energy, x)])
    wanted = grid(name, 5)
    forces = holding_forces(mechanism, joints(mechanism, wanted), payload)
    expected = gradient(wanted.T).full().T
    assert np.abs(forces - expected).max() < 1e-9 * np.abs(expected).max()


@pytest.mark.parametrize(
    ("name", "start", "end", "payload", "least"),
    [("crane", (0.3, -1.2), 2.0, 0.0, 1e3), ("loader", joints(LOADER, [0.7, 0.25]), 0.6, 5000.0, 1e5)],
    ids=["a double pendulum", "the loader falls"],
)
def test_a_free_motion_keeps_its_energy(name, start, end, payload, least):
    time, _, along = run_alone(name, start, end, payload)
    total = along["kinetic"] + along["potential"]
    assert along["kinetic"].max() > least
    assert np.ptp(total) < 1e-6 * along["kinetic"].max()
    assert time[-1] == end


def test_payload_that_comes_brings_its_energy():
    """Half a tonne a second into a falling bucket: kinetic and potential energy grow by what each kilogram has."""
    ode, values = motion(LOADER)
    inputs, slope = np.zeros((1, len(ode.inputs))), np.zeros((1, len(ode.inputs)))
    place = ode.inputs.index("payload")
    inputs[0, place], slope[0, place] = 1000.0, 500.0
    segments = Segments(np.array([0.0]), np.array([0.5]), inputs, slope, values[None])
    time = np.linspace(0.0, 0.5, 2001)
    start = np.concatenate([joints(LOADER, [0.5, 0.3]), np.zeros(2)])
    run = integrate(ode, start, segments, time, rtol=1e-11, tolerance_scale=0.01)
    along = outputs(ode, segments, time, run.state)
    q = run.state[:, :2]
    other = LOADER.load
    poses = [LOADER.poses(list(row))[other.body].at(other.x, other.z) for row in q]
    x, z = (np.array([float(p[k]) for p in poses]) for k in (0, 1))
    speed2 = np.gradient(x, time, edge_order=2) ** 2 + np.gradient(z, time, edge_order=2) ** 2
    per_mass = 0.5 * speed2 + LOADER.gravity * z
    brought = 500.0 * np.sum(0.5 * (per_mass[1:] + per_mass[:-1]) * np.diff(time))
    total = along["kinetic"] + along["potential"]
    assert total[-1] - total[0] == pytest.approx(brought, rel=1e-5)


def test_a_level_bucket_stays_level_over_the_whole_lift():
    lift = np.column_stack([np.linspace(0.0, 0.7, 141), np.full(141, 0.25)])
    assert np.abs(np.degrees(angles(LOADER, joints(LOADER, lift))["bucket"])).max() < 1e-9


def test_the_rated_payload_takes_the_papers_loads():
    lift = np.column_stack([np.linspace(0.0, 0.7, 71), np.full(71, 0.25)])
    boom, bucket = holding_forces(LOADER, joints(LOADER, lift), LOADER.rated_payload).T
    loads = {name: machine.load_machine("mining-loader").unit(name).load.loads["high"] for name in ("boom", "bucket")}
    assert boom.max() == pytest.approx(loads["boom"], rel=5e-3)
    assert -bucket.min() == pytest.approx(loads["bucket"], rel=5e-3)  # the rod side holds it
    assert np.all(boom > 0.0)
    assert np.all(bucket < 0.0)


def test_a_chain_doubles_way_and_force():
    mechanism = MECHANISMS["forklift"]
    up = tip(mechanism, joints(mechanism, [[0.0], [0.5]]))
    assert up[1] - up[0] == pytest.approx([0.0, 1.0])
    more = holding_forces(mechanism, [0.3], 1000.0) - holding_forces(mechanism, [0.3])
    assert more == pytest.approx([2.0 * 1000.0 * mechanism.gravity])


def test_a_force_on_the_tip_is_carried_by_virtual_work():
    x, force, h = np.array([0.3, 0.3]), (-3e4, 1e4), 1e-6
    held = holding_forces(LOADER, joints(LOADER, x)) - holding_forces(LOADER, joints(LOADER, x), 0.0, force)
    for k in (0, 1):
        step = h * np.eye(2)[k]
        way = (tip(LOADER, joints(LOADER, x + step)) - tip(LOADER, joints(LOADER, x - step))) / (2 * h)
        assert held[k] == pytest.approx(way @ force, rel=1e-6)


def test_out_of_reach_is_no_number():
    assert np.isnan(joints(LOADER, [0.35, 2.0])[1])
    assert np.isfinite(potential(LOADER, [0.0, 0.0], 1.0))


WRONG = [
    (CRANE, 'parent = "boom"', 'parent = "hook"', "bodies.hook.parent", "no such body named before"),
    (CRANE, 'body = "hook"', 'body = "jib"', "tip.body", "frame, boom, hook"),
    (CRANE, 'kind = "turning"\nparent', 'kind = "flying"\nparent', "bodies.hook.kind", "sliding, turning"),
    (CRANE, 'rod = { x = "1.4 m", z = "1.9 m", body = "boom" }', 'rod = { x = "1.4 m", z = "1.9 m" }', "boom", "free"),
    (CRANE, 'mass = "300 kg"', 'mass = "300 m"', "bodies.hook.mass", "mass"),
    (CRANE, "pivot = { x", "direction = { x", "bodies.boom.direction", "unknown key"),
    (
        EXCAVATOR, 'rod = { x = "5.4 m", z = "-0.8 m", body = "rocker" }',
        'rod = { x = "5.4 m", z = "-0.8 m", body = "bucket" }', "cylinders.bucket", "which has to be free",
    ),
    (
        EXCAVATOR,
        'link = { pin = { x = "5.35 m"',
        'follows = { body = "arm", ratio = 1 }\nlink = { pin = { x = "5.35 m"',
        "follows",
        "not both",
    ),
    (EXCAVATOR, 'body = "rocker" } }', 'body = "bucket" } }', "link.to.body", "no such body named before"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "old", "new", "key", "words"), WRONG)
def test_what_does_not_hold_together_is_refused_by_key(text, old, new, key, words):
    assert old in text
    with pytest.raises(DescriptionError) as refused:
        described(text.replace(old, new, 1))
    assert key in str(refused.value)
    assert words in str(refused.value)


def test_a_cylinder_needs_a_unit_of_its_name():
    text = machine.catalogue.find("machine", "forklift-mast").path.read_text()
    with pytest.raises(DescriptionError, match=r"linkage\.cylinders\.mast = .*no such unit.*allowed: lift"):
        machine.loads(text.replace("[linkage.cylinders.lift]", "[linkage.cylinders.mast]"))


def test_every_value_of_the_catalogues_mechanisms_has_a_source():
    for name in ("mining-loader", "forklift-mast"):
        read = machine.load_machine(name)
        for value in machine.walk(read.linkage, "linkage."):
            assert not value.given or read.source_of(value.path), value.path


@pytest.mark.parametrize("name", ["mining-loader", "forklift-mast"])
def test_a_template_keeps_the_mechanism(name):
    read = machine.load_machine(name)
    assert machine.loads(machine.template(read)).linkage == read.linkage


def test_the_catalogue_shows_a_mechanism():
    from rich.console import Console

    from ramsight.machine.tables import catalogue_entry

    console = Console(width=140)
    with console.capture() as shown:
        console.print(catalogue_entry("mining-loader"))
    assert "linkage.bodies.bucket" in shown.get()
