"""Comparisons that can fail: pytest.approx allows 1e-12 unless told otherwise, which is more than a small number."""

import ast
from pathlib import Path

SMALL = 1e-9
"""Below this the absolute tolerance is more than a thousandth of the number."""
TESTS = sorted(Path(__file__).parent.glob("*.py"))


def too_small(text):
    """Lines where a literal that small is compared without an absolute tolerance that was chosen."""
    for node in ast.walk(ast.parse(text)):
        if not isinstance(node, ast.Call) or not ast.unparse(node.func).endswith("approx"):
            continue
        if any(keyword.arg == "abs" for keyword in node.keywords) or len(node.args) > 2:
            continue
        values = [one.value for one in ast.walk(node.args[0]) if isinstance(one, ast.Constant)]
        if any(isinstance(value, float) and 0.0 < value < SMALL for value in values):
            yield node.lineno


def test_small_numbers_are_compared_with_a_tolerance_that_was_chosen():
    found = [f"{file.name}:{line}" for file in TESTS for line in too_small(file.read_text(encoding="utf-8"))]
    assert found == []
    assert len(TESTS) > 200


def test_the_test_sees_them():
    wrong = "approx(-2e-12)\napprox([1.0, 3e-10], rel=1e-3)\n"
    assert sorted(too_small(wrong + "approx(2e-12, abs=0.0)\napprox(2e-12, 1e-6, 0.0)\napprox(0.0)")) == [1, 2]
