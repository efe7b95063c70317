"""Whether exported C, of doubles and of floats, keeps every covariance positive semi-definite under hostile samples.

`python fuzz/covariance.py 1000` takes so many runs of 20 000 samples in either precision. Half of the samples come
from a machine that moves, rests and presses on its ends, half from none.
"""

from __future__ import annotations

import ctypes
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness import READ, WRONG, Rng, Section

from ramsight.deploy.compiler import find_compiler, library

CASES, SAMPLES = 200, 20_000
MARGIN = {"double": 1e-12, "float": 1e-5}
"""By how much an eigenvalue of a correlation matrix may be below 0: some dozen roundings of its entries."""

_DRIVER = """
#include <math.h>
#include "ramsight_boom.h"
#define QUANTITIES %d
#define HYPOTHESES %d
#define ENTRIES (QUANTITIES * (QUANTITIES + 1) / 2)

static const ramsight_boom *here;
static unsigned long long seed;

static double uniform(void) {
  seed ^= seed << 13; seed ^= seed >> 7; seed ^= seed << 17;
  return (double)(seed >> 11) * 0x1p-53;
}
static double normal(void) { return uniform() + uniform() + uniform() + uniform() - 2.0; } /* nearly, times 0.58 */
static void read_entries(double *all) {
%s
}

/* Whether an eigenvalue of a correlation matrix is below minus a margin: whether the covariance with variances that are
   larger by the margin has a pivot that is not positive. Scaling rows and columns changes no sign of a pivot. */
int negative(const double *all, double margin) {
  double c[QUANTITIES][QUANTITIES];
  int k = 0;
  for (int i = 0; i < QUANTITIES; i++) {
    c[i][i] = all[k++] * (1.0 + margin);
    for (int j = i + 1; j < QUANTITIES; j++) c[j][i] = all[k++];
  }
  for (int j = 0; j < QUANTITIES; j++) {
    const double pivot = c[j][j];
    const int exact = all[j * QUANTITIES - j * (j - 1) / 2] == 0.0; /* a quantity that is known has no covariances */
    if (!(pivot > 0.0) && !(exact && pivot == 0.0)) return 1;
    for (int i = j + 1; i < QUANTITIES; i++) {
      if (exact) {
        if (c[i][j] != 0.0) return 1;
        continue;
      }
      const double factor = c[i][j] / pivot;
      for (int k = j + 1; k <= i; k++) c[i][k] -= factor * c[k][j];
    }
  }
  return 0;
}

/* Hostile samples; how often a covariance was none. The worst margin [1] and its sample go into `worst`. */
long hostile(unsigned long long begun, long count, double margin, double *worst) {
  static ramsight_boom sensor;
  ramsight_boom_inputs in;
  ramsight_boom_outputs out;
  double speed = 0.0, torque = 20.0, wanted = 0.0, load = 20.0, time = 0.0, left = 0.0, ends = 60.0;
  long wrong = 0;
  int kind = 0;
  seed = begun * 2654435761u + 88172645463325252ull;
  ramsight_boom_init(&sensor);
  here = &sensor;
  if (uniform() < 0.7) {
    const double std = pow(10.0, -5.0 + 4.0 * uniform());
    ramsight_boom_start(&sensor, (ramsight_boom_real)uniform(), (ramsight_boom_real)std);
  }
  for (long k = 0; k < count; k++) {
    if ((left -= 0.02) <= 0.0) {
      left = 0.1 + 6.0 * uniform() * uniform();
      kind = (int)(12.0 * uniform());
      wanted = kind < 3 ? 0.0 : (uniform() < 0.5 ? -1.0 : 1.0) * 400.0 * uniform();
      if (uniform() < 0.2) load = 60.0 * uniform() - 10.0;
      ends = 40.0 + 60.0 * uniform();
    }
    const double most = 30.0;
    speed += fmax(-most, fmin(most, wanted - speed));
    torque += 0.5 * (load + 0.01 * speed - torque);
    if (kind == 0) torque *= 0.9; /* a valve holds */
    if (kind == 4 || kind == 5) { /* an end */
      speed = wanted > 0.0 ? 3.0 : -3.0;
      torque = wanted > 0.0 ? ends : -ends;
    }
    time += 0.02;
    if (kind == 6) time += 0.02 * (normal() * 0.5 + (uniform() < 0.01 ? 50.0 * uniform() : 0.0));
    in.time = time;
    in.motor_speed = (ramsight_boom_real)speed;
    in.motor_torque = (ramsight_boom_real)(torque + 0.5 * normal());
    in.oil_temperature = (ramsight_boom_real)(313.15 + 20.0 * sin(1e-3 * time));
    if (kind == 7) in.motor_torque = (ramsight_boom_real)(200.0 * normal());
    if (kind == 8 && uniform() < 0.1) in.motor_speed = (ramsight_boom_real)(1000.0 * normal());
    if (kind == 9 && uniform() < 0.2) {
      const double odd[] = {NAN, INFINITY, -INFINITY, 0.0, 1e30, -1e30, 1e-30, 300.0};
      const double one = odd[(int)(8.0 * uniform())];
      switch ((int)(4.0 * uniform())) {
        case 0: in.time = one; break;
        case 1: in.motor_speed = (ramsight_boom_real)one; break;
        case 2: in.motor_torque = (ramsight_boom_real)one; break;
        default: in.oil_temperature = (ramsight_boom_real)one;
      }
    }
    if (kind == 10 && k > 0 && uniform() < 0.1) {
      const double place = uniform() < 0.7 ? (double)out.position + 3e-3 * normal() : uniform();
      ramsight_boom_reference(&sensor, (ramsight_boom_real)place);
    }
    if (uniform() < 1e-5) ramsight_boom_start(&sensor, (ramsight_boom_real)uniform(), (ramsight_boom_real)1e-3);
    ramsight_boom_step(&sensor, &in, &out);
    if (out.status == RAMSIGHT_BOOM_STATE_INVALID) { /* it says itself that it has to be restarted */
      ramsight_boom_init(&sensor);
      worst[2] += 1.0;
      continue;
    }
    double every[HYPOTHESES * ENTRIES];
    read_entries(every);
    for (int h = 0; h < HYPOTHESES; h++) {
      const double *all = every + h * ENTRIES;
      if (!negative(all, worst[0])) continue;
      while (worst[0] < 0.5 && negative(all, worst[0])) worst[0] *= 1.5;
      worst[1] = (double)k;
    }
    wrong += worst[0] > margin;
  }
  return wrong;
}
"""


@dataclass
class Prepared:
    """What the cases share: the sensor with its samples, by precision."""

    built: dict[str, Any]


def prepare(folder: Path, *, optimised: bool = True) -> Prepared:
    """Compile the boom's sensor in either precision, for speed or at once."""
    from ramsight.deploy.c_sensor import sensor_source
    from ramsight.deploy.c_step import field_of
    from ramsight.machine import load_machine
    from ramsight.plant.ddh import build_ddh
    from ramsight.sensor.kalman import kalman

    unit = build_ddh("boom", load_machine("mining-loader").unit("boom"))
    sensor, built = kalman(unit), {}
    names = [name for name in sensor.state if name.startswith("hypotheses") and ".covariance[" in name]
    kinds = len({name.partition(".")[0] for name in names})
    quantities = sum(name.startswith("hypotheses[0]") and _is_variance(name) for name in names)
    reads = "\n".join(f"  all[{k}] = (double)here->{field_of(name)};" for k, name in enumerate(names))
    driver = _DRIVER % (quantities, kinds, reads)
    for precision in MARGIN:
        source = sensor_source(sensor, unit, "ramsight_boom", "mining-loader", single=precision == "float")
        target = folder / f"covariance_{precision}.so"
        files = {name: text for name, text in source.files.items() if not name.endswith("_test.c")}
        library(find_compiler() or "", {**files, "driver.c": driver}, target, "-std=c99", "-O2" if optimised else "-O0")
        compiled = ctypes.CDLL(str(target))
        compiled.hostile.restype = ctypes.c_long
        built[precision] = compiled
    return Prepared(built)


def _is_variance(name: str) -> bool:
    one, _, other = name.partition("[covariance")[0].rpartition("[")[2].rstrip("]").partition(",")
    return one == other


def tried(prepared: Prepared, precision: str, seed: int, samples: int = SAMPLES) -> tuple[float, int]:
    """The smallest margin with which no eigenvalue was negative, and how often the sensor called its state invalid."""
    worst = (ctypes.c_double * 3)(1e-15, 0.0, 0.0)
    prepared.built[precision].hostile(
        ctypes.c_ulonglong(seed), ctypes.c_long(samples), ctypes.c_double(MARGIN[precision]), worst
    )
    return float(worst[0]), int(worst[2])


def _check(prepared: Prepared, rng: Rng, _: Path) -> tuple[str, str]:
    seed = int(rng.integers(1, 1 << 40))
    for precision, margin in MARGIN.items():
        worst, _ = tried(prepared, precision, seed)
        if worst > margin:
            return WRONG, f"{precision}, seed {seed}: an eigenvalue of -{worst:.1e}"
    return READ, ""


def main(runs: int) -> None:
    """Print the worst margin of so many runs in either precision."""
    with tempfile.TemporaryDirectory() as folder:
        prepared = prepare(Path(folder))
        for precision, margin in MARGIN.items():
            found = [tried(prepared, precision, seed) for seed in range(1, runs + 1)]
            beyond, invalid = sum(one > margin for one, _ in found), sum(one for _, one in found)
            said = f"{runs * SAMPLES:.1e} samples, worst -{max(found)[0]:.1e}, {beyond} runs beyond {margin:g}"
            print(f"{precision}: {said}, state invalid {invalid} times")


SECTIONS = [Section("covariance", CASES, prepare, _check)] if find_compiler() else []

if __name__ == "__main__":
    main(int(sys.argv[1]))
