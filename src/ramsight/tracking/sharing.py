"""Two units of one machine share oil and battery: what their drives report of it, held against each other.

Each thermometer is in the same oil, and each DC link is on the same battery:

    T_1 = T_2,      U_1 = U_2

each summed up and bounded as reports of one drive are (`disagreement`), within what is declared of noise, of what lasts
and of delays. Of two that are apart nothing here shows which is wrong; each drive's own checks (`drive_check`) may.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

import casadi as ca
import numpy as np

from ramsight.arrays import Array
from ramsight.engine.recursion import Graph, Recursion, replay
from ramsight.engine.typed_state import column, leaf, leaves, symbols
from ramsight.expression import Flag, Scalar, all_of, any_of, scalar_symbol
from ramsight.sensor.checks.disagreement import Sums, summed
from ramsight.sensor.thresholds import MEASURABLE_LIMIT

_INPUTS = ("time", "one", "other")
_SET = ("noise", "offset", "gain", "delay")
_OUTPUTS = ("apart", "allowed", "alarm")


@dataclass(frozen=True)
class Allowed:
    """By how much two reports of one thing may differ without a fault, both together."""

    noise: float  # standard deviation of the difference that is new with each sample [unit of the quantity]
    offset: float = 0.0  # standard deviation of it that lasts [unit of the quantity]
    gain: float = 0.0  # the same as a share of the quantity [1]
    delay: float = 0.0  # by which they may be apart in time [s]


@dataclass(frozen=True)
class Shared:
    """Something that two units share, and what is looked at: a row of the table."""

    name: str  # of the quantity
    unit: str  # of it
    signals: str  # that are compared
    hypothesis: str  # that it rejects, with its equation
    memory: float  # over which is summed up [s]
    allowed: Allowed  # what is allowed unless more is declared
    then: str = "–"  # what is done beside saying so


# Thermometers of class B are right to 0.5 K at 40 degC (IEC 60751), and a pump that works has its oil up to 6 K warmer
# than the tank (docs/reference/real-machines.md). That inverters measure voltage to 1 % is a guess.
OIL = Shared(
    "oil_temperature", "K", "both thermometers", "both are in the same oil, Σ(T₁ − T₂)h = 0", 60.0,
    Allowed(noise=0.3, offset=3.0), "a temperature that is missing is the other unit's",
)  # fmt: skip
VOLTAGE = Shared(
    "dc_voltage", "V", "both DC links", "both are on one battery, Σ(U₁ − U₂)h = 0", 1.0,
    Allowed(noise=0.5, gain=0.014, delay=0.02),
)  # fmt: skip
SHARED = (OIL, VOLTAGE)
"""All that is looked at."""


@dataclass(frozen=True, kw_only=True)
class AgreementState:
    """What is kept of two reports of one thing."""

    begun: Flag = leaf("1")  # whether both have reported once
    time: Scalar = leaf("s", exact="time")  # of the last sample [s]
    sums: Sums = field(default_factory=Sums)


@lru_cache(maxsize=len(SHARED))
def agreement_graph(memory: float) -> Recursion:
    """One sample of two reports of one thing; a sample in which one is missing adds nothing.

    Args:
        memory: over which is summed [s].
    """
    u = {name: scalar_symbol(name) for name in _INPUTS}
    p = {name: scalar_symbol(name) for name in _SET}
    state = symbols(AgreementState())
    both = all_of(ca.fabs(u["one"]) < MEASURABLE_LIMIT, ca.fabs(u["other"]) < MEASURABLE_LIMIT)
    elapsed = ca.if_else(state.begun, ca.fmax(u["time"] - state.time, 0.0), 0.0)
    level = ca.if_else(both, u["one"], state.sums.level)
    lasting = ca.if_else(both, ca.sqrt(p["offset"] ** 2 + (p["gain"] * level) ** 2), 0.0)
    sums, found = summed(
        state.sums,
        ca.if_else(both, u["one"] - u["other"], 0.0),
        started=state.begun,
        elapsed=elapsed,
        level=level,
        delay=p["delay"],
        lasting=lasting,
        noise=ca.if_else(both, p["noise"], 0.0),
        memory=memory,
    )
    after = AgreementState(begun=any_of(state.begun, both), time=ca.fmax(u["time"], state.time), sums=sums)
    names = tuple(one.name for one in leaves(state))
    columns = column(state), ca.vertcat(*u.values()), ca.vertcat(*p.values())
    outputs = ca.vertcat(found.by, found.allowed, found.alarm)
    return Recursion(names, _INPUTS, _SET, _OUTPUTS, lambda: Graph(*columns, column(after), outputs))


class Agreement:
    """Whether two reports of something that is shared agree, sample by sample or over a log.

    Args:
        shared: what is shared.
        allowed: by how much they may differ; as it is usual without.

    Example:
        >>> warm = Agreement(OIL)
        >>> [warm.step(float(t), 313.0, 315.0) for t in range(3)]
        [False, False, False]
        >>> [warm.step(float(t), 313.0, 393.0) for t in range(3, 6)]
        [True, True, True]
    """

    def __init__(self, shared: Shared, allowed: Allowed | None = None) -> None:
        of = allowed or shared.allowed
        self._graph = agreement_graph(shared.memory)
        self._set = np.array([of.noise, of.offset, of.gain, of.delay])
        self._kept = np.zeros(len(self._graph.state))

    def step(self, time: float, one: float, other: float) -> bool:
        """One sample; whether they contradict each other.

        Args:
            time: [s], increasing.
            one: by one report [unit of the quantity]; NaN where it reports nothing.
            other: by the other one [unit of the quantity].
        """
        return bool(self.replay(np.array([[time, one, other]]))[0, 2])

    def replay(self, rows: Array) -> Array:
        """A log: sum of the difference and what it may be [unit of the quantity times s], and whether that is an alarm.

        Args:
            rows: time [s] and both reports, shape (samples, 3).
        """
        return replay(self._graph, np.ascontiguousarray(rows), self._set, self._kept)
