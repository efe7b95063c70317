"""Mechanisms against MuJoCo, which gets the descriptions by a translation of its own (see `linkages.py`).

MuJoCo is a tree of bodies with tendons between pins; links are tendons that an equality constraint keeps at their
length. Statics use the tree and the tendons' Jacobians alone, so that the softness of constraints does not enter.
"""

import casadi as ca
import numpy as np
import pytest

from ramsight.engine.equation import OdeModel
from ramsight.engine.run import Segments, integrate
from ramsight.plant.linkage import angles, holding_forces, joints, motion, tip

from .linkages import DESCRIPTIONS, MECHANISMS, grid, mujoco_xml

pytestmark = pytest.mark.slow

mujoco = pytest.importorskip("mujoco")

PAYLOAD = 1500.0


class Reference:
    """A description in MuJoCo."""

    def __init__(self, name, payload=0.0, springs=None):
        self.spec = DESCRIPTIONS[name]
        self.model = mujoco.MjModel.from_xml_string(mujoco_xml(self.spec, payload, springs))
        self.data = mujoco.MjData(self.model)

    def joints_of(self, name, coordinates):
        """All joint coordinates, of links and chains too, at those of the free joints."""
        mechanism = MECHANISMS[name]
        turned = {body: float(angle) for body, angle in angles(mechanism, coordinates).items()} | {"frame": 0.0}
        found = {}
        for body, spec in self.spec.bodies.items():
            if body in mechanism.joints:
                found[body] = coordinates[mechanism.joints.index(body)]
            elif spec.follows is not None:
                found[body] = spec.follows.ratio * found[spec.follows.body]
            else:
                found[body] = turned[body] - turned[spec.parent]
        return np.array(list(found.values()))

    def put(self, name, coordinates):
        self.data.qpos[:] = self.joints_of(name, coordinates)
        self.data.qvel[:] = 0.0
        mujoco.mj_forward(self.model, self.data)

    def tip(self):
        return self.data.site("tip").xpos[[0, 2]].copy()

    def tendons(self, kind):
        names = [self.model.tendon(k).name for k in range(self.model.ntendon)]
        return {n.removeprefix(kind): k for k, n in enumerate(names) if n.startswith(kind)}

    def jacobian(self):
        dense = np.zeros((self.model.ntendon, self.model.nv))
        for k in range(self.model.ntendon):
            first, count = self.model.ten_J_rowadr[k], self.model.ten_J_rownnz[k]
            columns = self.model.ten_J_colind[first : first + count]
            dense[k, columns] = self.data.ten_J.ravel()[first : first + count]
        return dense

    def weight(self):
        """Torques and forces at the tree's joints that hold it, without any constraint."""
        self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        self.data.qacc[:] = 0.0
        mujoco.mj_inverse(self.model, self.data)
        return self.data.qfrc_inverse.copy()


@pytest.mark.parametrize("name", MECHANISMS)
def test_positions_agree(name):
    reference, mechanism = Reference(name), MECHANISMS[name]
    drawn = mujoco.MjData(reference.model)
    mujoco.mj_forward(reference.model, drawn)
    for x, q in zip(grid(name, 4), joints(mechanism, grid(name, 4)), strict=True):
        reference.put(name, q)
        assert np.abs(reference.tip() - tip(mechanism, q)).max() < 1e-6
        length = reference.data.ten_length
        for cylinder, k in reference.tendons("cylinder_").items():
            spec = reference.spec.cylinders[cylinder]
            position = x[mechanism.cylinders.index(cylinder)]
            assert length[k] - spec.retracted_length == pytest.approx(position, abs=1e-6)
        for k in reference.tendons("link_").values():
            assert length[k] == pytest.approx(drawn.ten_length[k], abs=1e-6)


@pytest.mark.parametrize("name", ["loader", "forklift", "excavator"])
def test_holding_forces_agree(name):
    reference, mechanism = Reference(name, PAYLOAD), MECHANISMS[name]
    bodies = list(reference.spec.bodies)
    chains = [(b, spec.follows) for b, spec in reference.spec.bodies.items() if spec.follows is not None]
    for q in joints(mechanism, grid(name, 4)):
        reference.put(name, q)
        columns = list(reference.jacobian())
        for body, chain in chains:  # what the chain takes: its constraint is q_body - ratio q_leader
            row = np.zeros(len(bodies))
            row[bodies.index(body)], row[bodies.index(chain.body)] = 1.0, -chain.ratio
            columns.append(row)
        solved = np.linalg.lstsq(np.array(columns).T, reference.weight(), rcond=None)[0]
        places = reference.tendons("cylinder_")
        expected = np.array([solved[places[cylinder]] for cylinder in mechanism.cylinders])
        assert holding_forces(mechanism, q, PAYLOAD) == pytest.approx(expected, rel=1e-4)


def sprung(name, springs, payload):
    """The mechanism with springs in place of its cylinders, as an equation without inputs that matter."""
    ode, values = motion(MECHANISMS[name])
    order = MECHANISMS[name].cylinders
    forces = []
    for cylinder in order:
        stiffness, length = springs[cylinder]
        position = next(o.expression for o in ode.outputs if o.name == f"position_{cylinder}")
        forces.append(-stiffness * (position + DESCRIPTIONS[name].cylinders[cylinder].retracted_length - length))
    rest = ca.vertcat(payload, *([0.0] * (ode.u.numel() - len(order) - 1)))
    rhs = ca.substitute(ode.rhs, ode.u, ca.vertcat(*forces, rest))
    model = OdeModel(name, ode.states, ode.inputs, ode.parameters, ode.x, ode.u, ode.slope, ode.p, rhs)
    return model, values


@pytest.mark.parametrize(
    ("name", "start", "stiffness"),
    [
        ("crane", (0.3, -1.2), None),  # a free double pendulum
        ("loader", (0.35, 0.25), 1.5e6),
        ("forklift", (0.6,), 4e5),
        ("excavator", (0.45, 0.55, 0.35), 8e5),
    ],
)
def test_a_swing_of_two_seconds_agrees(name, start, stiffness):
    """Springs stand in for the oil, so that the swing is free and stays where links do not lock."""
    mechanism = MECHANISMS[name]
    payload = PAYLOAD if mechanism.load is not None else 0.0
    q0 = np.array(start) if stiffness is None else joints(mechanism, start)
    forces = np.zeros(len(mechanism.struts)) if stiffness is None else 0.6 * holding_forces(mechanism, q0, payload)
    springs = {}
    for cylinder, force in zip(mechanism.cylinders, forces, strict=True):
        now = DESCRIPTIONS[name].cylinders[cylinder].retracted_length
        now += start[mechanism.cylinders.index(cylinder)] if stiffness is not None else 0.0
        springs[cylinder] = (stiffness or 0.0, now + (force / stiffness if stiffness else 0.0))
    model, values = sprung(name, springs, payload)
    zeros = np.zeros((1, model.u.numel()))
    time = np.linspace(0.0, 2.0, 21)
    run = integrate(
        model,
        np.concatenate([q0, np.zeros(len(q0))]),
        Segments(np.array([0.0]), np.array([2.0]), zeros, zeros, values[None]),
        time,
        rtol=1e-10,
    )
    reference = Reference(name, payload, None if stiffness is None else springs)
    reference.put(name, q0)
    moved = 0.0
    for instant, state in zip(time, run.state, strict=True):
        while reference.data.time < instant - 1e-9:
            mujoco.mj_step(reference.model, reference.data)
        expected = reference.data.qpos[[list(reference.spec.bodies).index(j) for j in mechanism.joints]]
        assert np.abs(state[: len(q0)] - expected).max() < 1e-3
        moved = max(moved, np.abs(state[: len(q0)] - q0).max())
    assert moved > 0.03
