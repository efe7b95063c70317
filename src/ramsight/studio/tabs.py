"""The studio's tabs; each but the first is made when it is opened first, so that the page is there at once."""

from __future__ import annotations

import json
from collections.abc import Callable

from nicegui import background_tasks, run, ui

from ramsight.machine.description import Machine
from ramsight.studio.draft import Problem
from ramsight.studio.prepared import Prepared
from ramsight.studio.rig_holder import Running
from ramsight.studio.session import Session
from ramsight.studio.setting import TABS, Setting
from ramsight.studio.visit import Visit
from ramsight.studio.visitors import Place

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
    with ui.tab_panels(row, value=TABS[0], keep_alive=True).classes("w-full bg-transparent"):
        live = Running(
            ui.tab_panel(TABS[0]), prepared, session, place, naming, setting, lambda: row.set_value(setting.tab)
        )
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


def _history(visit: Visit) -> None:
    from ramsight.studio.history_tab import history_tab

    history_tab(visit)


_DESCRIBED = "Machines"
_LATER: dict[str, Build] = dict(zip(TABS[1:], (_machines, _logs, _studies, _history), strict=True))
