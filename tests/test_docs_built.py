"""The site is built again where anything of the project has changed, and only there."""

import subprocess
from pathlib import Path

import pytest


@pytest.fixture
def built(tmp_path, monkeypatch, script):
    """Whether a project's site is as its files are."""
    module = script("built", "docs")
    subprocess.run(["git", "init", "-q", tmp_path], check=True)
    (tmp_path / ".gitignore").write_text("build/\n")
    (tmp_path / "page.md").write_text("a page\n")
    (tmp_path / "build" / "site").mkdir(parents=True)
    monkeypatch.chdir(tmp_path)
    site = Path("build/site")
    assert module.main(site, done=False) == 1
    module.main(site, done=True)
    return lambda: module.main(site, done=False) == 0


@pytest.mark.parametrize(
    ("change", "stays"),
    [
        (lambda: None, True),
        (lambda: Path("page.md").touch(), True),
        (lambda: Path("build/other").write_text("ignored"), True),
        (lambda: Path("page.md").write_text("b page\n"), False),
        (lambda: Path("new.py").write_text(""), False),
        (lambda: Path("page.md").rename("other.md"), False),
        (lambda: Path("page.md").unlink(), False),
        (lambda: Path("build/site/.built").unlink(), False),
    ],
)
def test_the_site_stays_only_where_nothing_has_changed(built, change, stays):
    change()
    assert built() is stays


def test_outside_of_git_the_site_is_always_built(built, tmp_path):
    (tmp_path / ".git").rename(tmp_path / "no-git")
    assert not built()
