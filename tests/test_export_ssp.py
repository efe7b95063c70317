"""An SSP package is valid; in an importer that runs it the sensor follows the plant, or the control drives it."""

import xml.etree.ElementTree as ElementTree
import zipfile

import numpy as np
import pytest

from ramsight import machine
from ramsight.deploy.compiler import find_compiler
from ramsight.deploy.fmu_units import Variable
from ramsight.deploy.profiles import ControlOptions
from ramsight.deploy.ssp import DESCRIPTION, PARAMETERS, Part, Structure, Wire, system_structure, write_ssp
from ramsight.errors import DescriptionError, OutputError

from .command import at_once

SPACE = "{http://ssp-standard.org/SSP1/SystemStructureDescription}"
COMMON = "{http://ssp-standard.org/SSP1/SystemStructureCommon}"
LOADER = machine.load_machine("mining-loader")
STEP = 0.02


def two_parts():
    """A structure of two components, an input and an output."""
    speed, word = Variable("v", "real", "input", "m/s"), Variable("status", "status", "output")
    given = Variable("w", "real", "output", "m/s")
    parts = [
        Part("a", "resources/a.fmu", {"v": speed, "w": given}),
        Part("b", "resources/b.fmu", {"v": speed, "status": word}),
    ]
    wires = (Wire("", "wanted", "a", "v"), Wire("a", "w", "b", "v"), Wire("b", "status", "", "status"))
    return Structure("two", parts, wires, "resources/p.ssv", 5.0)


def test_a_structure_has_the_connectors_that_something_connects():
    root = ElementTree.fromstring(system_structure(two_parts()))
    (system,) = root.findall(f"{SPACE}System")
    own = {one.get("name"): one for one in system.find(f"{SPACE}Connectors")}
    assert {name: one.get("kind") for name, one in own.items()} == {"wanted": "input", "status": "output"}
    assert own["wanted"][0].tag == f"{COMMON}Real"
    assert own["wanted"][0].get("unit") == "m/s"
    assert own["status"][0].get("name") == "Status"
    for component in system.find(f"{SPACE}Elements"):
        there = {one.get("name") for one in component.find(f"{SPACE}Connectors")}
        assert there == ({"v", "w"} if component.get("name") == "a" else {"v", "status"})
    units = [one.get("name") for one in root.find(f"{SPACE}Units")]
    assert units == ["m/s"]


def test_a_structure_is_valid_by_the_schema_of_ssp():
    pytest.importorskip("fmpy")
    etree = pytest.importorskip("lxml.etree")
    from fmpy.ssp.ssd import validate_tree

    root = etree.fromstring(system_structure(two_parts()).encode())
    validate_tree(root, "SystemStructureDescription.xsd")
    del root.attrib["version"]
    with pytest.raises(Exception, match="version"):
        validate_tree(root, "SystemStructureDescription.xsd")


@pytest.fixture(scope="module")
def packages(tmp_path_factory):
    """Packages of the boom, with the sensor and with the control."""
    folder = tmp_path_factory.mktemp("ssp")
    return {
        name: write_ssp(LOADER, "boom", folder / f"{name}.ssp", control=ControlOptions() if name == "control" else None)
        for name in ("sensor", "control")
    }


def simulated(path, stop, inputs):
    from fmpy.ssp.simulation import simulate_ssp
    from fmpy.ssp.ssd import read_ssv

    numbers = read_ssv(str(path), resource=PARAMETERS)
    return simulate_ssp(str(path), stop_time=stop, step_size=STEP, parameter_set=numbers, input=inputs)


compiled = pytest.mark.skipif(find_compiler() is None, reason="there is no C compiler")


@pytest.mark.slow
@compiled
@pytest.mark.parametrize("name", ["sensor", "control"])
def test_a_package_is_read_whole(packages, name):
    pytest.importorskip("fmpy")
    from fmpy.ssp.ssd import read_ssd, read_ssv

    done = packages[name]
    system = read_ssd(str(done.path)).system  # valid by the schema, or this raises
    assert [one.name for one in system.elements] == ["plant", name]
    assert len(system.connections) == done.connections
    numbers = {one.name: one for one in read_ssv(str(done.path), resource=PARAMETERS).parameters}
    assert len(numbers) == done.parameters
    assert numbers["plant.start_position"].value == numbers[f"{name}.start_position"].value
    assert numbers[f"{name}.start_known"].type == "Boolean"
    with zipfile.ZipFile(done.path) as archive:
        assert archive.namelist()[0] == DESCRIPTION
        assert {f"resources/{one.name}.fmu" for one in system.elements} <= set(archive.namelist())
    ends = {(wire.endElement, wire.endConnector) for wire in system.connections}
    assert len(ends) == len(system.connections), "an input has one source"


def test_pressures_that_a_machine_measures_reach_the_sensor(tmp_path):
    done = write_ssp(machine.load_machine("eha-valve-rig"), "axis", tmp_path / "axis.ssp", compiler="")
    with zipfile.ZipFile(done.path) as archive:
        root = ElementTree.fromstring(archive.read(DESCRIPTION))
    wires = [dict(one.attrib) for one in root.iter(f"{SPACE}Connection")]
    for side in "ab":
        ends = {"startElement": "plant", "endElement": "sensor"}
        assert ends | {"startConnector": f"pressure_chamber_{side}", "endConnector": f"pressure_{side}"} in wires


@pytest.mark.slow
@compiled
def test_the_sensor_follows_the_plant(packages):
    pytest.importorskip("fmpy")
    corners, speeds = [0, 1, 1.8, 4.8, 5.6, 7, 7.8, 10.8, 11.6], [0, 0, 100, 100, 0, 0, -100, -100, 0]

    def speed(time):
        return float(np.interp(time, corners, speeds))

    inputs = {"motor_speed": speed, "motor_acceleration": lambda time: (speed(time + STEP) - speed(time)) / STEP}
    found = simulated(packages["sensor"].path, 13.0, inputs)
    assert np.ptp(found["true_position"]) > 0.04
    assert np.abs(found["position"] - found["true_position"]).max() < 1e-3
    assert (found["plant.motor_speed_actual"][1:] == found["sensor.motor_speed"][1:]).all()


@pytest.mark.slow
@compiled
def test_the_control_drives_the_plant_to_its_target(packages):
    pytest.importorskip("fmpy")
    inputs = {"ask": lambda _: 1.0, "target": lambda _: 0.25, "speed": lambda _: 1e10}
    found = simulated(packages["control"].path, 20.0, inputs)
    assert found["true_position"][0] == pytest.approx(0.35, abs=1e-4)
    assert found["true_position"][-1] == pytest.approx(0.25, abs=2e-3)
    assert found["position"][-1] == pytest.approx(0.25, abs=2e-3)
    assert (found["reason"][1:] == 0.0).all()  # in the first step FMPy asks for a stop


def test_what_cannot_be_is_refused(tmp_path):
    with pytest.raises(OutputError, match="ssp"):
        write_ssp(LOADER, "boom", tmp_path / "boom.zip")
    with pytest.raises(DescriptionError, match="fmi"):
        write_ssp(LOADER, "boom", tmp_path / "boom.ssp", fmi=4)
    refused = at_once(
        "export", "ssp", "mining-loader", "--unit", "boom", "--out", "a.ssp", "--speed", "1 mm/s", cwd=tmp_path
    )
    assert refused.returncode == 2
    assert "none is exported" in refused.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_the_command_line_writes_a_package_of_fmi_3(tmp_path):
    said = at_once(
        "export",
        "ssp",
        "mining-loader",
        "--unit",
        "boom",
        "--out",
        "a.ssp",
        "--fmi",
        "3",
        "--platforms",
        "none",
        cwd=tmp_path,
    )
    assert said.returncode == 0, said.stderr
    assert "plant and sensor, 11 connections, 70 parameters, sources alone" in said.stdout
    with zipfile.ZipFile(tmp_path / "a.ssp") as archive, archive.open("resources/plant.fmu") as inner:
        assert b'fmiVersion="3.0"' in zipfile.ZipFile(inner).read("modelDescription.xml")
