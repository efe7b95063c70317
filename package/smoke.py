"""Some work with an installed package, without extras, from an empty folder."""

from __future__ import annotations

import pathlib
import re
import subprocess
import sys
import tempfile

import ramsight

ALLOWED = 2e-3  # m
BOOM = ("mining-loader", "--unit", "boom")
EXTRAS = {
    ("track", "mining-loader", "log.parquet", "--unit", "boom"): "logs",
    ("track", "mining-loader", "log.csv", "--unit", "boom", "--figure", "track.png"): "figures",
    ("track", "mining-loader", "log.csv", "--unit", "boom", "--out", "track.nc"): "datasets",
    ("identify", "mining-loader", "log.csv", "--truth", "truth.csv", "--unit", "boom"): "identify",
    ("datasheet", *BOOM, "--out", "sheet"): "study",
    ("studio", "--no-show"): "studio",
}
"""Commands that need an extra, and which."""


def verb(folder: str, *words: str) -> tuple[int, str]:
    """Exit code and output of a command in a folder."""
    command = [sys.executable, "-I", "-m", "ramsight", *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder)
    return done.returncode, done.stdout + done.stderr


def work(folder: str) -> float:
    """Describe, simulate, track, export; the largest error of the track [mm]."""
    said = ""
    for words in (
        ("new", "lift.toml", "--circuit", "ddh", "--unit", "lift", "--minimal"),
        ("check", "lift.toml"),
        ("simulate", *BOOM, "--load", "441 kN", "--start", "120 mm", "--log", "log.csv", "--truth", "truth.csv"),
        ("export", "parameters", *BOOM, "--out", "boom.h"),
        ("track", "mining-loader", "log.csv", "--unit", "boom", "--start", "120 mm", "--truth", "truth.csv", "--out",
         "track.csv"),
    ):  # fmt: skip
        code, said = verb(folder, *words)
        if code:
            sys.exit(f"{' '.join(words)}: {said}")
    found = re.search(r"error against the truth: largest ([\d.]+) mm", said)
    if found is None or not (pathlib.Path(folder) / "track.csv").is_file():
        sys.exit(f"the track has no error, or was not written: {said}")
    return float(found[1])


def main() -> None:
    """Simulate, track, describe; what needs an extra says which, in one line."""
    if "site-packages" not in ramsight.__file__:
        sys.exit(f"{ramsight.__file__} is not the installed package")
    sensor = ramsight.sensor_for("mining-loader", unit="boom")
    sensor.start(position="120 mm")
    sensor.step(time=0.0, motor_speed=0.0, motor_torque=0.0, oil_temperature=313.15)
    with tempfile.TemporaryDirectory() as folder:
        error = 1e-3 * work(folder)
        if not error < ALLOWED:
            sys.exit(f"the track is {error} m off")
        (pathlib.Path(folder) / "log.parquet").write_bytes(b"PAR1")
        for words, extra in EXTRAS.items():
            code, said = verb(folder, *words)
            lines = [line for line in said.splitlines() if not line.endswith(" s so far")]  # of a busy machine
            if code != 2 or len(lines) != 1 or f"ramsight[{extra}]" not in lines[0]:
                sys.exit(f"{' '.join(words)}: a missing extra is not named in one line: {said}")
    print(f"ramsight {ramsight.__version__} works here: a simulated track is within {1e3 * error:.2f} mm")


main()
