"""A part of your own
==================

A scratch in a cylinder's wall leaks from the chamber that holds the load. No part of the catalogue does that, so
here is one. A part is a frozen dataclass with a name and a `connect`; its float fields become parameters of the
model, the rest shapes it.
"""

from dataclasses import dataclass, replace

import matplotlib.pyplot as plt

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


# %%
# The boom of a loader, sound and scratched. The new part is compiled into the equations like any other, and the
# audit of energy closes with it: what the throttle turns into heat is counted under its name.
boom = build(machine.load_machine("mining-loader").unit("boom"), "boom")
leaking = replace(boom, extra=(Throttle("scratch", "chamber_a", 1e-12),))
duty = lift_lower(boom, load=300e3, oil_temperature=313.15)
sound, scratched = simulate(boom, duty), simulate(leaking, duty)

lost = 1e3 * float(sound["position"][-1] - scratched["position"][-1])
residual = scratched.attrs["energy_residual"]
print(f"the scratch lets the boom sink {lost:.1f} mm in a cycle; energy closes to {100 * abs(residual):.1e} %")
print(f"it turns {scratched.attrs['energy.scratch.throttling']:.0f} J into heat")

# %%
# The part is in the sensors as well, because they are made of the same equations: a sensor of `leaking` knows of
# the scratch. One that is made of the sound boom would be wrong by the difference below.
figure, (way, gap) = plt.subplots(2, 1, sharex=True, figsize=(7, 4.5), layout="constrained")
way.plot(sound["time"], 1e3 * sound["position"], label="sound")
way.plot(scratched["time"], 1e3 * scratched["position"], label="scratched")
way.set_ylabel("position [mm]")
way.legend()
gap.plot(sound["time"], 1e3 * (sound["position"] - scratched["position"]))
gap.set(xlabel="time [s]", ylabel="sunk by [mm]")
plt.show()
