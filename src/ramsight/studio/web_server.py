"""The studio's server: pages, the files that they need, and who may ask for anything: who knows the token."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Awaitable, Callable, Mapping, MutableMapping
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from http.cookies import CookieError, SimpleCookie
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, parse_qsl, urlencode, urlsplit

from ramsight.errors import RamsightError, one_line
from ramsight.machine import load_machine
from ramsight.machine.description import Machine
from ramsight.optional import check_extra, needing
from ramsight.studio.session import MOST, Place, Session, Visitors

with needing("studio"):
    from uvicorn.protocols.http.auto import AutoHTTPProtocol


BODY_WITHIN = 10.0
"""Between two parts of a request's body [s]."""
LOOPBACK = ("127.0.0.1", "localhost", "::1")
_COOKIE = "ramsight-token"
_OWN = (
    "none",
    "same-origin",
)  # where a request comes from, by Sec-Fetch-Site; another port of this machine is another site
_HEADERS = [
    (b"x-frame-options", b"DENY"),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (
        b"content-security-policy",
        b"default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
        b"img-src 'self' data: blob:; font-src 'self' data:; worker-src 'self' blob:; object-src 'none'; "
        b"base-uri 'self'; form-action 'self'; frame-ancestors 'none'",
    ),
]
"""Of every answer. The page is made by templates that the browser compiles: scripts of its own may be inline."""

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[MutableMapping[str, Any], Receive, Send], Awaitable[None]]


class TooLargeError(Exception):
    """A request's body is larger than allowed."""


class Guard:
    """Middleware: refuses strange hosts, other sites' requests, those without the token, and bodies that are too large.

    Args:
        token: that a browser has to bring once, in the address; None where none is needed: then only names of this
            machine are answered, so that no other site's name can be made to lead here.
        largest: of a request's body [bytes].
    """

    def __init__(self, app: App, token: str | None, largest: int) -> None:
        self.app, self.token, self.largest = app, token, largest

    async def __call__(self, scope: MutableMapping[str, Any], receive: Receive, send: Send) -> None:
        """Let a request through, or answer it."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        sent = {name.decode("latin-1").lower(): value.decode("latin-1") for name, value in scope["headers"]}
        refused = self.refused(sent, scope.get("query_string", b"").decode("latin-1"))
        if refused is None and self.token is not None and scope["type"] == "http" and self._brings(scope):
            await _answer(send, 303, "", [(b"location", _without_token(scope)), (b"set-cookie", self._cookie())])
        elif refused is None:
            await self._guarded(scope, receive, send)
        elif scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.close", "code": 1008, "reason": refused[1]})
        else:
            await _answer(send, *refused)

    def refused(self, headers: MutableMapping[str, str], query: str) -> tuple[int, str] | None:
        """Why a request is not answered, as status and words; None if it is."""
        host = headers.get("host", "")
        if self.token is None and _name(host) not in LOOPBACK:
            return 421, "this studio answers to names of its own machine only"
        origin = headers.get("origin")
        if origin is not None and _place(origin) != host:
            return 403, "requests of other sites are refused"
        if headers.get("sec-fetch-site", "none") not in _OWN and not _opens(headers):
            return 403, "requests of other sites are refused"
        if self.token is not None and not self._knows(headers.get("cookie", ""), query):
            return 401, "this studio needs the token that it printed when it began: open the address with ?token=..."
        length = headers.get("content-length", "0")
        if not (length.isascii() and length.isdigit() and len(length) < 20) or int(length) > self.largest:
            return 413, f"larger than {self.largest // 2**20} MiB"
        return None

    def _knows(self, cookie: str, query: str) -> bool:
        try:
            kept = SimpleCookie(cookie).get(_COOKIE)
        except CookieError:
            kept = None
        sent = [kept.value] if kept is not None else []
        sent += parse_qs(query).get("token", [])
        return any(secrets.compare_digest(one.encode(), str(self.token).encode()) for one in sent)

    def _brings(self, scope: MutableMapping[str, Any]) -> bool:
        return "token" in parse_qs(scope.get("query_string", b"").decode("latin-1")) and scope["path"] == "/"

    def _cookie(self) -> bytes:
        return f"{_COOKIE}={self.token}; Path=/; HttpOnly; SameSite=Strict".encode()

    async def _guarded(self, scope: MutableMapping[str, Any], receive: Receive, send: Send) -> None:
        taken, is_whole = 0, scope["type"] != "http"

        async def counted() -> Message:
            nonlocal taken, is_whole
            message = await asyncio.wait_for(receive(), None if is_whole else BODY_WITHIN)
            is_whole = is_whole or not message.get("more_body", False)
            taken += len(message.get("body", b"")) if message["type"] == "http.request" else 0
            if taken > self.largest:
                raise TooLargeError
            return message

        async def marked(message: Message) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message.get("headers", []), *_HEADERS]
            await send(message)

        try:
            await self.app(scope, counted, marked)
        except TooLargeError:
            await _answer(send, 413, f"larger than {self.largest // 2**20} MiB")
        except TimeoutError:
            if is_whole:
                raise
            await _answer(send, 408, "the request did not come to its end")


def _without_token(scope: Mapping[str, Any]) -> bytes:
    """Where a browser that has brought the token goes on: what its link says beside it stays."""
    query = parse_qsl(scope.get("query_string", b"").decode("latin-1"), keep_blank_values=True)
    rest = urlencode([(name, value) for name, value in query if name != "token"])
    return f"/?{rest}".encode() if rest else b"/"


def _name(host: str) -> str:
    """The name of a Host header, without its port; "" of one that is none."""
    try:
        return "" if "@" in host else urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


def _place(origin: str) -> str | None:
    """Host and port of an Origin header; None of one that is none."""
    try:
        return urlsplit(origin).netloc
    except ValueError:
        return None


def _opens(headers: Mapping[str, str]) -> bool:
    """Whether a request of another site opens a page, as a link does: no frame, script or picture in its own."""
    return headers.get("sec-fetch-mode") == "navigate" and headers.get("sec-fetch-dest") == "document"


async def _answer(send: Send, status: int, text: str, headers: list[tuple[bytes, bytes]] | None = None) -> None:
    kind = (b"content-type", b"text/plain; charset=utf-8")
    await send({"type": "http.response.start", "status": status, "headers": [kind, *_HEADERS, *(headers or [])]})
    await send({"type": "http.response.body", "body": text.encode()})


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
    check_extra("studio")
    first = [Session(described, waits=True)]  # is made ready while the server begins and the browser loads the page
    try:
        _serve(described, first, host, port, show, visitors, history)
    finally:
        for session in first:
            session.close()


def _serve(
    described: Machine, first: list[Session], host: str, port: int, show: bool, visitors: int, history: str | None
) -> None:
    """Serve; `first` has the machine of the first visitor who asks for none by name."""
    with needing("studio"):
        from nicegui import app, ui
    from starlette.middleware.gzip import GZipMiddleware

    token = None if host in LOOPBACK else secrets.token_urlsafe(_FREE)
    app.add_middleware(Guard, token=token, largest=LARGEST)
    app.add_static_files("/studio-assets", ASSETS)
    app.storage.max_tab_storage_age = _FORGOTTEN
    title = title_of(described)
    ui.page("/", title=title, reconnect_timeout=_GONE)(_page(described, Visitors(visitors), history, first))
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


def _page(
    described: Machine, room: Visitors, history: str | None, first: list[Session]
) -> Callable[[], Awaitable[Any]]:
    """What answers a browser that asks for the page.

    Args:
        described: the machine, unless a link asks for another.
        history: store of histories that a tab shows; None for none.
        first: its machine, which waits for a visitor; empty once he has come.
    """
    from nicegui import background_tasks, run, ui
    from starlette.responses import PlainTextResponse, Response

    from ramsight.studio.prepared import Prepared, prepare
    from ramsight.studio.setting import read_setting, with_unit
    from ramsight.studio.tabs import tabs

    prepared = prepare(described)

    @lru_cache(_KEPT)
    def of_catalogue(name: str) -> Prepared:
        return prepare(load_machine(name))

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
            session = _waiting(first) if chosen is prepared else None
            if session is None:
                session = await run.io_bound(Session, chosen.described, waits=True)  # a process takes a while to start
            place.session = session
        if session is None or client.is_deleted:  # the server goes, or he has gone meanwhile
            return None
        with body:
            tabs(chosen, session, place, named.set_text, asked, history)
        return None

    return page


def _waiting(first: list[Session]) -> Session | None:
    """A machine that waits for a visitor; None if there is none, or its process has ended."""
    if not first:
        return None
    session = first.pop()
    if session.over or not session.alive:
        session.close()
        return None
    return session


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
