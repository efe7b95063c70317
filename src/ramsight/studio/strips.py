"""Signals that the strips over time can show, and strips of them: those that are ready made, and a visitor's own."""

from __future__ import annotations

from dataclasses import dataclass
from difflib import get_close_matches

from ramsight.errors import DescriptionError
from ramsight.sensor.kind import Kind
from ramsight.studio.knobs import KINDS, SECOND

STATUS = "status"
"""Measure of what has no axis: a lane says what it is now."""
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
