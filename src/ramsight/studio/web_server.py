"""The studio's server: pages, the files that they need, and who may ask for them."""

from __future__ import annotations

import asyncio
import secrets
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from ramsight.errors import RamsightError, one_line
from ramsight.machine import load_machine
from ramsight.machine.description import Machine
from ramsight.optional import needing
from ramsight.studio.guard import BODY_WITHIN, LOOPBACK, Guard
from ramsight.studio.visitors import MOST, Place, Visitors

ASSETS = Path(__file__).parent / "assets"
LARGEST = 256 * 2**20  # bytes of an upload: ten hours at 100 Hz are some 150 MB of CSV
_INK = "#1f4e79"  # of buttons and sliders; white on it has a contrast of 8.6 : 1
_FREE = 16  # bytes of a token
_SHOWN = 60.0  # s, within which a browser that shows a page asks for its socket
_FORGOTTEN = 3600.0  # s, after which NiceGUI forgets a tab that nobody has come back to
_KEPT = 16  # machines of the catalogue that were asked for by a link
_GONE = 10.0  # s, until a page that has gone away is abandoned, and its machine ended
_SILENT = 40.0  # s, within which NiceGUI asks whether a page is there (0.8 of it) and waits for the answer (0.4 of it).
# A page that draws on a slow computer is silent for seconds. Abandoned too early, it is loaded again and forgets
# what its visitor has typed.


_SCRIPTS = (
    "uPlot.iife.min.js", "studio.js", "kept.js", "timeline.js", "strips.js", "flows.js", "status.js", "space.js",
    "description.js", "energy.js", "known.js", "lifts.js", "race.js", "link.js",
)  # fmt: skip
_FIRST = (
    f'<div id="first" style="position:absolute;inset:0;padding:8px 16px;font:600 18px sans-serif;color:{_INK};'
    'background:#f3f5f7">ramsight studio is being laid out …</div>'
    "<script>new MutationObserver((_, all) => { if (document.querySelector('.q-header')) {"
    " document.getElementById('first').remove(); all.disconnect(); } })"
    ".observe(document.documentElement, { childList: true, subtree: true });</script>"
)
"""What a page shows before its own scripts are there, and until they have laid it out."""


def address(host: str, port: int, token: str | None) -> str:
    """What a browser opens.

    Example:
        >>> address("127.0.0.1", 8080, None)
        'http://127.0.0.1:8080/'
    """
    name = f"[{host}]" if ":" in host else host
    return f"http://{name}:{port}/" + (f"?token={token}" if token else "")


def title_of(machine: Machine) -> str:
    """What a browser shows of a page.

    Example:
        >>> title_of(load_machine("press"))
        'ramsight studio: Stationary press, 400 kN'
    """
    return f"ramsight studio: {machine.title or machine.name}"


def serve(machine: str, *, host: str, port: int, show: bool, visitors: int = MOST, history: str | None = None) -> None:
    """Serve the studio until it is interrupted.

    Args:
        machine: a description file, or a catalogue name; it is checked before anything is served.
        host: address to listen at; any that is not this machine's own asks for a token.
        history: store of histories that a tab shows; None for none.

    Raises:
        MissingPackageError: the extra `studio` is not installed.
        DescriptionError: the machine cannot be used.
        UnknownNameError: there is no such machine.
    """
    described = load_machine(machine)
    with needing("studio"):
        from nicegui import app, background_tasks, run, ui
    from starlette.middleware.gzip import GZipMiddleware
    from starlette.responses import PlainTextResponse, Response

    from ramsight.studio.prepared import Prepared, prepare
    from ramsight.studio.session import Session
    from ramsight.studio.setting import read_setting, with_unit
    from ramsight.studio.tabs import tabs

    token = None if host in LOOPBACK else secrets.token_urlsafe(_FREE)
    app.add_middleware(Guard, token=token, largest=LARGEST)
    app.add_static_files("/studio-assets", ASSETS)
    app.storage.max_tab_storage_age = _FORGOTTEN
    prepared, room = prepare(described), Visitors(visitors)

    @lru_cache(_KEPT)
    def of_catalogue(name: str) -> Prepared:
        return prepare(load_machine(name))

    title = title_of(described)

    @ui.page("/", title=title, reconnect_timeout=_GONE)
    async def page() -> Response | None:
        client = ui.context.client
        request = client.request
        try:
            asked = read_setting(request.query_params)
            chosen = prepared if asked.machine is None else await run.io_bound(of_catalogue, asked.machine)
            if chosen is None:  # the server goes
                return None
            asked = replace(asked, unit=with_unit(asked, list(chosen.circuits)))
        except RamsightError as error:
            return PlainTextResponse(str(error), status_code=400)
        named = _head(request, title_of(chosen.described))
        body = ui.column().classes("w-full gap-0")
        with suppress(TimeoutError):
            await client.connected(_SHOWN)
        if client.is_deleted or not client.has_socket_connection:  # nobody looks: a page that runs no script
            return None
        if not room.come():
            with body:
                ui.label(room.full).classes("p-4").props("id=full role=alert")
            return None
        place = Place(room)
        client.on_delete(lambda: background_tasks.create(place.leave()))
        async with place.changing:
            session = await run.io_bound(Session, chosen.described)  # a process takes a while to start
            place.session = session
        if session is None or client.is_deleted:  # the server goes, or he has gone meanwhile
            return None
        with body:
            tabs(chosen, session, place, named.set_text, asked, history)
        return None

    print(one_line(f"ramsight studio: {address(host, port, token)}"), flush=True)
    ui.run(
        http=ClosingProtocol,
        host=host,
        port=port,
        title=title,
        show=show,
        reload=False,
        dark=None,
        language="en-US",
        reconnect_timeout=_SILENT,
        tailwind=False,  # 260 kB that look at every change of the page; its few words are in studio.css
        gzip_middleware_factory=None if host in LOOPBACK else GZipMiddleware,  # nothing is far away on this machine
        show_welcome_message=False,
    )


def _head(request: Any, title: str) -> Any:
    """The head of a page, with the styles and scripts that it needs; returns the label of the machine's name."""
    from nicegui import ui

    from ramsight.studio.markup import served_under

    prefix = f"{request.headers.get('X-Forwarded-Prefix', '')}{request.scope.get('root_path', '')}"
    assets = served_under(prefix, "/studio-assets")
    ui.page_title(title)
    ui.colors(primary=_INK)
    for name in ("uPlot.min.css", "studio.css"):
        ui.add_head_html(f'<link rel="stylesheet" href="{assets}/{name}">')
    for name in _SCRIPTS:
        ui.add_head_html(f'<script src="{assets}/{name}"></script>')
    ui.add_body_html(_FIRST)
    with ui.header().classes("items-center py-1"):
        ui.html('<h1 class="text-lg font-bold">ramsight studio</h1>', sanitize=False)
        named = ui.label().props("id=machine-name")
        ui.element("span").props("id=gone role=alert")
    return named


with needing("studio"):
    from uvicorn.protocols.http.auto import AutoHTTPProtocol

PATIENCE = BODY_WITHIN
"""For which the head of a request may be half there [s], as its body; a browser sends it at once."""

_Protocol: Any = AutoHTTPProtocol


class ClosingProtocol(_Protocol):  # type: ignore[misc]
    """HTTP as uvicorn speaks it, for connections whose next request is there in time."""

    _waits: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        """Begin to wait for the first request."""
        super().connection_made(transport)
        self._look()

    def data_received(self, data: bytes) -> None:
        """Take what has come, and wait on if it is no whole head of a request."""
        super().data_received(data)
        self._look()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait for nothing more."""
        self._end()
        super().connection_lost(exc)

    def _look(self) -> None:
        if self.cycle is not None and not self.cycle.response_complete:
            self._end()
        elif self._waits is None:
            self._waits = self.loop.call_later(PATIENCE, self._close)

    def _end(self) -> None:
        if self._waits is not None:
            self._waits.cancel()
            self._waits = None

    def _close(self) -> None:
        self._waits = None
        is_asked = self.cycle is not None and not self.cycle.response_complete
        # A connection that has become a socket of a page has another protocol by now.
        if not is_asked and self.transport.get_protocol() is self and not self.transport.is_closing():
            self.transport.close()
