"""Some work with an installed package, without extras, from an empty folder."""

from __future__ import annotations

import pathlib
import subprocess
import sys
import tempfile

import ramsight

ALLOWED = 2e-3  # m


def verb(*words: str) -> tuple[int, str]:
    """Exit code and output of a command."""
    done = subprocess.run([sys.executable, "-I", "-m", "ramsight", *words], capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


def main() -> None:
    """Simulate, track, describe; what needs an extra says which."""
    if "site-packages" not in ramsight.__file__:
        sys.exit(f"{ramsight.__file__} is not the installed package")
    boom = ramsight.build("mining-loader", "boom")
    run = ramsight.simulate(boom, load="441 kN", start="120 mm")
    error = ramsight.track(boom, ramsight.drive_report(run), "120 mm", run).attrs["error_largest"]
    if not error < ALLOWED:
        sys.exit(f"the track is {error} m off")
    with tempfile.TemporaryDirectory() as folder:
        machine = str(pathlib.Path(folder) / "lift.toml")
        for words in (("new", machine, "--circuit", "ddh", "--unit", "lift", "--minimal"), ("check", machine)):
            code, said = verb(*words)
            if code:
                sys.exit(f"{' '.join(words)}: {said}")
        log = pathlib.Path(folder) / "log.parquet"
        log.write_bytes(b"PAR1")
        code, said = verb("track", "mining-loader", str(log), "--unit", "boom")
        if code != 2 or 'pip install "ramsight[logs]"' not in said:
            sys.exit(f"a missing extra is not named: {said}")
    print(f"ramsight {ramsight.__version__} works here: a simulated track is within {1e3 * error:.2f} mm")


main()
