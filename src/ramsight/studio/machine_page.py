"""The page of a description: a form of all its values, its circuits as menus, and the file itself."""

from __future__ import annotations

import json
from collections.abc import Collection
from html import escape
from typing import Any

from nicegui import run, ui

from ramsight.drawing import drawn, svg
from ramsight.drawing.notes import BOTH_SIDES
from ramsight.errors import RamsightError
from ramsight.machine import catalogue
from ramsight.machine.description import Machine
from ramsight.plant.build import build
from ramsight.studio.draft import Problem, Row, can_be_read, edited, follows, read, rows, text_of
from ramsight.studio.markup import scrolled
from ramsight.studio.visit import Visit

_KEPT = "ramsight-description"  # where the browser keeps it
_LARGEST = 2**20  # bytes of a description
_FINDING = (
    '<div class="finding"><input type="search" id="machine-search" aria-label="find a value"'
    ' placeholder="find a value: bore, leak, bar …" autocomplete="off" spellcheck="false">'
    '<label><input type="checkbox" id="machine-given"> only what is given</label>'
    '<span id="machine-found" role="status"></span></div>'
)
"""What `description.js` shows of the form by."""


def machine_page(visit: Visit) -> None:
    """Build the page for one visitor."""
    page = _MachinePage(visit)
    page.build()
    ui.timer(0.0, page.begin, once=True)


class _MachinePage:
    def __init__(self, visit: Visit) -> None:
        self.visit, self.machine = visit, visit.machine
        self.text = self.valid = text_of(visit.machine)
        self.problem: Problem | None = None
        self.edited = ""  # the field that was edited last: what is wrong and names no field is put to it
        self.client = ui.context.client

    def build(self) -> None:
        """Lay the page out."""
        with ui.element("section").classes("panel"):
            ui.html("<h2>A description</h2>", sanitize=False)
            ui.label("Every value with its unit, its range and where it comes from; other tabs use it once it holds.")
            with ui.row().classes("items-center gap-2"):
                names = [one.name for one in catalogue.entries() if one.kind == "machine"]
                self.like = ui.select(names, label="begin with").classes("w-48").props("dense")
                self.like.on_value_change(lambda e: self._begin_with(e.value))
                opened = ui.upload(
                    label="open a TOML file", on_upload=self._open, auto_upload=True, max_file_size=_LARGEST
                )
                opened.props("id=open-description flat bordered").classes("w-60")
                ui.button("download the TOML file", on_click=self._download).props("id=download-description")
                self.runner = ui.button("run it live", on_click=self._run).props("id=run-description")
            self.said = ui.label().props("id=machine-said role=status").classes("whitespace-pre-wrap")
        with ui.element("div").classes("described"):
            with ui.column().classes("gap-3 min-w-0 w-full"):
                with ui.element("section").classes("panel circuit"):
                    ui.html("<h2>The circuit</h2>", sanitize=False)
                    ui.label("a part leads to its values").props("id=machine-part").classes("text-sm")
                    self.circuit = ui.html("", sanitize=False).props("id=machine-circuit").classes("w-full")
                with ui.element("section").classes("panel"):
                    ui.html("<h2>Values</h2>", sanitize=False)
                    ui.html(_FINDING, sanitize=False).classes("w-full")
                    self.form = ui.html("", sanitize=False).props("id=machine-form").classes("w-full")
            with ui.column().classes("gap-3 min-w-0 w-full"):
                with ui.element("section").classes("panel"):
                    ui.html("<h2>What follows</h2>", sanitize=False)
                    self.follows = ui.html("", sanitize=False).props("id=machine-follows").classes("w-full")
                with ui.element("section").classes("panel"):
                    ui.html("<h2>The file</h2>", sanitize=False)
                    self.file = ui.textarea("TOML").classes("w-full font-mono").props("for=machine-file rows=16")
                    ui.button("take this text", on_click=lambda: self._take(self.file.value or "")).props("dense")
        ui.on("description-edited", self._edited)

    async def begin(self) -> None:
        """Show what the browser kept of the last time, or the machine that the studio was opened with."""
        found = await ui.run_javascript(f"studio.kept({json.dumps(_KEPT)})", timeout=20.0)
        if found:
            kept = read(found["valid"])
            if isinstance(kept, Machine):
                self.machine, self.valid = kept, found["valid"]
            await self._take(found["text"])
        else:
            await self._take(self.text)

    async def _begin_with(self, name: str) -> None:
        await self._take(catalogue.find("machine", name).path.read_text(encoding="utf-8"))

    async def _open(self, event: Any) -> None:
        content = await event.file.read()
        await self._take(content.decode("utf-8-sig", errors="replace"))

    def _download(self) -> None:
        ui.download.content(self.text, f"{self.machine.name}.toml", "application/toml")

    async def _run(self) -> None:
        """Let the machine run on the first tab as it is described now; no file is written."""
        if self.problem is not None or self.visit.run_live is None:
            self.said.set_text(f"not run: {self._wrong()}")
            return
        self.said.set_text(f"{self.machine.title or self.machine.name} is being made ready to run …")
        self.runner.disable()
        machine = self.machine
        try:
            wrong = await self.visit.run_live(machine)
        finally:
            self.runner.enable()
        if wrong is None:
            self.said.set_text(f"{machine.title or machine.name} runs on the first tab")
        elif machine is self.machine:
            shown = rows(self.text, self.machine)
            named = any(row.path == wrong.path for row in shown)
            self.problem = wrong if named else Problem(self.edited, wrong.words)
            self._mark(shown)
            self.said.set_text(f"not run: {self._wrong()}")

    def _wrong(self) -> str:
        """What is wrong, and where."""
        if self.problem is None:
            return ""
        return f"{self.problem.path}: {self.problem.words}" if self.problem.path else self.problem.words

    async def _edited(self, event: Any) -> None:
        """One field of the form was changed."""
        path, key, value = event.args
        if key not in ("value", "source"):
            return
        self.edited = path
        before = {row.path for row in rows(self.text, self.machine)}
        self.text = edited(self.text, self.machine, path, **{key: value})
        self._read()
        shown = rows(self.text, self.machine)
        if {row.path for row in shown} != before:
            self._draw(shown)
        self._mark(shown)
        await self._after()

    async def _take(self, text: str) -> None:
        """Take a whole text in the place of the one before."""
        wrong = can_be_read(text)
        if wrong is not None:
            self.said.set_text(f"not taken: {wrong.words}")
            return
        self.text = text
        self.edited = ""
        self._read()
        shown = rows(self.text, self.machine)
        self._draw(shown)
        self._mark(shown)
        await self._after()

    def _read(self) -> None:
        """See whether the text holds."""
        found = read(self.text)
        if isinstance(found, Problem):
            self.problem = Problem(found.path or self.edited, found.words)
        else:
            self.machine, self.valid, self.problem = found, self.text, None

    def _draw(self, shown: list[Row]) -> None:
        self.form.set_content("".join(_tables(shown)))

    def _mark(self, shown: list[Row]) -> None:
        """Say at the fields what they hold and what is wrong."""
        fields = {row.path: [row.text, row.usual, row.source] for row in shown}
        wrong = {} if self.problem is None else {self.problem.path: self.problem.words}
        self.client.run_javascript(f"studio.description({json.dumps(fields)}, {json.dumps(wrong)})")

    async def _after(self) -> None:
        """Keep the text in the browser, and say what follows from it."""
        self.file.set_value(self.text)
        kept = {"text": self.text, "valid": self.valid}
        self.client.run_javascript(f"studio.keep({json.dumps(_KEPT)}, {json.dumps(kept)})")
        if self.problem is not None:
            self.said.set_text(self._wrong())
            return
        self.visit.use(self.machine)
        self.said.set_text(f"{self.machine.title or self.machine.name} holds")
        text, circuits = await run.io_bound(_results, self.machine, list(_groups(rows(self.text, self.machine)))) or (
            "",
            "",
        )
        self.follows.set_content(scrolled(text, "what follows"))
        if circuits != self.circuit.content:  # what has the focus keeps it
            self.circuit.set_content(circuits)


def _results(machine: Machine, groups: list[str]) -> tuple[str, str]:
    """What follows from a description, and its circuits; "" for those if one cannot be drawn."""
    try:
        circuits = circuit_menu(machine, groups)
    except RamsightError:
        circuits = ""
    return follows(machine), circuits


def _groups(shown: list[Row]) -> dict[str, list[Row]]:
    """The values of each table of the description."""
    groups: dict[str, list[Row]] = {}
    for row in shown:
        groups.setdefault(row.path.rpartition(".")[0], []).append(row)
    return groups


def _tables(shown: list[Row]) -> list[str]:
    """The form: a table of the description a group that opens, a value a row."""
    parts = []
    for k, (name, own) in enumerate(_groups(shown).items()):
        opened = " open" if k == 0 else ""
        parts.append(f'<details{opened} data-group="{escape(name)}"><summary>{escape(name or "machine")}</summary>')
        parts += [_field(row) for row in own]
        parts.append("</details>")
    return parts


def _field(row: Row) -> str:
    """A value's row: its name and meaning, the value, its source, its range and what is wrong with it."""
    path, name = escape(row.path), escape(row.path.rpartition(".")[2])
    allowed = "; ".join(one for one in (row.unit if row.unit != "1" else "", row.range) if one)
    return (
        f'<div class="field" data-path="{path}"><label for="value-{path}">{name}'
        f' <span class="meaning">{escape(row.meaning)}</span></label>'
        f'<input id="value-{path}" data-key="value" aria-describedby="note-{path}" autocomplete="off"'
        ' spellcheck="false">'
        f'<input data-key="source" aria-label="source of {path}" placeholder="source" autocomplete="off">'
        f'<div class="note" id="note-{path}"><span class="range">{escape(allowed)}</span>'
        f' <span class="wrong" role="alert"></span></div></div>'
    )


_SENSORS = {"oil temperature": "assumptions.thermometer", "pressure_a": "assumptions.pressure",
            "pressure_b": "assumptions.pressure"}  # fmt: skip


def section_of(unit: str, part: str, groups: Collection[str]) -> str | None:
    """The table of a description that describes a part of a circuit; None if there is none.

    Example:
        >>> groups = ["units.boom", "units.boom.relief_valve", "units.boom.pump_a", "units.boom.hose"]
        >>> [section_of("boom", part, groups) for part in ("pump_a", "relief_b", "hose_a", "load")]
        ['units.boom.pump_a', 'units.boom.relief_valve', 'units.boom.hose', None]
    """
    stem = part.removesuffix("_a").removesuffix("_b")
    names = (_SENSORS.get(part, part), f"parts.{part}", stem, BOTH_SIDES.get(stem, stem))
    return next((found for one in names if (found := f"units.{unit}.{one}") in groups), None)


def circuit_menu(machine: Machine, groups: Collection[str]) -> str:
    """The circuits of all units as HTML, each part a button with `data-section`.

    Raises:
        RamsightError: a unit cannot be built or drawn.
    """
    parts: list[str] = []
    for name, unit in machine.units.items():
        sheet = drawn(build(unit, name), f"circuit of {name}")
        found = {placed.name: section_of(name, placed.name, groups) for placed in sheet.placed}
        sections = {part: section for part, section in found.items() if section is not None}
        head = f"<h3>{escape(name)}</h3>" if len(machine.units) > 1 else ""
        parts.append(head + svg.text(sheet, sections))
    return "".join(parts)
