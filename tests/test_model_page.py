"""The page of mathematics says what the code estimates: its quantities, hypotheses and measurements, and no others."""

import ast
import re
from pathlib import Path

import pytest

import ramsight
from ramsight.sensor import thresholds
from ramsight.sensor.kind import Kind
from ramsight.sensor.quantity import Quantity

PAGE = (Path(__file__).parents[1] / "docs/explanation/model.md").read_text(encoding="utf-8")
SENSOR = Path(ramsight.__file__).parent / "sensor"


def rows(head: str) -> list[list[str]]:
    """Cells of the table that begins with a head."""
    lines = PAGE[PAGE.index(head) :].splitlines()
    table = lines[2 : next(k for k, line in enumerate(lines) if not line.startswith("|"))]
    return [[cell.strip() for cell in line.strip("|").replace("\\|", "¦").split("|")] for line in table]


def named(cell: str) -> list[str]:
    return re.findall(r"`([a-z_]+)`", cell)


def test_the_page_is_one():
    assert len(PAGE.splitlines()) <= 120


def test_the_quantities_are_those_of_the_page_with_their_units():
    units = {name: unit for cell, unit, *_ in rows("| `Quantity`") for name in named(cell)}
    assert units == {str(one): one.unit for one in Quantity}


def test_the_hypotheses_are_those_of_the_page_in_their_order():
    assert [name for cell, *_ in rows("| `Kind`") for name in named(cell)] == [kind.text for kind in Kind]


def made_in(file: Path) -> int:
    """How often a file makes a measurement."""
    calls = (node for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))) if isinstance(node, ast.Call))
    return sum(isinstance(call.func, ast.Name) and call.func.id == "Measurement" for call in calls)


def test_the_measurements_are_made_where_the_page_says():
    told = {file for _, cell, *_ in rows("| measurement") for file in re.findall(r"`([a-z_/]+\.py)`", cell)}
    makes = {str(file.relative_to(SENSOR)) for file in SENSOR.rglob("*.py") if made_in(file)}
    assert makes <= told


def test_a_weight_is_written_in_three_places():
    """The priors, Bayes' rule and the births: nothing else sets the weight of a hypothesis."""
    writes = {
        file.stem
        for file in SENSOR.rglob("*.py")
        if re.search(r"with_log_weight\(|\blog_weight=(?!ca\.if_else\(condition)", file.read_text(encoding="utf-8"))
    }
    assert writes - {"hypothesis"} == {"bank_state", "mixture", "renewal"}


@pytest.mark.parametrize("name", sorted(set(re.findall(r"`([A-Z][A-Z_]{4,})`", PAGE))))
def test_a_number_of_the_page_is_there(name):
    assert name in vars(thresholds)
