"""Parts with the nodes they join: what a circuit is made of when its description gives it in full."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Discriminator, Field, Tag

from ramsight.machine.base import Part
from ramsight.machine.declare import quantity
from ramsight.machine.parts import AnticavitationValve, Hose, Manifold, Pump, RatedFlow, ReliefValve, SafetyValve

Node = Annotated[
    str, Field(description="node: tank, chamber_a, chamber_b or any name", pattern=r"^[a-z][a-z0-9_]*$", max_length=40)
]


class PlacedPump(Pump):
    """Pump-motor with its belt; positive motor speed moves oil from inlet to outlet."""

    kind: Annotated[Literal["pump"], Field(description="kind of part")]
    inlet: Node
    outlet: Node


class PlacedRelief(ReliefValve):
    """Relief valve; opens from inlet to outlet at its setting above the outlet's pressure."""

    kind: Annotated[Literal["relief valve"], Field(description="kind of part")]
    inlet: Node
    outlet: Node


class PlacedCheck(AnticavitationValve):
    """Check valve, from inlet to outlet."""

    kind: Annotated[Literal["check valve"], Field(description="kind of part")]
    inlet: Node
    outlet: Node


class PlacedPilotCheck(AnticavitationValve):
    """Check valve from inlet to outlet that a pilot pressure opens backwards."""

    kind: Annotated[Literal["pilot check valve"], Field(description="kind of part")]
    inlet: Node
    outlet: Node
    pilot: Node
    pilot_ratio: Annotated[float, quantity("1", "area of the pilot piston over that of the seat", above=0.1, most=100)]


class PlacedSafety(SafetyValve):
    """Seat valve; free from inlet to outlet, opened the other way by the motor's speed."""

    kind: Annotated[Literal["safety valve"], Field(description="kind of part")]
    inlet: Annotated[Node, Field(description="node on the pump's side")]
    outlet: Annotated[Node, Field(description="node on the cylinder's side")]
    opens: Annotated[
        Literal["lowering", "always"], Field(description="while the motor lowers, or held open all the time")
    ] = "lowering"


class PlacedHose(Hose):
    """Hose or pipe between two nodes."""

    kind: Annotated[Literal["hose"], Field(description="kind of part")]
    inlet: Node
    outlet: Node


class PlacedVolume(Manifold):
    """Rigid volume of oil at a node."""

    kind: Annotated[Literal["volume"], Field(description="kind of part")]
    node: Node
    volume: Annotated[float, quantity("l", "oil in it", least="1e-4 l", most=1000)]


class PlacedOrifice(Part):
    """Fixed orifice."""

    kind: Annotated[Literal["orifice"], Field(description="kind of part")]
    inlet: Node
    outlet: Node
    rated_flow: RatedFlow
    rated_pressure_drop: Annotated[float, quantity("bar", "pressure drop at rated_flow", least=0.001, most=1000)]

    @property
    def flow_coefficient(self) -> float:
        """Q/sqrt(dp) [m3/s/sqrt(Pa)]."""
        return self.rated_flow / math.sqrt(self.rated_pressure_drop)


class PlacedDirectional(Part):
    """Directional valve with a commanded spool: at 1 the pump feeds port_a, at -1 port_b; the other port returns."""

    kind: Annotated[Literal["directional valve"], Field(description="kind of part")]
    pump_port: Annotated[Node, Field(description="node of the line that feeds it")]
    tank_port: Annotated[Node, Field(description="node that it returns to")]
    port_a: Annotated[Node, Field(description="node that is fed at command 1")]
    port_b: Annotated[Node, Field(description="node that is fed at command -1")]
    rated_flow: RatedFlow
    rated_pressure_drop: Annotated[
        float, quantity("bar", "pressure drop of one open edge at rated_flow", least=0.001, most=100)
    ]
    overlap: Annotated[
        float,
        quantity(
            "1",
            "share of the spool's way where an edge begins to open; negative: open in the middle",
            least=-0.9,
            most=0.9,
        ),
    ] = 0.0
    switching_time: Annotated[
        float,
        quantity("ms", "until the spool has gone 95 % of a step, first order; 0 for at once", least=0, most="10 s"),
    ] = 0.0
    closed_leakage: Annotated[
        float, quantity("ml/min", "past each edge at 250 bar, 46 mm2/s; 0 for none", least=0, most=10000)
    ] = 0.0

    @property
    def flow_coefficient(self) -> float:
        """Q/sqrt(dp) of one open edge [m3/s/sqrt(Pa)]."""
        return self.rated_flow / math.sqrt(self.rated_pressure_drop)


class PlacedLoadSensingPump(PlacedPump):
    """Pump of variable displacement that keeps its outlet by a margin above a sensing line."""

    kind: Annotated[Literal["load-sensing pump"], Field(description="kind of part")]  # type: ignore[assignment]
    load_line: Annotated[Node, Field(description="node of the sensing line that it answers")]
    margin: Annotated[
        float, quantity("bar", "of its outlet over the line, where it delivers nothing", above=1, most=100)
    ]
    cut_off: Annotated[float, quantity("bar", "pressure rise where it delivers nothing", above=1, most=1000)]
    band: Annotated[
        float, quantity("bar", "below these within which it goes to full displacement", least=0.001, most=100)
    ]
    swivel_time: Annotated[float, quantity("ms", "until it has gone 95 % of a step, first order", above=1, most="10 s")]


class PlacedMetering(PlacedDirectional):
    """Proportional directional valve that meters by its opening, and tells a pump the fed port's pressure."""

    kind: Annotated[Literal["metering valve"], Field(description="kind of part")]  # type: ignore[assignment]
    load_line: Annotated[Node, Field(description="node of the sensing line")]
    sensing_flow: Annotated[
        float, quantity("l/min", "through the sensing bore at rated_pressure_drop", least=0.001, most=100)
    ]

    @property
    def sensing_coefficient(self) -> float:
        """Q/sqrt(dp) of the sensing bore [m3/s/sqrt(Pa)]."""
        return self.sensing_flow / math.sqrt(self.rated_pressure_drop)


class PlacedAccumulator(Part):
    """Gas-loaded accumulator, or the reservoir of a closed circuit; at rest it has the tank's pressure."""

    kind: Annotated[Literal["accumulator"], Field(description="kind of part")]
    node: Node
    gas_volume: Annotated[float, quantity("l", "gas at its precharge", least="1e-4 l", most=1000)]
    precharge: Annotated[float, quantity("bar", "absolute gas pressure without oil", above=0.1, most=500)]
    gas_exponent: Annotated[
        float, quantity("1", "polytropic exponent of the gas, 1 slow, 1.4 fast", least=1, most=1.67)
    ] = 1.2

    family: ClassVar[str] = ""


PLACED: tuple[type[Part], ...] = (
    PlacedPump, PlacedLoadSensingPump, PlacedRelief, PlacedCheck, PlacedPilotCheck, PlacedSafety, PlacedHose,
    PlacedVolume, PlacedOrifice, PlacedDirectional, PlacedMetering, PlacedAccumulator,
)  # fmt: skip
KINDS: dict[str, type[Part]] = {part.model_fields["kind"].annotation.__args__[0]: part for part in PLACED}  # type: ignore[union-attr]


def _tag(value: Any) -> str | None:
    kind = value.get("kind") if isinstance(value, dict) else getattr(value, "kind", None)
    return f"@{kind}" if isinstance(kind, str) and kind in KINDS else None


AnyPlaced = Annotated[
    Annotated[PlacedPump, Tag("@pump")]
    | Annotated[PlacedLoadSensingPump, Tag("@load-sensing pump")]
    | Annotated[PlacedRelief, Tag("@relief valve")]
    | Annotated[PlacedCheck, Tag("@check valve")]
    | Annotated[PlacedPilotCheck, Tag("@pilot check valve")]
    | Annotated[PlacedSafety, Tag("@safety valve")]
    | Annotated[PlacedHose, Tag("@hose")]
    | Annotated[PlacedVolume, Tag("@volume")]
    | Annotated[PlacedOrifice, Tag("@orifice")]
    | Annotated[PlacedDirectional, Tag("@directional valve")]
    | Annotated[PlacedMetering, Tag("@metering valve")]
    | Annotated[PlacedAccumulator, Tag("@accumulator")],
    Discriminator(_tag),
]


_PORTS = ("inlet", "outlet", "pilot", "node", "pump_port", "tank_port", "port_a", "port_b", "load_line")


def nodes_of(part: Part) -> tuple[str, ...]:
    """The nodes that a placed part names."""
    return tuple(getattr(part, key) for key in _PORTS if hasattr(part, key))


def has_volume(part: Part) -> bool:
    """Whether a placed part brings oil volume to its nodes."""
    return isinstance(part, PlacedHose | PlacedVolume | PlacedAccumulator)
