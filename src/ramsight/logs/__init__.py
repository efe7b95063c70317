"""Drive logs in and out, and the truth beside them where a test rig has it.

A drive log states what a motor drive knows: speed, torque and oil temperature, and reference switches if there are any.
`read_log` reads that and nothing else, so that a position in the same file cannot reach a sensor; `open_log`
reads it piece by piece, however long it is. A channel map states which channels of a file are what. `read_truth` reads
the position, to judge the sensor by afterwards.
"""

from typing import TYPE_CHECKING

from ramsight.late import late

if TYPE_CHECKING:
    from ramsight.logs.channel_map import load_map
    from ramsight.logs.drive_log import read_log, write_log
    from ramsight.logs.mapped import ChannelMap
    from ramsight.logs.opening import open_log
    from ramsight.logs.truth import read_truth
else:
    __getattr__, __dir__ = late(__name__)

__all__ = ["ChannelMap", "load_map", "open_log", "read_log", "read_truth", "write_log"]
