"""What a kalman sensor takes for an end, in hours of work: contacts that are none, and ends that it finds.

A contact counts where it becomes a measurement of the place (`accepted` under a hypothesis). It is false where the true
piston is further than 1 % of the stroke from both ends. An end is pressed where oil passes the relief valve on it while
the motor turns; it is found with the first measurement since the piston is there. Machines are drawn as in `work_days`;
the start is unknown, and the sensor knows no switch. Work is that of a loader (`loader_work`), or that of the steady
days with visits to both ends (`work_day`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray
from work_days import LOADS, data_sheets, drawn_machine, passes_relief, reported

from ramsight.arrays import true_intervals
from ramsight.duty import simulate
from ramsight.duty.loader_work import loader_work
from ramsight.duty.profile import Duty
from ramsight.duty.work_day import work_day
from ramsight.hindsight.innovations import Innovation
from ramsight.hindsight.smoother import Forward, silent
from ramsight.hindsight.trace import Tracer
from ramsight.plant.ddh import DdhUnit
from ramsight.sensor.virtual_sensor import log_inputs

HOUR = 3600.0
HOURS = 50
"""Of each kind of work of each unit; each hour is another machine's."""
KINDS = ("loader", "steady")
AT_END = 0.01  # share of the stroke
PRESSED = 0.06  # s at the setting, from when on an end counts as pressed
_STARTS = 1.0  # rad/s, of a motor that turns


@dataclass
class Found:
    """Contacts of some hours."""

    hours: float = 0.0  # of work
    false: int = 0  # measurements where no end is that the likeliest hypothesis accepted
    refused: int = 0  # those that it did not accept
    pressed: int = 0  # visits to ends that were pressed to the setting
    delays: list[float] = field(default_factory=list)  # of those that were found, after the setting was reached [s]

    def figures(self) -> dict[str, float]:
        """What they come to; of ends nothing, where none was pressed."""
        counts = {"hours": self.hours, "false_contacts": self.false, "refused": self.refused}
        if not self.pressed:
            return counts
        return counts | {
            "ends_pressed": self.pressed,
            "ends_found": len(self.delays) / self.pressed,
            "delay_median_s": float(np.median(self.delays)),
            "delay_p95_s": float(np.percentile(self.delays, 95.0)),
        }


def worked(unit: DdhUnit, kind: str, seed: int) -> tuple[xarray.Dataset, xarray.Dataset]:
    """An hour of a machine that its seed draws: what was true, and what its drive reported.

    Args:
        unit: by its data sheet.
        kind: "loader" or "steady".
        seed: the same one gives the same hour.
    """
    random = np.random.default_rng([seed, sorted(LOADS).index(unit.name), kind == "loader"])
    built = drawn_machine(random)
    run = simulate(built.apply(unit), _duty(unit, kind, float(random.uniform(298.15, 328.15)), seed))
    return run, reported(run, unit, seed, random)


def _duty(unit: DdhUnit, kind: str, warmth: float, seed: int) -> Duty:
    """An hour's work, at an oil temperature [K]."""
    if kind == "loader":
        return loader_work(unit, f"loader-{unit.name}", warmth, duration=HOUR, seed=seed)
    return work_day(unit, LOADS[unit.name], warmth, duration=HOUR, seed=seed)


def visits(run: xarray.Dataset, stroke: float) -> list[tuple[float, float, float]]:
    """Visits to ends that are pressed to a relief valve's setting.

    Returns:
        Of each: when it begins and ends, and when the setting is reached [s].
    """
    time, position = run["time"].values, run["position"].values
    opens = passes_relief(run) & (np.abs(run["motor_speed"].values) > _STARTS)
    near = np.minimum(position, stroke - position) < AT_END * stroke
    found = []
    for first, after in true_intervals(near):
        long = [
            (a, b) for a, b in true_intervals(opens[first:after]) if time[first + b - 1] - time[first + a] >= PRESSED
        ]
        if long:
            found.append((float(time[first]), float(time[after - 1]), float(time[first + long[0][0]])))
    return found


def judge(found: Found, run: xarray.Dataset, measured: list[Innovation], stroke: float) -> None:
    """Add an hour."""
    time, position = run["time"].values, run["position"].values
    found.hours += float(time[-1] - time[0]) / HOUR
    taken = [one for one in measured if one.accepted]
    for one in measured:
        true = position[np.searchsorted(time, one.time)]
        if min(true, stroke - true) > AT_END * stroke:
            found.false += one.accepted
            found.refused += not one.accepted
    for begins, ends, reached in visits(run, stroke):
        found.pressed += 1
        first = next((one.time for one in taken if begins <= one.time <= ends + 1.0), None)
        if first is not None:
            found.delays.append(max(first - reached, 0.0))


def runs() -> int:
    """How many hours there are."""
    return len(KINDS) * len(LOADS) * HOURS


def study(advance: Callable[[int], object]) -> dict[str, dict[str, float]]:
    """Figures by unit and kind of work."""
    done = {}
    for name, unit in data_sheets().items():
        tracer = Tracer.of(unit)
        for kind in KINDS:
            found = Found()
            for seed in range(HOURS):
                run, log = worked(unit, kind, seed)
                tracer.sensor.start(None)
                begun = np.array(list(tracer.sensor.state.values()))
                gone = Forward.through(tracer, log_inputs(tracer.sensor, log), log["time"].values, begun, (), silent)
                judge(found, run, gone.innovations.measured, unit.cylinder.stroke)
                advance(1)
            done[f"{name}, {kind}"] = found.figures()
    return done


def table(found: dict[str, Any]) -> list[str]:
    """A unit and a kind of work a row."""
    rows = ["| work | hours | false contacts | ends pressed | found | after, median, 95 % [s] |", "|---" * 6 + "|"]
    for name, row in found.items():
        ends = "| – | – | – |"
        if "ends_pressed" in row:
            after = f"{row['delay_median_s']:.2f}, {row['delay_p95_s']:.2f}"
            ends = f"| {row['ends_pressed']} | {100 * row['ends_found']:.1f} % | {after} |"
        rows.append(f"| {name} | {row['hours']:.0f} | {row['false_contacts']} {ends}")
    return rows
