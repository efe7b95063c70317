"""Whether the reservoir of a closed circuit gives and takes the oil that the rod's motion asks for."""

from __future__ import annotations

from ramsight.errors import DescriptionError
from ramsight.plant.accumulator import Accumulator, oil_volume
from ramsight.plant.circuit import TANK
from ramsight.plant.unit import HydraulicUnit


def check_reservoir(unit: HydraulicUnit, file: str | None = None) -> None:
    """Reject gas volumes and precharges with which oil tears, or has no room, somewhere on the stroke.

    At rest the gas has the circuit's pressure, wherever the rod is: V_0 (p_0/p_T)^(1/n) of gas, the rest is oil. Over
    the stroke the rod asks for |A_A - A_B| s of oil, or gives it back. Circuits that draw from a tank are not looked
    at, as an accumulator serves another purpose there.

    Args:
        unit: the unit.
        file: that describes it, for messages.

    Raises:
        DescriptionError: the oil in the reservoirs is less than that volume, or the gas is; the text names key, value
            and range.
    """
    reservoirs = [part for part in unit.parts() if isinstance(part, Accumulator)]
    if not reservoirs or _draws_from_tank(unit):
        return
    cylinder, rest = unit.cylinder, unit.tank_pressure
    rod = abs(cylinder.area_a - cylinder.area_b) * cylinder.stroke
    largest = max(reservoirs, key=lambda part: part.volume)
    where = f"units.{unit.name}.parts.{largest.name}"
    if largest.precharge >= rest:
        raise DescriptionError(
            f"with a gas as strong as the circuit's pressure at rest, {rest / 1e5:g} bar, no oil is in it",
            file=file,
            key=f"{where}.precharge",
            value=f"{largest.precharge / 1e5:g} bar",
            allowed=f"less than {rest / 1e5:g} bar",
        )
    oil = sum(float(oil_volume(rest, one.volume, one.precharge, one.polytropic)) for one in reservoirs)
    gas = sum(one.volume for one in reservoirs) - oil
    if min(oil, gas) < rod:
        share = float(oil_volume(rest, 1.0, largest.precharge, largest.polytropic))
        missing = max((rod - oil) / share, (rod - gas) / (1.0 - share))
        held = f"{1e3 * oil:.3g} l of oil and {1e3 * gas:.3g} l of gas"
        enough = 1.005 * (largest.volume + missing)  # rounded to three digits below
        raise DescriptionError(
            f"at {rest / 1e5:g} bar it has {held}; over its stroke the rod takes or gives {1e3 * rod:.3g} l",
            file=file,
            key=f"{where}.gas_volume",
            value=f"{1e3 * largest.volume:g} l",
            allowed=f"at least {1e3 * enough:.3g} l at a precharge of {largest.precharge / 1e5:g} bar",
        )


def _draws_from_tank(unit: HydraulicUnit) -> bool:
    return any(value == TANK for part in unit.parts() for value in vars(part).values() if isinstance(value, str))
