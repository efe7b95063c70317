"""A part of your own in a circuit: a throttle that leaks from the boom's held chamber to the tank.

A part is a frozen dataclass with a name and a `connect`. Its float fields become parameters of the model, the rest
shapes it. Run it with: python examples/own_part.py
"""

from dataclasses import dataclass, replace

from ramsight import machine
from ramsight.duty import lift_lower, simulate
from ramsight.plant.build import build
from ramsight.plant.circuit import TANK, Circuit


@dataclass(frozen=True)
class Throttle:
    """A laminar leak from a node to the tank."""

    name: str
    node: str
    conductance: float  # m3/s/Pa

    def connect(self, circuit: Circuit) -> None:
        """Add the flow, and where its power goes."""
        difference = circuit.pressure(self.node) - circuit.pressure(TANK)
        flow = self.conductance * difference
        circuit.flow(self.name, self.node, TANK, flow)
        circuit.loss(f"{self.name}.throttling", flow * difference)


boom = build("boom", machine.load("mining-loader").unit("boom"))
leaking = replace(boom, extra=(Throttle("scratch", "chamber_a", 1e-12),))
duty = lift_lower(boom, load=300e3, oil_temperature=313.15)
sound, scratched = simulate(boom, duty), simulate(leaking, duty)

lost = 1e3 * float(sound["position"][-1] - scratched["position"][-1])
residual = scratched.attrs["energy_residual"]
print(f"the scratch lets the boom sink {lost:.1f} mm in a cycle; energy closes to {100 * abs(residual):.1e} %")
print(f"it turns {scratched.attrs['energy.scratch.throttling']:.0f} J into heat")
