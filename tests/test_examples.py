"""The examples run."""

import ast
import os
import re
import subprocess
import sys
import textwrap
import tomllib
from pathlib import Path

import pytest

import ramsight

ROOT = Path(__file__).parent.parent
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
QUICK = ("typed.py", "linearise.py")
LONGER = [pytest.param(name, marks=pytest.mark.slow) for name in ("own_part.py", "control.py", "own_loop.py")]


@pytest.mark.parametrize("name", [*QUICK, *LONGER])
def test_an_example_runs_and_says_what_it_should(name, tmp_path, script):
    """The others run where the pages are made (`make docs`); here with every warning as an error."""
    unseen = "ignore:FigureCanvasAgg is non-interactive:UserWarning"
    environment = {**os.environ, "MPLBACKEND": "agg", "PYTHONWARNINGS": f"error,{unseen}"}
    done = subprocess.run(
        [sys.executable, ROOT / "examples" / name],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env=environment,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert re.search(script("check", "docs").SAYS[name], done.stdout), done.stdout
    assert list(tmp_path.iterdir()) == [], "an example leaves nothing behind"


def test_of_every_example_it_is_stated_what_it_prints(script):
    assert script("check", "docs").SAYS.keys() == {file.name for file in EXAMPLES}


def test_the_list_of_examples_has_each_once_with_its_title():
    listed = re.findall(r"^- \[(.*?)\]\((\w+\.py)\): .", (ROOT / "examples/README.md").read_text(), flags=re.MULTILINE)
    titles = [(ast.get_docstring(ast.parse(file.read_text())).splitlines()[0], file.name) for file in EXAMPLES]
    assert sorted(listed) == sorted(one for one in titles if one[1] != "typed.py")


def test_a_part_of_ones_own_takes_less_than_fifteen_lines():
    tree = ast.parse((ROOT / "examples" / "own_part.py").read_text(encoding="utf-8"))
    (part,) = [node for node in tree.body if isinstance(node, ast.ClassDef)]
    assert part.end_lineno - part.decorator_list[0].lineno + 1 < 15


def test_what_the_package_hands_out_and_what_not():
    assert ramsight.casadi_model.__name__ == "casadi_model"
    with pytest.raises(AttributeError, match="no attribute 'casadi_modle'"):
        ramsight.casadi_modle  # noqa: B018


def test_the_toml_of_the_plants_pages_is_read():
    from ramsight import machine
    from ramsight.machine.pump_description import read_efficiencies

    pages = ("explanation/pump-laws", "how-to/own-circuit")
    text = "\n".join((ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8") for page in pages)
    blocks = [tomllib.loads(textwrap.dedent(block)) for block in re.findall(r"```toml\n(.*?)```", text, re.S)]
    (table,) = (block for block in blocks if "efficiency_table" in block)
    (circuit,) = (block for block in blocks if "ram" in block.get("units", {}))
    (heat,) = (block["units"]["boom"]["heat"] for block in blocks if "heat" in block.get("units", {}).get("boom", {}))
    assert machine.load_machine("mining-loader").unit("boom").replace({"heat": heat}).heat.case == 4200.0
    assert read_efficiencies(table["efficiency_table"]).pressure == (50e5, 250e5)
    press = machine.load_machine("press").unit("ram")
    for name, part in circuit["units"]["ram"]["parts"].items():
        for key, value in part.items():
            assert press.replace({f"parts.{name}.{key}": value}).parts[name].kind == part["kind"]
