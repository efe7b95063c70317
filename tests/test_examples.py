"""The examples run, and the docstrings' examples of the plant too."""

import ast
import doctest
import importlib
import os
import re
import subprocess
import sys
import textwrap
import tomllib
from pathlib import Path
from pkgutil import iter_modules

import pytest

import ramsight

EXAMPLES = sorted((Path(__file__).parent.parent / "examples").glob("*.py"))
SAYS = {
    "own_part.py": r"sink \d+\.\d mm in a cycle; energy closes to \d\.\de-\d\d %",
    "typed.py": r"^\d+\.\d mm$",
    "linearise.py": r"oscillation: \d+\.\d Hz, damping ratio 0\.\d+\n.*\nthey differ by 0\.\d+ %",
}


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda file: file.name)
def test_an_example_runs_and_says_what_it_should(example, tmp_path):
    environment = {**os.environ, "PYTHONWARNINGS": "error"}
    done = subprocess.run(
        [sys.executable, example], capture_output=True, text=True, cwd=tmp_path, env=environment, check=False
    )
    assert done.returncode == 0, done.stderr
    assert re.search(SAYS[example.name], done.stdout), done.stdout


def test_a_part_of_ones_own_takes_less_than_fifteen_lines():
    tree = ast.parse((EXAMPLES[0].parent / "own_part.py").read_text(encoding="utf-8"))
    (part,) = [node for node in tree.body if isinstance(node, ast.ClassDef)]
    assert part.end_lineno - part.decorator_list[0].lineno + 1 < 15


MODULES = sorted(
    f"{room}.{module.name}"
    for room in ("plant", "machine", "duty")
    for module in iter_modules(importlib.import_module(f"ramsight.{room}").__path__)
)


@pytest.mark.parametrize("name", MODULES)
def test_examples_in_docstrings_run(name):
    failed, _ = doctest.testmod(importlib.import_module(f"ramsight.{name}"))
    assert failed == 0


def test_what_the_package_hands_out_and_what_not():
    assert ramsight.casadi_model.__name__ == "casadi_model"
    with pytest.raises(AttributeError, match="no attribute 'casadi_modle'"):
        ramsight.casadi_modle  # noqa: B018


def test_the_toml_of_the_plants_page_is_read():
    from ramsight import machine
    from ramsight.machine.efficiencies import read_efficiencies

    text = (EXAMPLES[0].parent.parent / "docs" / "plant.md").read_text(encoding="utf-8")
    table, circuit, _ = (
        tomllib.loads(textwrap.dedent(block)) for block in re.findall(r"```toml\n(.*?)```", text, re.S)
    )
    assert read_efficiencies(table["efficiency_table"]).pressure == (50e5, 250e5)
    press = machine.load("press").unit("ram")
    for name, part in circuit["units"]["ram"]["parts"].items():
        for key, value in part.items():
            assert press.replace({f"parts.{name}.{key}": value}).parts[name].kind == part["kind"]
