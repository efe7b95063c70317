"""Places for what a sensor knows, which `known.js` fills in: how likely each place of the piston is, and why."""

from __future__ import annotations

from nicegui import ui

_QUESTIONS = {
    "now": "What does it know now?", "sure": "How sure is it?", "since": "Since when?",
    "next": "What makes it surer?", "wrong": "What if it is wrong?",
}  # fmt: skip
"""What a look at the page answers, by what the places of the answers are called."""


def places_panel(of: str) -> None:
    """How likely each place in the cylinder is, and what that answers.

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
        rows = "".join(f"<dt>{question}</dt><dd id={of}-{name}>–</dd>" for name, question in _QUESTIONS.items())
        ui.html(rows, sanitize=False, tag="dl").classes("answers").props(f"id={of}-said")


def reasons_panel(of: str) -> None:
    """Why it knows that.

    Args:
        of: what the places on the page are called, as `known`.
    """
    with ui.element("section").classes(f"panel {of}"):
        ui.html("<h2>Why it knows that</h2>", sanitize=False)
        ui.element("ul").props(
            f'id={of}-hypotheses class=known-hypotheses aria-label="what it takes for true, and how likely that is"'
        )
        ui.label("").props(f"id={of}-moved").classes("text-xs whitespace-pre-wrap")
        ui.label("learned, over the data sheet; dashed: as the data sheet has it").classes("text-xs mt-1")
        ui.element("div").props(f"id={of}-learned").classes("now known-learned")
