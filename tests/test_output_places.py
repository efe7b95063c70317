"""Where results may go: never over what is read, never two into one file; drafts of killed runs go."""

import os
import signal
import subprocess
import sys

import pytest

from ramsight.errors import OutputError
from ramsight.output import atomic_path, check_apart, check_state, whole_folder
from ramsight.output.atomic import draft_of
from ramsight.output.netcdf import ForgivingFile

from .command import at_once

LOG = "time_s,motor_speed_rpm,motor_torque_nm,oil_temperature_c\n" + "".join(
    f"{k / 50:.2f},0,12.5,40.1\n" for k in range(100)
)


def contents(folder):
    return {file.name: file.read_bytes() for file in folder.iterdir() if file.is_file()}


@pytest.fixture
def place(tmp_path):
    (tmp_path / "log.csv").write_text(LOG)
    (tmp_path / "truth.csv").write_text("time_s,position_m\n0,0.1\n5,0.1\n")
    (tmp_path / "link.csv").symlink_to(tmp_path / "log.csv")
    os.link(tmp_path / "log.csv", tmp_path / "hard.csv")
    (tmp_path / "machine.toml").write_text('name = "mine"\n')
    return tmp_path


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--out", "log.csv"), "log.csv: is --out and the log; give another file"),
        (("--out", "link.csv"), "link.csv: is --out and the log"),
        (("--out", "hard.csv"), "hard.csv: is --out and the log"),
        (("--out", "../{folder}/log.csv"), "is --out and the log"),
        (("--out", "truth.csv", "--truth", "truth.csv"), "truth.csv: is --out and --truth"),
        (("--out", "x.csv", "--state", "x.csv"), "x.csv: is --state and --out"),
        (("--state", "log.csv"), "log.csv: is --state and the log"),
        (("--state", "machine.toml"), "machine.toml: is there already, and is no state of a sensor"),
        (("--state", "."), ".: is not a regular file"),
    ],
)
def test_track_writes_over_nothing_that_it_reads(place, options, said):
    before = contents(place)
    options = [one.format(folder=place.name) for one in options]
    done = at_once("track", "mining-loader", "log.csv", "--unit", "boom", "--start", "100 mm", *options, cwd=place)
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert said in done.stderr
    assert contents(place) == before


def test_other_verbs_write_over_nothing_that_they_read(place):
    before = contents(place)
    for arguments in (
        ("logs", "inspect", "log.csv", "--map", "machine.toml", "--out", "machine.toml"),
        ("simulate", "mining-loader", "--unit", "boom", "--load", "100 kN", "--out", "a.csv", "--log", "a.csv"),
        ("identify", "machine.toml", "log.csv", "--unit", "boom", "--truth", "truth.csv", "--out", "machine.toml"),
        ("leak-test", "machine.toml", "log.csv", "--unit", "boom", "--out", "machine.toml"),
        ("commission", "machine.toml", "log.csv", "--unit", "boom", "--tuned", "machine.toml"),
    ):
        done = at_once(*arguments, cwd=place)
        assert done.returncode == 2
        assert "give another file" in done.stderr
    assert contents(place) == before


@pytest.mark.parametrize(
    "content", [b"", b"\0" * 700, b"\xff" * 700, b"\xff" * 376 + b"ramsight state\n\0" + bytes(360)]
)
def test_what_may_have_been_a_state_may_become_one(tmp_path, content):
    (tmp_path / "boom.state").write_bytes(content)
    check_state(tmp_path / "boom.state")
    check_state(tmp_path / "absent")
    check_state(None)


def test_files_are_compared_before_they_exist(tmp_path):
    check_apart({"the log": tmp_path / "a"}, {"--out": tmp_path / "b", "--state": tmp_path / "c", "--eds": None})
    with pytest.raises(OutputError, match="is --state and --out"):
        check_apart({}, {"--out": tmp_path / "b", "--state": tmp_path / "x" / ".." / "b"})
    with pytest.raises(OutputError, match="is --out and the log"):
        check_apart({"the log": "null\0character"}, {"--out": "null\0character"})


WRITER = """
import sys, time
from pathlib import Path
from ramsight.output import atomic_path, whole_folder
kind, path = sys.argv[1], Path(sys.argv[2])
with atomic_path(path) if kind == "file" else whole_folder(path, last="a") as draft:
    (draft if kind == "file" else draft / "a").write_text("half")
    print("writing", flush=True)
    time.sleep(60)
"""


@pytest.mark.posix
@pytest.mark.parametrize("kind", ["file", "folder"])
def test_the_draft_of_a_killed_run_goes_with_the_next_run_of_the_same_output(tmp_path, kind):
    def run():
        command = [sys.executable, "-c", WRITER, kind, str(tmp_path / "out.csv")]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert process.stdout.readline() == "writing\n"
        return process

    killed, alive = run(), run()
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    assert len(list(tmp_path.iterdir())) == 2
    with atomic_path(tmp_path / "out.csv") as draft:
        assert len(list(tmp_path.iterdir())) == 1  # the one that is at work stays
        draft.write_text("whole")
    alive.kill()
    alive.wait()
    for process in (killed, alive):
        process.stdout.close()
    (tmp_path / "out.csv").unlink()
    with whole_folder(tmp_path / "out.csv", last="a") as folder:
        (folder / "a").write_text("whole")
    assert [path.name for path in tmp_path.iterdir()] == ["out.csv"]


def test_drafts_of_other_machines_and_other_results_stay(tmp_path):
    own = draft_of(tmp_path / "a.csv").name.split("-")
    strange = tmp_path / "-".join([".0000" if own[0] != ".0000" else ".0001", "99999999", *own[2:]])
    other = tmp_path / "-".join([own[0], "99999999", own[2], "b.csv"])
    dead = tmp_path / "-".join([own[0], "99999999", *own[2:]])
    for path in (strange, other, dead):
        path.write_text("half")
    with atomic_path(tmp_path / "a.csv") as draft:
        draft.write_text("whole")
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(["a.csv", strange.name, other.name])


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs a device that is full")
def test_a_full_standard_output_is_named_and_nothing_else_is(tmp_path):
    with open("/dev/full", "w") as full:
        command = [sys.executable, "-m", "ramsight.cli", "catalog"]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False, timeout=60)
    assert done.returncode == 2
    assert done.stderr == "error: standard output: No space left on device\n"


FULL = """
import resource, signal, sys
import numpy, xarray
from pathlib import Path
from ramsight.errors import OutputError
from ramsight.output import open_dataset, write_dataset
time = numpy.arange(20_000) * 0.01
piece = xarray.Dataset({"position": ("time", numpy.sin(time), {"units": "m"})}, coords={"time": ("time", time)})
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
for path, most, how in (one.split(":") for one in sys.argv[1:]):
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(most), resource.RLIM_INFINITY))
    try:
        if how == "whole":
            write_dataset(piece, path)
        else:
            with open_dataset(path) as writer:
                for _ in range(5):
                    writer.append(piece)
    except OutputError as error:
        print(error)
"""


@pytest.mark.posix
def test_a_full_disk_is_one_line_in_every_format(tmp_path):
    cases = [
        ("a.nc", 100, "pieces"), ("b.nc", 60_000, "pieces"), ("c.nc", 60_000, "whole"), ("d.csv", 60_000, "pieces"),
        ("e.csv.gz", 60_000, "pieces"), ("f.parquet", 60_000, "pieces"), ("g.mf4", 60_000, "pieces"),
        ("h.mcap", 60_000, "pieces"),
    ]  # fmt: skip
    for name, _, _ in cases:
        (tmp_path / name).write_text("old")
    asked = [f"{tmp_path / name}:{most}:{how}" for name, most, how in cases]
    done = subprocess.run([sys.executable, "-c", FULL, *asked], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    for (name, _, _), said in zip(cases, done.stdout.splitlines(), strict=True):
        assert said.startswith(f"{tmp_path / name}: cannot be written: ")
        assert said.endswith("File too large")
    assert contents(tmp_path) == {name: b"old" for name, _, _ in cases}


def test_what_could_not_be_written_can_be_read_until_the_end(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    with ForgivingFile(tmp_path / "a") as file:
        file.write(b"0123456789")
        file.check()
        monkeypatch.setattr(file, "_file", Stub(file._file, full))
        file.seek(8)
        assert file.write(b"abcdef") == 6
        file.seek(6)
        assert file.read(20) == b"67abcdef"
        file.truncate(12)
        file.seek(-4, os.SEEK_END)
        assert file.read(20) == b"abcd"
        with pytest.raises(OSError, match="No space left"):
            file.check()


class Stub:
    """A file on a disk that is full."""

    def __init__(self, file, write):
        self._file, self.write = file, write

    def __getattr__(self, name):
        return getattr(self._file, name)
