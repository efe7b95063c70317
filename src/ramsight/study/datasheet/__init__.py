"""What an axis will achieve: machines drawn from tolerances, simulated and tracked; the sensor's data sheet and error budget."""
