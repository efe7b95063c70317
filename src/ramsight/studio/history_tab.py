"""The page of a store of histories: how the machines of a fleet change, as `ramsight history report` writes it."""

from __future__ import annotations

from html import escape

from nicegui import run, ui

from ramsight.api.histories import report_text
from ramsight.errors import RamsightError
from ramsight.studio.visit import Visit

_NONE = (
    "<p>No store of histories is served. A history has a record of each log of a machine: how much its pump leaks, and"
    " how sure that is. Make one, and start the studio with it:</p>"
    '<pre style="white-space:pre-wrap">ramsight history add MACHINE LOGS… --store fleet.db\n'
    "ramsight studio --history fleet.db</pre>"
)


def history_tab(visit: Visit) -> None:
    """Show the store that the studio was started with, as it is now."""
    store = visit.history
    with ui.element("section").classes("panel"):
        ui.html("<h2>How machines change</h2>", sanitize=False)
        if store is None:
            ui.html(_NONE, sanitize=False)
            return
        said = ui.label("the store is read …").props("id=fleet-said role=status").classes("text-sm")
        again = ui.button("read again", on_click=lambda: read()).props("dense size=sm no-caps")
        shown = ui.html("", sanitize=False).classes("w-full")

    async def read() -> None:
        again.disable()
        try:
            page = str(await run.io_bound(report_text, store))
        except RamsightError as error:
            said.set_text(str(error))
        else:
            said.set_text("")
            # No script of a page runs in such a frame; what a store has of names is text there.
            words = 'class="fleet" sandbox="" title="how machines change" tabindex="0"'
            shown.set_content(f'<iframe {words} srcdoc="{escape(page)}"></iframe>')
        again.enable()

    ui.timer(0.0, read, once=True)
