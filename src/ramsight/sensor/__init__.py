"""Where is it: virtual sensors that know only what a drive reports."""

from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import Estimate, VirtualSensor

__all__ = ["Estimate", "Status", "VirtualSensor"]
