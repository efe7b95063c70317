"""The race: how far off each sensor is, and what goes wrong at the press of a button."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from nicegui import ui

from ramsight.studio.controls import Controls
from ramsight.studio.knobs import KNOBS, WRONG_START
from ramsight.studio.playing import ENDS

_RACERS = {"kalman": "kalman", "balance": "dead reckoning", "table": "the paper's table"}
_TROUBLES: dict[str, tuple[str, float | None]] = {
    "hot oil": ("oil_temperature", 60.0),
    "worn pump": ("leak", 1.6),
    "torque that lies": ("torque_gain", 1.06),
    "an obstacle": ("obstacle", None),
    "power cut": ("power", None),
}
"""What goes wrong: a knob and where its slider then is, or a fault."""
_KNOBS = {one.name: one for one in KNOBS}


class RacePanel:
    """Sensors beside each other on one machine; `race.js` fills the numbers in."""

    def __init__(self, say: Callable[..., None], begin: Callable[[], None], controls: Controls) -> None:
        self._say, self._begin, self._controls = say, begin, controls
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

    def _press(self, name: str) -> None:
        is_on = self._is_pressed(name)
        what, value = _TROUBLES[name]
        if value is None:
            self._controls.fault(what, on=not is_on)
        else:
            self._controls.turn(what, _KNOBS[what].first if is_on else value)

    def _is_pressed(self, name: str) -> bool:
        return self._buttons[name].props.get("aria-pressed") == "true"

    def show(self, settings: Mapping[str, Any]) -> None:
        """Mark what is wrong now."""
        knobs, faults = settings["knobs"], settings["faults"]
        for name, button in self._buttons.items():
            what, value = _TROUBLES[name]
            is_on = what in faults if value is None else _KNOBS[what].shown(knobs[what]) == value
            if self._is_pressed(name) is not is_on:
                button.props(f"aria-pressed={'true' if is_on else 'false'}")


def _number(kind: str, words: str) -> str:
    """The place of a sensor's error."""
    return (
        f'<div class="racer" id="race-{kind}"><b>–</b><span>mm off: {words}</span>'
        "<small>largest so far <i>–</i> mm</small></div>"
    )
