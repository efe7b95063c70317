"""Check a site that was built: links and pictures are there, nothing is fetched, pages have titles and no raw Markdown.

Every example prints what it should, by the output on its page.

Where Chromium and playwright are installed, tables and outputs have to fit into a window of 1400 px, too, and every
picture has to be one of the dark theme: turned around, or on a card (docs/_static/dark.css).

python docs/check.py build/site
"""

from __future__ import annotations

import html
import re
import shutil
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

#: links that a reader follows; what any other tag names is fetched when the page is shown
FOLLOWED = {"a"}
#: relations of `<link>` that a browser fetches nothing for
NOT_FETCHED = {"canonical", "author", "license", "next", "prev", "index", "search", "genindex"}
#: elements whose text is shown as it stands, or not at all
VERBATIM = {"pre", "code", "script", "style", "svg"}
#: elements that begin a line
BLOCKS = {"div", "dd", "dt", "h1", "h2", "h3", "li", "p", "td", "th"}
#: Markdown that was not rendered: a link, a fence, bold text, the list item or heading of a line
MARKDOWN = re.compile(r"\]\([\w./#-]+\)|```|\*\*\S[^*\n]*\*\*|^\s*(?:#{1,4} \S|- \[)", flags=re.MULTILINE)


WIDTH = 1400
"""Of a window in which no page may scroll sideways [px]."""
WIDER = """() => {
  const boxes = [...document.querySelectorAll('article pre, article .table-wrapper')];
  const wide = boxes.filter(box => box.scrollWidth > box.clientWidth + 1).map(box => box.textContent.trim());
  return document.documentElement.scrollWidth > innerWidth ? ['the page', ...wide] : wide;
}"""


UNLIT = """() => document.body.dataset.theme === undefined ? [] : [...document.images].filter(one => {
  const style = getComputedStyle(one);
  return style.filter === 'none' && style.backgroundColor === 'rgba(0, 0, 0, 0)';
}).map(one => one.getAttribute('src'))"""
"""Pictures that a page of the theme shows in the dark as they are in the light."""


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
"""What an example prints, by the name of its file: a regular expression."""
PRINTED = re.compile(r"sphx-glr-script-out.*?<pre>(.*?)</pre>", flags=re.DOTALL)


class Page(HTMLParser):
    """What a page names, the anchors it has, its title, and its text outside of code."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.followed: set[str] = set()
        self.fetched: set[str] = set()
        self.title = self.text = ""
        self._inside: list[str] = []
        self.feed(text)

    def handle_endtag(self, tag: str) -> None:
        """Leave a title, or what is shown as it stands."""
        if self._inside and self._inside[-1] == tag:
            self._inside.pop()

    def handle_data(self, data: str) -> None:
        """Keep title and text."""
        if self._inside and self._inside[0] in VERBATIM:
            return
        if self._inside:
            self.title += data
        else:
            self.text += data

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Keep anchors and addresses."""
        if tag in BLOCKS:
            self.text += "\n"
        if tag in VERBATIM or (tag == "title" and not self._inside):
            self._inside.append(tag)
        given = {name: value or "" for name, value in attrs}
        self.anchors |= {given[key] for key in ("id", "name") if key in given}
        kept = tag in FOLLOWED or (tag == "link" and set(given.get("rel", "").split()) <= NOT_FETCHED)
        for key in ("href", "src", "srcset", "data", "poster", "action"):
            if key in given:
                (self.followed if kept else self.fetched).add(given[key])


def outside(address: str) -> bool:
    """Whether an address leaves the site."""
    return bool(urlsplit(address).netloc) or urlsplit(address).scheme in {"http", "https"}


def unfinished(page: Page) -> list[str]:
    """What a reader would see of a page that was not rendered: no title, or Markdown."""
    found = ["has no title"] if "<no title>" in page.title or not page.title.strip() else []
    return found + [f"shows Markdown: {match.strip()[:60]}" for match in MARKDOWN.findall(page.text)]


def faults(site: Path) -> list[str]:
    """What is wrong with a site, a line each."""
    pages = {file: Page(file.read_text(encoding="utf-8")) for file in sorted(site.rglob("*.html"))}
    found = []
    for file, page in pages.items():
        shown = file.relative_to(site)
        found += [f"{shown}: {fault}" for fault in unfinished(page)]
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


def examples_that_differ(site: Path) -> list[str]:
    """Examples of the gallery that print something else than they should, a line each."""
    found = []
    for name, says in SAYS.items():
        page = site / "gallery" / f"{Path(name).stem}.html"
        if page.is_file():
            blocks = PRINTED.findall(page.read_text(encoding="utf-8"))
            printed = "".join(html.unescape(re.sub("<[^>]*>", "", block)) for block in blocks)
            if not re.search(says, printed):
                found.append(f"{page.relative_to(site)}: prints {printed[:200]!r}, not {says!r}")
    return found


def in_browser(site: Path) -> list[str]:
    """What does not fit into a window or lacks the dark theme, a line each; nothing where there is no browser."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        return []
    if chromium is None:
        return []
    found = []
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        window = browser.new_page(viewport={"width": WIDTH, "height": 900}, color_scheme="dark")
        for file in sorted(site.rglob("*.html")):
            window.goto(file.as_uri())
            wide = window.evaluate(WIDER)
            found += [f"{file.relative_to(site)}: wider than {WIDTH} px: {' '.join(one.split())[:60]}" for one in wide]
            unlit = window.evaluate(UNLIT)
            found += [f"{file.relative_to(site)}: {one} is missing in the dark theme" for one in unlit]
        browser.close()
    return found


def main() -> None:
    """Print what is wrong, or how many pages are right."""
    site = Path(sys.argv[1]).resolve()
    wrong = faults(site) + examples_that_differ(site) + in_browser(site)
    pages = len(list(site.rglob("*.html")))
    good = f"{site.name}: {pages} pages with titles, every link inside them leads somewhere, nothing is fetched"
    print("\n".join(wrong) or good)
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
