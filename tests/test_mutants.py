"""The table of mutants fits the code, and CONTRIBUTING.md lists what survives with its reason."""

import json
import shlex
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture
def script(script):
    return script("mutants")


def test_each_mutant_changes_one_place_and_has_tests(script):
    table = script.mutants()
    assert len(table) >= 40
    for mutant in table:
        assert mutant.old in mutant.text(ROOT)
        assert mutant.new != mutant.old
        files = [word for word in shlex.split(mutant.tests) if word.endswith(".py")]
        assert files, mutant
        assert all((ROOT / "tests" / file).is_file() for file in files), mutant.tests


def test_a_place_that_is_not_there_is_named(script):
    gone = script.Mutant("units/conversion.py", "text that does not stand there", "", "test_units.py")
    with pytest.raises(SystemExit, match=r"units/conversion\.py: .* stands there 0 times"):
        gone.text(ROOT)


def test_the_page_lists_the_survivors_with_their_reasons(script):
    results = json.loads((ROOT / "results" / "mutants.json").read_text(encoding="utf-8"))["mutants"]
    page = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    assert {(row["place"].split(":")[0], row["old"]) for row in results} == {
        (one.file, one.old) for one in script.mutants()
    }
    for row in results:
        listed = f"| `{row['place'].split(':')[0]}` | `{row['old'].strip()}` → `{row['new'].strip()}` |" in page
        assert listed == (row["outcome"] == "survived"), row["place"]
    killed = sum(row["outcome"] == "killed" for row in results)
    assert f"Of {len(results)}, {killed} are killed" in page
    for row in results:
        if row["outcome"] == "survived":
            assert row["reason"] in page
