"""The page of a recorded log: drop it, see what its channels are taken for, track it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from nicegui import run, ui

from ramsight.studio.rig import SENSORS
from ramsight.studio.tracking import propose, track
from ramsight.studio.visit import Visit

_LARGEST = 250 * 2**20  # bytes of a file; a little less than the server takes of a request


def logs_page(visit: Visit) -> None:
    """Build the page for one visitor, whose files lie in his folder as long as the page is open."""
    page = _LogsPage(visit)
    page.build()


class _LogsPage:
    def __init__(self, visit: Visit) -> None:
        self.visit = visit
        self.files: dict[str, Path] = {}

    def build(self) -> None:
        """Lay the page out."""
        with ui.element("section").classes("panel"):
            ui.html("<h2>A drive log</h2>", sanitize=False)
            ui.label("CSV, CSV.GZ, Parquet, MF4, BLF, ASC or candump: motor speed, motor torque and oil temperature.")
            with ui.row().classes("items-start"):
                self._upload("log", "drop the log here")
                self._upload("truth", "true position, if known")
                with ui.column().classes("gap-1"):
                    self.unit = ui.select(
                        list(self.visit.machine.units), value=next(iter(self.visit.machine.units)), label="unit"
                    )
                    self.start = ui.input("piston at first, e.g. 120 mm")
                    self.sensor = ui.select(list(SENSORS), value=SENSORS[0], label="sensor")
                    self.mapped = ui.checkbox("use the proposed channel map")
                    ui.button("track", on_click=self._track).props("id=track")
            self.said = ui.label().props("id=log-said role=status").classes("whitespace-pre-wrap font-mono text-sm")
        self.shown = ui.element("section").classes("panel")
        with self.shown:
            ui.element("div").props("id=track-picture").classes("w-full")
        with ui.element("section").classes("panel"):
            ui.html("<h2>Channels and the proposed map</h2>", sanitize=False)
            self.channels = ui.element("div").classes("w-full")
            self.map = ui.textarea("channel map, to be checked: signs above all").classes("w-full font-mono")

    def _upload(self, role: str, words: str) -> None:
        async def take(event: Any) -> None:
            await self._take(role, event)

        ui.upload(
            label=words, on_upload=take, auto_upload=True, max_files=1, max_file_size=_LARGEST,
            on_rejected=lambda: self._say(f"refused: a file of at most {_LARGEST // 2**20} MiB"),
        ).props(f"id=upload-{role} flat bordered").classes("w-60")  # fmt: skip

    async def _take(self, role: str, event: Any) -> None:
        """Keep an uploaded file under its own name, without whatever folder its name has in it."""
        name = Path(event.file.name.replace("\\", "/")).name or "log"
        place = self.visit.folder / role
        place.mkdir(exist_ok=True)
        file = place / name
        await event.file.save(file)
        self.files[role] = file
        if role == "log":
            self._say(f"{name}: looking through …")
            self._proposed(name, await run.cpu_bound(propose, str(file)))
        else:
            self._say(f"{name}: the true position")

    def _proposed(self, name: str, found: dict[str, Any] | None) -> None:
        if found is None or "error" in found:
            self._say("the studio ends" if found is None else found["error"])
            return
        self._say("\n".join([f"{name}: {len(found['channels'])} channels", *found["warnings"]]))
        self.map.set_value(found["map"])
        self.channels.clear()
        with self.channels:
            ui.table(rows=found["channels"], row_key="name").classes("w-full").props("dense flat")

    async def _track(self) -> None:
        if "log" not in self.files:
            self._say("drop a log first")
            return
        self._say("tracking …")
        truth = self.files.get("truth")
        done = await run.cpu_bound(
            track, self.visit.machine, self.unit.value, str(self.files["log"]), None if truth is None else str(truth),
            self.start.value or "", self.sensor.value, self.map.value if self.mapped.value else "",
        )  # fmt: skip
        if done is None or "error" in done:
            self._say("the studio ends" if done is None else done["error"])
            return
        self._say("\n".join([done["summary"], *done["warnings"]]))
        await ui.run_javascript(f"studio.track('track-picture', {json.dumps(done['columns'])})", timeout=20.0)

    def _say(self, text: str) -> None:
        self.said.set_text(text)
