"""Every tutorial runs as it is written: its commands in their order, in an empty folder, and prints what it shows."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from .shown import ROOT, SAVED, alike, blocks

TUTORIALS = sorted(page.stem for page in (ROOT / "docs" / "tutorials").glob("*.md") if page.stem != "index")
SLOW = {
    "commissioning-at-your-desk", "first-position", "into-c", "is-my-pump-wearing", "onto-can", "weigh-what-you-lift",
    "your-machine",
}  # fmt: skip
"""Those that take seconds of processor time, or play a log in real time."""
NEEDS = {"onto-can": "can", "into-c": "cc"}
TRIES = {"onto-can": 8}
"""Of what plays a log in real time: a computer that is busy with others loses frames, and the sensor its place."""


def marked(name):
    return pytest.param(name, marks=[pytest.mark.slow] if name in SLOW else [])


@pytest.fixture
def typed(tmp_path):
    """Type commands into a shell in an empty folder, with `ramsight` and `python` as an installation has them."""
    there, folder = tmp_path / "bin", tmp_path / "empty"
    folder.mkdir()
    there.mkdir()
    for name, words in (("ramsight", "-m ramsight"), ("python", "")):
        (there / name).write_text(f'#!/bin/sh\nexec "{sys.executable}" {words} "$@"\n', encoding="utf-8")
        (there / name).chmod(0o755)
    kept = {name: value for name, value in os.environ.items() if name != "COLUMNS"}
    sources = os.pathsep.join([str(ROOT / "src"), *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = kept | {
        "PATH": f"{there}{os.pathsep}{os.environ['PATH']}", "PYTHONPATH": sources, "MPLBACKEND": "Agg",
    }  # fmt: skip

    def run(text):
        done = subprocess.run(
            ["bash", "-e", "-c", text], cwd=folder, env=environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, (text, done.stdout, done.stderr)
        return done.stdout

    return folder, run


def typed_until_it_shows(run, block, tries):
    """What a block says, the last of some tries."""
    for left in reversed(range(tries)):
        try:
            said = run(block.text)
        except AssertionError:
            if not left:
                raise
            continue
        if block.shown is None or alike(said, block.shown):
            return said
    return said


def test_there_are_six_tutorials_and_a_block_is_saved_where_its_page_says():
    assert len(TUTORIALS) >= 6
    assert SLOW | NEEDS.keys() <= set(TUTORIALS)
    assert SAVED.findall("Save it as `main.c`: and save this as\n`loop.py`") == ["main.c", "loop.py"]


@pytest.mark.parametrize("name", [marked(name) for name in TUTORIALS])
def test_a_tutorial_runs_as_it_is_written(name, typed):
    needed = NEEDS.get(name)
    if needed == "can":
        pytest.importorskip("can")
    elif needed and shutil.which(needed) is None:
        pytest.skip(f"{needed} is not there")
    folder, run = typed
    shown = 0
    for block in blocks(f"docs/tutorials/{name}.md"):
        if block.kind == "sh":
            said = typed_until_it_shows(run, block, TRIES.get(name, 1))
            if block.shown is not None:
                shown += 1
                assert alike(said, block.shown), (block.text, said, block.shown)
        else:
            assert block.saved, block.text
            Path(folder, block.saved).write_text(block.text, encoding="utf-8")
    assert shown
