"""A log followed by a sensor: the track piece by piece, its statistics, and its errors against a true position."""

from ramsight.tracking.position_errors import ComparisonError, PositionErrors, first_stop_contact, position_errors

__all__ = ["ComparisonError", "PositionErrors", "first_stop_contact", "position_errors"]
