"""What to say of an identification."""

from __future__ import annotations

import math

from ramsight.calibration.identify import Estimate, Identification
from ramsight.calibration.identify_friction import FEWEST_LOADS
from ramsight.units import FREEZING

WORDS = {
    "leak": "leak factor", "orifice": "orifice leak", "displacement": "displacement factor",
    "stiffness": "stiffness factor", "friction": "friction factor", "efficiency": "pump efficiency",
}  # fmt: skip
_WHY = {
    "leak": "needs moves under load, both ways",
    "orifice": "needs loads of different pressure, or oil of different temperatures",
    "displacement": "needs moves both ways",
    "stiffness": "needs loads that differ between moves, at best changed at rest, and a valve that holds them there",
    "friction": f"the pumps' own friction may be as much; needs {FEWEST_LOADS} loads and more, each lifted and lowered",
    "efficiency": f"needs {FEWEST_LOADS} loads and more that differ, each lifted and lowered",
}
_HEAD = [("", "of the", "95 % interval", "oil 1 K", "torque 1 %"), ("", "data sheet", "", "warmer", "larger")]


def summary(found: Identification) -> str:
    """The factors with their intervals and what they depend on, as lines of text."""
    low, high = (1e-5 * p for p in found.pressure)
    cold, hot = (t - FREEZING for t in found.temperature)
    rows: list[tuple[str, ...]] = list(_HEAD)
    notes = []
    for name, words in WORDS.items():
        estimate = found.factors[name]
        if estimate.identified:
            shifts = (f"{estimate.per_kelvin:+.4f}", f"{estimate.per_torque:+.4f}")
            rows.append((words, _number(name, estimate.value), _ends(name, estimate), *shifts))
        else:
            rows.append((words, _number(name, estimate.value), "not identifiable from this log", "", ""))
            notes.append(_untold(name, estimate))
    if not found.factors["orifice"].identified:
        notes.append("  the leak factor counts all leakage at this log's pressures and temperatures as laminar")
    notes += [
        f"  {words}: not determined by this log, whose interval is wider "
        f"than the ± {found.judged_by[name]:.2g} that it is judged by"
        for name, words in WORDS.items()
        if found.is_vague(name)
    ]
    notes += _no_load(found.factors["friction"])
    table = [f"{a:<20} {b:>10}  {c:<21} {d:>8}  {e:>10}".rstrip() for a, b, c, d, e in rows]
    lines = [
        f"{found.moves} moves ({found.lifts} lifting, {found.lowers} lowering), {found.duration:.0f} s, "
        f"{_plural(found.loads, 'load')} both ways, "
        f"{low:.0f} to {high:.0f} bar, {cold:.1f} to {hot:.1f} degC; "
        f"unexplained within a move {1e3 * found.residual:.3f} mm",
        *table,
        *notes,
        *_lag(found.delay),
    ]
    return "\n".join(lines)


def words_of(name: str, estimate: Estimate) -> str:
    """A factor with its interval, for the source of a value.

    Args:
        name: of `FACTORS`.
        estimate: of it.
    """
    text = f"{WORDS[name]} {_number(name, estimate.value)} (95 %: {_ends(name, estimate)}"
    if math.isfinite(estimate.as_described):
        text += f"; ± {estimate.as_described:.4f} if the pumps' no-load torque is as described"
    return text + ")"


def _number(name: str, value: float) -> str:
    return f"{value:+.4f}" if name == "efficiency" else f"{value:.4f}"


def _ends(name: str, estimate: Estimate) -> str:
    low = estimate.low if name == "efficiency" else max(estimate.low, 0.0)
    return f"{_number(name, low)} to {_number(name, estimate.high)}"


def _plural(count: int, word: str) -> str:
    return f"{count} {word}" + ("" if count == 1 else "s")


def _untold(name: str, estimate: Estimate) -> str:
    half = estimate.high - estimate.value
    wide = f", its interval would be ± {half:.2g}" if half < 1e3 else ""
    return f"  {WORDS[name]}: left at the data sheet{wide}; {_WHY[name]}"


def _no_load(friction: Estimate) -> list[str]:
    """What of the friction's interval is the pumps' no-load torque."""
    if not friction.identified:
        return []
    return [
        f"  friction factor: with the no-load torque of the pumps as described ± {friction.as_described:.3f}; a "
        f"quarter more of it would make it {friction.per_no_load:+.3f}, and no log tells them apart"
    ]


def _lag(lag: Estimate) -> list[str]:
    if not (lag.identified and lag.low * lag.high > 0.0):
        return []
    ends = f"{1e3 * lag.low:.1f} to {1e3 * lag.high:.1f}"
    return [f"  the position lags the drive by {1e3 * lag.value:.1f} ms ({ends}); this is taken off"]
