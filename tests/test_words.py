"""The words of the field stand in the code; docs/nomenclature.md lists the old ones and what took their place."""

import re
from pathlib import Path

import pytest

import ramsight

SOURCE = Path(ramsight.__file__).parent
SUFFIXES = {".py", ".js", ".html", ".c", ".h", ".md", ".toml"}
OLD = {
    "believe": r"believ\w*", "doubt": r"doubt(s|ed|ful|fully)?", "surprise": r"surpris\w*", "anew": r"anew",
    "let go": r"let(s|ting)?( it)? go", "told": r"told", "dear": r"dear", "is no more": r"is no more",
}  # fmt: skip


def found(text, pattern):
    """Lines in which a word stands, by itself or as a part of a name, none of them a part of another word."""
    whole = re.compile(rf"(?<![A-Za-z]){pattern}(?![A-Za-z])", flags=re.IGNORECASE)
    return [f"{number}: {line.strip()}" for number, line in enumerate(text.splitlines(), 1) if whole.search(line)]


FILES = sorted(file for file in SOURCE.rglob("*") if file.suffix in SUFFIXES and "__pycache__" not in file.parts)


@pytest.mark.parametrize("word", OLD)
def test_the_old_words_are_gone(word):
    there = []
    for file in FILES:
        lines = found(file.read_text(encoding="utf-8"), OLD[word])
        there += [f"{file.relative_to(SOURCE)}:{line}" for line in lines]
    assert not there, "\n".join(there)


def test_the_test_sees_words_and_parts_of_names():
    text = "it_is_told = 1\n# a DOUBT\nendear = 1\nlets_go, 'lets it go'\nbelieving(1)\n"
    assert [len(found(text, pattern)) for pattern in OLD.values()] == [1, 1, 0, 0, 1, 1, 0, 0]


def test_the_nomenclature_lists_every_old_word():
    page = (SOURCE.parents[1] / "docs" / "nomenclature.md").read_text(encoding="utf-8")
    (table,) = re.findall(r"^## Old words and new\n(.*?)(?=^## |\Z)", page, flags=re.MULTILINE | re.DOTALL)
    rows = re.findall(r"^\| (.+?) \| .+? \|$", table, flags=re.MULTILINE)
    assert all(any(word.removeprefix("is ") in row for row in rows) for word in OLD)
