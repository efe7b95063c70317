"""Drive logs in and out, and the truth beside them where a test rig has it.

A drive log says what a motor drive knows: speed, torque and oil temperature, and reference switches if
there are any. `read_drive_log` reads that and nothing else, so that a position in the same file cannot reach
a sensor; `read_truth` reads the position, to judge the sensor by afterwards.
"""

from ramsight.logs.drive import read_drive_log, write_drive_log
from ramsight.logs.truth import read_truth

__all__ = ["read_drive_log", "read_truth", "write_drive_log"]
