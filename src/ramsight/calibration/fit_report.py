"""What was found of a description's values, in words, as a description and as a channel map."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ramsight.machine.as_toml import as_toml
from ramsight.machine.base import walk
from ramsight.machine.declare import Quantity
from ramsight.machine.reading import loads
from ramsight.normal import TWO_SIDED_95
from ramsight.optional import needing

if TYPE_CHECKING:
    from ramsight.calibration.fit_track import FittedValues, Torque
    from ramsight.logs.mapped import ChannelMap, Motor, SensorCurve
    from ramsight.machine.description import Machine


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
        known: the map.
        torque: what was found.
        curve: of the position's sensor, if it was looked for.

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
