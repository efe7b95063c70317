"""What the heat of a unit's losses is kept in, and how it leaves."""

from __future__ import annotations

from typing import Annotated

from ramsight.machine.base import Part
from ramsight.machine.declare import quantity


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
    ] = 37e3
    case_to_air: Annotated[float, quantity("W/K", "from the cases to the air", least="0 W/K", most="1e4 W/K")] = 3.0
    tank_to_air: Annotated[float, quantity("W/K", "from the tank to the air", least="0 W/K", most="1e5 W/K")] = 15.0
