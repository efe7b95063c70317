"""A file of the true position as it is dropped: ours, or one of another program."""

import pytest

from ramsight.logs.guess import guess_roles
from ramsight.logs.inspect import Channel
from ramsight.logs.source import Offered
from ramsight.studio.uploaded_log import look_at_truth, position_of

OURS = "time_s,position_m\n0.0,0.25\n0.1,0.26\n"


def said_of(file):
    """What is said of a file, but for warnings."""
    said = []
    look_at_truth(lambda what, value: said.append((what, value)), str(file))
    return [one for one in said if one[0] != "warnings"]


def test_a_file_of_ours_is_taken_as_it_is(tmp_path):
    file = tmp_path / "truth.csv"
    file.write_text(OURS)
    said = "truth.csv: taken as the true position, 2 samples"
    assert said_of(file) == [("truth", {"said": said, "file": "truth.csv"})]
    assert file.read_text() == OURS


@pytest.mark.parametrize("encoding", ["utf-8", "cp1252"])
def test_a_german_file_is_rewritten_in_metres(tmp_path, encoding):
    file = tmp_path / "weg.txt"
    text = "Zeit [ms];Kolbenweg (mm);Druck [bar];Überlauf\n0;1,5;3,0;1\n10;2,5;3,0;1\n20;;3;1\n"
    file.write_bytes(text.encode(encoding))
    ((what, value),) = said_of(file)
    assert what == "truth"
    assert value["said"].endswith("of 'Kolbenweg (mm)' in mm, 2 samples")
    rows = (tmp_path / value["file"]).read_text().split()
    assert rows == ["time_s,position_m", "0.000000,0.001500", "0.010000,0.002500"]


@pytest.mark.parametrize("head", ["a;b", "Zeit [s];Druck [bar]", "Zeit [s];Weg", "Weg [mm];Druck [bar]"])
def test_a_file_without_a_position_or_a_clock_is_refused_at_once(tmp_path, head):
    file = tmp_path / "v.csv"
    file.write_text(f"{head}\n0,5;1,5\n0,7;1,6\n0,8;1,7\n")
    ((what, words),) = said_of(file)
    assert what == "error"
    assert words.startswith("v.csv: ")


def test_of_two_positions_none_is_chosen():
    two = [Channel("Weg A", "mm"), Channel("Weg B", "mm")]
    assert position_of(two) is None
    assert position_of(two[:1]) is two[0]


def test_a_temperature_with_a_group_before_its_name_is_the_oils():
    offered = [Offered("Drv.n_ist", "1/min"), Offered("Drv.M_ist", "Nm"), Offered("Hyd.T_Oil [°C]", "")]
    assert guess_roles(offered)["temperature"] == "Hyd.T_Oil [°C]"
    assert "temperature" not in guess_roles([Offered("Hyd.P_Oil", "")])
