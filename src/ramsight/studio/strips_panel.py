"""The strips over time, what can be done with them, and the run that they show as files."""

from __future__ import annotations

import asyncio
from dataclasses import asdict
from functools import partial
from typing import Any

from nicegui import ui

from ramsight.studio.said import LETTERS
from ramsight.studio.session import Session
from ramsight.studio.setting import SPAN, SPANS
from ramsight.studio.strips import MOST_LETTERS, MOST_STRIPS, PRESETS, SIGNALS, STATUS, STRIPS

_LOOKS = 0.1  # s between two looks at whether the run has come
_PATIENCE = 60.0  # s, after which it is given up
_BUTTONS = (
    ("strips-pause", "pause", "the strips stand, the machine goes on; dragging over a strip does so, too", "latch"),
    ("strips-whole", "go on", "show the newest again; a double click does so, too", ""),
    ("strips-picture", "picture", "save the strips as PNG", ""),
)
_OWN = '<button type="button" id="strip-add" class="small" title="of signals that you choose">add a strip</button>'


def strips_panel(session: Session, units: list[str]) -> None:
    """Build the panel; `strips.js` fills it in, `timeline.js` knows its buttons."""
    with ui.element("section").classes("panel strips min-w-0").props("id=strips"):
        with ui.row().classes("w-full justify-between items-center gap-1"):
            ui.html("<h2>Over time</h2>", sanitize=False)
            with ui.row().classes("gap-1 items-center"):
                ui.html("".join(_button(*one) for one in _BUTTONS), sanitize=False)
                for unit in units:
                    _saving(session, unit, of_several=len(units) > 1)
        ui.html("".join(_shown(name) for name in PRESETS) + _OWN, sanitize=False).props(
            'role=group aria-label="strips that are shown"'
        )
        ui.html(_times(), sanitize=False).classes("times").props('role=group aria-label="the time that is shown"')
        ui.element("div").props("id=strip-list").classes("w-full")
        ui.label("").props("id=strips-said role=status").classes("text-xs")


def strips_known() -> dict[str, Any]:
    """What `strips.js` has to know: signals, ready-made strips, and the letters of a status."""
    return {
        "signals": {name: asdict(one) for name, one in SIGNALS.items()},
        "presets": {name: {"title": title, "names": names} for name, (title, names) in PRESETS.items()},
        "usual": STRIPS,
        "lanes": STATUS,
        "levels": LETTERS,
        "most": MOST_STRIPS,
        "letters": MOST_LETTERS,
    }


def _button(name: str, words: str, hint: str, kind: str) -> str:
    pressed = ' aria-pressed="false"' if kind else ""
    return f'<button type="button" id="{name}" class="small {kind}" title="{hint}"{pressed}>{words}</button>'


def _shown(name: str) -> str:
    """A button that shows a ready-made strip below the others, or removes it."""
    return f'<button type="button" class="small latch" data-strip="{name}" aria-pressed="false">{name}</button>'


def _times() -> str:
    """How much of the time is shown, and how far back."""
    spans = "".join(
        f'<button type="button" class="small latch" data-span="{name}" aria-pressed="{str(name == SPAN).lower()}">'
        f"{words}</button>"
        for name, words in SPANS.items()
    )
    hint = "drag to what was before; at its right end the newest is shown"
    words = f'aria-label="back in time [s]" title="{hint}"'
    return f'{spans}<input type="range" id="strips-back" step="any" disabled {words}>'


def _saving(session: Session, unit: str, *, of_several: bool) -> None:
    """A button that saves the newest hour of a unit's run."""
    words = f"save the run of {unit}" if of_several else "save the run"
    button = ui.button(words, color=None)
    button.on_click(partial(_save, session, unit, button))
    hint = "log of the drive, truth and description: what ramsight track takes"
    button.props(f'dense no-caps unelevated title="{hint}"').classes("latch")


async def _save(session: Session, unit: str, button: ui.button) -> None:
    """Ask for the run, wait until it has come, and hand it to the browser."""
    button.disable()
    try:
        found = await saved_run(session, unit)
    finally:
        button.enable()
    if isinstance(found, bytes):
        ui.download.content(found, f"{unit}-run.zip", "application/zip")
    else:
        ui.notify(found or "the machine gives no answer", type="negative")


async def saved_run(session: Session, unit: str) -> bytes | str | None:
    """The run of a unit as a ZIP file, or why there is none; None if nothing has come in time."""
    session.saved.pop(unit, None)
    session.say("save", unit)
    waited = 0.0
    while unit not in session.saved and waited < _PATIENCE and not session.over:
        await asyncio.sleep(_LOOKS)
        waited += _LOOKS
    return session.saved.pop(unit, None)
