"""Where the piston of a hydraulic cylinder is, without a position sensor.

Everything that `dir(ramsight)` lists is imported when it is asked for first. Quantities are SI numbers, or text with a
unit: ``load="441 kN"``, ``start="120 mm"``.

Example:
    >>> import ramsight
    >>> boom = ramsight.build("mining-loader", unit="boom")
    >>> run = ramsight.simulate(boom, load="441 kN", oil_temperature="40 degC")
    >>> track = ramsight.track(boom, ramsight.drive_report(run), start="158 mm", truth=run)
    >>> track.attrs["error_largest"] < 1e-3  # m
    True
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ramsight.api.machines import build as build
    from ramsight.api.machines import catalogue as catalogue
    from ramsight.api.machines import load_machine as load_machine

__version__ = "0.1.0.dev0"
