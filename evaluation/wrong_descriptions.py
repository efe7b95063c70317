"""Whether a commissioning names the wrong value of a description: machines built otherwise, one value 10 % off.

The machine is the description but for what was built otherwise (leakage, displacement, stiffness, friction); its drive
logs a commissioning. The log is judged by descriptions with one value 10 % off either way, and by the right one.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

import ramsight
from ramsight.machine.base import walk
from ramsight.study.commissioning.log_checks import leakage
from ramsight.study.commissioning.wrong_values import Judgement, judge, observed

UNITS = {"mining-loader": "boom", "forklift-mast": "lift"}
VALUES = {
    "mining-loader": (
        "pump_a.displacement", "cylinder.bore", "cylinder.stroke", "relief_valve.setting", "pump_a.belt",
    ),
    "forklift-mast": ("parts.pump.displacement", "cylinder.bore", "cylinder.stroke", "parts.relief.setting"),
}  # fmt: skip
OFF = (0.9, 1.1)
BUILDS = 3  # machines of each kind
_FIRST_SEED = 4000  # others than those of the other studies


def runs() -> int:
    """How many machines there are."""
    return BUILDS * len(UNITS)


def built(seed: int) -> ramsight.AsBuilt:
    """How a machine differs from its data sheet, within what data sheets leave open."""
    drawn = np.random.default_rng(seed)
    return ramsight.AsBuilt(
        leak=float(np.exp(drawn.normal(0.0, 0.15))),
        displacement=float(1.0 + drawn.normal(0.0, 0.005)),
        stiffness=float(drawn.uniform(0.8, 1.25)),
        friction=float(drawn.uniform(0.7, 1.4)),
    )


def study(advance: Callable[[int], object]) -> list[dict[str, Any]]:
    """A row for each machine, description and way of measuring."""
    rows = []
    for name, unit in UNITS.items():
        machine = ramsight.load_machine(name)
        values = {one.path: one.value for one in walk(machine.unit(unit))}
        for seed in range(_FIRST_SEED, _FIRST_SEED + BUILDS):
            run = ramsight.simulate(machine, "commissioning", unit=unit, as_built=built(seed))
            log = ramsight.drive_report(run)
            cases = [(path, off) for path in VALUES[name] for off in OFF] + [("", 1.0)]
            for path, off in cases:
                wrong = machine.replace({f"units.{unit}.{path}": values[path] * off}) if path else machine
                track = ramsight.track(wrong, log, unit=unit)
                for truth in (run, None):
                    found = judged(wrong, unit, log, track, truth)
                    rows.append(row(name, path, off, values.get(path, 0.0), found) | {"measured": truth is not None})
            advance(1)
    return rows


def judged(machine: ramsight.Machine, unit: str, log: Any, track: Any, truth: Any) -> Judgement:
    """The description against the log, as `ramsight commission` does it."""
    made = ramsight.build(machine, unit)
    _, test = leakage(made, log)
    return judge(unit, machine.unit(unit), made, observed(made, log, track, test, truth))


def row(name: str, path: str, off: float, true: float, found: Judgement) -> dict[str, Any]:
    """What is said of one description."""
    wrong = found.wrong
    return {
        "machine": name,
        "value": path,
        "described_over_true": off,
        "named": None if wrong is None else wrong.path,
        "also": [] if wrong is None else list(wrong.others),
        "holds": wrong is not None and wrong.path == path and wrong.low <= true <= wrong.high,
        "width": None if wrong is None else wrong.high / wrong.low - 1.0,
    }


def table(rows: list[dict[str, Any]]) -> list[str]:
    """The study as a table: a line for each value, with and without a measured position."""
    lines = [
        "| machine | wrong value, 10 % off | position | named first | named | interval holds the true value |",
        "|---|---|---|---|---|---|",
    ]
    keys = dict.fromkeys((one["machine"], one["value"], one["measured"]) for one in rows)
    for name, path, measured in keys:
        those = [one for one in rows if (one["machine"], one["value"], one["measured"]) == (name, path, measured)]
        first = [one for one in those if one["named"] == path]
        known = [one for one in those if one["named"] == path or path in one["also"]]
        position = "measured" if measured else "not measured"
        if not path:
            quiet = sum(one["named"] is None for one in those)
            lines.append(f"| {name} | none | {position} | – | nothing named: {quiet} of {len(those)} | – |")
            continue
        holds = f"{sum(one['holds'] for one in first)} of {len(first)}" if first else "–"
        counts = f"{len(first)} of {len(those)} | {len(known)} of {len(those)}"
        lines.append(f"| {name} | `{path}` | {position} | {counts} | {holds} |")
    return lines
