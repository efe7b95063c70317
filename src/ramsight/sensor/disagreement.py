"""Two reports of one thing: by how much they are apart lately, and by how much they may be without a fault.

What should be equal is summed up over the last second or so, and so is what may keep it apart:

    d' = d e^(-h/T) + (a - b) h,      |d| <= k sqrt(Q + S^2) + delay |y - mean y|

with Q the variance of noise and of what a sample does not see, S the sum of standard deviations that stay what they are
(gains, losses), and y the level that both follow. Of two reports of y that are `delay` apart the sums differ by
(delay)(y - mean y), whatever y does, for both are linear in y.
"""

from __future__ import annotations

from dataclasses import dataclass
from statistics import NormalDist
from typing import Any

import casadi as ca

from ramsight.sensor.virtual_sensor import SensorGraph

MEMORY = 1.0  # s; T: a speed that is off by 0.1 % of 2000 rpm is 0.2 rad off by then, which is seen
FALSE_ALARMS = 1.0 / (1000.0 * 3600.0)  # 1/s; one in a thousand hours
SURE = -NormalDist().inv_cdf(0.5 * FALSE_ALARMS * MEMORY)  # k; sums are independent about every T
_OVER = 0.5  # share of the bound below which an alarm is over


@dataclass(frozen=True)
class Apart:
    """How far two reports are apart.

    Attributes:
        by: the sum of their difference [unit of the level times s].
        allowed: what it may be.
        late: how much of that is by delays.
        alarm: whether it is more, and since then has not become half of it.
        onset: whether it is so for the first time.
    """

    by: Any
    allowed: Any
    late: Any
    alarm: Any
    onset: Any


def apart(
    graph: SensorGraph,
    name: str,
    difference: Any,
    *,
    level: Any,
    delay: float,
    lasting: Any,
    noise: Any = 0.0,
) -> Apart:
    """Follow two reports of one level.

    Args:
        graph: gains states.
        name: of the pair; its states begin with it.
        difference: of the reports at this sample, 0 where one is missing.
        level: that both follow, by one of them.
        delay: by which they may be apart in time [s].
        lasting: standard deviation of the difference that lasts [unit of the level].
        noise: standard deviation of it that is new with each sample.
    """
    h = graph.elapsed
    kept = ca.exp(-h / MEMORY)
    by, mean = graph.state(f"{name}_apart"), graph.state(f"{name}_mean")
    variance, lasts, last = (graph.state(f"{name}_{what}") for what in ("variance", "lasts", "level"))
    alarmed = graph.state(f"{name}_alarm")
    by_1 = kept * by + difference * h
    mean_1 = ca.if_else(graph.held("started"), level + kept * (mean - level), level)
    # Between two samples nobody knows when the level changed.
    unseen = ca.if_else(h > 0.0, 0.5 * h * (level - last), 0.0)
    variance_1 = kept**2 * variance + unseen**2 + (noise * h) ** 2
    lasts_1 = kept * lasts + lasting * h
    late = delay * ca.fabs(level - mean_1)
    allowed = SURE * ca.sqrt(variance_1 + lasts_1**2) + late
    size = ca.fabs(by_1)
    alarm = size > ca.if_else(alarmed, _OVER * allowed, allowed)
    values = {"apart": by_1, "mean": mean_1, "variance": variance_1, "lasts": lasts_1, "level": level, "alarm": alarm}
    for what, value in values.items():
        graph.becomes(f"{name}_{what}", value)
    return Apart(by_1, allowed, late, alarm, ca.logic_and(alarm, ca.logic_not(alarmed)))


def lately(graph: SensorGraph, name: str, rate: Any) -> Any:
    """A rate summed up over the same time [its unit times s]."""
    before = graph.state(name)
    now = ca.exp(-graph.elapsed / MEMORY) * before + rate * graph.elapsed
    graph.becomes(name, now)
    return now
