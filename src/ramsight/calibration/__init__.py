"""Sensors made to measure: tables from simulated sweeps, kept by their content, and as files."""

from ramsight.calibration.cached import calibrated
from ramsight.calibration.movement import calibrate
from ramsight.calibration.sensor_file import SensorFileError, load, save
from ramsight.calibration.sensors import sensor_for

__all__ = ["SensorFileError", "calibrate", "calibrated", "load", "save", "sensor_for"]
