"""What the page of exports says for other tools fits what is exported."""

import re
import shutil
import subprocess
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from ramsight.deploy.encoder.objects import eds_text
from ramsight.deploy.fmu_description import TOOL

PAGE = (Path(__file__).parent.parent / "docs" / "how-to" / "fmu.md").read_text(encoding="utf-8")


def block(kind):
    (found,) = re.findall(rf"^```{kind}\n(.*?)^```", PAGE, flags=re.DOTALL | re.MULTILINE)
    return found


def test_the_configuration_for_twincat_names_the_tool_of_the_fmus():
    root = ElementTree.fromstring(block("xml").encode())
    (one,) = root.findall("FmuConfiguration")
    assert one.findtext("ToolName") == TOOL
    assert "$(ProjectDir)sources" in one.findtext("AdditionalInclude")


def test_the_bus_of_ros_2_has_the_encoder_with_its_eds(tmp_path):
    yaml = pytest.importorskip("yaml")
    canopen = pytest.importorskip("canopen")
    bus = yaml.safe_load(block("yaml"))
    assert set(bus) == {"options", "master", "boom_encoder"}
    node = bus["boom_encoder"]
    assert node["node_id"] != bus["master"]["node_id"]
    assert f"--eds {node['dcf']}" in PAGE
    eds = tmp_path / node["dcf"]
    eds.write_text(eds_text(), encoding="ascii")
    dictionary = canopen.import_od(str(eds), node["node_id"])
    first = dictionary[0x1800][1].default  # TPDO1
    assert first & 0x7FF == 0x180 + node["node_id"]
    mapped = [dictionary[0x1A00][k].default >> 16 for k in range(1, dictionary[0x1A00][0].default + 1)]
    assert 0x6004 in mapped
    assert set(node["tpdo"]) == {1}


@pytest.mark.skipif(shutil.which("dcfgen") is None, reason="Lely's dcf-tools are not installed")
def test_the_tool_of_ros_2_makes_the_masters_file(tmp_path):
    (tmp_path / "bus.yml").write_text(block("yaml"), encoding="utf-8")
    (tmp_path / "ramsight-encoder.eds").write_text(eds_text(), encoding="ascii")
    done = subprocess.run(["dcfgen", "-r", "bus.yml"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert not done.stderr
    assert (tmp_path / "master.dcf").stat().st_size > 1000
