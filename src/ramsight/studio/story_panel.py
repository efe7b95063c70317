"""Scenarios as cards, and the words of the one that plays."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from html import escape
from typing import Any

from nicegui import ui

from ramsight.studio.scenarios import SCENARIOS

_NOTHING = "<p>No scenario plays. Choose one below, or move the machine with the controls.</p>"


class StoryPanel:
    """The panel that a page opens on."""

    def __init__(self, play: Callable[[str], None]) -> None:
        self._shown: tuple[str, int] | None = None
        self._awaited: str | None = None
        self._cards: dict[str, ui.element] = {}
        with ui.element("section").classes("panel story").props('id=story aria-label="the scenario that plays"'):
            self._title = ui.html("<h2>The levers are yours</h2>", sanitize=False)
            self._words = ui.html(_NOTHING, sanitize=False).props(
                'id=story-words role=log tabindex=0 aria-label="what has happened"'
            )
        with ui.element("section").classes("panel"):
            ui.html("<h2>Scenarios</h2>", sanitize=False)
            with ui.element("div").classes("cards"):
                for name, scenario in SCENARIOS.items():
                    card = ui.element("button").classes("card").props(f"type=button data-scenario={name}")
                    self._cards[name] = card
                    card.on("click", lambda _, name=name: play(name))
                    with card:
                        text = f"<b>{escape(scenario.title)}</b><span>{escape(scenario.sentence)}</span>"
                        ui.html(text, sanitize=False)

    def begins(self, name: str) -> None:
        """Say that a scenario is set up."""
        self._shown, self._awaited = None, name
        self._title.set_content(f"<h2>{escape(SCENARIOS[name].title)}</h2>")
        self._words.set_content("<p>The machine is set up …</p>")
        self._mark(name)

    def _mark(self, name: str | None) -> None:
        """Mark the card of the scenario that plays."""
        for one, card in self._cards.items():
            card.props(f"aria-pressed={'true' if one == name else 'false'}")

    def show(self, telling: Mapping[str, Any] | None) -> bool:
        """Show how far a scenario is.

        Returns:
            Whether it has gone on since the last call.
        """
        if self._awaited is not None and (telling is None or telling["name"] != self._awaited):
            return False  # of the machine as it was before
        self._awaited = None
        now = None if telling is None else (telling["name"], len(telling["words"]))
        if now == self._shown:
            return False
        self._shown = now
        if telling is None:
            self._title.set_content("<h2>The levers are yours</h2>")
            self._words.set_content(_NOTHING)
            self._mark(None)
            return True
        scenario = SCENARIOS[telling["name"]]
        lines = "".join(f"<li>{marked(words)}</li>" for words in telling["words"])
        after = f"<p class='try'><b>Try this.</b> {marked(scenario.try_this)}</p>" if telling["over"] else ""
        self._title.set_content(f"<h2>{escape(scenario.title)}</h2>")
        self._words.set_content(f"<ol>{lines}</ol>{after}")
        ui.run_javascript("studio.newest('story-words')")
        return True


def marked(words: str) -> str:
    """Words with ``*emphasis*`` and ```names``` as HTML.

    Example:
        >>> marked("a < b: *ok*, by `kalman`")
        'a &lt; b: <em>ok</em>, by <code>kalman</code>'
    """
    text = re.sub(r"\*(.+?)\*", r"<em>\1</em>", escape(words, quote=False))
    return re.sub(r"`(.+?)`", r"<code>\1</code>", text)
