"""The mining loader as a machine of 4 t: the paper's units, and forces that its relief valves allow."""

import numpy as np
import pytest

from ramsight import machine
from ramsight.duty.linked_duty import simulate_linked
from ramsight.duty.loading import loading_cycle
from ramsight.plant.linkage import angles, holding_forces, joints, tip
from ramsight.plant.linked import build_linked
from ramsight.plant.steady import derive

SMALL, LARGE = machine.load_machine("mining-loader-4t"), machine.load_machine("mining-loader")
LOADER = build_linked(SMALL)
STROKES = {"boom": 0.7, "bucket": 0.5}


def holding(payload, places, tip_force=(0.0, 0.0)):
    """Loads of boom and bucket [N], positive where the unit lifts."""
    forces = holding_forces(LOADER.mechanism, joints(LOADER.mechanism, places), payload, tip_force)
    return forces * [unit.lift_sign for unit in LOADER.units]


def test_its_units_are_the_mining_loaders():
    assert SMALL.units == LARGE.units
    assert SMALL.linkage.cylinders == LARGE.linkage.cylinders


def test_carrying_it_stays_within_its_relief_valves_wherever_it_stands():
    rated = LOADER.mechanism.rated_payload
    assert 3000.0 < rated < 4200.0
    carrying = np.array([[x, y] for x in np.linspace(0.0, 0.7, 15) for y in np.linspace(0.0, 0.25, 6)])
    largest = holding(rated, carrying).max(axis=0)
    allowed = np.array([derive(unit).load_at_relief_after_friction for unit in LOADER.units])
    assert (largest < 0.6 * allowed).all()
    paper = np.array([SMALL.unit(name).load.loads["medium"] for name in STROKES])
    assert largest == pytest.approx(paper, rel=0.05)  # the paper's half loads


def test_breaking_out_takes_the_papers_high_load():
    down = [[0.0, 0.25]]
    force = 65e3
    bucket = holding(0.0, down, (0.0, -force))[0, 1]
    assert bucket == pytest.approx(SMALL.unit("bucket").load.loads["high"], rel=0.02)


def test_it_digs_and_keeps_its_bucket_level():
    level = np.column_stack([np.linspace(0.0, 0.7, 9), np.full(9, 0.25)])
    at = joints(LOADER.mechanism, level)
    assert np.ptp(angles(LOADER.mechanism, at)["bucket"]) < 1e-9
    assert 0.0 <= tip(LOADER.mechanism, at)[0, 1] < 0.1  # the lip is on the ground


def test_its_loading_cycle_stays_below_the_relief_pressure():
    run = simulate_linked(LOADER, loading_cycle(LOADER))
    assert abs(run.attrs["energy_residual"]) < 1e-5
    for unit in LOADER.units:
        relief = unit.held_side.relief.setting + unit.tank_pressure
        assert run[f"{unit.name}_pressure_{unit.held}"].values.max() < 0.6 * relief
        assert run[f"{unit.name}_relief_{unit.held}_flow"].values.max() == 0.0
