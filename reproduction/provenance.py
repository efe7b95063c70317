"""Tables 1 and 2 of the paper as they are taken here, and where every cell comes from."""

from __future__ import annotations

import math

from ramsight.machine.description import Machine
from ramsight.plant.steady import derive
from ramsight.units import RPM
from reproduction.bench import Bench
from reproduction.chapter import Chapter, Grid, Statement, Verdict
from reproduction.choices import UNITS, direct_driven
from reproduction.words import figure

_FRICTION = {"breakaway_friction": "static friction", "coulomb_friction": "Coulomb friction"}
_UNKNOWN = "not described"


def provenance(benches: dict[str, Bench]) -> Chapter:
    """Chapter on where the numbers of the paper's Tables 1 and 2 come from."""
    described = benches[UNITS[0]].machine
    ratios = {unit: derive(bench.unit) for unit, bench in benches.items()}
    mismatch = {unit: 100.0 * of.mismatch for unit, of in ratios.items()}
    return Chapter(
        "The machine: the paper's Tables 1 and 2",
        (
            "Most numbers of both tables are lost in the text of the paper. Each cell says where it comes from: [P] "
            "stated in the paper, [D] derived from what it states, [M] remembered from a data sheet and unverified, "
            "[G] guessed inside a plausible range, [S] from elsewhere. Of a data sheet at hand, change the machine's "
            "description, or give the value with --set, and redo the study.",
            _nominal(described),
        ),
        {"flow_ratio_less_area_ratio_percent": mismatch},
        (
            Statement(
                "Section 2",
                "The units' flows are in a ratio as close as possible to that of the cylinders' areas.",
                "Geared flow ratio and area ratio: "
                + ", ".join(f"{of.geared_flow_ratio:.3f} and {of.area_ratio:.3f} ({u})" for u, of in ratios.items())
                + ". The boom's belt ratio is the paper's; the bores are derived with this sentence, so that it is no "
                "independent test.",
                Verdict.of(max(abs(value) for value in mismatch.values()) < 2.0, fitted=True),
            ),
        ),
        grids=(_cylinders(described, benches), *(_pumps(described, name) for name in UNITS)),
    )


def _nominal(described: Machine) -> str:
    """Oil and nominal points, which the paper states."""
    unit = direct_driven(described, UNITS[0])
    oil, pump = unit.oil, unit.pump_a
    return (
        f"The oil has {1e6 * oil.viscosity_40c:.0f} mm²/s at 40 °C and {oil.density:.0f} kg/m³, kept constant [P]. The "
        f"nominal point of eqs 8 and 10 is {pump.nominal_speed / RPM:.0f} rpm, {pump.nominal_pressure / 1e5:.0f} bar, "
        f"{1e6 * pump.nominal_viscosity:.0f} mm²/s and {pump.nominal_density:.0f} kg/m³, the no-load torque "
        f"{pump.no_load_torque:g} N m for each block [P]."
    )


def _cylinders(described: Machine, benches: dict[str, Bench]) -> Grid:
    """Table 1, the cylinders."""
    rows: list[list[str]] = [[name] for name in ("stroke [mm]", "A-side area [mm²]", "B-side area [mm²]", "area ratio")]
    rows += [[f"{text} [N]"] for text in _FRICTION.values()]
    rows.append(["viscous friction [N/(m/s)]"])
    for name, bench in benches.items():
        spec = direct_driven(described, name).cylinder
        path = f"units.{name}.cylinder"
        cells = [
            (f"{1e3 * spec.stroke:.0f}", f"{path}.stroke"),
            (f"{1e6 * spec.area_a:.0f}", f"{path}.bore"),
            (f"{1e6 * spec.area_b:.0f}", f"{path}.rod"),
            (figure(derive(bench.unit).area_ratio, 3), f"{path}.rod"),
            *((f"{spec.number * getattr(spec, key):.0f}", f"{path}.{key}") for key in _FRICTION),
            (f"{spec.number * spec.viscous_friction:.0f}", f"{path}.viscous_friction"),
        ]
        for row, (value, where) in zip(rows, cells, strict=True):
            row += [value, described.source_of(where) or _UNKNOWN]
    head = ("parameter", "boom, both cylinders", "where from", "bucket", "where from")
    return Grid("Table 1: the cylinders", head, tuple(tuple(row) for row in rows))


def _pumps(described: Machine, name: str) -> Grid:
    """Table 2 of one unit."""
    unit = direct_driven(described, name)
    texts = (
        "pump",
        "total displacement [cm³/rev]",
        "largest circuit pressure [bar]",
        "volumetric efficiency at 250 bar, 1450 rpm",
        "hydromechanical efficiency at 250 bar, 1450 rpm",
        "highest speed [rpm]",
        "gear ratio, motor to pump",
        "flow ratio B to A",
    )
    rows: list[list[str]] = [[text] for text in texts]
    ratio = unit.pump_b.geared_displacement / unit.pump_a.geared_displacement
    for side, pump in (("pump_a", unit.pump_a), ("pump_b", unit.pump_b)):
        path = f"units.{name}.{side}"
        cells = [
            (f"{pump.model or 'described'}, {pump.chambers} x {pump.blocks}", f"{path}.model"),
            (figure(2e6 * math.pi * pump.displacement_per_rad), f"{path}.displacement"),
            (f"{max(unit.relief_settings) / 1e5:.0f}", f"units.{name}.relief_valve.setting"),
            (figure(pump.volumetric_efficiency, 3), f"{path}.volumetric_efficiency"),
            (figure(pump.hydromechanical_efficiency, 3), f"{path}.hydromechanical_efficiency"),
            (f"{pump.max_speed / RPM:.0f}", f"{path}.max_speed"),
            (figure(pump.belt, 4), f"{path}.belt"),
            (figure(ratio, 3), f"{path}.belt"),
        ]
        for row, (value, where) in zip(rows, cells, strict=True):
            row += [value, described.source_of(where) or _UNKNOWN]
    head = ("parameter", "A-side", "where from", "B-side", "where from")
    return Grid(f"Table 2: the pumps of the {name}", head, tuple(tuple(row) for row in rows))
