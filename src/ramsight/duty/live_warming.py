"""The oil of a unit that runs: what is lost in it warms it, the air cools it, as in `warming`, step by step."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from ramsight.plant.circuit import WARMING
from ramsight.plant.heat import HeatStores, case_losses, shared_out
from ramsight.plant.unit import HydraulicUnit


class LiveWarming:
    """Temperatures of a unit's pumps and tank.

    Args:
        unit: the unit; its oil's data state between which temperatures the stores are kept.
        first: temperature of both at the beginning [K].
        stores: of heat; by default those of its description, or of a unit of some kW where it has none.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build
        >>> oil = LiveWarming(build(machine.load_machine("press").unit("ram"), "ram"), 313.15)
        >>> for k in range(600):
        ...     oil.go_on(0.1, {"pump_a.leakage": 100.0 * k}, ambient=293.15)
        >>> round(oil.pumps - 273.15, 1), round(oil.tank - 273.15, 1)
        (43.5, 40.6)
    """

    def __init__(self, unit: HydraulicUnit, first: float, stores: HeatStores | None = None) -> None:
        self._of_pumps, self._heat = case_losses(unit.parts()), stores or unit.heat or HeatStores()
        self._limits = unit.oil.temperatures
        self._stores = np.full(2, first)
        self._entered = np.zeros(2)

    @property
    def pumps(self) -> float:
        """Temperature of the oil in the pumps' gaps, by which the unit runs [K]."""
        return float(self._stores[0])

    @property
    def tank(self) -> float:
        """Temperature of the oil in the tank, which a thermometer sees [K]."""
        return float(self._stores[1])

    def followed(self, before: float, passed: float, known: Collection[str], prefix: str = "") -> dict[str, float]:
        """Parameters of a live equation that follow the oil, in SI by name.

        Args:
            before: temperature of the oil in the pumps a while ago [K].
            passed: since then [s].
            known: names of the equation's parameters; not each has a rate of warming.
            prefix: of the unit's, with its point; "" for a unit alone.
        """
        values = {f"{prefix}oil_temperature": self.pumps}
        if (rate := f"{prefix}{WARMING}") in known:
            values[rate] = (self.pumps - before) / passed
        return values

    def begin_account(self) -> None:
        """The account of losses begins again."""
        self._entered = np.zeros(2)

    def go_on(self, dt: float, losses: Mapping[str, float], ambient: float) -> None:
        """Let a time pass in which losses warm the oil and the air cools it.

        Args:
            dt: time [s].
            losses: energies since the account began, by the circuit's names [J].
            ambient: temperature of the air [K].
        """
        self._keep(self._heat.after(self._stores, dt, self._enter(losses), ambient))

    def bring(self, dt: float, losses: Mapping[str, float], aim: float, rate: float) -> bool:
        """Let a time pass in which a heater or a cooler brings all oil towards a temperature, whatever is lost in it.

        Args:
            dt: time [s].
            aim: the temperature [K].
            rate: at most [K/s].

        Returns:
            Whether it is there.
        """
        self._enter(losses)
        self._keep(self._stores + np.clip(aim - self._stores, -rate * dt, rate * dt))
        return bool(np.all(self._stores == aim))

    def _enter(self, losses: Mapping[str, float]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        """Heat into both stores since the last call [J]."""
        now = np.array(shared_out(self._of_pumps, losses), dtype=np.float64)
        entered, self._entered = now - self._entered, now
        return entered

    def _keep(self, stores: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> None:
        self._stores = np.clip(stores, *self._limits)
