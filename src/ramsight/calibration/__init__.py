"""Sensors made to measure: tables from simulated sweeps."""
