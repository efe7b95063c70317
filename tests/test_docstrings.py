"""What the reference documents says in which unit its numbers are."""

import ast
import importlib
import inspect
import re
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path

import pytest

import ramsight

REFERENCE = Path(__file__).parent.parent / "docs" / "api"
NUMBER = re.compile(r"\b(float|Quantity|Loads|Array)\b")
"""Annotations of what has a unit, or has none and says so."""
HAS_UNIT = re.compile(r"\[[^\]]*\]|\bshare\b|\bfactor\b|\brelative\b|\bprobability\b|\bunits?\b|\bSI\b|\bas `")
"""A unit in brackets, a word for a number without one, or where it is said."""


def documented():
    """What the reference names, by its full name."""
    text = "\n".join(page.read_text(encoding="utf-8") for page in sorted(REFERENCE.glob("*.md")))
    names = set(re.findall(r"auto(?:function|class):: (\S+)", text))
    for module in re.findall(r"automodule:: (\S+)", text):
        names |= {f"{module}.{name}" for name in getattr(importlib.import_module(module), "__all__", [])}
    for name in sorted(names):
        holder, _, last = name.rpartition(".")
        yield name, getattr(importlib.import_module(holder), last)


def functions():
    """Functions of the reference, and the public methods of its classes."""
    for name, found in documented():
        if inspect.isfunction(found):
            yield name, found
        elif inspect.isclass(found) and found.__module__.startswith("ramsight"):
            for key, method in list(vars(found).items()):
                function = inspect.unwrap(getattr(method, "__func__", method))
                if inspect.isfunction(function) and not key.startswith("_"):
                    yield f"{name}.{key}", function


FUNCTIONS = dict(functions())


def described(text: str) -> dict[str, str]:
    """Arguments of a docstring, each with what is said of it."""
    found, now = {}, []
    block = re.search(r"^Args:\n((?:(?: .*)?\n)*(?: .*)?)", text, flags=re.MULTILINE)
    for line in block[1].splitlines() if block else ():
        if head := re.match(r" {4}([*`\w][^:]*): (.*)", line):
            now = [name.strip(" *`") for name in head[1].split(",")]
            found.update(dict.fromkeys(now, head[2]))
        else:
            found.update({name: f"{found[name]} {line.strip()}" for name in now})
    return found


def without_unit(function) -> list[str]:
    """Arguments, and ``return``, that are numbers without a unit.

    What `Args` does not list may have its unit in the sentences above."""
    text = inspect.getdoc(function) or ""
    before = text.partition("Example:")[0]
    said, found = described(before), []
    for name, parameter in inspect.signature(function).parameters.items():
        annotation = str(parameter.annotation)
        if NUMBER.search(annotation) and "Callable" not in annotation and not HAS_UNIT.search(said.get(name, before)):
            found.append(name)
    returned = str(inspect.signature(function).return_annotation)
    if NUMBER.search(returned) and "Callable" not in returned and not HAS_UNIT.search(before):
        found.append("return")
    return found


def test_the_public_functions_are_among_them():
    public = {name for name in ramsight.__all__ if inspect.isfunction(getattr(ramsight, name))}
    assert len(public) >= 15
    assert {f"ramsight.{name}" for name in public} <= FUNCTIONS.keys()


def test_numbers_have_their_units_in_the_docstring():
    assert {name: lacks for name, function in FUNCTIONS.items() if (lacks := without_unit(function))} == {}


def test_a_list_of_arguments_is_whole_in_the_reference():
    """Elsewhere it has what name and type of an argument do not say."""
    lists = {name: described(inspect.getdoc(function) or "") for name, function in FUNCTIONS.items()}
    asked = {name: inspect.signature(FUNCTIONS[name]).parameters.keys() - {"self", "cls"} for name in lists}
    assert {name: lacks for name, said in lists.items() if said and (lacks := asked[name] - said.keys())} == {}
    assert sum(map(bool, lists.values())) > 50


@pytest.fixture
def said_of_fields(script):
    return script("field_comments", "docs").said_of_fields


def test_the_pages_list_what_is_said_beside_a_field(said_of_fields):
    @dataclass
    class Seen:
        """What was seen."""

        time: float  # of it [s]
        # low, high: ends of its band [m]
        low: float
        high: float
        # name: of the one that said it, which is
        # longer than a line
        name: str = "nobody"
        # Nobody asks for it.
        unsaid: bool = False

    said = said_of_fields(Seen)
    band, name = "ends of its band [m]", "of the one that said it, which is longer than a line"
    assert said == {"time": "of it [s]", "low/high": band, "name": name}


def test_numbers_of_the_reference_are_described(said_of_fields):
    """Each once: beside the field, or in the docstring."""
    kinds = {found for _, found in documented() if inspect.isclass(found) and is_dataclass(found)}
    described = {kind: "/".join(said_of_fields(kind)).split("/") for kind in kinds if said_of_fields(kind)}
    assert len(described) > 40
    missing = [
        f"{kind.__name__}.{one.name}"
        for kind, said in described.items()
        for one in fields(kind)
        if one.name in kind.__annotations__ and NUMBER.search(str(one.type)) and not one.name.startswith("_")
        if one.name not in said and one.name not in (inspect.getdoc(kind) or "")
    ]
    assert missing == []


def test_a_number_without_its_unit_is_seen():
    def area(bore: float, rod: float, share: float) -> float:
        """Something.

        Args:
            bore: of the cylinder [m].
            rod: of the
                rod.
            share: of it.
        """
        return bore - rod - share

    def stroke() -> float:
        """How far it goes."""
        return 0.5

    area.__doc__ = (area.__doc__ or "").replace("share: of it", "share: a share of it")
    assert without_unit(area) == ["rod"]
    assert without_unit(stroke) == ["return"]


def test_public_names_have_an_example_that_runs():
    """Errors apart: `tests/test_docs.py` runs them."""
    public = [getattr(ramsight, name) for name in ramsight.__all__]
    named = [one for one in public if callable(one) and not (inspect.isclass(one) and issubclass(one, BaseException))]
    assert [one.__name__ for one in named if ">>> " not in (inspect.getdoc(one) or "")] == []
    assert len(named) > 20


RIDDLE = re.compile(r"(To|Yes|Nothing|Some of)\b|Whether (the |it |a )?\w* ?(is|are|has|does)\.$")
"""First lines that lack their verb, or what they are about."""


def test_a_docstring_is_no_riddle():
    documented = (ast.FunctionDef, ast.ClassDef)
    files = sorted(Path(ramsight.__file__).parent.rglob("*.py"))
    nodes = [node for file in files for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))]
    first = [(ast.get_docstring(node) or "").partition("\n")[0] for node in nodes if isinstance(node, documented)]
    assert [line for line in first if RIDDLE.match(line)] == []
    assert len(first) > 2000
    assert RIDDLE.match("Whether the position is.")
    assert not RIDDLE.match("Whether the position is valid.")
