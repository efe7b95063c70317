"""What it does: speed, load and temperature over time, the run that follows, and what a drive reports of it."""

from ramsight.duty.drive_report import DriveReport, Magnets, report
from ramsight.duty.lift_lower import lift_lower
from ramsight.duty.profile import Duty, Profile
from ramsight.duty.reading_report import LinkReport
from ramsight.duty.simulate import simulate

__all__ = ["DriveReport", "Duty", "LinkReport", "Magnets", "Profile", "lift_lower", "report", "simulate"]
