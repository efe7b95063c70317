"""What a simulated run has, with units: names and words: numbers alone, and to be made a Dataset."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ramsight.arrays import Array
from ramsight.duty.profile import Profile
from ramsight.engine.equation import OdeModel
from ramsight.plant.drive import Supply
from ramsight.signals import Dataset, Signals
from ramsight.signals import Signal as Column


@dataclass(frozen=True)
class Signal:
    """One signal."""

    values: Array  # shape (samples,)
    units: str
    long_name: str


@dataclass(frozen=True)
class Recorded:
    """A run.

    Example:
        >>> run = Recorded({"time": Signal(np.array([0.0, 0.1]), "s", "time")}, {"unit": "boom"})
        >>> run["time"].values.tolist(), run.dataset().sizes["time"]
        ([0.0, 0.1], 2)
    """

    signals: Mapping[str, Signal]  # by their names, `time` [s] first
    attrs: Mapping[str, Any]

    def __getitem__(self, name: str) -> Signal:
        """The signal of that name."""
        return self.signals[name]

    def columns(self) -> Signals:
        """As columns over `time`."""
        return Signals(
            {
                name: Column(one.values, {"units": one.units, "long_name": one.long_name})
                for name, one in self.signals.items()
            },
            self.attrs,
        )

    def dataset(self) -> Dataset:
        """As a Dataset over `time`; xarray takes a third of a second to be imported."""
        from ramsight.output.notebook import ShownDataset

        return ShownDataset.of(self.columns().dataset())


_FOR_THE_AUDIT = ("capacity_", "stored.")  # outputs that nothing else reads


@dataclass(frozen=True)
class Owner:
    """Whose signals they are.

    Example:
        >>> Owner("boom").column("pressure_a"), Owner("boom").symbol("pressure_a"), Owner().column("pressure_a")
        ('boom_pressure_a', 'boom.pressure_a', 'pressure_a')
    """

    name: str = ""  # of the unit, before every one of its names; empty where it is alone

    def column(self, short: str) -> str:
        """The name of a signal."""
        return f"{self.name}_{short}" if self.name else short

    def symbol(self, short: str) -> str:
        """The name of a state, an output or an attribute."""
        return f"{self.name}.{short}" if self.name else short

    def words(self, text: str) -> str:
        """What a signal is, with the name of its unit before it."""
        return f"{self.name}: {text}" if self.name else text

    def drive(self, ode: OdeModel, state: Array, time: Array, speed: Profile, kelvin: Profile) -> dict[str, Signal]:
        """Motor speed and oil temperature; a servo's speed is its own state, the duty's is its reference."""
        servo = self.symbol("motor_speed")
        own = any(known.name == servo for known in ode.states)
        turned = state[:, ode.state_index(servo)] if own else speed(time)
        return {
            self.column("motor_speed"): Signal(turned, "rad/s", self.words("motor speed, positive extends")),
            self.column("oil_temperature"): Signal(kelvin(time), "K", self.words("oil temperature")),
        }

    def pressures(self, ode: OdeModel, state: Array, nodes: Iterable[str]) -> dict[str, Signal]:
        """The pressure of every node."""
        found = {}
        for node in nodes:
            short = node.replace("chamber", "pressure") if node.startswith("chamber") else f"pressure_{node}"
            values = np.maximum(state[:, ode.state_index(self.symbol(f"pressure_{node}"))], 0.0)  # else it is torn
            found[self.column(short)] = Signal(values, "Pa", self.words(f"absolute pressure of {node}"))
        return found

    def electrical(self, supply: Supply | None, attributes: Mapping[str, Any]) -> dict[str, Any]:
        """Energy that a battery gave and took [J], of that at the shaft among a run's attributes."""
        if supply is None:
            return {}
        given, taken = (attributes[self.symbol(f"energy.shaft_{way}")] for way in ("given", "taken"))
        names = (self.symbol(f"electrical_energy_{way}") for way in ("given", "recovered"))
        return dict(zip(names, supply.electrical(given, taken), strict=True))


def computed(ode: OdeModel, values: Mapping[str, Array], units: Iterable[str] = ()) -> dict[str, Signal]:
    """What an equation computes beside its states, without what only the audit reads.

    Args:
        values: of each output, shape (samples,).
    """
    found = {}
    owners = {name: Owner(name) for name in units}
    for output in ode.outputs:
        first, _, rest = output.name.partition(".")
        owner, short = (owners[first], rest) if first in owners else (Owner(), output.name)
        if not short.startswith(_FOR_THE_AUDIT):
            text = owner.words(short.replace("_", " ").replace(".", " "))
            found[output.name.replace(".", "_")] = Signal(values[output.name], output.unit, text)
    return found
