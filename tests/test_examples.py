"""The examples run, and the docstrings' examples of the plant too."""

import ast
import doctest
import importlib
import os
import re
import shutil
import subprocess
import sys
import textwrap
import tomllib
from pathlib import Path
from pkgutil import iter_modules

import pytest

import ramsight

ROOT = Path(__file__).parent.parent
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
SAYS = {
    "first_position.py": r"^first position after \d+\.\d s\n95 % of the errors within \d\.\d mm, in the end \d\.\d mm",
    "own_machine.py": r"^3\.14 mm a revolution.*\nwithin 0\.\d+ mm over 24 s",
    "own_part.py": r"sink \d+\.\d mm in a cycle; energy closes to \d\.\de-\d\d %",
    "own_circuit.py": r"rigid: sinks by 5\.\d mm, 1[45]\d bar.*\nsprung: sinks by 3\d\.\d mm, 12\d bar",
    "monte_carlo.py": r"^1000 cycles in .* 5\.6 h simulated\nsinks by 24 mm",
    "leak_test.py": r"leak factor 1\.(19|20|21)\d ± 0\.0\d+",
    "identification.py": r"leak: 1\.(19|20)\d+, .*\n(.*\n)*identified: -?0\.\d mm off",
    "commissioning.py": r"verdict: look twice\n(.*\n)*failed      units and signs of torque.*\n(.*\n)*verdict: failed",
    "faults.py": r"plain: [4-9]\.\d mm off(.*\n)*with counter: 0\.\d mm off(.*\n)*  from 0\.\d+ s on: .* contradict",
    "control.py": r"(target \d+ mm: rod at \d+\.\d\d mm\n){4}3 s after",
    "own_loop.py": r"(\d+\.\d s: target \d+ mm, rod at \d+\.\d mm\n){3}the sensor is within 2\.\d mm",
    "own_mpc.py": r"0\.196 mm/s .*\n7\.9 s: target 200 mm, rod at 199\.\d mm\n.*\novershoot 0\.\d mm, fastest 30\.",
    "canopen_encoder.py": r"device type 406(.*\n)*\d{3} positions",
    "c_on_a_controller.py": r"\n1951 steps, C and Python differ by \d\d?\.\d um at most\n[0-4] statuses differ",
    "fmu_in_a_simulator.py": r"boom-sensor\.fmu: FMI 2\.0(.*\n)*lifted by 67\.\d mm; the sensor is within [01]\.\d+ mm",
    "typed.py": r"^\d+\.\d mm$",
    "linearise.py": r"oscillation: \d+\.\d Hz, damping ratio 0\.\d+\n.*\nthey differ by 0\.\d+ %",
}
QUICK = ("own_part.py", "control.py", "own_loop.py", "typed.py", "linearise.py")
NEEDS = {"canopen_encoder.py": ("can", "canopen"), "fmu_in_a_simulator.py": ("fmpy",)}
COMPILES = ("c_on_a_controller.py", "fmu_in_a_simulator.py")


@pytest.mark.parametrize(
    "example",
    [pytest.param(file, id=file.name, marks=[] if file.name in QUICK else [pytest.mark.slow]) for file in EXAMPLES],
)
def test_an_example_runs_and_says_what_it_should(example, tmp_path):
    for library in NEEDS.get(example.name, ()):
        pytest.importorskip(library)
    if example.name in COMPILES and shutil.which("gcc") is None:
        pytest.skip("there is no gcc")
    unseen = "ignore:FigureCanvasAgg is non-interactive:UserWarning"
    environment = {**os.environ, "MPLBACKEND": "agg", "PYTHONWARNINGS": f"error,{unseen}"}
    done = subprocess.run(
        [sys.executable, example], capture_output=True, text=True, cwd=tmp_path, env=environment, check=False
    )
    assert done.returncode == 0, done.stderr
    assert re.search(SAYS[example.name], done.stdout), done.stdout
    assert list(tmp_path.iterdir()) == [], "an example leaves nothing behind"


def test_the_list_of_examples_has_each_once_with_its_title():
    listed = re.findall(r"^- \[(.*?)\]\((\w+\.py)\): .", (ROOT / "examples/README.md").read_text(), flags=re.MULTILINE)
    titles = [(ast.get_docstring(ast.parse(file.read_text())).splitlines()[0], file.name) for file in EXAMPLES]
    assert sorted(listed) == sorted(one for one in titles if one[1] != "typed.py")


def test_a_part_of_ones_own_takes_less_than_fifteen_lines():
    tree = ast.parse((ROOT / "examples" / "own_part.py").read_text(encoding="utf-8"))
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


def test_the_toml_of_the_plants_pages_is_read():
    from ramsight import machine
    from ramsight.machine.efficiencies import read_efficiencies

    pages = ("explanation/pump-laws", "explanation/heat", "how-to/own-circuit")
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
