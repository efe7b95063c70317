"""One HTML page that tries sensors of the catalogue without an installation: as WebAssembly, with an example each."""

from __future__ import annotations

import gzip
import json
from base64 import b64encode
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ramsight._version import __version__
from ramsight.deploy.c_function import asset, template
from ramsight.deploy.compiler import zig_for
from ramsight.deploy.wasm import camel, wasm_of
from ramsight.duty.drive_report import declared_report, reported
from ramsight.duty.simulate import simulated
from ramsight.duty.work_day import work_day
from ramsight.logs.channels import TIME
from ramsight.logs.drive_log import CHANNELS
from ramsight.machine import load_machine
from ramsight.output import check_target, write_text
from ramsight.output.cells import rows_text
from ramsight.plant.as_built import AsBuilt
from ramsight.plant.build import build
from ramsight.plant.limits import limits_of
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.kalman import kalman
from ramsight.sensor.kind import Kind

MODULES = ("chart", "columns", "csv", "cylinder", "follow", "pattern")
"""What the page's script imports beside the sensor; files of `deploy/web/page`."""
_RECORDED = ("demo/workday.csv.gz", "demo/workday_truth.csv.gz")  # data files of the demonstration, in the package
_AS_BUILT = {"leak": 1.15, "displacement": 0.996, "friction": 1.3}  # as the demonstration's machine
_LOADS = (0.1, 0.5)  # shares of what relief pressure holds
_TEMPERATURE = 313.15  # K
_DURATION, _VISIT_EVERY = 240.0, 20.0  # s
_TRUTH_EVERY = 5  # samples


@dataclass(frozen=True)
class Shown:
    """A unit of the catalogue that the page offers."""

    machine: str
    unit: str  # the unit's name
    title: str  # what the page calls it
    recorded: tuple[str, str] | None = None  # log and truth in the package; without them its example is simulated


SHOWN = (
    Shown("mining-loader", "boom", "Boom of a mining loader", _RECORDED),
    Shown("mining-loader", "bucket", "Bucket of a mining loader"),
    Shown("press", "ram", "Press, 400 kN"),
    Shown("forklift-mast", "lift", "Mast of a forklift, 2 t"),
)
"""What the page offers, in its order."""


def write_page(out: str | Path, *, advance: Callable[[int], object] = lambda count: None) -> int:
    """Write the page, whole or not at all.

    Returns:
        Its size [bytes].

    Raises:
        OutputError: the file cannot be written.
        CompilerError: the package ziglang is missing.
    """
    check_target(Path(out), (".html",))
    zig_for("WebAssembly")  # before the work
    machines = []
    for one in SHOWN:
        machines.append(_machine(one))
        advance(1)
    text = template(
        "web/page/page.html",
        style=asset("web/page/page.css"),
        version=__version__,
        machines=_inline(machines),
        modules=_inline({"imports": dict(_modules())}),
        script=asset("web/page/page.mjs"),
    )
    write_text(text, out)
    return len(text.encode())


def _machine(shown: Shown) -> dict[str, object]:
    """What the page knows of a unit: its sensor, its shape, and its example."""
    described = load_machine(shown.machine)
    unit, cylinder = build(described, shown.unit), described.unit(shown.unit).cylinder
    sensor = kalman(unit)
    made = wasm_of(sensor, unit, described.name)
    said = {f"{kind.text}_probability": kind.words for kind in Kind}
    if shown.recorded:
        log, truth = (b64encode((resources.files("ramsight") / name).read_bytes()).decode() for name in shown.recorded)
    else:
        log, truth = (_packed(text.encode()) for text in _example(unit))
    return {
        "name": f"{shown.machine} {shown.unit}",
        "title": shown.title,
        "facts": made.facts,
        "shape": {"bore": cylinder.bore, "rod": cylinder.rod, "stroke": cylinder.stroke},
        "hypotheses": {camel(name): words for name, words in said.items() if name in sensor.recursion.outputs},
        "note": f"Example: {'six minutes' if shown.recorded else 'four minutes'} of work, simulated; the "
        "machine leaks 15 % more than its data sheet says, and nobody knows where the piston starts.",
        "wasm": _packed(made.code),
        "log": log,
        "truth": truth,
    }


def _example(unit: HydraulicUnit) -> tuple[str, str]:
    """A simulated work day of a machine that is not its data sheet: log and true position as CSV."""
    force = limits_of(unit).load
    loads = (_LOADS[0] * force, _LOADS[1] * force)
    duty = work_day(unit, loads, _TEMPERATURE, duration=_DURATION, visit_every=_VISIT_EVERY, seed=1)
    real = AsBuilt(**_AS_BUILT).apply(unit)
    run = simulated(real, duty).columns()
    log = reported(run, declared_report(real, 1))
    columns = {TIME: log["time"].values} | {one.column: one.from_si(log[one.name].values) for one in CHANNELS}
    truth = {TIME: run["time"].values[::_TRUTH_EVERY], "position_m": run["position"].values[::_TRUTH_EVERY]}
    return _csv(columns, ("%.3f", "%.3f", "%.4f", "%.1f")), _csv(truth, ("%.2f", "%.6f"))


def _csv(columns: Mapping[str, NDArray[np.float64]], formats: Sequence[str]) -> str:
    """A table with as many digits as the page needs."""
    text = rows_text(list(columns.items()), dict(zip(columns, formats, strict=True)))
    return f"{','.join(columns)}\n{text.decode()}"


def _packed(data: bytes) -> str:
    """Bytes as gzip in base64, the same for the same bytes."""
    return b64encode(gzip.compress(data, mtime=0)).decode()


def _modules() -> Iterator[tuple[str, str]]:
    """The page's modules by name, each an address that has its text: a file on a disk may import no other one."""
    paths = {name: f"web/page/{name}.mjs" for name in MODULES} | {"sensor": "web/sensor.mjs"}
    for name, path in paths.items():
        yield name, f"data:text/javascript;base64,{b64encode(asset(path).encode()).decode()}"


def _inline(value: object) -> str:
    """JSON that ends no script."""
    return json.dumps(value, separators=(",", ":")).replace("<", "\\u003c")
