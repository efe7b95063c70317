"""A log followed by a sensor: the track piece by piece, its statistics, and its errors against a true position."""

from typing import TYPE_CHECKING

from ramsight.late import late

if TYPE_CHECKING:
    from ramsight.tracking.track_errors import ComparisonError, PositionErrors, first_stop_contact, position_errors
else:
    __getattr__, __dir__ = late(__name__)

__all__ = ["ComparisonError", "PositionErrors", "first_stop_contact", "position_errors"]
