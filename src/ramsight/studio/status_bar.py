"""The bar that stays on the screen: of every sensor position, band and status, and what the status asks for."""

from __future__ import annotations

from nicegui import ui

from ramsight.studio.knobs import KINDS, SECOND
from ramsight.studio.said import SILENT

_NAMES = {kind: kind for kind in KINDS} | {SECOND: "transducer"}
_OFF = set(_NAMES) - {"kalman", "balance"}  # hidden until they report something


def status_bar(units: list[str]) -> None:
    """Build the bar; `studio.js` fills it from frames.

    Args:
        units: of the machine.
    """
    rows = "".join(
        f'<div class="unit">{"".join(_row(unit, kind, name) for kind, name in _NAMES.items())}</div>' for unit in units
    )
    numbers = (
        ("true", "now-true", "mm"), ("kalman", "now-kalman", "mm"), ("its error", "now-error", "mm"),
        ("balance's error", "now-balance-error", "mm"), ("time", "now-time", "s"), ("speed-up", "now-factor", "×"),
    )  # fmt: skip
    now = "".join(f'<span>{words} <b id="{place}">–</b> {unit}</span>' for words, place, unit in numbers)
    ui.html(
        f'<div class="rows">{rows}</div>'
        '<p class="meaning" tabindex="0" role="group" aria-label="what the status means">'
        '<b id="meaning-of">–</b> <span id="meaning">No sensor has reported anything yet.</span>'
        ' <span id="remedy"></span></p>'
        f'<div class="now">{now}</div>',
        sanitize=False,
    ).classes("bar").props('id=bar role=region aria-label="what the sensors say"')


def _row(unit: str, kind: str, name: str) -> str:
    place = f"{unit}-{kind}"
    hidden = " hidden" if kind in _OFF else ""
    return (
        f'<button type="button" class="said" data-unit="{unit}" data-kind="{kind}"{hidden}>'
        f'<span class="who">{unit} <b>{name}</b></span><span class="at"><b id="at-{place}">–</b> mm</span>'
        f'<span class="width">± <b id="width-{place}">–</b> mm</span>'
        f'<span class="status" id="status-{place}">{SILENT}</span></button>'
    )
