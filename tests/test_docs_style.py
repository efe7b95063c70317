"""The style of pages: improved sentences stay improved, and what a stranger reads first has short sentences."""

import importlib.util
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
READ_FIRST = ("README.md", "docs/index.md", "docs/faq.md", "docs/glossary.md", "docs/commands.md", "docs/python.md")
MOST = 0.05
"""Share of long sentences on these pages."""


@pytest.fixture(scope="module")
def counting():
    spec = importlib.util.spec_from_file_location("sentences", ROOT / "docs" / "sentences.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def spaced(text):
    return " ".join(text.split())


def pairs():
    (section,) = re.findall(r"^## Style\n(.*?)(?=^## )", (ROOT / "CONTRIBUTING.md").read_text(), flags=re.M | re.S)
    return re.findall(r"^\| (?!before)(.+?) \| (.+?) \|$", section, flags=re.MULTILINE)


def test_the_style_has_twenty_sentences_that_were_improved():
    text = spaced("\n".join(page.read_text(encoding="utf-8") for page in PAGES))
    assert len(pairs()) >= 20
    for before, after in pairs():
        assert before not in text
        assert after in text, after


def test_words_of_sentences_are_counted_and_no_others(counting):
    text = (
        "# A heading with words\n\nOne two three. Four [five six](seven.md) `eight`!\n\n"
        "| a table | has none |\n|---|---|\n\n- an item of five words\n- 441 kN is\n  two lines\n\n"
        "```sh\nnot one of these words.\n```\n\n    nor indented code\n\n<!-- nor comments -->\n"
    )
    assert [counting.words(one) for one in counting.sentences(text)] == [3, 4, 5, 5]
    assert counting.share(text) == 0.0
    assert counting.share("word " * 31 + "\n\nshort one") == 0.5
    assert counting.share("word " * 30) == 0.0


@pytest.mark.parametrize("page", READ_FIRST)
def test_what_is_read_first_has_short_sentences(counting, page):
    text = (ROOT / page).read_text(encoding="utf-8")
    assert counting.share(text) <= MOST
