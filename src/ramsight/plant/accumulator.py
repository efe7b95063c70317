"""The accumulator: a gas cushion behind a membrane, also the reservoir of a closed circuit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi as ca

from ramsight.expression import Real

if TYPE_CHECKING:
    from ramsight.plant.circuit import Circuit

_EMPTY = 1e-3  # share of the gas volume's give that is left where there is no oil behind the membrane


def gas_capacity(pressure: Real, volume: Real, precharge: Real, polytropic: Real) -> Real:
    """Oil taken up per pressure [m3/Pa]: V_0/(n p) (p_0/p)^(1/n) above the precharge, next to none below it.

    Args:
        pressure: absolute [Pa].
        volume: V_0, of the gas at its precharge [m3].
        precharge: p_0, absolute [Pa].
        polytropic: n, 1 slow to 1.4 fast [1].

    Source: polytropic gas, p V^n = const; H. Murrenhoff, Grundlagen der Fluidtechnik, part 1.

    Example:
        >>> f"{float(gas_capacity(4e5, 1e-3, 2e5, 1.4)):.3e}"
        '1.088e-09'
    """
    p = ca.fmax(pressure, precharge)
    capacity = volume / (polytropic * p) * ca.exp(ca.log(precharge / p) / polytropic)
    return ca.if_else(pressure > precharge, capacity, _EMPTY * capacity)


def oil_volume(pressure: Real, volume: Real, precharge: Real, polytropic: Real) -> Real:
    """Oil in the accumulator [m3] at an absolute pressure above its precharge [Pa]; arguments as `gas_capacity`."""
    p = ca.fmax(pressure, precharge)
    return volume * (1.0 - ca.exp(ca.log(precharge / p) / polytropic))


@dataclass(frozen=True)
class Accumulator:
    """A gas-loaded accumulator at a node."""

    name: str
    node: str  # where it is
    volume: float  # of the gas at its precharge [m3]
    precharge: float  # absolute [Pa]
    polytropic: float  # exponent of the gas [1]
    port: float = 1e-5  # oil that is always in its port [m3]

    def connect(self, circuit: Circuit) -> None:
        """Add the gas's give to its node."""
        p = circuit.pressure(self.node)
        circuit.volume(self.node, self.port)
        circuit.compliance(self.node, gas_capacity(p, self.volume, self.precharge, self.polytropic))
        circuit.output(f"{self.name}.oil", "m3", oil_volume(p, self.volume, self.precharge, self.polytropic))
