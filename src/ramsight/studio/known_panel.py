"""Places for what a sensor knows, which `known.js` fills in: how likely each place of the piston is, and why."""

from __future__ import annotations

from nicegui import ui


def places_panel(of: str) -> None:
    """How likely each place in the cylinder is.

    Args:
        of: what the places on the page are called, as `known`.
    """
    with ui.element("section").classes(f"panel {of}"):
        ui.html("<h2>What the sensor knows</h2>", sanitize=False)
        ui.label(
            "how likely each place in the cylinder is (height: its root), by what the sensor takes for true; pale: the"
            " 95 % band; whiskers: the bound; triangle: where the piston is"
        ).classes("text-xs")
        ui.element("div").props(f"id={of}").classes("w-full")
        ui.label("–").props(f"id={of}-said").classes("text-xs")


def reasons_panel(of: str) -> None:
    """Why it knows that, and what would make it surer.

    Args:
        of: what the places on the page are called, as `known`.
    """
    with ui.element("section").classes(f"panel {of}"):
        ui.html("<h2>Why it knows that</h2>", sanitize=False)
        ui.element("ul").props(
            f'id={of}-hypotheses class=known-hypotheses aria-label="what it takes for true, and how likely that is"'
        )
        ui.label("").props(f"id={of}-moved").classes("text-xs whitespace-pre-wrap")
        ui.label("–").props(f"id={of}-next").classes("text-xs")
        ui.label("learned, over the data sheet; dashed: as the data sheet has it").classes("text-xs mt-1")
        ui.element("div").props(f"id={of}-learned").classes("now known-learned")
