"""The description of valves."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar

from ramsight.machine.base import Part
from ramsight.machine.declare import Model, quantity

#: what passes a closed valve: of data sheets of poppets 5 drops a minute, 0.3 ml/min; of a worn one 2 to 10 ml/min
ClosedLeakage = Annotated[
    float, quantity("ml/min", "past the closed valve at 250 bar, 46 mm2/s; 0 for none", least=0, most=10000)
]
RatedFlow = Annotated[float, quantity("l/min", "flow at which rated_pressure_drop is stated", least=0.001, most=10000)]
OpenDrop = Annotated[float, quantity("bar", "pressure drop of the open valve at rated_flow", least=0.001, most=100)]


class ReliefValve(Part):
    """Relief valves, one per side, from manifold to tank."""

    family: ClassVar[str] = "relief valve"

    model: Model = None
    setting: Annotated[float, quantity("bar", "opening pressure above the tank's", least=1, most=1000)]
    rated_flow: Annotated[
        float, quantity("l/min", "flow at which override_pressure is stated", least=0.001, most=10000)
    ]
    override_pressure: Annotated[float, quantity("bar", "rise above the setting at rated_flow", least=0.001, most=200)]
    closed_leakage: ClosedLeakage = 0.0
    pilot_leakage: Annotated[
        float, quantity("l/min", "of the pilot at the setting and beyond; 0 for none", least=0, most=100)
    ] = 0.0
    # Where the pilot's cone begins to leave its seat; direct acting valves have none.
    pilot_opens: Annotated[
        float, quantity("%", "share of the setting from which the pilot leaks", above=10, below=100)
    ] = 0.85
    reseats: Annotated[
        float, quantity("%", "share of the setting where it shuts again; 100 % for none", above=10, most=100)
    ] = 1.0


class AnticavitationValve(Part):
    """Check valves, one per side, from tank to manifold."""

    family: ClassVar[str] = "anticavitation valve"

    model: Model = None
    cracking_pressure: Annotated[float, quantity("bar", "pressure difference at which it opens", least=0, most=20)]
    rated_flow: RatedFlow
    rated_pressure_drop: OpenDrop
    closed_leakage: ClosedLeakage = 0.0

    @property
    def flow_coefficient(self) -> float:
        """Q/sqrt(dp) of the open valve [m3/s/sqrt(Pa)]."""
        return self.rated_flow / math.sqrt(self.rated_pressure_drop)


class SafetyValve(Part):
    """Safety valves between manifold and hose; the load side's is a check while lifting, open to lower."""

    family: ClassVar[str] = "safety valve"

    model: Model = None
    rated_flow: RatedFlow
    rated_pressure_drop: OpenDrop
    opening_speed: Annotated[
        float,
        quantity("rad/s", "motor speed in the lowering direction above which it is held open", least=0.001, most=100),
    ]
    opening_time: Annotated[
        float, quantity("ms", "until it is 95 % open or shut, first order; 0 for at once", least=0, most="10 s")
    ] = 0.0
    closed_leakage: ClosedLeakage = 0.0

    @property
    def flow_coefficient(self) -> float:
        """Q/sqrt(dp) of the open valve [m3/s/sqrt(Pa)]."""
        return self.rated_flow / math.sqrt(self.rated_pressure_drop)
