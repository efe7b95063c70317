"""Places for what a machine weighs, which `lifts.js` fills in: lifts with their bands, the rated load and the truth."""

from __future__ import annotations

from nicegui import ui


def lifts_panel(unit: str) -> None:
    """The newest weighing with its picture, those before it, and the total."""
    with ui.element("section").classes("panel lifts").props('id=lifts aria-label="what it lifts"'):
        ui.html("<h2>What it lifts</h2>", sanitize=False)
        ui.label(
            "each lift weighed by the motor's torque and the sensors' positions; pale: the 95 % band; triangle: the"
            " true mass, which only the studio knows; dashed: what may be lifted there"
        ).classes("text-xs")
        ui.label(f"Nothing is weighed yet. Lift the {unit} steadily for 3 s, then stop.").props("id=lifts-none")
        ui.element("ul").props('id=lifts-newest role=log aria-label="the newest weighing"')
        ui.element("div").props("id=lifts-picture").classes("w-full")
        ui.element("ul").props('id=lifts-before aria-label="weighings before it"')
        ui.element("p").props("id=lifts-total")
        ui.label("no scale for trade, and no safety function").classes("text-xs")
