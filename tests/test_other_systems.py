"""Windows and macOS, as far as Linux can tell: a process without POSIX, object files of other systems, their paths."""

import os
import struct
import subprocess
import sys
from functools import cache
from pathlib import Path, PureWindowsPath

import pytest
from llvmlite import binding

from ramsight import posix, system
from ramsight.engine import object_code, recursion
from ramsight.errors import OutputError
from ramsight.logs import proposal
from ramsight.machine import load_machine, template
from ramsight.output.atomic import draft_of
from ramsight.output.exclusive import Exclusive, HeldError
from ramsight.plant.ddh import build_ddh
from ramsight.sensor.kalman import kalman
from tests import without_posix
from tests.command import at_once

ROOT = Path(__file__).parent.parent
LOG = ROOT / "tests" / "traces" / "boom_258kN_40C.csv.gz"

EVERY_MODULE = """
import importlib, pkgutil, ramsight
from ramsight import posix
from ramsight.errors import MissingPackageError
assert not posix.IS_HERE
names = [one.name for one in pkgutil.walk_packages(ramsight.__path__, "ramsight.") if not one.name.endswith("__main__")]
for name in names:
    importlib.import_module(name)
print(len(names))
"""

MAIN_PATHS = """
from pathlib import Path
import ramsight
from ramsight import system
from ramsight.engine.private_folder import cache_directory
from ramsight.output.exclusive import Exclusive, HeldError
from ramsight.machine import load_machine
from ramsight.plant.ddh import build_ddh
from ramsight.sensor.kalman import kalman
from ramsight.sensor.persistence import StateFile

print(cache_directory().is_relative_to(Path.home()))
run = ramsight.simulate("mining-loader", unit="boom", load="100 kN")
print(run.sizes["time"] > 100)
track = ramsight.track("mining-loader", LOG, unit="boom", state="boom.state")
print(track.sizes["time"] > 100)
print(Path("boom.state").stat().st_size > 1000, sorted(one.name for one in Path().glob("*.lock")))

boom = kalman(build_ddh("boom", load_machine("mining-loader").unit("boom")))
file, late = StateFile("boom.state", boom, "boom"), StateFile("boom.state", boom, "boom")
print(file.resume().found)
file.hold()
try:
    late.save()
except HeldError as error:
    print(error)
file.release()
late.save()
print(late.resume().found)

done = ramsight.export_c("mining-loader", "boom", out="boom-c", compiler="")
print(sorted(Path("boom-c").glob("*.c"))[0].read_bytes().count(b"\\r"), len(done.files) > 10)
print(system.processors() >= 1, system.forward() <= system.forward())
"""

CACHED = """
import casadi as ca, numpy as np
from ramsight.engine.cache import generated_module
x = ca.SX.sym("x")
model = generated_module({"twice": ca.Function("twice", [x], [2.0 * x + 0.125], ["x"], ["z"])}, {}, "")
z = np.empty(1)
model.twice(np.full(1, 21.0), z)
print(z[0], model.twice.loaded)
"""


@pytest.mark.slow
def test_every_module_can_be_imported_without_posix(tmp_path):
    (count,) = without_posix.run(EVERY_MODULE, tmp_path)
    assert int(count) > 400


def test_the_main_paths_go_without_posix(tmp_path):
    said = without_posix.run(f"LOG = {str(LOG)!r}\n{MAIN_PATHS}", tmp_path, RAMSIGHT_CACHE="")
    assert said == [
        "True",
        "True",
        "True",
        "True []",
        "True",
        "boom.state: another program has it; end that, or give another file",
        "True",
        "0 True",
        "True True",
    ]


@pytest.mark.slow
def test_the_command_line_goes_without_posix(tmp_path):
    code = "import sys; from ramsight.cli import main; sys.argv[1:] = {!r}; main()"
    words = ["simulate", "mining-loader", "--unit", "boom", "--load", "100 kN", "--log", "log.csv", "--out", "run.csv"]
    said = without_posix.run(code.format(words), tmp_path)
    assert sorted(said[-2:]) == ["log.csv: written", "run.csv: written"]
    words = ["track", "mining-loader", "log.csv", "--unit", "boom", "--out", "track.csv"]
    assert without_posix.run(code.format(words), tmp_path)[-1] == "track.csv: written"


def test_machine_code_is_kept_without_posix_where_the_profile_protects_it(tmp_path):
    (tmp_path / "home" / "temporary").mkdir(parents=True)
    inside, outside = tmp_path / "home" / "cache", tmp_path / "elsewhere"
    for loaded in (0, 1):
        assert without_posix.run(CACHED, tmp_path / "home", RAMSIGHT_CACHE=str(inside)) == [f"42.125 {loaded}"]
    outside.mkdir()
    for file in inside.iterdir():
        (outside / file.name).write_bytes(file.read_bytes())
    temporary = str(tmp_path / "home" / "temporary")
    said = without_posix.run(CACHED, tmp_path / "home", RAMSIGHT_CACHE=str(outside), TMPDIR=temporary)
    assert said == ["42.125 0"], "what lies there is not run"


def test_a_folder_is_ours_on_windows_only_below_the_profile(tmp_path, monkeypatch):
    home, link = tmp_path / "home", tmp_path / "link"
    (home / "cache").mkdir(parents=True)
    link.symlink_to(home / "cache")
    monkeypatch.setattr(posix, "IS_HERE", False)
    monkeypatch.setenv("HOME", str(home))
    assert system.folder_refusal(home / "cache") == ""
    assert system.folder_refusal(tmp_path) == f"it is not below your own folder {home}"
    assert system.folder_refusal(link) == "it is a link"
    (home / "out").symlink_to(tmp_path)
    assert "not below" in system.folder_refusal(home / "out" / "home" / ".." / ".")
    assert system.is_ours(home / "cache")
    assert not system.is_ours(link)


def test_a_lock_beside_a_file_is_one_for_all_links_to_it(tmp_path, monkeypatch):
    monkeypatch.setattr(system, "lock", system._lock_beside)
    path, link = tmp_path / "boom.state", tmp_path / "link.state"
    path.write_bytes(b"x")
    link.symlink_to(path)
    one, other = Exclusive(path), Exclusive(link)
    one.take()
    one.take()
    with pytest.raises(HeldError, match=r"link\.state: another program has it"):
        other.take()
    one.release()
    other.take()
    assert other.is_held
    other.release()
    assert path.read_bytes() == b"x"
    with pytest.raises(OutputError):
        Exclusive(tmp_path / "none" / "boom.state").take()


def test_a_process_is_looked_for_on_windows_and_gets_no_signal():
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    kernel = without_posix.Kernel32("kernel32")
    assert system._is_alive_on_windows(os.getpid(), kernel)
    assert not system._is_alive_on_windows(ended.pid, kernel)
    assert not system._is_alive_on_windows(0, kernel)
    assert not system._is_alive_on_windows(1 << 32, kernel)
    kernel.WaitForSingleObject = lambda handle, milliseconds: 0  # its handle is there, and it has ended
    assert not system._is_alive_on_windows(os.getpid(), kernel)
    kernel.OpenProcess, kernel.GetLastError = lambda *_: 0, lambda: 5
    assert system._is_alive_on_windows(4, kernel), "of another user"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("triple", "magic"),
    [
        ("x86_64-pc-windows-msvc", b"\x64\x86"),
        ("x86_64-apple-darwin", b"\xcf\xfa\xed\xfe"),
        ("x86_64-unknown-linux-gnu", b"\x7fELF"),
    ],
)
def test_machine_code_for_each_system_is_an_object_file_of_its_kind(triple, magic):
    assert object_file(triple).startswith(magic)


def test_machine_code_for_windows_asks_the_system_for_the_stack_probe_alone():
    """LLVM marks a file that has floating point with `_fltused`, to which nothing refers."""
    assert undefined(object_file("x86_64-pc-windows-msvc")) == {"__chkstk", "_fltused"}


@cache
def replay() -> str:
    """The replay of a sensor, as LLVM text."""
    sensor = kalman(build_ddh("boom", load_machine("mining-loader").unit("boom")))
    text, _ = recursion._compile(sensor.recursion).replay._written((("d", 2), ("d", 1), ("d", 1), ("d", 2)))
    return str(text)


@cache
def object_file(triple: str) -> bytes:
    """It, compiled for a system on x86-64."""
    object_code._initialize()
    target = binding.Target.from_triple(triple).create_target_machine(cpu="x86-64-v3", features="", opt=0, jit=True)
    return target.emit_object(binding.parse_assembly(replay()))


def undefined(coff: bytes) -> set[str]:
    """Names that a COFF file asks for: symbols of no section (PE format, 5.4)."""
    start, count = struct.unpack_from("<II", coff, 8)
    names = start + 18 * count
    found, k = set(), 0
    while k < count:
        name, _, section, _, _, more = struct.unpack_from("<8sIhHBB", coff, start + 18 * k)
        if section == 0:
            at = names + int.from_bytes(name[4:], "little")
            found.add((coff[at : coff.index(b"\0", at)] if name[:4] == bytes(4) else name.rstrip(b"\0")).decode())
        k += 1 + more
    return found


def test_drafts_have_names_that_windows_takes():
    draft = draft_of(PureWindowsPath(r"C:\Users\a b\track.csv"))
    assert draft.parent == PureWindowsPath(r"C:\Users\a b")
    assert not set(draft.name) & set('<>:"/\\|?*')
    assert draft.suffix == ".csv"


def test_a_map_names_a_file_of_another_drive_as_a_whole(monkeypatch, tmp_path):
    assert proposal._from(tmp_path / "drive.dbc", tmp_path / "maps") == "../drive.dbc"

    def refuses(path, start):
        raise ValueError("path is on mount 'D:', start on mount 'C:'")

    monkeypatch.setattr(os.path, "relpath", refuses)
    assert proposal._from(tmp_path / "drive.dbc", tmp_path) == (tmp_path / "drive.dbc").as_posix()


CHECK = ("check", "mining-loader")
FEW = {"ascii": (CHECK, ("track", "mining-loader", LOG, "--unit", "boom"), ("catalog",)), "cp1252": (CHECK,)}
"""Verbs by the characters of a console: what goes where there is ASCII alone goes where there is more."""


@pytest.mark.parametrize("encoding", FEW)
def test_a_console_with_few_characters_stops_no_verb(tmp_path, encoding):
    for words in FEW[encoding]:
        command, known = [sys.executable, "-m", "ramsight.cli"], os.environ | {"PYTHONIOENCODING": encoding}
        done = subprocess.run([*command, *map(str, words)], capture_output=True, check=False, cwd=tmp_path, env=known)
        assert (done.returncode, done.stderr) == (0, b"")
        assert done.stdout.decode(encoding)


def test_files_with_the_line_ends_of_windows_are_read_alike(tmp_path):
    plain, windows = tmp_path / "plain", tmp_path / "windows"
    for folder, end in ((plain, "\n"), (windows, "\r\n")):
        folder.mkdir()
        for name, text in FILES.items():
            (folder / name).write_bytes(text.replace("\n", end).encode())
    for words in (
        ("check", "machine.toml"),
        ("simulate", "mining-loader", "--unit", "boom", "--duty", "duty.csv", "--out", "run.csv"),
        ("track", "mining-loader", "log.csv", "--unit", "boom", "--map", "map.toml", "--out", "track.csv"),
        ("compare", "mining-loader", "log.csv", "truth.csv", "--unit", "boom", "--map", "map.toml"),
    ):
        one, other = at_once(*words, cwd=plain), at_once(*words, cwd=windows)
        assert one.returncode == 0, one.stderr
        assert (one.stdout, one.stderr, one.returncode) == (other.stdout, other.stderr, other.returncode)
    for result in ("run.csv", "track.csv"):
        content = (plain / result).read_bytes()
        assert content == (windows / result).read_bytes()
        assert b"\r" not in content


FILES = {
    "machine.toml": template(),
    "duty.csv": "time_s,motor_speed_rpm,load_kn\n0,0,129\n1,1500,129\n5,1500,129\n6,0,129\n",
    "log.csv": "t;n;M;T\n" + "".join(f"{0.02 * k:.2f};{min(20 * k, 900)};40;40\n" for k in range(300)),
    "map.toml": '[time]\nchannel = "t"\nunit = "s"\n\n[speed]\nchannel = "n"\nunit = "rpm"\n\n'
    '[torque]\nchannel = "M"\nunit = "N m"\n\n[temperature]\nchannel = "T"\nunit = "degC"\n',
    "truth.csv": "time_s,position_m\n" + "".join(f"{0.02 * k:.2f},{0.1 + 0.0005 * k:.4f}\n" for k in range(300)),
}
