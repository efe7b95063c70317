"""What the paper leaves open, and what each of it is worth in millimetres."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ramsight import simulate
from ramsight.plant.ddh import DdhUnit
from ramsight.plant.pump import Pump
from ramsight.plant.steady import derive
from ramsight.sensor.table import table
from reproduction.bench import Bench, small_table
from reproduction.chapter import Chapter, Grid, Statement, Verdict
from reproduction.choices import LOADS
from reproduction.cycles import LIMITS_MM
from reproduction.words import both, figure, slashed

STATED = {"boom": {"light": 129e3, "high": 441e3}, "bucket": {"light": 48e3, "high": 162e3}}
"""The paper's loads at a quarter and at "about three quarters" of the maximum [N], [P]."""
TOLERANCE = 0.02
"""Of volumetric and hydromechanical efficiency [1], as the catalogue's sources have it: the paper's curves are lost."""


def open_points(benches: dict[str, Bench]) -> Chapter:
    """Loads, ramps and efficiencies that are not in the paper."""
    loads = {unit: _loads(bench, unit) for unit, bench in benches.items()}
    shares = {unit: _with_shares(bench) for unit, bench in benches.items()}
    corners = {unit: _corners(bench) for unit, bench in benches.items()}
    return Chapter(
        "What the paper leaves open, and what it is worth",
        (*_text(loads, shares), _tolerance_text(corners)),
        {
            "loads": loads,
            "table_error_with_loads_as_shares_mm": shares,
            "table_error_within_tolerances_mm": corners,
        },
        (_quarters(loads, shares), _interval(corners)),
        grids=(_loads_grid(loads, shares),),
    )


def _loads(bench: Bench, unit: str) -> dict[str, float]:
    """Both readings of a unit's loads [kN, %]."""
    limit = derive(bench.unit).load_at_relief_after_friction / 1e3
    light, high = (STATED[unit][name] / 1e3 for name in ("light", "high"))
    return {
        "largest_by_a_quarter_kN": light / LOADS["light"],
        "largest_by_three_quarters_kN": high / LOADS["high"],
        "largest_at_relief_here_kN": limit,
        "light_percent_of_that": 100.0 * light / limit,
        "high_percent_of_that": 100.0 * high / limit,
    }


def _with_shares(bench: Bench) -> dict[str, float]:
    """The table's error of a cycle [mm] with loads that are shares of the largest."""
    limit = derive(bench.unit).load_at_relief_after_friction
    found = {}
    for name, share in LOADS.items():
        run = simulate(bench.unit, bench.cycle(share * limit))
        found[name] = bench.track(run, bench.sensors["table"]).largest_mm
    return found


def _corners(bench: Bench) -> dict[str, float]:
    """Least and largest error of the table at high load [mm] over the corners of the efficiencies' tolerances."""
    both_ways = (-TOLERANCE, TOLERANCE)
    ends = [(a, b) for a in both_ways for b in both_ways]
    by_volumetric = [_error(bench, _with_efficiencies(bench.unit, one, (0.0, 0.0))) for one in ends]
    by_all = [
        _error(bench, _with_efficiencies(bench.unit, (one, one), (mechanical, mechanical)))
        for one in both_ways
        for mechanical in both_ways
    ]
    return {
        "volumetric_least": min(by_volumetric),
        "volumetric_largest": max(by_volumetric),
        "both_least": min(by_all),
        "both_largest": max(by_all),
    }


def _with_efficiencies(unit: DdhUnit, volumetric: tuple[float, float], mechanical: tuple[float, float]) -> DdhUnit:
    """A unit whose pumps A and B have other efficiencies, by these differences."""
    more = {"pump_a": (volumetric[0], mechanical[0]), "pump_b": (volumetric[1], mechanical[1])}

    def change(part: Any) -> Any:
        if not isinstance(part, Pump):
            return part
        by = more[part.name]
        return replace(
            part,
            volumetric_efficiency=part.volumetric_efficiency + by[0],
            hydromechanical_efficiency=part.hydromechanical_efficiency + by[1],
        )

    return unit.mapped(change)


def _error(bench: Bench, unit: DdhUnit) -> float:
    """Error of one cycle at high load [mm] of a unit with its own table."""
    run = simulate(unit, bench.cycle(bench.loads["high"], of=unit))
    return replace(bench, unit=unit).track(run, table(small_table(unit))).largest_mm


def _text(loads: dict[str, dict[str, float]], shares: dict[str, dict[str, float]]) -> tuple[str, ...]:
    quarter, most = (
        {u: by[f"largest_by_{name}_kN"] for u, by in loads.items()} for name in ("a_quarter", "three_quarters")
    )
    high = {unit: by["high_percent_of_that"] for unit, by in loads.items()}
    return (
        "Loads. The paper's figures carry loads in kN and call them ¼ and about ¾ of the largest. Both cannot be: by "
        f"the quarter the largest load is {both(quarter, 0, 'kN')}, by the three quarters "
        f"{both(most, 0, 'kN')}. With the relief valves that are taken here the stated high load is "
        f"{both(high, 0, '%')} of it. The report uses the stated forces. With a quarter, a half and three "
        "quarters of the largest the table's errors of a cycle are "
        + " and ".join(f"{slashed(by.values())} mm ({unit})" for unit, by in shares.items())
        + ".",
        "Ramps. Their length is not in the paper, and the errors are in proportion to it; the chapter on ramps says "
        "what is fitted and what is predicted.",
    )


def _tolerance_text(corners: dict[str, dict[str, float]]) -> str:
    def of(name: str) -> str:
        return " and ".join(
            f"{figure(by[f'{name}_least'])} to {figure(by[f'{name}_largest'])} mm ({unit})"
            for unit, by in corners.items()
        )

    return (
        "Efficiencies. The pumps' nominal efficiencies are guesses, and the catalogue gives them ± 0.02. By the "
        f"volumetric ones alone, both pumps of a unit, the table's error at high load is {of('volumetric')}. With the "
        f"hydromechanical ones {of('both')}. No figure of this report that depends on leakage is better known than "
        "that."
    )


def _quarters(loads: dict[str, dict[str, float]], shares: dict[str, dict[str, float]]) -> Statement:
    off = max(by["largest_by_three_quarters_kN"] / by["largest_by_a_quarter_kN"] for by in loads.values()) - 1.0
    high = {unit: by["high"] for unit, by in shares.items()}
    return Statement(
        "Section 3",
        "The loads are ¼ and about ¾ of the largest that the relief valves allow: 129 and 441 kN, 48 and 162 kN.",
        f"The forces contradict the shares by {100 * off:.0f} %, whatever the largest load is. With real three "
        f"quarters the table errs by {both(high)}.",
        Verdict.CONTRADICTED if off > 0.05 else Verdict.REPRODUCED,
    )


def _interval(corners: dict[str, dict[str, float]]) -> Statement:
    inside = all(by["both_least"] <= LIMITS_MM[u] <= 1.2 * by["both_largest"] for u, by in corners.items())
    spans = " and ".join(
        f"{figure(by['both_least'])} to {figure(by['both_largest'])} mm ({unit})" for unit, by in corners.items()
    )
    return Statement(
        "Table 2, Fig. 3",
        "The errors of 5 and 10 mm belong to pumps with the nominal efficiencies of the data sheet.",
        f"These are lost. Within ± {TOLERANCE:g} of those taken here the table errs by {spans}, with the fitted ramps.",
        Verdict.of(inside, fitted=True),
    )


def _loads_grid(loads: dict[str, dict[str, float]], shares: dict[str, dict[str, float]]) -> Grid:
    head = (
        "unit",
        "largest by ¼ [kN]",
        "largest by ¾ [kN]",
        "at relief here [kN]",
        "stated high load [% of that]",
        "error with ¼ / ½ / ¾ of that [mm]",
    )
    rows = tuple(
        (
            unit,
            *(figure(by[f"largest_{key}_kN"]) for key in ("by_a_quarter", "by_three_quarters", "at_relief_here")),
            figure(by["high_percent_of_that"]),
            slashed(shares[unit].values()),
        )
        for unit, by in loads.items()
    )
    return Grid("The two readings of the loads", head, rows)
