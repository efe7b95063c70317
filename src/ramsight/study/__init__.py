"""How good a sensor is: its error against the truth."""

from ramsight.study.errors import ComparisonError, PositionErrors, first_stop_contact, position_errors

__all__ = ["ComparisonError", "PositionErrors", "first_stop_contact", "position_errors"]
