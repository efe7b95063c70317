"""How much warmer the oil in the pumps' gaps is than a thermometer in the tank says, by what the pumps lose.

    C_c dD/dt = P - G_ct D - C_c dT_t/dt,    D = T_c - T_t

P is what leakage and friction of the pumps turn into heat, by the balance of the sample; capacity and conductance are
those of the description (`ramsight.plant.heat`). What the cases lose to the air is left out: a hundredth of what the
oil carries away, and nobody says how warm the air is. Solved implicitly, so that a long sample ends where it settles.
"""

from __future__ import annotations

from typing import Any

import casadi as ca

from ramsight.plant.heat import HeatStores
from ramsight.sensor.virtual_sensor import SensorGraph

_MOST = 60.0  # K; a case that is further from its tank burns its oil, and no fault of an input leads beyond it
_STATE = "case_warmer"


class CaseHeat:
    """The pumps' cases as a heat store.

    Args:
        graph: gains states, and its `pump_temperature` is then that of the cases.
        stores: of the unit.
    """

    def __init__(self, graph: SensorGraph, stores: HeatStores) -> None:
        add = graph.parameters.add
        self._graph = graph
        self._case, self._to_tank = add("heat.case", stores.case), add("heat.case_to_tank", stores.case_to_tank)
        self._warmer, self._tank = graph.state(_STATE), graph.state("tank_temperature")
        graph.warmer = self._warmer

    def after(self, heat: Any, passed: Any) -> None:
        """Go on with the sample.

        Args:
            heat: into the cases [W].
            passed: time since the last sample, gaps that are not counted among it [s].
        """
        graph, tank = self._graph, self._graph.oil_temperature
        risen = ca.if_else(self._tank > 0.0, tank - self._tank, 0.0)
        stored = self._warmer - risen + graph.elapsed * heat / self._case
        warmer = stored / (1.0 + ca.fmax(passed, graph.elapsed) * self._to_tank / self._case)
        graph.becomes(_STATE, ca.fmin(ca.fmax(warmer, -_MOST), _MOST))
        graph.becomes("tank_temperature", tank)
