"""The kinds of graph expressions are told apart by the type checker, with the project's own settings."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("mypy")

ROOT = Path(__file__).parents[1]
SNIPPET = """
import casadi as ca
from casadi import Scalar  # what `ramsight.expression` takes it from; importing the package would check all of it


def law(x: Scalar) -> Scalar:
    positive = x > 0.0
    right = x + ca.if_else(positive, 1.0, 0.0)
    wrong = x + positive
    also_wrong = ca.if_else(x, right, wrong)
    return right
"""


def test_a_condition_that_is_added_to_a_number_does_not_pass_the_type_checker(tmp_path):
    file = tmp_path / "snippet.py"
    file.write_text(SNIPPET)
    lines = SNIPPET.splitlines()
    settings = ["--config-file", str(ROOT / "pyproject.toml"), "--cache-dir", os.devnull]
    done = subprocess.run(
        [sys.executable, "-m", "mypy", *settings, str(file)],
        cwd=ROOT,
        env={**os.environ, "MYPYPATH": str(ROOT / "src")},
        capture_output=True,
        text=True,
        check=False,
    )
    found = [line for line in done.stdout.splitlines() if ": error: " in line and "snippet.py" in line]
    numbers = [int(line.split(":")[1]) for line in found]
    assert numbers == [
        1 + lines.index(f"    {line}") for line in ("wrong = x + positive", "also_wrong = ca.if_else(x, right, wrong)")
    ]
    assert 'operand types for + ("Scalar" and "Flag")' in found[0]
