"""How long the sentences of pages are: python docs/sentences.py [PAGE …].

Code, tables, headings, comments and pictures do not count. A list item and a paragraph each end a sentence.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
LONG = 30
"""Words from which on a sentence is too long to be read at once."""
_BLOCKS = re.compile(r"^( *)```.*?^\1```|<!--.*?-->", flags=re.MULTILINE | re.DOTALL)
_LINES = re.compile(r"^(?:\||#|!\[|<| {4}\S|.*\|\s*$).*$", flags=re.MULTILINE)
_LINKS = re.compile(r"!?\[([^\]]*)\]\([^)]*\)")
_CODE = re.compile(r"`[^`]+`")
_ITEMS = re.compile(r"\n\s*\n|\n(?=\s*(?:[-*:]|\d+\.) )")
_ENDS = re.compile(r"(?<=[.!?])[*_)”\"]*\s+(?=[A-Z*`“\"(\d])")


def sentences(text: str) -> list[str]:
    """The sentences of a page in Markdown."""
    prose = _LINES.sub("", _BLOCKS.sub("\n\n", text))
    prose = _CODE.sub("CODE", _LINKS.sub(r"\1", prose))
    found = [" ".join(one.split()) for item in _ITEMS.split(prose) for one in _ENDS.split(item)]
    return [one.lstrip("-: ") for one in found if re.search(r"[a-z]{2}", one)]


def words(sentence: str) -> int:
    """How many words it has; a number with its unit is one or two."""
    return len(re.findall(r"[^\W_][\w.,'’%°/–-]*", sentence))


def share(text: str) -> float:
    """Share of a page's sentences that are longer than `LONG` words."""
    found = [words(one) for one in sentences(text)]
    return sum(count > LONG for count in found) / max(len(found), 1)


def main() -> None:
    """Print a line a page, the worst first, then the longest sentences of the pages that were named."""
    named = [Path(one) for one in sys.argv[1:]]
    pages = named or [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
    texts = {page: page.read_text(encoding="utf-8") for page in pages}
    for page in sorted(texts, key=lambda one: -share(texts[one])):
        count = [words(one) for one in sentences(texts[page])]
        longest = max(count, default=0)
        print(
            f"{100 * share(texts[page]):5.1f} % of {len(count):4d} sentences, longest {longest:3d} words  {page.name}"
        )
    for page in named:
        for one in sorted(sentences(texts[page]), key=words, reverse=True):
            if words(one) > LONG:
                print(f"\n{words(one)} words: {one}")


if __name__ == "__main__":
    main()
