"""The folder of compiled models runs as code: nobody but the user may be able to put anything there."""

import importlib.util
import marshal
import os
import pickle
import stat
import subprocess
import sys
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from ramsight import posix
from ramsight.engine import private_folder as module
from ramsight.engine.cache import generated_module
from ramsight.engine.private_folder import FolderError, FolderWarning, private_folder, refusal

pytestmark = pytest.mark.posix  # modes and owners of files

_CHILD = """
import casadi as ca, numpy as np
from ramsight.engine.cache import generated_module
x = ca.SX.sym("x")
model = generated_module({"twice": ca.Function("twice", [x], [2.0 * x + 0.125], ["x"], ["z"])}, {}, "")
z = np.empty(1)
model.twice(np.array([21.0]), z)
print(z[0])
"""

_LOADED = _CHILD.replace("print(z[0])", "print(z[0], model.twice.loaded)")
_MODEST = """
from llvmlite import binding
binding.get_host_cpu_name = lambda: "x86-64"
binding.get_host_cpu_features = lambda: binding.FeatureMap({"sse2": True})
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
    (file,) = (tmp_path / "above" / "cache").iterdir()
    assert file.suffix == ".o"
    assert mode(file) == 0o600


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
    (open_to_all, r"others may write into it \(mode 0777\)"), (a_link, "it is a link"),
    (below_an_open_folder, "not sticky"), (below_a_link_into_an_open_folder, "not sticky"),
]  # fmt: skip


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
    monkeypatch.setattr(posix, "user", lambda: os.getuid() + 1)
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
    assert child(good, code=_LOADED).stdout == "42.125 0\n"
    trap = open_to_all(tmp_path / "trap")
    for file in good.iterdir():
        (trap / file.name).write_bytes(file.read_bytes())
    done = child(trap, code=_LOADED, TMPDIR=str(tmp_path))
    assert done.stdout == "42.125 0\n"
    assert "others may write into it" in done.stderr
    assert "RAMSIGHT_CACHE" in done.stderr


def test_nothing_but_machine_code_is_read_from_the_folder(tmp_path):
    """No source, no bytecode, no pickle: whatever else lies there is not looked at."""
    folder = tmp_path / "cache"
    assert child(folder).stdout == "42.125\n"
    (file,) = folder.iterdir()
    name = file.name.partition(".")[0]
    (folder / f"{name}.py").write_text("print('run by mistake')\n")
    evil = compile("print('run by mistake')", "forged", "exec")
    forged = Path(importlib.util.cache_from_source(str(folder / f"{name}.py")))
    forged.parent.mkdir()
    forged.write_bytes(unchecked(evil))
    (forged.parent / f"{name}.twice-9.py311.nbi").write_bytes(pickle.dumps(Evil()))
    done = child(folder, code=_LOADED)
    assert done.stdout == "42.125 1\n", done.stderr


class Evil:
    """What a pickle can do."""

    def __reduce__(self):
        return print, ("run by mistake",)


def unchecked(code) -> bytes:
    """Bytecode that Python runs without comparing it with its source (PEP 552)."""
    return importlib.util.MAGIC_NUMBER + (1).to_bytes(4, "little") + bytes(8) + marshal.dumps(code)


@pytest.mark.skipif(getattr(os, "getuid", int)() != 0, reason="only root can give files away")
def test_machine_code_of_somebody_else_is_made_again(tmp_path):
    folder = tmp_path / "cache"
    assert child(folder).stdout == "42.125\n"
    (file,) = folder.iterdir()
    os.chown(file, 65534, 65534)
    assert child(folder, code=_LOADED).stdout == "42.125 0\n"
    assert file.stat().st_uid == 0


@pytest.mark.slow
@pytest.mark.parametrize("place", [0, 20, 60, -1])
def test_damaged_machine_code_is_made_again(tmp_path, place):
    folder = tmp_path / "cache"
    assert child(folder).stdout == "42.125\n"
    (file,) = folder.iterdir()
    content = bytearray(file.read_bytes())
    content[place] ^= 0x10
    for damaged in (bytes(content), content[: len(content) // 2], b""):
        file.write_bytes(damaged)
        assert child(folder, code=_LOADED).stdout == "42.125 0\n"
    assert child(folder, code=_LOADED).stdout == "42.125 1\n"


def test_machine_code_of_another_processor_is_not_taken(tmp_path):
    assert child(tmp_path, code=_MODEST + _LOADED).stdout == "42.125 0\n"
    assert child(tmp_path, code=_LOADED).stdout == "42.125 0\n"
    assert child(tmp_path, code=_LOADED).stdout == "42.125 1\n"


def test_optimized_code_is_not_taken_for_what_is_not_and_both_are_kept(tmp_path):
    for told, loaded in (("no", 0), ("yes", 0), ("no", 1), ("", 1)):
        assert child(tmp_path, code=_LOADED, RAMSIGHT_OPTIMIZE=told).stdout == f"42.125 {loaded}\n"
    assert len(list(tmp_path.iterdir())) == 2


def test_an_array_that_is_not_whole_is_refused():
    x = ca.SX.sym("x")
    model = generated_module({"twice": ca.Function("twice", [x], [2.0 * x], ["x"], ["z"])}, {}, "")
    with pytest.raises(ValueError, match="C-contiguous"):
        model.twice(np.ones(4)[::2], np.empty(1))
    with pytest.raises(TypeError, match="float32"):
        model.twice(np.ones(1, dtype=np.float32), np.empty(1))
