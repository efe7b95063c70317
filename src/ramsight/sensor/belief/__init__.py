"""Hypotheses of position, machine and ends: filters, measurements, births."""
