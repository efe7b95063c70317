"""What the tests share: recorded traces, what is made once a process, and settings of hypothesis."""

import gc
import importlib
import json
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

import ramsight
from ramsight import posix

from .made_once import share

# Optimizing machine code takes three quarters of making it, and most of it runs for less long than that; commands that
# tests start have this too. `test_optimized.py` compares with what users have.
os.environ["RAMSIGHT_OPTIMIZE"] = "no"

share()  # before any other module takes the functions that make them

TRACES = Path(__file__).parent / "traces"

# Compiling takes seconds the first time, so examples have no deadline; the same examples run everywhere.
settings.register_profile("ramsight", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("ramsight")


# Files that take a core for more than 20 s, the longest first: a worker that is given one at the end works alone.
LONG = (
    "studio_browser", "studio_visits", "export_platforms", "paper", "docs_tutorials", "studio", "docs_run",
    "loader_verb", "export_further", "export", "assumptions", "identify_circuits", "balance", "load_observer",
    "loader_in_service", "commissioning", "wrong_values", "identify", "opcua", "other_systems", "export_wasm",
    "fit_track", "export_control", "export_visits",
    "export_fmu", "export_profiles", "export_watch", "effects", "datasheet", "drive_check",
    "commissioning_changes", "export_ssp", "docs", "unit_control", "kalman", "imports",
    "sensor_circuits", "core_alone", "watch", "cli_machine", "encoder_beside", "export_power", "optimized",
    "plant", "directional", "export_parameters", "export_page", "encoder_weighing", "export_weighing", "hindsight",
    "encoder_bus", "control", "hypotheses", "encoder", "engine_graph", "mistakes", "contact", "leakage", "drive_check",
)  # fmt: skip


def pytest_collection_modifyitems(items):
    """Put what takes longest first; leave out what only POSIX has where it is not."""
    for item in items:
        if not posix.IS_HERE and item.get_closest_marker("posix"):
            item.add_marker(pytest.mark.skip(reason="of POSIX alone"))
    place = {f"test_{name}.py": k for k, name in enumerate(LONG)}
    items.sort(key=lambda item: place.get(item.path.name, len(LONG)))


def pytest_collection_finish():
    """Graphs are many objects that stay: looking through all of them again and again for garbage takes a tenth."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(10_000, 20, 20)


@dataclass(frozen=True)
class Trace:
    """A recorded case: where its log and its truth are, and what was done (see ``traces/README.md``)."""

    name: str
    log: Path
    truth: Path
    case: dict[str, Any]


def trace_names() -> list[str]:
    """The names of all recorded cases, to parametrize tests with."""
    return [case["name"] for case in _cases()]


def _cases() -> list[dict[str, Any]]:
    return json.loads((TRACES / "cases.json").read_text())


@pytest.fixture(scope="session")
def trace() -> Callable[[str], Trace]:
    """A recorded case by its name: ``trace("boom_441kN_40C").log``."""
    cases = {case["name"]: case for case in _cases()}

    def find(name: str) -> Trace:
        return Trace(name, TRACES / f"{name}.csv.gz", TRACES / f"{name}_truth.csv.gz", cases[name])

    return find


@pytest.fixture(scope="session")
def traces(trace: Callable[[str], Trace]) -> list[Trace]:
    """All recorded cases."""
    return [trace(name) for name in trace_names()]


@pytest.fixture(scope="session")
def loader() -> Any:
    """The description of the mining loader."""
    return ramsight.load_machine("mining-loader")


@pytest.fixture(scope="session")
def units() -> dict[str, Any]:
    """The units of the mining loader, by their names."""
    return {name: ramsight.build("mining-loader", name) for name in ("boom", "bucket")}


@pytest.fixture(scope="session")
def boom(units: dict[str, Any]) -> Any:
    """The loader's boom."""
    return units["boom"]


@pytest.fixture(scope="module")
def logs() -> dict[str, Any]:
    """What both drives of the mining loader report of two lifts; before the second one the bucket is rolled back."""
    from ramsight.duty.linked_duty import simulate_linked, unit_run
    from ramsight.duty.loading import lifting
    from ramsight.duty.profile import Profile
    from ramsight.plant.linked import build_linked

    linked = build_linked(ramsight.load_machine("mining-loader"))
    duty = lifting(linked, [3000.0, 6000.0])
    begins = duty.phases[2][1]
    roll = Profile([0.0, begins - 1.6, begins - 1.4, begins - 1.0, begins - 0.8], [0.0, 0.0, -120.0, -120.0, 0.0])
    run = simulate_linked(linked, replace(duty, motor_speed=duty.motor_speed | {"bucket": roll}))
    return {name: ramsight.drive_report(unit_run(run, name)) for name in ("boom", "bucket")}


@pytest.fixture(autouse=True)
def columns(monkeypatch: pytest.MonkeyPatch) -> None:
    """What goes into a pipe has no columns; a worker of the tests has those of its terminal."""
    monkeypatch.delenv("COLUMNS", raising=False)


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch) -> Callable[..., ModuleType]:
    """A program of a folder beside the package, which finds its neighbours: ``script("pages", "evaluation")``."""

    def imported(name: str, folder: str = "evaluation") -> ModuleType:
        monkeypatch.syspath_prepend(TRACES.parents[1] / folder)
        return importlib.import_module(name)

    return imported
