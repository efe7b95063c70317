"""The flow of a pump as a law that is linear in what wears, and how sure a fit of it is.

    Q = D w - L dp/mu - G sign(dp) sqrt|dp|

Displacement; laminar leakage through gaps (eqs 3, 9, 10: Hagen-Poiseuille, so it goes with 1/viscosity, the dynamic
one mu = nu rho); leakage through worn edges (orifice, whatever the viscosity): the plant's pump as columns of a linear
fit, which the real-oil study makes to a real one.

Source of the orifice's part: W. E. Wilson, Trans. ASME 71 (1949) 115, and Schloesser's loss models, which split slip
into a laminar and a turbulent part.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from ramsight.arrays import Array
from ramsight.calibration.identify_balance import sandwich, student
from ramsight.plant.valve import orifice_flow


def root(pressure_rise: ArrayLike) -> Array:
    """sign(dp) sqrt|dp| as the plant's orifices have it, linear near zero [sqrt(Pa)].

    Args:
        pressure_rise: [Pa], any shape.

    Example:
        >>> round(float(root(-4e6)))
        -2000
    """
    rise = np.asarray(pressure_rise, dtype=np.float64)
    return np.asarray(np.array(orifice_flow(1.0, ca.DM(rise.ravel()))).reshape(rise.shape))


def columns(speed: ArrayLike, pressure_rise: ArrayLike, viscosity: ArrayLike) -> Array:
    """What D, L and G are multiplied by: w, -dp/mu, -root(dp).

    Args:
        speed: of the pump [rad/s].
        pressure_rise: from inlet to outlet [Pa].
        viscosity: dynamic [Pa s].

    Returns:
        Shape (..., 3).
    """
    w, rise, mu = np.broadcast_arrays(*(np.asarray(v, dtype=np.float64) for v in (speed, pressure_rise, viscosity)))
    return np.stack([w, -rise / mu, -root(rise)], axis=-1)


@dataclass(frozen=True)
class Fit:
    """A linear fit and how sure it is."""

    value: Array  # coefficients, shape (k,)
    covariance: Array  # of them, clusters taken as independent, shape (k, k)
    freedom: float  # degrees of freedom of the intervals: clusters less coefficients
    residual: Array  # of every row, shape (n,)

    @property
    def half_width(self) -> Array:
        """Half of the 95 % interval of each coefficient, shape (k,)."""
        return student(self.freedom) * np.sqrt(np.diag(self.covariance))


def fit(design: ArrayLike, response: ArrayLike, clusters: ArrayLike) -> Fit:
    """Least squares whose uncertainty allows that rows of a cluster err together.

    Args:
        design: shape (n, k).
        response: shape (n,).
        clusters: which rows belong together (a cycle, a move), shape (n,).

    Raises:
        ValueError: fewer clusters than coefficients and one more, or coefficients that the rows cannot tell apart.

    Source: the sandwich of Liang and Zeger, Biometrika 73 (1986) 13, with the usual small-sample factor.

    Example:
        >>> x = np.linspace(0.0, 1.0, 60)
        >>> line = fit(np.column_stack([np.ones(60), x]), 2.0 + 3.0 * x, np.arange(60) // 5)
        >>> line.value.round(6).tolist()
        [2.0, 3.0]
    """
    rows, y = np.asarray(design, dtype=np.float64), np.asarray(response, dtype=np.float64)
    groups = np.unique(np.asarray(clusters), return_inverse=True)[1]
    count, k = int(groups.max(initial=-1)) + 1, rows.shape[1]
    if count < k + 1:
        raise ValueError(f"{count} clusters cannot give {k} coefficients and their uncertainty")
    scale = np.sqrt(np.mean(rows**2, axis=0))
    scaled = rows / scale
    value, _, rank, _ = np.linalg.lstsq(scaled, y, rcond=1e-10)
    if rank < k:
        raise ValueError("the rows cannot tell the coefficients apart")
    residual = y - scaled @ value
    covariance = sandwich(scaled, residual, groups) / np.outer(scale, scale)
    return Fit(value / scale, covariance, float(count - k), residual)
