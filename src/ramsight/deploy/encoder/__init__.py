"""A virtual position sensor in the place of a real one: a linear encoder of CiA 406 on a CANopen bus.

`Encoder` is the whole of it, without a bus; `serve` (ramsight.deploy.encoder.runner) puts it on one.
"""

from ramsight.deploy.encoder.assembly import encoder_for
from ramsight.deploy.encoder.encoder import Encoder, Settings
from ramsight.deploy.encoder.frame import Frame
from ramsight.deploy.encoder.listening import Listener, drive_map
from ramsight.deploy.encoder.parameters import ParameterFile
from ramsight.deploy.encoder.saving import Persistence

__all__ = ["Encoder", "Frame", "Listener", "ParameterFile", "Persistence", "Settings", "drive_map", "encoder_for"]
