"""Sensors made to measure: tables from simulated sweeps, kept by their content, and as files."""
