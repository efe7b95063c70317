"""The studio's tabs: the machine that runs on the first; each other one is made when it is opened first."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from html import escape

from nicegui import background_tasks, run, ui

from ramsight.errors import DescriptionError, RamsightError
from ramsight.machine.description import Machine
from ramsight.studio.draft import Problem, problem
from ramsight.studio.live_page import live_page
from ramsight.studio.prepared import Prepared, prepare
from ramsight.studio.session import Place, Session
from ramsight.studio.setting import TABS, Setting
from ramsight.studio.visit import Visit

_NONE = (
    "<p>No store of histories is served. A history has a record of each log of a machine: how much its pump leaks, and"
    " how sure that is. Make one, and start the studio with it:</p>"
    '<pre style="white-space:pre-wrap">ramsight history add MACHINE LOGS… --store fleet.db\n'
    "ramsight studio --history fleet.db</pre>"
)


def _history(visit: Visit) -> None:
    """Show the store that the studio was started with, as it is now."""
    from ramsight.api.histories import report_text

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


_LOOK = 0.1  # s, from one look at whether a machine is ready to the next


class Running:
    """The first tab.

    Args:
        place: of the visitor, with the session that is ended when he goes.
    """

    def __init__(
        self,
        panel: ui.tab_panel,
        prepared: Prepared,
        session: Session,
        place: Place,
        naming: Callable[[str], object],
        setting: Setting,
        laid_out: Callable[[], object],
    ) -> None:
        self._panel, self._place, self._naming = panel, place, naming
        self._show(prepared, session, setting, laid_out)

    async def another(self, machine: Machine) -> Problem | None:
        """Let another machine run; the one before runs until that one is ready, and goes on if it cannot.

        Returns:
            Why it cannot run; None if it does.
        """
        async with self._place.changing:
            return await self._change(machine)

    async def _change(self, machine: Machine) -> Problem | None:
        try:
            prepared = await run.io_bound(prepare, machine)
        except DescriptionError as error:
            return problem(error)
        except RamsightError as error:
            return Problem("", str(error))
        session = (
            None
            if prepared is None or self._panel.client.is_deleted
            else await run.io_bound(Session, machine, waits=True)
        )
        if prepared is None or session is None:
            return Problem("", "the studio has ended, or nobody looks any more")
        while session.about is None and not session.over and not self._panel.client.is_deleted:
            await asyncio.sleep(_LOOK)
        if session.about is None or self._panel.client.is_deleted:
            await run.io_bound(session.close)
            return session.wrong or Problem("", session.ended)
        before, self._place.session = self._place.session, session
        if before is not None:
            await run.io_bound(before.close)
        self._panel.clear()
        # whoever has described a machine moves it himself
        self._show(prepared, session, Setting(scenario=None), can_link=False)
        return None

    def _show(
        self,
        prepared: Prepared,
        session: Session,
        setting: Setting,
        laid_out: Callable[[], object] = lambda: None,
        *,
        can_link: bool = True,
    ) -> None:
        described = prepared.described
        self._naming(described.title or described.name)
        with self._panel:
            live_page(prepared, session, setting, laid_out, can_link=can_link)


Build = Callable[[Visit], None]


def tabs(
    prepared: Prepared,
    session: Session,
    place: Place,
    naming: Callable[[str], object],
    setting: Setting,
    history: str | None = None,
) -> None:
    """Lay the tabs out for one visitor.

    Args:
        history: store of histories that is shown, or None.
    """
    visit = Visit(prepared.described, history)
    ui.context.client.on_delete(lambda: background_tasks.create(run.io_bound(visit.end)))
    waiting: dict[str, tuple[ui.tab_panel, Build]] = {}
    with ui.tabs().classes("w-full") as row:
        for name in TABS:
            ui.tab(name)

    def begin() -> None:
        if row.value == TABS[0]:  # a visitor may have turned to another one meanwhile
            row.set_value(setting.tab)

    with ui.tab_panels(row, value=TABS[0], keep_alive=True).classes("w-full bg-transparent"):
        live = Running(ui.tab_panel(TABS[0]), prepared, session, place, naming, setting, begin)
        for name, build in _LATER.items():
            with ui.tab_panel(name) as panel:
                waiting[name] = panel, build

    def opened(name: str) -> None:
        for one in (_DESCRIBED, name):  # the others work with what the browser kept of the description
            if one in waiting and name != TABS[0]:
                panel, build = waiting.pop(one)
                with panel:
                    build(visit)

    async def run_live(machine: Machine) -> Problem | None:
        wrong = await live.another(machine)
        if wrong is None:
            row.set_value(TABS[0])
        return wrong

    visit.run_live = run_live
    row.on_value_change(lambda e: ui.run_javascript(f"studio.tab({json.dumps(e.value)})"))
    row.on_value_change(lambda e: opened(e.value))


def _machines(visit: Visit) -> None:
    from ramsight.studio.machine_page import machine_page

    machine_page(visit)


def _logs(visit: Visit) -> None:
    from ramsight.studio.logs_page import logs_page

    logs_page(visit)


def _studies(visit: Visit) -> None:
    from ramsight.studio.studies_page import studies_page

    studies_page(visit)


_DESCRIBED = "Machines"
_LATER: dict[str, Build] = dict(zip(TABS[1:], (_machines, _logs, _studies, _history), strict=True))
