"""How long the studio's sensor is green beyond its band, after each of what a visitor can make go wrong.

A machine of the studio finds its ends for two minutes; then something goes wrong, and it works on for three more. All
that is counted is what a visitor sees: *ok*, and an error beyond the 95 % band. Each is the worst of several instants.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from ramsight import machine
from ramsight.normal import TWO_SIDED_95
from ramsight.studio.knobs import WRONG_START
from ramsight.studio.playing import ENDS
from ramsight.studio.rig import Rig

MACHINES = ("mining-loader", "press")
BEFORE, AFTER, DARK = 120.0, 180.0, 6.0  # s: until it goes wrong, from then on, without power
LATER = (0.0, 6.0, 12.0, 18.0, 24.0)  # s after the two minutes: the instants, spread over a stroke
HOT = 333.15  # K
EARLY = 0.7  # of the stroke, where an obstacle stands


@dataclass(frozen=True)
class Trouble:
    """What goes wrong."""

    words: str  # for the table
    begins: Callable[[Rig, str], object]  # does it to a unit of a machine


TROUBLES = {
    "none": Trouble("nothing", lambda rig, unit: None),
    "leak": Trouble("pumps that leak three times as much", lambda rig, unit: rig.turn(replace(rig.knobs, leak=3.0))),
    "hot_oil": Trouble("oil of 60 °C", lambda rig, unit: rig.turn(replace(rig.knobs, oil_temperature=HOT))),
    "obstacle": Trouble(
        "an obstacle at 70 % of the stroke",
        lambda rig, unit: rig.obstruct({unit: EARLY * float(rig.sheet[unit].cylinder.stroke)}),
    ),
    "start": Trouble("a wrong start", lambda rig, unit: rig.start_sensors("kalman", off=WRONG_START)),
    "power": Trouble("a power cut of 6 s", lambda rig, unit: rig.fault("power", on=True)),
}
"""By the key in results/study.json."""


def runs() -> int:
    """How many there are."""
    return len(MACHINES) * len(TROUBLES) * len(LATER)


def study(advance: Callable[[int], object]) -> dict[str, dict[str, dict[str, float]]]:
    """Figures by machine and trouble."""
    found: dict[str, dict[str, dict[str, float]]] = {}
    for name in MACHINES:
        found[name] = {}
        for key, trouble in TROUBLES.items():
            each = []
            for later in LATER:
                each.append(look(name, trouble, BEFORE + later))
                advance(1)
            found[name][key] = {
                "longest": max(one["longest"] for one in each),
                "largest": max(one["largest"] for one in each),
                "ok": min(one["ok"] for one in each),
            }
    return found


def look(name: str, trouble: Trouble, at: float) -> dict[str, float]:
    """Longest time that the sensor was ok and off by more than its band [s], and its largest error while ok [m].

    Args:
        at: when it goes wrong [s].
    """
    rig = Rig(machine.load_machine(name))
    unit = next(iter(rig.sheet))
    rig.begin(known=False)
    rig.play(ENDS)
    time = wrong = longest = largest = green = 0.0
    begun = False
    while time < at + AFTER:
        if not begun and time >= at:
            begun = True
            trouble.begins(rig, unit)
        if "power" in rig.faults and time >= at + DARK:
            rig.fault("power", on=False)
        row = rig.step()[unit]
        passed, time = row.time - time, row.time
        said = row.estimates.get("kalman")
        error = 0.0 if said is None else abs(said.position - row.position)
        ok = said is not None and said.status.validity == "ok"
        wrong = wrong + passed if said is not None and ok and error > TWO_SIDED_95 * said.position_std else 0.0
        if begun:
            longest, green = max(longest, wrong), green + passed * ok
            largest = max(largest, error) if ok else largest
    return {"longest": longest, "largest": largest, "ok": green / AFTER}


def table(found: dict[str, Any]) -> list[str]:
    """A trouble a row."""
    heads = " | ".join(f"{name}: longest, largest error while ok, share ok" for name in MACHINES)
    rows = [f"| what goes wrong | {heads} |", "|---" * (len(MACHINES) + 1) + "|"]
    for key, trouble in TROUBLES.items():
        cells = (
            f"{one['longest']:.1f} s, {1e3 * one['largest']:.0f} mm, {100 * one['ok']:.0f} %"
            for one in (found[name][key] for name in MACHINES)
        )
        rows.append(f"| {trouble.words} | {' | '.join(cells)} |")
    return rows
