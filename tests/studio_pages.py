"""A studio that serves, and a browser that visits it: what tests of its pages share."""

import contextlib
import json
import os
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path

import psutil
import pytest

from .chromium import launched, nothing, wrong_on
from .waiting import PATIENCE, wait_for

TRACES = Path(__file__).parent / "traces"
READY = 1e3 * PATIENCE  # ms, until a machine runs; whatever has to be compiled is in it


def answered(request):
    """Status and text of an answer, also of a refusal; nothing of it stays open."""
    try:
        answer = urllib.request.urlopen(request, timeout=PATIENCE)
    except urllib.error.HTTPError as refused:
        answer = refused
    with answer:
        return answer.status, answer.read().decode(errors="replace")


def of_a_user():
    """The environment without pytest's variables, which NiceGUI takes for a test of itself, and with optimized code.

    A machine keeps up with real time only with that. Both kinds of code differ in the last digits.
    """
    return {n: v for n, v in os.environ.items() if not n.startswith("PYTEST_") and n != "RAMSIGHT_OPTIMIZE"}


def listens(port):
    """Whether somebody answers at a port of this machine."""
    with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port)):
        return True
    return False


@contextlib.contextmanager
def studio(*words):
    """A studio that serves; its address and process."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "ramsight", "studio", *words, "--no-show", "--port", str(port)]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=of_a_user())
    try:
        line = server.stdout.readline()
        assert "ramsight studio: http" in line, line
        wait_for(lambda: listens(port))
        yield line.split(": ", 1)[1].strip(), server
    finally:
        server.terminate()
        server.wait(PATIENCE)
        server.stdout.close()


@pytest.fixture(scope="module")
def loader():
    with studio("mining-loader") as served:
        yield served


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with launched() as found:
        yield found


@pytest.fixture
def visitor(browser):
    """Opens a page for a visitor of his own, who is as patient as a busy computer needs; its context may be closed."""
    contexts = []

    def come():
        contexts.append(browser.new_context(viewport={"width": 1500, "height": 1000}))
        contexts[-1].set_default_timeout(READY)
        return contexts[-1].new_page()

    yield come
    for context in contexts:
        context.close()


def runs(page, address):
    """Go to a machine, and wait until it runs."""
    page.goto(address)
    page.get_by_text("runs", exact=True).wait_for()


@pytest.fixture
def page(loader, visitor):
    """A page of the loader, which must fetch nothing from elsewhere and have no errors."""
    address, _ = loader
    opened = visitor()
    wrong = wrong_on(opened, address, "blob:")
    runs(opened, f"{address}?play=none")
    yield opened
    nothing(wrong, opened)


FIXTURES = browser, loader, visitor, page


def newest(page, name, unit="boom"):
    return page.evaluate(f"studio.units[{json.dumps(unit)}][{json.dumps(name)}]?.at(-1) ?? null")


def wait(page, condition):
    wait_for(condition, lambda: page.wait_for_timeout(100))


def picture(page, name):
    """Renew a picture of docs/how-to/studio.md, if wanted."""
    if folder := os.environ.get("RAMSIGHT_PICTURES"):
        page.screenshot(path=Path(folder) / name)


def workers(server):
    return [p for p in psutil.Process(server.pid).children(recursive=True) if "spawn_main" in line(p)]


def line(process):
    """A process's command line; nothing of one that has just ended."""
    with contextlib.suppress(psutil.NoSuchProcess):  # a zombie is one, too
        return " ".join(process.cmdline())
    return ""
