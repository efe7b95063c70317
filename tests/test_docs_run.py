"""Every shell and Python block of README and docs/*.md runs as it is copied, and prints what stands below it."""

import re
import shlex
import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest
from typer.main import get_command
from typer.testing import CliRunner

from ramsight.cli import app

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parent.parent
TRACES = ROOT / "tests" / "traces"
PAGES = ["README.md", *sorted(f"docs/{page.name}" for page in (ROOT / "docs").glob("*.md"))]
FENCE = re.compile(r"^```(\w*)\n(.*?)^```", flags=re.DOTALL | re.MULTILINE)

OF_THE_SYSTEM = {"make", "source", "pip", "ip", "chrt", "cc", "cat", "cd"}
"""Commands that are not ramsight's; of `chrt` and its like what they start is looked at all the same."""
ONLY_PARSED = {
    "encoder": "needs a bus",
    "studio": "serves until it is interrupted",
    "datasheet": "has a test of its own",
    "paper": "has a test of its own",
    "loader": "has a test of its own",
}
ASKS_FOR = {
    "log.csv.gz": "boom_asbuilt1_leaktest.csv.gz",
    "position.csv": "boom_asbuilt1_leaktest_truth.csv.gz",
    "truth.csv.gz": "boom_441kN_40C_truth.csv.gz",
    "day.csv.gz": "boom_asbuilt1_workday.csv.gz",
    "another-day.csv.gz": "boom_441kN_40C.csv.gz",
}
"""Files that a page takes for granted: the reader's own."""
MAKES_ITS_MACHINE = ("README.md", "docs/getting-started.md")
OF_DAYS = {"docs/identify.md": {"position.csv": "boom_asbuilt1_workday_truth.csv.gz"}}


@dataclass(frozen=True)
class Block:
    kind: str
    text: str
    shown: str | None


def blocks(page):
    """The shell, Python and TOML blocks of a page; `text` right behind one is what it prints."""
    text = (ROOT / page).read_text(encoding="utf-8")
    fences = list(FENCE.finditer(text))
    for fence, after in zip(fences, [*fences, None][1:], strict=True):
        if fence[1] in ("sh", "python", "toml"):
            follows = after is not None and after[1] == "text" and not text[fence.end() : after.start()].strip()
            yield Block(fence[1], fence[2], after[2] if follows else None)


def describes_a_machine(block):
    """Whether it is a whole description; other TOML is a part of one, or of a catalogue."""
    return block.kind == "toml" and block.text.startswith("format = ")


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
        asked = ASKS_FOR | OF_DAYS.get(page, {})
        for name, trace in asked.items():
            if name.endswith(".gz"):
                shutil.copy(TRACES / trace, tmp_path / name)
            else:
                import gzip

                (tmp_path / name).write_bytes(gzip.decompress((TRACES / trace).read_bytes()))
        if page not in MAKES_ITS_MACHINE:
            (machine,) = [block for block in blocks("docs/getting-started.md") if describes_a_machine(block)]
            (tmp_path / "my-machine.toml").write_text(machine.text, encoding="utf-8")
        monkeypatch.chdir(tmp_path)
        return tmp_path

    return prepared


NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?")


def alike(said, shown):
    """Whether two outputs have the same words, and numbers that agree within what another processor may change."""
    words = [NUMBER.sub("#", text) for text in (said, shown)]
    pairs = zip(*(NUMBER.findall(text) for text in (said, shown)), strict=False)
    return words[0].split() == words[1].split() and all(
        float(one) == pytest.approx(float(other), rel=0.03, abs=0.02) for one, other in pairs
    )


def test_outputs_are_compared_by_words_and_numbers():
    assert alike("largest 0.105 mm", "largest 0.106  mm\n")
    assert not alike("largest 0.105 mm", "largest 0.205 mm")
    assert not alike("largest 0.105 mm", "final 0.105 mm")
    assert not alike("a 1.0 b", "a 1.0 b 2.0")


def invoked(words):
    """Run a command of ramsight; what it prints."""
    if words[1] in ONLY_PARSED:
        get_command(app).commands[words[1]].make_context(words[1], words[2:])
        return None
    done = CliRunner().invoke(app, words[1:])
    assert done.exit_code == 0, (words, done.output, done.exception)
    return done.stdout


@pytest.mark.parametrize("page", PAGES)
@pytest.mark.filterwarnings("ignore::ramsight.errors.LogWarning")
def test_the_shell_blocks_of_a_page_run(page, folder):
    found = [block for block in blocks(page) if block.kind == "sh"]
    if not found:
        pytest.skip("has none")
    where = folder(page)
    for block in blocks(page):
        if describes_a_machine(block) and page in MAKES_ITS_MACHINE:
            (where / "my-machine.toml").write_text(block.text, encoding="utf-8")
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


RUN_BY_NAME = {"README.md", "docs/getting-started.md", "docs/control.md"}
"""Pages whose Python test_docs.py runs, and looks at what it leaves."""


@pytest.mark.parametrize("page", [page for page in PAGES if page not in RUN_BY_NAME])
def test_the_python_blocks_of_a_page_run(page, folder):
    found = [block for block in blocks(page) if block.kind == "python"]
    if not found:
        pytest.skip("has none")
    folder(page)
    names = {"__name__": "page"}
    for block in found:
        exec(compile(block.text, page, "exec"), names)
