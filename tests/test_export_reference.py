"""An FMU has a reference experiment inside, listed as FMI-LS-REF asks; a simulator that runs it gets what it says."""

import io
import re
import xml.etree.ElementTree as ElementTree
import zipfile
from posixpath import join, normpath

import numpy as np
import pytest

from ramsight import machine
from ramsight.deploy.compiler import find_compiler
from ramsight.deploy.credentials import CARD, DESCRIPTION, FMEDA
from ramsight.deploy.fmu import write_fmu
from ramsight.deploy.reference_experiment import (
    FOLDER,
    IN,
    MANIFEST,
    NOTE,
    OUT,
    START,
    Experiment,
    experiment_of,
    reference_files,
)
from ramsight.plant.build import build
from ramsight.sensor.status import Status
from ramsight.tracking.comparing import Verdict

LOADER = machine.load_machine("mining-loader")
LS = "{http://fmi-standard.org/fmi-ls-manifest}"
ROLES = (  # of FMI-LS-REF 1.0.0-alpha.1
    "document|requirement|specification|model|parameter|system|testcase|"
    "experiment(/(smoke-test|validation|uncertainty-analysis))?|result|method|rationale|report|request|delivery|"
    "configuration|signature|serialized-state(/.*)?|meta-data|other"
)
ALLOWED = {"position": 1e-9, "position_std": 1e-9, "position_bound": 1e-9, "velocity": 1e-8, "load": 1e-3}
PLANT_ALLOWED = {"position": 1e-6, "velocity": 1e-4, "pressure_chamber_a": 1e3, "pressure_chamber_b": 1e3}


def tiny():
    """An experiment of two samples."""
    columns = {"time": np.array([0.0, 0.5]), "motor_speed": np.array([1.0, np.nan])}
    return Experiment(0.5, columns, columns, {"start_position": 0.25, "start_known": True}, 1e-9)


def manifest_of(files):
    return ElementTree.fromstring(files[f"{FOLDER}/{MANIFEST}"])


def test_the_manifest_says_what_it_is_of():
    root = manifest_of(reference_files(tiny(), "boom", (DESCRIPTION,)))
    assert root.tag == "fmiReferences"
    assert root.attrib == {
        f"{LS}fmi-ls-name": "org.fmi-standard.fmi-ls-ref",
        f"{LS}fmi-ls-version": "1.0.0-alpha.1",
        f"{LS}fmi-ls-description": "Layered Standard providing information on related files included in an FMU.",
    }
    assert [one.tag for one in root] == ["Related"] * 4
    for one in root:
        assert set(one.attrib) == {"type", "source", "role", "description"}
        assert re.fullmatch(ROLES, one.get("role")), one.get("role")
    roles = {one.get("source"): one.get("role") for one in root}
    assert roles == {
        IN: "experiment/smoke-test",
        OUT: "result",
        START: "parameter",
        f"../../resources/{DESCRIPTION}": "model",
    }


def test_without_an_experiment_the_manifest_lists_what_is_there():
    files = reference_files(None, "boom", (DESCRIPTION, CARD, FMEDA))
    assert list(files) == [f"{FOLDER}/{MANIFEST}"]
    assert [one.get("role") for one in manifest_of(files)] == ["model", "meta-data", "document"]


def test_the_tables_are_numbers_below_their_names():
    files = reference_files(tiny(), "boom", ())
    assert files[f"{FOLDER}/{IN}"] == "time,motor_speed\n0,1\n0.5,10000000000\n"
    assert '<ssv:Boolean value="true"/>' in files[f"{FOLDER}/{START}"]
    assert '<ssv:Real value="0.25"/>' in files[f"{FOLDER}/{START}"]
    assert "Step by 0.5 s up to 0.5 s" in files[NOTE]


def test_a_control_and_a_plant_with_commands_have_no_experiment():
    boom = build(LOADER.unit("boom"), "boom")
    assert experiment_of(boom, "control") is None
    rig = machine.load_machine("eha-valve-rig")
    name = next(iter(rig.units))
    assert experiment_of(build(rig.unit(name), name), "plant") is None


@pytest.mark.slow
@pytest.mark.skipif(find_compiler() is None, reason="there is no C compiler")
@pytest.mark.parametrize(("what", "fmi"), [("sensor", 3), ("compare", 2), ("plant", 2), ("plant", 3)])
def test_a_simulator_gets_what_the_experiment_says(tmp_path, what, fmi):
    fmpy = pytest.importorskip("fmpy")
    from fmpy.validation import validate_fmu

    path = write_fmu(LOADER, "boom", tmp_path / "boom.fmu", what=what, fmi=fmi).path
    assert validate_fmu(str(path)) == []
    with zipfile.ZipFile(path) as archive:
        names = set(archive.namelist())
        files = {name: archive.read(f"{FOLDER}/{name}").decode() for name in (IN, OUT, START, MANIFEST)}
        assert NOTE in names
    root = ElementTree.fromstring(files[MANIFEST])
    assert {normpath(join(FOLDER, one.get("source"))) for one in root} <= names
    assert len(root) == (5 if what == "plant" else 6)
    given, expected = (np.genfromtxt(io.StringIO(files[name]), delimiter=",", names=True) for name in (IN, OUT))
    start = {
        one.get("name"): value == "true" if value in ("true", "false") else float(value)
        for one in ElementTree.fromstring(files[START])[0]
        for value in (one[0].get("value"),)
    }
    wanted = [name for name in expected.dtype.names if name != "time"]
    found = fmpy.simulate_fmu(
        str(path),
        stop_time=given["time"][-1],
        output_interval=float(np.median(np.diff(given["time"]))),
        input=given,
        start_values=start,
        output=wanted,
    )[-len(expected) :]
    assert np.allclose(found["time"], expected["time"], atol=1e-9)
    assert np.ptp(expected["position"]) > 0.05
    for name, allowed in (PLANT_ALLOWED if what == "plant" else ALLOWED).items():
        assert np.abs(found[name] - expected[name]).max() < allowed, name
    if what != "plant":
        assert (found["status"] == expected["status"]).all()
        assert Status.OK in expected["status"]
    if what == "compare":
        assert (found["verdict"] == expected["verdict"]).all()
        assert {Verdict.AGREE, Verdict.OTHER_WRONG} <= set(expected["verdict"].astype(int))
