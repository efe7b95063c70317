"""A typed program: a type checker knows what each function takes and gives (mypy --strict examples/typed.py)."""

from __future__ import annotations

import xarray

import ramsight


def worst_error(machine: str, unit: str, leak: float) -> float:
    """The largest error of a sensor that knows the data sheet, on a machine that leaks otherwise [m]."""
    built = ramsight.build(machine, unit)
    made = ramsight.AsBuilt(leak=leak)
    run: xarray.Dataset = ramsight.simulate(built, load="441 kN", start="120 mm", as_built=made)
    track = ramsight.track(built, ramsight.drive_report(run), "120 mm", run)
    return float(track.attrs["error_largest"])


def status_of(sample: ramsight.Estimate) -> str:
    """What a sample is worth, in words."""
    status: ramsight.Status = sample.status
    return status.text


print(f"{1e3 * worst_error('mining-loader', 'boom', 1.2):.1f} mm")
