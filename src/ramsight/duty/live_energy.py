"""Where the energy of a machine goes while it runs: the terms of `audit`, from sample to sample.

Losses, works and what the shaft gave and took are the same integrals. What is stored in compressed oil is summed up
over samples instead of the integrator's steps, so that the balance closes a little less well than an audit's.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ramsight.plant.circuit import Audited

_LOADS = ("load", "rods")  # works that a load does or has done to it


@dataclass
class EnergyAccount:
    """Energies since the account began [J]."""

    given: float = 0.0
    taken: float = 0.0  # back by the motor
    lifted: float = 0.0  # work done on the load
    lowered: float = 0.0  # work that the load did
    losses: dict[str, float] = field(default_factory=dict)  # by the circuit's names, `pump_a.leakage`
    # all other works, net, by name; `tank` is what went back to it
    works: dict[str, float] = field(default_factory=dict)
    stored: dict[str, float] = field(default_factory=dict)  # net, by name

    @property
    def missing(self) -> float:
        """What came in and is in none of the entries [J]."""
        gone = sum(self.losses.values()) + sum(self.works.values()) + sum(self.stored.values())
        return self.given - self.taken + self.lowered - self.lifted - gone


class LiveEnergy:
    """The energy account of one circuit.

    Args:
        inside: all that its equation knows at first, by name, integrals too, in SI.
        tank_pressure: [Pa].
    """

    def __init__(self, audited: Audited, inside: Mapping[str, float], tank_pressure: float) -> None:
        self._audited = audited.names
        self._tank_pressure, self._last = tank_pressure, dict(inside)
        self.account = EnergyAccount()

    def enter(self, inside: Mapping[str, float]) -> None:
        """Enter what happened since the last sample."""
        last, account, audited = self._last, self.account, self._audited

        def grown(name: str) -> float:
            return inside[name] - last[name]

        account.given += grown("energy.shaft_given")
        account.taken += grown("energy.shaft_taken")
        for name in audited.losses:
            account.losses[name] = account.losses.get(name, 0.0) + grown(f"energy.{name}")
        for name in audited.works:
            done = grown(f"energy.{name}")
            if name in _LOADS:
                account.lifted += max(done, 0.0)
                account.lowered += max(-done, 0.0)
            else:
                account.works[name] = account.works.get(name, 0.0) + done
        drawn = sum(grown(f"volume.{name}") for name in audited.tank_flows)
        account.works["tank"] = account.works.get("tank", 0.0) - self._tank_pressure * drawn
        self._store(inside)
        self._last = dict(inside)

    def _store(self, inside: Mapping[str, float]) -> None:
        stored, last = self.account.stored, self._last
        for name in inside:
            if name.startswith("stored."):
                short = name.removeprefix("stored.")
                stored[short] = stored.get(short, 0.0) + inside[name] - last[name]
        compressed = 0.0
        for node in self._audited.nodes:
            capacity = 0.5 * (inside[f"capacity_{node}"] + last[f"capacity_{node}"])
            now, before = (max(of[f"pressure_{node}"], 0.0) for of in (inside, last))
            compressed += capacity * 0.5 * (now**2 - before**2)
        stored["compression"] = stored.get("compression", 0.0) + compressed
