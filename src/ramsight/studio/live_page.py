"""The page of a machine that runs: levers and knobs, the machine, its circuit, and what the sensors report of it."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any

from nicegui import background_tasks, run, ui

from ramsight.studio.knobs import FAULTS, KINDS, LIE, SENSORS
from ramsight.studio.playing import DUTIES
from ramsight.studio.prepared import Prepared
from ramsight.studio.scene import MachineScene
from ramsight.studio.session import Session
from ramsight.studio.worker import FASTEST, Frame
from ramsight.units import FREEZING

_PAUSE = 0.03  # s between two looks at what has come
_ANSWERS = 5.0  # s that a page may take for a frame
_SCENE = 3  # every how many frames the machine in space is moved
_MAGNIFIED = 100  # times, at most, that an error is shown as large as it is
_HIGHEST = 250.0  # bar, that the circuit's warmest colour stands for where no relief valve says it

KNOBS = (
    ("load", "load [% of the largest]", 0.0, 120.0, 50.0, 5.0, 0.01, 0.0),
    ("oil_temperature", "oil, brought to [°C]", 0.0, 80.0, 40.0, 1.0, 1.0, FREEZING),
    ("ambient", "air around [°C]", -20.0, 50.0, 20.0, 1.0, 1.0, FREEZING),
    ("leak", "leakage × data sheet", 0.5, 3.0, 1.0, 0.05, 1.0, 0.0),
    ("displacement", "displacement × data sheet", 0.97, 1.03, 1.0, 0.001, 1.0, 0.0),
    ("stiffness", "stiffness × data sheet", 0.5, 1.5, 1.0, 0.05, 1.0, 0.0),
    ("friction", "friction × data sheet", 0.5, 3.0, 1.0, 0.05, 1.0, 0.0),
    ("torque_gain", "reported torque × true", 0.9, 1.1, 1.0, 0.01, 1.0, 0.0),
    ("magnets", "magnets of the motor warmer by [K]", 0.0, 100.0, 0.0, 5.0, 1.0, 0.0),
    ("torque_step", "steps of the torque [N m]", 0.0, 2.0, 0.0, 0.1, 1.0, 0.0),
    ("report_delay", "delay of the report [ms]", 0.0, 100.0, 0.0, 10.0, 1e-3, 0.0),
    ("temperature_offset", "thermometer offset [K]", -10.0, 10.0, 0.0, 0.5, 1.0, 0.0),
)
"""Name, words, least, most, first value, step, and factor and offset to SI of what can be turned."""
KEYS = (("ArrowUp", "ArrowDown"), ("ArrowRight", "ArrowLeft"))
"""Keys that move the first unit and the second one, lifting and lowering."""


def live_page(prepared: Prepared, session: Session) -> None:
    """Build the page for one visitor.

    Args:
        prepared: the machine.
        session: the process in which it runs for him; it is closed when he goes.
    """
    described, units = prepared.described, list(prepared.circuits)
    signs = {name: float(described.unit(name).lift_sign) for name in units}
    client = ui.context.client
    client.on_delete(lambda: background_tasks.create(run.io_bound(session.close)))
    with ui.element("div").classes("studio"):
        with ui.column().classes("gap-3"):
            _levers(session, units, signs)
            _knobs(session)
            _faults(session, units)
            _sensors(session)
        with ui.column().classes("gap-3 min-w-0"):
            with ui.element("section").classes("panel"):
                ui.html("<h2>The machine</h2>", sanitize=False)
                ui.label("red and pale: where the sensor takes it to be; its error as large as you like").classes(
                    "text-xs"
                )
                space = ui.element("div").classes("w-full space")
                ui.label("error × true").classes("text-sm")
                magnified = ui.slider(min=1, max=_MAGNIFIED, value=1)
                magnified.props('label dense aria-label="error in the picture over the true one"')
            _circuits(prepared.circuits)
            _energy(session)
        with ui.column().classes("gap-3 min-w-0"):
            _said(units)
            with ui.element("section").classes("panel").props("id=strips"):
                for name in ("position", "error", "drive", "pressure", "status"):
                    ui.element("div").props(f"id=strip-{name}").classes("w-full")

    def scene() -> MachineScene:
        with space:
            made = MachineScene(described, prepared.linked)
        magnified.on_value_change(lambda e: made.magnify(float(e.value)))
        made.magnify(float(magnified.value))
        return made

    background_tasks.create(_follow(session, client, scene, prepared))


def _levers(session: Session, units: list[str], signs: dict[str, float]) -> None:
    with ui.element("section").classes("panel"):
        ui.html("<h2>Levers</h2>", sanitize=False)
        waits = ui.label("the machine is being made ready …").props("id=ready")
        ui.timer(0.3, lambda: waits.set_text(session.ended or ("runs" if session.about else waits.text)))
        sliders = {}
        for name, keys in zip(units, KEYS * len(units), strict=False):
            up, down = (key.removeprefix("Arrow").lower() for key in keys)
            ui.label(f"{name}: key {up} lifts, key {down} lowers").classes("text-sm")
            slider = ui.slider(min=-100, max=100, step=5, value=0).props(f'label aria-label="lever of {name}" snap')
            slider.on_value_change(
                lambda e, name=name: session.say("lever", name, signs[name] * (e.value or 0) / 100.0)
            )
            sliders[name] = slider
            with ui.row().classes("gap-1"):
                for text, value in (("lower", -100), ("stop", 0), ("lift", 100)):
                    button = ui.button(text, on_click=lambda _, s=slider, v=value: s.set_value(v)).props(
                        "dense size=sm"
                    )
                    button.props(f'aria-label="{text} {name}"')
        ui.label("a duty that plays").classes("text-sm")
        duties = {"": "none", **{name: f"{name}: {words}" for name, words in DUTIES.items()}}
        play = ui.select(duties, value="", on_change=lambda e: session.say("play", e.value or None))
        play.props('dense aria-label="duty that plays"').classes("w-full")
        ui.keyboard(on_key=lambda e: _key(e, list(sliders.values())), ignore=["input", "select", "textarea"])
        ui.label("time × life").classes("text-sm")
        ui.slider(min=0, max=FASTEST, step=1, value=1, on_change=lambda e: session.say("factor", e.value)).props(
            'label aria-label="times faster than life"'
        )


def _key(event: Any, sliders: list[Any]) -> None:
    """Arrow keys are levers: as long as one is down the machine moves."""
    for slider, (lift, lower) in zip(sliders, KEYS, strict=False):
        if event.key.name in (lift, lower) and not event.action.repeat:
            slider.set_value(0 if event.action.keyup else 100 if event.key.name == lift else -100)


def _knobs(session: Session) -> None:
    with ui.element("section").classes("panel"):
        ui.html("<h2>What the sensor does not know</h2>", sanitize=False)
        for name, words, least, most, first, step, factor, offset in KNOBS:
            with ui.row().classes("w-full justify-between text-sm gap-1"):
                ui.label(words)
                shown = ui.label(f"{first:g}")
            slider = ui.slider(min=least, max=most, step=step, value=first).props(f'dense aria-label="{words}"')

            def turn(
                e: Any, name: str = name, factor: float = factor, offset: float = offset, shown: Any = shown
            ) -> None:
                shown.set_text(f"{e.value:g}")
                session.say("knobs", {name: e.value * factor + offset})

            slider.on_value_change(turn)
            if name == "ambient":
                _oil(session, slider)


def _oil(session: Session, ambient: Any) -> None:
    """How warm the oil is, and a switch that keeps it so; while it does, the air has nothing to say."""
    ui.html('<span class="text-sm">oil in the pumps <b id="now-pumps">–</b> °C, in the tank <b id="now-tank">–</b> °C'
            "</span>", sanitize=False)  # fmt: skip
    hold = ui.switch("hold the oil there, whatever is lost in it").props("dense").classes("w-full")

    def turned(e: Any) -> None:
        session.say("hold oil", bool(e.value))
        ambient.set_enabled(not e.value)

    hold.on_value_change(turned)


def _faults(session: Session, units: list[str]) -> None:
    with ui.element("section").classes("panel"):
        ui.html("<h2>Faults and references</h2>", sanitize=False)
        for name, words in FAULTS.items():
            switch = ui.switch(words, on_change=lambda e, name=name: session.say("fault", name, bool(e.value)))
            switch.props("dense").classes("w-full")
        start = ui.button("start the sensors again", on_click=lambda: session.say("start")).props("dense size=sm")
        start.tooltip("they start at the true positions")
        for name in units:
            with ui.row().classes("gap-1 mt-1"):
                ui.button(f"{name}: reference", on_click=lambda name=name: session.say("refer", name, False)).props(
                    "dense size=sm"
                )
                ui.button(
                    f"{name}: switch lies by {1e3 * LIE:g} mm",
                    on_click=lambda name=name: session.say("refer", name, True),
                ).props("dense size=sm")


def _sensors(session: Session) -> None:
    with ui.element("section").classes("panel"):
        ui.html("<h2>Sensors</h2>", sanitize=False)
        for kind, words in KINDS.items():
            switch = ui.switch(words, value=kind in SENSORS).props("dense").classes("w-full")
            switch.on_value_change(lambda e, kind=kind: session.say("sense", kind, bool(e.value)))
        refused = ui.label().props("role=status").classes("text-sm")
        refused.bind_text_from(session, "refused")


def _circuits(circuits: Mapping[str, str]) -> None:
    with ui.element("section").classes("panel circuit"):
        ui.html("<h2>The circuit</h2>", sanitize=False)
        ui.label(
            "lines: blue at the tank's pressure, red at the relief valves'; dashes go as the oil goes, faster where"
            " more flows; yellow: a valve passes oil; red: a relief valve spits"
        ).classes("text-xs")
        units = list(circuits)
        for k, (name, text) in enumerate(circuits.items()):
            place = ui.html(text, sanitize=False).classes("w-full").props(f'data-circuit="{name}"')
            if k:
                place.props("hidden")
        if len(units) > 1:
            ui.toggle(
                units, value=units[0], on_change=lambda e: ui.run_javascript(f"studio.show({json.dumps(e.value)})")
            )


def _energy(session: Session) -> None:
    with ui.element("section").classes("panel"):
        ui.html("<h2>Where the energy goes</h2>", sanitize=False)
        ui.label("–").props("id=energy-said").classes("text-xs")
        ui.element("div").props("id=sankey").classes("w-full")
        ui.button("begin again", on_click=lambda: session.say("account")).props("dense size=sm")


def _said(units: list[str]) -> None:
    numbers = (
        ("true", "now-true", "mm"), ("kalman", "now-kalman", "mm"), ("its error", "now-error", "mm"),
        ("95 % band ±", "now-band", "mm"), ("balance's error", "now-balance-error", "mm"),
        ("time", "now-time", "s"), ("× life", "now-factor", ""),
    )  # fmt: skip
    rows = "".join(f'<span>{words} <b id="{place}">–</b> {unit}</span>' for words, place, unit in numbers)
    status = "".join(
        f'<div data-kind="{kind}">{unit}, {kind}: <span class="status" id="status-{unit}-{kind}">–</span></div>'
        for unit in units
        for kind in KINDS
    )
    with ui.element("section").classes("panel").props("aria-live=off"):
        ui.html(f'<h2>What the sensors say</h2><div class="now">{rows}</div>{status}', sanitize=False)


async def _follow(session: Session, client: Any, scene: Callable[[], MachineScene], prepared: Prepared) -> None:
    """Hand the page what comes of its machine, no faster than the page takes it.

    The machine in space comes once the rest is there: what draws it is as large as all the rest.
    """
    units = list(prepared.circuits)
    await client.connected(timeout=30.0)
    with client:
        words = f"studio.begin({json.dumps(units)}, {_HIGHEST}, {json.dumps(prepared.lines)})"
        await client.run_javascript(words, timeout=30.0)
        space = scene()
        await space.scene.initialized()
        client.run_javascript(f"studio.space({space.scene.id})")
    seen = 0
    while not client.is_deleted and not session.over:
        frames = session.frames()
        if not frames or not client.has_socket_connection:
            await asyncio.sleep(_PAUSE)
            continue
        frame = _joined(frames)
        try:
            await client.run_javascript(f"studio.frame({json.dumps(asdict(frame), default=str)})", timeout=_ANSWERS)
        except TimeoutError:
            continue
        seen += 1
        if seen % _SCENE == 0 and not session.over:
            with client:
                space.show(_positions(frame, "position", units), _positions(frame, "kalman", units), frame.load)
    session.close()


def _joined(frames: list[Frame]) -> Frame:
    """Several frames as one: all their rows, and the newest of the rest."""
    last = frames[-1]
    last.energy = next((frame.energy for frame in reversed(frames) if frame.energy), {})
    for name in last.columns:
        parts = [frame.columns[name] for frame in frames]
        if name == "time":
            last.columns[name] = [value for part in parts for value in part]
        else:
            last.columns[name] = {key: _row(parts, key) for key in parts[-1]}
    return last


def _row(parts: list[dict[str, list[float | None]]], key: str) -> list[float | None]:
    """One column of several frames; a sensor that was off has None."""
    return [v for part in parts for v in part.get(key, [None] * len(part["position"]))]


def _positions(frame: Frame, column: str, units: list[str]) -> dict[str, float]:
    """Newest positions [m] by unit; the true one where the sensor has none."""
    found = {}
    for name in units:
        value = frame.columns[name].get(column, [None])[-1]
        found[name] = 1e-3 * (frame.columns[name]["position"][-1] if value is None else value)
    return found
