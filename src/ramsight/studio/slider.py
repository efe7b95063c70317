"""A slider that stays where it was set last, however slow the way to the server."""

from __future__ import annotations

from nicegui import ui


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
        unit: of its value.
        least: its lower end.
        most: its upper end.
        first: the value that it begins with.
        step: what a key moves it by.
    """
    with ui.row().classes("w-full justify-between text-sm gap-1"):
        ui.label(f"{words} [{unit}]")
        shown = ui.label(f"{first:g}").classes("value")
    slider = Slider(min=least, max=most, step=step, value=first)
    slider.props(f'dense aria-label="{words} [{unit}]"')
    slider.on_value_change(lambda e: shown.set_text(f"{e.value:g}"))
    return slider
