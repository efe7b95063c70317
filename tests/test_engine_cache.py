"""The folder of compiled models runs as code: nobody but the user may be able to put anything there."""

import importlib.util
import marshal
import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from ramsight.engine import private_folder as module
from ramsight.engine.private_folder import FolderError, FolderWarning, private_folder, refusal

_CHILD = """
import casadi as ca, numpy as np
from ramsight.engine.cache import generated_module
x = ca.SX.sym("x")
model = generated_module({"twice": ca.Function("twice", [x], [2.0 * x + 0.125], ["x"], ["z"])}, {}, "")
z = np.empty(1)
model.twice(np.array([21.0]), z)
print(z[0])
"""


def child(folder, umask=0o022, code=_CHILD, **environment):
    return subprocess.run(
        [sys.executable, "-W", "always", "-c", code],
        env=os.environ | {"RAMSIGHT_CACHE": str(folder)} | environment,
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
        umask=umask,
    )


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """A folder for temporary files, as /tmp is."""
    folder = tmp_path / "tmp"
    folder.mkdir()
    folder.chmod(0o1777)
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    module._fresh.cache_clear()
    module._warn.cache_clear()
    yield folder
    module._fresh.cache_clear()


@pytest.mark.parametrize("umask", [0o000, 0o002, 0o022])
def test_the_folder_is_ours_alone_whatever_the_umask(tmp_path, umask):
    done = child(tmp_path / "above" / "cache", umask)
    assert done.stdout == "42.125\n", done.stderr
    assert done.stderr == ""
    assert mode(tmp_path / "above") == mode(tmp_path / "above" / "cache") == 0o700
    assert list((tmp_path / "above" / "cache" / "__pycache__").glob("model_*.nbi"))


def test_a_folder_that_others_may_only_read_is_closed_and_used(tmp_path):
    folder = tmp_path / "cache"
    folder.mkdir(mode=0o755)
    assert private_folder(folder, "") == folder
    assert mode(folder) == 0o700


def open_to_all(folder: Path) -> Path:
    folder.mkdir()
    folder.chmod(0o777)
    return folder


def a_link(folder: Path) -> Path:
    folder.with_name("target").mkdir(mode=0o700)
    folder.symlink_to(folder.with_name("target"))
    return folder


def below_an_open_folder(folder: Path) -> Path:
    open_to_all(folder.with_name("open"))
    return folder.with_name("open") / "cache"


def below_a_link_into_an_open_folder(folder: Path) -> Path:
    open_to_all(folder.with_name("open"))
    (folder.with_name("open") / "real").mkdir(mode=0o700)
    folder.with_name("link").symlink_to(folder.with_name("open") / "real")
    return folder.with_name("link") / "cache"


UNSAFE = [
    (open_to_all, r"others may write into it \(mode 0777\)"),
    (a_link, "it is a link"),
    (below_an_open_folder, "not sticky"),
    (below_a_link_into_an_open_folder, "not sticky"),
]


@pytest.mark.parametrize(("make", "says"), UNSAFE)
def test_a_folder_that_others_may_write_is_refused_and_a_private_one_used(tmp_path, temporary, make, says):
    wanted = make(tmp_path / "cache")
    with pytest.warns(FolderWarning, match=f"cache: not used, because .*{says}.*; the remedy"):
        found = private_folder(wanted, "the remedy")
    assert found.parent == temporary
    assert mode(found) == 0o700
    assert refusal(found) == ""


def test_a_folder_of_somebody_else_is_refused(tmp_path, monkeypatch):
    folder = tmp_path / "cache"
    folder.mkdir(mode=0o700)
    monkeypatch.setattr(module, "_user", lambda: os.getuid() + 1)
    assert "belongs to another user" in refusal(folder)


def test_a_prepared_folder_among_the_temporary_files_is_not_used(tmp_path, temporary):
    trap = temporary / f"ramsight-{os.getuid()}"
    open_to_all(trap)
    file = tmp_path / "file"
    file.write_text("")
    found = private_folder(file / "below", "the remedy")
    assert found != trap
    assert found.parent == temporary
    assert mode(found) == 0o700
    assert private_folder(file / "below", "the remedy") == found, "one for the process"


def test_where_no_folder_can_be_ours_alone_the_error_says_so(temporary):
    temporary.chmod(0o777)
    with pytest.raises(FolderError, match="not sticky; the remedy"):
        private_folder(Path("/proc/none/cache"), "the remedy")


def test_what_lies_in_a_folder_of_others_is_not_run(tmp_path):
    good = tmp_path / "good"
    assert child(good).stdout == "42.125\n"
    trap = open_to_all(tmp_path / "trap")
    for file in good.glob("model_*.py"):
        (trap / file.name).write_text("print('run by mistake')\n")
    done = child(trap, TMPDIR=str(tmp_path))
    assert done.stdout == "42.125\n"
    assert "others may write into it" in done.stderr
    assert "RAMSIGHT_CACHE" in done.stderr


def unchecked(code) -> bytes:
    """Bytecode that Python runs without comparing it with its source (PEP 552)."""
    return importlib.util.MAGIC_NUMBER + (1).to_bytes(4, "little") + bytes(8) + marshal.dumps(code)


def test_forged_bytecode_beside_a_good_source_is_not_run(tmp_path):
    folder = tmp_path / "cache"
    assert child(folder).stdout == "42.125\n"
    evil = compile("print('run by mistake')", "forged", "exec")
    for file in folder.glob("model_*.py"):
        forged = Path(importlib.util.cache_from_source(str(file)))
        forged.parent.mkdir(exist_ok=True)
        forged.write_bytes(unchecked(evil))
    done = child(folder)
    assert done.stdout == "42.125\n", done.stderr


@pytest.mark.skipif(os.getuid() != 0, reason="only root can give files away")
def test_machine_code_of_somebody_else_is_made_again(tmp_path):
    folder = tmp_path / "cache"
    assert child(folder).stdout == "42.125\n"
    files = list((folder / "__pycache__").glob("model_*.nb*"))
    before = {file.name: file.read_bytes() for file in files}
    for file in files:
        os.chown(file, 65534, 65534)
    assert child(folder).stdout == "42.125\n"
    assert before
    assert all((folder / "__pycache__" / name).stat().st_uid == 0 for name in before)


def test_no_folder_of_numbas_own_takes_its_place(tmp_path):
    home, folder = tmp_path / "home", tmp_path / "cache"
    for one in (home, folder):
        one.mkdir(mode=0o700)
    (folder / "__pycache__").write_text("a file in the way")
    looked = _CHILD + "\nprint(type(model._module.twice._cache).__name__)"
    environment = {"HOME": str(home), "XDG_CACHE_HOME": str(home / "caches")}
    done = child(folder, code=looked, **environment)
    assert done.stdout == "42.125\nNullCache\n", done.stderr
    assert [file for file in home.rglob("*") if file.is_file()] == []


def test_a_second_process_takes_the_machine_code_from_the_folder(tmp_path):
    counted = _CHILD.replace("print(z[0])", "print(sum(model._module.twice.stats.cache_hits.values()))")
    assert child(tmp_path, code=counted).stdout == "0\n"
    assert child(tmp_path, code=counted).stdout == "1\n"
