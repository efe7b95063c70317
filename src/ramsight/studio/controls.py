"""What a visitor does to the machine that runs: levers, knobs, faults, references, sensors and their race."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from nicegui import ui

from ramsight.studio.knobs import FAULTS, KINDS, KNOBS, LIE, SENSORS, WRONG_START
from ramsight.studio.playing import DUTIES, ENDS
from ramsight.studio.session import Session
from ramsight.studio.worker import FASTEST

KEYS = (("ArrowUp", "ArrowDown"), ("ArrowRight", "ArrowLeft"))
"""Keys that move the first unit and the second one, lifting and lowering."""
_LATCHED = (("lower", -100.0), ("stop", 0.0), ("lift", 100.0))


class Controls:
    """The panels, and how they follow what a scenario sets."""

    def __init__(self, session: Session, units: list[str], signs: Mapping[str, float]) -> None:
        self._session, self._units, self._signs = session, units, signs
        self._levers: dict[str, Slider] = {}
        self._knobs: dict[str, Slider] = {}
        self._faults: dict[str, ui.switch] = {}
        self._kinds: dict[str, ui.switch] = {}
        self._quiet = False
        self._build_levers()
        self._build_knobs()
        self._build_faults()
        self._build_sensors()

    def follow(self, settings: Mapping[str, Any], *, levers: bool) -> None:
        """Show what the machine is set to, without setting it again."""
        self._quiet = True
        for knob in KNOBS:
            self._knobs[knob.name].set_value(knob.shown(settings["knobs"][knob.name]))
        for name, switch in self._faults.items():
            switch.set_value(name in settings["faults"])
        for kind, switch in self._kinds.items():
            switch.set_value(kind in settings["sensors"])
        for slider in self._levers.values() if levers else ():
            slider.set_value(0)
        self._duty.set_value(settings["duty"] or "")
        self._speed.set_value(settings["speed"])
        self._hold.set_value(settings["holds_oil"])
        self._quiet = False

    def turn(self, name: str, shown: float) -> None:
        """Set a knob, as a visitor does by its slider."""
        self._knobs[name].set_value(shown)

    def fault(self, name: str, *, on: bool) -> None:
        """Switch a fault, as a visitor does."""
        self._faults[name].set_value(on)

    def _say(self, *command: Any) -> None:
        if not self._quiet:
            self._session.say(*command)

    def _build_levers(self) -> None:
        with _panel("Levers"):
            for name, keys in zip(self._units, KEYS * len(self._units), strict=False):
                self._lever(name, [key.removeprefix("Arrow").lower() for key in keys])
            ui.label("duty cycle").classes("text-sm")
            duties = {"": "none", **{name: f"{name}: {words}" for name, words in DUTIES.items()}}
            self._duty = ui.select(duties, value="", on_change=lambda e: self._say("play", e.value or None))
            self._duty.props('dense aria-label="duty cycle"').classes("w-full")
            ui.keyboard(on_key=self._key, ignore=["input", "select", "textarea"])
            self._speed = labelled("speed-up", "× real time", 0.0, FASTEST, 1.0, 1.0)
            self._speed.on_value_change(lambda e: self._say("factor", e.value))

    def _lever(self, name: str, keys: list[str]) -> None:
        slider = labelled(f"lever of {name}", "%", -100.0, 100.0, 0.0, 5.0)
        self._levers[name] = slider
        ui.label(f"key {keys[0]} lifts, key {keys[1]} lowers, while it is pressed").classes("text-xs")
        buttons = {}
        with ui.row().classes("gap-1").props(f'role=group aria-label="{name}: buttons that stay pressed"'):
            for text, value in _LATCHED:
                button = ui.button(text, on_click=lambda _, v=value: slider.set_value(v), color=None)
                button.props("dense no-caps unelevated").classes("latch")
                buttons[value] = button.props(f'aria-label="{text} {name}"')

        def moved(value: float) -> None:
            for held, button in buttons.items():
                button.props(f"aria-pressed={'true' if held == value else 'false'}")
            self._say("lever", name, self._signs[name] * (value or 0.0) / 100.0)

        slider.on_value_change(lambda e: moved(e.value))
        self._quiet = True
        moved(0.0)
        self._quiet = False

    def _key(self, event: Any) -> None:
        """Arrow keys are levers: as long as one is down the machine moves."""
        for slider, (lift, lower) in zip(self._levers.values(), KEYS, strict=False):
            if event.key.name in (lift, lower) and not event.action.repeat:
                slider.set_value(0 if event.action.keyup else 100 if event.key.name == lift else -100)

    def _build_knobs(self) -> None:
        with _panel("What the sensor does not know"):
            for knob in KNOBS:
                slider = labelled(knob.words, knob.unit, knob.least, knob.most, knob.first, knob.step)
                self._knobs[knob.name] = slider
                slider.on_value_change(lambda e, knob=knob: self._say("knobs", {knob.name: knob.si(e.value)}))
                if knob.name == "ambient":
                    self._oil(slider)

    def _oil(self, ambient: Slider) -> None:
        """How warm the oil is, and a switch that keeps it so; while it does, the air has nothing to say."""
        shown = ", ".join(f'in the {place} <b id="now-{place}">–</b> °C' for place in ("pumps", "tank"))
        ui.html(f'<span class="text-sm">oil {shown}</span>', sanitize=False)
        self._hold = ui.switch("hold the oil there, whatever is lost in it").props("dense").classes("w-full")

        def turned(e: Any) -> None:
            self._say("hold oil", bool(e.value))
            ambient.set_enabled(not e.value)

        self._hold.on_value_change(turned)

    def _build_faults(self) -> None:
        with _panel("Faults and references"):
            for name, words in FAULTS.items():
                switch = ui.switch(words, on_change=lambda e, name=name: self._say("fault", name, bool(e.value)))
                self._faults[name] = switch.props("dense").classes("w-full")
            _button("reset the sensors", lambda: self._say("start")).props('title="they start at the true positions"')
            for name in self._units:
                with ui.row().classes("gap-1 mt-1"):
                    _button(f"{name}: reference", partial(self._say, "refer", name, False))
                    words = f"{name}: faulty limit switch, {1e3 * LIE:g} mm off"
                    _button(words, partial(self._say, "refer", name, True))

    def _build_sensors(self) -> None:
        with _panel("Sensors"):
            for kind, words in KINDS.items():
                switch = self._kinds[kind] = ui.switch(words, value=kind in SENSORS).props("dense").classes("w-full")
                switch.on_value_change(lambda e, kind=kind: self._say("sense", kind, bool(e.value)))
            refused = ui.label().props("role=status").classes("text-sm")
            refused.bind_text_from(self._session, "refused")


def _panel(title: str) -> ui.element:
    section = ui.element("section").classes("panel")
    with section:
        ui.html(f"<h2>{title}</h2>", sanitize=False)
    return section


def _button(words: str, done: Callable[[], None]) -> ui.button:
    return ui.button(words, on_click=done).props("dense size=sm no-caps")


class Slider(ui.slider):
    """A slider whose value is set by the page; the server hears of it.

    NiceGUI's own is set by what the server sends back. Where keys are pressed, or the thumb is dragged, faster than
    that comes, an older value takes the slider back, and what was pressed meanwhile is lost.
    """

    LOOPBACK = False


def labelled(words: str, unit: str, least: float, most: float, first: float, step: float) -> Slider:
    """A slider with its words, unit and value above it.

    Args:
        words: beside the slider, and its name for whoever does not see them.
    """
    with ui.row().classes("w-full justify-between text-sm gap-1"):
        ui.label(f"{words} [{unit}]")
        shown = ui.label(f"{first:g}").classes("value")
    slider = Slider(min=least, max=most, step=step, value=first)
    slider.props(f'dense aria-label="{words} [{unit}]"')
    slider.on_value_change(lambda e: shown.set_text(f"{e.value:g}"))
    return slider


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
