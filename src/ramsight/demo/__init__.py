"""The demonstration that ships with the package: a loader's boom at work that is not its data sheet, and its log.

The log is that of an independent simulator (Hopsan 2.24): six minutes of moves and loads, the pumps' leakage 1.15 and
their displacement 0.996 of the data sheet's, friction 1.3, oil of 1.0 GPa where the data sheet states 1.2. The truth is
every fifth sample of that simulator's.
"""

from __future__ import annotations

from pathlib import Path

MACHINE, UNIT = "mining-loader", "boom"
LOG, POSITION = (Path(__file__).parent / name for name in ("workday.csv.gz", "workday_truth.csv.gz"))
AS_BUILT = {"leak": 1.15, "displacement": 0.996}
"""What the sensor is to learn of the machine, over its data sheet."""
