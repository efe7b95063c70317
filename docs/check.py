"""Check a site that was built: every link and picture inside it is there, and nothing is fetched from elsewhere.

python docs/check.py build/site
"""

from __future__ import annotations

import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

#: links that a reader follows; what any other tag names is fetched when the page is shown
FOLLOWED = {"a"}
#: relations of `<link>` that a browser fetches nothing for
NOT_FETCHED = {"canonical", "author", "license", "next", "prev", "index", "search", "genindex"}


class Page(HTMLParser):
    """What a page names, and the anchors it has."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.followed: set[str] = set()
        self.fetched: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Keep anchors and addresses."""
        given = {name: value or "" for name, value in attrs}
        self.anchors |= {given[key] for key in ("id", "name") if key in given}
        kept = tag in FOLLOWED or (tag == "link" and set(given.get("rel", "").split()) <= NOT_FETCHED)
        for key in ("href", "src", "srcset", "data", "poster", "action"):
            if key in given:
                (self.followed if kept else self.fetched).add(given[key])


def outside(address: str) -> bool:
    """Whether an address leaves the site."""
    return bool(urlsplit(address).netloc) or urlsplit(address).scheme in {"http", "https"}


def faults(site: Path) -> list[str]:
    """What is wrong with a site, a line each."""
    pages = {file: Page(file.read_text(encoding="utf-8")) for file in sorted(site.rglob("*.html"))}
    found = []
    for file, page in pages.items():
        shown = file.relative_to(site)
        found += [f"{shown}: fetches {address}" for address in sorted(page.fetched) if outside(address)]
        for address in sorted(page.fetched | page.followed):
            parts = urlsplit(address)
            if parts.scheme or parts.netloc:
                continue
            target = (file.parent / unquote(parts.path)).resolve() if parts.path else file
            if not target.is_file():
                found.append(f"{shown}: {address} is not there")
            elif target in pages and parts.fragment and unquote(parts.fragment) not in pages[target].anchors:
                found.append(f"{shown}: {address} has no such anchor")
    for file in sorted(site.rglob("*.css")):
        fetched = re.findall(r"(?:url\(|@import)\s*[\"']?((?:https?:)?//[^\"')]*)", file.read_text(encoding="utf-8"))
        found += [f"{file.relative_to(site)}: fetches {address}" for address in fetched]
    if not pages:
        found.append(f"{site}: no pages")
    return found


def main() -> None:
    """Print what is wrong, or how many pages are right."""
    site = Path(sys.argv[1]).resolve()
    wrong = faults(site)
    pages = len(list(site.rglob("*.html")))
    print("\n".join(wrong) or f"{site.name}: {pages} pages, every link inside them leads somewhere, nothing is fetched")
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
