"""A real Chromium for tests of pages; without one, or without playwright, a module that needs it is left out."""

import contextlib
import shutil

import pytest

playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright (extra dev)")
axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="needs axe-core (extra dev)")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
if CHROMIUM is None:
    pytest.skip("needs a Chromium", allow_module_level=True)

FLAGS = [
    "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--disable-gpu-watchdog",
]  # fmt: skip


OF_THE_BROWSER = ("WebSocket connection to", "net::ERR_", "WebGL context")
"""What errors name that are none of a page: a connection or a GPU process that a busy computer is too slow for."""


@contextlib.contextmanager
def launched():
    """A Chromium that is closed in the end."""
    with playwright.sync_playwright() as p:
        found = p.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield found
        found.close()


def wrong_on(page, *places):
    """What goes wrong on a page from now on, as a list that grows: its errors, and what it fetches from elsewhere."""
    wrong = []

    def said(message):
        if message.type == "error" and not any(one in message.text for one in OF_THE_BROWSER):
            wrong.append(message.text)

    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("console", said)
    page.on("request", lambda r: None if not places or r.url.startswith((*places, "data:")) else wrong.append(r.url))
    return wrong


def nothing(wrong, page):
    """Assert that nothing has gone wrong so far; what ends with the page that closes is no error of it."""
    if not page.is_closed():
        page.evaluate("0")  # whatever was said before has come with the answer
    found = list(wrong)
    page.context.close()
    assert found == [], "\n".join(found)


def violations(page):
    """What axe-core finds of the page as it is that keeps somebody out, and where."""
    return [
        (one["impact"], one["id"], [node["html"][:200] for node in one["nodes"]])
        for one in axe.Axe().run(page).response["violations"]
        if one["impact"] in ("serious", "critical")
    ]
