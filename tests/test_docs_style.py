"""The style of pages: improved sentences stay improved, and what a stranger reads first has short sentences."""

import re
import statistics
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
IN_FOLDERS = [page for page in sorted((ROOT / "docs").rglob("*.md")) if "gallery" not in page.parts]
PAGES = [ROOT / "README.md", *IN_FOLDERS]
READ_FIRST = (
    "README.md",
    "docs/index.md",
    *(f"docs/reference/{name}.md" for name in ("status", "messages", "glossary", "commands")),
    "docs/how-to/python.md",
    *sorted(page.relative_to(ROOT).as_posix() for page in (ROOT / "docs" / "tutorials").glob("*.md")),
)
MOST = 0.05
"""Share of long sentences on these pages."""
MOST_OF_ALL = 0.02
"""The same of all pages together, without those of `LONGER`."""
LONGEST_PAGE, MEDIAN_PAGE = 1500, 700
"""Words of a page without its tables, code and what scripts write into it."""
LONGER: dict[str, str] = {}
"""Pages that are longer, and why."""
WRITTEN_BY_CODE = re.compile(r"<!-- (\S+) -->.*?<!-- end of \1 -->", flags=re.DOTALL)
NO_SUMMARY = ("docs/changelog.md", "docs/api/")
"""What is the file itself of the repository, or docstrings."""


@pytest.fixture
def counting(script):
    return script("sentences", "docs")


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


def prose(text):
    """A page's words, without code, tables, comments and what scripts write."""
    text = WRITTEN_BY_CODE.sub("", re.sub(r"^( *)```.*?^\1```", "", text, flags=re.MULTILINE | re.DOTALL))
    text = re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)
    text = re.sub(r"^\|.*$", "", text, flags=re.MULTILINE)
    return re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", text).split()


def test_words_of_a_page_are_those_of_its_prose():
    text = "# One\n\ntwo [three](a.md)\n\n| no | no |\n\n```sh\nno no\n```\n\n<!-- a -->\nno\n<!-- end of a -->\n"
    assert len(prose(text)) == 4


def test_pages_are_short():
    count = {page.relative_to(ROOT).as_posix(): len(prose(page.read_text(encoding="utf-8"))) for page in IN_FOLDERS}
    long = {name for name, words in count.items() if words > LONGEST_PAGE}
    assert long == set(LONGER), {name: count[name] for name in long ^ set(LONGER)}
    assert statistics.median(count.values()) <= MEDIAN_PAGE


def test_a_page_begins_with_its_title_and_a_summary():
    for page in IN_FOLDERS:
        name, text = page.relative_to(ROOT).as_posix(), page.read_text(encoding="utf-8")
        if name.startswith(NO_SUMMARY):
            continue
        before = text.partition("\n## ")[0]
        assert re.match(r"# \S.*\n\n", before), name
        paragraph = next(part for part in before.partition("\n\n")[2].split("\n\n") if part.strip())
        assert re.match(r"[A-Za-z*`(\[]", paragraph), (name, paragraph)
        assert 8 <= len(paragraph.split()) <= 90, (name, paragraph)


def test_few_sentences_of_all_pages_are_long(counting):
    pages = [page for page in IN_FOLDERS if page.relative_to(ROOT).as_posix() not in LONGER]
    lengths = [counting.words(one) for page in pages for one in counting.sentences(page.read_text("utf-8"))]
    assert sum(length > counting.LONG for length in lengths) <= MOST_OF_ALL * len(lengths)


def test_no_line_of_a_page_begins_with_a_percent_sign():
    """MyST takes such a line for a comment, and the site would not have its words."""
    lost = [(page.name, line) for page in IN_FOLDERS for line in page.read_text(encoding="utf-8").splitlines()]
    assert [(page, line) for page, line in lost if line.lstrip().startswith("%")] == []
