"""The one-way street: every room imports only rooms before it, and heavy libraries load late."""

import ast
import importlib
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping
from functools import cache
from graphlib import CycleError, TopologicalSorter
from importlib.metadata import version
from pathlib import Path

import pytest
from packaging.requirements import Requirement

import ramsight
from ramsight.cli import verbs

SOURCE = Path(ramsight.__file__).parent

STREET = [
    {"units"}, {"output"}, {"logs"}, {"machine"}, {"engine"}, {"plant"}, {"duty"}, {"sensor"}, {"hindsight"},
    {"tracking"}, {"tool"}, {"calibration"}, {"control"}, {"closed_loop"}, {"drawing"}, {"study"}, {"histories"},
    {"deploy"}, {"api"},
    {"studio"}, {"demo"}, {"cli"}, {"__main__"},
]  # fmt: skip
PLACE = {room: place for place, rooms in enumerate(STREET) for room in rooms}
FREE = {
    "_version", "argument_kinds", "arrays", "bounded_toml", "circuit_picture", "constant", "errors", "expression",
    "late", "log_formats", "normal", "optional", "posix", "progress", "signals", "system",
}  # fmt: skip
"""Modules that all others may use, and that use no room but each other."""
DOOR = "__init__"
"""The package itself, above all rooms: it loads none by itself, and rooms below what it offers do not import it."""

PIPE = [
    {"assumptions", "covariance", "kind", "machine_model", "normal_tail", "quantity", "status", "thresholds"},
    {"inputs"},
    {"circuit"},
    {"checks"},
    {"contacts"},
    {"belief"},
    {"pickled", "virtual_sensor"},
    {"report"},
    {"balance", "dead_reckoning", "kalman", "kept_sensor", "persistence", "reckoned", "redundancy", "table"},
]
"""Folders and single files of the sensor: each imports what stands before it, or beside it."""

ENGINE_LIBRARIES = {"numpy", "llvmlite", "casadi"}
HEAVY = [
    "numpy", "casadi", "llvmlite", "xarray", "pint", "matplotlib", "scipy", "pandas", "pyarrow", "h5py",
    "h5netcdf", "asammdf", "mcap", "can", "canopen", "cantools", "fmpy", "zarr", "SALib", "dask", "distributed",
    "nicegui", "asyncua", "sqlalchemy", "psycopg",
]  # fmt: skip


def room_of(file: Path) -> str:
    parts = file.relative_to(SOURCE).with_suffix("").parts
    return parts[0]


@cache
def parsed(text: str) -> ast.Module:
    return ast.parse(text)


@cache
def statements(text: str) -> list[ast.Import | ast.ImportFrom]:
    """All that a source imports with, inside functions too."""
    return [node for node in ast.walk(parsed(text)) if isinstance(node, ast.Import | ast.ImportFrom)]


def modules(file: Path) -> Iterator[tuple[int, str]]:
    """Line and dotted name of everything that a file imports, inside functions too."""
    package = ["ramsight", *file.relative_to(SOURCE).parts[:-1]]
    for node in statements(file.read_text(encoding="utf-8")):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        else:
            base = package[: len(package) - node.level + 1] if node.level else []
            name = ".".join([*base, *([node.module] if node.module else [])])
            if name == "ramsight":  # from ramsight import sensor
                yield from ((node.lineno, f"ramsight.{alias.name}") for alias in node.names)
            else:
                yield node.lineno, name


def rooms(file: Path) -> Iterator[tuple[int, str]]:
    """Line and name of the rooms of ramsight that a file imports."""
    for line, name in modules(file):
        if name == "ramsight":
            yield line, DOOR
        elif name.startswith("ramsight."):
            room = name.split(".")[1]
            yield line, room if (SOURCE / room).is_dir() or (SOURCE / f"{room}.py").is_file() else DOOR


def allowed(room: str, other: str) -> bool:
    if other in {room, *FREE}:
        return True
    if room in FREE or room == "engine":
        return False
    if other == DOOR:
        return PLACE[room] > PLACE["api"]
    return PLACE[other] < PLACE[room]


FILES = sorted(SOURCE.rglob("*.py"))
SHOWN = {"demo"}
"""The room that shows what the others can do; only its verb loads it."""
SAME_NAME = {"balance", "leakage", "report", "thresholds"}
"""Names that two files have, one of them in the sensor: its stage has the name of what it estimates."""


def test_every_room_has_its_place_in_the_street():
    known = {*PLACE, *FREE, DOOR}
    assert {room_of(file) for file in FILES} <= known, "a new room needs a place in STREET"


def test_imports_run_one_way():
    wrong = [
        f"{file.relative_to(SOURCE)}:{line}: {room} imports {other}"
        for file in FILES
        if (room := room_of(file)) != DOOR
        for line, other in rooms(file)
        if not allowed(room, other)
    ]
    assert wrong == []


def dotted(file: Path) -> str:
    parts = ("ramsight", *file.relative_to(SOURCE).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imported(files: list[Path]) -> dict[str, set[str]]:
    """The modules that each module imports, inside functions too."""
    known = {dotted(file): file for file in files}
    found: dict[str, set[str]] = {}
    for module, file in known.items():
        names = {name for _, name in modules(file)}
        for node in statements(file.read_text(encoding="utf-8")):
            if isinstance(node, ast.ImportFrom) and node.module:
                below = {f"{node.module}.{alias.name}" for alias in node.names}
                names |= below
                names -= {node.module} if below <= known.keys() else set()
        found[module] = names & known.keys() - {module}
    return found


def circle(of: Mapping[str, set[str]]) -> list[str]:
    """Modules that import each other in a circle; empty if there is none."""
    try:
        TopologicalSorter(of).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def test_no_modules_import_each_other_in_a_circle():
    """Late imports count; the package itself does not, which imports whatever it is asked for."""
    of = {module: names - {"ramsight"} for module, names in imported(FILES).items()}
    assert sum(map(len, of.values())) > 1000
    assert circle(of) == []


def against_the_pipe(of: Mapping[str, set[str]]) -> list[str]:
    """Imports of the sensor that lead to a later stage of the pipe."""
    stage_of = {f"ramsight.sensor.{name}": stage for stage, names in enumerate(PIPE) for name in names}
    at = {module: stage_of.get(".".join(module.split(".")[:3])) for module in of}
    return [
        f"{module} imports {other}"
        for module, others in of.items()
        for other in sorted(others)
        if (here := at[module]) is not None and (there := at[other]) is not None and there > here
    ]


def test_every_file_of_the_sensor_has_its_place_in_the_pipe():
    room = SOURCE / "sensor"
    there = {file.relative_to(room).with_suffix("").parts[0] for file in room.rglob("*.py")}
    listed = [name for names in PIPE for name in names]
    assert sorted(listed) == sorted(there - {"__init__"}), "a new file or folder needs a place in PIPE"


def test_the_folders_of_the_sensor_import_one_way():
    of = imported(FILES)
    assert against_the_pipe(of) == []
    load, bank = "ramsight.sensor.circuit.load", "ramsight.sensor.belief.bank"
    assert against_the_pipe({load: {bank}, bank: {load}}) == [f"{load} imports {bank}"]


def test_the_test_sees_circles_inside_a_room(tmp_path, monkeypatch):
    (tmp_path / "logs").mkdir()
    files = [tmp_path / "logs" / name for name in ("__init__.py", "a.py", "b.py")]
    monkeypatch.setitem(globals(), "SOURCE", tmp_path)
    files[0].write_text("from ramsight.logs.a import one\n")
    files[1].write_text("from ramsight.logs import b\none = 1\n")
    files[2].write_text("import math\n")
    assert circle(imported(files)) == []
    files[2].write_text("def late():\n    from ramsight.logs.a import one\n")
    assert set(circle(imported(files))) == {"ramsight.logs.a", "ramsight.logs.b"}
    files[2].write_text("from ramsight.logs import one\n")
    assert set(circle(imported(files))) == {"ramsight.logs", "ramsight.logs.a", "ramsight.logs.b"}


def test_the_engine_uses_numpy_llvmlite_and_casadi_alone():
    files = [file for file in FILES if room_of(file) == "engine"]
    used = {name.split(".")[0] for file in files for _, name in modules(file)}
    assert used - sys.stdlib_module_names - {"ramsight"} <= ENGINE_LIBRARIES


def test_the_drawing_of_the_rooms_is_that_of_the_code(script):
    root = SOURCE.parent.parent
    drawing = script("rooms")
    listed = drawing.listed()
    found = drawing.edges(list(listed))
    assert [{room} for room in listed] == [rooms & set(listed) for rooms in STREET if rooms & set(listed)]
    assert set(listed) | FREE | {"__main__"} == {name for rooms in STREET for name in rooms} | FREE
    here = {(room_of(file), other) for file in FILES for _, other in rooms(file)}
    assert found == {(room, other) for room, other in here if room != other and {room, other} <= set(listed)}
    assert drawing.reduced({("c", "b"), ("b", "a"), ("c", "a")}) == {("c", "b"), ("b", "a")}
    picture = root / "docs" / "images" / "rooms.svg"
    assert picture.read_text() == drawing.drawn(listed, found), "draw it anew: python evaluation/rooms.py ..."


def test_the_test_sees_imports_of_every_kind(tmp_path, monkeypatch):
    (tmp_path / "engine").mkdir()
    (tmp_path / "cli.py").write_text("")
    (tmp_path / "units.py").write_text("")
    file = tmp_path / "engine" / "run.py"
    file.write_text(
        "import ramsight.cli\nfrom ramsight import units, __version__\nfrom . import kernel\n"
        "from ..cli import main\ndef late():\n    from ramsight.units import parse\n"
    )
    monkeypatch.setitem(globals(), "SOURCE", tmp_path)
    assert list(rooms(file)) == [(1, "cli"), (2, "units"), (2, DOOR), (3, "engine"), (4, "cli"), (6, "units")]
    assert not allowed("engine", "cli")
    assert not allowed("logs", "machine")
    assert not allowed("errors", "units")
    assert not allowed("engine", "units")
    assert not allowed("sensor", "tracking")
    assert not allowed("api", "studio")
    assert not allowed("machine", DOOR)
    assert allowed("cli", "studio")


def test_a_command_does_not_load_what_no_verb_uses(tmp_path):
    words = ["ramsight", "simulate", "press", "--unit", "ram", "--load", "50 kN", "--out", str(tmp_path / "run.csv")]
    code = f"""
import sys
sys.argv = {words}
from ramsight.cli import main
try:
    main()
finally:
    heavy = ("dask", "pint", "scipy.optimize", "xarray", "pandas")
    print("loaded:", *(name for name in heavy if sys.modules.get(name)))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "loaded:"


@pytest.mark.parametrize(
    ("words", "kept"), [(["simulate"], False), (["datasheet", "--cluster", "local"], True), (["--cluster=local"], True)]
)
def test_who_asks_for_a_cluster_has_dask(words, kept, monkeypatch):
    for name in (*verbs.OTHER_ARRAYS, "xarray"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.setattr(sys, "argv", ["ramsight", *words])
    verbs._without_other_arrays()
    assert [name in sys.modules for name in verbs.OTHER_ARRAYS] == [not kept] * 2
    for name in verbs.OTHER_ARRAYS:
        sys.modules.pop(name, None)


def test_where_xarray_is_there_already_it_keeps_what_it_may_have_found(monkeypatch):
    importlib.import_module("xarray")
    for name in verbs.OTHER_ARRAYS:
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.setattr(sys, "argv", ["ramsight", "simulate"])
    verbs._without_other_arrays()
    assert not any(name in sys.modules for name in verbs.OTHER_ARRAYS)


@pytest.mark.parametrize("module", ["ramsight", "ramsight.cli", "ramsight.errors", "ramsight.progress"])
def test_heavy_libraries_load_late(module):
    code = f"import sys, {module}\nprint(*(name for name in {HEAVY} if name in sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout.split() == []


EXPORT = """
import sys, tempfile, ramsight
from tests.made_once import share
share()
with tempfile.TemporaryDirectory() as folder:
    ramsight.export_c("press", "ram", out=folder + "/c", compiler="")
    ramsight.export_fmu("press", "ram", out=folder + "/sensor.fmu", compiler="")
    print(*(name for name in sys.modules if name.startswith("ramsight.control")))
    ramsight.export_c("press", "ram", out=folder + "/control", control=True, compiler="")
    print("ramsight.control.block" in sys.modules)
"""


@pytest.mark.slow
def test_an_exported_sensor_loads_nothing_of_the_control():
    root = Path(__file__).parents[1]
    done = subprocess.run([sys.executable, "-c", EXPORT], check=True, capture_output=True, text=True, cwd=root)
    assert done.stdout.splitlines() == ["", "True"]


HELP = """
import contextlib, io, sys
from typer.main import get_command
from ramsight.cli import app, main

def verbs(command, path=()):
    yield path
    for name, below in getattr(command, "commands", {}).items():
        yield from verbs(below, (*path, name))

for verb in verbs(get_command(app)):
    sys.argv = ["ramsight", *verb, "--help"]
    with contextlib.redirect_stdout(io.StringIO()) as said, contextlib.suppress(SystemExit):
        main()
    assert "Usage: " in said.getvalue(), verb
    print(*verb, *(f"loads:{name}" for name in HEAVY if sys.modules.get(name) is not None))
"""


def test_no_help_loads_a_heavy_library():
    code = f"HEAVY = {HEAVY}\n{HELP}"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert {"check", "simulate", "logs inspect", "export c"} <= set(done.stdout.splitlines())
    assert [line for line in done.stdout.splitlines() if "loads:" in line] == []


def test_logs_load_without_xarray():
    code = "import sys, ramsight.logs, ramsight.output\nassert 'xarray' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_canopen_is_capped_as_long_as_private_names_of_it_are_used():
    project = tomllib.loads((SOURCE.parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    (canopen,) = (one for one in map(Requirement, project["optional-dependencies"]["can"]) if one.name == "canopen")
    server = (SOURCE / "deploy" / "encoder" / "server.py").read_text(encoding="utf-8")
    assert "_local.nmt._state" in server
    assert canopen.specifier.contains(version("canopen"))
    major, minor, *_ = version("canopen").split(".")
    assert not canopen.specifier.contains(f"{major}.{int(minor) + 1}")


def test_the_name_of_a_module_tells_it_from_those_of_other_rooms():
    names = Counter(file.stem for file in FILES)
    assert {name for name, times in names.items() if times > 1} <= {"__init__", "__main__", *SAME_NAME}


def test_only_verbs_load_what_shows_the_others_and_only_when_they_are_called():
    shown = [(file, line) for file in FILES for line, other in rooms(file) if other in SHOWN and room_of(file) != other]
    assert shown
    for file, line in shown:
        late = {line for node in ast.walk(parsed(file.read_text(encoding="utf-8")))
                if isinstance(node, ast.FunctionDef) for line in range(node.lineno, node.end_lineno + 1)}  # fmt: skip
        assert room_of(file) == "cli", f"{file.relative_to(SOURCE)}:{line} imports a room that is shown"
        assert line in late, f"{file.relative_to(SOURCE)}:{line} imports a room before its verb is called"


def test_what_builds_a_circuit_or_a_mechanism_says_which():
    """`build` alone is the public function."""
    named = [(file, node.name) for file in FILES for node in parsed(file.read_text(encoding="utf-8")).body
             if isinstance(node, ast.FunctionDef) and node.name.startswith("build")]  # fmt: skip
    assert [file for file, name in named if name == "build"] == [SOURCE / "plant" / "build.py"]
    names = [name for _, name in named]
    assert len(names) == len(set(names)) >= 6
