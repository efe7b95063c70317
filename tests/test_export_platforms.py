"""Binaries of FMUs for other machines, run where they can be run here: they say what Python says."""

import platform
import shutil
import subprocess
import sys
import zipfile
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from ramsight import machine
from ramsight.cli import app
from ramsight.deploy import compiler as platforms
from ramsight.deploy.c_sensor import inputs_of
from ramsight.deploy.compiler import PLATFORMS, STRICT, CompilerError, binaries, platforms_of, run
from ramsight.deploy.fmu import write_fmu
from ramsight.deploy.golden import faulty_day
from ramsight.engine.recursion import replay
from ramsight.errors import DescriptionError
from ramsight.plant.build import build
from ramsight.sensor.kalman import kalman

LOADER = machine.load_machine("mining-loader")
IMPORTER = r"""
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#if defined _WIN32
#include <windows.h>
#define FIND(name) (void (*)(void))GetProcAddress(library, name)
#else
#include <dlfcn.h>
#define FIND(name) (void (*)(void))dlsym(library, name)
#endif
typedef int (*plain)(void *);
typedef void *(*maker)(const char *, int, const char *, const char *, const void *, int, int);
typedef int (*begin)(void *, int, double, double, int, double);
typedef int (*reals)(void *, const unsigned *, size_t, double *);
typedef int (*wholes)(void *, const unsigned *, size_t, int *);
typedef int (*stepper)(void *, double, double, int);
int main(int count, char **words) {
#if defined _WIN32
  HMODULE library = LoadLibraryA(words[1]);
#else
  void *library = dlopen(words[1], RTLD_NOW);
#endif
  if (count < 5 || !library) return 2;
  FILE *in = fopen(words[3], "rb"), *out = fopen(words[4], "wb");
  void *one = ((maker)FIND("fmi2Instantiate"))("one", 1, words[2], "", NULL, 0, 0);
  if (!one || !in || !out) return 3;
  reals set = (reals)FIND("fmi2SetReal"), get = (reals)FIND("fmi2GetReal");
  wholes truth = (wholes)FIND("fmi2SetBoolean"), whole = (wholes)FIND("fmi2GetInteger");
  unsigned inputs[] = {1, 2, 3, 4}, start[] = {5}, says[] = {7, 8}, status[] = {STATUS};
  unsigned known[] = {STATUS + 1, STATUS + 2};
  double row[5], said[3];
  int is_known[2] = {0, 1}, word;
  if (fread(row, sizeof row[0], 1, in) != 1 || set(one, start, 1, row) || truth(one, known, 2, is_known)) return 4;
  if (((begin)FIND("fmi2SetupExperiment"))(one, 0, 0, 0, 0, 0)) return 5;
  if (((plain)FIND("fmi2EnterInitializationMode"))(one) || ((plain)FIND("fmi2ExitInitializationMode"))(one)) return 6;
  while (fread(row, sizeof row, 1, in) == 1) {
    is_known[0] = !isnan(row[4]);
    if (!is_known[0]) row[4] = 0;
    if (set(one, inputs, 4, row + 1) || truth(one, known, 1, is_known)) return 7;
    if (((stepper)FIND("fmi2DoStep"))(one, row[0], 0.0, 1)) return 8;
    if (get(one, says, 2, said) || whole(one, status, 1, &word)) return 9;
    said[2] = word;
    fwrite(said, sizeof said, 1, out);
  }
  return fclose(out);
}
"""
_PATIENCE = 400.0  # s; wine makes its folders when it runs first
RUNNERS = {
    "linux64": (),
    "linux-aarch64": ("qemu-aarch64", "-L", "/usr/aarch64-linux-gnu"),
    "win64": (shutil.which("wine64") or shutil.which("wine") or "/usr/lib/wine/wine64",),
}


CALLED = {
    "__initenv.c", "__p___initenv.c", "dllmain.c", "mingw_matherr.c", "ucrt___local_stdio_printf_options.c",
    "ucrt__getmainargs.c", "ucrt_amsg_exit.c", "ucrt_fprintf.c", "ucrt_snprintf.c", "ucrt_vfprintf.c",
    "ucrt_vsnprintf.c",
}  # fmt: skip
"""Of the C runtime of Windows what a library of ours and the importer call, beside its folders `crt` and `math`."""


def with_little_runtime(folder):
    """zig's own files, of its C runtime of Windows those alone that are called.

    zig compiles all 400 of that runtime before it links the first library, five minutes' work; here the others are
    empty. The linker names what is missing.
    """
    real = Path(platforms.zig_for("a test")).parent / "lib"
    place, whole = folder, real
    for inner in ("libc", "mingw"):
        place.mkdir()
        for one in whole.iterdir():
            if one.name != inner:
                (place / one.name).symlink_to(one)
        place, whole = place / inner, whole / inner
    shutil.copytree(whole, place)
    for one in place.rglob("*.[csS]"):
        if one.relative_to(place).parts[0] not in ("crt", "math") and one.name not in CALLED:
            one.write_text("")
    return folder


@pytest.mark.slow
@pytest.mark.skipif(find_spec("ziglang") is None, reason="the package ziglang is not installed")
@pytest.mark.parametrize("name", RUNNERS)
def test_a_binary_says_what_python_says(tmp_path, name, monkeypatch):
    runner = RUNNERS[name]
    if runner and not shutil.which(runner[0]):
        pytest.skip(f"there is no {runner[0]}")
    if not runner and (sys.platform, platform.machine()) != ("linux", "x86_64"):
        pytest.skip("this is another machine")
    if name == "win64":
        monkeypatch.setenv("ZIG_LIB_DIR", str(with_little_runtime(tmp_path / "zig")))
    unit = build(LOADER.unit("boom"), "boom")
    done = write_fmu(LOADER, "boom", tmp_path / "boom.fmu", platforms=(name,))
    with zipfile.ZipFile(done.path) as archive:
        archive.extractall(tmp_path)
    (place,) = (tmp_path / "binaries").rglob("*.*")
    config = (tmp_path / "sources" / "fmu_config.h").read_text()
    (token,) = [line.split('"')[1] for line in config.splitlines() if line.startswith("#define TOKEN")]
    (reals,) = [line.split()[2] for line in config.splitlines() if line.startswith("#define REALS")]
    (tmp_path / "importer.c").write_text(IMPORTER)
    target, program = PLATFORMS[name].target, tmp_path / ("importer.exe" if name == "win64" else "importer")
    zig, more = platforms.zig_for("a test"), [] if name == "win64" else ["-ldl"]
    # By the options of the library: for others zig compiles the system's own libraries once more, a minute's work.
    options = [one for one in platforms.LIBRARY_OPTIONS if one not in (*STRICT, "-shared")]
    run(
        [zig, "cc", "-target", target, *options, f"-DSTATUS={reals}", "importer.c", "-o", program.name, *more], tmp_path
    )
    rows, start = faulty_day(unit, duration=45.0, every=30.0, seed=4)
    rows = rows[rows[:, 0] == np.maximum.accumulate(rows[:, 0])]  # no importer steps back
    (tmp_path / "rows").write_bytes(np.concatenate([[start], rows.ravel()]).tobytes())
    command = [*runner, str(program), place.relative_to(tmp_path).as_posix(), token, "rows", "said"]
    try:
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=_PATIENCE)
    except subprocess.TimeoutExpired:
        pytest.skip(f"{runner[0]} does not run here: no answer within {_PATIENCE:g} s")
    assert done.returncode == 0, done.stderr
    said = np.frombuffer((tmp_path / "said").read_bytes()).reshape(-1, 3)
    sensor = kalman(unit)
    sensor.start(start)
    state = np.array([sensor.state[name] for name in sensor.recursion.state])
    expected = replay(sensor.recursion, inputs_of(rows), sensor.parameters, state)
    assert np.abs(said[:, :2] - expected[:, :2]).max() < 1e-12
    assert (said[:, 2] == expected[:, 4]).all()


def test_what_is_asked_for_is_built_and_nothing_else(tmp_path, monkeypatch):
    asked = []

    def compiler(command, folder):
        asked.append(command[command.index("-target") + 1])
        (folder / command[command.index("-o") + 1]).write_bytes(b"library")

    monkeypatch.setattr(platforms, "run", compiler)
    monkeypatch.setattr(platforms, "zig_for", lambda use: "zig")
    assert binaries({"a.c": ""}, "boom", 3, ["win64", "darwin-arm64"]) == {
        "binaries/x86_64-windows/boom.dll": b"library",
        "binaries/aarch64-darwin/boom.dylib": b"library",
    }
    assert list(binaries({"a.c": ""}, "boom", 2, ["linux64"])) == ["binaries/linux64/boom.so"]
    assert asked == ["x86_64-windows-gnu", "aarch64-macos", "x86_64-linux-gnu.2.17"]
    assert binaries({"a.c": ""}, "boom", 2, []) == {}


def test_sources_alone_need_no_compiler(tmp_path):
    out = tmp_path / "plant.fmu"
    words = [
        "export", "fmu", "mining-loader", "--unit", "boom", "--what", "plant", "--platforms", "none", "--out",
        str(out),
    ]  # fmt: skip
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    assert done.output.rstrip().endswith("92 variables, sources alone")
    with zipfile.ZipFile(out) as archive:
        assert not [name for name in archive.namelist() if name.startswith("binaries/")]


def test_a_platform_that_is_none_and_a_package_that_is_missing_are_named(tmp_path, monkeypatch):
    with pytest.raises(DescriptionError, match="there is no such platform"):
        platforms_of("win64,win32")
    monkeypatch.setitem(sys.modules, "ziglang", None)
    with pytest.raises(CompilerError, match=r"needs the package ziglang: pip install .ramsight\[platforms\]"):
        write_fmu(LOADER, "boom", tmp_path / "plant.fmu", what="plant", platforms=("win64",))
    assert list(tmp_path.iterdir()) == []
