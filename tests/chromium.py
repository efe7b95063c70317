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
    "--disable-component-update", "--disable-sync",
]  # fmt: skip


@contextlib.contextmanager
def launched():
    """A Chromium that is closed in the end."""
    with playwright.sync_playwright() as p:
        found = p.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield found
        found.close()


def violations(page):
    """What axe-core finds of the page as it is that keeps somebody out, and where."""
    return [
        (one["impact"], one["id"], [node["html"][:200] for node in one["nodes"]])
        for one in axe.Axe().run(page).response["violations"]
        if one["impact"] in ("serious", "critical")
    ]
