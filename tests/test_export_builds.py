"""Exported C builds where it is taken to: as C99 and C++11, for 32 and 64 bits, by CMake, for microcontrollers."""

import json
import shutil
import subprocess

import pytest

from ramsight import machine
from ramsight.deploy.c_folder import STEPS, build_files, write_sensor
from ramsight.deploy.compiler import CompilerError, ControlFootprint, Footprint, _stack, bodies, find_compiler, run
from ramsight.deploy.profiles import ControlOptions

COMPILER = find_compiler()
pytestmark = pytest.mark.skipif(COMPILER is None, reason="there is no C compiler")
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wvla", "-Wconversion", "-Wdouble-promotion", "-Werror")


class Counted:
    """In place of the measuring of builds: keeps which were asked for."""

    def __init__(self):
        self.builds = []

    def footprint(self, compiler, folder, prefix, *, single, optimised):
        self.builds.append((single, optimised))
        return Footprint("float" if single else "double", optimised, 1, 2, 3, 4, 1e-6)


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """The loader's boom with its control, and which builds were to be measured."""
    out, counted = tmp_path_factory.mktemp("exported") / "boom", Counted()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("ramsight.deploy.c_folder.footprint", counted.footprint)
        patch.setattr("ramsight.deploy.c_folder.control_footprint", lambda *of: ControlFootprint(1, 2, 1e-6))
        write_sensor(machine.load_machine("mining-loader"), "boom", out, control=ControlOptions(), measure=True)
    return out, counted.builds


@pytest.fixture
def folder(exported):
    """The folder that was written."""
    return exported[0]


def compiles_for_32_bits(folder):
    """Whether this compiler has the other word size's headers."""
    (folder / "probe.c").write_text("#include <stdint.h>\n#include <math.h>\nint probe(void) { return 0; }\n")
    try:
        run([COMPILER, "-m32", "-shared", "-fPIC", "probe.c", "-o", "probe.so"], folder)
    except CompilerError:
        return False
    return True


@pytest.mark.slow
@pytest.mark.parametrize("word", ["-m64", "-m32"])
@pytest.mark.parametrize("dialect", ["c99", "c++11"])
def test_every_source_compiles_without_a_warning(folder, tmp_path, dialect, word):
    if word == "-m32" and not compiles_for_32_bits(tmp_path):
        pytest.skip("the compiler has no headers for 32 bits")
    if dialect == "c++11" and not shutil.which("g++"):
        pytest.skip("there is no C++ compiler")
    language = ["g++", "-x", "c++"] if dialect == "c++11" else [COMPILER]
    sources = sorted(file.name for file in folder.glob("*.c"))
    assert len(sources) == 11
    for single in (0, 1) if dialect == "c99" else (1,):
        options = [f"-std={dialect}", word, f"-DRAMSIGHT_BOOM_FLOAT={single}", *WARNINGS, "-fsyntax-only"]
        run([*language, *options, *sources], folder)


def test_a_c_that_is_no_cpp_is_noticed(tmp_path):
    """What once stood in the generated C, and C++ refuses."""
    if not shutil.which("g++"):
        pytest.skip("there is no C++ compiler")
    (tmp_path / "old.c").write_text("#include <stdlib.h>\nchar *make(void) { char *new = malloc(1); return new; }\n")
    with pytest.raises(CompilerError):
        run(["g++", "-x", "c++", "-std=c++11", *WARNINGS, "-fsyntax-only", "old.c"], tmp_path)


@pytest.mark.slow
def test_golden_samples_pass_with_32_bits(folder, tmp_path):
    if not compiles_for_32_bits(tmp_path):
        pytest.skip("the compiler has no headers for 32 bits")
    for name in ("ramsight_boom", "ramsight_boom_control"):
        sources = [str(folder / file) for file in (*bodies(folder, name), f"{name}_test.c")]
        run([COMPILER, "-m32", "-std=c99", "-O0", "-DROUNDS=1", *sources, "-lm", "-o", "golden"], tmp_path)
        assert "passed" in run([str(tmp_path / "golden")], tmp_path)


@pytest.mark.slow
def test_cmake_builds_a_library_and_runs_its_tests(folder, tmp_path):
    if not shutil.which("cmake"):
        pytest.skip("there is no CMake")
    run(["cmake", "-DCMAKE_C_FLAGS=-O0 -DROUNDS=1", "-S", str(folder), "-B", "build"], tmp_path)
    run(["cmake", "--build", "build"], tmp_path)
    said = subprocess.run(["ctest"], cwd=tmp_path / "build", capture_output=True, text=True, check=True).stdout
    assert "100% tests passed, 0 tests failed out of 2" in said
    assert list((tmp_path / "build").glob("libramsight_boom.*"))


def test_build_files_name_what_is_there(folder):
    listed = (folder / "CMakeLists.txt").read_text(encoding="utf-8")
    for file in folder.glob("*.c"):
        assert file.stem in listed, file
    library = json.loads((folder / "library.json").read_text(encoding="utf-8"))
    assert library["name"] == "ramsight_boom"
    assert library["build"]["srcFilter"] == ["+<*.c>", "-<*_test.c>"]
    assert (folder / "zephyr" / "module.yml").read_text(encoding="utf-8") == "name: ramsight_boom\nbuild:\n  cmake: .\n"


def test_a_folder_without_tests_has_none_in_its_build():
    listed = build_files(["a.h", "a.c"], "a", "press", "ram")["CMakeLists.txt"]
    assert "foreach(name )" in listed
    assert "  a.c)" in listed


def test_one_build_is_measured_unless_all_are_asked_for(exported, tmp_path, monkeypatch):
    assert exported[1] == [(False, "-O2"), (False, "-Os"), (True, "-O2"), (True, "-Os")]
    counted, steps = Counted(), []
    monkeypatch.setattr("ramsight.deploy.c_folder.footprint", counted.footprint)
    done = write_sensor(
        machine.load_machine("mining-loader"), "boom", tmp_path / "one", single=True, advance=steps.append
    )
    assert counted.builds == [(True, "-O2")]
    assert sum(steps) == STEPS
    assert [one.precision for one in done.footprints] == ["float"]
    record = json.loads((tmp_path / "one" / "ramsight.json").read_text(encoding="utf-8"))
    assert record["command"] == "ramsight export c description.toml --unit boom --single"


def test_the_stack_of_a_step_is_that_of_its_deepest_part(tmp_path):
    """Its own frame, and of one part the frame and that of the function in it that takes most."""
    frames = {
        "p.su": {"p_step": 100, "p_begin": 9000},
        "p_step_balance.su": {"p_step_balance": 50, "p_step_balance_0": 700, "p_step_balance_1": 200},
        "p_step_input_check.su": {"p_step_input_check": 600, "p_step_input_check_0": 10, "p_step_input_check_12": 60},
    }
    for file, found in frames.items():
        lines = (f"{file}:1:1:{name}\t{taken}\tstatic\n" for name, taken in found.items())
        (tmp_path / file).write_text("".join(lines), encoding="utf-8")
    assert _stack(tmp_path, "p") == 100 + 50 + 700


def test_what_the_linker_lacks_is_named(tmp_path):
    """The driver's last line, "ld returned 1 exit status", helps nobody."""
    (tmp_path / "main.c").write_text("int missing_part(void);\nint main(void) { return missing_part(); }\n")
    with pytest.raises(CompilerError, match="missing_part"):
        run([COMPILER, "main.c", "-o", "main"], tmp_path)
