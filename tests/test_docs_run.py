"""Every shell and Python block of README and docs runs as it is copied, and prints what stands below it.

Tutorials have test_docs_tutorials.py.
"""

import gzip
import shlex
import shutil

import pytest
from typer.main import get_command
from typer.testing import CliRunner

from ramsight import machine
from ramsight.cli import app

from .shown import ROOT, alike, blocks

pytestmark = pytest.mark.slow

TRACES = ROOT / "tests" / "traces"
IN_FOLDERS = [page.relative_to(ROOT).as_posix() for page in sorted((ROOT / "docs").rglob("*.md"))]
APART = ("docs/tutorials/", "docs/gallery/")
"""Folders whose pages other tests run: test_docs_tutorials.py, and what makes the site."""
PAGES = ["README.md", *(page for page in IN_FOLDERS if not page.startswith(APART))]

OF_THE_SYSTEM = {"make", "python3", "source", "pip", "ip", "chrt", "cc", "cat", "cd"}
"""Commands that are not ramsight's; of `chrt` and its like what they start is looked at all the same."""
ONLY_PARSED = {
    "encoder": "needs a bus", "studio": "serves until it is interrupted", "datasheet": "has a test of its own",
    "page": "has a test of its own",
}  # fmt: skip
ASKS_FOR = {
    "log.csv.gz": "boom_asbuilt1_leaktest.csv.gz", "position.csv": "boom_asbuilt1_leaktest_truth.csv.gz",
    "truth.csv.gz": "boom_441kN_40C_truth.csv.gz", "day.csv.gz": "boom_asbuilt1_workday.csv.gz",
    "another-day.csv.gz": "boom_441kN_40C.csv.gz", "logs/boom_2026-02-01.csv.gz": "boom_441kN_40C.csv.gz",
    "logs/boom_2026-03-08.csv.gz": "boom_asbuilt1_leaktest.csv.gz",
}  # fmt: skip
"""Files that a page takes for granted: the reader's own."""
MAKES_ITS_MACHINE = ("docs/reference/commands.md",)
OF_DAYS = {"docs/how-to/identify.md": {"position.csv": "boom_asbuilt1_workday_truth.csv.gz"}}


def commands(block):
    """The commands of a shell block, lines joined, comments gone."""
    for line in block.text.replace("\\\n", " ").splitlines():
        words = shlex.split(line, comments=True)
        if words:
            yield words


@pytest.fixture
def folder(tmp_path, monkeypatch):
    def prepared(page):
        (tmp_path / "tests").symlink_to(ROOT / "tests")
        (tmp_path / "logs").mkdir()
        asked = ASKS_FOR | OF_DAYS.get(page, {})
        for name, trace in asked.items():
            if name.endswith(".gz"):
                shutil.copy(TRACES / trace, tmp_path / name)
            else:
                (tmp_path / name).write_bytes(gzip.decompress((TRACES / trace).read_bytes()))
        if page not in MAKES_ITS_MACHINE:
            (tmp_path / "my-machine.toml").write_text(machine.template(), encoding="utf-8")
        monkeypatch.chdir(tmp_path)
        return tmp_path

    return prepared


def invoked(words):
    """Run a command of ramsight; what it prints."""
    verb, rest = get_command(app), words[1:]
    while rest and rest[0] in getattr(verb, "commands", {}):
        verb, rest = verb.commands[rest[0]], rest[1:]
    if verb.name in ONLY_PARSED:
        verb.make_context(verb.name, rest)
        return None
    done = CliRunner().invoke(app, words[1:])
    assert done.exit_code == 0, (words, done.output, done.exception)
    return done.stdout


def pages_with(kind):
    """The pages that have such blocks."""
    return [page for page in PAGES if any(block.kind == kind for block in blocks(page))]


@pytest.mark.parametrize("page", pages_with("sh"))
@pytest.mark.filterwarnings("ignore::ramsight.errors.LogWarning")
def test_the_shell_blocks_of_a_page_run(page, folder):
    folder(page)
    for block in blocks(page):
        if block.kind != "sh":
            continue
        said = []
        for words in commands(block):
            if words[0] != "ramsight" and "ramsight" not in words:
                assert words[0] in OF_THE_SYSTEM, words
                continue
            said.append(invoked(words[words.index("ramsight") :]))
        if block.shown is not None and None not in said:
            assert alike("".join(said), block.shown), ("".join(said), block.shown)


RUN_BY_NAME = {"docs/how-to/python.md", "docs/how-to/control.md", "docs/how-to/mechanism.md"}
"""Pages whose Python test_docs.py and test_loader.py run, and look at what it leaves."""


@pytest.mark.parametrize("page", [page for page in pages_with("python") if page not in RUN_BY_NAME])
def test_the_python_blocks_of_a_page_run(page, folder):
    folder(page)
    names = {"__name__": "page"}
    for block in blocks(page):
        if block.kind == "python":
            exec(compile(block.text, page, "exec"), names)
