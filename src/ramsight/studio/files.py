"""Files that a visitor can open or save, under an address that nobody else knows."""

from __future__ import annotations

import secrets
from pathlib import Path

from fastapi import Response
from fastapi.responses import FileResponse
from nicegui import app, ui

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
