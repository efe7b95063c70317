"""What to say of an identification, and of values that were fitted: in words, as a description, as a channel map."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ramsight.calibration.identify import Estimate, Identification
from ramsight.calibration.identify_friction import FEWEST_LOADS
from ramsight.machine.as_toml import as_toml
from ramsight.machine.base import walk
from ramsight.machine.declare import Quantity
from ramsight.machine.reading import loads
from ramsight.normal import TWO_SIDED_95
from ramsight.optional import needing
from ramsight.units import FREEZING

if TYPE_CHECKING:
    from ramsight.calibration.fit_track import FittedValues, Torque
    from ramsight.logs.mapped import ChannelMap, Motor, SensorCurve
    from ramsight.machine.description import Machine

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
    """A factor with its interval, for the source of a value."""
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


def values_summary(found: FittedValues, unit: str) -> str:
    """What was found, for a terminal: a line a value, those that the runs do not tell apart marked."""
    shown = {one.path: one.declared for one in walk(found.machine) if one.declared is not None}
    width = max(len(key) for key in found.values)
    runs = "run" if len(found.rms_of) == 1 else "runs"
    lines = [f"Position within {found.rms * 1e3:.2f} mm (RMS) of the measured one over {len(found.rms_of)} {runs}."]
    for key, (value, low, high) in found.values.items():
        declared = shown[f"units.{unit}.{key}"]
        note = "" if key in found.identified else "  (hardly identified by the runs)"
        lines.append(
            f"{key:{width}}  {_short(declared, value)}  ({_short(declared, low)} to {_short(declared, high)}){note}"
        )
    error = math.expm1(TWO_SIDED_95 * found.torque_std) * 100.0
    lines.append(f"{'torque':{width}}  {found.torque.gain:.4g} of the reported one (within {error:.1f} %)")
    if found.torque.loss:
        lines.append(f"{'':{width}}  less {found.torque.loss * 100.0:.3g} % per N m of it, by the motor's saturation")
    if found.curve is not None:
        bend = max(map(abs, found.curve.excess)) * 1e3
        lines.append(f"{'curve':{width}}  of the position's sensor: up to {bend:.2f} mm beside a straight line")
    return "\n".join(lines)


def described(found: FittedValues, unit: str, machine: Machine, logs: str) -> str:
    """The description with what was found, as TOML, every value that was found with its interval as its source."""
    shown = {one.path: one.declared for one in walk(found.machine) if one.declared is not None}
    sources = dict(machine.sources)
    for key, (_, low, high) in found.values.items():
        path = f"units.{unit}.{key}"
        before = machine.source_of(path)
        weakly = "" if key in found.identified else ", hardly identified"
        limits = f"{_short(shown[path], low)} to {_short(shown[path], high)}"
        sources[path] = f"[identified] {limits}{weakly}" + (f"; was: {before}" if before else "")
    head = [
        f"# {unit} of {machine.origin or machine.name}, values found by ramsight identify",
        f"# from {logs}:",
        *(f"# {line}" for line in values_summary(found, unit).splitlines()),
    ]
    text = "\n".join([*head, *as_toml(found.machine, sources)]) + "\n"
    loads(text, "the identified description")
    return text


def _short(declared: Quantity, value: float) -> str:
    """A value in its unit with four digits: more would say more than the runs do."""
    number, _, unit = declared.show(value).partition(" ")
    return f"{float(number):.4g} {unit}".strip()


def motor_with(motor: Motor, torque: Torque) -> Motor:
    """The motor of a channel map with what was found of its torque.

    k g i (1 - i/i_s)(1 - l k i (1 - i/i_s)) to the second order of the current: k' = k g, 1/i_s' = 1/i_s + l k.
    """
    from ramsight.logs.mapped import Motor

    before = 0.0 if motor.saturation is None else 1.0 / motor.saturation
    loss = before + torque.loss * abs(motor.torque_constant)
    return Motor(motor.torque_constant * torque.gain, 1.0 / loss if loss > 0.0 else None)


def map_with(text: str, known: ChannelMap, torque: Torque, curve: SensorCurve | None = None) -> str:
    """The text of a channel map with what was found of the motor's torque and of the position's sensor.

    Args:
        text: of the map, with a table ``current`` or a curve to be found.

    Returns:
        The text with another `torque_constant`, `saturation` and `curve`; everything else as it was.
    """
    with needing("identify"):
        import tomlkit

    if known.motor is None and curve is None:
        raise ValueError("the map has no current, and no curve of a sensor was found")
    document = tomlkit.parse(text)
    if known.motor is not None:
        motor = motor_with(known.motor, torque)
        document["current"]["torque_constant"] = f"{motor.torque_constant:.6g} N m"
        if motor.saturation is not None:
            document["current"]["saturation"] = float(f"{motor.saturation:.6g}")
    if curve is not None:
        table = tomlkit.inline_table()
        table["unit"] = "mm"
        table["reading"] = [round(1e3 * one, 3) for one in curve.at]
        table["excess"] = [round(1e3 * one, 4) for one in curve.excess]
        document["measured"]["position"]["curve"] = table
    return tomlkit.dumps(document)
