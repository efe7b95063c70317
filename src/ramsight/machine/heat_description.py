"""What the heat of a unit's losses is kept in, and how it leaves."""

from __future__ import annotations

from typing import Annotated

from ramsight.machine.base import Part
from ramsight.machine.declare import quantity

#: what a unit of some kW has where nobody says more: a tank of 20 l and 10 kg of steel [J/K], 0.3 m2 of cases and 1 m2
#: of tank at 10 and 15 W/m2/K [W/K]
TANK, CASE_TO_AIR, TANK_TO_AIR = 37e3, 3.0, 15.0


class Heat(Part):
    """Heat stores: the pumps' cases, which leakage and friction of the pumps warm, and the tank."""

    case: Annotated[
        float,
        quantity("kJ/K", "heat capacity of the pumps' cases with their oil", least="0.05 kJ/K", most="1000 kJ/K"),
    ]
    case_to_tank: Annotated[
        float,
        quantity("W/K", "from cases to tank, by the oil that passes the pumps", least="1 W/K", most="1e5 W/K"),
    ]
    tank: Annotated[
        float, quantity("kJ/K", "heat capacity of the tank with its oil", least="0.1 kJ/K", most="1e5 kJ/K")
    ] = TANK
    case_to_air: Annotated[float, quantity("W/K", "from the cases to the air", least="0 W/K", most="1e4 W/K")] = (
        CASE_TO_AIR
    )
    tank_to_air: Annotated[float, quantity("W/K", "from the tank to the air", least="0 W/K", most="1e5 W/K")] = (
        TANK_TO_AIR
    )
