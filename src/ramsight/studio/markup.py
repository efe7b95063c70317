"""Pieces of pages that several of them have: lines that scroll, links to a visitor's own files."""

from __future__ import annotations

import secrets
from html import escape
from pathlib import Path
from urllib.parse import quote

from fastapi import Response
from fastapi.responses import FileResponse
from nicegui import app, ui


def served_under(prefix: str, path: str) -> str:
    """A path of the studio's own files as the page asks for it, behind a proxy that serves the studio under a prefix.

    Args:
        prefix: of the proxy, as the header ``X-Forwarded-Prefix`` states it; anybody can send it.

    Example:
        >>> served_under("/rig", "/studio-assets/studio.js"), served_under('"><script>', "/studio-assets/studio.js")
        ('/rig/studio-assets/studio.js', '/%22%3E%3Cscript%3E/studio-assets/studio.js')
    """
    inner = quote(prefix.strip("/"), safe="/")
    return f"/{inner}{path}" if inner else path


def scrolled(text: str, name: str) -> str:
    """Lines as they are, which may be wider than the page: whoever has no mouse gets there with keys and scrolls.

    Example:
        >>> scrolled("a < b", "a comparison")
        '<pre tabindex="0" role="region" aria-label="a comparison">a &lt; b</pre>'
    """
    return f'<pre tabindex="0" role="region" aria-label="{escape(name)}">{escape(text)}</pre>'


_FREE = 16  # bytes of an address
_shared: dict[str, dict[str, Path]] = {}


@app.get("/files/{token}/{name}")
def shared(token: str, name: str, save: bool = False) -> Response:
    """A file, for whom its address was made."""
    file = _shared.get(token, {}).get(name)
    if file is None or not file.is_file():
        return Response("no such file", status_code=404)
    return FileResponse(file, filename=name if save else None)


class Shared:
    """The files of one visitor, as long as his page is open."""

    def __init__(self) -> None:
        self._token = secrets.token_urlsafe(_FREE)
        self._files = _shared.setdefault(self._token, {})

    def link(self, file: Path) -> None:
        """Lay out a link that saves a file."""
        ui.link(f"download {file.name}", f"{self._address(file)}?save=true").props("download")

    def opening_link(self, words: str, file: Path) -> None:
        """Lay out a link that opens a file in a tab of its own."""
        ui.link(words, self._address(file), new_tab=True)

    def end(self) -> None:
        """Stop sharing files."""
        _shared.pop(self._token, None)

    def _address(self, file: Path) -> str:
        self._files[file.name] = file
        return f"/files/{self._token}/{file.name}"
