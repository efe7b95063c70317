"""Studies of a machine: the data sheet of an axis, and a commissioning judged."""
