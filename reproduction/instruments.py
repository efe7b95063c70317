"""The bench by its parts' names, and what its instruments' accuracy is worth in millimetres of a cycle."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from ramsight import simulate
from ramsight.machine import catalogue
from ramsight.machine.declare import declaration
from ramsight.machine.parts import PARTS
from reproduction.bench import Bench
from reproduction.chapter import Chapter, Grid
from reproduction.limits_state import warmer
from reproduction.words import both, figure

if TYPE_CHECKING:
    import xarray

_BENCH = ("ME1304", "Sevcon-Gen4-Size-6", "Altairnano-96V", "SCPT-CAN", "CANtrans-T", "LINARIX-LM0")
"""Names in the catalogue of what is around the hydraulics, in the paper's order."""


def instruments(benches: dict[str, Bench]) -> Chapter:
    """Parts by name, each value with its source; and errors of the instruments as errors of the position."""
    torque = _value("Sevcon-Gen4-Size-6", "torque_accuracy") * _value("ME1304", "rated_torque")
    kelvin = _value("CANtrans-T", "accuracy")
    wire = 1e3 * _value("LINARIX-LM0", "accuracy") * _value("LINARIX-LM0", "span")
    worth = {unit: _worth(bench, torque, kelvin) for unit, bench in benches.items()}
    return Chapter(
        "The bench: motor, controller, battery and instruments",
        (
            "The paper names its parts and gives no accuracies. They stand in the catalogue by name, with what is "
            "known "
            "of them; no equation uses them. On the simulated bench the truth is known exactly and the drive's report "
            "has steps and noise alone. With the accuracies below a real bench would have these errors beside: a "
            f"thermometer off by {kelvin:g} K costs the balance "
            f"{both({u: by['thermometer_mm'] for u, by in worth.items()})} "
            f"a cycle at high load, a torque off by {torque:.1f} N m "
            f"{both({u: by['torque_mm'] for u, by in worth.items()})}. The draw wire that was to be the truth is "
            f"itself "
            f"good to {wire:.1f} mm: errors as small as the table's at light load it cannot show.",
        ),
        {"instruments_are_worth_mm": worth | {"draw_wire": wire}},
        grids=(_grid(),),
    )


def _value(name: str, key: str) -> float:
    """A value of a catalogue entry [SI]."""
    entry = catalogue.find("", name)
    declared = declaration(PARTS[entry.kind].model_fields[key])
    return float(declared.read(catalogue.read(entry)[0][key], from_file=True)) if declared else float("nan")


def _worth(bench: Bench, torque: float, kelvin: float) -> dict[str, float]:
    """What instruments that are off add to the balance's error of a cycle at high load [mm]."""
    run = simulate(bench.unit, bench.cycle(bench.loads["high"]))

    def final(add: Callable[[xarray.Dataset], xarray.Dataset] | None) -> float:
        return bench.track(run, bench.sensors["balance"], add=add).lifted_mm(bench.unit.lift_sign)

    exact = final(None)
    return {
        "thermometer_mm": abs(final(partial(warmer, by=kelvin)) - exact),
        "torque_mm": abs(final(partial(_stronger, by=bench.unit.lift_sign * torque)) - exact),
    }


def _stronger(log: xarray.Dataset, by: float) -> xarray.Dataset:
    """A log whose torques read higher by some newton metres."""
    changed = log.copy()
    changed["motor_torque"] = log["motor_torque"] + by
    return changed


def _grid() -> Grid:
    rows: list[tuple[str, ...]] = []
    for name in _BENCH:
        entry = catalogue.find("", name)
        values, sources = catalogue.read(entry)
        part = f"{entry.kind} {entry.name}"
        rows += [(part, key.replace("_", " "), _shown(value), sources[key]) for key, value in values.items()]
    return Grid("Parts around the hydraulics", ("part", "value", "is", "where from"), tuple(rows))


def _shown(value: Any) -> str:
    return value if isinstance(value, str) else figure(float(value), 3)
