"""Who may ask the server anything: this machine's own pages, and whoever knows the token."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Awaitable, Callable, Mapping, MutableMapping
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, parse_qsl, urlencode, urlsplit

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
