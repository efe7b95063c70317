"""The pages of statuses and messages have each in the words of the code; the glossary is short."""

import ast
import re
from pathlib import Path

import ramsight
from ramsight.sensor.status import Status
from ramsight.study.commissioning import finding
from ramsight.tracking import comparing

ROOT = Path(__file__).parent.parent
SOURCE = Path(ramsight.__file__).parent
NAMES = ("status", "messages")
FAQ = "\n".join((ROOT / "docs" / "reference" / f"{name}.md").read_text(encoding="utf-8") for name in NAMES)
RESERVED = {Status.CAVITATION}
"""Statuses that no sensor reports."""


def rows(title):
    """The first cells of the tables of a chapter."""
    (chapter,) = re.findall(rf"^## {title}\n(.*?)(?=^## |\Z)", FAQ, flags=re.MULTILINE | re.DOTALL)
    return re.findall(r"^\| (.+?) \|", chapter, flags=re.MULTILINE)


def test_every_status_has_its_entry_with_its_reason_and_a_remedy():
    entries = re.findall(r"^### (.*?)\n\n(.*?)(?=^##|\Z)", FAQ, flags=re.MULTILINE | re.DOTALL)
    assert [title for title, _ in entries] == [status.text for status in sorted(Status)]
    for status, (_, text) in zip(sorted(Status), entries, strict=True):
        assert text.startswith(f"`{status.name}`, {int(status)}. "), status
        if status not in RESERVED:
            assert "\n- **Why:** " in text, status
            assert "\n- **What to do:** " in text, status


def test_no_sensor_reports_what_the_page_calls_reserved():
    rules = [file for room in ("sensor",) for file in (SOURCE / room).glob("*.py") if file.name != "status.py"]
    for status in RESERVED:
        assert not [file.name for file in rules if f"Status.{status.name}" in file.read_text(encoding="utf-8")]


def test_every_verdict_has_its_row():
    assert [verdict.text for verdict in comparing.Verdict] == rows("Verdicts of compare")[1:]
    found = rows("Verdicts of commission")
    assert {verdict.value for verdict in finding.Verdict} <= set(found)


def test_every_check_of_a_commissioning_has_its_row():
    trees = [ast.parse(file.read_text(encoding="utf-8")) for file in (SOURCE / "study/commissioning").glob("*.py")]
    calls = [node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.Call)]
    first = [node.args[0] for node in calls if getattr(node.func, "id", "") == "Finding" and node.args]
    checks = {arg.value for arg in first if isinstance(arg, ast.Constant)} | {"description", "requirement"}
    assert len(checks) > 6
    assert checks <= set(rows("Verdicts of commission"))


def test_the_warnings_are_worded_as_in_the_code():
    logs = ("clock_watch", "clock_going", "row_clock", "counter")
    files = ("tracking/plausible.py", "tracking/mistakes.py", *(f"logs/{name}.py" for name in logs))
    code = "".join((SOURCE / file).read_text(encoding="utf-8") for file in files)
    warnings = [row.strip("*") for row in rows("Warnings about a log")[1:]]
    assert len(warnings) > 10
    parts = [part.strip() for warning in warnings for part in warning.split("…")]
    assert [part for part in parts if part not in code] == []


def test_the_glossary_is_short_and_sorted_and_other_pages_use_its_words():
    terms = re.findall(
        r"^(\S.*)\n: ", (ROOT / "docs" / "reference" / "glossary.md").read_text(encoding="utf-8"), flags=re.MULTILINE
    )
    assert 20 <= len(terms) <= 40
    assert terms == sorted(terms, key=str.casefold)
    pages = [page for page in (ROOT / "docs").rglob("*.md") if page.name != "glossary.md"]
    text = "\n".join(page.read_text(encoding="utf-8").casefold() for page in pages)
    assert [term for term in terms if term.casefold() not in text] == []
