"""The page of a machine that runs: what its sensors say, a scenario or the controls, the machine and its circuit."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from typing import Any

from nicegui import background_tasks, ui

from ramsight.studio.controls import Controls, RacePanel, labelled
from ramsight.studio.known_panel import places_panel, reasons_panel
from ramsight.studio.prepared import Prepared
from ramsight.studio.scene import VIEWS, MachineScene
from ramsight.studio.session import STANDS, Session
from ramsight.studio.setting import Setting, catalogue_name, query_of
from ramsight.studio.status_bar import status_bar, status_help
from ramsight.studio.story_panel import StoryPanel
from ramsight.studio.strips import strips_known, strips_panel
from ramsight.studio.worker import Frame


def lifts_panel(unit: str) -> None:
    """The newest weighing with its picture, those before it, and the total."""
    with ui.element("section").classes("panel lifts").props('id=lifts aria-label="what it lifts"'):
        ui.html("<h2>What it lifts</h2>", sanitize=False)
        ui.label(
            "each lift weighed by the motor's torque and the sensors' positions; pale: the 95 % band; triangle: the"
            " true mass, which only the studio knows; dashed: what may be lifted there"
        ).classes("text-xs")
        ui.label(f"Nothing is weighed yet. Lift the {unit} steadily for 3 s, then stop.").props("id=lifts-none")
        ui.element("ul").props('id=lifts-newest aria-live=polite aria-label="the newest weighing"')
        ui.element("div").props("id=lifts-picture").classes("w-full")
        ui.element("ul").props('id=lifts-before aria-label="weighings before it"')
        ui.element("p").props("id=lifts-total")
        ui.label("no scale for trade, and no safety function").classes("text-xs")


_STANDS = f"the machine's process has said nothing for {STANDS:g} s: what is shown is old"
_PAUSE = 0.01  # s between two looks at what has come
_BEGINS = 30.0  # s that a page may take to begin, and then to lay out the machine in space
_ANSWERS = 5.0  # s that a page may take for a frame
_BEAT = 1.0  # s, from one word that the server is there to the next
_SCENE = 3  # every how many frames the machine in space is moved
_MAGNIFIED = 100  # times, at most, that an error is shown as large as it is
_SCALE = '<div class="scale"><span>0 bar</span><i></i><span><b id="highest-pressure">–</b> bar</span></div>'
"""The colours of the circuit's lines over the pressure; `studio.js` knows the highest one."""
_ADDRESS = '<input id="link" class="link" readonly hidden aria-label="link to this setting">'
_HIGHEST = 250.0  # bar, that the circuit's warmest colour stands for where no relief valve says it
_STORY, _CONTROLS, _RACE = "scenarios", "controls", "race"


def live_page(
    prepared: Prepared, session: Session, setting: Setting, laid_out: Callable[[], object], *, can_link: bool = True
) -> None:
    """Build the page for one visitor.

    Args:
        setting: in which it begins; if no scenario plays it stands, with its controls.
        laid_out: is called once the page and its machine in space are there.
        can_link: whether a link leads to this machine: one that is described in this page alone has none.
    """
    described, units = prepared.described, list(prepared.circuits)
    signs = {name: float(described.unit(name).lift_sign) for name in units}
    client, shown, name = ui.context.client, setting.unit or units[0], catalogue_name(described)
    ui.element("p").props("id=reloaded role=status")
    ui.timer(_BEAT, lambda: ui.run_javascript("studio.beat()"))
    status_bar(units)
    with ui.element("div").classes("studio"):
        with ui.column().classes("gap-3 min-w-0 first"):
            story, controls, race, latest = _first_column(session, units, signs, setting)
            _link(name, latest, can_link=can_link)
        with ui.column().classes("gap-3 min-w-0 seen"):
            places_panel("known")
            space, magnified = _machine(lambda view: looks[0](view) if looks else None)
            if prepared.linked is not None and prepared.linked.mechanism.rated_payload > 0.0:
                lifts_panel(prepared.linked.mechanism.cylinders[0])
            reasons_panel("known")
            _circuits(prepared.circuits, shown)
            _energy(session)
        strips_panel(session, units)

    looks: list[Callable[[str], None]] = []  # of the machine in space, once it is there

    def scene() -> MachineScene:
        with space:
            made = MachineScene(described, prepared.linked)
        magnified.on_value_change(lambda e: made.magnify(float(e.value)))
        made.magnify(float(magnified.value))
        looks[:] = [made.look]
        return made

    begun = 0
    address = "" if can_link else None  # what nobody has changed is there as it came; another machine is not

    def show(frame: Frame) -> None:
        nonlocal begun, address
        latest[:] = [frame]
        now = _query(frame, name)
        if address not in ("", now):
            ui.run_javascript(f"studio.address({json.dumps(now)})")
        address = now
        gone_on, again, begun = story.show(frame.telling), frame.begun != begun, frame.begun
        race.show(frame.settings)
        if gone_on or again:  # a scene has set something
            controls.follow(frame.settings, levers=again)

    view = f"studio.strips({json.dumps(strips_known())}, {json.dumps(setting.strips)}); "
    view += f"studio.show({json.dumps(shown)}); "
    view += f"studio.timeline.spanned({json.dumps(setting.span)})"

    def there() -> None:
        _set_going(session, setting)
        laid_out()

    background_tasks.create(_follow(session, client, scene, prepared, show, view, there))
    lost = None if can_link or name is not None else described.title or described.name
    ui.run_javascript(f"studio.holds('machine', {json.dumps(lost)})")


def _first_column(
    session: Session, units: list[str], signs: Mapping[str, float], setting: Setting
) -> tuple[StoryPanel, Controls, RacePanel, list[Frame]]:
    """Scenarios, controls or the race, one at a time; above them the machine's state. The newest frame goes last."""
    scenario = setting.scenario
    waits = ui.label("the machine is being made ready …").props("id=ready role=status").classes("text-sm")
    latest: list[Frame] = []
    ui.timer(0.3, lambda: waits.set_text(session.ended or _state(session, waits.text, is_shown=bool(latest))))
    choice = ui.toggle([_STORY, _CONTROLS, _RACE], value=_CONTROLS if scenario is None else _STORY)
    choice.props("no-caps spread dense").classes("w-full")

    def play(name: str | None) -> None:
        session.say("scenario", name)
        if name is not None:
            story.begins(name)

    with ui.column().classes("gap-3 w-full").bind_visibility_from(choice, "value", value=_STORY):
        story = StoryPanel(play)
    with ui.column().classes("gap-3 w-full").bind_visibility_from(choice, "value", value=_CONTROLS):
        begin = ui.button("begin again, nothing plays", on_click=lambda: play(None))
        begin.props('dense size=sm no-caps title="positions, knobs, faults and sensors as at first"')
        controls = Controls(session, units, signs)
    with ui.column().classes("gap-3 w-full").bind_visibility_from(choice, "value", value=_RACE):
        race = RacePanel(session.say, lambda: play(None), controls)
    controls.follow(setting.settings, levers=False)
    if scenario is not None:
        story.begins(scenario)
    return story, controls, race, latest


def _set_going(session: Session, setting: Setting) -> None:
    """Let a machine go on in its setting: not before the page is there, which would miss its first seconds."""
    session.go_on()
    if setting.scenario is not None:
        session.say("scenario", setting.scenario)
    for command in setting.commands():
        session.say(*command)


def _query(frame: Frame, name: str | None) -> str:
    """The query of a link to a machine as a frame says that it is set; its name in the catalogue, if it has one."""
    telling = frame.telling
    return query_of(frame.settings, None if telling is None or telling["over"] else telling["name"], name)


def _link(name: str | None, latest: list[Frame], *, can_link: bool) -> None:
    """A button that makes a link to the machine as it is set."""

    def make() -> None:
        if name is None and not can_link:
            ui.notify("This description is in this page alone: a link has no room for it. Download its TOML file.")
        elif latest:
            ui.run_javascript(f"studio.link({json.dumps(_query(latest[0], name))})")

    with ui.element("section").classes("panel"):
        button = ui.button("make a link to this setting", on_click=make, color=None)
        button.props("dense no-caps unelevated").classes("latch")
        ui.html(_ADDRESS, sanitize=False).classes("w-full")


def _state(session: Session, before: str, *, is_shown: bool) -> str:
    """What is said of a machine that has not ended; it runs once the page shows it."""
    if session.stands:
        return _STANDS
    return "runs" if is_shown else session.making or before


def _machine(look: Callable[[str], None]) -> tuple[Any, Any]:
    """The place of the machine in space, and the slider that magnifies the error in it; `look` goes to a view."""
    with ui.element("section").classes("panel"):
        ui.html("<h2>The machine</h2>", sanitize=False)
        ui.label("red and pale: where the sensor takes it to be; the fan: its 95 % band").classes("text-xs")
        space = ui.element("div").classes("w-full space")
        magnified = labelled("error in the picture", "× true", 1.0, _MAGNIFIED, 1.0, 1.0)
        with ui.row().classes("gap-1").props('role=group aria-label="where one looks from"'):
            for name in ("as at first", *VIEWS):
                button = ui.button(name, on_click=partial(look, name), color=None)
                button.props("dense no-caps unelevated").classes("latch")
            _own_view()
    return space, magnified


def _own_view() -> None:
    """A view of the visitor's own, which the browser keeps for this machine."""
    for name, words, does in (("keep-view", "keep this view", "keepView"), ("kept-view", "kept view", "keptView")):
        button = ui.button(words, color=None).on("click", js_handler=f"() => studio.{does}()")
        button.props(f"dense no-caps unelevated id={name}").classes("latch" if does == "keepView" else "latch none")


def _circuits(circuits: Mapping[str, str], shown: str) -> None:
    with ui.element("section").classes("panel circuit") as panel:
        with ui.row().classes("w-full justify-between items-center"):
            ui.html("<h2>The circuit</h2>", sanitize=False)
            enlarge = ui.button("enlarge, with names and data", color=None)
            enlarge.props("dense no-caps unelevated").classes("latch")
        enlarge.on_click(lambda: _enlarge(panel, enlarge))
        ui.label(
            "lines: blue at the tank's pressure, red at the relief valves'; dashes go as the oil goes, faster where"
            " more flows; yellow: a valve passes oil; red: a relief valve opens"
        ).classes("text-xs")
        ui.html(_SCALE, sanitize=False)
        units = list(circuits)
        for name, text in circuits.items():
            place = ui.html(text, sanitize=False).classes("w-full drawn").props(f'data-circuit="{name}" tabindex=0')
            place.props(f'role=region aria-label="circuit of {name}"')
            if name != shown:
                place.props("hidden")
        if len(units) > 1:
            ui.toggle(
                units, value=shown, on_change=lambda e: ui.run_javascript(f"studio.show({json.dumps(e.value)})")
            ).props("no-caps dense")


def _enlarge(panel: ui.element, button: ui.button) -> None:
    """Show the circuit as large as the window, where its words can be read, or as it was."""
    large = "large" not in panel.classes
    panel.classes(toggle="large")
    button.set_text("back" if large else "enlarge, with names and data")


def _energy(session: Session) -> None:
    with ui.element("section").classes("panel"):
        ui.html("<h2>Where the energy goes</h2>", sanitize=False)
        ui.label("–").props("id=energy-said").classes("text-xs")
        ui.element("div").props("id=sankey").classes("w-full")
        ui.button("reset the account", on_click=lambda: session.say("account")).props("dense size=sm no-caps")


async def _follow(
    session: Session,
    client: Any,
    scene: Callable[[], MachineScene],
    prepared: Prepared,
    show: Callable[[Frame], None],
    view: str,
    laid_out: Callable[[], object],
) -> None:
    """Hand the page what comes of its machine, no faster than the page takes it.

    The machine in space comes once the rest is there: what draws it is as large as all the rest.
    """
    units = list(prepared.circuits)
    try:
        space = await _begun(client, scene, prepared, view)
    except TimeoutError:  # the browser has gone, or runs no script
        return
    with client:
        laid_out()
    seen, stood = 0, False
    while not client.is_deleted and not session.over:
        frames = session.frames()
        if session.stands is not stood and client.has_socket_connection:
            stood = not stood
            # the page's body, since a tab that is not shown has no elements
            client.run_javascript(f"document.body.classList.toggle('stands', {json.dumps(stood)})")
        if not frames or not client.has_socket_connection:
            await asyncio.sleep(_PAUSE)
            continue
        frame = _joined(frames)
        try:
            await client.run_javascript(f"studio.frame({json.dumps(asdict(frame), default=str)})", timeout=_ANSWERS)
        except TimeoutError:
            continue
        seen += 1
        if session.over or client.is_deleted:
            break
        with client:
            show(frame)
            if seen % _SCENE == 0:
                known = all(frame.columns[name].get("kalman", [None])[-1] is not None for name in units)
                true, estimated = (_positions(frame, column, units) for column in ("position", "kalman"))
                band = {name: found for name in units if (found := _band(frame.columns[name])) is not None}
                space.show(true, estimated, frame.load, band=band, known=known)


async def _begun(client: Any, scene: Callable[[], MachineScene], prepared: Prepared, view: str) -> MachineScene:
    """Let the page begin; the machine in space. TimeoutError: it does not answer."""
    await client.connected(timeout=_BEGINS)
    with client:
        given = (list(prepared.circuits), _HIGHEST, prepared.lines, status_help())
        await client.run_javascript(f"studio.begin({', '.join(map(json.dumps, given))}); {view}", timeout=_BEGINS)
        if client.is_deleted:
            raise TimeoutError
        space = scene()
        await asyncio.wait_for(space.scene.initialized(), _BEGINS)
        client.run_javascript(f"studio.space({space.scene.id})")
    return space


def _joined(frames: list[Frame]) -> Frame:
    """Several frames as one: all their rows since the machine began again last, and the newest of the rest."""
    last = frames[-1]
    frames = [frame for frame in frames if frame.begun == last.begun]
    last.marks = sorted(mark for frame in frames for mark in frame.marks)
    last.energy = next((frame.energy for frame in reversed(frames) if frame.energy), {})
    last.known = next((frame.known for frame in reversed(frames) if frame.known), {})
    last.lifts = next((frame.lifts for frame in reversed(frames) if frame.lifts), {})
    for name in last.columns:
        parts = [frame.columns[name] for frame in frames]
        if name == "time":
            last.columns[name] = [value for part in parts for value in part]
        else:
            last.columns[name] = {key: _row(parts, key) for part in parts for key in part}
    return last


def _row(parts: list[dict[str, list[float | None]]], key: str) -> list[float | None]:
    """One column of several frames; a sensor that reports nothing has None."""
    return [v for part in parts for v in part.get(key, [None] * len(part["position"]))]


def _band(columns: Mapping[str, Sequence[float | None]]) -> tuple[float, float] | None:
    """Newest 95 % band [m] of a unit's kalman sensor; None where it has none."""
    low, high = (columns.get(f"kalman_{edge}", [None])[-1] for edge in ("low", "high"))
    return None if low is None or high is None else (1e-3 * low, 1e-3 * high)


def _positions(frame: Frame, column: str, units: list[str]) -> dict[str, float]:
    """Newest positions [m] by unit; the true one where the sensor has none."""
    found = {}
    for name in units:
        value = frame.columns[name].get(column, [None])[-1]
        found[name] = 1e-3 * (frame.columns[name]["position"][-1] if value is None else value)
    return found
