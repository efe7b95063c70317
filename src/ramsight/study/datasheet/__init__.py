"""What an axis will achieve: machines drawn from tolerances, simulated, tracked; data sheet and error budget."""
