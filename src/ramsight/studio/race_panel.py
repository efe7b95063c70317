"""The race: how far off each sensor is, and what goes wrong at the press of a button."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

from nicegui import ui

from ramsight.studio.knobs import WRONG_START, Knobs
from ramsight.studio.playing import ENDS

_RACERS = {"kalman": "kalman", "balance": "dead reckoning", "table": "the paper's table"}
_TROUBLES: dict[str, tuple[Any, ...]] = {
    "hot oil": ("oil_temperature", 333.15),
    "worn pump": ("leak", 1.6),
    "torque that lies": ("torque_gain", 1.06),
    "an obstacle": ("obstacle",),
    "power cut": ("power",),
}
"""What goes wrong: a knob with its value, or a fault."""
_FOLLOWS = 3.0  # s after a press, within which the machine's setting shows it


class RacePanel:
    """Sensors beside each other on one machine; `race.js` fills the numbers in.

    Args:
        say: passes a command to the machine.
        begin: has the machine begin again, with nothing that plays.
    """

    def __init__(self, say: Callable[..., None], begin: Callable[[], None]) -> None:
        self._say, self._begin = say, begin
        self._pressed = 0.0
        self._buttons: dict[str, ui.button] = {}
        with ui.element("section").classes("panel race").props('aria-label="race of the sensors"'):
            ui.html("<h2>The race</h2>", sanitize=False)
            ui.label("All begin at the true position. Who still knows it, when something goes wrong?").classes(
                "text-sm"
            )
            ui.button("start", on_click=self._start).props("dense size=sm no-caps id=race-start")
            ui.html("".join(_number(kind, words) for kind, words in _RACERS.items()), sanitize=False)
            ui.html('<p id="race-says" role="status">–</p>', sanitize=False)
            with ui.row().classes("gap-1").props('role=group aria-label="what goes wrong"'):
                for name in _TROUBLES:
                    button = ui.button(name, on_click=lambda _, name=name: self._press(name), color=None)
                    self._buttons[name] = button.props("dense no-caps unelevated aria-pressed=false").classes("latch")
                words = f"wrong start, {1e3 * WRONG_START:g} mm off"
                wrong = ui.button(words, on_click=lambda: self._say("start", WRONG_START), color=None)
                wrong.props("dense no-caps unelevated").classes("latch")
            ui.label("press again to put it right").classes("text-xs")

    def _start(self) -> None:
        self._begin()
        self._say("sense", "table", True)
        self._say("play", ENDS)
        ui.run_javascript("studio.raceBegins()")

    def _press(self, name: str) -> None:
        is_on = self._buttons[name].props.get("aria-pressed") == "true"
        what, *value = _TROUBLES[name]
        if value:
            self._say("knobs", {what: getattr(Knobs(), what) if is_on else value[0]})
        else:
            self._say("fault", what, not is_on)
        self._pressed = time.monotonic()

    def show(self, settings: Mapping[str, Any]) -> bool:
        """Mark what is wrong now.

        Args:
            settings: of a `worker.Frame`.

        Returns:
            Whether a button has just set something.
        """
        for name, button in self._buttons.items():
            what, *value = _TROUBLES[name]
            is_on = settings["knobs"][what] == value[0] if value else what in settings["faults"]
            if (button.props.get("aria-pressed") == "true") is not is_on:
                button.props(f"aria-pressed={'true' if is_on else 'false'}")
        return time.monotonic() - self._pressed < _FOLLOWS


def _number(kind: str, words: str) -> str:
    """The place of a sensor's error."""
    return (
        f'<div class="racer" id="race-{kind}"><b>–</b><span>mm off: {words}</span>'
        "<small>largest so far <i>–</i> mm</small></div>"
    )
