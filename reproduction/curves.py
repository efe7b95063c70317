"""Figs 9 and 10: movement per motor revolution over torque."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ramsight.calibration.pump_map_figure import MM_PER_REVOLUTION, draw_movement
from ramsight.sensor.table import MovementTable
from ramsight.units import FREEZING
from reproduction.bench import Bench
from reproduction.chapter import Chapter, Picture, Statement, Verdict

_KEPT = 0.9  # share of the relief torque up to which a curve is without relief flow
_STEEP = 10.0  # the drop at relief counts as steep when so many times steeper than before


def movements(benches: dict[str, Bench]) -> Chapter:
    """Chapter on Figs 9 and 10: movement per revolution against torque."""
    shapes = {name: _shape(bench.movement) for name, bench in benches.items()}
    pictures = tuple(
        Picture(
            f"{figure}_{name}_movement",
            f"{name.capitalize()} movement per motor revolution over motor torque at oil temperatures from 20 to 70 "
            f"°C, up to the relief valve's opening (the paper's Fig. {int(figure[3:])}).",
            partial(draw_movement, movement=bench.movement),
            (7.2, 4.2),
        )
        for figure, (name, bench) in zip(("fig09", "fig10"), benches.items(), strict=True)
    )
    both = list(shapes.values())
    slopes = {(d, n): s[f"{d}_slope_mm_per_rev_per_nm"]["40"] for n, s in shapes.items() for d in ("lift", "lower")}
    spread = {
        n: (s["lift_slope_mm_per_rev_per_nm"]["20"], s["lift_slope_mm_per_rev_per_nm"]["70"]) for n, s in shapes.items()
    }
    return Chapter(
        "Movement per motor revolution (Figs 9 and 10)",
        (
            "The table is made as the paper made it: each unit is simulated at a constant 1500 rpm with loads from "
            "1 kN to above the relief valve's opening, and the movement per motor revolution is noted over the "
            "motor torque.",
        ),
        {"movement": shapes},
        (
            Statement(
                "Figs 9, 10",
                "Increasing load and torque causes less movement per revolution during lifting, and vice versa for "
                "lowering.",
                "At 40 °C per 10 N m: boom lift {:+.1f} %, lower {:+.1f} %; "
                "bucket lift {:+.1f} %, lower {:+.1f} %.".format(
                    *(
                        1000 * slopes[d, n] / shapes[n]["unloaded_mm_per_rev"]
                        for n in ("boom", "bucket")
                        for d in ("lift", "lower")
                    )
                ),
                Verdict.of(all(s["lift_falls"] and s["lower_rises"] for s in both)),
            ),
            Statement(
                "Figs 9, 10",
                "At higher temperatures the movement ratio is lower (lifting), because of more leakage.",
                f"The boom's lift falls by {-spread['boom'][0]:.4f} mm/rev per N m at 20 °C and by "
                f"{-spread['boom'][1]:.4f} at 70 °C; the bucket's by {-spread['bucket'][0]:.4f} and "
                f"{-spread['bucket'][1]:.4f}. Lowering rises likewise.",
                Verdict.of(all(s["hotter_is_stronger"] for s in both)),
            ),
            Statement(
                "Figs 9, 10",
                "The rapid drop at high torque in the lifting graph is caused by reaching the relief limit.",
                f"The drop begins at {both[0]['relief_torque_nm']:.1f} N m (boom) and "
                f"{both[1]['relief_torque_nm']:.1f} N m (bucket), where the simulated relief valve opens; it is "
                f"{both[0]['steeper_at_relief']:.0f} and {both[1]['steeper_at_relief']:.0f} times steeper than "
                "before.",
                Verdict.of(all(s["steeper_at_relief"] > _STEEP for s in both)),
            ),
            Statement(
                "Figs 9, 10",
                "The bucket motor torque is reverse to the boom.",
                "Torque while lifting at 40 °C: boom {:+.0f} to {:+.0f} N m, bucket {:+.0f} to {:+.0f} N m.".format(
                    *(t for s in both for t in s["lift_torque_range_nm"])
                ),
                Verdict.of(both[0]["lift_torque_range_nm"][1] > 0.0 > both[1]["lift_torque_range_nm"][1]),
            ),
        ),
        pictures,
    )


def _shape(movement: MovementTable) -> dict[str, Any]:
    """What can be said of a table's curves; torque is taken in the direction that lifts."""
    celsius = [f"{t - FREEZING:.0f}" for t in movement.temperature]
    order = np.argsort(movement.lift_sign * movement.lift_torque)
    torque = movement.lift_sign * movement.lift_torque[order]
    lift = MM_PER_REVOLUTION * movement.lift[:, order]
    clear = torque < _KEPT * movement.relief_torque
    lower_order = np.argsort(movement.lift_sign * movement.lower_torque)
    lower_torque = movement.lift_sign * movement.lower_torque[lower_order]
    lower = MM_PER_REVOLUTION * movement.lower[:, lower_order]
    below = lower_torque < _KEPT * lower_torque[-1]
    lift_slope = np.array([np.polyfit(torque[clear], row[clear], 1)[0] for row in lift])
    lower_slope = np.array([np.polyfit(lower_torque[below], row[below], 1)[0] for row in lower])
    drop = np.array([np.min(np.diff(row) / np.diff(torque)) for row in lift])
    found = movement.lift_sign * np.array([torque[0], torque[-1]])
    return {
        "lift_falls": bool((np.diff(lift[:, clear], axis=1) < 0.0).all()),
        "lower_rises": bool((np.diff(lower[:, below], axis=1) > 0.0).all()),
        "hotter_is_stronger": bool((np.diff(lift_slope) < 0.0).all() and (np.diff(lower_slope) > 0.0).all()),
        "lift_slope_mm_per_rev_per_nm": dict(zip(celsius, lift_slope.tolist(), strict=True)),
        "lower_slope_mm_per_rev_per_nm": dict(zip(celsius, lower_slope.tolist(), strict=True)),
        "unloaded_mm_per_rev": float(lift[0, 0]),
        "steeper_at_relief": float((drop / lift_slope).min()),
        "relief_torque_nm": float(movement.lift_sign * movement.relief_torque),
        "lift_torque_range_nm": sorted(found.tolist(), key=abs),
    }
