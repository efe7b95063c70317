"""The page of a recorded log: drop it, see what its channels are taken for, track it, judge it, take the results."""

from __future__ import annotations

import json
from bisect import bisect
from collections.abc import Awaitable, Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from nicegui import run, ui

from ramsight.log_formats import READABLE
from ramsight.machine.description import Machine
from ramsight.studio import uploaded_log
from ramsight.studio.knobs import SENSORS
from ramsight.studio.known_panel import places_panel, reasons_panel
from ramsight.studio.map_form import MapForm, entry, is_standard
from ramsight.studio.markup import Shared, scrolled
from ramsight.studio.spawned import Job, Say
from ramsight.studio.thinning import Floats, kept, thinned
from ramsight.studio.visit import Visit

_LARGEST = 250 * 2**20  # bytes of a file; a little less than the server takes of a request
_LOOK = 0.2  # s, from one look at what a process says to the next
_PIXELS = 1500  # of a picture, where the page does not say how wide it is
_WORK: dict[str, Callable[[Say, uploaded_log.Asked], None]] = {
    "leak test": uploaded_log.find_leak,
    "identified factors": uploaded_log.find_factors,
    "report": uploaded_log.judge,
}


def logs_page(visit: Visit) -> None:
    """Build the page for one visitor, whose files lie in his folder as long as the page is open."""
    page = _LogsPage(visit)
    page.build()


class _LogsPage:
    def __init__(self, visit: Visit) -> None:
        self.visit = visit
        self.files: dict[str, Path] = {}
        self.asked: uploaded_log.Asked | None = None
        self.job: Job | None = None
        self.looks = ""  # the file that is looked through now
        self.waiting: list[Callable[[], Awaitable[None]]] = []  # what is done once it was
        self.columns: dict[str, Floats] = {}
        self.references: list[dict[str, Any]] = []
        self.known: list[tuple[float, dict[str, Any]]] = []  # what the sensor knew, and when
        self.named: dict[str, ui.label] = {}
        self.client, self.shared = ui.context.client, Shared()
        visit.on_end(self.shared.end)
        visit.on_end(lambda: None if self.job is None else self.job.stop())

    def build(self) -> None:
        """Lay the page out."""
        with ui.element("section").classes("panel"):
            self._inputs()
        with (
            ui.element("section").classes("panel mt-3") as self.choosing,
            ui.expansion("Which channel is what").classes("w-full") as self.roles,
        ):
            ui.label("as proposed by names, units and values; look at the signs: positive extends the rod")
            self.form = MapForm(lambda: self.map.value or "", self._mapped)
        self.choosing.set_visibility(False)
        with ui.element("section").classes("panel"):
            ui.label("drag to look closer, double-click for all of it").classes("text-xs")
            self.advice = ui.label().props("id=log-advice role=status").classes("advice")
            ui.element("div").props("id=track-picture").classes("w-full")
            ui.element("div").props("id=error-picture").classes("w-full")
            self.exports = ui.row().props("id=log-exports").classes("gap-4")
        with ui.element("div").props("id=log-knows") as self.knows:
            self._knows()
        self.knows.set_visibility(False)
        with ui.element("div").classes("described"):
            with ui.element("section").classes("panel"):
                ui.html("<h2>References found</h2>", sanitize=False)
                self.found = ui.element("div").props("id=log-references").classes("w-full")
            with ui.element("section").classes("panel"):
                ui.html("<h2>What the log says of the machine</h2>", sanitize=False)
                with ui.row().classes("gap-1"):
                    for name in _WORK:
                        ui.button(name, on_click=lambda _, n=name: self._begin(_WORK[n])).props("dense no-caps")
                self.judged = ui.html("", sanitize=False).props("id=log-judged").classes("w-full")
        with ui.element("section").classes("panel mt-3"):
            ui.html("<h2>Channels of the log, and the map as a file</h2>", sanitize=False)
            self.channels = ui.element("div").classes("w-full")
            self.map = ui.textarea("channel map, to be checked: signs above all").classes("w-full font-mono")
        ui.timer(_LOOK, self._look)
        ui.on("track-view", self._show)
        ui.on("track-at", self._point)
        self.visit.on_machine(self._another)

    def _inputs(self) -> None:
        machine = self.visit.machine
        ui.html("<h2>A drive log</h2>", sanitize=False)
        ui.label(f"{READABLE}: motor speed, motor torque and oil temperature.")
        with ui.row().classes("items-start"):
            self._upload("log", "drop the log here")
            self._upload("truth", "true position, if known")
            with ui.column().classes("gap-1"):
                self.unit = ui.select(list(machine.units), value=next(iter(machine.units)), label="unit")
                self.start = ui.input("piston at first, e.g. 120 mm").classes("w-60")
                self.sensor = ui.select(list(SENSORS), value=SENSORS[0], label="sensor")
                self.hindsight = ui.checkbox("in hindsight: by all of the log")
                self.mapped = ui.checkbox("use the channel map below")
                ui.button("track", on_click=lambda: self._begin(uploaded_log.track)).props("id=track")
        self.bar = ui.linear_progress(0.0, show_value=False).props('aria-label="share of the log that is done"')
        self.said = ui.label().props("id=log-said role=status").classes("whitespace-pre-wrap font-mono text-sm")

    def _knows(self) -> None:
        """Places for what the sensor knew at an instant, which the pointer in the track or the slider chooses."""
        ui.label("point at the track, or move: what a live sensor knew then").classes("text-xs mt-3")
        with ui.row().classes("w-full items-center no-wrap"):
            self.when = ui.label().props("id=log-known-at").classes("text-sm whitespace-nowrap")
            self.instant = ui.slider(min=0, max=1, step=1, on_change=self._show_known)
            self.instant.props('aria-label="instant of the log"')
        with ui.element("div").classes("described"):
            places_panel("log-known")
            reasons_panel("log-known")

    def _point(self, event: Any) -> None:
        """The pointer is at a time of the track."""
        if self.known:
            later = bisect([time for time, _ in self.known], float(event.args))
            self.instant.set_value(max(later - 1, 0))

    def _show_known(self) -> None:
        """Draw what the sensor knew at the chosen instant."""
        if not self.known:
            return
        time, known = self.known[min(int(self.instant.value), len(self.known) - 1)]
        true = None
        if "true" in self.columns:
            at = float(np.interp(time, self.columns["time"], self.columns["true"]))
            true = at if np.isfinite(at) else None
        self.when.set_text(f"{time:.1f} s")
        self.client.run_javascript(f"studio.knows({json.dumps(known)}, {json.dumps(true)}, 'log-known')")

    def _another(self, machine: Machine) -> None:
        self._forget()
        value = self.unit.value if self.unit.value in machine.units else next(iter(machine.units))
        self.unit.set_options(list(machine.units), value=value)

    def _upload(self, role: str, words: str) -> None:
        async def take(event: Any) -> None:
            await self._take(role, event)
            place.reset()  # so that another file can be dropped at once

        async def remove() -> None:
            if self.files.pop(role, None) is not None:
                if self.looks != "log":  # which goes on without it
                    self._look_no_more()
                    await self._stop()
                self._forget()
                named.set_text(f"{role}: none")

        with ui.column().classes("gap-1 w-60"):
            place = ui.upload(
                label=words, on_upload=take, auto_upload=True, max_file_size=_LARGEST,
                on_rejected=lambda: self._say(f"refused: a file of at most {_LARGEST // 2**20} MiB"),
            ).props(f"id=upload-{role} flat bordered").classes("w-full")  # fmt: skip
            named = self.named[role] = ui.label(f"{role}: none").classes("text-sm")
            if role == "truth":
                ui.button("remove the true position", on_click=remove, color=None).props(
                    "dense no-caps unelevated"
                ).classes("latch")

    async def _take(self, role: str, event: Any) -> None:
        """Keep an uploaded file under its own name, without whatever folder its name has in it."""
        name = Path(event.file.name.replace("\\", "/")).name or "log"
        place = self.visit.folder / role
        place.mkdir(exist_ok=True)
        file = place / name
        await event.file.save(file)
        self.files[role] = file
        self.named[role].set_text(f"{role}: {name}")
        if role == "log":
            self.client.run_javascript(f"studio.holds('log', {json.dumps(name)})")
            self._look_no_more()
            self.channels.clear()
            self.map.set_value("")
            self.choosing.set_visibility(False)
        await self._after_look(partial(self._look_through, role))

    async def _after_look(self, do: Callable[[], Awaitable[None]]) -> None:
        """Do something, once no file is looked through any more."""
        if self.looks:
            self.waiting.append(do)
        else:
            await do()

    async def _look_through(self, role: str) -> None:
        if role not in self.files:  # taken away meanwhile
            return
        file = self.files[role]
        self._forget()
        self._say(f"{file.name}: looked through …")
        self.looks = role  # before anything is awaited: who asks for a track from now on waits
        await self._work(uploaded_log.propose if role == "log" else uploaded_log.look_at_truth, str(file))

    def _look_no_more(self) -> None:
        self.looks = ""
        self.waiting.clear()

    def _proposed(self, found: dict[str, Any]) -> None:
        self._say(f"{self.files['log'].name}: {len(found['channels'])} channels")
        self.map.set_value(found["map"])
        names = [one["name"] for one in found["channels"]]
        clock = entry(found["map"], "time").channel
        self.form.show([*([clock] if clock and clock not in names else []), *names])
        self.mapped.set_value(not is_standard({*names, clock}))
        self.roles.set_value(self.mapped.value)  # of a log with the usual columns nothing has to be chosen
        self.choosing.set_visibility(True)
        self.channels.clear()
        with self.channels:
            ui.table(rows=found["channels"], row_key="name").classes("w-full").props("dense flat")

    def _mapped(self, text: str) -> None:
        """The form has changed the map: it is what is used from now on."""
        self.map.set_value(text)
        self.mapped.set_value(True)

    def _forget(self) -> None:
        """Take away what belongs to another file, or to another description of the machine."""
        self.asked, self.columns, self.references, self.known = None, {}, [], []
        self.knows.set_visibility(False)
        self.bar.set_value(0.0)
        self.advice.set_text("")
        self.exports.clear()
        self.found.clear()
        self.judged.set_content("")
        self.client.run_javascript("studio.forget()")

    async def _stop(self) -> None:
        """Stop whatever is still going on; what it has said and nobody has heard is dropped."""
        job, self.job = self.job, None
        if job is not None:
            await run.io_bound(job.stop)

    async def _work(self, work: Callable[..., None], *arguments: Any) -> None:
        """Have something done; whatever is still going on is stopped."""
        await self._stop()
        self.job = await run.io_bound(Job, work, *arguments)

    async def _begin(self, work: Callable[[Say, uploaded_log.Asked], None]) -> None:
        """Have a log worked on."""
        if "log" not in self.files:
            self._say("drop a log first")
            return
        if self.looks:
            self._say(f"{self.files[self.looks].name}: looked through …, then worked on")
            self.waiting.append(partial(self._begin, work))
            return
        truth = self.files.get("truth")
        asked = self.asked = uploaded_log.Asked(
            self.visit.machine, self.unit.value, str(self.files["log"]), None if truth is None else str(truth),
            self.start.value or "", self.sensor.value, self.map.value if self.mapped.value else "",
            self.hindsight.value,
        )  # fmt: skip
        self.bar.set_value(0.0)
        if work is uploaded_log.track:
            self._forget()
            self.asked = asked
            self._say("tracking …")
        else:
            self.judged.set_content("<p>worked out …</p>")
        await self._work(work, asked)

    async def _look(self) -> None:
        """Take what a process has sent."""
        job = self.job
        if job is None:
            return
        for what, value in job.news():
            await self._take_news(what, value)
        if not job.alive and self.job is job:
            self.job, self.looks = None, ""
            waiting, self.waiting = self.waiting, []
            for do in waiting:
                await self._after_look(do)

    async def _take_news(self, what: str, value: Any) -> None:
        if what == "progress":
            self.bar.set_value(value)
        elif what == "error":
            self._say(value)
            if self.looks:
                self.waiting.clear()
            if self.looks == "truth":
                self.files.pop("truth", None)
                self.named["truth"].set_text("truth: none")
            self.judged.set_content("")
        elif what == "warnings" and value:
            self._say("\n".join([self.said.text, *value]))
        elif what == "truth":
            self.files["truth"] = self.files["truth"].with_name(value["file"])
            self._say(value["said"])
        elif what == "proposed":
            self._proposed(value)
        elif what == "tracked":
            await self._tracked(value)
        elif what == "known":
            self._knew(value)
        elif what == "drawn":
            self._offer(*value)
        elif what in ("leak test", "factors", "report"):
            self.judged.set_content(scrolled(value, "what the log says of the machine"))
            if what == "report":
                self._offer(uploaded_log.REPORT)

    async def _tracked(self, found: dict[str, Any]) -> None:
        assert self.asked is not None
        self.bar.set_value(1.0)
        self._say(found["summary"])
        self.advice.set_text(found["advice"])
        self._offer(uploaded_log.TRACK)
        self.references = found["references"]
        self.found.clear()
        with self.found:
            if self.references:
                ui.table(rows=self.references, pagination=10).classes("w-full").props("dense flat")
            else:
                ui.label("none: neither an end stop nor a reference of the log")
        self.columns = await run.io_bound(kept, self.asked.folder / uploaded_log.VIEW) or {}
        await self._send(None, None, _PIXELS)

    def _knew(self, found: list[tuple[float, dict[str, Any]]]) -> None:
        self.known = found
        self.knows.set_visibility(True)
        self.instant.props(f"max={max(len(found) - 1, 1)}")
        self.instant.set_value(len(found) - 1)
        self._show_known()

    async def _show(self, event: Any) -> None:
        """The visitor looks closer."""
        begin, end, pixels = event.args
        if self.columns:
            await self._send(begin, end, max(min(int(pixels), 4000), 50))

    async def _send(self, begin: float | None, end: float | None, pixels: int) -> None:
        seen = await run.io_bound(thinned, self.columns, pixels, begin, end)
        at = [row["time [s]"] for row in self.references]
        self.client.run_javascript(f"studio.track({json.dumps(seen)}, {json.dumps(at)})")

    def _offer(self, *names: str) -> None:
        """Links to what was written."""
        assert self.asked is not None
        with self.exports:
            for name in names:
                self.shared.link(self.asked.folder / name)

    def _say(self, text: str) -> None:
        self.said.set_text(text)
