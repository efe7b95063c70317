"""The page of a data sheet: ask for one, watch it fill, stop it, open it."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

from nicegui import run, ui

from ramsight.api.studying import Study
from ramsight.machine.as_toml import as_toml
from ramsight.machine.description import Machine
from ramsight.studio.markup import Shared
from ramsight.studio.spawned import Job, Say
from ramsight.studio.visit import Visit
from ramsight.study.datasheet.sheet import Sheet
from ramsight.study.datasheet.sheet_page import FILES, write_sheet
from ramsight.study.datasheet.studied_duties import NAMED

_LOOK = 0.25  # s, from one look at what a study says to the next
_MOST, _USUAL = 100_000, 200  # machines
_MEANING = (
    "<p><b>95 % within</b>: 95 % of all samples have a smaller error. <b>95 % of the machines</b>: each machine has the"
    " error that 95 % of its own samples keep; 95 % of the machines keep this one. A machine is one more set of values"
    " from the description's tolerances. References are end stops and switches that the piston has met.</p>"
)


def studies_page(visit: Visit) -> None:
    """Build the page for one visitor."""
    _StudiesPage(visit).build()


class _StudiesPage:
    def __init__(self, visit: Visit) -> None:
        self.visit, self.client = visit, ui.context.client
        self.job: Job | None = None
        self.shared = Shared()
        self.grown: list[dict[str, float]] = []  # 95 % within, by group, after so many machines
        visit.on_end(self._end)

    def build(self) -> None:
        """Lay the page out."""
        machine = self.visit.machine
        with ui.element("section").classes("panel"):
            ui.html("<h2>A data sheet</h2>", sanitize=False)
            self.of = ui.label(_named(machine)).classes("font-medium")
            ui.label("Machines are drawn from the description's tolerances, simulated and tracked, by numbers.")
            with ui.row().classes("items-end gap-3"):
                self.unit = ui.select(list(machine.units), value=next(iter(machine.units)), label="unit of the sheet")
                self.unit.classes("w-36")
                self.duty = ui.select(list(NAMED), value=NAMED[0], label="duty").classes("w-36")
                self.sensor = ui.select(list(SHEET_SENSORS), value=SHEET_SENSORS[0], label="sensor of the sheet")
                self.sensor.classes("w-36")
                self.machines = ui.number("machines", value=_USUAL, min=1, max=_MOST, precision=0).classes("w-28")
                self.seed = ui.number("seed", value=0, min=0, precision=0).classes("w-24")
                ui.button("start", on_click=self._start).props("id=study-start")
                self.stopper = ui.button("stop", on_click=self._stop).props("id=study-stop")
            self.stopper.disable()
            self.bar = ui.linear_progress(0.0, show_value=False).props('aria-label="machines done" size=14px')
            self.said = ui.label().props("id=study-said role=status").classes("whitespace-pre-wrap")
        with ui.element("section").classes("panel"):
            ui.html("<h2>Accuracy so far</h2>", sanitize=False)
            ui.html(_MEANING, sanitize=False).classes("text-sm")
            ui.element("div").props("id=study-picture").classes("w-full")
            self.shown = ui.html("", sanitize=False).classes("w-full overflow-x-auto")
            self.shown.props('id=study-accuracy tabindex=0 role=region aria-label="accuracy so far"')
            self.links = ui.row().props("id=study-links").classes("gap-4")
        self.visit.on_machine(self._another)
        ui.timer(_LOOK, self._look)

    def _another(self, machine: Machine) -> None:
        self.of.set_text(_named(machine))
        kept = self.unit.value if self.unit.value in machine.units else next(iter(machine.units))
        self.unit.set_options(list(machine.units), value=kept)

    async def _start(self) -> None:
        await self._stop()
        self.links.clear()
        self.shown.set_content("")
        self.grown = []
        self.bar.set_value(0.0)
        self.said.set_text("is being made ready …")
        wanted = Wanted(
            self.visit.machine, self.unit.value, self.duty.value, self.sensor.value,
            int(self.machines.value or 1), int(self.seed.value or 0),
        )  # fmt: skip
        self.job = await run.io_bound(Job, fill, wanted, self.visit.folder)
        self.stopper.enable()

    async def _stop(self) -> None:
        job, self.job = self.job, None
        self.stopper.disable()
        if job is not None:
            await run.io_bound(job.stop)
            self.said.set_text(f"stopped; {self.said.text}\nThe same study goes on where it was.")

    def _look(self) -> None:
        if self.job is None:
            return
        for what, value in self.job.news():
            if what == "error":
                self.said.set_text(value)
            elif what == "so far":
                self._so_far(value)
            elif what == "written":
                self._written(Path(value))
        if not self.job.alive:
            self.job = None
            self.stopper.disable()

    def _so_far(self, found: dict[str, Any]) -> None:
        self.bar.set_value(found["done"] / found["wanted"])
        self.said.set_text(
            f"{found['done']} of {found['wanted']} machines, {found['failed']} that could not be simulated; "
            f"status: {found['status']}"
        )
        self.shown.set_content(_table(found["accuracy"]))
        self.grown.append(
            {"machines": found["done"]} | {one["errors"]: one["95 % within"] for one in found["accuracy"]}
        )
        self.client.run_javascript(f"studio.studied({json.dumps(self.grown)})")

    def _written(self, folder: Path) -> None:
        with self.links:
            self.shared.opening_link("open the sheet", folder / FILES[0])
            for name in FILES:
                self.shared.link(folder / name)

    def _end(self) -> None:
        self.shared.end()
        if self.job is not None:
            self.job.stop()


def _named(machine: Machine) -> str:
    return f"of {machine.title or machine.name}"


def _table(rows: list[dict[str, Any]]) -> str:
    """The accuracy of each group of errors; lengths in mm."""
    if not rows:
        return ""
    head = "".join(f'<th scope="col">{escape(name)}{_unit(name)}</th>' for name in rows[0])
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(_text(value))}</td>" for value in row.values()) + "</tr>" for row in rows
    )
    return f'<table class="numbers"><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>'


def _unit(name: str) -> str:
    return "" if name in ("errors", "machines") else " [mm]"


def _text(value: Any) -> str:
    return f"{value:.2f}" if isinstance(value, float) else str(value)


SHEET_SENSORS = ("kalman", "balance", "table")
_FIRST, _STEPS = 8, 20  # machines at first; after that so many times the accuracy so far is said


@dataclass(frozen=True)
class Wanted:
    """A study as a visitor asks for it."""

    machine: Machine
    unit: str
    # duty, sensor: as `Study` takes them
    duty: str
    sensor: str
    machines: int
    seed: int = 0

    def folder(self, below: Path) -> Path:
        """Where it is kept: the same study goes on where it was stopped, another one is elsewhere."""
        said = "\n".join([*as_toml(self.machine, {}), self.unit, self.duty, self.sensor, str(self.seed)])
        return below / f"study-{hashlib.sha256(said.encode()).hexdigest()[:16]}"


def fill(say: Say, wanted: Wanted, below: Path) -> None:
    """Do a study; says ``begun`` (its quantities), ``so far`` again and again, and ``written`` (the folder)."""
    out = wanted.folder(below)
    out.mkdir(exist_ok=True)
    whole = _study(wanted, wanted.machines)
    say("begun", whole.quantities)
    for count in steps(wanted.machines):
        study = _study(wanted, count)
        found = study.run(out / "machines.zarr")
        sheet = study.datasheet(found)
        say("so far", so_far(sheet, wanted.machines))
    sheet = whole.datasheet(found, whole.budget(0))
    title = f"{wanted.machine.title or wanted.machine.name}, unit {wanted.unit}"
    write_sheet(sheet, found, out, title)
    say("written", str(out))


def _study(wanted: Wanted, count: int) -> Study:
    return Study(wanted.machine, wanted.duty, wanted.sensor, unit=wanted.unit, machines=count, seed=wanted.seed)


def steps(machines: int) -> list[int]:
    """After how many machines the accuracy so far is said.

    Example:
        >>> steps(100)
        [8, 16, 24, 32, 40, 48, 56, 64, 72, 80, 88, 96, 100]
    """
    step = max(_FIRST, machines // _STEPS)
    return [*range(step, machines, step), machines]


def so_far(sheet: Sheet, wanted: int) -> dict[str, Any]:
    """What a page shows of a sheet that is not full yet: lengths in mm."""
    rows = [
        {
            "errors": one.group,
            "machines": one.machines,
            "95 % within": 1e3 * one.quantiles[1].value,
            "95 % of the machines": 1e3 * one.machine.value,
            "largest": 1e3 * one.largest,
        }
        for one in sheet.accuracy
        if one.machines
    ]
    validity = ", ".join(f"{name} {100.0 * share:.1f} %" for name, share in sheet.validity.items())
    return {"done": sheet.machines, "wanted": wanted, "failed": sheet.failed, "accuracy": rows, "status": validity}
