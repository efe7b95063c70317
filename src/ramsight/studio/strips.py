"""The strips over time: signals that they can show, those that are ready made or a visitor's own, and their panel."""

from __future__ import annotations

import asyncio
from dataclasses import asdict, dataclass
from difflib import get_close_matches
from functools import partial
from typing import Any

from nicegui import ui

from ramsight.errors import DescriptionError
from ramsight.sensor.kind import Kind
from ramsight.studio.knobs import KINDS, SECOND
from ramsight.studio.said import LETTERS
from ramsight.studio.session import Session

STATUS = "status"
"""Measure of what has no axis: a lane says what it is now."""
SPANS = {"30s": "30 s", "2min": "2 min", "10min": "10 min", "all": "all"}
"""How much of the time the strips show, as a link has it and in words."""
SPAN = "2min"
MOST_STRIPS = 12
"""Strips of a page."""
MOST_LETTERS = 1200
"""Letters of all strips of a page in its link."""
_MOST_MEASURES = 2  # of a strip: an axis on the left, one on the right


@dataclass(frozen=True)
class Signal:
    """One of a unit's signals."""

    words: str
    measure: str  # its unit of measure, as its axis has it, or `STATUS`
    colour: str  # of studio.css
    sensor: str = ""  # that has to be switched on, if any
    column: str = ""  # of what the page keeps; empty if it is called as the signal
    band: bool = False  # whether the page keeps a 95 % band of it


def _of_sensors() -> dict[str, Signal]:
    found = {}
    for suffix, measure, words in (("", "mm", ""), ("_error", "mm", "'s error"), ("_level", STATUS, "")):
        for kind in (*KINDS, SECOND):
            if kind != SECOND or suffix != "_level":
                name = "transducer" if kind == SECOND else kind
                band = kind == "kalman" and suffix != "_level"
                found[f"{kind}{suffix}"] = Signal(f"{name}{words}", measure, kind, sensor=kind, band=band)
    return found


_SURE = {
    Kind.DESCRIBED: ("ends as described", "kalman"), Kind.LEAKS: ("pumps leak otherwise", "table"),
    Kind.LOW: ("retracted end elsewhere", "balance"), Kind.TOP: ("extended end elsewhere", "second"),
    Kind.UNKNOWN_POSITION: ("position unknown", "unreferenced"),
}  # fmt: skip
_SHEET = "× data sheet"
SIGNALS = {
    "true": Signal("true", "mm", "true", column="position"),
    **_of_sensors(),
    "speed": Signal("motor speed", "rpm", "true"),
    "torque": Signal("motor torque", "N m", "balance"),
    "pressure_a": Signal("pressure A", "bar", "kalman"),
    "pressure_b": Signal("pressure B", "bar", "balance"),
    "leakage": Signal("leakage", _SHEET, "kalman", sensor="kalman", band=True),
    "displacement": Signal("displacement", _SHEET, "balance", sensor="kalman", band=True),
    "compliance": Signal("compliance", _SHEET, "second", sensor="kalman", band=True),
    **{kind.text: Signal(words, "%", colour, sensor="kalman") for kind, (words, colour) in _SURE.items()},
    "oil_pumps": Signal("oil in the pumps", "°C", "kalman"),
    "oil_tank": Signal("oil in the tank", "°C", "balance"),
}
"""Signals by name, in the order in which a menu lists them."""

PRESETS = {
    "position": ("position", ("true", *KINDS, SECOND)),
    "error": ("error", tuple(f"{kind}_error" for kind in (*KINDS, SECOND))),
    "status": ("status, a lane for each sensor", tuple(f"{kind}_level" for kind in KINDS)),
    "drive": ("motor speed and torque", ("speed", "torque")),
    "pressure": ("chambers", ("pressure_a", "pressure_b")),
    "learned": ("learned, with 95 % bands", ("leakage", "displacement", "compliance")),
    "hypotheses": ("how likely each hypothesis is", tuple(kind.text for kind in Kind)),
    "oil": ("oil", ("oil_pumps", "oil_tank")),
}
"""Strips that are ready made, by name: words and signals of the unit that is shown."""
STRIPS = ("position", "error", "status", "drive", "pressure")
"""Strips of a new page, from above."""


def read_strips(text: str) -> tuple[str, ...]:
    """Strips of a link, from above, each once: of `PRESETS`, or signals with spaces between them.

    A signal of the unit that is shown has its name alone, one of a certain unit that unit's before it.

    Raises:
        DescriptionError: a name that the page does not have, more than it can show, or signals that no strip can show
            together.

    Example:
        >>> read_strips("error,true boom.kalman,error")
        ('error', 'true boom.kalman')
    """
    found = tuple(dict.fromkeys(text.split(",")))
    if len(found) > MOST_STRIPS or len(text) > MOST_LETTERS:
        allowed = f"up to {MOST_STRIPS} strips, {MOST_LETTERS} letters"
        raise DescriptionError("are too many", key="link: strips", value=str(len(found)), allowed=allowed)
    for strip in found:
        if strip not in PRESETS:
            _check(strip)
    return found


def _check(strip: str) -> None:
    names = [word.rpartition(".")[2] for word in strip.split(" ")]
    for name in names:
        if name not in SIGNALS:
            near = ", ".join(get_close_matches(name, SIGNALS, cutoff=0.0))
            allowed = f"{', '.join(PRESETS)}, or signals such as {near}"
            raise DescriptionError("is no strip and no signal", key="link: strips", value=name, allowed=allowed)
    measures = dict.fromkeys(SIGNALS[name].measure for name in names)
    if len(measures) > (1 if STATUS in measures else _MOST_MEASURES):
        raise DescriptionError(
            "cannot be shown together", key="link: strips", value=", ".join(measures),
            allowed=f"up to {_MOST_MEASURES} units of measure, or {STATUS} alone",
        )  # fmt: skip


def units_of(strips: tuple[str, ...]) -> list[str]:
    """Units that strips name.

    Example:
        >>> units_of(("error", "true boom.kalman"))
        ['boom']
    """
    words = (word.rpartition(".") for strip in strips for word in strip.split(" "))
    return list(dict.fromkeys(unit for unit, dot, _ in words if dot))


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
