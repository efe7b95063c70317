"""Mechanisms to test with, and a generic translation of a description for MuJoCo that shares no code with the plant."""

import math
import tomllib
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np

from ramsight import machine
from ramsight.machine.checking import validate
from ramsight.machine.declare import FROM_FILE
from ramsight.machine.linkage import FRAME, Linkage
from ramsight.plant.linkage import build_mechanism

# An excavator's arm, with the boom level and the arm hanging: the bucket turns by a rocker and a link, as a four-bar.
EXCAVATOR = """
[bodies.boom]
kind = "turning"
pivot = { x = "0 m", z = "1.5 m" }
mass = "1800 kg"
centre_of_mass = { x = "2.4 m", z = "1.9 m" }
moment_of_inertia = "4500 kg m2"

[bodies.arm]
kind = "turning"
parent = "boom"
pivot = { x = "5 m", z = "1.5 m" }
mass = "800 kg"
centre_of_mass = { x = "5 m", z = "0.6 m" }
moment_of_inertia = "700 kg m2"

[bodies.rocker]
kind = "turning"
parent = "arm"
pivot = { x = "5 m", z = "-0.7 m" }
mass = "60 kg"
centre_of_mass = { x = "5.2 m", z = "-0.75 m" }
moment_of_inertia = "2 kg m2"

[bodies.bucket]
kind = "turning"
parent = "arm"
pivot = { x = "5 m", z = "-1.1 m" }
mass = "500 kg"
centre_of_mass = { x = "4.8 m", z = "-1.6 m" }
moment_of_inertia = "90 kg m2"
link = { pin = { x = "5.35 m", z = "-1.2 m" }, to = { x = "5.4 m", z = "-0.8 m", body = "rocker" } }

[cylinders.boom]
base = { x = "0.4 m", z = "0.7 m" }
rod = { x = "2.2 m", z = "1.6 m", body = "boom" }
retracted_length = "1.6 m"

[cylinders.arm]
base = { x = "3 m", z = "2.3 m", body = "boom" }
rod = { x = "5.2 m", z = "2.1 m", body = "arm" }
retracted_length = "1.7 m"

[cylinders.bucket]
base = { x = "5.3 m", z = "1.1 m", body = "arm" }
rod = { x = "5.4 m", z = "-0.8 m", body = "rocker" }
retracted_length = "1.5 m"

[payload]
body = "bucket"
x = "4.7 m"
z = "-1.7 m"
rated = "900 kg"

[tip]
body = "bucket"
x = "4.4 m"
z = "-2.2 m"
"""

# A boom that one cylinder lifts, with a load that hangs free on a rod.
CRANE = """
[bodies.boom]
kind = "turning"
pivot = { x = "0 m", z = "2 m" }
mass = "900 kg"
centre_of_mass = { x = "2 m", z = "2 m" }
moment_of_inertia = "1500 kg m2"

[bodies.hook]
kind = "turning"
parent = "boom"
pivot = { x = "4 m", z = "2 m" }
mass = "300 kg"
centre_of_mass = { x = "4 m", z = "0.5 m" }
moment_of_inertia = "20 kg m2"

[cylinders.boom]
base = { x = "0.3 m", z = "1 m" }
rod = { x = "1.4 m", z = "1.9 m", body = "boom" }
retracted_length = "1.1 m"

[tip]
body = "hook"
x = "4 m"
z = "0.4 m"
"""


def described(text: str) -> Linkage:
    return validate(Linkage, tomllib.loads(text), context=FROM_FILE)


DESCRIPTIONS = {
    "loader": machine.load_machine("mining-loader").linkage,
    "forklift": machine.load_machine("forklift-mast").linkage,
    "excavator": described(EXCAVATOR),
    "crane": described(CRANE),
}
MECHANISMS = {name: build_mechanism(spec) for name, spec in DESCRIPTIONS.items()}
# Cylinder positions at which each can be assembled: least and greatest [m].
RANGES = {
    "loader": ((0.0, 0.7), (0.0, 0.5)), "forklift": ((0.0, 1.5),),
    "excavator": ((0.2, 0.7), (0.2, 0.9), (0.1, 0.6)), "crane": ((0.05, 0.6),),
}  # fmt: skip


def grid(name: str, count: int) -> np.ndarray:
    """Cylinder positions over the range, shape (poses, cylinders)."""
    axes = np.meshgrid(*(np.linspace(*ends, count) for ends in RANGES[name]))
    return np.column_stack([axis.ravel() for axis in axes])


def mujoco_xml(spec: Linkage, payload: float, springs: dict[str, tuple[float, float]] | None = None) -> str:
    """A description as MJCF: x forward, z up, joints about -y; links and chains as equality constraints.

    Args:
        spec: the description.
        payload: [kg].
        springs: in place of cylinders, by name: stiffness [N/m] and length [m].
    """
    root = Element("mujoco")
    SubElement(root, "compiler", autolimits="true")
    option = {"gravity": f"0 0 {-spec.gravity!r}", "timestep": "5e-5", "integrator": "RK4", "iterations": "200"}
    SubElement(root, "option", option | {"tolerance": "1e-14"})
    world = SubElement(root, "worldbody")
    tendons, equalities = Element("tendon"), Element("equality")
    element, origin = {FRAME: world}, {FRAME: (0.0, 0.0)}
    for name, body in spec.bodies.items():
        x, z = (body.pivot.x, body.pivot.z) if body.kind == "turning" else origin[body.parent]
        px, pz = origin[body.parent]
        here = SubElement(element[body.parent], "body", name=name, pos=f"{x - px!r} 0 {z - pz!r}")
        if body.kind == "turning":
            SubElement(here, "joint", name=name, type="hinge", axis="0 -1 0")
        else:
            way = f"{math.cos(body.direction)!r} 0 {math.sin(body.direction)!r}"
            SubElement(here, "joint", name=name, type="slide", axis=way)
        c, i = body.centre_of_mass, body.moment_of_inertia
        SubElement(here, "inertial", pos=f"{c.x - x!r} 0 {c.z - z!r}", mass=repr(body.mass), diaginertia=f"{i} {i} {i}")
        element[name], origin[name] = here, (x, z)

    def site(name, body, point):
        x, z = origin[body]
        SubElement(element[body], "site", name=name, pos=f"{point.x - x!r} 0 {point.z - z!r}")

    def tendon(name, ends, **options):
        spatial = SubElement(tendons, "spatial", name=name, **options)
        for end, (body, point) in zip("ab", ends, strict=True):
            site(f"{name}_{end}", body, point)
            SubElement(spatial, "site", site=f"{name}_{end}")

    stiff = {"solref": "1e-4 1", "solimp": "0.99999 0.99999 1e-6"}
    for name, body in spec.bodies.items():
        if body.kind == "turning" and body.link is not None:
            tendon(f"link_{name}", ((name, body.link.pin), (body.link.to.body, body.link.to)))
            SubElement(equalities, "tendon", tendon1=f"link_{name}", **stiff)
        if body.follows is not None:
            ratio = f"0 {body.follows.ratio!r} 0 0 0"
            SubElement(equalities, "joint", joint1=name, joint2=body.follows.body, polycoef=ratio, **stiff)
    for name, cylinder in spec.cylinders.items():
        options = {}
        if springs:
            options = {"stiffness": repr(float(springs[name][0])), "springlength": repr(float(springs[name][1]))}
        tendon(f"cylinder_{name}", ((cylinder.base.body, cylinder.base), (cylinder.rod.body, cylinder.rod)), **options)
    site("tip", spec.tip.body, spec.tip)
    if spec.payload is not None and payload > 0.0:
        x, z = origin[spec.payload.body]
        place = f"{spec.payload.x - x!r} 0 {spec.payload.z - z!r}"
        carried = SubElement(element[spec.payload.body], "body", name="payload", pos=place)
        SubElement(carried, "inertial", pos="0 0 0", mass=repr(payload), diaginertia="1e-6 1e-6 1e-6")
    root.append(tendons)
    root.append(equalities)
    return tostring(root, encoding="unicode")
