"""The flow law on a real pump with real oil: a test bench of ZeMA, 1103 load cycles (UCI, doi 10.24432/C5F31Q).

The bench has no shaft speed and no motor torque, no cylinder and no position. Its electric motor is an asynchronous
one on the mains, whose speed drops with its power; so w = w0 (1 - s P), and with it Q = a - b P - L dp/mu - G root(dp).
"""

from __future__ import annotations

import gzip
from dataclasses import dataclass
from pathlib import Path

import casadi as ca
import numpy as np
from flow_law import Fit, columns, fit
from numpy.typing import NDArray

from ramsight.plant.oil import T40, T100, kinematic_viscosity, thermal_density, walther_constants

Array = NDArray[np.float64]

FILES = ("EPS1", "PS1", "FS1", "TS1", "profile")
PLATEAUS = ((13, 18), (22, 28), (32, 38), (42, 48), (53, 59))  # s of a cycle in which the load's pressure stands still
RELIEF = 180e5  # Pa; above it the bench's relief valve lets oil pass beside the flow meter
COLD, HOT = 46.0, 54.0  # degC
GRADES = {"VG46": (46e-6, 6.8e-6), "VG32": (32e-6, 5.4e-6)}  # m2/s at 40 and 100 degC; the bench's is not documented
DENSITY, EXPANSION = 872.0, 7e-4  # kg/m3 at 15 degC, 1/K; a usual mineral oil


@dataclass(frozen=True)
class Bench:
    """Means over the plateaus, shape (cycles, plateaus), and the cycles' labels."""

    flow: Array
    pressure: Array
    power: Array
    celsius: Array
    leak: NDArray[np.int64]
    stable: NDArray[np.bool_]

    @property
    def open(self) -> NDArray[np.bool_]:
        """Plateaus in which all oil passes the flow meter."""
        return np.asarray(self.pressure < RELIEF)

    @property
    def mean_celsius(self) -> Array:
        """Of each cycle."""
        return np.asarray(self.celsius.mean(axis=1))


def read(folder: Path) -> Bench:
    """Read the data; `folder` holds EPS1.csv.gz and its kind."""
    raw = {}
    for name in FILES:
        with gzip.open(folder / f"{name}.csv.gz", "rt") as file:
            raw[name] = np.loadtxt(file, delimiter=",")

    def plateaus(name: str, factor: float = 1.0) -> Array:
        return factor * np.stack([raw[name][:, a:b].mean(axis=1) for a, b in PLATEAUS], axis=1)

    label = raw["profile"]
    return Bench(
        flow=plateaus("FS1", 1.0 / 60000.0),
        pressure=plateaus("PS1", 1e5),
        power=plateaus("EPS1"),
        celsius=plateaus("TS1"),
        leak=label[:, 2].astype(np.int64),
        stable=label[:, 4] == 0,
    )


def viscosity(celsius: Array, grade: str) -> Array:
    """Dynamic viscosity [Pa s] of a mineral oil of that grade."""
    low, high = GRADES[grade]
    kelvin = celsius.ravel() + 273.15
    nu = np.array(kinematic_viscosity(ca.DM(kelvin), *walther_constants(T40, low, T100, high))).ravel()
    return np.asarray((nu * thermal_density(kelvin, DENSITY, EXPANSION)).reshape(celsius.shape))


def design(bench: Bench, rows: NDArray[np.bool_], grade: str, orifice: bool = False, laminar: bool = True) -> Array:
    """Columns of displacement, slip, laminar leakage and orifice for some plateaus."""
    law = columns(1.0, bench.pressure[rows], viscosity(bench.celsius, grade)[rows])
    chosen = [law[:, 0], -bench.power[rows]] + [law[:, 1]] * laminar + [law[:, 2]] * orifice
    return np.stack(chosen, axis=-1)


def fitted(bench: Bench, rows: NDArray[np.bool_], grade: str, **terms: bool) -> Fit:
    """The law on some plateaus; a cycle is a cluster."""
    cycles = np.broadcast_to(np.arange(len(bench.leak))[:, None], rows.shape)
    return fit(design(bench, rows, grade, **terms), bench.flow[rows], cycles[rows])


def auc(healthier: Array, leakier: Array) -> float:
    """Chance that of two cycles the leakier one has the smaller flow residual."""
    return float((healthier[:, None] > leakier[None, :]).mean())


def study(folder: Path) -> dict[str, float]:
    """All figures that docs/reference/plant-accuracy.md quotes."""
    bench = read(folder)
    healthy = (bench.leak == 0) & bench.stable
    rows = bench.open & healthy[:, None]
    cold, hot = (rows & mask[:, None] for mask in (bench.mean_celsius <= COLD, bench.mean_celsius >= HOT))
    found: dict[str, float] = {"cycles": len(bench.leak), "healthy_cycles": int(healthy.sum())}

    law = fitted(bench, rows, "VG46")
    flow = bench.flow[rows]
    found["residual_percent"] = 100.0 * float((law.residual / flow).std())
    found["explained_percent"] = 100.0 * float(1.0 - law.residual.var() / flow.var())
    found["laminar_half_width_percent"] = 100.0 * float(law.half_width[2] / law.value[2])
    wide = fitted(bench, rows, "VG46", orifice=True)
    found["healthy_orifice"], found["healthy_orifice_half_width"] = float(wide.value[3]), float(wide.half_width[3])

    for key, grade, terms in (
        ("bias_percent", "VG46", {}),
        ("bias_vg32_percent", "VG32", {}),
        ("bias_with_orifice_percent", "VG46", {"orifice": True}),
        ("bias_without_leakage_percent", "VG46", {"laminar": False}),
    ):
        at = fitted(bench, cold, grade, **terms)
        predicted = design(bench, hot, grade, **terms) @ at.value
        found[key] = 100.0 * float(((bench.flow[hot] - predicted) / bench.flow[hot]).mean())
    found["cold_cycles"], found["hot_cycles"] = int(cold.any(axis=1).sum()), int(hot.any(axis=1).sum())

    # Every second cycle to fit, the others to judge.
    even = np.arange(len(bench.leak)) % 2 == 0
    half = fitted(bench, rows & even[:, None], "VG46")
    residual = np.full(bench.flow.shape, np.nan)
    residual[bench.open] = bench.flow[bench.open] - design(bench, bench.open, "VG46") @ half.value
    judged = ~even & bench.stable & bench.open.any(axis=1)
    mean = np.array([np.nanmean(r) if np.isfinite(r).any() else np.nan for r in residual])
    by_label = [mean[judged & (bench.leak == label)] for label in (0, 1, 2)]
    found["auc_0_1"], found["auc_1_2"] = auc(by_label[0], by_label[1]), auc(by_label[1], by_label[2])

    # Neighbouring cycles are much alike; so also fitted cold, and judged on all cycles that are warmer.
    law_cold = fitted(bench, cold, "VG46")
    residual_cold = np.full(bench.flow.shape, np.nan)
    residual_cold[bench.open] = bench.flow[bench.open] - design(bench, bench.open, "VG46") @ law_cold.value
    warm = (bench.mean_celsius > COLD) & bench.stable & bench.open.any(axis=1)
    means = np.nanmean(residual_cold[warm], axis=1)
    by_label = [means[bench.leak[warm] == label] for label in (0, 1, 2)]
    found["auc_0_1_warmer"], found["auc_1_2_warmer"] = auc(by_label[0], by_label[1]), auc(by_label[1], by_label[2])

    # What the labels add: more through gaps, or through an edge?
    for label in (1, 2):
        added = bench.open & ((bench.leak == label) & bench.stable)[:, None]
        cycles = np.broadcast_to(np.arange(len(bench.leak))[:, None], added.shape)[added]
        terms = columns(0.0, bench.pressure[added], viscosity(bench.celsius, "VG46")[added])[:, 1:]
        extra = fit(terms, residual[added], cycles)
        share = terms * extra.value
        found[f"label_{label}_orifice_share"] = float(share[:, 1].sum() / share.sum())
        found[f"label_{label}_orifice"] = float(extra.value[1])
        found[f"label_{label}_orifice_half_width"] = float(extra.half_width[1])
        found[f"label_{label}_percent"] = 100.0 * float(-(residual[added] / bench.flow[added]).mean())
    return found
