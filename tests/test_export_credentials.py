"""An export has inside what it was made of, and can be made again from that."""

import hashlib
import json
import xml.etree.ElementTree as ElementTree
import zipfile
from dataclasses import replace

import pytest

from ramsight import machine
from ramsight.deploy.credentials import DESCRIPTION, Export, card, credentials
from ramsight.deploy.fmu import write_fmu
from ramsight.deploy.profiles import ControlOptions, Profile
from ramsight.duty.drive_response import DriveResponse
from ramsight.plant.build import build

TYPE = "{http://ssp-standard.org/SSPTraceability1/SSPTraceabilityCommon}"


@pytest.mark.parametrize(("name", "unit"), [("mining-loader", "boom"), ("press", "ram"), ("forklift-mast", "mast")])
def test_an_fmu_is_made_again_from_what_is_inside(tmp_path, name, unit):
    loaded = machine.load_machine(name)
    unit = unit if unit in loaded.units else next(iter(loaded.units))
    first = write_fmu(loaded, unit, tmp_path / "first.fmu", what="plant", fmi=3, compiler="")
    with zipfile.ZipFile(first.path) as archive:
        described = archive.read(f"resources/{DESCRIPTION}").decode()
        record = json.loads(archive.read("resources/ramsight.json"))
        for file, digest in record["sha256"].items():
            place = f"resources/{file}" if file == DESCRIPTION else file
            assert hashlib.sha256(archive.read(place)).hexdigest() == digest, file
        assert len(record["sha256"]) > 5
    again = write_fmu(machine.loads(described), unit, tmp_path / "again.fmu", what="plant", fmi=3, compiler="")
    assert again.path.read_bytes() == first.path.read_bytes()
    assert record["command"] == f"ramsight export fmu {DESCRIPTION} --unit {unit} --what plant --fmi 3"


def export(what="sensor"):
    loaded = machine.load_machine("mining-loader")
    return Export(loaded, build(loaded.unit("boom"), "boom"), what, ("c", "--single"))


def test_a_changed_file_has_another_digest():
    one, other = (json.loads(credentials(export(), {"a.c": text})["ramsight.json"]) for text in (b"1", b"2"))
    assert one["sha256"]["a.c"] != other["sha256"]["a.c"]
    assert one["sha256"][DESCRIPTION] == other["sha256"][DESCRIPTION]


@pytest.mark.parametrize("what", ["sensor", "control", "compare", "weighing", "plant"])
def test_the_card_has_the_attributes_of_mic_core_once_each(what):
    root = ElementTree.fromstring(card(export(what), "ramsight export c description.toml"))
    kind, *own = root
    assert kind.get("type") == "org.mic-core.mic-core"
    keys = [one.get("keyword") for one in kind]
    assert len(keys) == len(set(keys)) == 18
    said = {one.get("keyword"): one.text for one in kind}
    assert all(said.values())
    assert said["administrative-data.model.confidentiality-level"] == "1: internal"
    assert said["verification-validation.verification-status"] == "not run where it was exported"
    assert "stroke 700 mm; pressure up to 210 bar" in said["implementation.model.limitations"]
    lines = [(one.get("keyword"), one.text) for more in own for one in more]
    assert lines == ([] if what == "plant" else [("profile", "kalman: all hypotheses, as in Python")])
    assert {one.tag for one in kind} == {f"{TYPE}ClassificationEntry"}


def test_the_card_names_the_profile_of_the_sensor_and_only_the_measured_one_has_a_table():
    for profile in Profile:
        made = credentials(replace(export(), profile=profile), {"a.c": b"1"})
        assert f">{profile.words}<" in made["card.srmd"]
        assert ("fmeda.csv" in made) == (profile is Profile.KALMAN)


def test_a_controls_options_are_said_as_the_command_takes_them():
    assert ControlOptions().words == ()
    late = DriveResponse(command_delay=0.04, report_delay=0.04)
    assert ControlOptions(force=3e5, drive=late).words == ('--force "300000.0 N"', '--drive-delay "0.04 s"')
