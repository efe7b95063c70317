"""Exported C against Python over a million samples, with and without faults; adds its figures to results/bench.json.

python benchmarks/exported.py [--days 28] [--out results/bench.json]
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path

import numpy as np
from bench_file import keep
from exported_run import CompiledSensor

from ramsight import machine
from ramsight.deploy.c_folder import write_sensor
from ramsight.deploy.c_sensor import inputs_of, sensor_source
from ramsight.deploy.compiler import find_compiler, version
from ramsight.deploy.golden import faulty_day
from ramsight.engine.recursion import replay
from ramsight.plant.as_built import AsBuilt
from ramsight.plant.ddh import build_ddh
from ramsight.sensor.kalman import kalman

sys.path.append(str(Path(__file__).parents[1] / "evaluation"))
import work_days

DAY = 360.0  # s
EVERY = 40.0  # s; a round of faults
APART = 1e-3  # m; a day with a larger difference counts as one on which both went different ways


def days_of(unit, count):
    """Days of machines that are not their data sheet: the study's, and as many with faults in them."""
    names = ("time", "motor_speed", "motor_torque", "oil_temperature")
    for seed in range(count):
        day = work_days.drawn(unit, seed)
        yield np.column_stack([*(day.log[n].values for n in names), np.full(day.log.sizes["time"], np.nan)]), day.start
        random = np.random.default_rng(seed)
        real = AsBuilt(
            leak=random.uniform(0.75, 1.25),
            displacement=random.uniform(0.995, 1.005),
            stiffness=random.uniform(0.6, 1.4),
            friction=random.uniform(0.6, 1.4),
        )
        yield faulty_day(unit, duration=DAY, every=EVERY, seed=seed, real=real.apply(unit))


def agreement(days):
    """Largest difference of the position [m], other statuses and samples, by build."""
    compiler = find_compiler()
    found = {"export_samples": 0, "export_compiler": version(compiler)}
    builds = {
        "double": {},
        "float": {"single": True},
        "double_fma": {"options": ("-march=native", "-ffp-contract=fast")},
    }
    for name in ("boom", "bucket"):
        unit = build_ddh(name, machine.load_machine("mining-loader").unit(name))
        sensor = kalman(unit)
        source = sensor_source(sensor, unit, f"ramsight_{name}", "mining-loader", single=False)
        compiled = {key: CompiledSensor(source, sensor, compiler, **more) for key, more in builds.items()}
        for number, (rows, start) in enumerate(days_of(unit, days)):
            found["export_days"] = found.get("export_days", 0) + 1
            sensor.start(start)
            state = np.array([sensor.state[k] for k in sensor.recursion.state])
            said = replay(sensor.recursion, inputs_of(rows), sensor.parameters, state)
            found["export_samples"] += len(rows)
            for key, one in compiled.items():
                other = one.track(rows, start)
                worst, flips = f"export_{key}_error_m", f"export_{key}_other_statuses"
                apart = float(np.abs(other[:, 0] - said[:, 0]).max())
                found[worst] = max(found.get(worst, 0.0), apart)
                if number % 2 == 0:  # a day without faults
                    without = f"export_{key}_error_without_faults_m"
                    found[without] = max(found.get(without, 0.0), apart)
                days_apart = f"export_{key}_days_apart"
                found[days_apart] = found.get(days_apart, 0) + int(apart > APART)
                found[flips] = found.get(flips, 0) + int((other[:, 4] != said[:, 4]).sum())
    return found


def footprints():
    """Bytes and time of a step, by build."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        done = write_sensor(machine.load_machine("mining-loader"), "boom", Path(folder) / "boom", measure=True)
    for f in done.footprints:
        key = f"export_{f.precision}_{f.optimised.removeprefix('-')}"
        found[key] = {
            "code_bytes": f.code,
            "stack_bytes": f.stack,
            "state_bytes": f.state,
            "saved_bytes": f.saved,
            "step_ns": round(1e9 * f.step),
        }
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--days", type=int, default=28, help="with faults and without, of each unit")
    parser.add_argument("--out", type=Path, default=Path("results/bench.json"))
    options = parser.parse_args()
    new = {**agreement(options.days), **footprints()}
    keep({k: float(f"{v:.4g}") if isinstance(v, float) else v for k, v in new.items()}, options.out)
    print(json.dumps(new, indent=1))


if __name__ == "__main__":
    main()
