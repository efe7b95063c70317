"""The machine that runs for a visitor, on the first tab: the one he came for, until another one takes its place."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from nicegui import run, ui

from ramsight.errors import DescriptionError, RamsightError
from ramsight.machine.description import Machine
from ramsight.studio.draft import Problem, problem
from ramsight.studio.live_page import live_page
from ramsight.studio.prepared import Prepared, prepare
from ramsight.studio.session import Session
from ramsight.studio.setting import Setting
from ramsight.studio.visitors import Place

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
        session = None if prepared is None or self._panel.client.is_deleted else await run.io_bound(Session, machine)
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
