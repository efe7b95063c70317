"""The table of docs/explanation/signals.md: which faults a set of signals can show, and which it can distinguish."""

from __future__ import annotations

from ramsight.sensor.redundancy import detectable

SETS = {
    "speed, torque, temperature": (),
    "+ reference": ("reference",),
    "+ counter": ("counter",),
    "+ DC power": ("DC power",),
    "+ counter and DC power": ("counter", "DC power"),
    "+ pressures": ("pressures",),
    "+ one load that is known": ("one load",),
    "+ inertia of the shaft, in ramps": ("inertia",),
    "+ counter and inertia, in ramps": ("counter", "inertia"),
    "all": ("counter", "DC power", "pressures", "reference"),
}


def table() -> list[str]:
    """In Markdown: signals, and what faults of speed, torque, counter and power can be seen and distinguished."""
    shown = ("speed", "torque", "temperature", "counter", "DC power", "pressures", "reference")
    rows = [f"| given | {' | '.join(shown)} |", "|---" * (len(shown) + 1) + "|"]
    for name, further in SETS.items():
        found = detectable(further)
        rows.append(f"| {name} | {' | '.join(_cell(found, signal) for signal in shown)} |")
    return rows


def _cell(found: dict[str, tuple[str, ...] | None], signal: str) -> str:
    if signal not in found:
        return ""
    others = found[signal]
    if others is None:
        return "unseen"
    return f"seen, or {', '.join(others)}" if others else "named"
