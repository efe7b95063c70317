"""A studio under load: frames of other sites, visitors who vanish, and more of them than it lets in.

Every case looks at the server from outside: machines at a time, how long somebody else waits for the page, and what is
left behind.
"""

from __future__ import annotations

import contextlib
import importlib.util
import shutil
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import psutil
from harness import READ, REFUSED, WRONG, Rng, Section
from served_studio import ServedStudio, Visitor, Watched

LIMIT = 3
"""Visitors that are let in: what holds for three holds for eight, and two cores can run three machines."""

WAITED = 1.0
"""Seconds within which the page is served to others."""

GROWN = 250.0, 40
"""MiB and file descriptors that a server may have grown by. Pages are kept for a minute, and freed when Python collects
garbage: 2100 pages came to 42 MiB and stayed there, 1050 visitors who vanished to 130 MiB and hardly more."""

_SETTLES = 40.0  # s, from the last visitor's going until his machine has ended
_FORGETS = 75.0  # s, after which a page that nobody looks at is forgotten
_SEES = 60.0  # s, within which each of many visitors gets an answer
_AT_ONCE = 10  # visitors who come together
_FLAGS = ["--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking", "--disable-sync"]
Found = tuple["str | Counter[str]", str]


@dataclass
class Prepared:
    """The studio, and what it had before anybody came."""

    studio: ServedStudio  # that serves
    before: tuple[float, int]  # its memory [MiB] and file descriptors
    browser: Any  # a Chromium; None where there is none


def prepare(folder: Path) -> Prepared:
    """A studio that has had one visitor, so that what is made once is made."""
    browser = _browser()
    studio = ServedStudio(LIMIT, folder)
    one = Visitor(studio)
    one.sees(_SEES)
    one.drop()
    studio.settled(_SETTLES)
    return Prepared(studio, studio.kept(), browser)


def _browser() -> Any:
    path = shutil.which("chromium") or shutil.which("chromium-browser")
    if path is None or importlib.util.find_spec("playwright") is None:
        return None
    from playwright.sync_api import sync_playwright

    browser = sync_playwright().start().chromium.launch(executable_path=path, args=_FLAGS)
    for one in psutil.Process().children(recursive=True):
        one.nice(19)  # a visitor's browser has a computer of its own
    return browser


def judged(prepared: Prepared, visits: Callable[[], Counter[str]]) -> Found:
    """Let visitors come while the server is looked at; what is wrong with it then and afterwards."""
    studio, wrong = prepared.studio, []
    with Watched(studio) as watched:
        found = visits()
        left = studio.settled(_SETTLES)
    memory, descriptors = (now - old for now, old in zip(studio.kept(), prepared.before, strict=True))
    said = f"{watched.most} machines at most, others waited {watched.waited:.2f} s, {left} machines left"
    said += f", {memory:+.0f} MiB, {descriptors:+d} descriptors"
    wrong += ["more machines than visitors"] * (watched.most > LIMIT) + ["machines are left"] * (left > 0)
    wrong += ["others waited"] * (watched.waited > WAITED) + ["memory"] * (memory > GROWN[0])
    wrong += ["descriptors"] * (descriptors > GROWN[1]) + ["a traceback"] * ("Traceback" in studio.said())
    return (WRONG if wrong else found), f"{', '.join(wrong)}: {said}" if wrong else said


def frames(prepared: Prepared, count: int) -> Counter[str]:
    """A page of another site with so many frames of the studio, in a browser; or as a browser asks for them."""
    studio = prepared.studio
    if prepared.browser is None:
        asked = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "iframe"}
        return Counter(READ if studio.get(**asked)[0] == 200 else REFUSED for _ in range(count))
    text = "".join(f'<iframe src="{studio.address}?{k}"></iframe>' for k in range(count))
    statuses: list[int] = []
    with _site(text) as address:
        page = prepared.browser.new_page()
        page.on("response", lambda one: statuses.append(one.status) if one.url.startswith(studio.address) else None)
        page.goto(address)
        until = time.monotonic() + _SEES
        while len(statuses) < count and time.monotonic() < until:
            page.wait_for_timeout(50)
        page.close()
    return Counter(READ if one == 200 else REFUSED for one in statuses)


@contextlib.contextmanager
def _site(text: str) -> Any:
    """A site of another name with one page; its address."""

    class Page(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("content-type", "text/html")
            self.end_headers()
            self.wfile.write(text.encode())

        def log_message(self, *_: Any) -> None:
            """Say nothing."""

    class Quiet(ThreadingHTTPServer):
        def handle_error(self, *_: Any) -> None:
            """Say nothing: a browser may close its page before all has been sent."""

    server = Quiet(("127.0.0.1", 0), Page)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://localhost:{server.server_address[1]}/"
    finally:
        server.shutdown()


def vanishing(studio: ServedStudio, rng: Rng, count: int) -> Counter[str]:
    """Visitors who come together and break their connections off after up to three seconds."""
    found: Counter[str] = Counter()
    for begun in range(0, count, _AT_ONCE):
        stays = [float(rng.choice([0.0, 0.1, 3.0])) for _ in range(min(_AT_ONCE, count - begun))]
        with ThreadPoolExecutor(_AT_ONCE) as pool:
            found += Counter(pool.map(partial(_vanish, studio), stays))
    return found


def _vanish(studio: ServedStudio, stays: float) -> str:
    one = Visitor(studio)
    seen = one.sees(stays) if stays else ""
    one.drop()
    return REFUSED if seen == "full" else READ


def crowd(studio: ServedStudio, count: int) -> Counter[str]:
    """So many sessions at a time: each gets a machine or is told why not."""
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        visitors = list(pool.map(lambda _: Visitor(studio), range(count)))
        seen = Counter(pool.map(lambda one: one.sees(_SEES), visitors))
    for one in visitors:
        one.drop()
    if seen["machine"] + seen["full"] < count:
        raise AssertionError(f"{seen} of {count}")
    return Counter({READ: seen["machine"], REFUSED: seen["full"]})


def _frames(prepared: Prepared, _: Rng, __: Path) -> Found:
    return judged(prepared, partial(frames, prepared, 20))


def _vanishing(prepared: Prepared, rng: Rng, _: Path) -> Found:
    return judged(prepared, partial(vanishing, prepared.studio, rng, 50))


def _crowd(prepared: Prepared, _: Rng, __: Path) -> Found:
    return judged(prepared, partial(crowd, prepared.studio, 200))


def main() -> None:
    """Print what is measured of each kind, in full numbers."""
    import numpy as np

    with tempfile.TemporaryDirectory() as folder:
        prepared, rng = prepare(Path(folder)), np.random.default_rng(1)
        vanish = ("500 visitors who vanish", partial(vanishing, prepared.studio, rng, 500))
        many = ("200 at a time", partial(crowd, prepared.studio, 200))
        for name, visits in (("100 frames", partial(frames, prepared, 100)), vanish, vanish, vanish, many):
            begun = time.monotonic()
            found, said = judged(prepared, visits)
            print(f"{name}: {found}, {said}, {time.monotonic() - begun:.0f} s", flush=True)
        time.sleep(_FORGETS)
        print(f"{_FORGETS:g} s later: {_kept(prepared)}", flush=True)
        print(prepared.studio.said()[:3000])
        prepared.studio.end()


def _kept(prepared: Prepared) -> str:
    """Memory and descriptors beside those before anybody came."""
    pairs = zip(("MiB", "descriptors"), prepared.studio.kept(), prepared.before, strict=True)
    return ", ".join(f"{now - old:+.0f} {name}" for name, now, old in pairs)


_HAS_STUDIO = importlib.util.find_spec("nicegui") is not None
SECTIONS = [
    Section("studio: frames of another site", 5, prepare, _frames, 300.0, tells=True),
    Section("studio: visitors who vanish", 10, prepare, _vanishing, 300.0, tells=True),
    Section("studio: 200 visitors at a time", 1, prepare, _crowd, 300.0, tells=True),
] if _HAS_STUDIO else []  # fmt: skip

if __name__ == "__main__":
    main()
